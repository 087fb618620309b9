rule draw_saliency:
    """A rendered picture of the saliency with the points."""
    input:
        mesh=rules.clean.output.mesh,
        saliency=rules.saliency.output[0],
        points=rules.select.output[0],
    output:
        report(
            f"{RESULTS}/{{mesh}}/figures/saliency.png",
            caption="../report/saliency.rst",
            category="Meshes",
            labels={"mesh": "{mesh}", "figure": "saliency and points"},
        ),
    log:
        f"{RESULTS}/{{mesh}}/logs/draw_saliency.log",
    params:
        views=setting("figures", "views"),
        pixels=setting("figures", "pixels"),
        up=setting("figures", "up"),
        code=fingerprint("sid.render"),
    message:
        "{wildcards.mesh}: picture of saliency and points"
    script:
        "../scripts/draw_saliency.py"


rule draw_spectrum:
    """Spectrum and irregularity of a mesh (Fig. 1 of the paper)."""
    input:
        irregularity=rules.irregularity.output[0],
    output:
        report(
            f"{RESULTS}/{{mesh}}/figures/spectrum.svg",
            caption="../report/spectrum.rst",
            category="Meshes",
            labels={"mesh": "{mesh}", "figure": "spectrum and irregularity"},
        ),
    log:
        f"{RESULTS}/{{mesh}}/logs/draw_spectrum.log",
    params:
        code=fingerprint("sid.plot"),
    message:
        "{wildcards.mesh}: plot of the spectrum"
    script:
        "../scripts/draw_spectrum.py"


rule draw_scores:
    """FNE, WME and FPE over the tolerance (Fig. 5 of the paper), of a mesh or on average."""
    input:
        scores=rules.summarise.output.scores,
    output:
        report(
            f"{RESULTS}/figures/scores/{{mesh}}.svg",
            caption="../report/scores.rst",
            category="Scores",
            labels={"mesh": "{mesh}", "figure": "FNE, WME, FPE"},
        ),
    log:
        f"{RESULTS}/logs/draw_scores_{{mesh}}.log",
    localrule: True
    params:
        code=fingerprint("sid.plot"),
    message:
        "{wildcards.mesh}: graphs of FNE, WME and FPE"
    script:
        "../scripts/draw_scores.py"
