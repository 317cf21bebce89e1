"""The rules for markers of tests: slow, reading real recordings.

* `real_data`: the test names a recording with `needs_data`; it is skipped, by name, if the recording is missing.
* `slow`: all cases of the test function together take longer than `BOUND_S` on two idle cores. slow_tests.txt lists
  these functions; `python -m tests.project.slow_tests` writes the list from the measured times of a run.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import pytest

from tests.data_folder import is_present

BOUND_S = 0.4
SLOW_TESTS = Path(__file__).with_name("slow_tests.txt")
ROOT = Path(__file__).parents[1]


def mark(items: Iterable[pytest.Item]) -> None:
    """Add its markers to each collected test."""
    slow = set(slow_tests())
    for item in items:
        for absent in (name for found in item.iter_markers("real_data") for name in found.args if not is_present(name)):
            item.add_marker(pytest.mark.skip(reason=f"no recording {absent} (set CDTOOL_DATA)"))
        if item.nodeid.partition("[")[0] in slow:
            item.add_marker("slow")


def slow_tests(path: Path = SLOW_TESTS) -> list[str]:
    """Return the functions listed as slow, `tests/base/files/test_files.py::test_a_link_stays`."""
    return [line for line in path.read_text(encoding="utf-8").splitlines() if line and not line.startswith("#")]
