"""MATLAB files of both kinds from one description: by SciPy for version 7, by h5py as MATLAB writes version 7.3.

A dict is a struct, a list of dicts an array of structs, a tuple a cell array, anything else a text or an array.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.io import savemat

from tests.formats.bombs import with_mat_header

CLASSES = {"f8": "double", "f4": "single", "i2": "int16", "u4": "uint32", "i8": "int64", "b1": "logical", "u1": "uint8"}
_COMPLEX = np.dtype([("real", "f8"), ("imag", "f8")])


def save_v7(path: Path, variables: dict[str, object], **options) -> Path:
    """Write variables as version 7 does."""
    savemat(path, {name: _for_scipy(value) for name, value in variables.items()}, **options)
    return path


def _for_scipy(value: object) -> object:
    if isinstance(value, dict):
        return {name: _for_scipy(part) for name, part in value.items()}
    if isinstance(value, tuple):
        cells = np.empty((1, len(value)), dtype=object)
        for i, part in enumerate(value):
            cells[0, i] = _for_scipy(part)
        return cells
    if isinstance(value, list):
        names = list(value[0])
        array = np.empty((1, len(value)), dtype=[(name, object) for name in names])
        for i, element in enumerate(value):
            for name in names:
                array[0, i][name] = _for_scipy(element[name])
        return array
    return value


def save_v73(path: Path, variables: dict[str, object], **options) -> Path:
    """Write variables like MATLAB: reverse dimensions, class as an attribute, texts as numbers, cells as references."""
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in variables.items():
            _put(file, name, value, options)
    return with_mat_header(path)


def _put(group, name: str, value: object, options: dict) -> None:
    import h5py

    if isinstance(value, dict | list):
        inner = group.create_group(name)
        inner.attrs["MATLAB_class"] = np.bytes_("struct")
        for key in value if isinstance(value, dict) else value[0]:
            if isinstance(value, dict):
                _put(inner, key, value[key], options)
            else:
                inner.create_dataset(key, data=_references(group.file, [part[key] for part in value], options))
    elif isinstance(value, tuple):
        cells = group.create_dataset(name, data=_references(group.file, value, options), dtype=h5py.ref_dtype)
        cells.attrs["MATLAB_class"] = np.bytes_("cell")
    elif isinstance(value, str):
        codes = np.array([[ord(letter)] for letter in value], dtype=np.uint16)
        group.create_dataset(name, data=codes).attrs["MATLAB_class"] = np.bytes_("char")
    else:
        _put_array(group, name, np.atleast_2d(np.asarray(value)), options)


def _put_array(group, name: str, array: np.ndarray, options: dict) -> None:
    if not array.size:
        dataset = group.create_dataset(name, data=np.array(array.shape, dtype=np.uint64))
        dataset.attrs["MATLAB_empty"] = np.uint8(1)
    elif array.dtype.kind == "c":
        both = np.empty(array.T.shape, _COMPLEX)
        both["real"], both["imag"] = array.T.real, array.T.imag
        dataset = group.create_dataset(name, data=both, **options)
    else:
        stored = array.T.astype(np.uint8) if array.dtype == bool else array.T
        dataset = group.create_dataset(name, data=stored, **({} if array.size == 1 else options))
    kind = "logical" if array.dtype == bool else CLASSES.get(array.dtype.str[1:], "double")
    dataset.attrs["MATLAB_class"] = np.bytes_(kind)


def _references(file, values, options: dict) -> np.ndarray:
    import h5py

    targets = file.require_group("#refs#")
    found = np.empty((len(values), 1), dtype=h5py.ref_dtype)
    for i, value in enumerate(values):
        name = f"r{len(targets)}"
        targets.create_group(f"taken_{name}")  # what is inside of the value takes other names
        _put(targets, name, value, options)
        found[i, 0] = targets[name].ref
    return found
