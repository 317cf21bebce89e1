"""MATLAB .mat files: variables of numbers as columns. Versions 5 to 7 by scipy, 7.3 (HDF5) by h5py."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from cdtool.channels import ChannelMap
from cdtool.columns import Column, as_float64
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.findings.containers import RowsAsColumns, VariableLeftOut
from cdtool.formats.column_names import wanted_keys
from cdtool.formats.container_checks import check_chunks, check_size, library, one_line_errors
from cdtool.formats.mat_check import MAGIC, check_complete
from cdtool.formats.source import Source

_NUMERIC = ("double", "single", "logical", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)))
_V73 = b"MATLAB 7."
_HDF5, _USER_BLOCK = b"\x89HDF\r\n\x1a\n", 512
_COMPLEX = ("real", "imag")
_MOST_DIMENSIONS = 32


@dataclass(frozen=True)
class Mat:
    """MATLAB files: a vector is a column, a matrix the columns `name[0]`, `name[1]` and so on."""

    name: ClassVar[str] = "mat"
    suffixes: ClassVar[tuple[str, ...]] = (".mat",)

    def sniff(self, path: Path) -> bool:
        """Return whether the file starts like a MATLAB file of version 5 to 7.3."""
        with path.open("rb") as file:
            return file.read(len(MAGIC)) == MAGIC or _is_v73(path)

    def columns(self, path: Path, wanted: ChannelMap | None = None) -> Source:
        """Return the columns that `wanted` names, or all columns; raises RecordingError."""
        shapes, others = _contents(path)
        names = tuple(name for variable, shape in shapes.items() for name in _names(variable, shape))
        keys = list(names) if wanted is None else wanted_keys(path, wanted, names)
        scalars = [variable for variable, shape in shapes.items() if not _names(variable, shape)]
        read = [variable for variable, shape in shapes.items() if set(_names(variable, shape)) & set(keys)]
        values = _load(path, {variable: shapes[variable] for variable in (*read, *scalars)})
        columns: dict[str, Column] = {}
        findings = [Finding(VariableLeftOut(name, _with_article(kind)), severity="note") for name, kind in others]
        for variable in read:
            array = np.asarray(values[variable])
            if np.iscomplexobj(array):
                findings.append(Finding(VariableLeftOut(variable, "complex"), severity="note"))
                continue
            table = array.reshape(-1, 1) if 1 in array.shape else array
            if table.shape[0] < table.shape[1]:
                table = table.T
                findings.append(Finding(RowsAsColumns("variable", variable, *array.shape), severity="note"))
            for i, key in enumerate(_names(variable, shapes[variable])):
                if key in keys:
                    columns[key] = Column(key, as_float64(table[:, i]))
        not_read = [key for key in keys if key not in columns]
        if wanted is not None and not_read:
            raise RecordingError(f"{path}: column '{not_read[0]}' is complex", "save its real part")
        if not columns:
            raise RecordingError(f"{path}: has no vector or matrix of numbers", "list its variables with `whos`")
        details = {variable: f"{np.asarray(values[variable]).ravel()[0]:g}" for variable in scalars}
        return Source(path, self.name, columns, findings=tuple(findings), details=details, names=names)


def _names(variable: str, shape: tuple[int, int]) -> list[str]:
    """Return the names of a variable's columns; empty for a scalar."""
    if shape == (1, 1):
        return []
    if 1 in shape:
        return [variable]
    return [f"{variable}[{i}]" for i in range(min(shape))]


def _with_article(kind: str) -> str:
    return f"{'an' if kind.startswith(('a', 'e', 'i', 'o', 'u', '8 ', '11 ', '18 ')) else 'a'} {kind}"


def _contents(path: Path) -> tuple[dict[str, tuple[int, int]], list[tuple[str, str]]]:
    """Return the numeric variables with their shapes, and the other variables with their kinds."""
    from scipy.io import whosmat

    if _is_v73(path):
        return _contents_of_v73(path)
    check_complete(path)
    shapes: dict[str, tuple[int, int]] = {}
    others: list[tuple[str, str]] = []
    try:
        listed = whosmat(str(path), appendmat=False)
    except Exception as fault:  # damaged bytes cause errors of any type
        raise _unreadable(path, fault) from fault
    for name, shape, kind in listed:
        if kind in _NUMERIC and len(shape) == 2 and 0 not in shape:
            shapes[name] = (shape[0], shape[1])
        else:
            described = f"{' x '.join(map(str, shape))} array" if kind in _NUMERIC else kind
            others.append((name, described))
    return shapes, others


def _load(path: Path, variables: dict[str, tuple[int, int]]) -> dict[str, Any]:
    from scipy.io import loadmat

    if _is_v73(path):
        return _load_v73(path, variables)
    try:
        # Only variables of numbers are requested, so that scipy never constructs a struct, object or function.
        values: dict[str, Any] = loadmat(str(path), appendmat=False, variable_names=list(variables))
    except Exception as fault:  # as above
        raise _unreadable(path, fault) from fault
    for variable, shape in variables.items():
        value = np.asarray(values.get(variable))
        if value.dtype.kind not in "biufc" or value.shape != shape:
            raise RecordingError(
                f"{path}: damaged: variable '{variable}' differs from its declaration", "save it again with -v7"
            )
    return values


