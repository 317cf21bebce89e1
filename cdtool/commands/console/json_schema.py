"""The JSON schema of a file that people write, from the annotated fields of its models."""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, get_args, get_origin

import msgspec

from cdtool.base.files.foreign import Kind, refuse_other_kind
from cdtool.base.files.strict_json import strict_json
from cdtool.base.registry import Registry
from cdtool.base.settings import alternatives, bare_type, is_model, keys_of
from cdtool.commands.scoring.benchmark_file import SECTIONS, BenchmarkTable
from cdtool.detectors import DETECTORS
from cdtool.formats.channels.channel_map import ChannelTable, ColumnsTable
from cdtool.formats.csv_dialect.pins import CsvTable
from cdtool.formats.machine_file import MachineTable
from cdtool.machines import MACHINES
from cdtool.machines.axis_model.model_table import ModelTable
from cdtool.thresholds import THRESHOLDS

KINDS = ("machine", "benchmark", "protocol")


_WRITTEN = Kind(b'"title": "cdtool ', "JSON schema of cdtool")


def with_schema(kind: str, file: Path, text: str) -> dict[Path, str]:
    """Return the texts of a drafted file and of the schema beside it, which its first line names for editors."""
    schema, own = _beside(kind, file), re.sub(r"^#:schema .*\n", "", text, flags=re.MULTILINE)
    return {file: f"#:schema ./{schema.name}\n{own}", schema: schema_text(kind)}


def refuse_other_schema(kind: str, file: Path, *, force: bool) -> None:
    """Raise UsageError if the schema beside a file would replace what cdtool did not write."""
    refuse_other_kind(_beside(kind, file), _WRITTEN, force=force)


def _beside(kind: str, file: Path) -> Path:
    return file.with_name(f"{kind}.schema.json")


@cache
def schema_text(kind: str) -> str:
    """Return the JSON schema of a machine, benchmark or protocol file, as `cdtool schema` prints it."""
    return strict_json(schema_of(kind)) + "\n"


def schema_of(kind: str) -> dict[str, Any]:
    """Return the JSON schema (draft 7, as taplo reads it) of a machine, benchmark or protocol file.

    >>> schema_of("benchmark")["properties"]["window_s"]["exclusiveMinimum"]
    0.0
    """
    made = {"machine": _machine, "benchmark": _benchmark, "protocol": _protocol}[kind]()
    title = f"cdtool {kind} file"
    shared: dict[str, Any] = {}
    whole = _shared(made, shared)
    definitions = {"definitions": shared} if shared else {}
    return {"$schema": "http://json-schema.org/draft-07/schema#", "title": title, **whole, **definitions}


#: The table of each channel is the same one.
_SHARED = {ChannelTable.__name__: ChannelTable}


def _shared(part: Any, shared: dict[str, Any]) -> Any:
    """Return a schema in which each model of `_SHARED` is written once, in `shared`."""
    if isinstance(part, list):
        return [_shared(item, shared) for item in part]
    if not isinstance(part, dict):
        return part
    for name, model in _SHARED.items():
        table = _table(model)
        if table["properties"].items() == part.get("properties", {}).items():
            shared[name] = table
            rest = {key: value for key, value in part.items() if key not in table}
            return {**rest, "allOf": [{"$ref": f"#/definitions/{name}"}]}
    return {name: _shared(item, shared) for name, item in part.items()}


def _machine() -> dict[str, Any]:
    made = _table(MachineTable)
    types = {name: _table(MACHINES.load(name).table) for name in MACHINES.names()}
    sections = {name: _table(part) for name, part in ModelTable.tables().items()}
    of = {
        "machine": _chosen("type", types, required=True),
        "channels": _table(ColumnsTable),
        "csv": _table(CsvTable),
        "detectors": _by_name(DETECTORS),
        "model": {"type": "object", "properties": sections, "additionalProperties": False},
    }
    made["properties"] = {**made["properties"], **of}
    return {**made, "required": ["machine"]}


def _benchmark() -> dict[str, Any]:
    made = _table(BenchmarkTable)
    rules = {name: _table(THRESHOLDS.load(name)) for name in THRESHOLDS.names()}
    rules["signature"]["properties"] = {}  # its settings are in [signature]
    made["properties"]["threshold"]["anyOf"] = [{"enum": list(rules)}, _chosen("name", rules, required=False)]
    for name in ("inject", "tune"):
        made["properties"][name] |= _table(SECTIONS.load(name).table)
    made["properties"]["protocol"] |= _protocol_table()
    return made


