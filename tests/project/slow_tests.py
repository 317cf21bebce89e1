"""Compare the measured slow tests with the list in tests/slow_tests.txt.

`python -m pytest --junitxml times.xml`, on an otherwise idle machine, measures. Then `python -m
tests.project.slow_tests times.xml` prints the tests missing from the list, those listed without need and those that no
longer exist, and exits with status 1 if a test is missing. `--write` corrects the list.

The first test that needs a shared fixture takes the time of its set-up. So measure the quick tests alone after that
(`-m "not slow"`), and add those that are slow now: `python -m tests.project.slow_tests quick.xml --add`.

A test is slow if all cases of its function, set-up included, together take longer than the bound of tests/markers.py. A
listed one stays until it takes less than half of that, so that runs on different machines do not alternate the list.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.etree import ElementTree

from tests.markers import BOUND_S, SLOW_TESTS, slow_tests

HEAD = """\
# Test functions whose cases together take longer than {bound} s on two idle cores: they have the marker `slow`.
# Made from a run with `--junitxml times.xml` by `python -m tests.project.slow_tests times.xml --write`, not by hand.
"""


def durations(report: Path) -> dict[str, float | None]:
    """Return test function -> time of all its cases [s]; None if one was skipped, so that the time is unknown."""
    took: dict[str, float | None] = defaultdict(float)
    for case in ElementTree.parse(report).iter("testcase"):
        name = f"{case.attrib['classname'].replace('.', '/')}.py::{case.attrib['name'].partition('[')[0]}"
        so_far = took[name]
        skipped = case.find("skipped") is not None
        took[name] = None if skipped or so_far is None else so_far + float(case.attrib["time"])
    return dict(took)


def corrected(listed: Sequence[str], took: Mapping[str, float | None], bound: float = BOUND_S) -> list[str]:
    """Return the corrected list."""
    slow = {name for name, seconds in took.items() if seconds is not None and seconds > bound}
    stay = {name for name in listed if name in took and ((seconds := took[name]) is None or seconds > bound / 2)}
    return sorted(slow | stay)


def main(arguments: Sequence[str] | None = None) -> int:
    """Compare the list with the report; return 1 if a slow test is not listed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("report", type=Path, help="what pytest wrote with --junitxml")
    parser.add_argument("--add", action="store_true", help="add the slow tests of a run of the quick tests to the list")
    parser.add_argument("--write", action="store_true", help="correct tests/slow_tests.txt")
    chosen = parser.parse_args(arguments)
    listed, took = slow_tests(SLOW_TESTS), durations(chosen.report)
    wanted = sorted({*listed, *corrected([], took)}) if chosen.add else corrected(listed, took)
    lacking, needless = sorted(set(wanted) - set(listed)), sorted(set(listed) - set(wanted))
    for name in lacking:
        print(f"not listed: {name} took {took[name]:.2f} s")
    for name in needless:
        print(f"listed, but {'took less than half of the bound' if name in took else 'there is no such test'}: {name}")
    fast = sum(seconds or 0.0 for name, seconds in took.items() if name not in wanted)
    print(f"{len(took)} test functions, {len(wanted)} of them slow; the others together took {fast:.0f} s")
    if chosen.write or chosen.add:
        SLOW_TESTS.write_text(HEAD.format(bound=BOUND_S) + "\n".join(wanted) + "\n", encoding="utf-8")
        return 0
    return int(bool(lacking))


if __name__ == "__main__":
    raise SystemExit(main())
