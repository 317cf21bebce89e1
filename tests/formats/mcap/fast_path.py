"""Compare reading with several threads, where the fast path reads chunks, with reading one message after the other."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.channels import ChannelMap, ChannelSource, TimeSource
from cdtool.errors import RecordingError
from cdtool.formats.mcap import Mcap
from cdtool.formats.mcap.container import chunk_read_ahead

JOINTS = ("c", "a", "b")


def read(path, wanted, cores):
    """Return the columns as bytes, the origin and the findings, or the error."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(chunk_read_ahead, "usable_cores", lambda: cores)
        try:
            source = Mcap().columns(path, wanted)
        except RecordingError as fault:
            return str(fault)
    columns = {
        name: (column.values.shape, bits(column.values), column.time.tobytes())
        for name, column in source.columns.items()
    }
    return columns, source.origin, [str(finding) for finding in source.findings]


def bits(values):
    """Return float64 numbers as bytes; all NaN are equal."""
    return np.where(np.isnan(values), np.nan, np.ascontiguousarray(values, dtype=np.float64)).tobytes()


def same(path, fields, clock="log", joints=JOINTS):
    """Check that reading ahead with several threads gives the same as reading without; return the result."""
    wanted = ChannelMap(
        TimeSource(clock=clock),
        tuple(ChannelSource("speed", topic=topic, field=field) for topic, field in fields),
        joints,
        topics=True,
    )
    one_core = read(path, wanted, cores=1)
    assert read(path, wanted, cores=3) == one_core
    return one_core
