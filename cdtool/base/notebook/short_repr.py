"""A short `repr` for values with arrays or many rows: a notebook shows one line, not a screen of numbers."""

from __future__ import annotations

from collections.abc import Mapping, Set
from dataclasses import MISSING, Field, fields
from enum import Enum
from pathlib import PurePath
from typing import Any

import numpy as np

# A line of a notebook or a terminal.
_LONGEST = 150
_LONGEST_TEXT = 40
# A tuple of more items is counted, not shown.
_MOST_ITEMS = 3


def short_repr(value: Any) -> str:
    """Return a dataclass in one short line: texts and numbers as they are, the size of everything else.

    Fields with their default value are left out; fields that do not fit are replaced by "...". Used as the `__repr__`
    of classes that contain arrays or many rows.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class Curve:
    ...     time: np.ndarray
    ...     unit: str
    ...     gaps: int = 0
    ...     __repr__ = short_repr
    >>> Curve(np.zeros(7200), "m/s")
    Curve(time=<7200 floats>, unit='m/s')
    """
    name, room = type(value).__qualname__, _LONGEST
    shown: list[str] = []
    for item in fields(value):
        held = getattr(value, item.name)
        if _is_default(item, held):
            continue
        part = f"{item.name}={_short(held)}"
        room -= len(part) + 2
        if room < 0:
            shown.append("...")
            break
        shown.append(part)
    return f"{name}({', '.join(shown)})"


def _is_default(item: Field[Any], held: Any) -> bool:
    if isinstance(held, np.ndarray) or not (item.default is not MISSING or item.default_factory is not MISSING):
        return False
    if item.default is not MISSING:
        return held is item.default or (isinstance(held, str | int | float | tuple) and _equal(held, item.default))
    return isinstance(held, Mapping | list | tuple) and not held


def _equal(held: Any, default: Any) -> bool:
    """Return whether a plain value is the default; a tuple only if both are empty: it may contain arrays."""
    return not held and not default if isinstance(held, tuple) else bool(held == default)


def _short(held: Any) -> str:
    """Return a value of a field in few letters."""
    if isinstance(held, np.ndarray):
        return f"<{' x '.join(map(str, held.shape)) or '1'} {_KINDS.get(held.dtype.kind, held.dtype.name)}>"
    if isinstance(held, Enum):
        return held.name
    if isinstance(held, float):
        return f"{float(held):.6g}"
    if isinstance(held, str | PurePath):
        text = str(held)
        return repr(text if len(text) <= _LONGEST_TEXT else f"...{text[-_LONGEST_TEXT:]}")
    if held is None or isinstance(held, bool | int):
        return repr(held)
    if isinstance(held, Mapping | Set | list | tuple):
        return _of_items(held)
    size = f" of {len(held)}" if hasattr(held, "__len__") else ""
    return f"<{type(held).__qualname__}{size}>"


def _of_items(held: Any) -> str:
    """Return a short tuple of names or numbers as it is, the keys of a short mapping, else the number of items."""
    items = list(held)
    plain = all(isinstance(item, str | int | float | None) for item in items)
    text = ", ".join(_short(item) for item in items) if plain and len(items) <= _MOST_ITEMS else ""
    if not items or (text and len(text) <= _LONGEST_TEXT):
        return f"{{{text}}}" if isinstance(held, Mapping) else f"[{text}]"
    kind = "entries" if isinstance(held, Mapping) else "items"
    return f"<{len(items)} {kind if len(items) != 1 else kind[:-1].replace('entrie', 'entry')}>"


_KINDS = {"f": "floats", "i": "integers", "u": "integers", "b": "booleans"}
