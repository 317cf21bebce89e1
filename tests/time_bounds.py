"""Promised times: measured by tests, and compared where the variable CDTOOL_TIME_BOUNDS is set, on an idle machine."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from time import process_time

CHECKED = "CDTOOL_TIME_BOUNDS"


def check(seconds: float, bound: float) -> None:
    """Fail if a time is above its promised bound [s]; without the variable any time is good."""
    if os.environ.get(CHECKED):
        assert seconds < bound, f"{seconds:.2f} s, promised are less than {bound:g} s"


@contextmanager
def bounded(bound: float) -> Iterator[None]:
    """Check the processor time of a block, independent of other processes."""
    begin = process_time()
    try:
        yield
    finally:
        check(process_time() - begin, bound)
