"""The signature: the normal band along a stroke, learned from impact-free runs (thesis 5.2.3, 6.2.3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import FieldsError, NothingValidError, SignatureError, UsageError
from cdtool.base.settings import NotNegative, Positive, check, setting
from cdtool.detectors.detection import Signal
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.motion.progress import Alignment, Progress
from cdtool.recordings.motion.speed_course import TIME_RESERVE
from cdtool.recordings.recording import Recording
from cdtool.thresholds.common_class import common_class
from cdtool.thresholds.fitted_signature import (
    FittedSignature,
    SpreadRule,
    axes_of,
    progress_of,
)
from cdtool.thresholds.settings import Sides, SidesOfMachine
from cdtool.thresholds.signature_curve import Curve, resample

# With fewer runs a spread along the stroke is too uncertain for a limit: see Coverage in docs/signature.md.
ENOUGH_RUNS = 10
# Not even a forced signature has a spread below these.
LEAST_RUNS = 2

#: 40 m in steps of 2 mm; memory and time grow with the places, and a wrong unit makes a thousand times as many.
MOST_PLACES = 20_000


@dataclass(frozen=True)
class Signature:
    """The normal band along the stroke: mean -+ `safety_factor` * pooled spread of at least 10 impact-free runs.

    Raises
    ------
    UsageError
        A setting is unknown or outside its range.

    Notes
    -----
    Thesis 5.2.3 and 6.2.3. Learned for one class of motion (direction and speed). Fails with another speed (see
    `speed_range`), payload or path, with temperature steps, in the first metres after a long stop, and with few runs.

    Examples
    --------
    Ten strokes at 0.2 m/s with 19 N and 21 N in turn: mean 20 N, standard deviation 1.05 N.

    >>> import numpy as np
    >>> from cdtool.recordings.recording import Series
    >>> time, valid = np.arange(2001) * 1e-3, np.zeros((2001, 1), dtype=np.uint8)
    >>> channels = {"speed": Series(time, np.full(2001, 0.2), "m/s"), "position": Series(time, 0.2 * time, "m")}
    >>> strokes = [Recording(f"{i}", "", ("axis",), channels) for i in range(10)]
    >>> forces = [np.full((2001, 1), 19.0 + 2.0 * (i % 2)) for i in range(10)]
    >>> pairs = [(stroke, Signal(time, force, valid, "N")) for stroke, force in zip(strokes, forces)]
    >>> fitted = Signature(sides="one").fit(pairs)
    >>> _, band = fitted.evaluate(*pairs[0])
    >>> band.upper[1000, 0].round(1).item(), band.lower[1000, 0].item()
    (25.8, -inf)
    """

    safety_factor: Annotated[
        Positive | None, setting('k, standard deviations from mean to limit; default: 5.5, or 1 with the rule "thesis"')
    ] = None
    sides: SidesOfMachine = None
    alignment: Annotated[
        Alignment,
        setting("location along the stroke: time while accelerating, then travel; or one of them"),
    ] = "time_then_position"
    rule: Annotated[
        SpreadRule,
        setting(
            "pooled: spread over neighbours within the window, with the deviation of the mean from its smoothed curve; "
            "thesis: mean + 1 standard deviation at each point, which raises an alarm in almost every run"
        ),
    ] = "pooled"
    position_step: Annotated[Positive, setting("grid along the travel", unit="m or rad")] = 2e-3
    position_window: Annotated[
        Positive, setting("neighbours pooled to either side; at least the step", unit="m or rad")
    ] = 20e-3
    force: Annotated[bool, setting("learn from fewer than 10 runs, but at least 2")] = False
    adaptive_level: Annotated[
        NotNegative,
        setting(
            "the band follows the slow change of a run by at most this many spreads (temperature, an offset); "
            "0: it stays; only with the threshold `signature`"
        ),
    ] = 0.0
    speed_range: Annotated[
        bool,
        setting(
            'between two learned speeds the band is interpolated; only with the threshold `signature`, not with "time"'
        ),
    ] = False

    name: ClassVar[str] = "signature"
    needs: ClassVar[tuple[str, ...]] = ("speed", "position")
    fitted: ClassVar[tuple[type, ...]] = (FittedSignature,)
    by_class: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check(self)
        if self.position_step > self.position_window:
            fields = ("position_step", "position_window")
            raise FieldsError(fields, f"is {self.position_step:g}, more than position_window", "see docs/signature.md")
        if self.speed_range and self.alignment == "time":
            raise FieldsError(
                ("speed_range", "alignment"),
                "cannot be combined with alignment 'time': at another speed a time is another location",
                "choose time_then_position or position",
            )

    @property
    def factor(self) -> float:
        """The safety factor k; by default 5.5, or 1 with the rule "thesis"."""
        if self.safety_factor is not None:
            return self.safety_factor
        return 1.0 if self.rule == "thesis" else 5.5

    def sided(self, default: Sides) -> Signature:
        """Return the rule with the sides of the machine, unless it states its own; `fit` without either: one side."""
        return self if self.sides else replace(self, sides=default)

    def fit(self, pairs: Sequence[tuple[Recording, Signal]]) -> FittedSignature:
        """Learn from impact-free runs of one class of motion; see `Threshold.fit`."""
        self._check_number(len(pairs))
        return self.fit_class(pairs, common_class([recording for recording, _ in pairs], self.alignment))

    def fit_class(self, pairs: Sequence[tuple[Recording, Signal]], motion: MotionClass) -> FittedSignature:
        """Learn from impact-free runs that are known to be of one class of motion; raises as `fit`."""
        places = [progress_of(recording, signal.time, motion) for recording, signal in pairs]
        joints = pairs[0][1].values.shape[1]
        # In time the grid and the window are what they are in position at the nominal speed.
        pace = 1.0 / motion.nominal_speed
        step, window = pace * self.position_step, pace * self.position_window
        lasting = self._longest_time(places)
        longest = max((float(np.nanmax(at.travel, initial=0.0)) for at in places), default=0.0)
        if max(longest / self.position_step, lasting / step) > MOST_PLACES:
            unit = pairs[0][0]["position"].unit
            raise UsageError(
                f"a travel of {longest:.6g} {unit} has more than {MOST_PLACES:,} places of {self.position_step:g} "
                f"{unit}: transmission_ratio or the position's unit may be wrong",
                "correct it, or set a larger position_step in [signature]",
            )
        by_time = Curve.empty(step, window, lasting, joints)
        by_travel = Curve.empty(self.position_step, self.position_window, longest, joints)
        samples: tuple[list[FloatArray], list[FloatArray]] = ([], [])
        for (_, signal), at in zip(pairs, places, strict=True):
            for store, (curve, axis) in zip(samples, axes_of(by_time, by_travel, at), strict=True):
                store.append(resample(signal, at, curve, axis))
        fitted = FittedSignature(
            motion=motion,
            alignment=self.alignment,
            rule=self.rule,
            sides=self.sides or "one",
            safety_factor=self.factor,
            signed=pairs[0][1].signed,
            joints=pairs[0][1].joints,
            by_time=by_time.learned(np.array(samples[0])),
            by_travel=by_travel.learned(np.array(samples[1])),
            adaptive_level=self.adaptive_level,
            speed_range=self.speed_range,
        )
        if not any(np.isfinite(curve.band(True)[0]).any() for curve in (fitted.by_time, fitted.by_travel)):
            reasons = pairs[0][1].why_not() if not pairs[0][1].valid.any() else "valid in too few runs at a time"
            raise NothingValidError(
                f"the runs share no part of the stroke where the signal is assessable ({reasons})",
                "another detector, or other joints",
            )
        return fitted

    def _check_number(self, runs: int) -> None:
        enough = LEAST_RUNS if self.force else ENOUGH_RUNS
        if runs < enough:
            many = "run" if runs == 1 else "runs"
            more = f"{enough - runs} more {'is' if enough - runs == 1 else 'are'} needed to have {enough}"
            fewer = f"to learn from fewer, but at least {LEAST_RUNS}: signature.force = true"
            raise SignatureError(
                f"{runs} impact-free {many} of one class: {more}", "add runs" if self.force else f"add runs; {fewer}"
            )

    def _longest_time(self, places: Sequence[Progress]) -> float:
        lasting = []
        for at in places:
            part = at.elapsed if self.alignment == "time" else at.elapsed[~at.running]
            lasting.append(float(np.nanmax(part, initial=0.0)))
        reserve = 1.0 if self.alignment == "time" else TIME_RESERVE
        return reserve * max(lasting, default=0.0)
