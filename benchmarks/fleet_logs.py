"""A simulated fleet: many short recordings of a gate, each with content of its own.

python benchmarks/fleet_logs.py FOLDER 20000
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from cdtool.commands.simulate.gate_recordings import simulate_gate

# What is simulated; each scored one is copied with another last digit, since recordings of equal content are refused.
_SIMULATED = {"free": 14, "holdout": 66, "stiff": 67, "soft": 67}
_SCORED = ("holdout", "stiff", "soft")
SEED = 1
# Of the rows at 1 kHz, each of so many is kept: 250 Hz, 7 s, 115 kB of CSV.
_EVERY = 4


def write_fleet(folder: Path, recordings: int, seed: int = SEED) -> Path:
    """Write a benchmark file with so many scored recordings and 14 impact-free ones; return the benchmark file."""
    with tempfile.TemporaryDirectory() as name:
        base = Path(name)
        simulate_gate(base, _SIMULATED, seed, file_format="csv")
        folder.mkdir(parents=True, exist_ok=True)
        for file in ("benchmark.toml", "machine.toml"):
            (folder / file).write_bytes((base / file).read_bytes())
        for group in ("free", *_SCORED):
            (folder / group).mkdir(exist_ok=True)
        for path in sorted((base / "free").glob("*.csv")):
            (folder / "free" / path.name).write_text(_thinned(path)[0], encoding="utf-8", newline="\n")
        texts = [(path.parent.name, path.stem, *_thinned(path)) for path in _in_turn(base)]
        for number in range(recordings):
            group, stem, text, end = texts[number % len(texts)]
            mark = f"{number // len(texts):04d}"
            log = folder / group / f"{mark}-{stem}.csv"
            log.write_text(f"{text[:end]}{mark}{text[end:]}", encoding="utf-8", newline="\n")
    return folder / "benchmark.toml"


def _in_turn(base: Path) -> Iterator[Path]:
    """Yield the scored recordings, the groups in turn."""
    every = [sorted((base / group).glob("*.csv")) for group in _SCORED]
    for number in range(max(map(len, every))):
        yield from (logs[number] for logs in every if number < len(logs))


def _thinned(path: Path) -> tuple[str, int]:
    """Return a recording at a lower rate, and where further digits of a cell of its first row go."""
    head, *rows = path.read_text(encoding="utf-8").splitlines(keepends=True)
    text = "".join((head, *rows[::_EVERY]))
    return text, text.index("\n", len(head))


if __name__ == "__main__":
    print(write_fleet(Path(sys.argv[1]), int(sys.argv[2])))
