"""MATLAB 7.3 files, which are HDF5 inside: their variables of numbers, by h5py.

A dataset's dimensions are MATLAB's in reverse, its attribute MATLAB_class is the variable's class; structs and sparse
matrices are groups, complex numbers compounds. https://www.mathworks.com/help/matlab/import_export/mat-file-versions.html
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.errors import RecordingError
from cdtool.formats.container_checks import check_chunks, check_size, library, one_line_errors

MAGIC = b"MATLAB 7."
_HDF5, _USER_BLOCK = b"\x89HDF\r\n\x1a\n", 512
_COMPLEX = ("real", "imag")
_MOST_DIMENSIONS = 32


def is_v73(path: Path) -> bool:
    """True if the file starts as MATLAB writes version 7.3: its own header, HDF5 behind it."""
    with path.open("rb") as file:
        head = file.read(_USER_BLOCK + len(_HDF5))
    return head.startswith(MAGIC) and head.endswith(_HDF5)


def contents(path: Path) -> tuple[dict[str, tuple[int, int]], list[tuple[str, str]]]:
    """The numeric variables with their shapes as MATLAB has them, and the others with their kind."""
    shapes: dict[str, tuple[int, int]] = {}
    others: list[tuple[str, str]] = []
    with _opened(path) as (h5py, file):
        for name in file:
            if name.startswith("#"):  # what cells and objects refer to
                continue
            if not isinstance(file.get(name, getlink=True), h5py.HardLink):
                others.append((name, "link"))
                continue
            item = file[name]
            kind = _kind(item) if isinstance(item, h5py.Dataset) else _group_kind(item)
            if kind:
                others.append((name, kind))
            else:
                shapes[name] = _shape(item)
    return shapes, others


def load(path: Path, variables: Collection[str]) -> dict[str, npt.NDArray[Any]]:
    """The values of variables that `contents` gave, as MATLAB has them; raises RecordingError for damage or a bomb."""
    with _opened(path) as (_, file):
        found = {name: file[name] for name in variables}
        check_size(path, sum(dataset.size * (1 + _is_complex(dataset)) for dataset in found.values()))
        for name, dataset in found.items():
            check_chunks(path, name, dataset)
        return {name: _values(dataset) for name, dataset in found.items()}


@contextmanager
def _opened(path: Path) -> Iterator[tuple[Any, Any]]:
    try:
        h5py = library("h5py", "hdf5", path)
    except RecordingError as fault:
        raise RecordingError(
            f"{path}: is a MATLAB 7.3 (HDF5) file, and h5py is not installed",
            f"{fault.hint}; or save it with: save(name, ..., '-v7')",
        ) from fault
    with one_line_errors(path, "a MATLAB 7.3 file"), h5py.File(path, "r") as file:
        yield h5py, file


def _kind(dataset: Any) -> str:
    """What a dataset is if it is no vector, matrix or single number; else nothing."""
    told = _class(dataset)
    if dataset.is_virtual or dataset.external:
        return "array kept in other files"
    if told in ("char", "cell", "struct", "function_handle") or "MATLAB_object_decode" in dataset.attrs:
        return told.replace("_handle", "")
    if "MATLAB_empty" in dataset.attrs and 0 < dataset.size <= _MOST_DIMENSIONS:  # its values are its dimensions
        return f"{' x '.join(map(str, dataset[()].ravel().tolist()))} array"
    if dataset.dtype.kind not in "biuf" and not _is_complex(dataset):
        return told or "text or a compound"
    odd = dataset.ndim > 2 or 0 in dataset.shape
    return f"{' x '.join(map(str, dataset.shape[::-1]))} array" if odd else ""


def _group_kind(group: Any) -> str:
    return "sparse" if "MATLAB_sparse" in group.attrs else _class(group) or "struct"


def _class(item: Any) -> str:
    told = item.attrs.get("MATLAB_class", b"")
    return told.decode("utf-8", "replace") if isinstance(told, bytes) else str(told)


def _is_complex(dataset: Any) -> bool:
    return bool(dataset.dtype.names == _COMPLEX)


def _shape(dataset: Any) -> tuple[int, int]:
    """MATLAB's rows and columns; what other tools wrote with one dimension is a column."""
    rows, *columns = (*dataset.shape[::-1], 1, 1)[: max(2, dataset.ndim)]
    return int(rows), math.prod(columns)


def _values(dataset: Any) -> npt.NDArray[Any]:
    values = dataset[()]
    if _is_complex(dataset):
        values = values["real"] + 1j * values["imag"]
    return np.asarray(values).T.reshape(_shape(dataset))
