"""Read the variables of a .mat file of version 7.3, which is an HDF5 file.

A dataset has MATLAB's dimensions in reverse order, and its attribute MATLAB_class is the variable's class. A struct is
a group; the fields of an array of structs, and cell arrays, are datasets of references; sparse matrices are groups, and
complex numbers compounds: https://www.mathworks.com/help/matlab/import_export/mat-file-versions.html
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.formats.containers.container_checks import check_chunks, check_size
from cdtool.formats.mat.variables import Numbers, Opaque, Value, ValueCount, Variables
from cdtool.formats.mat.version_5 import LONGEST_TEXT

_MAGIC, _HDF5 = b"MATLAB 7.", b"\x89HDF\r\n\x1a\n"
_COMPLEX = ("real", "imag")


def is_version_73(path: Path) -> bool:
    """Return whether the file starts like MATLAB version 7.3: a MATLAB header, followed by HDF5."""
    with path.open("rb") as file:
        head = file.read(512 + len(_HDF5))  # the user block, then HDF5
    return head.startswith(_MAGIC) and head.endswith(_HDF5)


def read_variables(path: Path, h5py: Any, file: Any) -> Variables:
    """Return the variables of an open file, whose numbers can be read as long as it is open."""
    reader = _Version73Reader(path, h5py, file)
    return {name: reader.member(file, name, 0) for name in file if not name.startswith("#")}  # targets of references


class _Version73Reader:
    def __init__(self, path: Path, h5py: Any, file: Any) -> None:
        self._path, self._h5py, self._file = path, h5py, file
        self._count = ValueCount()

    def member(self, group: Any, name: str, level: int) -> Value:
        """Return a member of a group; links are not followed, as they may form a cycle or point to another file."""
        if not isinstance(group.get(name, getlink=True), self._h5py.HardLink):
            return Opaque("link")
        return self._value(group[name], level)

    def _value(self, node: Any, level: int) -> Value:
        if isinstance(node, self._h5py.Group):
            return self._group(node, level)
        matlab_class = _class(node)
        if node.is_virtual or node.external:
            return Opaque("array stored in other files")
        if matlab_class == "function_handle":
            return Opaque("function handle")
        if "MATLAB_object_decode" in node.attrs:
            return Opaque(matlab_class or "object")
        shape = _shape(node)
        if "MATLAB_empty" in node.attrs and 0 < node.size <= 32:  # its values are the dimensions, of MATLAB's 32
            check_chunks(self._path, node.name, node)
            shape = tuple(int(size) for size in node[()].ravel().tolist())
            empty: dict[str, Value] = {"cell": (), "struct": [], "char": ""}
            return empty.get(matlab_class, Numbers(shape if 0 in shape else (0, 0), partial(np.empty, (0, 0))))
        if matlab_class == "char":
            return self._text(node)
        if node.dtype == self._h5py.ref_dtype:
            return tuple(self._targets(node, level))
        is_complex = bool(node.dtype.names == _COMPLEX)
        if node.dtype.kind not in "biuf" and not is_complex:
            return Opaque(matlab_class or "text or a compound")
        return Numbers(shape, partial(self._load, node, shape, is_complex), is_complex)

    def _group(self, group: Any, level: int) -> Value:
        matlab_class = _class(group)
        if "MATLAB_sparse" in group.attrs:
            return Opaque("sparse matrix")
        if "MATLAB_object_decode" in group.attrs or matlab_class not in ("", "struct"):
            return Opaque(matlab_class.replace("function_handle", "function handle") or "object")
        # In the order of HDF5: on damaged bytes, HDF5 may read the variable-length texts of MATLAB_fields without end.
        names = list(group)
        self._count.add(level + 1, len(names))
        members = {name: group.get(name) for name in names if self._is_array_field(group, name)}
        counts = {member.size for member in members.values()}
        if members and len(members) == len(names) and len(counts) == 1:
            fields = {name: list(self._targets(member, level)) for name, member in members.items()}
            return [dict(zip(fields, row, strict=True)) for row in zip(*fields.values(), strict=True)]
        return [{name: self.member(group, name, level + 1) for name in names}]

    def _is_array_field(self, group: Any, name: str) -> bool:
        """Return whether a member is the field of all elements of an array of structs: references without a class."""
        if not isinstance(group.get(name, getlink=True), self._h5py.HardLink):
            return False
        member = group[name]
        return isinstance(member, self._h5py.Dataset) and member.dtype == self._h5py.ref_dtype and not _class(member)

    def _targets(self, dataset: Any, level: int) -> Iterator[Value]:
        """Yield the values that a dataset refers to, in MATLAB's order."""
        if dataset.is_virtual or dataset.external:
            return
        self._count.add(level + 1, dataset.size)
        check_chunks(self._path, dataset.name, dataset)
        # The last dimension of HDF5 is MATLAB's first one, so that the order of both is the same.
        for reference in np.asarray(dataset[()]).ravel():
            yield self._value(self._file[reference], level + 1) if reference else Opaque("damaged reference")

    def _text(self, dataset: Any) -> str:
        if dataset.dtype.kind not in "iu" or not 0 < dataset.size <= LONGEST_TEXT:
            return "" if not dataset.size else "..."
        check_chunks(self._path, dataset.name, dataset)
        codes = np.asarray(dataset[()]).astype("<u2").reshape(dataset.shape[0], -1).T
        return " ".join(np.ascontiguousarray(row).tobytes().decode("utf-16-le", "replace").strip() for row in codes)

    def _load(self, dataset: Any, shape: tuple[int, ...], is_complex: bool) -> npt.NDArray[Any]:
        check_size(self._path, dataset.size)
        check_chunks(self._path, dataset.name, dataset)
        values = dataset[()]
        if is_complex:
            values = values["real"] + 1j * values["imag"]
        return np.asarray(values).T.reshape(shape)


def _class(node: Any) -> str:
    matlab_class = node.attrs.get("MATLAB_class", b"")
    return matlab_class.decode("utf-8", "replace") if isinstance(matlab_class, bytes) else str(matlab_class)


def _shape(dataset: Any) -> tuple[int, ...]:
    """Return MATLAB's dimensions; a dataset with one dimension, written by other tools, is one column."""
    shape = (*dataset.shape[::-1], 1, 1)[: max(2, dataset.ndim)]
    return tuple(int(size) for size in shape) if math.prod(shape) else (0, 0)
