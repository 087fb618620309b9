"""Checks of a configuration against its schema, with messages that a person can act on."""

from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from typing import Any

from sid.errors import InputError


def check(config: Mapping[str, Any], schema: Mapping[str, Any]) -> None:
    """Refuse a configuration with an unknown key or a value out of range.

    Parameters
    ----------
    config : mapping
    schema : mapping
        JSON schema.

    Raises
    ------
    InputError
        Naming the key, what is wrong with it and what is allowed; the first of several problems.
    """
    from jsonschema import Draft202012Validator

    for error in sorted(
        Draft202012Validator(schema).iter_errors(config), key=lambda e: list(map(str, e.path))
    ):
        raise InputError(_message(error))


def _message(error: Any) -> str:
    place = ".".join(str(part) for part in error.absolute_path)
    prefix = f"{place}." if place else ""
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
        return f"{place} is {error.instance!r}; allowed are {', '.join(map(str, error.validator_value))}"
    rule = {
        "minimum": "at least",
        "maximum": "at most",
        "exclusiveMinimum": "greater than",
        "exclusiveMaximum": "less than",
        "type": "of type",
        "minItems": "a list of at least",
    }.get(error.validator)
    if rule is None:
        return f"{place} is {error.instance!r}: {error.message}"
    return f"{place} is {error.instance!r}; it must be {rule} {_words(error.validator_value)}"


def _words(value: Any) -> str:
    return " or ".join(map(str, value)) if isinstance(value, list) else str(value)


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
    """
    for key, value in config.items():
        if isinstance(value, Mapping):
            yield from flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value
