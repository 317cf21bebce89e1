"""The store: an append-only folder of Parquet files with what was computed, found by key.

    store.json                what the folder is
    parts/*.parquet           the entries, a row each; a file is complete or not there
    runs/*.parquet            a file per run: which entries it used, how many it computed
    *.journal                 entries of a run that is under way

Several processes may write at the same time: each writes files of its own. An entry that two of them compute is there
twice, which changes nothing. At a URL there is no journal: parts are written more often.
"""

from __future__ import annotations

import io
import json
import secrets
import time
from collections import OrderedDict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.base.errors import ConfigurationError, UsageError, installing
from cdtool.base.files.bounded_loading import parse_json, parse_own_json, read_bytes
from cdtool.base.files.typed_json import decoded, encoded
from cdtool.base.files.writing import write_bytes, write_text
from cdtool.base.remote.remote_path import is_remote
from cdtool.execution.store.entry import Entry
from cdtool.execution.store.journal import JOURNAL_SUFFIX, Journal, entries_in, left_behind
from cdtool.execution.store.sources import SourceFile
from cdtool.execution.store.text_column import text_column

_KIND, _SCHEMA = "cdtool store", 1
_MARK = "store.json"
# A part is written when it has so many entries, or characters of content.
_MOST_ENTRIES, _MOST_CONTENT = 4000, 32 << 20
# Of a store at a URL, which has no journal, so many entries are lost at most with a process that is killed, or what was
# computed in this time [s].
_MOST_AT_RISK, _AT_RISK_SECONDS = 200, 30.0
# A place is the number of a part, and that of a row in these bits.
_ROW_BITS = 32
_ROW = (1 << _ROW_BITS) - 1
# Parts that are held in memory.
_MOST_PARTS = 3
_NAMES = tuple(item.name for item in fields(Entry))
_KEY_BYTES = 32
_NO_SOURCES = "[]"
_PLAIN = ("key", "kind", "recording", "sources", "failed")


class Store:
    """The store in a folder, which is created if it does not exist; raises ConfigurationError for another folder.

    Without `writes` nothing is created, entries that are added are dropped, and journals are read like parts.
    """

    def __init__(self, folder: Path, *, writes: bool = True) -> None:
        self.folder, self.writes = folder, writes
        require_pyarrow()
        if writes:
            _create(folder)
        require_store(folder)
        self._journal: Journal | None = None
        self._waiting: list[Entry] = []
        self._content = 0
        self._flushed = time.monotonic()
        self._parts: OrderedDict[Path, dict[str, list[Any]]] = OrderedDict()
        if writes:
            for _, entries in left_behind(folder):
                if entries:
                    write_part(folder, entries)
        journals = () if writes else folder.glob(f"*{JOURNAL_SUFFIX}")
        self._all_parts = [*sorted((folder / "parts").glob("*.parquet")), *sorted(journals)]
        self._index = _Index(self._all_parts)

    @property
    def parts(self) -> list[Path]:
        """Return the files with entries, as they were when the store was opened."""
        return list(self._all_parts)

    def entries_of(self, part: Path) -> list[Entry] | None:
        """Return the entries of a file; None if it is gone or damaged."""
        rows = read_columns(part, _NAMES)
        return None if rows is None else [_entry(rows, row) for row in range(len(rows["key"]))]

    @staticmethod
    def is_enough(entries: Sequence[Entry]) -> bool:
        """Return whether entries are enough for a file."""
        return len(entries) >= _MOST_ENTRIES or sum(len(item.content) for item in entries) >= _MOST_CONTENT

    def sources_of(self, recording: str) -> tuple[SourceFile, ...] | None:
        """Return the files from which a recording was last read; None for one that the store does not know."""
        text = self._index.sources.get(encodable(recording))
        return None if text is None else decoded(text, tuple[SourceFile, ...])

    def source_key_of(self, recording: str) -> str | None:
        """Return the key of the entry of the kind "source" that has these files; None if it is of another kind."""
        return self._index.source_keys.get(encodable(recording))

    def places(self, keys: Sequence[str]) -> list[int | None]:
        """Return where the entries of keys are; None for a key without one."""
        return self._index.places(keys)

    def is_failed(self, place: int) -> bool:
        """Return whether the entry at a place is a reading error."""
        return place in self._index.failed

    def get(self, key: str) -> Entry | None:
        """Return an entry; None if it is missing, or its file was removed or damaged meanwhile."""
        (place,) = self._index.places([key])
        found = None if place is None else self.at(place)
        return found if found is not None and found.key == key else None

    def at(self, place: int) -> Entry | None:
        """Return the entry at a place; None if its file was removed or damaged meanwhile."""
        row = place & _ROW
        rows = self._rows(self._index.parts[place >> _ROW_BITS])
        if rows is None:
            return None
        return _entry(rows, row)

    def add(self, entries: list[Entry]) -> None:
        """Add entries: they outlive this process when it returns, except on an object store."""
        if not self.writes:
            return
        if self._journal is None and not is_remote(self.folder):
            self._journal = Journal(self.folder)
        if self._journal is not None:
            self._journal.add(entries)
        self._waiting += entries
        self._content += sum(len(item.content) for item in entries)
        is_enough = len(self._waiting) >= _MOST_ENTRIES or self._content >= _MOST_CONTENT
        if is_enough or (self._journal is None and self._is_due()):
            self.flush()

    def _is_due(self) -> bool:
        """Return whether a part is written without a journal: what is not in a part is lost with this process."""
        return len(self._waiting) >= _MOST_AT_RISK or time.monotonic() - self._flushed >= _AT_RISK_SECONDS

    def flush(self) -> None:
        """Write the entries that were added to a part."""
        if self._waiting:
            write_part(self.folder, self._waiting)
        if self._journal is not None:
            self._journal.clear()
        self._waiting, self._content = [], 0
        self._flushed = time.monotonic()

    @contextmanager
    def writing(self) -> Iterator[Store]:
        """Write everything at the end of the block, also if it ends early."""
        try:
            yield self
        finally:
            self.flush()
            if self._journal is not None:
                self._journal.close()
                self._journal = None

    def _rows(self, path: Path) -> dict[str, list[Any]] | None:
        """Return the columns of a part."""
        if path in self._parts:
            self._parts.move_to_end(path)
            return self._parts[path]
        rows = read_columns(path, _NAMES)
        if rows is None:
            return None
        self._parts[path] = rows
        if len(self._parts) > _MOST_PARTS:
            self._parts.popitem(last=False)
        return self._parts[path]


