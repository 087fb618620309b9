"""Checks of a configuration against its schema, with messages that a person can act on."""

import math
from collections.abc import Iterable, Iterator, Mapping
from decimal import Decimal, InvalidOperation
from difflib import get_close_matches
from typing import Any

from sid.arguments import show_value
from sid.detectors import METHODS
from sid.detectors.parameters import check_parameters
from sid.errors import InputError

MOST_RADII = 1000

# what a schema's types are called by people
WORDS = {
    "integer": "a whole number",
    "number": "a number",
    "string": "a text",
    "array": "a list",
    "object": "a group of settings",
    "boolean": "true or false",
    "null": "null",
}


def check(config: Mapping[str, Any], schema: Mapping[str, Any]) -> None:
    """Refuse a configuration with an unknown key, a value out of range, NaN or infinity.

    Parameters
    ----------
    config : mapping
    schema : mapping
        JSON schema. A whole number is one without a decimal point: 3.0 is none.

    Raises
    ------
    InputError
        Naming the key, what is wrong with it and what is allowed; the first of several problems.

    Examples
    --------
    >>> schema = {"properties": {"k": {"type": "integer", "minimum": 1}}, "additionalProperties": False}
    >>> check({"k": 300}, schema)
    >>> check({"k": 0}, schema)
    Traceback (most recent call last):
    ...
    sid.errors.InputError: k is 0; it must be at least 1
    """
    from jsonschema import Draft202012Validator, validators

    for dotted, value in _values(config):
        if isinstance(value, float | int) and not _is_finite(value):
            raise InputError(f"{dotted} is {show_value(value)}; it must be a finite number")
    checker = Draft202012Validator.TYPE_CHECKER.redefine("integer", lambda _, value: type(value) is int)
    validator = validators.extend(Draft202012Validator, type_checker=checker)
    errors = validator(schema).iter_errors(config)
    for error in sorted(errors, key=lambda e: list(map(str, e.absolute_path))):
        raise InputError(_message(error))
    _check_radii(config)


def check_detectors(config: Mapping[str, Any]) -> None:
    """Refuse a name that is no detector's, and parameters that a detector cannot take.

    Parameters
    ----------
    config : mapping

    Raises
    ------
    InputError
        Naming the first such name, and those that are known; or the parameter, its value and what it must be;
        or a detector whose settings stand elsewhere.

    Examples
    --------
    >>> check_detectors({"detectors": ["sid", "hks"], "parameters": {}})
    >>> check_detectors({"detectors": ["hsk"], "parameters": {}})
    Traceback (most recent call last):
    ...
    sid.errors.InputError: unknown detector hsk; known are ...
    """
    for name in (*config["detectors"], *config["parameters"]):
        if name not in METHODS:
            raise InputError(f"unknown detector {name}; known are {', '.join(METHODS)}")
    for name, parameters in config["parameters"].items():
        if METHODS[name].settings:  # they would have no effect there
            raise InputError(
                f"parameters.{name} is set, but the settings of {name} are sections of their own; "
                f"set those of {METHODS[name].settings} instead"
            )
        check_parameters(name, parameters)


def parameters_of(config: Mapping[str, Any], detector: str) -> Mapping[str, Any]:
    """What a configuration sets for a detector.

    Parameters
    ----------
    config : mapping
    detector : str

    Returns
    -------
    mapping
        Empty where it sets nothing.

    Examples
    --------
    >>> parameters_of({"parameters": {"hks": {"time": 0.05}}}, "hks")
    {'time': 0.05}
    """
    section = METHODS[detector].settings
    return config[section] if section else config["parameters"].get(detector, {})


def times(config: Mapping[str, Any]) -> list[float]:
    """The grid of diffusion times of a configuration, with the time that saliency reads.

    Parameters
    ----------
    config : mapping

    Returns
    -------
    list of float
        Ascending.

    Examples
    --------
    >>> times({"signature": {"times": [0.1, 0.02]}, "saliency": {"time": 0.05}})
    [0.02, 0.05, 0.1]
    """
    return sorted({*map(float, config["signature"]["times"]), float(config["saliency"]["time"])})


def radii(config: Mapping[str, Any]) -> list[float]:
    """Localisation tolerances of a configuration, from 0.

    Parameters
    ----------
    config : mapping

    Returns
    -------
    list of float
        Shares of the diameter.

    Examples
    --------
    >>> radii({"evaluation": {"radii": {"step": 0.05, "stop": 0.1}}})
    [0.0, 0.05, 0.1]
    """
    step, stop = (config["evaluation"]["radii"][key] for key in ("step", "stop"))
    return [round(i * step, 9) for i in range(int(round(stop / step)) + 1)]


