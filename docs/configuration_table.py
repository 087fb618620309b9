"""The table of the configuration, made from config.yaml, its comments and the schema."""

import re
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[1]
COMMENT = re.compile(r"(?:^|\s)#\s?(.*)$")


def configuration_table() -> str:
    """Every key with its default, what it accepts and what it means, in Markdown.

    Raises
    ------
    ValueError
        If the schema knows a key that has no default, or a key is explained nowhere.
    """
    text = (ROOT / "config/config.yaml").read_text(encoding="utf-8")
    schema = yaml.safe_load((ROOT / "workflow/schemas/config.schema.yaml").read_text(encoding="utf-8"))
    explained = dict(
        re.findall(r"^\| `([\w.]+)` \| ([^|]*?) \|", (ROOT / "config/README.md").read_text(), re.M)
    )
    lines = text.splitlines()
    rows = ["```{table}", ":widths: 26 30 44", "| key | default; accepted | meaning |", "|---|---|---|"]
    known = set()
    for key, node, line in _leaves(yaml.compose(text)):
        known.add(key)
        top, _, name = key.partition(".")
        default = " ".join(text[node.start_mark.index : node.end_mark.index].split())
        if top == "parameters":
            accepted = ""
            meaning = "parameters of this detector, see [detectors](detectors.md)"
        else:
            accepted = _accepted(_at(schema, key), schema)
            meaning = _comment(lines, line, node.end_mark.line) or explained.get(key, "")
        if not meaning:
            raise ValueError(f"{key} is explained neither in config.yaml nor in config/README.md")
        cells = (f"`{key}`", f"`{default}`" + (f"; {accepted}" if accepted else ""), meaning)
        rows.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    missing = _keys(schema) - known
    if missing:
        raise ValueError(f"config.yaml has no default for {', '.join(sorted(missing))}")
    return "\n".join([*rows, "```"])


def _leaves(node, prefix=""):
<<<<<<< HEAD
    """Keys with dots, the node of the default, and the line of the key; braces are one default."""
=======
    """Keys with dots, the default's node and the key's line; what stands in braces is one default."""
>>>>>>> w-docs2
    for key, value in node.value:
        name = prefix + key.value
        if isinstance(value, yaml.MappingNode) and not value.flow_style:
            yield from _leaves(value, name + ".")
        else:
            yield name, value, key.start_mark.line


def _comment(lines: list[str], first: int, last: int) -> str:
    """The comment at the end of a default, and the lines below that hold nothing else."""
    found = COMMENT.search(lines[last]) or COMMENT.search(lines[first])
    parts = [found[1]] if found else []
    for line in lines[last + 1 :]:
        if not line.lstrip().startswith("#"):
            break
        parts.append(line.strip().lstrip("# "))
    return " ".join(parts).strip()


def _at(schema: dict, key: str) -> dict:
    entry = schema
    for name in key.split("."):
        entry = entry["properties"][name]
    return entry


def _keys(schema: dict) -> set[str]:
    """Keys of the schema that are no groups, groups in braces counted as one."""
    keys = set()
    for name, entry in schema["properties"].items():
        if "properties" in entry:
            keys |= {f"{name}.{inner}" for inner in entry["properties"]}
        elif name != "parameters":
            keys.add(name)
    return keys


def _accepted(entry: dict, schema: dict) -> str:
    if "$ref" in entry:
        return _accepted(schema["$defs"][entry["$ref"].rsplit("/", 1)[1]], schema)
    if "oneOf" in entry:
        return ", or ".join(_accepted(one, schema) for one in entry["oneOf"])
    if "enum" in entry:
        return ", ".join(f"`{value}`" for value in entry["enum"])
    if "properties" in entry:
        return "; ".join(f"`{name}`: {_accepted(one, schema)}" for name, one in entry["properties"].items())
    kinds = entry["type"] if isinstance(entry["type"], list) else [entry["type"]]
    words = []
    for kind in kinds:
        if kind == "array":
            words.append(f"list of: {_accepted(entry['items'], schema)}")
        elif kind == "object":
            words.append(f"names, each with: {_accepted(entry['additionalProperties'], schema)}")
        else:
            words.append({"null": "`null`", "string": "text", "boolean": "`true`, `false`"}.get(kind, kind))
    signs = {"minimum": "at least", "exclusiveMinimum": "above", "maximum": "at most"}
    signs["exclusiveMaximum"] = "below"
    limits = [f"{word} {entry[sign]}" for sign, word in signs.items() if sign in entry]
    return ", ".join([" or ".join(words), *limits])
