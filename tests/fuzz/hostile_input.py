"""Hostile files and options to every command: tracebacks, undocumented exit statuses, long lines, hangs and crashes.

Each attempt mutates one input file (its values or its bytes) or sets one option to a hostile value, and runs it.
Attempts run in a monitored process: a crash, or more than --seconds, is counted too. Exits with status 1 if there is
any. test_hostile_commands.py contains a short run.

python -m tests.fuzz.hostile_input --attempts 3000 --seed 1
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
import tempfile
import time
from collections import Counter
from multiprocessing.connection import Connection
from pathlib import Path

from tests.fuzz.hostile_commands import attempts, complaint, make_bench, run


def worker(folder: Path, seed: int, first: int, count: int, pipe: Connection) -> None:
    for number, attempt in enumerate(attempts(folder, seed, count)):
        if number >= first:
            pipe.send((number, attempt.shown, None, ""))
            outcome = run(attempt, folder)
            pipe.send((number, attempt.shown, outcome.status, complaint(outcome)))
    pipe.send(None)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--attempts", type=int, default=3000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=120.0, help="longer than this is a hang")
    given = parser.parse_args()
    statuses: Counter[int] = Counter()
    complaints: list[str] = []
    start = time.monotonic()
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made) / "bench"
        make_bench(folder)
        first = 0
        while first < given.attempts:
            here, there = multiprocessing.Pipe()
            arguments = (folder, given.seed, first, given.attempts, there)
            process = multiprocessing.get_context("spawn").Process(target=worker, args=arguments)
            process.start()
            there.close()
            first, said = watch(here, given.seconds, statuses, complaints, given.attempts)
            if said:
                complaints.append(said)
                print(said, flush=True)
            process.kill()
            process.join()
    minutes = (time.monotonic() - start) / 60
    shown = ", ".join(f"{status}: {count}" for status, count in sorted(statuses.items()))
    print(f"{given.attempts} attempts, seed {given.seed}, {minutes:.1f} min; by exit status {shown}")
    print(f"tracebacks, crashes, hangs, undocumented statuses and long lines: {len(complaints)} (at most 0)")
    return 1 if complaints else 0


def watch(
    pipe: Connection, seconds: float, statuses: Counter[int], complaints: list[str], count: int
) -> tuple[int, str]:
    """Return the number to continue with, and what ended the process early."""
    number, shown = -1, ""
    while True:
        try:
            if not pipe.poll(seconds + 60.0 * (number < 0)):
                return number + 1, f"{number}: {shown}: no end within {seconds:g} s"
            told = pipe.recv()
        except EOFError:
            return number + 1, f"{number}: {shown}: the process died"
        if told is None:
            return count, ""
        number, shown, status, said = told
        if status is not None:
            statuses[status] += 1
        if said:
            complaints.append(said)
            print(f"{number}: {shown}: {said}".encode("ascii", "replace").decode(), flush=True)


if __name__ == "__main__":
    sys.exit(main())
