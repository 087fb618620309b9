ruleorder: select > detect


rule select:
    """Globally and locally salient points, in the numbering of the input file."""
    input:
        mesh=rules.clean.output.mesh,
        saliency=rules.saliency.output[0],
    output:
        f"{RESULTS}/{{mesh}}/points/sid.csv",
    log:
        f"{RESULTS}/{{mesh}}/logs/select.log",
    resources:
        **needs("select"),
    params:
        t_global=setting("selection", "t_global"),
        t_local=setting("selection", "t_local"),
        rings=setting("selection", "rings"),
        code=fingerprint("sid.detectors.maxima"),
    message:
        "{wildcards.mesh}: select points"
    script:
        "../scripts/select.py"


rule detect:
    """Points by another detector."""
    input:
        mesh=rules.clean.output.mesh,
        spectrum=rules.spectrum.output[0],
    output:
        f"{RESULTS}/{{mesh}}/points/{{detector}}.csv",
    log:
        f"{RESULTS}/{{mesh}}/logs/detect_{{detector}}.log",
    resources:
        **needs("detect"),
    params:
        parameters=lambda wildcards: config["parameters"].get(wildcards.detector, {}),
        code=lambda wildcards: fingerprint(detectors.MODULES[wildcards.detector]),
    message:
        "{wildcards.mesh}: points by {wildcards.detector}"
    script:
        "../scripts/detect.py"