def _chosen(key: str, tables: Mapping[str, dict[str, Any]], *, required: bool) -> dict[str, Any]:
    """Return the schema of a table whose other keys depend on the one that chooses; each key has all its meanings."""
    properties: dict[str, Any] = {}
    for table in tables.values():
        properties |= {name: value for name, value in table["properties"].items() if name not in properties}
    depends: dict[str, Any] = {}
    for name, table in reversed(list(tables.items())):  # nested: taplo proposes no key of a table that has an allOf
        names = {"enum": sorted({key, *table["properties"]})}
        depends = {
            "if": {"properties": {key: {"const": name}}, "required": [key]},
            "then": {"propertyNames": names, "required": table.get("required", [])},
            "else": depends,
        }
    properties[key] = {**properties.get(key, {}), "enum": list(tables)}
    needed = {"required": [key]} if required else {}
    return {"type": "object", "properties": properties, **needed, **depends}


def _protocol() -> dict[str, Any]:
    return {
        "type": "object",
        "properties": {"protocol": _protocol_table()},
        "required": ["protocol"],
        "additionalProperties": False,
    }


def _protocol_table() -> dict[str, Any]:
    found: dict[str, Any] = _or_empty(_table(SECTIONS.load("protocol").table))
    return found


def _or_empty(part: Any) -> Any:
    """Return a schema in which every value may also be an empty text: a draft leaves it open."""
    if isinstance(part, list):
        return [_or_empty(item) for item in part]
    if not isinstance(part, dict):
        return part
    inner = {name: _or_empty(item) for name, item in part.items()}
    if inner.get("type") in ("number", "integer") or inner.get("format") == "date":
        return {"description": inner.pop("description", ""), "anyOf": [inner, {"const": ""}]}
    return inner


def _by_name(registry: Registry) -> dict[str, Any]:
    short = {full: name for name, full in registry.short_names.items()}
    tables = {name: _table(registry.load(name)) for name in registry.names()}
    both = tables | {short[name]: table for name, table in tables.items() if name in short}
    return {"type": "object", "properties": both}


def _table(model: Any) -> dict[str, Any]:
    keys = keys_of(model)
    properties = {}
    for name, key in keys.items():
        unit = f" [{key.extra['unit']}]" if key.extra.get("unit") else ""
        properties[name] = {**_value(key.hint), **({"description": f"{key.meaning}{unit}"} if key.meaning else {})}
    required = [name for name, key in keys.items() if key.required]
    return {
        "type": "object",
        "properties": properties,
        **({"required": required} if required else {}),
        "additionalProperties": False,
    }


def _value(hint: Any) -> dict[str, Any]:
    parts = [_one(part) for part in alternatives(hint)]
    flat = [item for part in parts for item in part.get("anyOf", [part])]
    return flat[0] if len(flat) == 1 else {"anyOf": flat}


def _one(hint: Any) -> dict[str, Any]:
    bare = bare_type(hint)
    if bare is Any:
        return {}
    if is_model(bare):
        return _table(bare)
    if get_origin(bare) is dict:
        return {"type": "object", "additionalProperties": _value(get_args(bare)[1])}
    if get_origin(bare) in (tuple, list):
        return _list(bare)
    if bare is dt.date:
        return {"type": "string"}
    made: Mapping[str, Any] = msgspec.json.schema(hint)
    found = made["$defs"].popitem()[1] if "$ref" in made else made
    return {name: value for name, value in found.items() if name not in ("title", "description")}


def _list(bare: Any) -> dict[str, Any]:
    """Return the schema of a list; a single value stands for a list with one, where it may have any length."""
    inner = get_args(bare)[0]
    size = None if Ellipsis in get_args(bare) or get_origin(bare) is list else len(get_args(bare))
    listed: dict[str, Any] = {"type": "array", "items": _value(inner)}
    if size is not None:
        return {**listed, "minItems": size, "maxItems": size}
    single = listed["items"].get("anyOf", [listed["items"]])
    return listed if is_model(bare_type(inner)) else {"anyOf": [*single, listed]}
