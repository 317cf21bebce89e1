"""Why a protocol does not say "pass": facts with their numbers; sentences are made where they are shown."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import date
from typing import Literal

from cdtool.commands.protocol.assessment.plan import Due, MeasuringPoint
from cdtool.truth.force.verdict import StepCause

Outcome = Literal["pass", "fail", "incomplete"]
Value = str | int | float | date


# A force or pressure above its limit, or a contact where none may be; any other reason leaves a protocol incomplete.
FAILING = frozenset(("point_exceeds", "pressure_exceeds", "not_permissible"))
# Reasons about a measuring point that its plan shows.
_BEFORE_TEST = frozenset(("no_profile", "not_permissible", "too_few_planned", "wrong_stiffness"))


@dataclass(frozen=True)
class Reason:
    """One reason, with the values of its sentence; `cause` is that of a step that could not be assessed.

    `kind` is the name of the sentence in the table [reason] of every language.
    """

    kind: str
    values: Mapping[str, Value] = field(default_factory=dict)
    cause: StepCause | None = None
    due: Due = "before_test"

    @classmethod
    def of_point(cls, kind: str, point: MeasuringPoint, cause: StepCause | None = None, /, **values: Value) -> Reason:
        """Return a reason about a measuring point."""
        return cls(kind, {"point": point.name, **values}, cause, "before_test" if kind in _BEFORE_TEST else "test_day")

    @property
    def outcome(self) -> Outcome:
        """Return what it leads to."""
        return "fail" if self.kind in FAILING else "incomplete"


@dataclass(frozen=True)
class ProtocolVerdict:
    """The verdict of a protocol, with every reason.

    Fail beats incomplete, incomplete beats pass: the reasons for both are listed, those of a fail first.
    """

    reasons: tuple[Reason, ...] = ()

    @property
    def outcome(self) -> Outcome:
        """Return fail if any reason fails, otherwise incomplete if there is a reason, otherwise pass."""
        order: tuple[Outcome, ...] = ("fail", "incomplete", "pass")
        return min((reason.outcome for reason in self.reasons), key=order.index, default="pass")
