"""Several thresholds as one: an alarm if any of them is exceeded, or if all are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np

from cdtool.base.errors import FieldsError
from cdtool.base.settings import NOT_A_KEY, Positive, check, setting
from cdtool.detectors.detection import Band, Signal, Status
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.recording import Recording
from cdtool.thresholds.adaptive import Adaptive
from cdtool.thresholds.base import FittedThreshold, Threshold, exceedance
from cdtool.thresholds.cusum import Cusum
from cdtool.thresholds.fitted_signature import known
from cdtool.thresholds.glr import Glr
from cdtool.thresholds.innovation import Innovation
from cdtool.thresholds.limit import Limit
from cdtool.thresholds.limit_and_trend import LimitAndTrend
from cdtool.thresholds.predicted_limit import PredictedLimit
from cdtool.thresholds.settings import SidesOfMachine, with_context
from cdtool.thresholds.signature import Signature
from cdtool.thresholds.trend import Trend

ACTIVATIONS = ("any", "all")
_RULES: dict[str, type[Threshold]] = {
    rule.name: rule
    for rule in (Signature, Limit, PredictedLimit, Trend, LimitAndTrend, Innovation, Adaptive, Cusum, Glr)
}
_FITTED: dict[str, Any] = {item.__name__: item for rule in _RULES.values() for item in rule.fitted}
# Shares of a limit are clipped here: a side without a limit is infinitely far away.
_FAR = 1e3


@dataclass(frozen=True)
class FittedCombined:
    """Members with their own safety factors; the statistic is the share of their limits that is reached."""

    members: tuple[FittedThreshold, ...]
    activation: str
    safety_factor: float

    @property
    def motion(self) -> MotionClass | None:
        """The class of motion of the members that have one."""
        classes = (getattr(item, "motion", None) for item in self.members)
        return next((item for item in classes if item is not None), None)

    def with_safety_factor(self, factor: float) -> FittedCombined:
        """Return the threshold with every member's safety factor times `factor`."""
        return replace(self, safety_factor=factor)

    def evaluate(self, recording: Recording, signal: Signal) -> tuple[Signal, Band]:
        """Return the share and its band (-inf, k); valid where any member is, or all are."""
        shares, states = [], []
        for member in self.members:
            statistic, met_at = exceedance(member, recording, signal)
            shares.append(np.clip(met_at / member.safety_factor, -_FAR, _FAR))
            states.append(statistic.status)
        share, status = np.array(shares), np.array(states)
        valid = status == Status.VALID
        if self.activation == "any":
            values = np.max(np.where(valid, share, -_FAR), axis=0)
            judged = valid.any(axis=0)
        else:
            values = np.min(share, axis=0)
            judged = valid.all(axis=0)
        # Of several reasons, the one with the highest code is reported.
        status = np.where(judged, Status.VALID, status.max(axis=0)).astype(np.uint8)
        values = np.where(judged, values, np.nan)
        limit = np.full(values.shape, self.safety_factor)
        return replace(signal, values=values, status=status, unit="1"), Band(np.full(values.shape, -np.inf), limit)

    def to_dict(self) -> dict[str, Any]:
        """Return the threshold as JSON values."""
        members = [{"fitted": type(item).__name__, **item.to_dict()} for item in self.members]
        return {"members": members, "activation": self.activation, "safety_factor": self.safety_factor}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the threshold that `to_dict` has written."""
        members = tuple(_FITTED[item["fitted"]].from_dict(item) for item in values["members"])
        return cls(members, known("activation", values["activation"], ACTIVATIONS), float(values["safety_factor"]))


@dataclass(frozen=True)
class Combined:
    """Several thresholds as one: an alarm if any of them is exceeded, or if all are.

    Raises
    ------
    UsageError
        A setting or a member is unknown, or there are fewer than two members.

    Notes
    -----
    The statistic is the largest (any) or smallest (all) share k*/k_m, where k* is the safety factor at which a member's
    limit would be met (`exceedance`); without unit. Fails if its members fail: "any" with each false alarm of each of
    them, "all" with each contact that one of them does not detect, and if members respond at different times.

    Examples
    --------
    Half sine waves with peaks of 9, 10 and 11 N: the limit of both members is reached at a peak of 10 + 5.5 N.

    >>> import numpy as np
    >>> time, valid = np.arange(501) * 1e-3, np.zeros((501, 1), dtype=np.uint8)
    >>> wave, run = np.sin(2.0 * np.pi * time)[:, np.newaxis], Recording("run", "", ("axis",), {})
    >>> fitted = Combined().fit([(run, Signal(time, peak * wave, valid, "N")) for peak in (9.0, 10.0, 11.0)])
    >>> share, band = fitted.evaluate(run, Signal(time, 15.5 * wave, valid, "N"))
    >>> np.nanmax(share.values).round(3).item(), band.upper[0, 0].item()
    (1.0, 1.0)
    """

    safety_factor: Annotated[Positive, setting("multiplies the members' safety factors")] = 1.0
    sides: SidesOfMachine = None
    members: Annotated[tuple[str, ...], setting("two thresholds or more, each with its defaults")] = (
        "limit",
        "trend",
    )
    activation: Annotated[Literal["any", "all"], setting("whether one member or all of them must be exceeded")] = "any"
    signature: Annotated[Signature | None, NOT_A_KEY] = None

    name: ClassVar[str] = "combined"
    needs: ClassVar[tuple[str, ...]] = ()
    fitted: ClassVar[tuple[type, ...]] = (FittedCombined,)

    def __post_init__(self) -> None:
        check(self)
        if len(self.members) < 2:
            raise FieldsError(("members",), f"are {list(self.members)}", "two or more thresholds are needed")
        for name in self.members:
            known("member", name, tuple(_RULES))

    @property
    def by_class(self) -> bool:
        """Whether a member belongs to a class of motion."""
        return any(getattr(rule, "by_class", False) for rule in self._rules())

    def fit(self, pairs: Sequence[tuple[Recording, Signal]]) -> FittedCombined:
        """Fit every member to the runs; see `Threshold.fit`."""
        members = tuple(rule.fit(pairs) for rule in self._rules())
        return FittedCombined(members, self.activation, self.safety_factor)

    def _rules(self) -> list[Threshold]:
        return [with_context(_RULES[name](), self.sides, self.signature) for name in self.members]
