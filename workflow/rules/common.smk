import os
import re
import sys
from functools import reduce
from operator import getitem
from pathlib import Path

import yaml
from snakemake.utils import update_config

from sid import configuration, detectors, machine, store
from sid.errors import InputError, naming
from sid.provenance import fingerprint

# found wherever the workflow lies: a folder, a git address, the installed package
HERE = workflow.current_basedir
SCHEMA = workflow.source_path("../schemas/config.schema.yaml")
DEFAULTS = workflow.source_path("../../config/config.yaml")


def read_source(path):
    """A YAML file of the workflow."""
    # libyaml's loader where there is one: ten times as fast
    return yaml.load(
        Path(path).read_text(), getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    )


# many meshes: compile once, before the first that is large enough; see deferred_compilation
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


try:
    with naming("config"):
        configuration.check(config, read_source(SCHEMA))
        configuration.check_detectors(config)
    MESH_SET = store.find_mesh_set(config["meshes"], config["nist"]["root"])
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
    return reduce(getitem, keys, config)


# detectors whose saliency is the result of a stage
RANKED = [
    name for name in config["detectors"] if detectors.METHODS[name].stage == "saliency"
]
DRAWN_DETECTOR = next(iter(RANKED), "sid")  # whose points the picture of a mesh shows


def stored_saliency(detector):
    """The files of a detector whose saliency is the result of a stage."""
    own = {"local_irregularity": "local_irregularity/"}.get(detector, "")
    names = ("saliency", "curvature", "arc_saliency") if own else ("saliency",)
    return {name: f"{RESULTS}/{{mesh}}/{own}{name}.npy" for name in names}


def stage_of(wildcards):
    """The result of a stage that a detector takes: eigenpairs, its own saliency, or none."""
    stage = detectors.METHODS[wildcards.detector].stage
    if stage == "spectrum":
        return {stage: f"{RESULTS}/{wildcards.mesh}/spectrum.zarr"}
    files = stored_saliency(wildcards.detector) if stage else {}
    return {name: path.format(mesh=wildcards.mesh) for name, path in files.items()}
