rule perturb:
    """A disturbed copy of a mesh, with the map to the vertices of its input file."""
    input:
        mesh=f"{RESULTS}/{{original}}/mesh.ply",
    output:
        mesh=f"{RESULTS}/stability/{{original}}/{{kind}}-{{amount}}/mesh.ply",
    log:
        f"{RESULTS}/stability/{{original}}/{{kind}}-{{amount}}/logs/perturb.log",
    benchmark:
        f"{RESULTS}/stability/{{original}}/{{kind}}-{{amount}}/logs/perturb.tsv"
    wildcard_constraints:
        original="[^/]+",
        kind="|".join(KINDS),
        amount="[-+.e0-9]+",
    resources:
        **needs("evaluate"),
    params:
        seed=setting("seed"),
        code=fingerprint("sid.formats.mesh_file", "sid.evaluation.perturbation"),
    message:
        "{wildcards.original}: {wildcards.kind} {wildcards.amount}"
    script:
        resolve("../scripts/perturb.py")


rule repeatability:
    """How many points of each detector are found again on the copies of a mesh, and how many by chance."""
    input:
        mesh=lambda wildcards: f"{RESULTS}/{original(wildcards.mesh)}/mesh.ply",
        points=lambda wildcards: expand(
            f"{RESULTS}/{original(wildcards.mesh)}/points/{{detector}}.csv",
            detector=config["detectors"],
        ),
        copies=lambda wildcards: expand(
            f"{RESULTS}/stability/{wildcards.mesh}/{{copy}}/mesh.ply",
            copy=STABLE[wildcards.mesh],
        ),
        copied_points=lambda wildcards: expand(
            f"{RESULTS}/stability/{wildcards.mesh}/{{copy}}/points/{{detector}}.csv",
            copy=STABLE[wildcards.mesh],
            detector=config["detectors"],
        ),
    output:
        f"{RESULTS}/stability/{{mesh}}/repeatability.csv",
    log:
        f"{RESULTS}/stability/{{mesh}}/logs/repeatability.log",
    wildcard_constraints:
        mesh="[^/]+",
    resources:
        **needs("evaluate"),
    params:
        detectors=setting("detectors"),
        copies=lambda wildcards: STABLE[wildcards.mesh],
        radius=setting("stability", "radius"),
        draws=setting("stability", "draws"),
        seed=setting("seed"),
        geodesic=setting("evaluation", "geodesic"),
        code=fingerprint("sid.evaluation.stability"),
    message:
        "{wildcards.mesh}: repeatability of points"
    script:
        resolve("../scripts/repeatability.py")


rule summarise_repeatability:
    """Repeatability on all meshes in one tidy table."""
    input:
        expand(f"{RESULTS}/stability/{{mesh}}/repeatability.csv", mesh=STABLE),
    output:
        report(
            f"{RESULTS}/stability/repeatability.csv",
            caption="../report/stability.rst",
            category="Stability",
        ),
    log:
        f"{RESULTS}/logs/summarise_repeatability.log",
    localrule: True
    resources:
        **needs("table"),
    message:
        "summarise repeatability"
    script:
        resolve("../scripts/summarise_repeatability.py")


rule draw_stability:
    """Repeatability over the size of each disturbance."""
    input:
        rules.summarise_repeatability.output,
    output:
        report(
            f"{RESULTS}/figures/stability.svg",
            caption="../report/stability.rst",
            category="Stability",
            labels={"figure": "repeatability"},
        ),
    log:
        f"{RESULTS}/logs/draw_stability.log",
    localrule: True
    resources:
        **needs("draw"),
    params:
        radius=setting("stability", "radius"),
        code=fingerprint("sid.figures.curves"),
    message:
        "graphs of repeatability"
    script:
        resolve("../scripts/draw_stability.py")
