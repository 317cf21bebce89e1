"""The section [inject] of a benchmark file: which contacts are put into which impact-free logs.

A position in a log at which a named joint is at a given angle or place.

Obstacles by name: of a benchmark file, and those that ship with cdtool.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cdtool.base.errors import ConfigurationError, RecordingError, UsageError, nearest
from cdtool.base.plain_text import digits
from cdtool.base.remote.remote_path import joined
from cdtool.base.tables import Table, read_toml
from cdtool.commands.inject.assumption import Assumption
from cdtool.commands.inject.robot_contact import StruckPoint
from cdtool.commands.judging.named_logs import LogsOf
from cdtool.formats.written_files import WRITERS
from cdtool.machines.axis import Axis
from cdtool.machines.axis_model.obstacle import Obstacle
from cdtool.machines.dynamics import Machine, has_links
from cdtool.recordings.log_section import MARK_HINT, Mark
from cdtool.recordings.recording import Recording
from cdtool.recordings.units import find_unit

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
        raise table.fault("force_n", "must be two or more forces", "give force_n and deflection_mm, both from 0")
    forces = table.numbers("force_n", len(force), minimum=0.0)
    deflections = table.numbers("deflection_mm", len(force), minimum=0.0)
    if not isinstance(table.raw("deflection_mm"), list):
        raise table.fault("deflection_mm", "must be a list", f"give {len(force)} deflections, one per force")
    try:
        return Obstacle(tuple(item / _PER_MM for item in deflections), forces, damping, series)
    except ConfigurationError as fault:
        raise table.fault("force_n", fault.message, fault.hint) from fault


_HINT = 'give a joint and its position, as "elbow = 62deg" or "lift = 0.3m"'


@dataclass(frozen=True)
class JointMark(Mark):
    """The first time at which the joint `joint` passes its position `value` in `unit` (m, rad), from either side."""

    joint: str = ""

    @classmethod
    def of_machine(cls, text: str, machine: Machine) -> JointMark:
        """Return the mark that a text such as `elbow = 62deg` describes; raises UsageError."""
        name, _, place = (part.strip() for part in text.partition("="))
        if name not in machine.joints:
            raise UsageError(f"names the joint '{name[:40]}'", nearest(name, machine.joints))
        number = place.rstrip("abcdefghijklmnopqrstuvwxyz° ")
        unit = find_unit(place[len(number) :].strip())
        expected = machine.load_units["position"]
        try:
            value = float(number) * unit.factor if unit else math.nan
        except ValueError:
            value = math.nan
        if (
            unit is None
            or not math.isfinite(value)
            or unit.si not in (("m", "rad") if expected == "SI" else (expected,))
        ):
            raise UsageError(f"is '{text[:40]}'", _HINT)
        return cls(value, unit.si, name)

    def __str__(self) -> str:
        return f"{self.joint} = {digits(self.value)} {self.unit}"

    def time_in(self, recording: Recording) -> float:
        """Return the time [s] at which the joint first passes the position; infinite if it never does.

        Raises RecordingError without positions.
        """
        if "position" not in recording:
            raise RecordingError(f"{recording.name}: no position", "map position in [channels], or use a time")
        position = recording["position"]
        column = position.values[:, recording.joints.index(self.joint)]
        known = np.isfinite(column)
        beyond = column[known] >= self.value
        passed = np.flatnonzero(beyond[1:] != beyond[:-1])
        return float(position.time[known][passed[0] + 1]) if len(passed) else math.inf


# The name of every group of injected contacts begins with this word.
INJECTED = "injected"
FORMATS = tuple(suffix.removeprefix(".") for suffix in WRITERS)
# More contacts than this are a mistake in a grid.
_MOST_POSITIONS = 1000


@dataclass(frozen=True)
class NamedObstacle:
    """An obstacle with its name, its stiffness at first touch [N/m], and the group of real impacts to compare with."""

    name: str
    obstacle: Obstacle
    compare_with: str = ""

    @property
    def stiffness(self) -> float:
        """Return the slope of the force curve at first touch, with what is in series [N/m]."""
        penetration, force = self.obstacle.penetration_curve
        return float((force[1] - force[0]) / (penetration[1] - penetration[0]))


@dataclass(frozen=True)
class InjectSection:
    """Every obstacle is put at every position into every log.

    `positions` are marks: distances travelled, or times. `duration` [s] of a recording after its contact. `folder` is
    where `cdtool benchmark` keeps the recordings. `joint`: the axis that meets the obstacle; `lever` [m]: its distance
    from a rotary axis, 0 for the others; `struck`: the point of a robot that meets it.
    """

    logs: tuple[Path, ...]
    obstacles: tuple[NamedObstacle, ...]
    positions: tuple[Mark, ...]
    duration: float
    seed: int
    joint: int
    folder: str
    file_format: str
    struck: StruckPoint | None = None
    lever: float = 0.0

    def groups(self, assumptions: Sequence[Assumption]) -> dict[str, tuple[NamedObstacle, Assumption]]:
        """Return the groups of contacts by name: an obstacle, and what is assumed about the machine."""
        return {
            f"{INJECTED}_{item.name}{assumption.suffix}": (item, assumption)
            for item in self.obstacles
            for assumption in assumptions
        }


def read_inject_section(table: Table, found: LogsOf, joints: tuple[str, ...], groups: tuple[str, ...]) -> InjectSection:
    """Read and check [inject]; raises ConfigurationError naming the key.

    `groups` are the groups of real impacts that an obstacle may be compared with.
    """
    shipped = shipped_obstacles(joined(found.base, table.text("obstacle_file")) if "obstacle_file" in table else None)
    obstacles = _obstacles(table, shipped, groups)
    machine = found.machine_file.machine
    struck = _struck(table, machine)
    joint = table.choice("joint", joints, joints[0])
    section = InjectSection(
        logs=found.of(Table({"logs": table.raw("logs", [])}, table.where, table.prefix)),
        obstacles=obstacles,
        positions=_positions(table, machine),
        duration=table.number("duration_s", 1.0, above=0.0),
        seed=table.whole("seed", 0, minimum=0),
        joint=joints.index(joint),
        folder=table.text("folder", INJECTED),
        file_format=table.choice("format", FORMATS, "csv"),
        struck=struck,
        lever=_lever(table, machine),
    )
    table.finish()
    return section


def _struck(table: Table, machine: Machine) -> StruckPoint | None:
    """Return the point of a robot that meets the obstacle; None for an axis."""
    if not has_links(machine):
        for key in ("link", "point", "direction"):
            if key in table:
                raise table.fault(key, "applies to a planar_arm or urdf_robot only", "remove it")
        return None
    if "joint" in table:
        raise table.fault("joint", "applies to axes only", "give link, and the point of it that meets the obstacle")
    raw = table.raw("link")
    link = table.whole("link", 0, minimum=0) if isinstance(raw, int) else table.text("link")
    if not isinstance(table.raw("point"), list):
        raise table.fault("point", "is missing or no list", "give [x, y, z] in the link's frame, in m")
    x, y, z = table.numbers("point", 3)
    return StruckPoint(link, (x, y, z), _direction(table))


def _lever(table: Table, machine: Machine) -> float:
    """Return the distance of the obstacle from a rotary axis [m]; 0 for other machines."""
    if isinstance(machine, Axis) and machine.force_unit != "N":
        if "lever_arm_m" not in table:
            raise table.fault("lever_arm_m", "is missing", "give the obstacle's distance from the axis of rotation")
        return table.number("lever_arm_m", above=0.0)
    if "lever_arm_m" in table:
        raise table.fault("lever_arm_m", "applies to a rotary_axis only", "remove it")
    return 0.0


def _direction(table: Table) -> tuple[float, float, float] | None:
    """Return the normal of the obstacle in the axes of the base; None for the direction of the point's motion."""
    if not isinstance(table.raw("direction", "motion"), list):
        table.choice("direction", ("motion",), "motion")
        return None
    x, y, z = table.numbers("direction", 3)
    if math.hypot(x, y, z) == 0.0:
        raise table.fault("direction", "has the length 0", 'give a vector such as [0, 0, 1], or "motion"')
    return x, y, z


