"""Matched banks: the evidence of contact-shaped templates in several channels, whitened together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Self

import numpy as np

from cdtool.detection import WHOLE_MACHINE, Band, Evidence, Signal, Status
from cdtool.errors import NothingValidError, SignatureError, UsageError
from cdtool.motion import MotionClass
from cdtool.recording import FloatArray, Recording
from cdtool.thresholds.matched_model import (
    Deviation,
    MatchedModel,
    average_along_stroke,
    fit_autoregression,
    spread_evenly,
    usual_sizes,
)
from cdtool.thresholds.matched_templates import banks_of, designed
from cdtool.thresholds.settings import check_sides
from cdtool.thresholds.signature import Signature
from cdtool.thresholds.statistic_limit import common_period

# The models and the sizes are learned from at most so many runs, evenly spread: more do not change them.
_MOST_RUNS = 300
# The speed of a settled motion may differ by so many spreads of the runs', and by at least this share of it.
_SPEED_SPREADS, _SPEED_SHARE = 4.0, 0.05
# In the start phase the limits are so many times as far away, for changes of friction and speed, and the spread of the
# runs' maxima counts so many times, for a smaller share of the false alarms.
_START_WIDER, _START_SPREADS = 2.0, 2.0
_HIGHEST_ORDER = 60
# So many runs are few: each of these parts of them is tested with a model of the others.
_FEW_RUNS, _FOLDS = 60, 5


@dataclass(frozen=True)
class FittedMatchedBanks:
    """The largest standardised evidence of any bank, compared with `safety_factor`, for one class of motion."""

    model: MatchedModel
    safety_factor: float
    _latest: list[tuple[Recording, Signal, Signal]] = field(default_factory=list, compare=False, repr=False)

    whole_machine: ClassVar[bool] = True

    @property
    def motion(self) -> MotionClass:
        """The class of motion that it was learned for."""
        return self.model.motion

    def with_safety_factor(self, factor: float) -> FittedMatchedBanks:
        """Return the threshold with its limit at `factor`."""
        return replace(self, safety_factor=factor)

    def __getstate__(self) -> dict[str, Any]:
        """Return the state without the latest result."""
        return {"model": self.model, "safety_factor": self.safety_factor, "_latest": []}

    def evaluate(self, recording: Recording, signal: Signal) -> tuple[Signal, Band]:
        """Return the largest evidence (n, 1) of the whole machine and its band (-inf, k).

        Status GAP where a column has no sample, NO_LIMIT where no template runs, OTHER_SPEED from where the motion is
        settled at a speed that was not learned, OTHER_RATE where the sample rate is not that of the runs. Raises
        SignatureError for other columns than those learned.
        """
        if signal.joints != self.model.signature.joints:
            learned, given = (", ".join(names) or "none" for names in (self.model.signature.joints, signal.joints))
            raise SignatureError(
                f"{recording.name}: learned for the columns {learned}, not for {given}",
                "learn from logs with the same channels",
            )
        # Bands of several factors have the same statistic: each log is evaluated once.
        for known_recording, known_signal, known in self._latest[:1]:
            if known_recording is recording and known_signal is signal:
                statistic = known
                break
        else:
            statistic = self._statistic(recording, signal)
            self._latest[:] = [(recording, signal, statistic)]
        upper = np.full(statistic.values.shape, self.safety_factor)
        return statistic, Band(np.full(upper.shape, -np.inf), upper)

    def _statistic(self, recording: Recording, signal: Signal) -> Signal:
        evidence, status = self.model.standardised(recording, signal)
        values = np.fmax.reduce(evidence, axis=0)
        status[(status == Status.VALID) & np.isnan(values)] = Status.NO_LIMIT
        values[status != Status.VALID] = np.nan
        lost = None if signal.lost is None else signal.lost.any(axis=1, keepdims=True)
        return signal.changed(
            values=np.ascontiguousarray(values[:, np.newaxis]),
            status=np.ascontiguousarray(status[:, np.newaxis]),
            unit="1",
            joints=WHOLE_MACHINE,
            channels=(),
            lost=lost,
        )

    def explained(self, recording: Recording, signal: Signal, time: float) -> Evidence | None:
        """Return which bank, template and columns decide at a time [s]; None where nothing is assessable.

        Parameters
        ----------
        recording : Recording
            The recording on the load side.
        signal : Signal
            The detector's signal (n, C).
        time : float
            A time of the recording, for example that of an alarm [s].

        Returns
        -------
        Evidence or None
            Bank, template and how far each of the bank's columns has moved.
        """
        return self.model.explained(recording, signal, time)

    def to_dict(self) -> dict[str, Any]:
        """Return the threshold as JSON values."""
        return {"model": self.model.to_dict(), "safety_factor": self.safety_factor}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the threshold that `to_dict` has written."""
        return cls(MatchedModel.from_dict(values["model"]), float(values["safety_factor"]))


