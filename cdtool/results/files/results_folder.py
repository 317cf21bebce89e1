"""results.parquet: a folder with all rows of a benchmark as Parquet tables, for queries; and back to `Results`.

    results.parquet/
      provenance.json            what the rows are from: provenance, detectors, groups, conclusion
      contacts/*.parquet         a file for each group and detector; of recordings and forces one for each group
      exposure/*.parquet ...     a file for each other kind of rows

Conventions: the columns are the fields of results.json, under the same names, and `row`, the position there. Contacts,
false alarms and recordings also have `began`, the time of the recording's first sample, and the machine; contacts and
false alarms the campaign and the test point. A table without rows has a file without rows.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

from cdtool.base.errors import RecordingError, UsageError, installing
from cdtool.base.files.bounded_loading import MOST_JSON, ContentError, parse_json, read_bytes
from cdtool.base.files.strict_json import strict_json
from cdtool.results.files.typed_rows import build
from cdtool.results.results import SCHEMA_VERSION, Results

# A row, and its position in results.json.
_Numbered = tuple[int, Any]
PROVENANCE = "provenance.json"
KIND = "cdtool results.parquet"
# Rows of a row group, which are in memory at once.
_AT_ONCE = 65_536
# Tables with a file for each group, or group and detector.
_PARTS: Mapping[str, tuple[str, ...]] = {
    "contacts": ("group", "detector"),
    "false_alarms": ("group", "detector"),
    "recordings": ("group",),
    "forces": ("group",),
}
# Tables that also have columns of the recording.
_OF_RECORDING = ("contacts", "false_alarms", "recordings")
# Tables that a results.parquet of an earlier version does not have.
_LATER = ("conditions",)
_NO_NAME = re.compile(r"[^A-Za-z0-9_-]+")
_LONGEST_NAME = 40
_OPERATION = re.compile(r"#\d+\Z")
_NEXT_STEP = "write one with cdtool benchmark -o results.parquet"


@dataclass(frozen=True)
class _Column:
    """A field of rows: its Arrow type and meaning, and what a value is stored and read as where that differs."""

    name: str
    arrow: Any
    meaning: str
    store: Callable[[Any], Any] | None = None
    load: Callable[[Any], Any] | None = None


def require_pyarrow(folder: Path) -> None:
    """Check that Parquet can be read and written.

    Parameters
    ----------
    folder : Path
        The folder, for the message.

    Raises
    ------
    UsageError
        pyarrow is not installed.

    Examples
    --------
    >>> require_pyarrow(Path("results.parquet"))
    """
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError as fault:
        raise UsageError(f"{folder.name}: Parquet needs pyarrow", f"install it: {installing('store')}") from fault


@cache
def tables() -> Mapping[str, Any]:
    """Return the class of the rows of each table; the tables are the fields of `Results` with rows.

    Returns
    -------
    mapping of str to type
        The class by the name of the field.

    Examples
    --------
    >>> list(tables())[:3]
    ['contacts', 'false_alarms', 'exposure']
    """
    hints = get_type_hints(Results)
    found = {item.name: get_args(hints[item.name]) for item in fields(Results)}
    return {name: inner[0] for name, inner in found.items() if inner and is_dataclass(inner[0])}


def write_tables(results: Results, folder: Path) -> str:
    """Write all rows into an empty folder.

    Parameters
    ----------
    results : Results
        The results; the same results produce the same bytes.
    folder : Path
        The folder.

    Returns
    -------
    str
        What the rows are from: the text of `provenance.json`, which is not written.

    Examples
    --------
    >>> empty = Results(provenance={}, detectors=(), groups=(), contacts=(), false_alarms=(), exposure=())
    >>> folder = Path("results.parquet")
    >>> folder.mkdir()
    >>> text = write_tables(empty, folder)
    >>> sorted(path.name for path in folder.iterdir()) == sorted(tables())
    True
    """
    of_recordings = _OfRecordings(results)
    for table, kind in tables().items():
        rows = getattr(results, table)
        (folder / table).mkdir()
        for name, numbered in _parts(table, rows):
            joined = of_recordings if table in _OF_RECORDING else None
            _write(folder / table / f"{name}.parquet", _columns(kind), numbered, joined)
    rest = {item.name: getattr(results, item.name) for item in fields(results) if item.name not in tables()}
    return strict_json({"kind": KIND, **rest, "conclusion": vars(results.conclusion)}) + "\n"


def holds_only_tables(folder: Path, others: Sequence[str] = ()) -> bool:
    """Return whether a folder may be replaced.

    Parameters
    ----------
    folder : Path
        The folder.
    others : sequence of str
        Names that may be in it too.

    Returns
    -------
    bool
        True if it is empty, or has only tables of `write_tables`, `provenance.json` and `others`.

    Examples
    --------
    >>> Path("reports").mkdir()
    >>> holds_only_tables(Path("reports"))
    True
    """
    held = [item for item in folder.iterdir() if item.name not in (PROVENANCE, *others)]
    if not held and not (folder / PROVENANCE).exists():
        return True
    are_tables = all(item.name in tables() and item.is_dir() and not item.is_symlink() for item in held)
    return (
        are_tables and _has_mark(folder) and all(file.suffix == ".parquet" for part in held for file in part.iterdir())
    )


def read_tables(folder: Path) -> Results:
    """Read the results that `write_tables` wrote.

    Parameters
    ----------
    folder : Path
        The folder.

    Returns
    -------
    Results
        The results.

    Raises
    ------
    RecordingError
        The folder is none of these, is damaged, or is of another version.
    UsageError
        pyarrow is not installed.

    Examples
    --------
    `cdtool report results.parquet -o report.html` reads them.
    """
    if not _has_mark(folder):
        raise RecordingError(f"{folder}: is a folder, and not a results.parquet", _NEXT_STEP)
    require_pyarrow(folder)
    from pyarrow import ArrowException

    try:
        head = parse_json(read_bytes(folder / PROVENANCE, RecordingError, most=MOST_JSON))
        if head.pop("kind") != KIND or head["schema_version"] != SCHEMA_VERSION:
            raise ValueError(f"this version of cdtool reads schema_version {SCHEMA_VERSION}")
        known = build(Results, {**head, **{name: [] for name in tables()}}, "results")
        # A table that earlier versions did not write is empty.
        rows = {
            name: _read(folder / name, kind) if (folder / name).exists() or name not in _LATER else ()
            for name, kind in tables().items()
        }
    except (ContentError, ValueError, KeyError, TypeError, AttributeError, OSError, ArrowException) as fault:
        reason = " ".join(str(fault).split())[:200]
        raise RecordingError(f"{folder}: damaged, or not a results.parquet: {reason}", _NEXT_STEP) from fault
    rest = {item.name: getattr(known, item.name) for item in fields(known)}
    return Results(**{**rest, **rows})


def _has_mark(folder: Path) -> bool:
    try:
        with (folder / PROVENANCE).open("rb") as file:
            return KIND.encode() in file.read(256)
    except OSError:
        return False


class _OfRecordings:
    """When the recording of a row began, and its campaign, test point and machine."""

    def __init__(self, results: Results) -> None:
        self.rows = {(row.group, row.recording): row for row in results.recordings}
        self.machine = str(results.provenance.get("machine") or "") or None

    def of(self, rows: Sequence[_Numbered]) -> dict[str, Sequence[Any]]:
        """Return columns for the recordings, or their operations, that rows name."""
        of_rows = [
            self.rows.get((row.group, row.recording), self.rows.get((row.group, _OPERATION.sub("", row.recording))))
            for _, row in rows
        ]
        began = [None if row is None or row.began_s is None else round(1e6 * row.began_s) for row in of_rows]
        found = {name: [getattr(row, name, None) for row in of_rows] for name in ("campaign", "point")}
        return {**found, "began": began, "machine": [self.machine] * len(rows)}


def _parts(table: str, rows: Sequence[Any]) -> Iterator[tuple[str, Sequence[_Numbered]]]:
    """Yield the name of each file of a table, and its rows."""
    numbered = list(enumerate(rows))
    if table not in _PARTS or not numbered:
        yield table, numbered
        return
    names, parts = _PARTS[table], dict[tuple[str, ...], list[_Numbered]]()
    for number, row in numbered:
        parts.setdefault(tuple(getattr(row, name) for name in names), []).append((number, row))
    for place, (key, part) in enumerate(parts.items()):
        yield f"{place:04d}-{'.'.join(_NO_NAME.sub('-', name)[:_LONGEST_NAME] for name in key)}", part


def _write(
    path: Path, columns: Sequence[_Column], rows: Sequence[_Numbered], of_recordings: _OfRecordings | None
) -> None:
    """Write numbered rows as one file, a row group at a time."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    listed = [pa.field("row", pa.int64(), metadata={"meaning": "position in results.json"})]
    listed += [pa.field(item.name, item.arrow, metadata={"meaning": item.meaning}) for item in columns]
    if of_recordings:
        known = {item.name for item in columns}
        listed += [pa.field(name, pa.string()) for name in ("campaign", "point", "machine") if name not in known]
        listed.append(pa.field("began", pa.timestamp("us"), metadata={"meaning": "when the recording began, UTC"}))
    schema = pa.schema(listed)
    with pq.ParquetWriter(path, schema, compression="zstd") as writer:
        for first in range(0, max(len(rows), 1), _AT_ONCE):
            some = rows[first : first + _AT_ONCE]
            values: dict[str, Sequence[Any]] = of_recordings.of(some) if of_recordings else {}
            values |= {"row": [number for number, _ in some]} | {item.name: _stored(item, some) for item in columns}
            arrays = [_array(values[item.name], item.type) for item in schema]
            writer.write_table(pa.Table.from_arrays(arrays, schema=schema))


