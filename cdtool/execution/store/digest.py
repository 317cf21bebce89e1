"""The digest of everything that determines an outcome: values of any frozen dataclasses, and the code itself."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from pathlib import Path, PurePath
from typing import Any

import numpy as np

from cdtool.base.remote.remote_path import is_remote


def digest_of(*values: Any) -> str:
    """Return the SHA-256 of values: numbers, texts, arrays, and collections and instances of classes of them.

    Raises TypeError for a function, which may do anything.
    """
    text = json.dumps([_plain(item) for item in values], separators=(",", ":"), sort_keys=True)
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


def combined(*digests: str) -> str:
    """Return the SHA-256 of digests, or of other texts without a line end."""
    return hashlib.sha256("\n".join(digests).encode()).hexdigest()


def _plain(value: Any) -> Any:
    """Return a value as JSON values that differ if it differs; a dataclass with the name of its class."""
    if value is None or isinstance(value, str | int | float):
        return value
    if isinstance(value, np.ndarray):
        content = hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()
        return [str(value.dtype), list(value.shape), content]
    if isinstance(value, Mapping):
        return {"mapping": [[_plain(key), _plain(item)] for key, item in value.items()]}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, set | frozenset):
        return sorted(json.dumps(_plain(item), sort_keys=True) for item in value)
    if isinstance(value, PurePath) or is_remote(value):
        return value.as_posix()
    return [f"{type(value).__module__}.{type(value).__qualname__}", _inner(value)]


def _inner(value: Any) -> Any:
    """Return what an instance of a class consists of."""
    if isinstance(value, Enum):
        return _plain(value.value)
    if is_dataclass(value):
        return {item.name: _plain(getattr(value, item.name)) for item in fields(value)}
    if isinstance(value, bytes | np.generic):
        return repr(value)
    if hasattr(value, "__dict__") and not callable(value):
        return _plain(vars(value))
    raise TypeError(f"{value!r} has no digest")


@cache
def code_version() -> str:
    """Return the digest of the code, and of the libraries that it computes with."""
    from importlib.metadata import version

    from cdtool.base.registry import plugin_packages

    digest = hashlib.sha256()
    root = Path(__file__).parents[2]
    for path in sorted(root.rglob("*.py")):
        digest.update(path.read_bytes())
    libraries = {name: version(name) for name in ("numpy", "scipy", "numba")}  # numba takes long to import
    digest.update(json.dumps([libraries, plugin_packages()], sort_keys=True).encode())
    return digest.hexdigest()
