"""results.json: strict JSON, checked against the layout of `Results` when it is read; and that layout as a JSON Schema.

Conventions: every field is always written, null where there is no value; a field that is not in the schema is not in
the file.
"""

from __future__ import annotations

import inspect
import json
import re
import types
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, fields, is_dataclass
from pathlib import Path
from typing import Any, Union, get_args, get_origin, get_type_hints

from cdtool.base.errors import RecordingError
from cdtool.base.files.bounded_loading import MOST_JSON, ContentError, parse_json, read_bytes
from cdtool.base.files.kinds import kind_of
from cdtool.base.files.strict_json import finite, strict_json
from cdtool.base.value_words import value_in_words
from cdtool.results.files.typed_rows import WORDS, build
from cdtool.results.results import SCHEMA_VERSION, Results
from cdtool.results.summary import kind_group

# Rows that are in memory as text at once.
_AT_ONCE = 256
_TEXTS, _NUMBERS = {str, type(None)}, {float, int, bool, type(None)}
# Rows of a detector, of a group or of both.
_TABLES = ("contacts", "false_alarms", "exposure", "recordings", "forces", "points", "sweep", "calibration", "limits")
# Earlier versions that can be read: 2 has "kept", "broken" and "not assessable", and no conclusion; 3 lists lost data
# of a recording as skipped, and names the label file in the rule of the onset.
_SPACED_WORDS, _LOSSES_LEFT_OUT = 2, 3
_READABLE = (_SPACED_WORDS, _LOSSES_LEFT_OUT, SCHEMA_VERSION)
# How versions 2 and 3 write these.
_DAMAGED = "damaged, used as far as it goes: "
_LABEL_FILE = "; label file "
_IN_SAMPLES = re.compile(r"\bfor \d+ samples?\b")
_RENAMED = {"kept": "met", "broken": "violated", "not assessable": "not_assessable"}
_NEXT_STEP = "write one with cdtool benchmark -o results.json"
_SCHEMA_TYPES = {str: "string", float: "number", int: "integer", bool: "boolean"}


def to_json(results: Results) -> str:
    """Return results as strict JSON.

    Parameters
    ----------
    results : Results
        The results.

    Returns
    -------
    str
        The text of results.json: null without a value; characters that control a terminal are escaped.

    Examples
    --------
    >>> empty = Results(provenance={}, detectors=(), groups=(), contacts=(), false_alarms=(), exposure=())
    >>> json.loads(to_json(empty))["schema_version"] == SCHEMA_VERSION
    True
    """
    return "".join(json_pieces(results))


def json_pieces(results: Results) -> Iterator[str]:
    """Yield the text of `to_json` in pieces, so that many rows are never in memory as text.

    Parameters
    ----------
    results : Results
        The results.

    Returns
    -------
    iterator of str
        The pieces.

    Examples
    --------
    >>> empty = Results(provenance={}, detectors=(), groups=(), contacts=(), false_alarms=(), exposure=())
    >>> "".join(json_pieces(empty)) == to_json(empty)
    True
    """
    before = "{"
    for item in fields(results):
        yield f'{before}\n "{item.name}": '
        before = ","
        value = getattr(results, item.name)
        if _are_rows(value):
            yield from _rows_in_json(value)
        else:
            yield strict_json(asdict(value) if is_dataclass(value) else value).replace("\n", "\n ")  # type: ignore[arg-type]
    yield "\n}\n"


def _are_rows(value: Any) -> bool:
    """Whether a value has rows; a tuple also has names."""
    return isinstance(value, tuple) and bool(value) and is_dataclass(value[0])


def _rows_in_json(rows: Sequence[Any], depth: int = 2) -> Iterator[str]:
    """Yield rows as `strict_json` lays them out at a depth, many at a time, field by field."""
    if not rows:
        yield "[]"
        return
    names = [item.name for item in fields(rows[0])]
    before, line = "[", "\n" + " " * depth
    layout = f"{line}{{{line} " + f",{line} ".join(f'"{name}": %s' for name in names) + f"{line}}}"
    for columns in _blocks(rows, names):
        texts = zip(*(_in_json(values, depth + 1) for values in columns), strict=True)
        yield before + ",".join([layout % row for row in texts])
        before = ","
    yield f"{line[:-1]}]"


def _blocks(rows: Sequence[Any], names: Sequence[str]) -> Iterator[list[Sequence[Any]]]:
    """Yield the values of each field of rows, in blocks."""
    for first in range(0, len(rows), _AT_ONCE):
        some = rows[first : first + _AT_ONCE]
        yield [[getattr(row, name) for row in some] for name in names]


def _in_json(values: Sequence[Any], depth: int) -> Sequence[str]:
    """Return each value of a field as JSON, laid out at a depth; equal texts are written once."""
    kinds = set(map(type, values))
    if kinds <= _TEXTS:
        known = {value: strict_json(value) for value in set(values)}
        return [known[value] for value in values]
    if kinds <= _NUMBERS:
        text = json.dumps(values)
        return json.dumps(finite(values))[1:-1].split(", ") if "N" in text or "I" in text else text[1:-1].split(", ")
    return ["".join(_one_in_json(value, depth)) for value in values]


def _one_in_json(value: Any, depth: int) -> Iterator[str]:
    if _are_rows(value):
        yield from _rows_in_json(value, depth + 1)
    else:
        yield strict_json(value).replace("\n", "\n" + " " * depth)


