# Which meshes a run works on, which of them have ground truth, and which are copies of others.


def named(*keys, default):
    """Meshes that a key of the configuration names, or the default where it is null."""
    value = setting(*keys)
    names = default if value is None else [value] if isinstance(value, str) else value
    for name in names:
        if name not in MESHES:
            refuse(
                f"config: {'.'.join(keys)} names {name}, which is none of the meshes"
            )
    return names


def is_model(mesh):
    """Whether a mesh is one of the benchmark's, whose ground truth is shipped."""
    return (
        NIST is not None
        and Path(MESHES[mesh]["path"]).parent == Path(NIST) / "MODEL_DATASET"
    )


WITH_TRUTH = [mesh for mesh in MESHES if MESHES[mesh]["marks"] or is_model(mesh)]


FIRST = [next(iter(MESHES))]
PICTURED = named("figures", "mesh", default=FIRST)[0]
GALLERY = named("figures", "gallery", default=WITH_TRUTH[:8])
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
    mesh: PERTURBATIONS for mesh in named("stability", "meshes", default=FIRST)
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


def existing(path):
    """A file as input of a job; where it is missing the job says so, and the other meshes go on."""
    # local: read in place, also where results go to a storage of objects
    return [local(path)] if path and Path(path).is_file() else []
