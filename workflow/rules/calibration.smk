CALIBRATED_FIELDS = [
    ("iks", float(config["saliency"]["time"]), estimator, smoothing, sign)
    for estimator in config["calibration"]["estimators"]
    for smoothing in config["calibration"]["smoothing"]
    for sign in config["calibration"]["signs"]
]
DEFAULT_WEIGHT = (
    config["curvature"]["estimator"],
    config["curvature"]["smoothing"],
    config["saliency"]["sign"],
)
ABLATED_FIELDS = [
    (signature, time, estimator, smoothing, sign)
    for signature, all_times in (
        ("iks", configuration.times(config)),
        ("hks", configuration.times(config)),
        ("none", [0.0]),
    )
    for time in all_times
    for estimator, smoothing, sign in [
        *([("none", 0, "absolute")] if signature != "none" else []),
        DEFAULT_WEIGHT,
        *(
            (DEFAULT_WEIGHT[0], steps, DEFAULT_WEIGHT[2])
            for steps in config["calibration"]["smoothing"]
            if time in (0.0, config["saliency"]["time"]) and steps != DEFAULT_WEIGHT[1]
        ),
    ]
]


rule scan:
    """Scores of one mesh at every setting of a search."""
    input:
        mesh=rules.clean.output.mesh,
        signatures=rules.signature.output[0],
        truth=rules.ground_truth.output.truth,
        geodesics=rules.geodesics.output[0],
    output:
        f"{RESULTS}/{{mesh}}/evaluation/{{search}}.csv",
    log:
        f"{RESULTS}/{{mesh}}/logs/{{search}}.log",
    benchmark:
        f"{RESULTS}/{{mesh}}/logs/{{search}}.tsv"
    wildcard_constraints:
        search="calibration|ablation",
    resources:
        **needs("scan"),
    params:
        fields=lambda wildcards: (
            CALIBRATED_FIELDS if wildcards.search == "calibration" else ABLATED_FIELDS
        ),
        t_global=setting("calibration", "t_global"),
        t_local=setting("calibration", "t_local"),
        rings=setting("selection", "rings"),
        radii=configuration.radii(config),
        code=fingerprint("sid.evaluation.calibration"),
    message:
        "{wildcards.mesh}: {wildcards.search}, all settings"
    script:
        resolve("../scripts/scan.py")


rule calibrate:
    """The setting that leave-one-out cross-validation chooses, and what it is worth on unseen meshes."""
    input:
        expand(f"{RESULTS}/{{mesh}}/evaluation/calibration.csv", mesh=WITH_TRUTH),
    output:
        settings=f"{RESULTS}/calibration/settings.csv",
        chosen=f"{RESULTS}/calibration/chosen.csv",
        held_out=f"{RESULTS}/calibration/held_out.csv",
    log:
        f"{RESULTS}/logs/calibrate.log",
    localrule: True
    resources:
        **needs("table"),
    params:
        largest_fpe=setting("calibration", "largest_fpe"),
        code=fingerprint("sid.evaluation.calibration"),
    message:
        "choose a setting by leave-one-out cross-validation"
    script:
        resolve("../scripts/calibrate.py")


rule ablate:
    """Signature and weight alone and together, over times and smoothings, by the same rule for thresholds."""
    input:
        expand(f"{RESULTS}/{{mesh}}/evaluation/ablation.csv", mesh=WITH_TRUTH),
    output:
        f"{RESULTS}/ablation/ablation.csv",
    log:
        f"{RESULTS}/logs/ablate.log",
    localrule: True
    resources:
        **needs("table"),
    params:
        largest_fpe=setting("calibration", "largest_fpe"),
        code=fingerprint("sid.evaluation.calibration"),
    message:
        "ablation"
    script:
        resolve("../scripts/ablate.py")