class _Index:
    """Where the entry of each key is: the first 64 bits of the keys, sorted, with their places."""

    def __init__(self, parts: list[Path]) -> None:
        self.parts: list[Path] = []
        # Of each recording: the files that it was last read from, and the key of the entry if it has only these.
        self.sources: dict[str, str] = {}
        self.source_keys: dict[str, str] = {}
        self.failed: set[int] = set()
        heads: list[npt.NDArray[np.uint64]] = []
        places: list[npt.NDArray[np.int64]] = []
        for path in parts:
            rows = read_columns(path, _PLAIN)
            if rows is None:
                continue
            keys = rows["key"]
            heads.append(_heads(keys))
            places.append((len(self.parts) << _ROW_BITS) + np.arange(len(keys), dtype=np.int64))
            self.parts.append(path)
            for key, kind, name, text in zip(keys, rows["kind"], rows["recording"], rows["sources"], strict=True):
                if kind == "log":
                    self.sources[name] = text
                    self.source_keys.pop(name, None)
                elif kind == "source":
                    self.sources[name], self.source_keys[name] = text, key
            first = (len(self.parts) - 1) << _ROW_BITS
            self.failed |= {first + row for row, failed in enumerate(rows["failed"]) if failed}
        every = np.concatenate(heads) if heads else np.empty(0, np.uint64)
        order = np.argsort(every, kind="stable")
        self._heads = every[order]
        self._places = np.concatenate(places)[order] if places else np.empty(0, np.int64)

    def places(self, keys: Sequence[str]) -> list[int | None]:
        """Return the places of keys; None for a key that is not known."""
        if not len(self._heads):
            return [None] * len(keys)
        heads = _heads(keys)
        at = np.minimum(np.searchsorted(self._heads, heads), len(self._heads) - 1)
        places = np.where(self._heads[at] == heads, self._places[at], -1)
        return [place if place >= 0 else None for place in places.tolist()]


def _heads(keys: Sequence[str]) -> npt.NDArray[np.uint64]:
    """Return the first 64 bits of keys."""
    return np.frombuffer(bytes.fromhex("".join(key[:16] for key in keys)), dtype=">u8").astype(np.uint64)


def _entry(rows: Mapping[str, list[Any]], row: int) -> Entry:
    values = {name: rows[name][row] for name in _NAMES}
    text = values["sources"]
    return Entry(**values | {"sources": () if text == _NO_SOURCES else decoded(text, tuple[SourceFile, ...])})


def require_pyarrow() -> None:
    """Raise UsageError with the next step if pyarrow is not installed."""
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError as fault:
        raise UsageError("--store needs pyarrow", f"install it: {installing('store')}") from fault


def write_part(folder: Path, entries: Sequence[Entry]) -> Path:
    """Write entries to a new part of a store, and return it."""
    import pyarrow as pa

    columns = _columns(entries)
    arrays = [
        _numbers(columns[name]) if name in ("seconds", "failed") else text_column(columns[name]) for name in _NAMES
    ]
    return _write_table(folder / "parts", pa.table(arrays, names=list(_NAMES)))


def _columns(entries: Sequence[Entry]) -> dict[str, list[Any]]:
    columns: dict[str, list[Any]] = {name: [getattr(item, name) for item in entries] for name in _NAMES}
    columns["recording"] = [encodable(name) for name in columns["recording"]]
    columns["sources"] = [encoded(item, tuple[SourceFile, ...]) if item else _NO_SOURCES for item in columns["sources"]]
    return columns


