rule spectrum:
    """The smallest eigenpairs of stiffness and mass."""
    input:
        stiffness=rules.assemble.output.stiffness,
        mass=rules.assemble.output.mass,
    output:
        # kept until a new one is whole, so that a longer spectrum can continue from it
        update(directory(f"{RESULTS}/{{mesh}}/spectrum.zarr")),
    log:
        f"{RESULTS}/{{mesh}}/logs/spectrum.log",
    cache: True  # which Snakemake allows without benchmark: only
    threads: threads_of_spectrum
    resources:
        **needs("spectrum"),
    params:
        k=setting("spectrum", "k"),
        backend=setting("spectrum", "backend"),
        continue_stored=setting("spectrum", "continue_stored"),
        code=fingerprint("sid.eigen.spectrum"),
    message:
        "{wildcards.mesh}: solve for {params.k} eigenpairs"
    script:
        resolve("../scripts/spectrum.py")


rule irregularity:
    """The smoothed spectrum and its irregularity, as far as the mesh resolves it."""
    input:
        mesh=rules.clean.output.mesh,
        spectrum=rules.spectrum.output[0],
    output:
        f"{RESULTS}/{{mesh}}/irregularity.csv",
    log:
        f"{RESULTS}/{{mesh}}/logs/irregularity.log",
    resources:
        **needs("irregularity"),
    params:
        k=setting("irregularity", "k"),
        multiplet_tolerance=setting("irregularity", "multiplet_tolerance"),
        weyl_tolerance=setting("irregularity", "weyl_tolerance"),
        code=fingerprint("sid.spectral.irregularity", "sid.spectral.weyl"),
    message:
        "{wildcards.mesh}: irregularity of the spectrum"
    script:
        resolve("../scripts/irregularity.py")


rule signature:
    """Irregularity and heat kernel signature over the grid of times."""
    input:
        spectrum=rules.spectrum.output[0],
        irregularity=rules.irregularity.output[0],
    output:
        directory(f"{RESULTS}/{{mesh}}/signatures.zarr"),
    log:
        f"{RESULTS}/{{mesh}}/logs/signature.log",
    resources:
        **needs("signature"),
    params:
        times=configuration.times(config),
        code=fingerprint("sid.spectral.signature"),
    message:
        "{wildcards.mesh}: signatures at {params.times}"
    script:
        resolve("../scripts/signature.py")
