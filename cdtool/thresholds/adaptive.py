"""Limits that widen with what the references demand of the machine (thesis 2.3.3, figure 2.6)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Annotated, Any, ClassVar, Self

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import NothingValidError, SignatureError, UsageError
from cdtool.base.settings import Positive, check, setting
from cdtool.detectors.detection import Band, Signal
from cdtool.recordings.clock import previous_value
from cdtool.recordings.recording import Recording, Series
from cdtool.thresholds.base import with_limits
from cdtool.thresholds.first_order import filtered_slope, low_passed
from cdtool.thresholds.sections import sections
from cdtool.thresholds.settings import SafetyFactor, SidesOfMachine

# Never a measured torque: the controller's response to a contact would raise the limit.
_INPUTS = ("reference_speed", "reference_torque")


@dataclass(frozen=True)
class FittedAdaptive:
    """-+ (c + sum g_j w_j + k s), w_j the excitation of reference j: `gains` (1 + M, J), c first, `spread` s (J,).

    M: the columns of all `inputs`, one per input and joint. If one side is monitored, it is the side that opposes the
    reference speed of the joint with the fastest reference so far; both sides before that joint first moves.
    """

    rule: Adaptive
    inputs: tuple[str, ...]
    gains: FloatArray
    spread: FloatArray
    signed: bool
    safety_factor: float

    def with_safety_factor(self, factor: float) -> FittedAdaptive:
        """Return the threshold with its limits `factor` standard deviations beyond what the references explain."""
        return replace(self, safety_factor=factor)

    def evaluate(self, recording: Recording, signal: Signal) -> tuple[Signal, Band]:
        """Return the signal and its band, NO_LIMIT where a reference is missing.

        Raises RecordingError without a reference, UsageError if the number of joints differs.
        """
        joints = signal.values.shape[1]
        excitation = self.rule.excitation(recording, self.inputs, signal.time)
        if (len(self.gains), len(self.spread)) != (excitation.shape[1], joints):
            raise UsageError(
                f"{recording.name}: learned for {len(self.spread)} joints, not for {joints}", "learn again"
            )
        reach = excitation @ self.gains + self.safety_factor * self.spread
        lower, upper = -reach, reach
        if self.rule.sides == "one":
            direction = _direction(recording, signal.time) if self.signed else np.ones(len(signal.time))
            known = ~np.isnan(reach)
            upper = np.where((direction < 0.0)[:, np.newaxis] & known, np.inf, upper)
            lower = np.where((direction > 0.0)[:, np.newaxis] & known, -np.inf, lower)
        return with_limits(signal, lower, upper)

    def to_dict(self) -> dict[str, Any]:
        """Return the threshold as JSON values."""
        return {
            "settings": asdict(self.rule),
            "inputs": list(self.inputs),
            "gains": self.gains.tolist(),
            "spread": self.spread.tolist(),
            "signed": self.signed,
            "safety_factor": self.safety_factor,
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the threshold that `to_dict` has written."""
        return cls(
            rule=Adaptive(**values["settings"]),
            inputs=tuple(map(str, values["inputs"])),
            gains=np.array(values["gains"], dtype=np.float64),
            spread=np.array(values["spread"], dtype=np.float64),
            signed=bool(values["signed"]),
            safety_factor=float(values["safety_factor"]),
        )


