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
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, replace
from operator import attrgetter
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

from cdtool.base.errors import RecordingError, UsageError, installing
from cdtool.base.files.bounded_loading import MOST_JSON, ContentError, parse_json, read_bytes
from cdtool.base.files.strict_json import strict_json
from cdtool.base.files.typed_json import plain, typed
from cdtool.results.results import SCHEMA_VERSION, Results, scalar_of, tables

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
_NO_NAME = re.compile(r"[^A-Za-z0-9_-]+")
_NEXT_STEP = "write one with cdtool benchmark -o results.parquet"


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
            _write(folder / table / f"{name}.parquet", kind, numbered, joined)
    rest = {item.name: getattr(results, item.name) for item in fields(results) if item.name not in tables()}
    return strict_json({"kind": KIND, **rest, "conclusion": plain(results.conclusion)}) + "\n"


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
        known = typed(Results, {**head, **{name: [] for name in tables()}}, "results")
        rows: dict[str, Any] = {name: _read(folder / name, kind) for name, kind in tables().items()}
        return replace(known, **rows)
    except (ContentError, ValueError, KeyError, TypeError, AttributeError, OSError, ArrowException) as fault:
        reason = " ".join(str(fault).split())[:200]
        raise RecordingError(f"{folder}: damaged, or not a results.parquet: {reason}", _NEXT_STEP) from fault


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

    def of(self, row: Any) -> dict[str, Any]:
        """Return columns for the recording that a row names."""
        known = self.rows.get((row.group, row.recording))
        if known is None:
            return {"machine": self.machine}
        began = None if known.began_s is None else round(1e6 * known.began_s)
        return {"campaign": known.campaign, "point": known.point, "began": began, "machine": self.machine}


def _parts(table: str, rows: Sequence[Any]) -> Iterator[tuple[str, Sequence[_Numbered]]]:
    """Yield the name of each file of a table, and its rows."""
    if table not in _PARTS or not rows:
        yield table, list(enumerate(rows))
        return
    parts: dict[tuple[str, ...], list[_Numbered]] = {}
    keys = zip(*(map(attrgetter(name), rows) for name in _PARTS[table]), strict=True)
    for names, numbered in zip(keys, enumerate(rows), strict=True):
        parts.setdefault(names, []).append(numbered)
    for place, (names, part) in enumerate(parts.items()):
        yield f"{place:04d}-{'.'.join(_NO_NAME.sub('-', name)[:40] for name in names)}", part


def _write(path: Path, kind: Any, rows: Sequence[_Numbered], of_recordings: _OfRecordings | None) -> None:
    """Write numbered rows as one file, a row group at a time."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    listed = [pa.field("row", pa.int64(), metadata={"meaning": "position in results.json"}), *_columns(kind)]
    if of_recordings:
        known = {item.name for item in listed}
        listed += [pa.field(name, pa.string()) for name in ("campaign", "point", "machine") if name not in known]
        listed.append(pa.field("began", pa.timestamp("us"), metadata={"meaning": "when the recording began, UTC"}))
    schema = pa.schema(listed)
    hints = _hints(kind)
    with pq.ParquetWriter(path, schema, compression="zstd") as writer:
        for first in range(0, max(len(rows), 1), _AT_ONCE):
            some = [row for _, row in rows[first : first + _AT_ONCE]]
            joined = [of_recordings.of(row) for row in some] if of_recordings else []
            columns = {name: [of_row.get(name) for of_row in joined] for name in schema.names if name not in hints}
            columns |= {name: _stored(hint, list(map(attrgetter(name), some))) for name, hint in hints.items()}
            columns["row"] = [number for number, _ in rows[first : first + _AT_ONCE]]
            try:
                table = pa.Table.from_pydict(columns, schema)
            except UnicodeEncodeError:  # half a surrogate pair, from a file name that is not UTF-8
                table = pa.Table.from_pydict(_encodable(columns), schema)
            writer.write_table(table)


def _stored(hint: Any, values: list[Any]) -> list[Any]:
    """Return the values of a field as Arrow takes them."""
    if scalar_of(hint):
        return values
    made = [plain(value) for value in values]
    return [list(value.items()) for value in made] if get_origin(hint) is Mapping else made


def _hints(kind: Any) -> dict[str, Any]:
    hints = get_type_hints(kind)
    return {item.name: hints[item.name] for item in fields(kind)}


def _encodable(value: Any) -> Any:
    if isinstance(value, str):
        return value.encode("utf-8", "replace").decode("utf-8")
    if isinstance(value, list | tuple):  # the pairs of a map are tuples
        return type(value)(map(_encodable, value))
    if isinstance(value, dict):
        return {_encodable(name): _encodable(item) for name, item in value.items()}
    return value


def _read(folder: Path, kind: Any) -> tuple[Any, ...]:
    """Return the rows of a table in their order in results.json."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    hints = _hints(kind)
    parts = (pq.read_table(path, columns=["row", *hints]) for path in sorted(folder.glob("*.parquet")))
    table = pa.concat_tables(parts).sort_by("row")
    texts: dict[str, str] = {}
    columns = []
    for name, hint in hints.items():
        if scalar := scalar_of(hint):
            values = table[name].to_pylist()
            columns.append([texts.setdefault(value, value) for value in values] if scalar is str else values)
        else:
            values = table[name].to_pylist(maps_as_pydicts="strict")
            columns.append([typed(hint, value, name) for value in values])
    return tuple(map(kind, *columns))


def _columns(kind: Any) -> list[Any]:
    """Return the Arrow fields of a class of rows, with their meanings."""
    import pyarrow as pa

    hints = _hints(kind)
    return [
        pa.field(item.name, _arrow_type(hints[item.name]), metadata={"meaning": item.metadata["meaning"]})
        for item in fields(kind)
    ]


def _arrow_type(hint: Any) -> Any:
    import pyarrow as pa

    if scalar := scalar_of(hint):
        return {str: pa.string(), float: pa.float64(), int: pa.int64(), bool: pa.bool_()}[scalar]
    if get_origin(hint) is Mapping:
        return pa.map_(pa.string(), pa.float64())
    return pa.list_(pa.struct(_columns(get_args(hint)[0])))
