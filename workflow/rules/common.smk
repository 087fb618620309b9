import os
import re
import sys
from pathlib import Path

import yaml
from snakemake.utils import update_config

from sid import bundled, configuration, detectors, machine, store
from sid.errors import InputError, naming
from sid.provenance import fingerprint

# found wherever the workflow lies: a folder, a git address, the installed package
HERE = workflow.current_basedir
SCHEMA = workflow.source_path("../schemas/config.schema.yaml")
DEFAULTS = workflow.source_path("../../config/config.yaml")


def read_source(path):
    """A YAML file of the workflow."""
    return yaml.safe_load(Path(path).read_text())


# many meshes: compile once, before the first that is large enough; see sid.compilation
os.environ.setdefault("SID_COMPILE", "first")

# whatever configuration is laid over them, and by whom
defaults = read_source(DEFAULTS)
update_config(defaults, config)
config.update(defaults)


def resolve(path):
    """A script beside the rules; Snakemake does not find a relative one below a local git address."""
    address = str(HERE.join(path))
    return address if address.startswith("git+file:") else path


def refuse(error):
    """End before any job with one line that says what is wrong."""
    sys.exit(f"sid: {error}")


def bundled_file(name):
    """A file of the example, named from here where it lies below."""
    path = bundled.locate("example") / name
    return str(path.relative_to(Path.cwd()) if Path.cwd() in path.parents else path)


def checked_meshes():
    """The set of meshes, after the configuration as a whole has been found usable."""
    with naming("config"):
        configuration.check(config, read_source(SCHEMA))
        known = detectors.METHODS
        for key in (*config["detectors"], *config["parameters"]):
            if key not in known:
                raise InputError(
                    f"unknown detector {key}; known are {', '.join(known)}"
                )
    root, source = config["nist"]["root"], config["meshes"]
    if root is not None and not (Path(root) / "MODEL_DATASET").is_dir():
        raise InputError(
            f"{root}: no NIST benchmark there (folder MODEL_DATASET); set nist.root"
        )
    if source == "bundled":
        files = {"path": "creature.ply", "marks": "creature_marks.csv"}
        creature = {key: bundled_file(name) for key, name in files.items()}
        return store.MeshSet({"creature": creature})
    if source is None and root is None:
        raise InputError(
            "config: meshes is null and nist.root too; name a table, folder or glob of meshes, or a mesh"
        )
    return store.read_mesh_set(
        source if source is not None else Path(root) / "MODEL_DATASET"
    )


try:
    MESH_SET = checked_meshes()
except InputError as error:
    refuse(error)

MESHES, REFUSED = MESH_SET.meshes, MESH_SET.refused
if workflow.is_main_process:
    for line in MESH_SET.lines():
        print(f"sid: {line}", file=sys.stderr)

MEMORY_MB = machine.memory() // 10**6
RESULTS = config["results"].rstrip("/")
NIST = config["nist"]["root"]


def setting(*keys):
    """A value of the configuration as a parameter of a rule."""
    return lookup(within=config, dpath="/".join(keys))


# detectors whose saliency is the result of a stage
RANKED = [
    name for name in config["detectors"] if detectors.METHODS[name].stage == "saliency"
]
SHOWN = next(iter(RANKED), "sid")  # whose points the picture of a mesh shows


def parameters_of(detector):
    """What the configuration sets for a detector."""
    settings = detectors.METHODS[detector].settings
    return config[settings] if settings else config["parameters"].get(detector, {})


def stored_saliency(detector):
    """The files of a detector whose saliency is the result of a stage."""
    own = {"local_irregularity": "local_irregularity/"}.get(detector, "")
    names = ("saliency", "curvature") if own else ("saliency",)
    return {name: f"{RESULTS}/{{mesh}}/{own}{name}.npy" for name in names}


def stage_of(wildcards):
    """The result of a stage that a detector takes: eigenpairs, its own saliency, or none."""
    stage = detectors.METHODS[wildcards.detector].stage
    if stage == "spectrum":
        return {stage: f"{RESULTS}/{wildcards.mesh}/spectrum.zarr"}
    files = stored_saliency(wildcards.detector) if stage else {}
    return {name: path.format(mesh=wildcards.mesh) for name, path in files.items()}


def times():
    """The grid of diffusion times with the time that saliency reads."""
    return sorted(
        {*map(float, config["signature"]["times"]), float(config["saliency"]["time"])}
    )


def radii():
    """Localisation tolerances r."""
    step, stop = (
        config["evaluation"]["radii"]["step"],
        config["evaluation"]["radii"]["stop"],
    )
    return [round(i * step, 9) for i in range(int(round(stop / step)) + 1)]
