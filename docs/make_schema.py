"""Make docs/results.schema.json, and the schemas of files that people write: python docs/make_schema.py"""

from __future__ import annotations

import inspect
import json
import types
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from cdtool.commands.console.json_schema import KINDS
from cdtool.commands.console.json_schema import schema_text as written_text
from cdtool.results.results import SCHEMA_VERSION, Results

FILE = Path(__file__).with_name("results.schema.json")
WRITTEN = {kind: FILE.with_name(f"{kind}.schema.json") for kind in KINDS}
TYPES = {str: "string", float: "number", int: "integer", bool: "boolean"}


def schema_text() -> str:
    """The file's content."""
    return json.dumps(results_schema(), indent=1) + "\n"


def results_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of results.json."""
    parts: dict[str, Any] = {}
    whole = _object(Results, parts)
    whole["properties"]["schema_version"] |= {"const": SCHEMA_VERSION}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"cdtool results.json, schema_version {SCHEMA_VERSION}",
        **whole,
        "$defs": dict(sorted(parts.items())),
    }


def _object(kind: Any, parts: dict[str, Any]) -> dict[str, Any]:
    hints = get_type_hints(kind)
    properties = {}
    for item in fields(kind):
        properties[item.name] = {"description": item.metadata["meaning"], **_schema(hints[item.name], parts)}
    return {
        "description": inspect.getdoc(kind),
        "type": "object",
        "properties": properties,
        "required": list(properties),
        "additionalProperties": False,
    }


def _schema(kind: Any, parts: dict[str, Any]) -> dict[str, Any]:
    origin, inner = get_origin(kind), get_args(kind)
    if kind is Any:
        return {}
    if origin in (Union, types.UnionType):
        known = _schema(*[item for item in inner if item is not type(None)], parts)
        more = {"enum": [*known["enum"], None]} if "enum" in known else {}
        return {"type": [known["type"], "null"], **more}
    if origin is Literal:
        return {"type": "string", "enum": list(inner)}
    if origin is tuple:
        return {"type": "array", "items": _schema(inner[0], parts)}
    if origin is Mapping:
        return {"type": "object", "additionalProperties": _schema(inner[1], parts)}
    if is_dataclass(kind):
        name = kind.__name__  # type: ignore[union-attr]
        if name not in parts:
            parts[name] = _object(kind, parts)
        return {"$ref": f"#/$defs/{name}"}
    return {"type": TYPES[kind]}


if __name__ == "__main__":
    FILE.write_text(schema_text(), encoding="utf-8")
    for kind, file in WRITTEN.items():
        file.write_text(written_text(kind), encoding="utf-8")