def _stored(column: _Column, rows: Sequence[_Numbered]) -> Sequence[Any]:
    values = [getattr(row, column.name) for _, row in rows]
    return [column.store(value) for value in values] if column.store else values


def _array(values: Sequence[Any], kind: Any) -> Any:
    import pyarrow as pa

    try:
        return pa.array(values, kind)
    except UnicodeEncodeError:  # half a surrogate pair, from a file name that is not UTF-8
        return pa.array(_encodable(values), kind)


def _encodable(value: Any) -> Any:
    if isinstance(value, str):
        return value.encode("utf-8", "replace").decode("utf-8")
    if isinstance(value, list | tuple):
        return [_encodable(item) for item in value]
    if isinstance(value, dict):
        return {_encodable(name): _encodable(item) for name, item in value.items()}
    return value


def _read(folder: Path, kind: Any) -> tuple[Any, ...]:
    """Return the rows of a table in their order in results.json."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = _columns(kind)
    names = ["row", *(item.name for item in columns)]
    table = pa.concat_tables(pq.read_table(path, columns=names) for path in sorted(folder.glob("*.parquet")))
    table = table.sort_by("row")
    values = [table[item.name].to_pylist() for item in columns]
    loaded = [list(map(item.load, held)) if item.load else held for item, held in zip(columns, values, strict=True)]
    return tuple(kind(*row) for row in zip(*loaded, strict=True))


def _columns(kind: Any) -> list[_Column]:
    """Return the columns of a class of rows."""
    hints = get_type_hints(kind)
    return [_column(item.name, hints[item.name], item.metadata["meaning"]) for item in fields(kind)]


def _column(name: str, kind: Any, meaning: str) -> _Column:
    import pyarrow as pa

    origin, inner = get_origin(kind), get_args(kind)
    if origin is tuple and is_dataclass(inner[0]):
        parts = _columns(inner[0])
        row: Any = inner[0]
        return _Column(
            name,
            pa.list_(pa.struct([(item.name, item.arrow) for item in parts])),
            meaning,
            store=lambda rows: [vars(one) for one in rows],
            load=lambda rows: tuple(row(**values) for values in rows),
        )
    if origin is Mapping:
        return _Column(name, pa.map_(pa.string(), pa.float64()), meaning, lambda values: list(values.items()), dict)
    known = next(item for item in (*inner, kind) if item is not type(None))
    plain = {str: pa.string(), float: pa.float64(), int: pa.int64(), bool: pa.bool_()}
    return _Column(name, plain[known], meaning)