def _obstacles(table: Table, shipped: Mapping[str, Obstacle], groups: tuple[str, ...]) -> tuple[NamedObstacle, ...]:
    tables = table.table("obstacles")
    found = []
    for name in tables.values:
        if not name.replace("_", "").replace("-", "").isalnum():
            raise tables.fault(name, "is not a valid name", "use letters, digits, - and _")
        own = tables.table(name)
        compared = own.text("compare_with", "")
        if compared and compared not in groups:
            raise own.fault("compare_with", f"is '{compared}'", nearest(compared, groups))
        found.append(NamedObstacle(name, read_obstacle(own, shipped), compared))
    for stiffness in _stiffnesses(table):
        found.append(NamedObstacle(f"{digits(stiffness)}_n_per_mm", Obstacle.spring(stiffness * 1e3)))
    if not found:
        raise table.fault(
            "obstacles", "is missing", "give [inject.obstacles.NAME] with stiffness_n_per_mm, or stiffnesses_n_per_mm"
        )
    if len({item.name for item in found}) < len(found):
        raise table.fault("stiffnesses_n_per_mm", "repeats an obstacle", "list each stiffness once")
    return tuple(found)


def _stiffnesses(table: Table) -> tuple[float, ...]:
    """Return a list of stiffnesses [N/mm], or `{ from, to, per_decade }`, rounded to two digits."""
    if "stiffnesses_n_per_mm" not in table:
        return ()
    if isinstance(table.raw("stiffnesses_n_per_mm"), list):
        return table.numbers("stiffnesses_n_per_mm", len(table.raw("stiffnesses_n_per_mm")), above=0.0)
    grid = table.table("stiffnesses_n_per_mm")
    low, high = grid.number("from", above=0.0), grid.number("to", above=0.0)
    per_decade = grid.whole("per_decade", 2, minimum=1)
    grid.finish()
    if high <= low:
        raise grid.fault("to", f"is {high:g}, not above from", "give a larger stiffness")
    count = max(round(float(np.log10(high / low)) * per_decade), 1) + 1
    return tuple(float(f"{value:.2g}") for value in np.geomspace(low, high, count))


