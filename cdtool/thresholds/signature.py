"""The signature: the normal band along a stroke, learned from impact-free runs (thesis 5.2.3, 6.2.3)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np

from cdtool.detection import Band, Signal
from cdtool.errors import NothingValidError, SignatureError, UsageError, nearest
from cdtool.motion import MotionClass, motion_class
from cdtool.recording import FloatArray, Recording
from cdtool.thresholds.alignment import ALIGNMENTS, Progress, progress
from cdtool.thresholds.base import with_limits
from cdtool.thresholds.signature_curve import Curve, resample

RULES = ("pooled", "thesis")
SIDES = ("one", "two")
ENOUGH_RUNS = 10
# Speeds of one class differ by at most this share.
SPEED_TOLERANCE = 0.05

_START_SHARE = 0.1
_RUNNING_SHARE = 0.95
# The time curve reaches this much beyond the slowest run's acceleration.
_TIME_RESERVE = 1.5


@dataclass(frozen=True)
class FittedSignature:
    """Statistics of the runs along the stroke, for one class of motion, and the rule that makes limits of them.

    `evaluate`: time since motion start counts while accelerating, travel afterwards (or one of them alone). Status
    NO_LIMIT before the motion starts and where too few runs have been.
    """

    motion: MotionClass
    alignment: str
    rule: str
    sides: str
    safety_factor: float
    signed: bool
    joints: tuple[str, ...]
    by_time: Curve
    by_position: Curve

    def evaluate(self, recording: Recording, signal: Signal) -> tuple[Signal, Band]:
        """The signal and its band on the signal's clock; raises RecordingError without speed and position.

        Raises SignatureError where the signal is of other joints than those that were learned.
        """
        if signal.joints != self.joints:
            learned, given = (", ".join(names) or "none" for names in (self.joints, signal.joints))
            raise SignatureError(f"learned for the joints {learned}, not for {given}", "learn a signature for these")
        where = self._progress(recording, signal.time)
        shape = signal.values.shape
        lower, upper = np.full(shape, np.nan), np.full(shape, np.nan)
        for curve, axis, use in self._curves(where):
            low, high = self.limits(curve)
            for j in range(shape[1]):
                lower[use, j] = curve.at(low[:, j], axis[use])
                upper[use, j] = curve.at(high[:, j], axis[use])
        return with_limits(signal, lower, upper)

    def limits(self, curve: Curve) -> tuple[FloatArray, FloatArray]:
        """Lower and upper limit (g, J) on a curve's grid: mean -+ k s, the side without a limit infinite."""
        mean, spread = curve.band(pooled=self.rule == "pooled")
        reach = self.safety_factor * spread
        lower, upper = mean - reach, mean + reach
        if self.sides == "one":
            if self.signed and self.motion.direction < 0:
                upper = np.where(np.isnan(upper), np.nan, np.inf)
            else:
                lower = np.where(np.isnan(lower), np.nan, -np.inf)
        return lower, upper

    def with_run(self, recording: Recording, signal: Signal, forget: float | None = None) -> FittedSignature:
        """The signature with one more impact-free run, by Welford's update, or by forgetting with N_eff = `forget`."""
        where = self._progress(recording, signal.time)
        sample = [resample(signal, where, curve, axis) for curve, axis in _axes(self.by_time, self.by_position, where)]
        return replace(
            self,
            by_time=self.by_time.updated(sample[0], forget),
            by_position=self.by_position.updated(sample[1], forget),
        )

    @property
    def runs(self) -> int:
        """The largest number of runs at any grid point."""
        return int(max(self.by_time.count.max(initial=0), self.by_position.count.max(initial=0)))

    def to_dict(self) -> dict[str, Any]:
        """As JSON values."""
        return {
            "direction": self.motion.direction,
            "nominal_speed": self.motion.nominal_speed,
            "leading_joint": self.motion.joint,
            "alignment": self.alignment,
            "rule": self.rule,
            "sides": self.sides,
            "safety_factor": self.safety_factor,
            "signed": self.signed,
            "joints": list(self.joints),
            "by_time": self.by_time.to_dict(),
            "by_position": self.by_position.to_dict(),
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """The inverse of `to_dict`."""
        return cls(
            motion=MotionClass(int(values["direction"]), float(values["nominal_speed"]), int(values["leading_joint"])),
            alignment=_known("alignment", values["alignment"], ALIGNMENTS),
            rule=_known("rule", values["rule"], RULES),
            sides=_known("sides", values["sides"], SIDES),
            safety_factor=float(values["safety_factor"]),
            signed=bool(values["signed"]),
            joints=tuple(map(str, values["joints"])),
            by_time=Curve.from_dict(values["by_time"]),
            by_position=Curve.from_dict(values["by_position"]),
        )

    def _progress(self, recording: Recording, clock: FloatArray) -> Progress:
        speed = self.motion.nominal_speed
        return progress(
            recording,
            clock,
            self.motion.direction,
            _START_SHARE * speed,
            _RUNNING_SHARE * speed,
            self.motion.joint,
        )

    def _curves(self, where: Progress) -> list[tuple[Curve, FloatArray, Any]]:
        started = np.isfinite(where.elapsed)
        if self.alignment == "time":
            return [(self.by_time, where.elapsed, started)]
        if self.alignment == "position":
            return [(self.by_position, where.travel, started)]
        return [
            (self.by_time, np.minimum(where.elapsed, self.by_time.end), started & ~where.running),
            (self.by_position, where.travel, started & where.running),
        ]


@dataclass(frozen=True)
class Signature:
    """The normal band along the stroke: mean + `safety_factor` * pooled spread of at least 10 impact-free runs.

    `rule` "pooled": spread over neighbours within the window, the mean's deviation from its smoothed course included;
    "thesis": mean + 1 standard deviation, point by point, which alarms in almost every run. `sides` "one" watches the
    side on which an obstacle opposes the motion, "two" both; None leaves it to the machine (see `for_machine`). Grid
    and window of the position in load units (m or rad). Fails with another speed, payload or path, with temperature
    steps, in the first metres after a long stop, with few runs.
    """

    safety_factor: float | None = None
    sides: str | None = None
    alignment: str = "time_then_position"
    rule: str = "pooled"
    position_step: float = 2e-3
    position_window: float = 20e-3
    force: bool = False

    name: ClassVar[str] = "signature"
    needs: ClassVar[tuple[str, ...]] = ("speed", "position")

    def __post_init__(self) -> None:
        _known("rule", self.rule, RULES)
        if self.sides is not None:
            _known("sides", self.sides, SIDES)
        _known("alignment", self.alignment, ALIGNMENTS)
        if self.safety_factor is not None and not self.safety_factor > 0.0:
            raise UsageError(f"safety factor is {self.safety_factor}", "a number above 0 is needed")
        if not (0.0 < self.position_step <= self.position_window):
            raise UsageError("the grid step must be above 0 and at most the window", "see docs/signature.md")

    @property
    def factor(self) -> float:
        """The safety factor k: 5.5, or 1 by the thesis's rule, where none is given."""
        if self.safety_factor is not None:
            return self.safety_factor
        return 1.0 if self.rule == "thesis" else 5.5

    def for_machine(self, default_sides: str) -> Signature:
        """The rule with the machine's own sides where none are given: one for an axis, two for a robot."""
        return self if self.sides else replace(self, sides=default_sides)

    def fit(self, pairs: Sequence[tuple[Recording, Signal]]) -> FittedSignature:
        """Learn from impact-free runs of one class; raises SignatureError where they are too few or differ."""
        self._check_number(len(pairs))
        motion = self._common_class([recording for recording, _ in pairs])
        wheres = [
            progress(
                recording,
                signal.time,
                motion.direction,
                _START_SHARE * motion.nominal_speed,
                _RUNNING_SHARE * motion.nominal_speed,
                motion.joint,
            )
            for recording, signal in pairs
        ]
        joints = pairs[0][1].values.shape[1]
        # In time the grid and the window are what they are in position at the nominal speed.
        pace = 1.0 / motion.nominal_speed
        step, window = pace * self.position_step, pace * self.position_window
        by_time = Curve.empty(step, window, self._longest_time(wheres), joints)
        longest = max((float(np.nanmax(where.travel, initial=0.0)) for where in wheres), default=0.0)
        by_position = Curve.empty(self.position_step, self.position_window, longest, joints)
        samples: tuple[list[FloatArray], list[FloatArray]] = ([], [])
        for (_, signal), where in zip(pairs, wheres, strict=True):
            for store, (curve, axis) in zip(samples, _axes(by_time, by_position, where), strict=True):
                store.append(resample(signal, where, curve, axis))
        fitted = FittedSignature(
            motion=motion,
            alignment=self.alignment,
            rule=self.rule,
            sides=self.sides or "one",
            safety_factor=self.factor,
            signed=pairs[0][1].signed,
            joints=pairs[0][1].joints,
            by_time=by_time.learned(np.array(samples[0])),
            by_position=by_position.learned(np.array(samples[1])),
        )
        if not any(np.isfinite(curve.band(True)[0]).any() for curve in (fitted.by_time, fitted.by_position)):
            reasons = pairs[0][1].why_not() if not pairs[0][1].valid.any() else "valid in too few runs at a time"
            raise NothingValidError(
                f"the runs share no part of the stroke where the signal can be judged ({reasons})",
                "another detector, or other joints",
            )
        return fitted

    def _check_number(self, runs: int) -> None:
        if runs < 2 or (runs < ENOUGH_RUNS and not self.force):
            many = "run" if runs == 1 else "runs"
            raise SignatureError(
                f"{runs} impact-free {many} of one class: {ENOUGH_RUNS - runs} more are needed",
                f"add runs to have {ENOUGH_RUNS}, or --force to learn from fewer, but never from fewer than 2",
            )

    def _common_class(self, recordings: Sequence[Recording]) -> MotionClass:
        classes = [motion_class(recording) for recording in recordings]
        nominal = float(np.median([item.nominal_speed for item in classes]))
        common = MotionClass(classes[0].direction, nominal, classes[0].joint)
        if common.direction == 0:
            raise SignatureError(f"{recordings[0].name}: the axis does not move", "learn from runs with motion")
        for recording, item in zip(recordings, classes, strict=True):
            if not item.matches(common, SPEED_TOLERANCE):
                raise SignatureError(
                    f"{recording.name}: runs {item.described}, the others {common.described}",
                    "a signature belongs to one direction and speed; leave the run out",
                )
        return common

    def _longest_time(self, wheres: Sequence[Progress]) -> float:
        lasting = []
        for where in wheres:
            part = where.elapsed if self.alignment == "time" else where.elapsed[~where.running]
            lasting.append(float(np.nanmax(part, initial=0.0)))
        reserve = 1.0 if self.alignment == "time" else _TIME_RESERVE
        return reserve * max(lasting, default=0.0)


def _axes(by_time: Curve, by_position: Curve, where: Progress) -> tuple[tuple[Curve, FloatArray], ...]:
    return ((by_time, where.elapsed), (by_position, where.travel))


def _known(what: str, value: Any, allowed: Sequence[str]) -> str:
    if value not in allowed:
        raise UsageError(f"unknown {what} '{value}'", nearest(str(value), allowed))
    return str(value)
