# The opening page of `snakemake --report`.
from contextlib import suppress

from sid.figures.overview import overview_of_run
from sid.jobs import ending


def collect_settings():
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
        detector: configuration.parameters_of(config, detector)
        for detector in config["detectors"]
    }


def describe_run(failures=()):
    """What the overview tells beside the results."""
    return {
        "meshes": list(MESHES),
        "detectors": config["detectors"],
        "settings": collect_settings(),
        "failures": [dict(zip(ending.COLUMNS, map(str, row))) for row in failures],
        "simulated": config["meshes"] == "bundled",
        "scored": bool(WITH_TRUTH),
        **config["bootstrap"],
    }


def tell_failures():
    """Write the overview of a run that did not come to it, made to look old: the next run makes it again."""
    if not ACCOUNT.has_left_out("overview"):
        return
    path = Path(RESULTS, "overview.html")
    # of a full disk, which was said; the table may be missing, too
    with suppress(OSError, InputError):
        table = store.read_table(Path(RESULTS, "failures.csv"), ending.COLUMNS)
        failures = list(zip(*(table[name] for name in ending.COLUMNS)))
        with store.replacing(path) as part:
            part.write_text(
                overview_of_run(RESULTS, **describe_run(failures)), encoding="utf-8"
            )
        os.utime(path, (10**9, 10**9))  # 2001; a ZIP knows nothing before 1980


rule overview:
    """A page for readers who never saw the code: what was run, on what, with which settings, and what came out."""
    input:
        # a report after failures shows what there is
        lambda wildcards: [
            path
            for path in (
                *expand(f"{RESULTS}/{{mesh}}/cleaning.json", mesh=MESHES),
                *rules_points(),
                *([rules.summarise.output.ranking] if WITH_TRUTH else []),
                *([rules.summarise.output.scores] if WITH_TRUTH else []),
            )
            if not REPORTING or Path(path).exists()
        ],
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
        run=describe_run((name, ending.REFUSAL, reason) for name, reason in REFUSED),
        code=fingerprint("sid.figures.overview", "sid.evaluation.bootstrap"),
    message:
        "overview of the run"
    script:
        resolve("../scripts/overview.py")
