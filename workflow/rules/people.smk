# People as the measure: worth how many of them a detector is, and how each does against the others.

# models that people of set A marked who did not make the ground truth of set B
WITH_PANELS = [
    mesh
    for mesh in WITH_TRUTH
    if is_model(mesh)
    and all(
        (
            Path(NIST)
            / f"GROUND_TRUTH_{dataset}"
            / f"{Path(MESHES[mesh]['path']).stem}.mat"
        ).is_file()
        for dataset in "AB"
    )
]


rule panels:
    """Scores of panels of people of set A against the ground truth that others, set B, made."""
    input:
        mesh=rules.clean.output.mesh,
    output:
        panels=f"{RESULTS}/{{mesh}}/evaluation/panels.csv",
        crowd=f"{RESULTS}/{{mesh}}/evaluation/crowd.csv",
    log:
        f"{RESULTS}/{{mesh}}/logs/panels.log",
    benchmark:
        f"{RESULTS}/{{mesh}}/logs/panels.tsv"
    resources:
        **needs("evaluate"),
    params:
        root=NIST,
        content=lambda wildcards: judged_content(wildcards.mesh),
        n=setting("evaluation", "n"),
        sigma=setting("evaluation", "sigma"),
        radii=configuration.radii(config),
        geodesic=setting("evaluation", "geodesic"),
        sizes=setting("people", "sizes"),
        marks=setting("people", "marks"),
        most=setting("people", "panels"),
        seed=setting("seed"),
        code=fingerprint(
            "sid.evaluation.panels", "sid.evaluation.people", "sid.evaluation.nist"
        ),
    message:
        "{wildcards.mesh}: panels of people"
    script:
        resolve("../scripts/panels.py")


rule summarise_panels:
    """Mean IoU of panels of people, and worth how many people each detector is."""
    input:
        panels=expand(f"{RESULTS}/{{mesh}}/evaluation/panels.csv", mesh=WITH_PANELS),
        scores=rules.summarise.output.scores,
    output:
        report(
            f"{RESULTS}/evaluation/panels.csv",
            caption="../report/panels.rst",
            category="Scores",
        ),
    log:
        f"{RESULTS}/logs/summarise_panels.log",
    localrule: True
    resources:
        **needs("table"),
    params:
        resamples=setting("bootstrap", "resamples"),
        level=setting("bootstrap", "level"),
        seed=setting("seed"),
        code=fingerprint("sid.evaluation.panels"),
    message:
        "worth how many people each detector is"
    script:
        resolve("../scripts/summarise_panels.py")


rule draw_panels:
    """The curve of panels of people, with every detector on it."""
    input:
        rules.summarise_panels.output,
    output:
        report(
            f"{RESULTS}/figures/panels.svg",
            caption="../report/panels.rst",
            category="Scores",
            labels={"figure": "worth how many people"},
        ),
    log:
        f"{RESULTS}/logs/draw_panels.log",
    localrule: True
    resources:
        **needs("table"),
    params:
        level=setting("bootstrap", "level"),
        code=fingerprint("sid.figures.panels"),
    message:
        "graph of panels of people"
    script:
        resolve("../scripts/draw_panels.py")


rule people:
    """Scores of each person against the others, and of all detectors against the same truths."""
    input:
        mesh=rules.clean.output.mesh,
        truth=rules.ground_truth.output.truth,
        reference=rules.ground_truth.output.reference,
        points=rules.evaluate.input.points,
    output:
        f"{RESULTS}/{{mesh}}/evaluation/people.csv",
    log:
        f"{RESULTS}/{{mesh}}/logs/people.log",
    resources:
        **needs("evaluate"),
    params:
        detectors=setting("detectors"),
        n=setting("evaluation", "n"),
        sigma=setting("evaluation", "sigma"),
        radii=configuration.radii(config),
        geodesic=setting("evaluation", "geodesic"),
        code=fingerprint("sid.evaluation.people"),
    message:
        "{wildcards.mesh}: people against the others"
    script:
        resolve("../scripts/people.py")


rule summarise_people:
    """Means of the fair scores of people, and of detectors on the same truths, with intervals."""
    input:
        people=expand(f"{RESULTS}/{{mesh}}/evaluation/people.csv", mesh=WITH_TRUTH),
        scores=rules.summarise.output.scores,
        crowd=expand(f"{RESULTS}/{{mesh}}/evaluation/crowd.csv", mesh=WITH_PANELS),
    output:
        scores=f"{RESULTS}/evaluation/people_scores.csv",
        ranking=f"{RESULTS}/evaluation/people.csv",
        bootstrap=f"{RESULTS}/evaluation/people_bootstrap.csv",
        both=f"{RESULTS}/evaluation/people_both_ways.csv",
        intervals=f"{RESULTS}/evaluation/people_intervals.csv",
    log:
        f"{RESULTS}/logs/summarise_people.log",
    localrule: True
    resources:
        **needs("table"),
    params:
        resamples=setting("bootstrap", "resamples"),
        level=setting("bootstrap", "level"),
        seed=setting("seed"),
        code=fingerprint("sid.evaluation.people", "sid.evaluation.bootstrap"),
    message:
        "people against the others on the meshes with ground truth"
    script:
        resolve("../scripts/summarise_people.py")


rule draw_people:
    """People the benchmark's way and fairly, beside the detectors, over the tolerance."""
    input:
        rules.summarise_people.output.both,
    output:
        report(
            f"{RESULTS}/figures/people.svg",
            caption="../report/people.rst",
            category="Scores",
            labels={"figure": "people both ways"},
        ),
    log:
        f"{RESULTS}/logs/draw_people.log",
    localrule: True
    resources:
        **needs("draw"),
    params:
        code=fingerprint("sid.figures.curves"),
    message:
        "graphs of people, the benchmark's way and fairly"
    script:
        resolve("../scripts/draw_people.py")


rule descriptors:
    """Signatures at the points of a detector, for matching."""
    input:
        mesh=rules.clean.output.mesh,
        spectrum=rules.spectrum.output[0],
        irregularity=rules.irregularity.output[0],
        points=f"{RESULTS}/{{mesh}}/points/{{detector}}.csv",
    output:
        table=f"{RESULTS}/{{mesh}}/descriptors/{{detector}}.csv",
        arrays=directory(f"{RESULTS}/{{mesh}}/descriptors/{{detector}}.zarr"),
    log:
        f"{RESULTS}/{{mesh}}/logs/descriptors_{{detector}}.log",
    resources:
        **needs("signature"),
    params:
        times=configuration.times(config),
        code=fingerprint("sid.spectral.descriptors"),
    message:
        "{wildcards.mesh}: descriptors at the points of {wildcards.detector}"
    script:
        resolve("../scripts/descriptors.py")
