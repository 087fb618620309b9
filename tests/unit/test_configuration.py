import copy
import inspect
import math
import re
import tomllib
from importlib import import_module
from pathlib import Path

import pytest
import yaml

import sid
from sid import detectors
from sid.configuration import check, check_detectors, flat, parameters_of, radii, times
from sid.detectors import sid as sid_detector
from sid.detectors.parameters import COMMON, PARAMETERS
from sid.errors import InputError
from sid.spectral.irregularity import irregularity, multiplets, usable
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
            if value.get("properties") and f"{prefix}{key}" != "parameters":
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
        ("spectrum.k", "many", "spectrum.k is 'many'; it must be a whole number"),
        ("spectrum.k", "1e9", "spectrum.k is '1e9'; it must be a whole number: write 1000000000"),
        ("spectrum.k", 300.0, "spectrum.k is 300.0; it must be a whole number: write 300"),
        ("spectrum.k", True, "spectrum.k is True; it must be a whole number"),
        ("spectrum.k", [3], "spectrum.k is [3]; it must be a whole number"),
        ("clean.largest", "1e6", "it must be a whole number or null: write 1000000"),
        ("saliency.time", "5e-2", "saliency.time is '5e-2'; it must be a number: write 0.05"),
        ("detectors", "sid", "detectors is 'sid'; it must be a list"),
        ("selection", 3, "selection is 3; it must be a group of settings"),
        ("meshes", 3, "meshes is 3; it must be a text or null"),
        ("evaluation.repeated", "no", "evaluation.repeated is 'no'; it must be true or false"),
        ("figures.meshes", "some", "figures.meshes is 'some'; allowed are all or none or a list of texts"),
        ("results", "", "results is ''; it must be a text that is not empty"),
        ("detectors", ["sid", "sid"], "nothing may stand in it twice"),
        ("curvature.smoothing", 10**9, "curvature.smoothing is 1000000000; it must be at most 1000"),
        ("selection.rings", 10**6, "selection.rings is 1000000; it must be at most 20"),
        ("selection.t_global", 1.5, "selection.t_global is 1.5; it must be at most 1"),
        ("spectrum.k", 10**7, "spectrum.k is 10000000; it must be at most 100000"),
        ("precision.draws", 10**9, "it must be at most 10000"),
        ("precision.counts", [10**9], "precision.counts.0 is 1000000000; it must be at most 1000000"),
        ("bootstrap.resamples", 10**10, "it must be at most 1000000"),
        ("parameters.harris3d.rings", 10**6, "parameters.harris3d.rings is 1000000; it must be at most 20"),
        ("signature.times", [1.0] * 1001, "it must be a list of at most 1000 entries"),
        ("evaluation.radii.step", 1e-9, "which makes 1.2e+08 tolerances up to 0.12; at most 1000 are"),
        ("evaluation.radii.stop", 10**6, "evaluation.radii.stop is 1000000; it must be at most 10"),
        ("evaluation.radii.step", 0.5, "must be at most evaluation.radii.stop, 0.12"),
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


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf"), 10**400])
@pytest.mark.parametrize("key", [key for key, _ in flat(CONFIG)])
def test_no_key_takes_nan_or_infinity(key, value):
    for wrong in (value, [value], {"a": [value]}):
        with pytest.raises(InputError, match=rf"^{re.escape(key)}[.a0]* is .*; it must be a finite number$"):
            check(changed(key, wrong), SCHEMA)


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


def schema_of(bounds):
    """What a JSON schema says of a value with these bounds."""
    if bounds.known:
        return {"enum": [*bounds.known, *([None] if bounds.optional else [])]}
    kind = "integer" if bounds.whole else "number"
    limits = {"type": [kind, "null"] if bounds.optional else kind}
    if bounds.least > -math.inf:
        limits["exclusiveMinimum" if bounds.above else "minimum"] = bounds.least
    if bounds.most < math.inf:
        limits["maximum"] = bounds.most
    return (
        {"type": "array", "minItems": 1, "maxItems": bounds.items, "items": limits}
        if bounds.items
        else limits
    )


