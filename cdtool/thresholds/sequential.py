"""Constant limits on a statistic of the whitened deviation, shared by `innovation`, `cusum` and `glr`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol, Self

from cdtool.detectors.detection import Band, Signal
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.recording import Recording
from cdtool.thresholds.base import Threshold
from cdtool.thresholds.limit import FittedLimit, Limit
from cdtool.thresholds.settings import on_side, watched_side
from cdtool.thresholds.signature import Signature
from cdtool.thresholds.stored import rule_from_dict, rule_to_dict
from cdtool.thresholds.whitening import Whitening


class SequentialRule(Threshold, Protocol):
    """A threshold that derives a statistic from innovations."""

    @property
    def safety_factor(self) -> float:
        """The limit, in the statistic's unit."""
        ...

    @property
    def sides(self) -> str | None:
        """One or two; None, not filled in by `with_context`, is two."""
        ...

    @property
    def order(self) -> int:
        """Order of the autoregressive model."""
        ...

    @property
    def signature(self) -> Signature | None:
        """How mean and spread are learned; None: by default."""
        ...

    def statistic(self, innovations: Signal, side: int, longest_gap: float) -> Signal:
        """Return the statistic, causal; `side` +1 or -1 if one is monitored; a gap over `longest_gap` s restarts it."""
        ...


@dataclass(frozen=True)
class FittedSequential:
    """A rule's statistic of the innovations, compared with -k and +k, for one class of motion."""

    rule: SequentialRule
    whitening: Whitening
    limit: FittedLimit
    side: int

    @property
    def motion(self) -> MotionClass:
        """The class that it was learned for."""
        return self.whitening.signature.motion

    @property
    def safety_factor(self) -> float:
        """The limit k, in the statistic's unit."""
        return self.limit.safety_factor

    def with_safety_factor(self, factor: float) -> FittedSequential:
        """Return the threshold with its limits at -+ `factor`."""
        return replace(self, limit=self.limit.with_safety_factor(factor))

    def evaluate(self, recording: Recording, signal: Signal) -> tuple[Signal, Band]:
        """Return the statistic and its band; raises SignatureError for other joints than those learned."""
        innovations = self.whitening.innovations(recording, signal)
        return self.limit.evaluate(recording, self.rule.statistic(innovations, self.side, self.whitening.longest_gap))

    def band_of(self, recording: Recording, statistic: Signal) -> Band:
        """Return the band of a statistic that was evaluated before."""
        return self.limit.evaluate(recording, statistic)[1]

    def to_dict(self) -> dict[str, Any]:
        """Return the threshold as JSON values."""
        return {
            # The signature's own settings are in the learned one.
            **rule_to_dict(replace(self.rule, signature=None)),
            "whitening": self.whitening.to_dict(),
            "limit": self.limit.to_dict(),
            "side": self.side,
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the threshold that `to_dict` has written."""
        return cls(
            rule=rule_from_dict(values),
            whitening=Whitening.from_dict(values["whitening"]),
            limit=FittedLimit.from_dict(values["limit"]),
            side=int(values["side"]),
        )


def fit_sequential(rule: SequentialRule, pairs: Sequence[tuple[Recording, Signal]]) -> FittedSequential:
    """Learn signature and autoregressive model from runs of one class, with limits -+ k; raises SignatureError."""
    whitening = Whitening.learned(rule.signature or Signature(), rule.order, pairs)
    signature = whitening.signature
    side = watched_side(rule.sides, signature.motion, signature.signed)
    limit = on_side(Limit.given([1.0]), side).with_safety_factor(rule.safety_factor)
    return FittedSequential(rule, whitening, limit, side)
