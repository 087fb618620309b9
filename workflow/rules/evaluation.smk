rule ground_truth:
    """What people marked, as consensus and each by themselves, and published detections."""
    input:
        mesh=rules.clean.output.mesh,
        marks=lambda wildcards: keep_existing(MESHES[wildcards.mesh]["marks"]),
    output:
        truth=f"{RESULTS}/{{mesh}}/evaluation/truth.csv",
        reference=f"{RESULTS}/{{mesh}}/evaluation/reference.csv",
    log:
        f"{RESULTS}/{{mesh}}/logs/ground_truth.log",
    resources:
        **needs("ground_truth"),
    params:
        marks=lambda wildcards: MESHES[wildcards.mesh]["marks"],
        content=lambda wildcards: judged_content(wildcards.mesh),
        root=lambda wildcards: NIST if is_model(wildcards.mesh) else None,
        datasets=setting("evaluation", "datasets"),
        n=setting("evaluation", "n"),
        sigma=setting("evaluation", "sigma"),
        geodesic=setting("evaluation", "geodesic"),
        code=fingerprint(
            "sid.evaluation.ground_truth",
            "sid.evaluation.nist",
            "sid.geodesic.bounded",
        ),
    message:
        "{wildcards.mesh}: ground truth"
    script:
        resolve("../scripts/ground_truth.py")


rule geodesics:
    """Geodesic distances around the points of the ground truth, for all that is scored against them."""
    input:
        mesh=rules.clean.output.mesh,
        truth=rules.ground_truth.output.truth,
    output:
        f"{RESULTS}/{{mesh}}/evaluation/geodesics.npz",
    log:
        f"{RESULTS}/{{mesh}}/logs/geodesics.log",
    benchmark:
        f"{RESULTS}/{{mesh}}/logs/geodesics.tsv"
    resources:
        **needs("evaluate"),
    params:
        radius=max([*configuration.radii(config), config["precision"]["radius"] or 0.0]),
        geodesic=setting("evaluation", "geodesic"),
        code=fingerprint("sid.geodesic.bounded"),
    message:
        "{wildcards.mesh}: geodesics around the ground truth"
    script:
        resolve("../scripts/geodesics.py")


rule evaluate:
    """Scores of every detector, published or run here, and of every person, on one mesh."""
    input:
        mesh=rules.clean.output.mesh,
        truth=rules.ground_truth.output.truth,
        reference=rules.ground_truth.output.reference,
        geodesics=rules.geodesics.output[0],
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
        radii=configuration.radii(config),
        repeated=setting("evaluation", "repeated"),
        code=fingerprint("sid.evaluation.scores"),
    message:
        "{wildcards.mesh}: scores"
    script:
        resolve("../scripts/evaluate.py")


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
    resources:
        **needs("table"),
    params:
        code=fingerprint("sid.evaluation.scores"),
    message:
        "summarise scores over the meshes with ground truth"
    script:
        resolve("../scripts/summarise.py")


rule precision:
    """Precision and recall of each detector on one mesh as the number of its points grows, and of people."""
    input:
        mesh=rules.clean.output.mesh,
        saliency=[stored_saliency(detector)["saliency"] for detector in RANKED],
        truth=rules.ground_truth.output.truth,
        reference=rules.ground_truth.output.reference,
        geodesics=rules.geodesics.output[0],
        points=rules.evaluate.input.points,
    output:
        f"{RESULTS}/{{mesh}}/evaluation/precision.csv",
    log:
        f"{RESULTS}/{{mesh}}/logs/precision.log",
    resources:
        **needs("evaluate"),
    params:
        detectors=setting("detectors"),
        ranked=RANKED,
        parameters={
            detector: configuration.parameters_of(config, detector)
            for detector in RANKED
        },
        radii=lambda wildcards: (
            configuration.radii(config)
            if config["precision"]["radius"] is None
            else [config["precision"]["radius"]]
        ),
        draws=setting("precision", "draws"),
        seed=setting("seed"),
        code=fingerprint("sid.evaluation.precision", "sid.detectors.maxima"),
    message:
        "{wildcards.mesh}: precision and recall"
    script:
        resolve("../scripts/precision.py")


rule summarise_precision:
    """Mean precision and recall over meshes."""
    input:
        expand(f"{RESULTS}/{{mesh}}/evaluation/precision.csv", mesh=WITH_TRUTH),
    output:
        curves=f"{RESULTS}/evaluation/precision.csv",
        equal_numbers=f"{RESULTS}/evaluation/equal_numbers.csv",
    log:
        f"{RESULTS}/logs/summarise_precision.log",
    localrule: True
    resources:
        **needs("table"),
    params:
        counts=setting("precision", "counts"),
        code=fingerprint("sid.evaluation.precision"),
    message:
        "mean precision and recall over the meshes with ground truth"
    script:
        resolve("../scripts/summarise_precision.py")


rule bootstrap:
    """Intervals of mean scores, and of differences to sid, by resampling meshes."""
    input:
        scores=rules.summarise.output.scores,
    output:
        f"{RESULTS}/evaluation/bootstrap.csv",
    log:
        f"{RESULTS}/logs/bootstrap.log",
    localrule: True
    resources:
        **needs("table"),
    params:
        resamples=setting("bootstrap", "resamples"),
        level=setting("bootstrap", "level"),
        seed=setting("seed"),
        code=fingerprint("sid.evaluation.bootstrap"),
    message:
        "bootstrap intervals"
    script:
        resolve("../scripts/bootstrap.py")
