"""The result of an audit of a season: runs, joints, and the changes that are shown."""

from __future__ import annotations

from dataclasses import dataclass

from cdtool.commands.signature.deviation import Axis
from cdtool.recordings.motion import MotionClass
from cdtool.statistics.trends import ChangeOverRuns


@dataclass(frozen=True)
class AuditedRun:
    """One run and one joint: see `Deviations` for what is in spreads, and its signs.

    `overall`: shift of the whole stroke. `local`: the largest one beyond it, at the place `local_at`; NaN where none is
    valid. `critical_factor`: the safety factor at which this joint would alarm; `margin_used` is its share of the one
    in use, 1 at an alarm. `alarm`: whether this joint does.
    """

    name: str
    overall: float
    local: float
    local_at: float
    critical_factor: float
    margin_used: float
    alarm: bool


@dataclass(frozen=True)
class Shown:
    """A change that is shown: its trend over the runs, and its location (None: the whole stroke).

    `outward`: it goes towards a limit.
    """

    course: ChangeOverRuns
    place: float | None
    outward: bool


@dataclass(frozen=True)
class JointDrift:
    """One joint over the season: runs, and changes of the whole stroke and of a location along `axis`, in its `unit`.

    `course` is the change of the runs' `overall`; `overall` and `local` are None if no change is shown.
    """

    joint: str
    two_sided: bool
    axis: Axis
    unit: str
    runs: tuple[AuditedRun, ...]
    course: ChangeOverRuns
    overall: Shown | None
    local: Shown | None

    @property
    def shown(self) -> tuple[Shown, ...]:
        """The changes shown, a location first: it must be inspected before anything is learned."""
        return tuple(item for item in (self.local, self.overall) if item is not None)


@dataclass(frozen=True)
class DriftAudit:
    """Runs of one class of motion in order of time, compared with one signature, which does not change meanwhile.

    Locations are along `axis`, in its `unit`: m or rad of travel, or s since the motion began. `not_assessable`: runs
    that were nowhere assessable, and why; they are in no row.
    """

    motion: MotionClass
    safety_factor: float
    axis: Axis
    unit: str
    joints: tuple[JointDrift, ...]
    not_assessable: tuple[tuple[str, str], ...]

    @property
    def names(self) -> tuple[str, ...]:
        """The runs that were assessed."""
        return tuple(item.name for item in self.joints[0].runs)

    @property
    def alarms(self) -> tuple[int, ...]:
        """The runs in which any joint alarms, by their index in `names`."""
        return tuple(i for i in range(len(self.names)) if any(joint.runs[i].alarm for joint in self.joints))

    @property
    def drifts(self) -> bool:
        """Whether a change of any joint is shown."""
        return any(item.shown for item in self.joints)
