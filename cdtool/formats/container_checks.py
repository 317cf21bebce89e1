"""What the readers of other containers share: their library, sizes that a small file declares, one line an error."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.errors import CdtoolError, RecordingError
from cdtool.findings import Finding
from cdtool.findings.containers import ColumnLeftOut, RoundedColumn
from cdtool.recording import FloatArray

# Above this many bytes, and this many times its own size, a file unpacks to more than any log: it is refused.
_FREE, _RATIO = 256 * 2**20, 200
_LARGEST_EXACT = 2**53
# HDF5's filters that only rearrange or check bytes: shuffle, Fletcher's checksum.
_NO_PACKERS = (2, 3)


def library(module: str, extra: str, path: Path) -> Any:
    """An optional library; raises RecordingError that names the extra where it is absent."""
    try:
        return import_module(module)
    except ImportError as fault:
        raise RecordingError(
            f"{path}: {module.partition('.')[0]} is not installed", f"pip install 'cdtool[{extra}]'"
        ) from fault


def check_size(path: Path, values: int) -> None:
    """Refuse a file that declares far more numbers than a log of its size holds; raises RecordingError."""
    size, declared = path.stat().st_size, 8 * values
    if declared > _FREE and declared > _RATIO * size:
        raise RecordingError(
            f"{path}: unpacks to {declared / 2**20:.0f} MiB, {declared / max(size, 1):.0f} times its size: refused",
            "name fewer columns in the machine file, or save it without compression",
        )


def check_chunks(path: Path, name: str, dataset: Any) -> None:
    """Refuse an HDF5 dataset that is packed twice, or in chunks far larger than its file; raises RecordingError.

    A chunk is unpacked as a whole, whatever is read of it, and each packing may shrink zeros to a thousandth.
    """
    check_size(path, math.prod(dataset.chunks or ()) * dataset.dtype.itemsize // 8)
    packing = dataset.id.get_create_plist()
    packers = [packing.get_filter(i)[0] for i in range(packing.get_nfilters())]
    if sum(packer not in _NO_PACKERS for packer in packers) > 1:
        raise RecordingError(f"{path}: dataset '{name}' is compressed more than once: refused", "save it again")


@contextmanager
def one_line_errors(path: Path, kind: str) -> Iterator[None]:
    """Any error of a library on a damaged file becomes one RecordingError."""
    try:
        yield
    except (CdtoolError, KeyboardInterrupt):
        raise
    except Exception as fault:  # damaged bytes provoke all kinds of errors
        reason = " ".join(f"{type(fault).__name__}: {fault}".split())[:200]
        raise RecordingError(f"{path}: damaged or not {kind}: {reason}", "copy or save it again") from fault


def as_numbers(name: str, values: npt.NDArray[Any], findings: list[Finding]) -> FloatArray:
    """Integers, booleans and floats as float64; integers that float64 cannot hold are told."""
    if values.dtype.kind in "iu" and values.size:
        largest = max(abs(int(values.min())), abs(int(values.max())))
        if largest > _LARGEST_EXACT:
            findings.append(Finding(RoundedColumn(), name))
    return np.ascontiguousarray(values, dtype=np.float64)


def left_out(name: str, kind: str) -> Finding:
    """The note on a column that holds no numbers."""
    return Finding(ColumnLeftOut(name, kind), severity="note")
