"""Where the times of a table count from that cdtool convert wrote as text: its head says so."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import takewhile

from cdtool.formats.groups import PREFIX
from cdtool.formats.source import Source

_MARK = b"# " + PREFIX.encode()
_KEY = _MARK + b"origin_s: "
# A long list of parts, or of what was lost, stands behind it.
_HEAD = 1 << 16


def with_written_origin(source: Source) -> Source:
    """The source with the `origin` [s] that stands in a text table's own head; any other source as it is."""
    if source.format != "csv" or source.origin:
        return source
    with source.path.open("rb") as file:
        head = file.read(_HEAD)
    told = takewhile(lambda line: line.startswith(_MARK), head.splitlines())
    found = next((line.removeprefix(_KEY) for line in told if line.startswith(_KEY)), b"0")
    try:
        origin = float(found)
    except ValueError:  # somebody has edited it
        return source
    return replace(source, origin=origin) if math.isfinite(origin) else source
