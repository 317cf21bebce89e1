"""Obstacles by name: of a benchmark file, and those that ship with cdtool."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

from cdtool.base.errors import ConfigurationError, nearest
from cdtool.base.tables import Table, read_toml
from cdtool.machines.axis_model.obstacle import Obstacle

_SHIPPED = Path(__file__).with_name("obstacles.toml")
_PER_MM = 1e3  # N/mm in N/m


def shipped_obstacles(path: Path | None = None) -> dict[str, Obstacle]:
    """Return the obstacles of a file by name; by default those that ship with cdtool.

    Raises ConfigurationError naming file and key.

    >>> round(shipped_obstacles()["en_12453_force_meter"].steepest)
    500000
    """
    where = str(path) if path else "the shipped obstacles.toml"
    root = Table(read_toml(path or _SHIPPED, "a file of obstacles"), where)
    found = {}
    for name in root.values:
        table = root.table(name)
        table.text("title", "")
        table.flag("checked", False)
        found[name] = read_obstacle(table, {})
    if not found:
        raise ConfigurationError(f"{where}: contains no obstacle", "write one table per obstacle")
    return found


def read_obstacle(table: Table, known: Mapping[str, Obstacle]) -> Obstacle:
    """Return the obstacle that a table describes: `profile`, `stiffness_n_per_mm`, or a force curve.

    A curve has `deflection_mm` and `force_n`, from 0. `damping_s_per_m` is that of T (1 + damping * speed),
    `in_series_n_per_mm` what is in series, such as a load cell. A given damping replaces a profile's, a given series
    stiffness adds to its. Raises ConfigurationError naming the key.
    """
    forms = [key for key in ("profile", "stiffness_n_per_mm", "force_n") if key in table]
    if len(forms) != 1:
        given = " and ".join(forms) or "nothing of it"
        raise table.fault("stiffness_n_per_mm", f"{given} is given", "give one of profile, stiffness_n_per_mm, force_n")
    damping = table.number("damping_s_per_m", 0.0, minimum=0.0)
    series = table.number("in_series_n_per_mm", math.inf, above=0.0) * _PER_MM
    if forms == ["profile"]:
        name = table.text("profile")
        if name not in known:
            raise table.fault("profile", f"is '{name}'", nearest(name, known))
        spring = known[name]
        damping = damping if "damping_s_per_m" in table else spring.damping
        compliance = 1.0 / series + 1.0 / spring.series_stiffness
        obstacle = Obstacle(spring.deflection, spring.force, damping, 1.0 / compliance if compliance else math.inf)
    elif forms == ["stiffness_n_per_mm"]:
        obstacle = Obstacle.spring(table.number("stiffness_n_per_mm", above=0.0) * _PER_MM, damping, series)
    else:
        obstacle = _curve(table, damping, series)
    table.finish()
    return obstacle


def _curve(table: Table, damping: float, series: float) -> Obstacle:
    force = table.raw("force_n")
    if not isinstance(force, list) or len(force) < 2:
        raise table.fault("force_n", "is no list of two or more forces", "give force_n and deflection_mm, both from 0")
    forces = table.numbers("force_n", len(force), minimum=0.0)
    deflections = table.numbers("deflection_mm", len(force), minimum=0.0)
    if not isinstance(table.raw("deflection_mm"), list):
        raise table.fault("deflection_mm", "is no list", f"give {len(force)} deflections, one per force")
    try:
        return Obstacle(tuple(item / _PER_MM for item in deflections), forces, damping, series)
    except ConfigurationError as fault:
        raise table.fault("force_n", fault.message, fault.hint) from fault
