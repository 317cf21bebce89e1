"""The benchmarks that take minutes, a process each; the longer ones are named in README.md.

Exits with status 1 if a target is not met.

python benchmarks/run_all.py
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

QUESTIONS = (
    *("structure", "start_up", "whole_benchmark", "peers", "reading", "large_results"),
    *("accuracy gate", "accuracy arm", "interval_coverage"),
)


def main() -> int:
    folder = Path(__file__).parent
    failed = []
    for question in QUESTIONS:
        name, *arguments = question.split()
        done = subprocess.run([sys.executable, str(folder / f"{name}.py"), *arguments], check=False)
        if done.returncode:
            failed.append(question)
        print(flush=True)
    print(f"not met: {', '.join(failed)}" if failed else "every target is met")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
