import copy
import inspect
import re
import tomllib
from importlib import import_module
from pathlib import Path

import pytest
import yaml

from sid import detectors
from sid.configuration import check, flat
from sid.detectors import sid as sid_detector
from sid.errors import InputError
from sid.surface import EIGENPAIRS

ROOT = Path(__file__).parents[2]
CONFIG = yaml.safe_load((ROOT / "config/config.yaml").read_text())
SCHEMA = yaml.safe_load((ROOT / "workflow/schemas/config.schema.yaml").read_text())


def changed(key, value):
    config = copy.deepcopy(CONFIG)
    level = config
    *path, last = key.split(".")
    for part in path:
        level = level[part]
    level[last] = value
    return config


def test_the_defaults_are_valid_and_the_schema_knows_no_other_keys():
    check(CONFIG, SCHEMA)

    def keys(schema, prefix=""):
        for key, value in schema.get("properties", {}).items():
            if value.get("properties"):
                yield from keys(value, f"{prefix}{key}.")
            else:
                yield f"{prefix}{key}"

    in_config = {key for key, _ in flat(CONFIG) if not key.startswith("parameters.")}
    assert in_config == set(keys(SCHEMA)) - {"parameters"}


def test_overlays_are_valid():
    for path in [ROOT / "config/nist.yaml", *sorted((ROOT / "config/presets").glob("*.yaml"))]:
        config = copy.deepcopy(CONFIG)
        for key, value in (yaml.safe_load(path.read_text()) or {}).items():
            config[key] = {**config[key], **value} if isinstance(value, dict) else value
        check(config, SCHEMA)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("selection.t_globl", 1, "unknown key selection.t_globl; did you mean selection.t_global?"),
        ("colour", 1, "unknown key colour; known are assemble, "),
        ("spectrum.k", 0, "spectrum.k is 0; it must be at least 1"),
        ("spectrum.k", "many", "spectrum.k is 'many'; it must be of type integer"),
        ("saliency.time", -1, "saliency.time is -1; it must be greater than 0"),
        ("assemble.mass", "heavy", "assemble.mass is 'heavy'; allowed are lumped, consistent"),
        ("clean.debris_area", 2, "clean.debris_area is 2; it must be at most 1"),
        ("signature.times", [], "signature.times is []"),
        ("signature.times", [0.1, 0], "signature.times.1 is 0; it must be greater than 0"),
    ],
)
def test_a_wrong_value_is_one_readable_line(key, value, message):
    with pytest.raises(InputError) as error:
        check(changed(key, value), SCHEMA)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_a_missing_key_is_named():
    config = copy.deepcopy(CONFIG)
    del config["selection"]["rings"]
    with pytest.raises(InputError, match="selection.rings is missing"):
        check(config, SCHEMA)


def defaults_of(function):
    found = {p.name: p.default for p in inspect.signature(function).parameters.values()}
    return {
        k: list(v) if isinstance(v, tuple) else v
        for k, v in found.items()
        if v is not inspect.Parameter.empty
    }


@pytest.mark.parametrize("name", sorted(detectors.METHODS))
def test_parameters_of_detectors_are_those_of_their_functions(name):
    """Numbers live in the config; a function's own defaults, for those in Python, say the same."""
    method = detectors.METHODS[name]
    found = defaults_of(import_module(method.module).detect)
    listed = CONFIG[method.settings] if method.settings else CONFIG["parameters"].get(name, {})
    assert {k: v for k, v in found.items() if v is not None} == listed  # None: unless a person asks


def test_the_stages_of_the_paper_have_the_defaults_of_its_function():
    found = defaults_of(sid_detector.measure_saliency)
    assert found.pop("k") is CONFIG["irregularity"]["k"] and CONFIG["spectrum"]["k"] == EIGENPAIRS
    listed = {**CONFIG["saliency"], **CONFIG["curvature"]}
    assert found.pop("multiplet_tolerance") == CONFIG["irregularity"]["multiplet_tolerance"]
    assert found == listed


def test_every_key_is_explained_in_words():
    text = (ROOT / "config/README.md").read_text()
    for key, _ in flat(CONFIG):
        if not key.startswith("parameters."):
            assert f"`{key}`" in text


def test_environment_and_package_have_the_same_bounds():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    environment = yaml.safe_load((ROOT / "environment.yml").read_text())["dependencies"]
    plain = [d for d in environment if isinstance(d, str)] + next(
        d["pip"] for d in environment if isinstance(d, dict)
    )
    conda_names = {"matplotlib-base": "matplotlib", "snakemake-minimal": "snakemake"}

    def parsed(requirements):
        pairs = (re.match(r"([A-Za-z0-9_-]+)(.*)", r).groups() for r in requirements)
        return {conda_names.get(name, name): bound for name, bound in pairs}

    ours = parsed(plain)
    assert ours.pop("python") == project["requires-python"]
    ours.pop("pip")
    extras = project["optional-dependencies"]
    needed = [r for extra in ("fast", "workflow", "remesh") for r in extras[extra]]
    assert ours == parsed(project["dependencies"] + needed)