def _unreadable(path: Path, fault: Exception) -> RecordingError:
    reason = " ".join(f"{type(fault).__name__}: {fault}".split())[:200]
    return RecordingError(f"{path}: damaged or not a MATLAB file: {reason}", "save it again with -v7")


def _is_v73(path: Path) -> bool:
    """Return whether the file starts like MATLAB version 7.3: a MATLAB header, followed by HDF5."""
    with path.open("rb") as file:
        head = file.read(_USER_BLOCK + len(_HDF5))
    return head.startswith(_V73) and head.endswith(_HDF5)


def _contents_of_v73(path: Path) -> tuple[dict[str, tuple[int, int]], list[tuple[str, str]]]:
    """Return the numeric variables with their MATLAB shapes, and the other variables with their kinds.

    A dataset has MATLAB's dimensions in reverse order, and its attribute MATLAB_class is the variable's class. Structs
    and sparse matrices are groups; complex numbers are compounds:
    https://www.mathworks.com/help/matlab/import_export/mat-file-versions.html
    """
    shapes: dict[str, tuple[int, int]] = {}
    others: list[tuple[str, str]] = []
    with _opened(path) as (h5py, file):
        for name in file:
            if name.startswith("#"):  # targets of references in cells and objects
                continue
            if not isinstance(file.get(name, getlink=True), h5py.HardLink):
                others.append((name, "link"))
                continue
            node = file[name]
            kind = _kind(node) if isinstance(node, h5py.Dataset) else _group_kind(node)
            if kind:
                others.append((name, kind))
            else:
                shapes[name] = _shape(node)
    return shapes, others


def _load_v73(path: Path, variables: Collection[str]) -> dict[str, npt.NDArray[Any]]:
    """Return the values of these variables in MATLAB's shape.

    Raises RecordingError if the file is damaged, or is a decompression bomb.
    """
    with _opened(path) as (_, file):
        datasets = {name: file[name] for name in variables}
        check_size(path, sum(dataset.size * (1 + _is_complex(dataset)) for dataset in datasets.values()))
        for name, dataset in datasets.items():
            check_chunks(path, name, dataset)
        return {name: _values(dataset) for name, dataset in datasets.items()}


@contextmanager
def _opened(path: Path) -> Iterator[tuple[Any, Any]]:
    try:
        h5py = library("h5py", "hdf5", path)
    except RecordingError as fault:
        raise RecordingError(
            f"{path}: is a MATLAB 7.3 (HDF5) file, and h5py is not installed",
            f"{fault.hint}; or save it in MATLAB with save(name, ..., '-v7')",
        ) from fault
    with one_line_errors(path, "a MATLAB 7.3 file"), h5py.File(path, "r") as file:
        yield h5py, file


def _kind(dataset: Any) -> str:
    """Return the kind of a dataset; empty for a vector, a matrix or a single number."""
    matlab_class = _class(dataset)
    if dataset.is_virtual or dataset.external:
        return "array stored in other files"
    if matlab_class in ("char", "cell", "struct", "function_handle") or "MATLAB_object_decode" in dataset.attrs:
        return matlab_class.replace("_handle", "")
    if "MATLAB_empty" in dataset.attrs and 0 < dataset.size <= _MOST_DIMENSIONS:  # its values are the dimensions
        return f"{' x '.join(map(str, dataset[()].ravel().tolist()))} array"
    if dataset.dtype.kind not in "biuf" and not _is_complex(dataset):
        return matlab_class or "text or a compound"
    not_a_matrix = dataset.ndim > 2 or 0 in dataset.shape
    return f"{' x '.join(map(str, dataset.shape[::-1]))} array" if not_a_matrix else ""


def _group_kind(group: Any) -> str:
    return "sparse" if "MATLAB_sparse" in group.attrs else _class(group) or "struct"


def _class(node: Any) -> str:
    matlab_class = node.attrs.get("MATLAB_class", b"")
    return matlab_class.decode("utf-8", "replace") if isinstance(matlab_class, bytes) else str(matlab_class)


def _is_complex(dataset: Any) -> bool:
    return bool(dataset.dtype.names == _COMPLEX)


def _shape(dataset: Any) -> tuple[int, int]:
    """Return MATLAB's rows and columns; a dataset with one dimension, written by other tools, is one column."""
    rows, *columns = (*dataset.shape[::-1], 1, 1)[: max(2, dataset.ndim)]
    return int(rows), math.prod(columns)


def _values(dataset: Any) -> npt.NDArray[Any]:
    values = dataset[()]
    if _is_complex(dataset):
        values = values["real"] + 1j * values["imag"]
    return np.asarray(values).T.reshape(_shape(dataset))
