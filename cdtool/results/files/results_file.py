"""results.json: strict JSON, checked against the layout of `Results` when it is read.

Conventions: every field is always written, null where there is no value; a field that is not in the schema is not in
the file. A row is a line.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

from cdtool.base.errors import RecordingError
from cdtool.base.files.bounded_loading import MOST_JSON, ContentError, parse_json, read_bytes
from cdtool.base.files.kinds import kind_of
from cdtool.base.files.strict_json import finite, passive, strict_json
from cdtool.base.files.typed_json import plain, typed
from cdtool.base.value_words import value_in_words
from cdtool.results.results import SCHEMA_VERSION, Results, tables
from cdtool.results.summary import kind_group

# Rows that are in memory as text at once.
_AT_ONCE = 256
_as_json = json.JSONEncoder(ensure_ascii=False, allow_nan=False, check_circular=False).encode
# Rows of a detector, of a group or of both.
_NAMED = ("contacts", "false_alarms", "exposure", "recordings", "forces", "points", "sweep", "calibration", "limits")
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
        if item.name in tables():
            yield from _rows_in_json(value, tables()[item.name])
        else:
            yield strict_json(plain(value) if is_dataclass(value) else value).replace("\n", "\n ")
    yield "\n}\n"


def _rows_in_json(rows: Sequence[Any], kind: Any) -> Iterator[str]:
    """Yield rows, a line each, many at a time."""
    for first in range(0, len(rows), _AT_ONCE):
        lines = ",\n  ".join([_line(plain(row, kind)) for row in rows[first : first + _AT_ONCE]])
        yield f"{',' if first else '['}\n  {passive(lines)}"
    yield "\n ]" if rows else "[]"


def _line(values: Any) -> str:
    try:
        return _as_json(values)
    except ValueError:  # a number that is not finite
        return _as_json(finite(values))


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
        results = typed(Results, values, "results")
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
    for table in _NAMED:
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
