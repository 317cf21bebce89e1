"""The layout of results.json as a JSON Schema, made from the dataclasses of `results` and the meanings beside them.

Conventions: every field is always written, null where there is no figure; a field that is not in the schema is not in
the file.
"""

from __future__ import annotations

import inspect
import types
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any, Union, get_args, get_origin, get_type_hints

from cdtool.evaluation.results import SCHEMA_VERSION, ConclusionResult, ContactResult, LimitResult, Results

_NAMES = {str: "string", float: "number", int: "integer", bool: "boolean"}
# What text may be, where it is one of a few words: for one class, or for every one that has the field.
WORDS: Mapping[tuple[type, str] | str, tuple[str, ...]] = {
    (ContactResult, "outcome"): ("detected", "missed", "not_assessable", "in_progress"),
    (LimitResult, "outcome"): ("met", "violated", "not_assessable"),
    (ConclusionResult, "outcome"): ("violated", "not_assessable", "met", "not_asked"),
    "verdict": ("pass", "fail", "not_assessable"),
    "side": ("above", "below"),
}


def results_schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of results.json."""
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
        made = _schema(hints[item.name], parts)
        words = WORDS.get((kind, item.name)) or WORDS.get(item.name)
        if words:
            made["enum"] = [*words, None] if "null" in made["type"] else list(words)
        properties[item.name] = {"description": item.metadata["meaning"], **made}
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
        (known,) = (item for item in inner if item is not type(None))
        return {"type": [_NAMES[known], "null"]}
    if origin is tuple:
        return {"type": "array", "items": _schema(inner[0], parts)}
    if origin is Mapping:
        return {"type": "object", "additionalProperties": _schema(inner[1], parts)}
    if is_dataclass(kind):
        name = kind.__name__  # type: ignore[union-attr]
        if name not in parts:
            parts[name] = _object(kind, parts)
        return {"$ref": f"#/$defs/{name}"}
    return {"type": _NAMES[kind]}
