"""Damaged text tables with known numbers: `python -m tests.formats.damaged_tables SEED COUNT` prints what is wrong.

A damaged row may be lost or have missing values, which a finding must say; every other row must be read exactly. A file
may be refused, in one line.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from cdtool.base.errors import RecordingError
from cdtool.formats.csv import Csv

NAMES = ("time", "torque", "speed", "force")
DIALECTS = ((",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ","))
WORDS = (
    "n/a",
    "ERR",
    "---",
    "#NV",
    "overflow",
    "1.2.3",
    "12:30",
    "1 2",
    "0x1F",
    "1_000",
    "?",
    "\xff\xfe",
    "5-",
)
Rng = np.random.Generator
Lines = list[bytes]


def cells_of(line: bytes, separator: str) -> list[bytes]:
    return line.split(separator.encode())


def in_row(change: Callable[[list[bytes], int, Rng], list[bytes]]) -> Callable[[Lines, int, str, Rng], Lines]:
    """Return a damage that changes the cells of one line."""

    def damage(lines: Lines, row: int, separator: str, rng: Rng) -> Lines:
        cells = cells_of(lines[row], separator)
        changed = change(cells, int(rng.integers(len(cells))), rng)
        return [*lines[:row], separator.encode().join(changed), *lines[row + 1 :]]

    return damage


def inserted(text: bytes) -> Callable[[Lines, int, str, Rng], Lines]:
    """Return a damage that inserts a line."""
    return lambda lines, row, separator, _: [*lines[:row], text.replace(b"|", separator.encode()), *lines[row:]]


# By name, whether the row may be lost, and the damage.
DAMAGES: dict[str, tuple[bool, Callable[[Lines, int, str, Rng], Lines]]] = {
    "word": (True, in_row(lambda c, at, rng: [*c[:at], str(rng.choice(WORDS)).encode("latin-1"), *c[at + 1 :]])),
    "empty": (True, in_row(lambda c, at, _: [*c[:at], b"", *c[at + 1 :]])),
    "cell lost": (True, in_row(lambda c, at, _: [*c[:at], *c[at + 1 :]])),
    "cell twice": (True, in_row(lambda c, at, _: [*c[: at + 1], *c[at:]])),
    "short": (True, in_row(lambda c, at, _: c[: at + 1] if at + 1 < len(c) else c[:-1])),
    "zeros": (True, in_row(lambda c, at, _: [*c[:at], b"\0" * 64, *c[at + 1 :]])),
    "other mark": (
        True,
        in_row(lambda c, at, _: [*c[:at], c[at].translate(bytes.maketrans(b".,", b",.")), *c[at + 1 :]]),
    ),
    "quoted": (False, in_row(lambda c, at, _: [*c[:at], b'"' + c[at] + b'"', *c[at + 1 :]])),
    "blanks": (False, in_row(lambda c, at, _: [*c[:at], b"  " + c[at] + b" ", *c[at + 1 :]])),
    "comment": (False, inserted(b"# logger restarted")),
    "blank line": (False, inserted(b"")),
    "names again": (False, inserted("|".join(NAMES).encode())),
    "units": (False, inserted(b"s|N m|m/s|N")),
    "total": (False, lambda lines, _, separator, __: [*lines, separator.join(("Total", "1", "2", "3")).encode()]),
    "joined": (True, lambda lines, row, *_: [*lines[:row], lines[row] + lines[row + 1], *lines[row + 2 :]]),
    "cut": (True, lambda lines, row, _, rng: [*lines[:row], lines[row][: int(rng.integers(1, len(lines[row])))]]),
}


def check(seed: int, folder: Path) -> str:
    """Return what is wrong with the reading of one damaged table; empty if nothing is."""
    rng = np.random.default_rng(seed)
    separator, mark = DIALECTS[rng.integers(len(DIALECTS))]
    kind = list(DAMAGES)[seed % len(DAMAGES)]
    may_be_lost, damage = DAMAGES[kind]
    count = int(rng.integers(20, 400))
    numbers = np.column_stack([np.arange(count) * 0.01, rng.normal(0.0, 20.0, (count, len(NAMES) - 1))])
    texts = [[f"{value:.4f}" for value in row] for row in numbers]
    truth = [[float(text) for text in row] for row in texts]
    lines = [separator.join(cell.replace(".", mark) for cell in row).encode() for row in texts]
    row = int(rng.integers(5, count - 5))
    damaged = {row, row + 1} if kind == "joined" else {row} if may_be_lost else set()
    last = row + 1 if kind == "cut" else count
    content = b"\n".join([separator.join(NAMES).encode(), *damage(lines, row, separator, rng)])
    path = folder / "log.csv"
    path.write_bytes(content if kind == "cut" else content + b"\n")
    try:
        source = Csv().columns(path, None)
    except RecordingError as fault:
        return "" if str(path) in str(fault) and "\n" not in str(fault) else f"{kind}: {fault}"
    left_out = [name for name in NAMES if name not in source.columns]
    if left_out:
        return "" if all(any(name in str(f) for f in source.findings) for name in left_out) else f"{kind}: {left_out}"
    read = np.column_stack([source.columns[name].values for name in NAMES])
    lost, wrong = compared(read, truth[:last], damaged)
    if wrong:
        return f"{kind} ({separator!r}, {mark!r}): {wrong}"
    said = any(finding.severity in ("warning", "loss") for finding in source.findings)
    return f"{kind}: {lost} lost in silence" if lost and not said else ""


def compared(read: np.ndarray, truth: list[list[float]], damaged: set[int]) -> tuple[int, str]:
    """Return how many damaged rows are lost, and what is wrong otherwise."""
    lost, row = 0, 0
    for values in read:
        if np.isnan(values).all():  # a row without any value
            lost += 1
            continue
        while row < len(truth) and not fits(values, truth[row], row in damaged):
            if row not in damaged:
                return lost, f"row {row} is {truth[row]}, read {values.tolist()}"
            lost, row = lost + 1, row + 1
        if row == len(truth):
            return lost, f"a row that does not exist: {values.tolist()}"
        row += 1
    missing = set(range(row, len(truth)))
    return lost + len(missing), f"rows {sorted(missing - damaged)} lost" if missing - damaged else ""


def fits(values: np.ndarray, expected: list[float], damaged: bool) -> bool:
    return bool(np.all((values == expected) | (damaged & np.isnan(values))))


def failures(seed: int, count: int) -> Iterator[str]:
    with tempfile.TemporaryDirectory() as folder:
        for number in range(seed * 10**6, seed * 10**6 + count):
            if problem := check(number, Path(folder)):
                yield f"{number} {problem}"


if __name__ == "__main__":
    first, cases = (int(argument) for argument in sys.argv[1:])
    wrong = list(failures(first, cases))
    print(*wrong, f"{len(wrong)} of {cases} wrong in silence", sep="\n")
    sys.exit(bool(wrong))
