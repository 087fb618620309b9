# The opening page of `snakemake --report`.


def shown_settings():
    """What decides the points and the scores, and no more: a change of it runs the overview again."""
    sections = [
        "clean",
        "assemble",
        "spectrum",
        "irregularity",
        "curvature",
        "saliency",
    ]
    scoring = ["evaluation"] if WITH_TRUTH else []
    return {section: config[section] for section in sections + scoring} | {
        detector: parameters_of(detector) for detector in config["detectors"]
    }


rule overview:
    """A page for readers who never saw the code: what was run, on what, with which settings, and what came out."""
    input:
        cleaning=expand(f"{RESULTS}/{{mesh}}/cleaning.json", mesh=MESHES),
        points=expand(
            f"{RESULTS}/{{mesh}}/points/{{detector}}.csv",
            mesh=MESHES,
            detector=config["detectors"],
        ),
        ranking=[rules.summarise.output.ranking] if WITH_TRUTH else [],
        scores=[rules.summarise.output.scores] if WITH_TRUTH else [],
    output:
        report(
            f"{RESULTS}/overview.html",
            caption="../report/overview.rst",
            category="Overview",
            labels={"page": "what was run, and what came out"},
        ),
    log:
        f"{RESULTS}/logs/overview.log",
    localrule: True
    resources:
        **needs("table"),
    params:
        # the folder is no reason to run again: it is part of the output's name
        results=lambda wildcards, output: str(Path(output[0]).parent),
        meshes=list(MESHES),
        detectors=setting("detectors"),
        settings=shown_settings(),
        refused=[list(map(str, line)) for line in REFUSED],
        simulated=config["meshes"] == "bundled",
        code=fingerprint("sid.figures.overview"),
    message:
        "overview of the run"
    script:
        resolve("../scripts/overview.py")
