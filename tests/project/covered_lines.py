"""Measure the share of the lines covered by the full suite that the fast tests cover.

`python -m tests.project.covered_lines fast.coverage full.coverage` compares two data files of the coverage package,
prints the share for each folder of cdtool/, and exits with status 1 if the total is below 90 %. Compiled loops and
programs started by a test count in neither.

coverage run --data-file fast.coverage --source cdtool -m pytest -q -p no:xdist -m "not slow"
coverage run --data-file full.coverage --source cdtool -m pytest -q -p no:xdist
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from pathlib import Path

AT_LEAST = 0.9
PACKAGE = Path(__file__).resolve().parents[2] / "cdtool"


def covered(data_file: Path) -> dict[str, set[int]]:
    """Return file of cdtool/ -> the numbers of its executed lines."""
    from coverage import CoverageData

    data = CoverageData(str(data_file))
    data.read()
    found = {}
    for name in data.measured_files():
        if PACKAGE in Path(name).parents:
            found[Path(name).relative_to(PACKAGE).as_posix()] = set(data.lines(name) or ())
    return found


def shares(fast: dict[str, set[int]], full: dict[str, set[int]]) -> dict[str, tuple[int, int]]:
    """Return folder -> number of lines executed by the fast tests, and by the full suite."""
    counts: dict[str, tuple[int, int]] = defaultdict(lambda: (0, 0))
    for name, lines in full.items():
        folder = name.partition("/")[0] if "/" in name else "."
        here, there = counts[folder]
        counts[folder] = here + len(lines & fast.get(name, set())), there + len(lines)
    return dict(counts)


def main() -> int:
    """Print the shares; return 1 if the total is below the bound."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("fast", type=Path, help="data file of the tests that are not slow")
    parser.add_argument("full", type=Path, help="data file of the full suite")
    chosen = parser.parse_args()
    counts = shares(covered(chosen.fast), covered(chosen.full))
    for folder, (here, there) in sorted(counts.items(), key=lambda item: item[1][0] / max(1, item[1][1])):
        print(f"{folder:12s} {here:6d} of {there:6d} lines {100.0 * here / max(1, there):6.1f} %")
    here, there = (sum(column) for column in zip(*counts.values(), strict=True))
    share = here / max(1, there)
    print(f"{'all':12s} {here:6d} of {there:6d} lines {100.0 * share:6.1f} % (at least {100.0 * AT_LEAST:.0f} %)")
    return int(share < AT_LEAST)


if __name__ == "__main__":
    raise SystemExit(main())
