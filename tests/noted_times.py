"""Times recorded by tests, which have no time limits; `benchmarks/time_bounds.py` checks them."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import process_time

FILE = "CDTOOL_NOTED_TIMES"
"""The environment variable that names the file in which the benchmark wants the times; without it none is noted."""


def note(seconds: float, bound: float) -> None:
    """Record the time of the current test [s] and its promised bound."""
    if file := os.environ.get(FILE):
        test = os.environ.get("PYTEST_CURRENT_TEST", "").removesuffix(" (call)")
        with Path(file).open("a", encoding="utf-8") as lines:
            lines.write(json.dumps({"test": test, "seconds": seconds, "bound": bound}) + "\n")


@contextmanager
def noted(bound: float) -> Iterator[None]:
    """Record the processor time of a block, independent of other processes."""
    begin = process_time()
    try:
        yield
    finally:
        note(process_time() - begin, bound)
