"""A sliding gate as German programs log it: python docs/examples/gate_with_force_meter.py FOLDER

CSV files with semicolons, decimal commas and German names: `frei/` has runs without contact, `prallen/` impacts on a
force meter. The force meter logs files of its own, `prallen/kraft_*.csv`, at 500 Hz, on a clock that begins at its
own start; a trigger signal is in both files. `machine.toml` and `benchmark.toml` read them. All of it is simulated
(`cdtool simulate gate`, seed 5).
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

import numpy as np

import cdtool
from cdtool.base.arrays import FloatArray

HEAD = "Zeit [ms];Motorstrom [A];Drehzahl [U/min];Motorwinkel [rad];Beschleunigung [g];Trigger"
# The force meter starts 1.7 s before the control, and keeps every second sample.
EARLIER, EVERY = 1.7, 2
# Both devices see a trigger of 0.1 s, 0.2 s after the start of the log.
TRIGGER, HIGH = 0.2, 0.1


def write_german(folder: Path) -> list[Path]:
    """Write the logs, machine file and benchmark file; return the logs of the control."""
    folder.mkdir(parents=True, exist_ok=True)
    example = Path(__file__).with_suffix("")
    shutil.copy(f"{example}.toml", folder / "machine.toml")
    shutil.copy(f"{example}_benchmark.toml", folder / "benchmark.toml")
    written = []
    with tempfile.TemporaryDirectory() as simulated:
        cdtool.simulate_gate(Path(simulated) / "gate", {"free": 12, "stiff": 3}, seed=5)
        for group, name in (("free", "frei"), ("stiff", "prallen")):
            (folder / name).mkdir(parents=True, exist_ok=True)
            for number, log in enumerate(sorted((Path(simulated) / "gate" / group).glob("*.csv")), 1):
                columns = np.loadtxt(log, delimiter=",", skiprows=1, unpack=True)
                time, current, speed, angle, acceleration, force = columns[:6]
                trigger = ((time >= 1e3 * TRIGGER) & (time < 1e3 * (TRIGGER + HIGH))).astype(float)
                path = folder / name / f"lauf_{number:02d}.csv"
                _write(path, HEAD, ".0f .4f .1f .5f .6f .0f", [time, current, speed, angle, acceleration, trigger])
                written.append(path)
                if group == "stiff":
                    meter = [1e-3 * time[::EVERY] + EARLIER, 1e3 * force[::EVERY], trigger[::EVERY]]
                    _write(path.with_name(f"kraft_{path.name}"), "Zeit [s];Kraft [N];Trigger", ".3f .1f .0f", meter)
    return written


def _write(path: Path, head: str, formats: str, columns: list[FloatArray]) -> None:
    """Write a table as a spreadsheet with German settings does."""
    rows = zip(*columns, strict=True)
    lines = [";".join(f"{x:{form}}" for x, form in zip(row, formats.split(), strict=True)) for row in rows]
    path.write_text("\n".join([head, *(line.replace(".", ",") for line in lines)]) + "\n", encoding="cp1252")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: gate_with_force_meter.py FOLDER")
    print(f"{len(write_german(Path(sys.argv[1])))} logs written to {sys.argv[1]}")
