"""Values and errors of a file as words for a message, without Python notation; errors of a plug-in with their place."""

from __future__ import annotations

import datetime as dt
import re
import traceback
from pathlib import Path
from typing import Any

from cdtool.base.plain_text import counted, digits, shorten

#: Leaves most of a line to what is wrong with the value.
_LONGEST = 60
_NO_NUMBER = re.compile(r"(?:could not convert string to float|invalid literal for int\(\) with base 10): (.*)")
_WRONG_KIND = (TypeError, AttributeError, IndexError)


def value_in_words(value: Any) -> str:
    """Return a value in words for a message.

    >>> [value_in_words(value) for value in (True, None, "a", 2.5, 1e-300, [1, 2], {"b": 1})]
    ['true', 'empty', "'a'", '2.5', '1e-300', '[1, 2]', 'a table']
    """
    if value is None or isinstance(value, bool):
        return "empty" if value is None else str(value).lower()
    if isinstance(value, str):
        return f"'{shorten(value, _LONGEST)}'"
    if isinstance(value, int | float):
        return digits(value) if not value or 1e-9 <= abs(value) < 1e15 else f"{value:g}"
    if isinstance(value, dt.date | dt.time):
        return str(value)
    if isinstance(value, list | tuple):
        plain = all(isinstance(item, int | float | str) for item in value) and len(value) <= 4
        listed = ", ".join(map(value_in_words, value))
        return f"[{shorten(listed, _LONGEST)}]" if plain else f"a list of {counted(len(value), 'value')}"
    return "a table"


def fault_in_words(fault: Exception) -> str:
    """Return why values of a file are invalid, from the Python exception that reading them raised.

    >>> fault_in_words(KeyError("unit")), fault_in_words(TypeError("'int' object is not iterable"))
    ("'unit' is missing", 'a value has the wrong type')
    """
    if isinstance(fault, KeyError) and fault.args:
        return f"'{fault.args[0]}' is missing"
    if isinstance(fault, _WRONG_KIND) or not str(fault):
        return "a value has the wrong type"
    if match := _NO_NUMBER.fullmatch(str(fault)):
        return f"{match[1]} is not a number"
    return str(fault)


def fault_and_place(fault: Exception) -> str:
    """Return an exception of a plug-in with the file and line that raised it."""
    frame = traceback.extract_tb(fault.__traceback__)[-1]
    return f"{fault!r} in {Path(frame.filename).name}, line {frame.lineno}"
