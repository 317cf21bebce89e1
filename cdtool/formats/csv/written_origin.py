"""Where the times of a table count from that cdtool convert wrote as text: its head says so."""

from __future__ import annotations

import math
from itertools import takewhile
from pathlib import Path

from cdtool.formats.groups import PREFIX

_MARK = b"# " + PREFIX.encode()
_KEY = _MARK + b"origin_s: "
# A long list of parts, or of what was lost, stands behind it.
_HEAD = 1 << 16


def written_origin(path: Path) -> float:
    """Return the origin [s] that stands in a text table's own head; 0 where there is none."""
    with path.open("rb") as file:
        head = file.read(_HEAD)
    lines = takewhile(lambda line: line.startswith(_MARK), head.splitlines())
    written = next((line.removeprefix(_KEY) for line in lines if line.startswith(_KEY)), b"0")
    try:
        origin = float(written)
    except ValueError:  # somebody has edited it
        return 0.0
    return origin if math.isfinite(origin) else 0.0