def _check_radii(config: Mapping[str, Any]) -> None:
    radii = config.get("evaluation", {}).get("radii")
    if radii is None:
        return
    step, stop = radii["step"], radii["stop"]
    if step > stop:
        raise InputError(
            f"evaluation.radii.step is {step:g}; it must be at most evaluation.radii.stop, {stop:g}"
        )
    if stop / step > MOST_RADII:
        raise InputError(
            f"evaluation.radii.step is {step:g}, which makes {stop / step:.3g} tolerances up to {stop:g}; "
            f"at most {MOST_RADII} are allowed"
        )


def _is_finite(value: float) -> bool:
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number that no floating-point number holds
        return False


def _message(error: Any) -> str:
    dotted = ".".join(str(part) for part in error.absolute_path)
    prefix = f"{dotted}." if dotted else ""
    value = f"{dotted or 'the configuration'} is {show_value(error.instance)}"
    if error.validator == "additionalProperties":
        known = sorted(error.schema["properties"])
        key = next(str(k) for k in error.instance if k not in known)
        close = get_close_matches(key, known, 1)
        hint = f"did you mean {prefix}{close[0]}?" if close else f"known are {', '.join(known)}"
        return f"unknown key {prefix}{key}; {hint}"
    if error.validator == "required":
        missing = next(k for k in error.validator_value if k not in error.instance)
        return f"{prefix}{missing} is missing"
    if error.validator == "enum":
        return f"{value}; allowed are {', '.join(map(str, error.validator_value))}"
    if error.validator == "oneOf":
        return f"{value}; allowed are {_words(list(_choices(error.validator_value)))}"
    if error.validator == "type":
        types = error.validator_value if isinstance(error.validator_value, list) else [error.validator_value]
        return f"{value}; it must be {_words([WORDS[kind] for kind in types])}{_hint(error.instance, types)}"
    if error.validator == "uniqueItems":
        return f"{value}; nothing may stand in it twice"
    limit = error.validator_value
    rule = {
        "minimum": f"at least {limit}",
        "maximum": f"at most {limit}",
        "exclusiveMinimum": f"greater than {limit}",
        "exclusiveMaximum": f"less than {limit}",
        "minItems": "a list with at least one entry",
        "maxItems": f"a list of at most {limit} entries",
        "minLength": "a text that is not empty",
    }[error.validator]
    return f"{value}; it must be {rule}"


def _choices(schemas: list[Mapping[str, Any]]) -> Iterator[str]:
    for schema in schemas:
        if "enum" in schema:
            yield from map(str, schema["enum"])
        elif schema.get("type") == "array":
            kind = schema.get("items", {}).get("type")
            yield "a list of texts" if kind == "string" else "a list"


def _hint(value: Any, types: list[str]) -> str:
    """How to write a number that YAML has read as something else."""
    if isinstance(value, bool) or not {"integer", "number"} & set(types):
        return ""
    try:
        number = Decimal(str(value))
    except InvalidOperation:
        return ""
    if not number.is_finite() or abs(number.adjusted()) > 20:
        return ""
    if number == number.to_integral_value():
        return f": write {int(number)}"
    return f": write {number:f}" if "number" in types else ""


def _words(names: list[str]) -> str:
    return " or ".join(names)


def _values(config: Any, dotted: str = "") -> Iterator[tuple[str, Any]]:
    """Every value of a configuration, those in lists, too."""
    if isinstance(config, Mapping):
        parts: Iterable[tuple[Any, Any]] = config.items()
    elif isinstance(config, list | tuple):
        parts = enumerate(config)
    else:
        yield dotted, config
        return
    for key, value in parts:
        yield from _values(value, f"{dotted}.{key}" if dotted else str(key))


def flat(config: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Every key of a nested configuration with dots between levels.

    Parameters
    ----------
    config : mapping
    prefix : str

    Yields
    ------
    key : str
    value

    Examples
    --------
    >>> dict(flat({"signature": {"times": [0.1, 0.2]}, "meshes": None}))
    {'signature.times': [0.1, 0.2], 'meshes': None}
    """
    for key, value in config.items():
        if isinstance(value, Mapping):
            yield from flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value