def _numbers(values: Sequence[float]) -> Any:
    import pyarrow as pa

    array = np.array(values)
    if array.dtype == bool:
        packed = np.packbits(array, bitorder="little")
        return pa.BooleanArray.from_buffers(pa.bool_(), len(array), [None, pa.py_buffer(packed)])
    return pa.DoubleArray.from_buffers(pa.float64(), len(array), [None, pa.py_buffer(array.astype(np.float64))])


def _write_table(folder: Path, table: Any) -> Path:
    import pyarrow.parquet as pq

    stream = io.BytesIO()
    pq.write_table(table, stream, compression="zstd", write_page_checksum=True)
    # In the order of their names, the newest is last: it knows the present times of files.
    path = folder / f"{time.time_ns():020d}-{secrets.token_hex(8)}.parquet"
    write_bytes(path, stream.getvalue())
    return path


def read_columns(path: Path, names: Sequence[str]) -> dict[str, list[Any]] | None:
    """Return columns of a part or journal; None if the file is gone or damaged."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        if path.suffix == JOURNAL_SUFFIX:
            return _columns(list(entries_in(path.read_bytes())))
        # `read_table` would import pandas.
        with pq.ParquetFile(pa.BufferReader(path.read_bytes()), page_checksum_verification=True) as file:
            table = file.read(columns=list(names))
    except (OSError, pa.ArrowException):
        return None
    return {name: table[name].to_pylist() for name in names}


def encodable(name: str) -> str:
    """Return the name of a recording without half surrogate pairs, which names that are not UTF-8 have."""
    return name.encode("utf-8", "replace").decode("utf-8")


@dataclass(frozen=True)
class RunRecord:
    """A finished run: when it began and ended [s since 1970], of which benchmark, and how many entries it used.

    `computed` of its `recordings` were computed at least in part, `failed` could not be read.
    """

    began: float
    ended: float
    benchmark: str
    benchmark_sha256: str
    used: int
    recordings: int
    computed: int
    failed: int
    version: str


def write_run(folder: Path, run: RunRecord, keys: Iterable[str]) -> None:
    """Write which entries a run has used."""
    import pyarrow as pa

    values = {item.name: getattr(run, item.name) for item in fields(RunRecord)}
    every = bytes.fromhex("".join(keys))
    column = pa.FixedSizeBinaryArray.from_buffers(
        pa.binary(_KEY_BYTES), len(every) // _KEY_BYTES, [None, pa.py_buffer(every)]
    )
    table = pa.table([column], names=["key"])
    _write_table(folder / "runs", table.replace_schema_metadata({"run": json.dumps(values)}))


def read_runs(folder: Path) -> list[tuple[Path, RunRecord]]:
    """Return the finished runs of a store, the newest first."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    found = []
    for path in (folder / "runs").glob("*.parquet"):
        try:
            metadata = pq.read_schema(pa.BufferReader(path.read_bytes())).metadata or {}
            found.append((path, RunRecord(**parse_own_json(metadata[b"run"]))))
        except (OSError, pa.ArrowException, KeyError, TypeError, ValueError):
            continue
    return sorted(found, key=lambda item: item[1].ended, reverse=True)


def read_speed(parts: Iterable[Path]) -> float | None:
    """Return how much of logs a worker computed per second in the past [bytes/s]; None if nothing is known."""
    size = seconds = 0.0
    for path in parts:
        rows = read_columns(path, ("kind", "sources", "seconds"))
        if rows is None:
            continue
        for kind, text, taken in zip(rows["kind"], rows["sources"], rows["seconds"], strict=True):
            if kind == "log" and taken > 0.0:
                size += sum(item.size for item in decoded(text, tuple[SourceFile, ...]))
                seconds += taken
    return size / seconds if size and seconds else None


def read_keys(path: Path) -> list[Any]:
    """Return the keys in a file of entries, as text, or of a run, as bytes; empty if it is gone or damaged."""
    columns = read_columns(path, ("key",))
    return [] if columns is None else columns["key"]


def require_store(folder: Path) -> None:
    """Raise ConfigurationError if a folder is not a store of this version."""
    mark = folder / _MARK
    if not mark.is_file():
        raise ConfigurationError(f"{folder}: is not a store", "give the folder that was given as --store")
    values = _values(mark)
    if values.get("kind") != _KIND or values.get("schema_version") != _SCHEMA:
        raise ConfigurationError(
            f"{mark}: is not that of a store of this version", "give another folder, or remove this one"
        )


def _create(folder: Path) -> None:
    """Create an empty store, unless the folder is one; raises ConfigurationError for a folder with other content."""
    mark = folder / _MARK
    if mark.is_file():
        return
    if folder.exists() and (not folder.is_dir() or any(True for _ in folder.iterdir())):
        raise ConfigurationError(f"{folder}: is neither a store nor an empty folder", "give another folder")
    for part in ("parts", "runs"):
        (folder / part).mkdir(parents=True, exist_ok=True)
    write_text(mark, json.dumps({"kind": _KIND, "schema_version": _SCHEMA, "created": int(time.time())}) + "\n")


def _values(mark: Path) -> Mapping[str, Any]:
    try:
        values = parse_json(read_bytes(mark, ConfigurationError))
    except ValueError:
        return {}
    return values if isinstance(values, dict) else {}
