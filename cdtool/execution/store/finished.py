"""The results of the last finished runs in a store, each a file of named texts under the key of what determines them.

    finished/KEY.parquet      a row for each text, in order

They save gathering and statistics when nothing has changed. A file is complete or not there; of a file that is gone or
damaged nothing is lost.
"""

from __future__ import annotations

import io
import os
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path

from cdtool.base.files.writing import write_bytes
from cdtool.base.remote.remote_path import is_remote
from cdtool.execution.store.text_column import text_column

# Files that are kept: the newest.
_MOST = 4
_FOLDER = "finished"
_NAMES = ("name", "text")


def write_finished(folder: Path, key: str, texts: Iterable[tuple[str, str]]) -> None:
    """Write names and texts, of which one is in memory at a time, and remove the oldest files."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    stream = io.BytesIO()
    schema = pa.schema([(name, pa.large_string()) for name in _NAMES])
    with pq.ParquetWriter(stream, schema, compression="zstd", write_page_checksum=True) as writer:
        for text in texts:
            writer.write_table(pa.Table.from_arrays([text_column([part]) for part in text], schema=schema))
    (folder / _FOLDER).mkdir(parents=True, exist_ok=True)
    write_bytes(_path(folder, key), stream.getvalue())
    for path in finished(folder)[_MOST:]:
        path.unlink(missing_ok=True)


def read_finished(folder: Path, key: str) -> Iterator[tuple[str, str]]:
    """Yield the names and texts; none if there is no such file. Raises ValueError for a damaged file."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        content = _path(folder, key).read_bytes()
    except OSError:
        return
    try:
        with pq.ParquetFile(pa.BufferReader(content), page_checksum_verification=True) as file:
            for number in range(file.num_row_groups):
                held = file.read_row_group(number)
                yield from zip(*(held[name].to_pylist() for name in _NAMES), strict=True)
    except (pa.ArrowException, OSError, KeyError) as fault:
        raise ValueError(f"damaged: {fault}") from fault


def mark_used(folder: Path, key: str) -> None:
    """Make a file the newest one; at a URL its age cannot be changed."""
    path = _path(folder, key)
    if not is_remote(path):
        with suppress(OSError):
            os.utime(path)


def finished(folder: Path) -> list[Path]:
    """Return the files of finished runs, the newest first."""
    found = []
    for path in list((folder / _FOLDER).glob("*.parquet")):
        with suppress(OSError):  # removed by another process
            found.append((path.stat().st_mtime, path))
    return [path for _, path in sorted(found, reverse=True)]


def _path(folder: Path, key: str) -> Path:
    return folder / _FOLDER / f"{key}.parquet"
