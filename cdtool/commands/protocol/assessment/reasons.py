"""Why a protocol does not say "pass": facts with their numbers; sentences are made where they are shown."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import date
from enum import Enum
from typing import Literal

from cdtool.commands.protocol.assessment.plan import Due
from cdtool.truth.force.verdict import StepCause

Outcome = Literal["pass", "fail", "incomplete"]
Value = str | int | float | date


class ReasonKind(Enum):
    """What is wrong; the value is its name in the tables of sentences."""

    POINT_EXCEEDS = "point_exceeds"
    NOT_PERMISSIBLE = "not_permissible"
    NO_VALUE = "no_value"
    NO_POINT = "no_point"
    NO_FORCE_INSTRUMENT = "no_force_instrument"
    NO_PROFILE = "no_profile"
    TOO_FEW_PLANNED = "too_few_planned"
    TOO_FEW_REPETITIONS = "too_few_repetitions"
    TOO_MANY_REPETITIONS = "too_many_repetitions"
    NOT_MEASURED = "not_measured"
    NO_FILE = "no_file"
    NOT_ASSESSABLE = "not_assessable"
    UNREADABLE = "unreadable"
    NO_FORCE = "no_force"
    IN_PROGRESS = "in_progress"
    SAME_RECORDING = "same_recording"
    SAME_MEASUREMENT = "same_measurement"
    CALIBRATION_EXPIRED = "calibration_expired"
    CALIBRATED_LATER = "calibrated_later"
    STATED_RATE_TOO_LOW = "stated_rate_too_low"
    RATE_TOO_LOW = "rate_too_low"
    RATE_DIFFERS = "rate_differs"
    RECORD_TOO_SHORT = "record_too_short"
    LAST_STEP_TOO_SHORT = "last_step_too_short"
    PEAK_BETWEEN_SAMPLES = "peak_between_samples"
    DATA_LOST = "data_lost"
    BEYOND_RANGE = "beyond_range"
    SATURATED = "saturated"
    NEAR_RANGE = "near_range"
    RESOLUTION_DECIDES = "resolution_decides"
    DRIFT_DECIDES = "drift_decides"
    REST_DECIDES = "rest_decides"
    WRONG_STIFFNESS = "wrong_stiffness"
    PRESSURES_MISSING = "pressures_missing"
    PRESSURE_EXCEEDS = "pressure_exceeds"
    PRESSURE_NOT_MEASURED = "pressure_not_measured"
    PRESSURE_NOT_ASSESSABLE = "pressure_not_assessable"
    PRESSURE_DOES_NOT_RISE = "pressure_does_not_rise"
    PRESSURE_TIME_UNKNOWN = "pressure_time_unknown"
    PRESSURE_REST_DECIDES = "pressure_rest_decides"
    PRESSURE_BETWEEN_SAMPLES = "pressure_between_samples"
    PRESSURE_BEYOND_RANGE = "pressure_beyond_range"
    NO_PRESSURE_INSTRUMENT = "no_pressure_instrument"
    SPEED_DIFFERS = "speed_differs"
    SPEED_MISSING = "speed_missing"
    BENCHMARK_UNREADABLE = "benchmark_unreadable"

    @property
    def outcome(self) -> Outcome:
        """Return what it leads to: a force or pressure above its limit, or a contact where none may be, fails."""
        failing = (ReasonKind.POINT_EXCEEDS, ReasonKind.PRESSURE_EXCEEDS, ReasonKind.NOT_PERMISSIBLE)
        return "fail" if self in failing else "incomplete"


@dataclass(frozen=True)
class Reason:
    """One reason, with the values of its sentence; `cause` is that of a step that could not be assessed."""

    kind: ReasonKind
    values: Mapping[str, Value] = field(default_factory=dict)
    cause: StepCause | None = None
    due: Due = "before_test"


@dataclass(frozen=True)
class ProtocolVerdict:
    """The verdict of a protocol, with every reason.

    Fail beats incomplete, incomplete beats pass: the reasons for both are listed, those of a fail first.
    """

    reasons: tuple[Reason, ...] = ()

    @property
    def outcome(self) -> Outcome:
        """Return fail if any reason fails, otherwise incomplete if there is a reason, otherwise pass."""
        return worst([reason.kind.outcome for reason in self.reasons])

    def of(self, outcome: Outcome) -> tuple[Reason, ...]:
        """Return the reasons that lead to an outcome."""
        return tuple(reason for reason in self.reasons if reason.kind.outcome == outcome)


def worst(outcomes: list[Outcome]) -> Outcome:
    """Return the outcome of several.

    Parameters
    ----------
    outcomes : list of str
        Any number of outcomes.

    Returns
    -------
    str
        Fail if one fails, otherwise incomplete if one is incomplete, otherwise pass, also of none.

    Examples
    --------
    >>> worst(["pass", "incomplete"]), worst(["incomplete", "fail"]), worst([])
    ('incomplete', 'fail', 'pass')
    """
    order: tuple[Outcome, ...] = ("fail", "incomplete", "pass")
    return min(outcomes, key=order.index, default="pass")
