rule ground_truth:
    """What people marked, as consensus and each by themselves, and published detections."""
    input:
        mesh=rules.clean.output.mesh,
        marks=lambda wildcards: existing(MESHES[wildcards.mesh]["marks"]),
    output:
        truth=f"{RESULTS}/{{mesh}}/evaluation/truth.csv",
        reference=f"{RESULTS}/{{mesh}}/evaluation/reference.csv",
    log:
        f"{RESULTS}/{{mesh}}/logs/ground_truth.log",
    resources:
        **needs("ground_truth"),
    params:
        marks=lambda wildcards: MESHES[wildcards.mesh]["marks"],
        root=lambda wildcards: NIST if is_model(wildcards.mesh) else None,
        datasets=setting("evaluation", "datasets"),
        n=setting("evaluation", "n"),
        sigma=setting("evaluation", "sigma"),
        geodesic=setting("evaluation", "geodesic"),
        code=fingerprint("sid.groundtruth", "sid.nist", "sid.geodesic"),
    message:
        "{wildcards.mesh}: ground truth"
    script:
        "../scripts/ground_truth.py"


rule evaluate:
    """Scores of every detector, published or run here, and of every person, on one mesh."""
    input:
        mesh=rules.clean.output.mesh,
        truth=rules.ground_truth.output.truth,
        reference=rules.ground_truth.output.reference,
        points=expand(
            f"{RESULTS}/{{{{mesh}}}}/points/{{detector}}.csv",
            detector=config["detectors"],
        ),
    output:
        f"{RESULTS}/{{mesh}}/evaluation/scores.csv",
    log:
        f"{RESULTS}/{{mesh}}/logs/evaluate.log",
    resources:
        **needs("evaluate"),
    params:
        detectors=setting("detectors"),
        radii=radii(),
        geodesic=setting("evaluation", "geodesic"),
        repeated=setting("evaluation", "repeated"),
        code=fingerprint("sid.evaluation"),
    message:
        "{wildcards.mesh}: scores"
    script:
        "../scripts/evaluate.py"


rule summarise:
    """All scores in one tidy table, and their means over meshes."""
    input:
        expand(f"{RESULTS}/{{mesh}}/evaluation/scores.csv", mesh=WITH_TRUTH),
    output:
        scores=f"{RESULTS}/evaluation/scores.csv",
        summary=f"{RESULTS}/evaluation/summary.csv",
        ranking=report(
            f"{RESULTS}/evaluation/ranking.csv",
            caption="../report/ranking.rst",
            category="Scores",
        ),
    log:
        f"{RESULTS}/logs/summarise.log",
    localrule: True
    params:
        code=fingerprint("sid.evaluation"),
    message:
        "summarise scores of {WITH_TRUTH}"
    script:
        "../scripts/summarise.py"
