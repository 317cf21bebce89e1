"""Interleaved timing: A B A B ..., so that other load on the machine affects both equally.

Only ratios of one run count. A ratio is taken pair by pair (each B with the A of the same round) and shown as the
median with the smallest and the largest pair.
"""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any


@dataclass(frozen=True)
class Spread:
    """Return median, smallest and largest of several numbers."""

    median: float
    low: float
    high: float

    @classmethod
    def of(cls, figures: Sequence[float]) -> Spread:
        return cls(median(figures), min(figures), max(figures))

    def __str__(self) -> str:
        return f"{self.median:.3g} ({self.low:.3g}-{self.high:.3g})"


def interleaved(tasks: Mapping[str, Callable[[], Any]], rounds: int) -> dict[str, list[float]]:
    """Seconds of every task in every round, the tasks one after the other in each; one round before it is not counted.

    The order turns round by round, so that no task always follows the same one.
    """
    names = list(tasks)
    seconds: dict[str, list[float]] = {name: [] for name in names}
    for number in range(-1, rounds):
        turn = number % len(names)
        for name in names[turn:] + names[:turn]:
            begin = perf_counter()
            tasks[name]()
            if number >= 0:
                seconds[name].append(perf_counter() - begin)
    return seconds


def ratio(over: Sequence[float], under: Sequence[float]) -> Spread:
    """Pair by pair `over` / `under`."""
    return Spread.of([a / b for a, b in zip(over, under, strict=True)])


def environment() -> str:
    """Return processor, cores, load, Python and the relevant libraries, without which a ratio is meaningless."""
    machine = [_processor(), f"{os.cpu_count()} cores"]
    if hasattr(os, "getloadavg"):
        machine.append(f"load {os.getloadavg()[0]:.1f}")
    software = [f"Python {platform.python_version()}"]
    for name in ("numpy", "numba", "scipy", "pandas", "filterpy", "typer"):
        try:
            software.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            software.append(f"no {name}")
    return f"{', '.join(machine)}\n{', '.join(software)}"


def table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Print rows below their headings, the first column on the left, the others on the right."""
    cells = [[str(cell) for cell in row] for row in (head, *rows)]
    widths = [max(len(row[i]) for row in cells) for i in range(len(head))]
    for row in cells:
        others = [cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True)]
        print("  ".join((row[0].ljust(widths[0]), *others)).rstrip())


def verdict(name: str, spread: Spread, target: float, at_most: bool = False) -> bool:
    """Print whether the median of a ratio meets its target; return it."""
    held = spread.median <= target if at_most else spread.median >= target
    wanted = f"{'at most' if at_most else 'at least'} {target:g}"
    print(f"{'ok  ' if held else 'FAIL'}  {name}: {spread} wanted {wanted}")
    return held


def main(title: str, measure: Callable[[], bool]) -> None:
    """Print title and environment, run the benchmark, exit with status 1 if a target is not met."""
    print(f"== {title}\n{environment()}", flush=True)
    sys.exit(0 if measure() else 1)


def _processor() -> str:
    listing = Path("/proc/cpuinfo")
    if listing.exists():
        for line in listing.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
