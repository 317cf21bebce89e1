"""ROS 1 serialisation: little-endian, without alignment (MCAP, "Well-known message encodings"; http://wiki.ros.org/roscpp).

An int64 or uint64 beyond 2^53 is rounded to the nearest float64.
"""

from __future__ import annotations

from cdtool.messages.columns.cdr import WalkFinder
from cdtool.messages.columns.typed import TypedDecoder
from cdtool.messages.layouts.layout import Schema


def ros1_decoder(schema: Schema) -> TypedDecoder:
    """The decoder of ROS 1 messages."""
    return TypedDecoder(schema, WalkFinder(schema, header=0))
