rule draw_saliency:
    """A rendered picture of the saliency of the first detector that has one, with its points."""
    input:
        mesh=rules.clean.output.mesh,
        saliency=stored_saliency(DRAWN_DETECTOR)["saliency"],
        points=f"{RESULTS}/{{mesh}}/points/{DRAWN_DETECTOR}.csv",
    output:
        report(
            f"{RESULTS}/{{mesh}}/figures/saliency.png",
            caption="../report/saliency.rst",
            category="Meshes",
            labels={"mesh": "{mesh}", "figure": "saliency and points"},
        ),
    log:
        f"{RESULTS}/{{mesh}}/logs/draw_saliency.log",
    resources:
        **needs("draw"),
    params:
        views=setting("figures", "views"),
        pixels=setting("figures", "pixels"),
        up=setting("figures", "up"),
        detector=DRAWN_DETECTOR,
        code=fingerprint("sid.figures.renderings"),
    message:
        "{wildcards.mesh}: picture of saliency and points"
    script:
        resolve("../scripts/draw_saliency.py")


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
    resources:
        **needs("draw"),
    params:
        code=fingerprint("sid.figures.curves"),
    message:
        "{wildcards.mesh}: plot of the spectrum"
    script:
        resolve("../scripts/draw_spectrum.py")


rule draw_page:
    """The viewer's page of a mesh: fields, points, and where people marked it, scores at any tolerance."""
    input:
        mesh=rules.clean.output.mesh,
        curvature=rules.curvature.output[0],
        signatures=rules.signature.output[0],
        saliency=rules.saliency.output[0],
        points=expand(
            f"{RESULTS}/{{{{mesh}}}}/points/{{detector}}.csv",
            detector=config["detectors"],
        ),
        scored=lambda wildcards: (
            [
                *rules.ground_truth.output,
                *rules.geodesics.output,
                *rules.evaluate.output,
            ]
            if wildcards.mesh in WITH_TRUTH
            else []
        ),
    output:
        report(
            f"{RESULTS}/{{mesh}}/figures/view.html",
            caption="../report/view.rst",
            category="Meshes",
            labels={"mesh": "{mesh}", "figure": "viewer"},
        ),
    log:
        f"{RESULTS}/{{mesh}}/logs/draw_page.log",
    resources:
        **needs("draw"),
    params:
        up=setting("figures", "up"),
        code=fingerprint("sid.viewer.document"),
    message:
        "{wildcards.mesh}: page of the viewer"
    script:
        resolve("../scripts/draw_page.py")


rule draw_scores:
    """FNE, WME and FPE over the tolerance (Fig. 5 of the paper), of a mesh or on average."""
    input:
        scores=lambda wildcards: (
            rules.summarise.output.scores
            if wildcards.mesh == "mean"
            else rules.evaluate.output[0]
        ),
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
    resources:
        **needs("draw"),
    params:
        mesh=lambda wildcards: "" if wildcards.mesh == "mean" else wildcards.mesh,
        code=fingerprint("sid.figures.curves"),
    message:
        "{wildcards.mesh}: graphs of FNE, WME and FPE"
    script:
        resolve("../scripts/draw_scores.py")


rule draw_eigenvectors:
    """The first eigenvectors on a mesh (Fig. 2 of the paper)."""
    input:
        mesh=rules.clean.output.mesh,
        spectrum=rules.spectrum.output[0],
    output:
        report(
            f"{RESULTS}/figures/eigenvectors/{{mesh}}.png",
            caption="../report/eigenvectors.rst",
            category="Meshes",
            labels={"mesh": "{mesh}", "figure": "eigenvectors"},
        ),
    log:
        f"{RESULTS}/logs/draw_eigenvectors_{{mesh}}.log",
    resources:
        **needs("draw"),
    params:
        pixels=setting("figures", "pixels"),
        up=setting("figures", "up"),
        turn=lambda wildcards: turn(wildcards.mesh),
        code=fingerprint("sid.figures.renderings"),
    message:
        "{wildcards.mesh}: picture of eigenvectors"
    script:
        resolve("../scripts/draw_eigenvectors.py")


