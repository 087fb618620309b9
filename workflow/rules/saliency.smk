rule curvature:
    """Smoothed Gaussian curvature."""
    input:
        mesh=rules.clean.output.mesh,
    output:
        f"{RESULTS}/{{mesh}}/curvature.npy",
    log:
        f"{RESULTS}/{{mesh}}/logs/curvature.log",
    resources:
        **needs("curvature"),
    params:
        estimator=setting("curvature", "estimator"),
        smoothing=setting("curvature", "smoothing"),
        code=fingerprint("sid.geometry.curvature"),
    message:
        "{wildcards.mesh}: Gaussian curvature"
    script:
        resolve("../scripts/curvature.py")


rule saliency:
    """The signature weighted by curvature."""
    input:
        signatures=rules.signature.output[0],
        curvature=rules.curvature.output[0],
    output:
        f"{RESULTS}/{{mesh}}/saliency.npy",
    log:
        f"{RESULTS}/{{mesh}}/logs/saliency.log",
    resources:
        **needs("saliency"),
    params:
        signature=setting("saliency", "signature"),
        time=setting("saliency", "time"),
        weight=setting("saliency", "weight"),
        sign=setting("saliency", "sign"),
        code=fingerprint("sid.detectors.sid"),
    message:
        "{wildcards.mesh}: saliency at t = {params.time}"
    script:
        resolve("../scripts/saliency.py")
