# The stages of the detector local_irregularity; what they leave, rule detect chooses from.
from sid.detectors import local_irregularity

LOCAL = configuration.parameters_of(config, "local_irregularity")
PARTS = LOCAL.get("parts", "each")
CHOICE = ("parts", "num_points", "absolute_distance", "threshold_rel")


def local_settings(*names):
    """Some parameters of the detector, after its preset."""
    given = {key: value for key, value in LOCAL.items() if key not in CHOICE}
    try:
        parameters = local_irregularity.parameters_of(**given)
    except (TypeError, ValueError) as error:
        refuse(f"config: parameters.local_irregularity: {error}")
    return {name: getattr(parameters, name) for name in names}


rule fair:
    """The noise of a mesh, and the mesh without it."""
    input:
        mesh=rules.clean.output.mesh,
    output:
        vertices=f"{RESULTS}/{{mesh}}/local_irregularity/faired.npy",
        noise=f"{RESULTS}/{{mesh}}/local_irregularity/noise.json",
    log:
        f"{RESULTS}/{{mesh}}/logs/fair.log",
    benchmark:
        f"{RESULTS}/{{mesh}}/logs/fair.tsv"
    resources:
        **needs("detect local_irregularity"),
    params:
        parameters=local_settings(
            "fairing_min", "fairing_max", "fairing_factor", "noise_floor"
        ),
        parts=PARTS,
        code=fingerprint("sid.detectors.local_irregularity"),
    message:
        "{wildcards.mesh}: noise and fairing"
    script:
        resolve("../scripts/fair.py")


rule local_saliency:
    """Diffused curvature of the faired mesh, and its saliency against what lies around."""
    input:
        mesh=rules.clean.output.mesh,
        faired=rules.fair.output.vertices,
    output:
        saliency=f"{RESULTS}/{{mesh}}/local_irregularity/saliency.npy",
        curvature=f"{RESULTS}/{{mesh}}/local_irregularity/curvature.npy",
        arc_saliency=f"{RESULTS}/{{mesh}}/local_irregularity/arc_saliency.npy",
    log:
        f"{RESULTS}/{{mesh}}/logs/local_saliency.log",
    benchmark:
        f"{RESULTS}/{{mesh}}/logs/local_saliency.tsv"
    resources:
        **needs("detect local_irregularity"),
    params:
        parameters=local_settings(
            "length",
            "competition_length",
            "competition_floor",
            "ceiling",
            "resolution",
        ),
        parts=PARTS,
        code=fingerprint("sid.detectors.local_irregularity"),
    message:
        "{wildcards.mesh}: local irregularity"
    script:
        resolve("../scripts/local_saliency.py")