def read_results(path: Path) -> Results:
    """Read a results.json, or the folder results.parquet.

    Parameters
    ----------
    path : Path
        The file or folder.

    Returns
    -------
    Results
        The results, checked field by field.

    Raises
    ------
    RecordingError
        The file is not a results file, is damaged, or is of an unknown version.
    UsageError
        It is a folder, and pyarrow is not installed.

    Examples
    --------
    >>> empty = Results(provenance={}, detectors=(), groups=(), contacts=(), false_alarms=(), exposure=())
    >>> _ = Path("results.json").write_text(to_json(empty), encoding="utf-8")
    >>> read_results(Path("results.json")) == empty
    True
    """
    if path.is_dir():
        from cdtool.results.files.results_folder import read_tables

        return read_tables(path)
    content = read_bytes(path, RecordingError, most=MOST_JSON)
    try:
        values = parse_json(content)
    except ContentError as fault:
        raise _other_kind(path, content) or _no_results(path, str(fault)) from fault
    if other := _other_kind(path, content):
        raise other
    if not isinstance(values, dict) or "schema_version" not in values:
        raise _no_results(path, "it has no schema_version")
    if values["schema_version"] not in _READABLE:
        known = f"this version of cdtool reads {', '.join(map(str, _READABLE[:-1]))} and {SCHEMA_VERSION}"
        raise RecordingError(
            f"{path}: schema_version is {value_in_words(values['schema_version'])}; {known}",
            "run cdtool benchmark again with this version",
        )
    try:
        values = migrated(values)
        results = build(Results, values, "results")
        _refuse_unlisted(results)
    except ValueError as fault:
        raise _no_results(path, str(fault)) from fault
    return results


def migrated(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of an earlier schema_version as those of this one."""
    if values["schema_version"] == _SPACED_WORDS:
        values = _with_joined_words(values)
    return _with_losses_as_findings(values) if values["schema_version"] == _LOSSES_LEFT_OUT else dict(values)


def _with_joined_words(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values of schema_version 2 as those of version 3: it has other words for verdicts, and no conclusion."""

    def renamed(rows: Any, name: str) -> Any:
        if not isinstance(rows, list):
            return rows
        made = []
        for row in rows:
            if isinstance(row, dict) and isinstance(row.get(name), str):
                row = {**row, name: _RENAMED.get(row[name], row[name])}
            if isinstance(row, dict) and "steps" in row:
                row = {**row, "steps": renamed(row["steps"], name)}
            made.append(row)
        return made

    tables = {name: renamed(values[name], "verdict") for name in ("forces", "points") if name in values}
    tables |= {"limits": renamed(values["limits"], "outcome")} if "limits" in values else {}
    return {**values, **tables, "schema_version": _LOSSES_LEFT_OUT}


def _with_losses_as_findings(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values of schema_version 3 as those of version 4: losses are findings, the label file is separate.

    `onset_unit` of the provenance becomes "samples" if the rule counts samples.
    """
    made = {**values, "schema_version": SCHEMA_VERSION}
    skipped, findings = values.get("skipped", []), values.get("findings", [])
    if isinstance(skipped, list) and isinstance(findings, list):
        made["skipped"] = [row for row in skipped if not _is_loss(row)]
        losses = [
            {**row, "reason": row["reason"].removeprefix(_DAMAGED), "severity": "loss"}
            for row in skipped
            if _is_loss(row)
        ]
        made["findings"] = [*losses, *findings]
    provenance = values.get("provenance")
    onset = provenance.get("onset") if isinstance(provenance, dict) else None
    if isinstance(provenance, dict) and isinstance(onset, str):
        made["provenance"] = {**provenance, "onset": onset.partition(_LABEL_FILE)[0]}
        if _IN_SAMPLES.search(onset):
            made["provenance"]["onset_unit"] = "samples"
    return made


def _is_loss(row: Any) -> bool:
    return isinstance(row, dict) and isinstance(row.get("reason"), str) and row["reason"].startswith(_DAMAGED)


def _refuse_unlisted(results: Results) -> None:
    """Raise ValueError for a row of a detector or group that the results do not list."""
    known = {"detectors": results.detectors, "groups": results.every_group}
    kinds = tuple(kind_group(group, " ")[:-1] for group in results.groups)  # STIFF/ in STIFF/KIND
    for table in _TABLES:
        for i, row in enumerate(getattr(results, table)):
            for name, listed in (("detector", "detectors"), ("group", "groups")):
                value = getattr(row, name, None)
                if value is not None and value not in known[listed]:
                    if table == "limits" and name == "group" and value.startswith(kinds):
                        continue
                    where = f"results.{table}[{i}].{name}"
                    raise ValueError(f"{where} is '{value}', which results.{listed} does not list")


def _other_kind(path: Path, content: bytes) -> RecordingError | None:
    """Return the error for a file that is recognised as another kind; a results file may begin like any JSON file."""
    kind = kind_of(content)
    if not kind or kind in ("a results file", "JSON"):
        return None
    return RecordingError(f"{path}: is {kind}, not a results file", _NEXT_STEP)


def _no_results(path: Path, why: str) -> RecordingError:
    return RecordingError(f"{path}: not a results file: {why}", _NEXT_STEP)


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
        return {"type": [_SCHEMA_TYPES[known], "null"]}
    if origin in (tuple, Sequence):
        return {"type": "array", "items": _schema(inner[0], parts)}
    if origin is Mapping:
        return {"type": "object", "additionalProperties": _schema(inner[1], parts)}
    if is_dataclass(kind):
        name = kind.__name__  # type: ignore[union-attr]
        if name not in parts:
            parts[name] = _object(kind, parts)
        return {"$ref": f"#/$defs/{name}"}
    return {"type": _SCHEMA_TYPES[kind]}