def test_the_schema_has_the_bounds_of_the_table_of_parameters():
    def resolved(rule):
        return SCHEMA["$defs"][rule["$ref"].rpartition("/")[2]] if "$ref" in rule else rule

    listed = SCHEMA["properties"]["parameters"]["properties"]
    own = {name for name, method in detectors.METHODS.items() if not method.settings}
    assert listed.keys() == own
    for name in own:
        assert listed[name]["additionalProperties"] is False
        expected = {key: schema_of(bounds) for key, bounds in {**PARAMETERS[name], **COMMON}.items()}
        assert listed[name]["properties"] == expected
    sections = ("irregularity", "saliency", "curvature", "selection")  # of sid
    keys = {
        key: resolved(rule)
        for section in sections
        for key, rule in SCHEMA["properties"][section]["properties"].items()
    }
    assert keys == {key: schema_of(bounds) for key, bounds in PARAMETERS["sid"].items()}


def test_settings_that_would_have_no_effect_are_refused():
    with pytest.raises(InputError, match="parameters.sid is set, but .* set those of selection instead"):
        check_detectors(changed("parameters.sid", {"t_global": 0.5}))


WRONG = ("text", "", [], {}, [[]], None, -1, -1e-300, 1e9, 10**30, True, "1e9", [None], {"a": 1}, ["x"] * 2)


@pytest.mark.parametrize("key", [key for key, _ in flat(CONFIG)])
def test_every_wrong_value_is_one_line_that_names_the_key(key):
    """Or it is right: nothing else may come of it."""
    refused = 0
    for value in WRONG:
        try:
            config = changed(key, value)
            check(config, SCHEMA)
            check_detectors(config)
        except InputError as error:
            refused += 1
            assert "\n" not in str(error) and len(str(error)) < 400
            name = key.rpartition(".")[2] if key.startswith("parameters.") else key
            assert name in str(error) or "unknown detector" in str(error)
    assert refused >= 8


@pytest.mark.parametrize("key", [k for k in CONFIG])
@pytest.mark.parametrize("value", [None, [], "text", 3, [{}]])
def test_a_section_of_another_kind_is_one_line_that_names_it(key, value):
    try:
        config = changed(key, value)
        check(config, SCHEMA)
        check_detectors(config)
    except InputError as error:
        assert "\n" not in str(error)
        assert str(error).startswith(key) or "unknown detector" in str(error)
    else:
        assert key in ("meshes", "results", "seed")


def test_the_stages_of_the_paper_have_the_defaults_of_its_function():
    found = defaults_of(sid_detector.measure_saliency)
    assert found.pop("k") is CONFIG["irregularity"]["k"] and CONFIG["spectrum"]["k"] == EIGENPAIRS
    listed = {**CONFIG["saliency"], **CONFIG["curvature"]}
    for name in ("multiplet_tolerance", "weyl_tolerance"):
        assert found.pop(name) == CONFIG["irregularity"][name]
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


def test_an_unknown_detector_is_named_with_those_that_are_known():
    check_detectors(CONFIG)
    for key, value in (("detectors", ["sid", "hsk"]), ("parameters", {"hsk": {}})):
        with pytest.raises(InputError, match="unknown detector hsk; known are local_irregularity, sid"):
            check_detectors({**CONFIG, key: value})


def test_tolerances_and_times_are_those_of_the_configuration():
    assert radii(CONFIG)[:2] == [0.0, 0.005] and radii(CONFIG)[-1] == 0.12 and len(radii(CONFIG)) == 25
    config = changed("saliency.time", 0.3)
    assert times(config) == sorted({*CONFIG["signature"]["times"], 0.3})
    assert parameters_of(CONFIG, "sid") == CONFIG["selection"]
    assert parameters_of(CONFIG, "harris3d") == CONFIG["parameters"]["harris3d"]


def test_cleaning_and_the_irregularity_have_the_defaults_of_the_configuration():
    share = CONFIG["clean"]["debris_area"]
    assert defaults_of(sid.clean)["debris_area"] == defaults_of(sid.read)["debris_area"] == share
    for function, name in (
        (irregularity, "multiplet_tolerance"),
        (multiplets, "tolerance"),
        (usable, "tolerance"),
    ):
        assert defaults_of(function)[name] == CONFIG["irregularity"]["multiplet_tolerance"]
