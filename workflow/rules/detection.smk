rule detect:
    """Points by one of the detectors, in the numbering of the input file."""
    input:
        unpack(stage_of),
        mesh=rules.clean.output.mesh,
    output:
        f"{RESULTS}/{{mesh}}/points/{{detector}}.csv",
    log:
        f"{RESULTS}/{{mesh}}/logs/detect_{{detector}}.log",
    benchmark:
        f"{RESULTS}/{{mesh}}/logs/detect_{{detector}}.tsv"
    resources:
        **needs("detect"),
    params:
        parameters=lambda wildcards: configuration.parameters_of(
            config, wildcards.detector
        ),
        code=lambda wildcards: fingerprint(detectors.METHODS[wildcards.detector].module),
    message:
        "{wildcards.mesh}: points by {wildcards.detector}"
    script:
        resolve("../scripts/detect.py")
