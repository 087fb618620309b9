# The files that each target of the workflow asks for.


def rules_points():
    return expand(
        f"{RESULTS}/{{mesh}}/points/{{detector}}.csv",
        mesh=MESHES,
        detector=config["detectors"],
    )


def rules_evaluation():
    names = ("scores", "summary", "ranking")
    return (
        expand(f"{RESULTS}/evaluation/{{name}}.csv", name=names) if WITH_TRUTH else []
    )


def rules_figures():
    pictures = expand(
        f"{RESULTS}/{{mesh}}/figures/{{name}}",
        mesh=SHOWN,
        name=("saliency.png", "spectrum.svg", "view.html"),
    )
    curves = (
        expand(
            f"{RESULTS}/figures/scores/{{name}}.svg",
            name=(*(m for m in WITH_TRUTH if m in SHOWN), "mean"),
        )
        if WITH_TRUTH
        else []
    )
    return pictures + curves


def rules_paper_figures():
    """Figures that are made on request: those of the paper, and with ground truth those it lacks."""
    pictures = [
        f"{RESULTS}/figures/eigenvectors/{PICTURED}.png",
        f"{RESULTS}/figures/scaling/{PICTURED}.svg",
    ]
    scored = (
        expand(
            f"{RESULTS}/figures/{{name}}",
            name=("gallery.png", "precision.svg", "bootstrap.svg", "people.svg"),
        )
        if WITH_TRUTH
        else []
    )
    panels = [f"{RESULTS}/figures/panels.svg"] if WITH_PANELS else []
    return rules_figures() + pictures + scored + panels


def rules_stability():
    return [
        f"{RESULTS}/stability/repeatability.csv",
        f"{RESULTS}/figures/stability.svg",
    ]
