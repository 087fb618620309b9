# Which meshes a run works on, which of them have ground truth, and which are copies of others.
import atexit
import json

from sid.formats.mesh_file import files_of_mesh


def usable(names, key):
    """Those of some meshes that can be worked on; the others were refused, and are left out with a line."""
    refused = {name for name, _ in REFUSED}
    for name in names:
        if name in MESHES:
            continue
        if store.show_name(name) not in refused:
            refuse(f"config: {key} names {name}, which is none of the meshes")
        if workflow.is_main_process:
            print(
                f"sid: config: {key}: {store.show_name(name)} was refused; left out",
                file=sys.stderr,
            )
    return [name for name in names if name in MESHES]


def pick_meshes(*keys, default):
    """Meshes that a key of the configuration names, or the default where it names none that can be used."""
    value = setting(*keys)
    names = default if value is None else [value] if isinstance(value, str) else value
    return usable(names, ".".join(keys)) or (default if names else [])


def is_model(mesh):
    """Whether a mesh is one of the benchmark's, whose ground truth is shipped."""
    return (
        NIST is not None
        and Path(MESHES[mesh]["path"]).parent == Path(NIST) / "MODEL_DATASET"
    )


WITH_TRUTH = [mesh for mesh in MESHES if MESHES[mesh]["marks"] or is_model(mesh)]


FIRST = [next(iter(MESHES))]
PICTURED = pick_meshes("figures", "mesh", default=FIRST)[0]
GALLERY = pick_meshes("figures", "gallery", default=WITH_TRUTH[:8])
SHOWN = {"all": list(MESHES), "none": []}.get(str(setting("figures", "meshes")))
if SHOWN is None:
    SHOWN = usable(setting("figures", "meshes"), "figures.meshes")
KINDS = ("noise", "decimate", "remesh", "scale", "turn", "bend")
PERTURBATIONS = [
    f"{kind}-{amount:g}" for kind in KINDS for amount in setting("stability", kind)
]
# copies of a mesh are meshes of their own, results/stability/MESH/COPY, and go through the same stages
POSES = setting("stability", "poses")
LOST = [path for path in POSES if not Path(path).is_file()]
if LOST:
    POSES = []
    if workflow.is_main_process:
        print(
            f"sid: stability.poses: {LOST[0]}: no such file; left out", file=sys.stderr
        )
STABLE = {
    mesh: PERTURBATIONS for mesh in pick_meshes("stability", "meshes", default=FIRST)
} | ({"poses": [f"pose-{i}" for i in range(1, len(POSES))]} if POSES else {})
SOURCES = {mesh: MESHES[mesh]["path"] for mesh in MESHES} | {
    f"stability/poses/pose-{i}": path for i, path in enumerate(POSES)
}


def turn(mesh):
    """Degrees by which pictures turn a mesh about the upright axis."""
    return (config["figures"]["turns"] or {}).get(mesh, 0.0)


def original(mesh):
    """What the copies of a mesh are compared with."""
    return "stability/poses/pose-0" if mesh == "poses" else mesh


# kept beside Snakemake's own records; a run without changes reads no file
HASHES = store.FileHashes(Path(".snakemake") / "sid_hashes.json")
if workflow.is_main_process:
    atexit.register(HASHES.keep)


def mesh_content(path):
    """What a mesh is: the hash of all its files, whatever their dates."""
    return HASHES.of(files_of_mesh(path))


def judged_content(mesh):
    """What people have said of a mesh: the hash of the files with it."""
    marks = MESHES[mesh]["marks"]
    if is_model(mesh):
        from sid.evaluation.nist import files_of_model

        return HASHES.of(files_of_model(NIST, Path(MESHES[mesh]["path"]).stem))
    return HASHES.of([marks] if marks else [])


def source(wildcards):
    """The file of a mesh; its date counts for nothing where it is the very one that was cleaned."""
    path = SOURCES[wildcards.mesh]
    cleaned = Path(RESULTS) / wildcards.mesh / "cleaning.json"
    try:
        known = json.loads(cleaned.read_bytes()).get("sha256")
    except (OSError, ValueError):
        known = None
    same = known is not None and known == mesh_content(path)
    return [ancient(file) if same else file for file in keep_existing(path)]


def keep_existing(path):
    """A file as input of a job; where it is missing the job says so, and the other meshes go on."""
    # local: read in place, also where results go to a storage of objects
    return [local(path)] if path and Path(path).is_file() else []
