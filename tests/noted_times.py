"""No test is timed: what a test knows to be bounded in time it notes, and `benchmarks/time_bounds.py` holds it."""

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
    """Note what the present test took [s] beside the bound that is promised."""
    if file := os.environ.get(FILE):
        test = os.environ.get("PYTEST_CURRENT_TEST", "").removesuffix(" (call)")
        with Path(file).open("a", encoding="utf-8") as lines:
            lines.write(json.dumps({"test": test, "seconds": seconds, "bound": bound}) + "\n")


@contextmanager
def noted(bound: float) -> Iterator[None]:
    """Note the processor time of a block, whatever else runs."""
    begin = process_time()
    try:
        yield
    finally:
        note(process_time() - begin, bound)
