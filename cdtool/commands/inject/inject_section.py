"""The section [inject] of a benchmark file: which contacts are put into which impact-free logs.

A position in a log at which a named joint is at a given angle or place.

Obstacles by name: of a benchmark file, and those that ship with cdtool.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from msgspec import Meta

from cdtool.base.errors import ConfigurationError, FieldsError, RecordingError, UsageError, nearest
from cdtool.base.files.bounded_loading import read_toml
from cdtool.base.plain_text import digits
from cdtool.base.settings import Count, CountFromZero, NotNegative, Place, Positive, read, setting
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


@dataclass(frozen=True, kw_only=True)
class ObstacleTable:
    """[inject.obstacles.NAME], or a shipped obstacle: one of a profile, a spring or a force curve."""

    profile: Annotated[str, setting("name of a shipped obstacle")] = ""
    stiffness_n_per_mm: Annotated[Positive | None, setting("of a spring", unit="N/mm")] = None
    force_n: Annotated[tuple[NotNegative, ...], setting("forces of a curve, from 0", unit="N")] = ()
    deflection_mm: Annotated[tuple[NotNegative, ...], setting("deflections of a curve, from 0", unit="mm")] = ()
    damping_s_per_m: Annotated[
        NotNegative | None, setting("T (1 + damping * speed); default: that of the profile, or 0", unit="s/m")
    ] = None
    in_series_n_per_mm: Annotated[
        Positive,
        setting("in series, such as a load cell; adds to that of a profile", unit="N/mm", infinite=True),
    ] = math.inf
    compare_with: Annotated[str, setting("a group of real impacts")] = ""
    title: Annotated[str, setting("what it is, of a shipped obstacle")] = ""
    checked: Annotated[bool, setting("whether someone has checked the values against their source")] = False

    def __post_init__(self) -> None:
        names = ("profile", "stiffness_n_per_mm", "force_n")
        forms = [name for name in names if getattr(self, name)]
        if len(forms) != 1:
            given = " and ".join(forms) or f"none of {', '.join(names)}"
            raise UsageError(f"{given} is given", f"give one of {', '.join(names)}")
        if self.force_n and (len(self.force_n) < 2 or len(self.force_n) != len(self.deflection_mm)):
            fields = ("force_n", "deflection_mm")
            raise FieldsError(fields, "and deflection_mm do not fit", "give two or more of each, both from 0")


def shipped_obstacles() -> dict[str, Obstacle]:
    """Return the obstacles that ship with cdtool by name; raises ConfigurationError naming the key.

    >>> round(shipped_obstacles()["en_12453_force_meter"].steepest)
    500000
    """
    place = Place("the shipped obstacles.toml")
    values = read_toml(_SHIPPED, "a file of obstacles")
    tables = {name: read(ObstacleTable, table, place.below(name)) for name, table in values.items()}
    place.finish()
    return {name: _obstacle(table, {}, place.below(name)) for name, table in tables.items() if table}


def _obstacle(table: ObstacleTable, known: Mapping[str, Obstacle], place: Place) -> Obstacle:
    """Return the obstacle that a table describes; raises ConfigurationError.

    A given damping replaces that of a profile, a given series stiffness adds to its.
    """
    damping, series = table.damping_s_per_m or 0.0, table.in_series_n_per_mm * _PER_MM
    if table.profile:
        if table.profile not in known:
            raise place.fault("profile", f"is '{table.profile}'", nearest(table.profile, known))
        spring = known[table.profile]
        damping = spring.damping if table.damping_s_per_m is None else damping
        compliance = 1.0 / series + 1.0 / spring.series_stiffness
        return Obstacle(spring.deflection, spring.force, damping, 1.0 / compliance if compliance else math.inf)
    if table.stiffness_n_per_mm:
        return Obstacle.spring(table.stiffness_n_per_mm * _PER_MM, damping, series)
    try:
        return Obstacle(tuple(item / _PER_MM for item in table.deflection_mm), table.force_n, damping, series)
    except ConfigurationError as fault:
        raise place.fault("force_n", fault.message, fault.hint) from fault


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


@dataclass(frozen=True, kw_only=True)
class StiffnessGrid:
    """Stiffnesses in equal steps of their logarithm, rounded to two digits."""

    begin: Annotated[Positive, setting("the smallest", key="from", unit="N/mm")]
    end: Annotated[Positive, setting("the largest", key="to", unit="N/mm")]
    per_decade: Annotated[Count, setting("how many in a decade")] = 2

    def __post_init__(self) -> None:
        if self.end <= self.begin:
            raise FieldsError(("end", "begin"), f"is {self.end:g}, not above from", "give a larger stiffness")

    @property
    def values(self) -> tuple[float, ...]:
        """Return the stiffnesses [N/mm]."""
        count = max(round(float(np.log10(self.end / self.begin)) * self.per_decade), 1) + 1
        return tuple(float(f"{value:.2g}") for value in np.geomspace(self.begin, self.end, count))


@dataclass(frozen=True, kw_only=True)
class PositionGrid:
    """Positions in equal steps."""

    begin: Annotated[str, setting("the first, such as 0.9m, 3.2s or elbow = 62deg", key="from")]
    end: Annotated[str, setting("the last", key="to")]
    count: Annotated[Annotated[int, Meta(ge=2, le=_MOST_POSITIONS)], setting("how many")] = 7


@dataclass(frozen=True, kw_only=True)
class InjectTable:
    """[inject]: each obstacle is put at each position into each log."""

    logs: Annotated[tuple[str, ...], setting("impact-free logs; a log with a contact is left out")]
    positions: Annotated[
        tuple[str, ...] | PositionGrid,
        setting("where the obstacle is reached: distances travelled (0.9m), times (3.2s) or the position of a joint"),
    ]
    obstacles: Annotated[dict[str, ObstacleTable], setting("obstacles by name")] = field(default_factory=dict)
    stiffnesses_n_per_mm: Annotated[
        tuple[Positive, ...] | StiffnessGrid, setting("springs without damping, one obstacle each", unit="N/mm")
    ] = ()
    duration_s: Annotated[
        Positive, setting("length of a recording after its contact; a log that ends sooner is left out", unit="s")
    ] = 1.0
    joint: Annotated[str, setting("the axis that meets the obstacle; distances are its travel; default: the first")] = (
        ""
    )
    lever_arm_m: Annotated[
        Positive | None,
        setting("distance of the obstacle from the axis of rotation; required for a rotary_axis, else not allowed"),
    ] = None
    link: Annotated[
        str | CountFromZero, setting("planar_arm and urdf_robot, in place of `joint`: the link that meets the obstacle")
    ] = ""
    point: Annotated[tuple[float, float, float] | None, setting("its point in the link's frame", unit="m")] = None
    direction: Annotated[
        tuple[float, float, float] | Literal["motion"],
        setting("normal of the obstacle in the axes of the base, or motion: that of the point"),
    ] = "motion"
    seed: Annotated[CountFromZero, setting("of the fraction of a sample at which the contact begins")] = 0
    folder: Annotated[str, setting("where `cdtool benchmark` keeps the recordings")] = INJECTED
    file_format: Annotated[str, setting(f"one of {', '.join(FORMATS)}", key="format")] = "csv"

    def __post_init__(self) -> None:
        if self.file_format not in FORMATS:
            raise FieldsError(("file_format",), f"is '{self.file_format}'", nearest(self.file_format, FORMATS))
        if self.direction != "motion" and not any(self.direction):
            raise FieldsError(("direction",), "has the length 0", 'give a vector such as [0, 0, 1], or "motion"')


def inject_section(table: InjectTable, place: Place, found: LogsOf, groups: tuple[str, ...]) -> InjectSection:
    """Return the section that [inject] describes, with mistakes of single keys in `place`; raises ConfigurationError.

    `groups` are the groups of real impacts that an obstacle may be compared with.
    """
    machine = found.machine_file.machine
    joints = machine.joints
    shipped = shipped_obstacles()
    if table.joint and table.joint not in joints:
        place.note("joint", f"is '{table.joint}'", nearest(table.joint, joints))
    return InjectSection(
        logs=place.tried((), found.of, table.logs, place),
        obstacles=place.tried((), _obstacles, table, place, shipped, groups),
        positions=place.tried((), _positions, table.positions, place, machine),
        duration=table.duration_s,
        seed=table.seed,
        joint=joints.index(table.joint) if table.joint in joints else 0,
        folder=table.folder,
        file_format=table.file_format,
        struck=_struck(table, place, machine),
        lever=place.tried(0.0, _lever, table, place, machine),
    )


def _struck(table: InjectTable, place: Place, machine: Machine) -> StruckPoint | None:
    """Return the point of a robot that meets the obstacle; None for an axis."""
    if not has_links(machine):
        for key in ("link", "point"):
            if getattr(table, key) not in ("", None):
                place.note(key, "applies to a planar_arm or urdf_robot only", "remove it")
        if table.direction != "motion":
            place.note("direction", "applies to a planar_arm or urdf_robot only", "remove it")
        return None
    if table.joint:
        place.note("joint", "applies to axes only", "give link, and the point of it that meets the obstacle")
    if table.link == "":
        place.note("link", "is missing", "name the link that meets the obstacle")
    if table.point is None:
        place.note("point", "is missing", "give [x, y, z] in the link's frame, in m")
        return None
    return StruckPoint(table.link, table.point, None if table.direction == "motion" else table.direction)


def _lever(table: InjectTable, place: Place, machine: Machine) -> float:
    """Return the distance of the obstacle from a rotary axis [m]; 0 for other machines."""
    is_rotary = isinstance(machine, Axis) and machine.force_unit != "N"
    if is_rotary and table.lever_arm_m is None:
        raise place.fault("lever_arm_m", "is missing", "give the obstacle's distance from the axis of rotation")
    if not is_rotary and table.lever_arm_m is not None:
        raise place.fault("lever_arm_m", "applies to a rotary_axis only", "remove it")
    return table.lever_arm_m or 0.0


def _obstacles(
    table: InjectTable, place: Place, shipped: Mapping[str, Obstacle], groups: tuple[str, ...]
) -> tuple[NamedObstacle, ...]:
    below = place.below("obstacles")
    found = []
    for name, own in table.obstacles.items():
        if not name.replace("_", "").replace("-", "").isalnum():
            below.note(name, "is not a valid name", "use letters, digits, - and _")
        if own.compare_with and own.compare_with not in groups and not place.has_mistake(f"impacts.{own.compare_with}"):
            below.below(name).note("compare_with", f"is '{own.compare_with}'", nearest(own.compare_with, groups))
        with place.noting():
            found.append(NamedObstacle(name, _obstacle(own, shipped, below.below(name)), own.compare_with))
    springs = table.stiffnesses_n_per_mm
    for stiffness in springs.values if isinstance(springs, StiffnessGrid) else springs:
        found.append(NamedObstacle(f"{digits(stiffness)}_n_per_mm", Obstacle.spring(stiffness * _PER_MM)))
    if not found and not table.obstacles:
        raise place.fault(
            "obstacles", "is missing", "give [inject.obstacles.NAME] with stiffness_n_per_mm, or stiffnesses_n_per_mm"
        )
    if len({item.name for item in found}) < len(found):
        raise place.fault("stiffnesses_n_per_mm", "repeats an obstacle", "list each stiffness once")
    return tuple(found)


def _positions(given: tuple[str, ...] | PositionGrid, place: Place, machine: Machine) -> tuple[Mark, ...]:
    """Return a list of marks, or an equal grid of marks."""
    if isinstance(given, PositionGrid):
        below = place.below("positions")
        begin, end = _mark(below, "from", given.begin, machine), _mark(below, "to", given.end, machine)
        if replace(begin, value=end.value) != end or not end.value > begin.value:
            raise below.fault("to", "is not after from", "give both in the same unit")
        return tuple(replace(begin, value=float(value)) for value in np.linspace(begin.value, end.value, given.count))
    names = [f"positions[{number}]" if len(given) > 1 else "positions" for number in range(1, len(given) + 1)]
    parsed = [place.tried(None, _mark, place, name, text, machine) for name, text in zip(names, given, strict=True)]
    marks = tuple(mark for mark in parsed if mark)
    if len({getattr(mark, "joint", None) for mark in marks}) > 1:
        raise place.fault("positions", "are those of different joints", "give positions of one joint")
    if len({f"{digits(mark.value)} {mark.unit}" for mark in marks}) < len(marks):
        raise place.fault("positions", "repeats a position", "list each position once")
    return marks


def _mark(place: Place, name: str, text: str, machine: Machine) -> Mark:
    try:
        return JointMark.of_machine(text, machine) if "=" in text else Mark.parse(text)
    except UsageError as fault:
        raise place.fault(name, fault.message, fault.hint or MARK_HINT) from fault
