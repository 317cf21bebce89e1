"""MATLAB .mat files: variables of numbers as columns. Versions 5 to 7 by scipy, 7.3 (HDF5) by h5py."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from cdtool.channels import ChannelMap
from cdtool.columns import Column
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.findings.containers import RowsAsColumns, VariableLeftOut
from cdtool.formats import mat_hdf5
from cdtool.formats.column_names import wanted_keys
from cdtool.formats.mat_check import MAGIC, check_whole
from cdtool.formats.source import Source

_NUMERIC = ("double", "single", "logical", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)))


@dataclass(frozen=True)
class Mat:
    """MATLAB files: a vector is a column, a matrix the columns `name[0]`, `name[1]` and so on."""

    name: ClassVar[str] = "mat"
    suffixes: ClassVar[tuple[str, ...]] = (".mat",)

    def sniff(self, path: Path) -> bool:
        """True if the file starts as MATLAB writes it (versions 5 to 7.3)."""
        with path.open("rb") as file:
            return file.read(len(MAGIC)) == MAGIC or mat_hdf5.is_v73(path)

    def columns(self, path: Path, wanted: ChannelMap | None = None) -> Source:
        """The columns that `wanted` names, or all; raises RecordingError."""
        shapes, others = _contents(path)
        names = tuple(name for variable, shape in shapes.items() for name in _names(variable, shape))
        keys = list(names) if wanted is None else wanted_keys(path, wanted, names)
        scalars = [variable for variable, shape in shapes.items() if not _names(variable, shape)]
        read = [variable for variable, shape in shapes.items() if set(_names(variable, shape)) & set(keys)]
        values = _load(path, {variable: shapes[variable] for variable in (*read, *scalars)})
        columns: dict[str, Column] = {}
        findings = [Finding(VariableLeftOut(name, f"a {kind}"), severity="note") for name, kind in others]
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
                    columns[key] = Column(key, np.ascontiguousarray(table[:, i], dtype=np.float64))
        lost = [key for key in keys if key not in columns]
        if wanted is not None and lost:
            raise RecordingError(f"{path}: column '{lost[0]}' is complex", "save its real part")
        if not columns:
            raise RecordingError(f"{path}: holds no vector or matrix of numbers", "see `whos` in MATLAB")
        details = {variable: f"{np.asarray(values[variable]).ravel()[0]:g}" for variable in scalars}
        return Source(path, self.name, columns, findings=tuple(findings), details=details, names=names)


def _names(variable: str, shape: tuple[int, int]) -> list[str]:
    """The columns of a variable; none for a scalar."""
    if shape == (1, 1):
        return []
    if 1 in shape:
        return [variable]
    return [f"{variable}[{i}]" for i in range(min(shape))]


def _contents(path: Path) -> tuple[dict[str, tuple[int, int]], list[tuple[str, str]]]:
    """The numeric variables with their shapes, and the others with their kind."""
    from scipy.io import whosmat

    if mat_hdf5.is_v73(path):
        return mat_hdf5.contents(path)
    check_whole(path)
    shapes: dict[str, tuple[int, int]] = {}
    others: list[tuple[str, str]] = []
    try:
        listed = whosmat(str(path), appendmat=False)
    except Exception as fault:  # damaged bytes provoke all kinds of errors
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

    if mat_hdf5.is_v73(path):
        return mat_hdf5.load(path, variables)
    try:
        # Only variables of numbers are named: no struct, object or function is ever built.
        values: dict[str, Any] = loadmat(str(path), appendmat=False, variable_names=list(variables))
    except Exception as fault:  # as above
        raise _unreadable(path, fault) from fault
    for variable, shape in variables.items():
        value = np.asarray(values.get(variable))
        if value.dtype.kind not in "biufc" or value.shape != shape:
            raise RecordingError(
                f"{path}: damaged: variable '{variable}' is not as announced", "save it again with -v7"
            )
    return values


def _unreadable(path: Path, fault: Exception) -> RecordingError:
    reason = " ".join(f"{type(fault).__name__}: {fault}".split())[:200]
    return RecordingError(f"{path}: damaged or not a MATLAB file: {reason}", "save it again with -v7")
