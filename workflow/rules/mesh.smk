rule clean:
    """A mesh fit for finite elements, with the map to the vertices of the input file."""
    input:
        source,
    output:
        mesh=f"{RESULTS}/{{mesh}}/mesh.ply",
        report=f"{RESULTS}/{{mesh}}/cleaning.json",
    log:
        f"{RESULTS}/{{mesh}}/logs/clean.log",
    benchmark:
        f"{RESULTS}/{{mesh}}/logs/clean.tsv"
    wildcard_constraints:
        mesh="|".join(map(re.escape, SOURCES)),
    resources:
        **needs("clean"),
    params:
        path=lambda wildcards: SOURCES[wildcards.mesh],
        content=lambda wildcards: mesh_content(SOURCES[wildcards.mesh]),
        debris_area=setting("clean", "debris_area"),
        largest=setting("clean", "largest"),
        code=fingerprint(
            "sid.formats.mesh_file", "sid.cleaning.repair", "sid.cleaning.decimation"
        ),
    message:
        "{wildcards.mesh}: clean the mesh"
    script:
        resolve("../scripts/clean.py")


rule assemble:
    """Stiffness and mass."""
    input:
        mesh=rules.clean.output.mesh,
    output:
        stiffness=f"{RESULTS}/{{mesh}}/stiffness.npz",
        mass=f"{RESULTS}/{{mesh}}/mass.npz",
    log:
        f"{RESULTS}/{{mesh}}/logs/assemble.log",
    resources:
        **needs("assemble"),
    params:
        laplacian=setting("assemble", "laplacian"),
        mass=setting("assemble", "mass"),
        code=fingerprint("sid.geometry.fem"),
    message:
        "{wildcards.mesh}: assemble stiffness and mass"
    script:
        resolve("../scripts/assemble.py")
