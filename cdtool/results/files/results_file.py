"""results.json: strict JSON, checked against the layout of `Results` when it is read.

Conventions: every field is always written, null where there is no value; a field that is not in the schema is not in
the file. A row is a line.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

from cdtool.base.errors import RecordingError
from cdtool.base.files.bounded_loading import MOST_JSON, ContentError, parse_json, read_bytes
from cdtool.base.files.kinds import kind_of
from cdtool.base.files.strict_json import finite, passive, strict_json
from cdtool.base.files.typed_json import plain, typed
from cdtool.base.value_words import value_in_words
from cdtool.results.results import SCHEMA_VERSION, FalseAlarmResult, Results, tables
from cdtool.results.summary import kind_group

# Rows that are in memory as text at once.
_AT_ONCE = 256
_as_json = json.JSONEncoder(ensure_ascii=False, allow_nan=False, check_circular=False).encode
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
            yield from _rows_in_json(value)
        else:
            yield strict_json(plain(value) if is_dataclass(value) else value).replace("\n", "\n ")
    yield "\n}\n"


def _rows_in_json(rows: Sequence[Any]) -> Iterator[str]:
    """Yield rows, a line each, many at a time."""
    for first in range(0, len(rows), _AT_ONCE):
        lines = ",\n  ".join([_line(plain(row)) for row in rows[first : first + _AT_ONCE]])
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
    version = values["schema_version"]
    if version not in (SCHEMA_VERSION - 1, SCHEMA_VERSION):
        raise RecordingError(
            f"{path}: schema_version is {value_in_words(version)}; "
            f"this version of cdtool reads {SCHEMA_VERSION - 1} and {SCHEMA_VERSION}",
            "run cdtool benchmark again with this version",
        )
    try:
        results = typed(Results, {**values, "schema_version": SCHEMA_VERSION}, "results")
        if version != SCHEMA_VERSION:
            results = _with_operations(results)
        _refuse_unlisted(results)
    except ValueError as fault:
        raise _no_results(path, str(fault)) from fault
    return results


def _with_operations(results: Results) -> Results:
    """Return results of version 4, in which a false alarm may name its operation as recording, RECORDING#N."""
    operations = {(row.group, row.recording): row.operations for row in results.recordings}

    def renamed(row: FalseAlarmResult) -> FalseAlarmResult:
        recording, _, number = row.recording.rpartition("#")
        if (row.group, row.recording) not in operations and (row.group, recording) in operations and number.isdecimal():
            return replace(row, recording=recording, operation=int(number))
        return replace(row, operation=1 if operations.get((row.group, row.recording)) == 1 else None)

    return replace(results, false_alarms=tuple(map(renamed, results.false_alarms)))


def _refuse_unlisted(results: Results) -> None:
    """Raise ValueError for a row of a detector or group that the results do not list."""
    known = {"detectors": results.detectors, "groups": results.every_group}
    kinds = tuple(kind_group(group, " ")[:-1] for group in results.groups)  # STIFF/ in STIFF/KIND
    for table in tables():
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
