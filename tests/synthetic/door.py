"""One long log of a door that opens and closes, with contacts in both directions."""

from __future__ import annotations

from pathlib import Path

import numpy as np

MACHINE = """
[machine]
type = "linear_axis"
name = "door"
coordinates = "load"
load_mass = 80.0
viscous_friction = 40.0
coulomb_friction = 15.0
[channels]
time = { column = "t", unit = "s" }
torque = { column = "drive", unit = "N" }
speed = { column = "v", unit = "m/s" }
position = { column = "x", unit = "m" }
force = { column = "cell", unit = "N" }
label = { column = "hit", scale = 1 }
"""
STROKE = 4.0


def write_log(path: Path, strokes: int, contacts: dict[int, float], seed: int, nominal_speed: float = 0.25) -> None:
    """Write strokes back and forth, 4 s each; `contacts` are forces [N] on the drive by stroke number."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(strokes * STROKE / 1e-3)) * 1e-3
    phase = time % STROKE
    direction = np.where((time // STROKE).astype(int) % 2 == 0, 1.0, -1.0)
    speed = nominal_speed * direction * np.interp(phase, [0.0, 0.5, 1.0, 3.0, 3.5, 4.0], [0.0, 0.0, 1.0, 1.0, 0.0, 0.0])
    rate = np.gradient(speed, 1e-3)
    pushed = np.zeros(len(time))
    for stroke, force in contacts.items():
        begin = stroke * STROKE + 2.0
        ramp = np.clip((time - begin) / 0.05, 0.0, 1.0) * (time < begin + 0.6)
        pushed += force * ramp
    drive = 80.0 * rate + 40.0 * speed + 15.0 * np.sign(speed) + direction * pushed + rng.normal(0.0, 1.0, len(time))
    columns = {
        "t": time,
        "drive": drive,
        "v": speed + rng.normal(0.0, 1e-4, len(time)),
        "x": np.cumsum(speed) * 1e-3,
        "cell": pushed + rng.normal(0.0, 0.2, len(time)),
        "hit": (pushed > 0.0).astype(float),
    }
    rows = np.column_stack(list(columns.values()))
    np.savetxt(path, rows, delimiter=",", header=",".join(columns), comments="", fmt="%.7g")
