"""Checks that the readers of containers share: optional library, declared sizes, errors of a library in one line."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

from cdtool.base.errors import CdtoolError, RecordingError, installing
from cdtool.base.findings import Finding, Severity

# A file that unpacks to more than this many bytes and to more than this multiple of its own size is refused.
_FREE, _RATIO = 256 * 2**20, 200
# HDF5 filters that do not compress: shuffle, Fletcher32 checksum.
_FILTERS_WITHOUT_COMPRESSION = (2, 3)


def library(module: str, extra: str) -> Any:
    """Return an optional library; raises RecordingError that names the extra if the library is not installed."""
    try:
        return import_module(module)
    except ImportError as fault:
        raise RecordingError(f"{module.partition('.')[0]} is not installed", installing(extra)) from fault


def check_size(path: Path, values: int) -> None:
    """Raise RecordingError if a file declares far more numbers than a log of its size can contain."""
    declared = min(8 * values, 2**63)  # a product of damaged dimensions may exceed every float
    if declared > _FREE and declared > _RATIO * (size := path.stat().st_size):
        raise RecordingError(
            f"unpacks to {declared / 2**20:.0f} MiB, {declared / max(size, 1):.0f} times its size: refused",
            "name fewer columns in the machine file, or save it without compression",
        )


def check_chunks(path: Path, name: str, dataset: Any) -> None:
    """Raise RecordingError if an HDF5 dataset is compressed twice, or has chunks that are lost or too large.

    HDF5 decompresses whole chunks even if only a part is read, and each compression may shrink zeros to a thousandth.
    In place of a chunk whose address is lost, or that was never written, it reads zeros.
    """
    check_size(path, math.prod(dataset.chunks or ()) * dataset.dtype.itemsize // 8)
    properties = dataset.id.get_create_plist()
    filters = [properties.get_filter(i)[0] for i in range(properties.get_nfilters())]
    if sum(number not in _FILTERS_WITHOUT_COMPRESSION for number in filters) > 1:
        raise RecordingError(f"dataset '{name}' is compressed more than once: refused", "save it again")
    if dataset.chunks:
        found: set[tuple[int, ...]] = set()
        dataset.id.chunk_iter(lambda chunk: found.add(chunk.chunk_offset) if chunk.size else None)
        stored = len(found)
        parts = math.prod(math.ceil(rows / most) for rows, most in zip(dataset.shape, dataset.chunks, strict=True))
    else:
        stored, parts = min(dataset.id.get_storage_size(), 1), min(dataset.size, 1)
    if stored < parts:
        lost = f"dataset '{name}': {parts - stored} of {parts} chunks are not in the file: refused"
        raise RecordingError(lost, "copy it again, or save it without the rows that were never written")


@contextmanager
def open_hdf5(path: Path, kind: str) -> Iterator[tuple[Any, Any]]:
    """Yield h5py and an open file; raises RecordingError if it is damaged, or longer than it states."""
    h5py = library("h5py", "hdf5")
    with one_line_errors(kind), h5py.File(path, "r") as file:
        with path.open("rb") as raw:
            raw.seek(file.userblock_size + 8)  # behind the signature
            head = raw.read(40)
        # HDF5 itself refuses a shorter file only.
        more = path.stat().st_size - int.from_bytes(head[20:28] if head[0] > 1 else head[32:], "little")
        if more > 0:
            hint = "copy it again; if its writer was killed, h5clear of HDF5 keeps what was flushed before"
            raise RecordingError(f"damaged: {more} bytes longer than it states", hint)
        yield h5py, file


@contextmanager
def one_line_errors(kind: str) -> Iterator[None]:
    """Raise any error of a library as one RecordingError."""
    try:
        yield
    except (CdtoolError, KeyboardInterrupt):
        raise
    except Exception as fault:  # damaged bytes cause errors of any type
        reason = " ".join(f"{type(fault).__name__}: {fault}".split())[:200]
        raise RecordingError(f"damaged or not {kind}: {reason}", "copy or save it again") from fault


def left_out_finding(name: str, kind: str) -> Finding:
    """Return the note on a column that is left out because its values are not numbers."""
    return Finding("column_left_out", "", {"column": name, "what": kind})


def messages_of(library: str, printed: str, severity: Severity = "warning") -> list[Finding]:
    """Return the first lines that a library printed about a file, each once."""
    lines = dict.fromkeys(" ".join(line.split())[:200] for line in printed.splitlines() if line.strip())
    return [Finding("library_message", "", {"library": library, "text": line}, severity) for line in list(lines)[:5]]
