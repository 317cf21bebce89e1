"""A robot that is pressed against a force rig with a pressure film: logs, machine, benchmark and protocol file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cdtool.base.arrays import FloatArray
from tests.synthetic.force_rig import BENCHMARK, MACHINE, ONSET, PROTOCOL, Force, half_sine

INSTRUMENT = """
[[protocol.instrument]]
quantity = "pressure"
model = "Film P"
serial_number = "9"
calibrated_on = 2026-01-15
calibration_valid_until = {valid_until}
range_n_per_cm2 = {range}
accuracy_class = "5 %"
"""
Speed = Callable[[FloatArray], FloatArray]


def steady(speed: float) -> Speed:
    """Return a speed [m/s] over the time after the onset: constant, then the machine stops."""
    return lambda time: np.where(time < 0.0, speed, speed * np.exp(-np.maximum(time, 0.0) / 0.05))


_PRESSURE, _FORCE, _SPEED = half_sine(100.0), half_sine(120.0), steady(0.2)


@dataclass(frozen=True)
class Run:
    """One test: force [N], pressure [N/cm2] and speed [m/s] over the time after the onset; NaN leaves a cell empty.

    `scale` converts the pressure to what is in the log.
    """

    pressure: Force | None = _PRESSURE
    force: Force = _FORCE
    speed: Speed = _SPEED
    scale: float = 1.0
    noise: float = 0.05


def write_run(path: Path, run: Run, *, seconds: float = 5.0, rate: float = 1000.0) -> None:
    """Write one log as CSV."""
    time = np.arange(round(seconds * rate)) / rate
    rng = np.random.default_rng(sum(path.name.encode()))
    cell = run.force(time - ONSET) + rng.normal(0.0, 0.3, len(time))
    table = {
        "t": time,
        "force_drive": np.where(time < ONSET, 40.0, 0.0),
        "v": run.speed(time - ONSET),
        "load_cell": cell,
    }
    if run.pressure is not None:
        table["p"] = (run.pressure(time - ONSET) + rng.normal(0.0, run.noise, len(time))) * run.scale
    rows = (_line(row) for row in zip(*table.values(), strict=True))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(",".join(table) + "\n" + "\n".join(rows) + "\n", encoding="utf-8")


def _line(row: Sequence[float]) -> str:
    return ",".join("" if np.isnan(value) else f"{value:.6g}" for value in row)


def write_pressure_rig(
    folder: Path,
    runs: Sequence[Run],
    *,
    unit: str = "N/cm2",
    channel: str = "",
    speed: str = '{ column = "v", unit = "m/s" }',
    profile: str = "iso_ts_15066_chest",
    point: str = "",
    language: str = "en",
    valid_until: str = "2027-01-14",
    most: float = 1000.0,
    instrument: bool = True,
) -> Path:
    """Write everything that a protocol needs, or one with a flaw; return the protocol file."""
    mapped = channel or f'{{ column = "p", unit = "{unit}" }}'
    machine = MACHINE.replace('{ column = "v", unit = "m/s" }', speed) + f"contact_pressure = {mapped}\n"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "machine.toml").write_text(machine, encoding="utf-8")
    (folder / "benchmark.toml").write_text(BENCHMARK, encoding="utf-8")
    for number, run in enumerate(runs, 1):
        write_run(folder / "edge" / f"{number:02d}.csv", run)
    text = PROTOCOL.format(
        language=language,
        day="2026-03-31",
        valid_until="2027-01-14",
        rate="1000",
        repetitions=len(runs),
        logs='group = "edge"',
        more=point + "\n" + (INSTRUMENT.format(valid_until=valid_until, range=most) if instrument else ""),
    )
    text = text.replace("en_12453_reducing_gap", profile).replace("stiffness_n_per_mm = 500", "stiffness_n_per_mm = 25")
    path = folder / "protocol.toml"
    path.write_text(text, encoding="utf-8")
    return path
