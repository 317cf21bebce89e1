"""Run the cases of any seed: `python -m tests.formats.mcap_damage SEED COUNT [FIRST]` prints the failures by kind."""

from __future__ import annotations

import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

from tests.formats.mcap_damage.assessment import LONGEST, faults, warm_up
from tests.formats.mcap_damage.generator import cases


def main(seed: int, count: int, first: int = 0) -> int:
    """Run the cases; return 1 if any case fails, otherwise 0."""
    failed: dict[str, list[str]] = defaultdict(list)
    slowest = (0.0, "")
    with tempfile.TemporaryDirectory() as folder:
        warm_up(Path(folder) / "case.mcap")
        for number, case in enumerate(cases(seed, count, first), start=first):
            start = time.process_time()
            problems = faults(case, Path(folder) / "case.mcap")
            seconds = time.process_time() - start
            slowest = max(slowest, (seconds, f"{number} {case.name}"))
            if seconds > LONGEST:
                problems.append(f"needed {seconds:.1f} s of processor time")
            if problems:
                failed[case.kind].append(f"{number} {case.name}: {'; '.join(problems)}")
    for kind, texts in failed.items():
        print(f"{kind}: {len(texts)} fail")
        for text in texts:
            print(f"    {text}")
    print(f"{sum(map(len, failed.values()))} of {count} fail; the slowest needed {slowest[0]:.2f} s ({slowest[1]})")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(*(int(argument) for argument in sys.argv[1:])))
