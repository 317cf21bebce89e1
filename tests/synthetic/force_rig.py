"""A door that is pressed against a force rig: short CSV logs with a given force, a benchmark and a protocol file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from cdtool.base.arrays import FloatArray

ONSET, RATE = 3.0, 1000.0
MACHINE = """
[machine]
type = "linear_axis"
name = "door"
motor_inertia = 0.0
load_mass = 100
transmission_ratio = 1.0

[channels]
time = { column = "t", unit = "s" }
torque = { column = "force_drive", unit = "N" }
speed = { column = "v", unit = "m/s" }
force = { column = "load_cell", unit = "N" }
"""
BENCHMARK = """
machine = "machine.toml"
detectors = ["gm"]
threshold = "baseline"

[onset]
above_n = 20.0
back_to_n = 8.0

[impacts.edge]
logs = ["edge/*.csv"]
"""
PROTOCOL = """
[protocol]
benchmark = "benchmark.toml"
number = "P-17"
language = "{language}"

[protocol.machine]
type = "Schiebetür"
maker = "Müller & Söhne <Tore>"
serial_number = "SN-0815"
installation = "Halle 3, Tor 2"
software_version = "4.2.1"

[protocol.test]
tester = "Jürgen Groß"
date = {day}
place = "Köln"
temperature_c = 21.5

[[protocol.instrument]]
quantity = "force"
model = "Rig 500"
serial_number = "77"
calibrated_on = 2026-01-15
calibration_valid_until = {valid_until}
range_n = 2000
accuracy_class = "1"
sample_rate_hz = {rate}
filter = "100 Hz low-pass"

[[protocol.point]]
name = "edge"
position = "closing edge"
region = "gap of 300 mm"
obstacle_stiffness_n_per_mm = 500
contact_area_mm2 = 5027
speed_m_per_s = 0.2
repetitions = {repetitions}
profile = "en_12453_reducing_gap"
{logs}
{more}
"""

Force = Callable[[FloatArray], FloatArray]


def half_sine(peak: float, length: float = 0.3) -> Force:
    """Return a force over the time after the onset: half a sine, then nothing."""
    return lambda time: np.where((time >= 0.0) & (time <= length), peak * np.sin(np.pi * time / length), 0.0)


def write_log(path: Path, force: Force, *, seconds: float = 9.0, rate: float = RATE, rest: float = 0.0) -> None:
    """Write one log: the door runs at 0.2 m/s, hits the rig at 3 s and stops."""
    time = np.arange(round(seconds * rate)) / rate
    noise = np.random.default_rng(sum(path.name.encode())).normal(0.0, 0.3, len(time))
    cell = force(time - ONSET) + rest + noise
    speed = np.where(time < ONSET, 0.2, 0.2 * np.exp(-(time - ONSET) / 0.05))
    drive = np.where(time < ONSET, 40.0, 0.0)
    rows = (f"{t:.4f},{d:.1f},{v:.5f},{f:.2f}" for t, d, v, f in zip(time, drive, speed, cell, strict=True))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("t,force_drive,v,load_cell\n" + "\n".join(rows) + "\n", encoding="utf-8")


def write_rig(folder: Path, forces: Sequence[Force], *, seconds: float = 9.0, rate: float = RATE) -> Path:
    """Write machine, benchmark and a log for each force; return the benchmark file."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "machine.toml").write_text(MACHINE, encoding="utf-8")
    (folder / "benchmark.toml").write_text(BENCHMARK, encoding="utf-8")
    for number, force in enumerate(forces, 1):
        write_log(folder / "edge" / f"{number:02d}.csv", force, seconds=seconds, rate=rate)
    return folder / "benchmark.toml"


def write_protocol(
    folder: Path,
    *,
    language: str = "en",
    day: str = "2026-03-31",
    valid_until: str = "2027-01-14",
    rate: float = RATE,
    repetitions: int = 3,
    logs: str = 'group = "edge"',
    more: str = "",
) -> Path:
    """Write a complete protocol file, or one with a flaw; return it."""
    path = folder / "protocol.toml"
    entries = {"language": language, "day": day, "valid_until": valid_until, "rate": f"{rate:g}"}
    path.write_text(PROTOCOL.format(**entries, repetitions=repetitions, logs=logs, more=more), encoding="utf-8")
    return path
