"""Strict JSON: without NaN or infinity, unencodable text or characters that a terminal would interpret."""

from __future__ import annotations

import json
import math
import re
from typing import Any

# JSON allows these unescaped. Half a surrogate pair, from a file name that is not UTF-8, cannot be encoded.
_ACTIVE = re.compile("[\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff\ud800-\udfff]")


def strict_json(value: Any, *, compact: bool = False) -> str:
    """Return JSON of mappings, sequences and plain values: null for non-finite numbers, active characters escaped."""
    layout: dict[str, Any] = {"separators": (",", ":")} if compact else {"indent": 1}
    return passive(json.dumps(finite(value), allow_nan=False, ensure_ascii=False, **layout))


def passive(text: str) -> str:
    """Return JSON with active characters escaped."""
    return _ACTIVE.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def finite(value: Any) -> Any:
    """Return the value with None for every number that is not finite."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {str(key): finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        # Columns of traces are a million plain numbers: avoid a call for each.
        return [
            item if type(item) is int or (type(item) is float and math.isfinite(item)) else finite(item)
            for item in value
        ]
    return value