rule draw_scaling:
    """Signatures of two points on a mesh and on a scaled copy (Fig. 3 of the paper)."""
    input:
        mesh=rules.clean.output.mesh,
        saliency=rules.saliency.output[0],
        spectra=[
            f"{RESULTS}/{{mesh}}/spectrum.zarr",
            f"{RESULTS}/stability/{{mesh}}/scale-{config['figures']['scale']:g}/spectrum.zarr",
        ],
        irregularities=[
            f"{RESULTS}/{{mesh}}/irregularity.csv",
            f"{RESULTS}/stability/{{mesh}}/scale-{config['figures']['scale']:g}/irregularity.csv",
        ],
    output:
        report(
            f"{RESULTS}/figures/scaling/{{mesh}}.svg",
            caption="../report/scaling.rst",
            category="Meshes",
            labels={"mesh": "{mesh}", "figure": "scaling"},
        ),
    log:
        f"{RESULTS}/logs/draw_scaling_{{mesh}}.log",
    resources:
        **needs("draw"),
    params:
        scale=setting("figures", "scale"),
        times=configuration.times(config),
        up=setting("figures", "up"),
        turn=lambda wildcards: turn(wildcards.mesh),
        code=fingerprint("sid.figures.renderings", "sid.spectral.signature"),
    message:
        "{wildcards.mesh}: signatures at two scales"
    script:
        resolve("../scripts/draw_scaling.py")


rule draw_gallery:
    """Meshes by detectors, with their points (Fig. 4 of the paper)."""
    input:
        meshes=expand(f"{RESULTS}/{{mesh}}/mesh.ply", mesh=GALLERY),
        truths=expand(f"{RESULTS}/{{mesh}}/evaluation/truth.csv", mesh=GALLERY),
        references=expand(f"{RESULTS}/{{mesh}}/evaluation/reference.csv", mesh=GALLERY),
        points=expand(
            f"{RESULTS}/{{mesh}}/points/{{detector}}.csv",
            mesh=GALLERY,
            detector=config["detectors"],
        ),
    output:
        report(
            f"{RESULTS}/figures/gallery.png",
            caption="../report/gallery.rst",
            category="Scores",
            labels={"figure": "points of all detectors"},
        ),
    log:
        f"{RESULTS}/logs/draw_gallery.log",
    resources:
        **needs("draw"),
    params:
        meshes=GALLERY,
        detectors=setting("detectors"),
        pixels=setting("figures", "pixels"),
        up=setting("figures", "up"),
        turns=[turn(mesh) for mesh in GALLERY],
        code=fingerprint("sid.figures.renderings"),
    message:
        "picture of the points of all detectors on a few meshes"
    script:
        resolve("../scripts/draw_gallery.py")


rule draw_precision:
    """Precision against recall, and IoU at equal numbers of points."""
    input:
        rules.summarise_precision.output.curves,
    output:
        report(
            f"{RESULTS}/figures/precision.svg",
            caption="../report/precision.rst",
            category="Scores",
            labels={"figure": "precision and recall"},
        ),
    log:
        f"{RESULTS}/logs/draw_precision.log",
    localrule: True
    resources:
        **needs("draw"),
    params:
        radius=setting("precision", "radius"),
        code=fingerprint("sid.figures.curves"),
    message:
        "graphs of precision and recall"
    script:
        resolve("../scripts/draw_precision.py")


rule draw_bootstrap:
    """Mean scores and differences to sid with their intervals."""
    input:
        rules.bootstrap.output,
    output:
        report(
            f"{RESULTS}/figures/bootstrap.svg",
            caption="../report/bootstrap.rst",
            category="Scores",
            labels={"figure": "intervals of the ranking"},
        ),
    log:
        f"{RESULTS}/logs/draw_bootstrap.log",
    localrule: True
    resources:
        **needs("draw"),
    params:
        level=setting("bootstrap", "level"),
        code=fingerprint("sid.figures.curves"),
    message:
        "graphs of the ranking with intervals"
    script:
        resolve("../scripts/draw_bootstrap.py")