@dataclass(frozen=True)
class MatchedBanks:
    """Limit `safety_factor` on the largest evidence of contact-shaped templates in all columns of a signal.

    Parameters
    ----------
    safety_factor : float
        The limit, in standard deviations of the largest evidence of an impact-free run, above its mean.
    sides : {"one", "two"}, optional
        "one" looks for what opposes the motion only; None: both.
    order : int, optional
        Order of the vector autoregression, 1 to 60; None: 4 for a single column, 20 for several joints.
    signature : Signature, optional
        How mean and spread of the start phase are learned; by default `Signature()`. Its `position_step` is also that
        of the mean along the stroke.

    Raises
    ------
    UsageError
        A setting is unknown or outside its range.

    Notes
    -----
    Not in the thesis; a matched filter in coloured noise (Kay, Fundamentals of Statistical Signal Processing II, 1998,
    4.4 and 5.4) with an own estimate of size and drift. Once the motion is settled, with y the columns:

        r = (y - mean(x)) / s,   e_k = S^(-1/2) (r_k - sum A_i r_{k-i}),   b = sum g'e,   Z^2 = max 2 b'x - x'Gx, x >= 0

    A, S by least squares from impact-free runs, g a ramp (t/L)^m as whitened by them. From 20 ms on the mean innovation
    before the template is subtracted. Z is divided by its usual size along the stroke and, if it is larger than usual,
    by its own size up to L before. Each template, then each bank, is standardised by mean and standard deviation of
    the runs' maxima, and the largest counts: one number sets one limit for all. Before, in the start phase, the
    deviation from a signature counts, in spreads, standardised by twice that mean and four times that deviation.

    After a missing sample there is no evidence from as many samples as `order`. Fails with contacts before the motion
    is settled (only strong ones are seen), slower than the longest template, or against another direction than those
    of the templates; with less than one missing-free section of `order` samples it detects nothing.

    Examples
    --------
    >>> import numpy as np
    >>> from cdtool.recording import Series
    >>> time, valid = np.arange(3000) * 1e-3, np.zeros((3000, 1), dtype=np.uint8)
    >>> speed = np.minimum(time, 0.2)
    >>> channels = {"speed": Series(time, speed, "m/s"), "position": Series(time, np.cumsum(speed) * 1e-3, "m")}
    >>> strokes = [Recording(f"{i}", "", ("axis",), channels) for i in range(12)]
    >>> rng = np.random.default_rng(1)
    >>> noise = [Signal(time, rng.normal(size=(3000, 1)), valid, "N", joints=("axis",)) for _ in strokes]
    >>> fitted = MatchedBanks().fit(list(zip(strokes, noise)))
    >>> hit = noise[0].changed(values=noise[0].values + 3.0 * (time[:, np.newaxis] >= 2.0))
    >>> statistic, band = fitted.evaluate(strokes[0], hit)
    >>> outside = time[statistic.values[:, 0] > band.upper[:, 0]]
    >>> statistic.values.shape, bool(2.0 <= outside[0] < 2.02)
    ((3000, 1), True)
    """

    safety_factor: float = 6.0
    sides: str | None = None
    order: int | None = None
    signature: Signature | None = None

    name: ClassVar[str] = "matched_banks"
    needs: ClassVar[tuple[str, ...]] = ("speed", "position")
    fitted: ClassVar[tuple[type, ...]] = (FittedMatchedBanks,)
    by_class: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check_sides(self.safety_factor, self.sides)
        if self.order is not None and not 1 <= self.order <= _HIGHEST_ORDER:
            raise UsageError(f"order is {self.order}", f"a whole number from 1 to {_HIGHEST_ORDER}")

    def fit(self, pairs: Sequence[tuple[Recording, Signal]]) -> FittedMatchedBanks:
        """Learn from impact-free runs of one class of motion; see `Threshold.fit`."""
        first, of_first = pairs[0]
        for recording, signal in pairs:
            if signal.joints != of_first.joints:
                own, others = ", ".join(signal.joints), ", ".join(of_first.joints)
                raise SignatureError(
                    f"{recording.name} has the columns {own}, {first.name} {others}",
                    "learn from logs with the same channels: leave one of the two out",
                )
        rule = self.signature or Signature()
        model = self._learned(pairs, rule)
        tested = self._tested(model, pairs, replace(rule, force=True))
        largest = np.array([_largest(one.evidence(*pair, factor)) for one, pair, factor in tested])
        banked = np.array([_largest(one.with_maxima(largest).by_bank(*pair, factor)) for one, pair, factor in tested])
        centre, spread = _moments(banked)
        centre[-1] *= _START_WIDER
        spread[-1] *= _START_WIDER * _START_SPREADS
        model = replace(model.with_maxima(largest), of_banks=np.array([centre, spread]))
        return FittedMatchedBanks(model, self.safety_factor)

    def _learned(self, pairs: Sequence[tuple[Recording, Signal]], rule: Signature) -> MatchedModel:
        """Return the model of some runs, with evidence that is not standardised yet."""
        two_sided = self.sides != "one"
        sides = "two" if two_sided else "one"
        signature = replace(rule, sides=sides, safety_factor=1.0, adaptive_level=0.0, speed_range=False).fit(pairs)
        period, step = common_period(pairs), rule.position_step
        signal = pairs[0][1]
        columns = signal.channels or (("", "whole machine"),) * signal.values.shape[1]
        kinds = tuple(channel for channel, _ in columns) if signal.channels else ()
        banks = banks_of(kinds, tuple(joint for _, joint in columns), two_sided, self.order)
        begin, mean = average_along_stroke(pairs, signature, period, step)
        model = MatchedModel.blank(signature, period, step, begin, mean, banks)
        some = spread_evenly(pairs, _MOST_RUNS)
        alone = _alone(pairs)
        deviations = [model.deviation(recording, item).times(alone) for recording, item in some]
        scale = _scale(deviations)
        models = tuple(
            fit_autoregression([part for item in deviations for part in item.sections(bank.columns, scale)], bank.order)
            for bank in banks
        )
        model = replace(model, scale=scale, models=models, design=designed(banks, models, period, len(scale)))
        model = replace(model, speeds=_speeds(model, pairs))
        return model.with_usual(usual_sizes(model, some, alone))

    def _tested(
        self, model: MatchedModel, pairs: Sequence[tuple[Recording, Signal]], forced: Signature
    ) -> list[tuple[MatchedModel, tuple[Recording, Signal], float]]:
        """Return runs with a model and a factor of their deviations with which their evidence is as that of new runs.

        Few runs are each tested with the model of others, because a model fits its own runs too well. Of many runs,
        only their share in the mean counts.
        """
        if len(pairs) > _FEW_RUNS:
            return [(model, pair, _alone(pairs)) for pair in spread_evenly(pairs, _MOST_RUNS)]
        tested = []
        for fold in range(_FOLDS):
            others = [pair for i, pair in enumerate(pairs) if i % _FOLDS != fold]
            one = self._learned(others, forced)
            tested += [(one, pair, 1.0) for pair in pairs[fold::_FOLDS]]
        return tested