def _positions(table: Table, machine: Machine) -> tuple[Mark, ...]:
    """Return a list of marks, or an equal grid `{ from, to, count }` of marks."""
    raw = table.raw("positions")
    if not isinstance(raw, dict):
        marks = tuple(_mark(table, "positions", text, machine) for text in table.texts("positions"))
        if len({getattr(mark, "joint", None) for mark in marks}) > 1:
            raise table.fault("positions", "are those of different joints", "give positions of one joint")
        if len({f"{digits(mark.value)} {mark.unit}" for mark in marks}) < len(marks):
            raise table.fault("positions", "repeats a position", "list each position once")
        return marks
    grid = table.table("positions")
    begin, end = (_mark(grid, name, grid.text(name), machine) for name in ("from", "to"))
    count = grid.whole("count", 7, minimum=2)
    grid.finish()
    if replace(begin, value=end.value) != end or not end.value > begin.value:
        raise grid.fault("to", "is not after from", "give both in the same unit")
    if count > _MOST_POSITIONS:
        raise grid.fault("count", f"is {count}", f"give at most {_MOST_POSITIONS}")
    return tuple(replace(begin, value=float(value)) for value in np.linspace(begin.value, end.value, count))


def _mark(table: Table, name: str, text: str, machine: Machine) -> Mark:
    try:
        return JointMark.of_machine(text, machine) if "=" in text else Mark.parse(text)
    except UsageError as fault:
        raise table.fault(name, fault.message, fault.hint or MARK_HINT) from fault