@dataclass(frozen=True)
class Adaptive:
    """Limits -+ (c + sum g_j LP{|HP{u_j}|} + `safety_factor` s) on the signal, u_j the references.

    Raises
    ------
    UsageError
        A setting is unknown or outside its range.

    Notes
    -----
    Thesis 2.3.3 and figure 2.6. u: the reference speed, and the reference torque if every run has it, of
    all joints. c and g by non-negative least squares of |i| over the runs. The high-pass is exact for a straight line
    between samples; the low-pass lags a ramp by 2 % too much at steps of T2 / 2, by 8 % at T2. Over a gap both continue
    with the longer step. Measured torques are never used: the response of the controller to a contact would raise the
    limit. It needs no repeated path and serves any class of motion. Fails if the model is wrong at constant excitation,
    because c must then grow, and with a constant offset such as friction, for which both limits must leave room.

    Examples
    --------
    With constant references only c is left, the mean of |i|.

    >>> import numpy as np
    >>> time, valid = np.arange(400) * 1e-3, np.zeros((400, 1), dtype=np.uint8)
    >>> run = Recording("run", "", ("axis",), {"reference_speed": Series(time, np.full(400, 0.2), "m/s")})
    >>> signal = Signal(time, np.full((400, 1), 5.0), valid, "N")
    >>> _, band = Adaptive().fit([(run, signal), (run, signal)]).evaluate(run, signal)
    >>> band.lower[-1, 0].round(2).item(), band.upper[-1, 0].round(2).item()
    (-5.0, 5.0)
    """

    safety_factor: SafetyFactor = 5.5
    sides: SidesOfMachine = None
    high_pass: Annotated[Positive, setting("time constant T1 of HP = s T1 / (1 + s T1)", unit="s")] = 0.1
    low_pass: Annotated[Positive, setting("time constant T2 of LP = 1 / (1 + s T2)", unit="s")] = 0.1

    name: ClassVar[str] = "adaptive"
    needs: ClassVar[tuple[str, ...]] = ("reference_speed",)
    fitted: ClassVar[tuple[type, ...]] = (FittedAdaptive,)

    def __post_init__(self) -> None:
        check(self)

    def fit(self, pairs: Sequence[tuple[Recording, Signal]]) -> FittedAdaptive:
        """Learn the gains from at least 2 impact-free runs of any class; see `Threshold.fit`."""
        if len(pairs) < 2:
            raise SignatureError(f"adaptive limits need at least 2 impact-free runs, {len(pairs)} given", "add runs")
        inputs = tuple(
            name for name in _INPUTS if all(name in recording for recording, _ in pairs) or name in self.needs
        )
        excitations = [self.excitation(recording, inputs, signal.time) for recording, signal in pairs]
        signals = [signal for _, signal in pairs]
        joints = signals[0].values.shape[1]
        columns = [_least_squares(signals, excitations, j) for j in range(joints)]
        return FittedAdaptive(
            rule=self,
            inputs=inputs,
            gains=np.column_stack([gains for gains, _ in columns]),
            spread=np.array([spread for _, spread in columns]),
            signed=signals[0].signed,
            safety_factor=self.safety_factor,
        )

    def excitation(self, recording: Recording, inputs: Sequence[str], clock: FloatArray) -> FloatArray:
        """Return 1 and LP{|HP{u_j}|} of each reference and joint (n, 1 + M) on the signal's clock; NaN if missing."""
        parts = [np.ones((len(clock), 1))]
        for name in inputs:
            series = recording[name]
            for column in series.values.T:
                present = np.isfinite(column)
                if not present.any():
                    parts.append(np.full((len(clock), 1), np.nan))
                    continue
                part = sections(series.time, present, np.zeros(len(column), dtype=bool), np.inf)
                high = self.high_pass * filtered_slope(column[part.index], part.step, self.high_pass)
                low = low_passed(np.abs(high), part.step, self.low_pass)
                parts.append(previous_value(Series(series.time[part.index], low, "1"), clock))
        return np.hstack(parts)


def _least_squares(signals: Sequence[Signal], excitations: Sequence[FloatArray], j: int) -> tuple[FloatArray, float]:
    """Return non-negative gains of |i| of one column on the excitations, and the standard deviation of the rest."""
    from scipy.optimize import nnls

    size = excitations[0].shape[1]
    normal, right, square, number = np.zeros((size, size)), np.zeros(size), 0.0, 0
    for signal, excitation in zip(signals, excitations, strict=True):
        use = signal.valid[:, j] & np.isfinite(excitation).all(axis=1)
        rows, values = excitation[use], np.abs(signal.values[use, j])
        normal += rows.T @ rows
        right += rows.T @ values
        square += float(values @ values)
        number += len(values)
    if not number:
        raise NothingValidError(f"a joint has no valid sample ({signals[0].why_not()})", "another detector")
    # Scaled to a unit diagonal, because references have different units; the ridge keeps it definite.
    scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
    root = np.linalg.cholesky(normal * np.outer(scale, scale) + 1e-9 * np.eye(size))
    gains = scale * nnls(root.T, np.linalg.solve(root, scale * right))[0]
    left = square - 2.0 * float(gains @ right) + float(gains @ normal @ gains)
    return gains, float(np.sqrt(max(left, 0.0) / number))


def _direction(recording: Recording, clock: FloatArray) -> FloatArray:
    """Return the sign of the leading joint's reference speed, held where it is zero; 0 before it first moves.

    The leading joint so far: the one with the fastest reference up to the sample.
    """
    series = recording["reference_speed"]
    speed = np.nan_to_num(series.values)
    leading = np.argmax(np.maximum.accumulate(np.abs(speed), axis=0), axis=1)
    sign = np.sign(speed[np.arange(len(speed)), leading])
    last = np.maximum.accumulate(np.where(sign != 0.0, np.arange(len(sign)), 0))
    return np.nan_to_num(previous_value(Series(series.time, sign[last], "1"), clock)[:, 0])