def _alone(pairs: Sequence[Any]) -> float:
    """Return the factor by which a run deviates more from a mean that does not contain it."""
    return len(pairs) / (len(pairs) - 1.0)


def _scale(deviations: Sequence[Deviation]) -> FloatArray:
    squares = np.sum([(item.values**2).sum(axis=1) for item in deviations], axis=0)
    number = np.sum([item.usable.sum(axis=1) for item in deviations], axis=0)
    if not number.all() or not squares.all():
        raise NothingValidError(
            "a column of the signal has no valid samples, or no variation of its own, once the motion is settled",
            "longer runs at constant speed, or another detector",
        )
    scale: FloatArray = np.sqrt(squares / number)
    return scale


def _speeds(model: MatchedModel, pairs: Sequence[tuple[Recording, Signal]]) -> tuple[float, float]:
    """Return the slowest and fastest settled speed to which the model applies [load unit/s]."""
    speeds = np.array([model.settled(recording, signal.time).speed for recording, signal in pairs])
    speeds = speeds[np.isfinite(speeds)]
    if not len(speeds):
        raise SignatureError("no run is settled for 0.06 s", "learn from runs with a section at constant speed")
    middle = float(speeds.mean())
    reach = max(_SPEED_SPREADS * float(speeds.std()), _SPEED_SHARE * middle)
    return middle - reach, middle + reach


def _largest(evidence: FloatArray) -> FloatArray:
    """Return the maximum (B,) of each row, NaN for one that nowhere runs."""
    maxima: FloatArray = np.fmax.reduce(evidence, axis=1, initial=-np.inf)
    return np.where(np.isfinite(maxima), maxima, np.nan)


def _moments(maxima: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return mean and standard deviation of the runs' maxima (runs, B); 0 and 1 where they are not known."""
    known = np.isfinite(maxima)
    number = np.maximum(known.sum(axis=0), 1)
    centre = np.where(known, maxima, 0.0).sum(axis=0) / number
    spread = np.sqrt(np.where(known, (maxima - centre) ** 2, 0.0).sum(axis=0) / np.maximum(number - 1, 1))
    return centre, np.where(spread > 0.0, spread, 1.0)
