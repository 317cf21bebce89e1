"""Every benchmark but thresholds.py, signature_coverage.py and lost_samples.py (10 minutes to hours), a process each.

Exits with status 1 if a target is not met.

python benchmarks/run_all.py
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

QUESTIONS = (
    *("friction_ekf", "momentum", "robot_dynamics", "detectors"),
    *("start_up", "whole_benchmark", "reports", "interval_coverage", "compare_builds"),
    *("reading",),
    *("gate_accuracy", "arm_accuracy", "missing_force", "time_bounds", "structure"),
)


def main() -> int:
    folder = Path(__file__).parent
    failed = []
    for name in QUESTIONS:
        done = subprocess.run([sys.executable, str(folder / f"{name}.py")], check=False)
        if done.returncode:
            failed.append(name)
        print(flush=True)
    print(f"not held: {', '.join(failed)}" if failed else "every target held")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
