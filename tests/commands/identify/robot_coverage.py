"""How often the errors that `cdtool identify` prints cover the true values of robots that it has never seen.

The robots and their logs are those of tests/synthetic/strange_robots.py; what is printed is what the changes of the
machine file have with a standard error. Used by test_robot_coverage.py and benchmarks/identification.py.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import cdtool
from cdtool.base.errors import CdtoolError
from cdtool.commands.identify.identifying import IdentifiedMachine
from cdtool.commands.identify.robot.drive_gains import LoadedRuns
from tests.synthetic.strange_robots import GRAVITY, KINDS, LOGS, Link, carrying, robot, write_log, write_machine

COVERED = 1.96


@dataclass(frozen=True)
class Value:
    """A printed value of a joint and the true one; the error is NaN if it was refused, or printed without."""

    robot: str
    key: str
    joint: int
    true: float
    value: float
    error: float

    @property
    def distance(self) -> float:
        """Return the distance to the true value in standard errors; NaN if refused."""
        return abs(self.value - self.true) / self.error if self.error > 0.0 else math.nan


def friction_values(kind: str, seed: int, folder: Path, logs: int = LOGS) -> list[Value]:
    """Return friction, and of planar arms the base parameters, of a robot that is identified from free motion."""
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    links = robot(kind, rng)
    machine = write_machine(folder, links, kind, rng)
    done = _identified([write_log(folder / f"{i}.csv", links, kind, rng) for i in range(logs)], machine)
    truth = {
        "viscous_friction": [link.viscous for link in links],
        "coulomb_friction": [link.coulomb for link in links],
        "constant_force": [link.offset for link in links],
    }
    if kind != "planar" and "drive_inertia" not in machine.read_text(encoding="utf-8"):
        truth["drive_inertia"] = [link.drive for link in links]
    if kind == "scara":
        # The constant force of a vertical slide holds what its links weigh more than in the file.
        text = (folder / "robot.urdf").read_text(encoding="utf-8")
        wrong = [
            link.mass - float(mass) for link, mass in zip(links, re.findall('mass value="(.+?)"', text), strict=True)
        ]
        truth["constant_force"][2] += GRAVITY * sum(wrong[2:])
    values = [item for key, values in truth.items() for item in _values(f"{kind} {seed}", done, key, values)]
    return values + (_base_values(f"{kind} {seed}", done, links) if kind == "planar" else [])


def _base_values(name: str, done: IdentifiedMachine | None, links: Sequence[Link]) -> list[Value]:
    """Return the inertial base parameters M11, M22, h, g1 and g2 of a planar arm."""
    (m1, m2), (c1, c2), length = [one.mass for one in links], [one.centre[0] for one in links], links[1].origin[0]
    own = [one.inertia[1, 1] + one.mass * one.centre[0] ** 2 for one in links]
    moments = (m1 * c1 + m2 * length, m2 * c2)
    truth = (own[0] + m2 * length**2, own[1], m2 * length * c2, *(GRAVITY * item for item in moments))
    if done is None or done.robot is None:
        return [Value(name, "base parameter", 0, float(true), math.nan, math.nan) for true in truth]
    base = done.robot.inertias.base
    rows = zip(truth, base.values.tolist(), base.standard_errors.tolist(), base.identifiable, strict=False)
    return [
        Value(name, "base parameter", 0, float(true), value, error if known else math.nan)
        for true, value, error, known in rows
    ]


def gain_values(
    kind: str, seed: int, folder: Path, logs: int = 3, key: str = "scale", given_error: float = math.inf
) -> list[Value]:
    """Return the torque constants of a robot from runs with and without a payload, its centre given or, inf, not."""
    rng = np.random.default_rng([seed, KINDS.index(kind), 1])
    links = robot(kind, rng)
    gains = rng.uniform(5.0, 15.0, len(links))
    machine = write_machine(folder, links, kind, rng, (gains * rng.uniform(0.7, 1.4, len(links))).tolist())
    loaded, mass, centre = carrying(links, kind, rng)
    free = [write_log(folder / f"{i}.csv", links, kind, rng, gains) for i in range(logs)]
    with_payload = [write_log(folder / f"loaded{i}.csv", loaded, kind, rng, gains) for i in range(logs)]
    given = None
    if math.isfinite(given_error):
        x, y, z = np.where(centre == 0.0, 0.0, centre + given_error * rng.normal(size=3)).tolist()
        given = (x, y, z)
    link = "forearm" if kind == "planar" else f"l{len(links) - 1}"
    done = _identified(free, machine, LoadedRuns(tuple(with_payload), mass, link, given))
    values = _values(f"{kind} {seed}", done, "scale", gains.tolist())
    return [replace(value, key=key) for value in values]


def gain_values_with_centre(kind: str, seed: int, folder: Path) -> list[Value]:
    """Return the torque constants of a robot whose payload's centre of mass is given, and wrong by 5 mm."""
    return gain_values(kind, seed, folder, key="scale, centre given", given_error=5e-3)


def _identified(logs: Sequence[Path], machine: Path, loaded: LoadedRuns | None = None) -> IdentifiedMachine | None:
    try:
        return cdtool.identify(logs, machine, loaded=loaded)
    except CdtoolError:
        return None


def _values(name: str, done: IdentifiedMachine | None, key: str, truth: Sequence[float]) -> Iterator[Value]:
    change = next((item for item in (done.changes if done else ()) if item.key == key), None)
    for joint, true in enumerate(truth):
        value, error = (change.values[joint], change.standard_errors[joint]) if change else (math.nan, math.nan)
        yield Value(name, key, joint, true, value, error)


def table_of(values: Sequence[Value]) -> list[tuple[str, int, float, float, float]]:
    """Return rows: parameter, count, share refused, share of the others covered, largest distance [errors]."""
    rows = []
    for key in dict.fromkeys(item.key for item in values):
        distances = np.array([item.distance for item in values if item.key == key])
        known = distances[np.isfinite(distances)]
        covered = float(np.mean(known <= COVERED)) if len(known) else math.nan
        rows.append((key, len(distances), 1.0 - len(known) / len(distances), covered, float(known.max(initial=0.0))))
    return rows
