"""Updating a signature without learning a slowly growing fault: change per run capped, all changes bounded."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.errors import SignatureError, UsageError
from cdtool.detectors.detection import Signal
from cdtool.recordings.motion.progress import Progress
from cdtool.recordings.recording import Recording
from cdtool.thresholds.fitted_signature import FittedSignature
from cdtool.thresholds.signature_curve import Curve

# A run counts as no further from the mean than this many spreads. Of Gaussian scatter 0.3 % is clipped, so that the
# spread comes out 0.3 % smaller than without a cap.
CAP = 3.0
# No limit is learned further than this many of the first spreads from where it was first learned. On the simulated
# gate, where nothing drifts, 14 runs determine the spread so poorly that 2 would refuse a fifth of all runs; 3: 3 %.
RESERVE = 3.0
# A run that covers this share of the learned stroke has completed it.
_COMPLETE = 0.95


def guarded(
    first: FittedSignature,
    current: FittedSignature,
    recording: Recording,
    signal: Signal,
    effective_runs: float | None = None,
    cap: float = CAP,
    reserve: float = RESERVE,
) -> FittedSignature:
    """Return a signature with one more impact-free run, unless a limit would move too far from the one first learned.

    Parameters
    ----------
    first : FittedSignature
        The signature as first learned.
    current : FittedSignature
        The signature to update.
    recording : Recording
        The run, on the load side.
    signal : Signal
        The detector's signal of the run.
    effective_runs : float, optional
        How many runs are remembered: the weight of this one is w = 1 / effective_runs. By default Welford's update,
        w = 1 / (n + 1).
    cap : float
        The deviation of the run from the mean is clipped to this many spreads; see `largest_move` for the effect.
    reserve : float
        All updates together move no limit by more than this many spreads of `first`.

    Returns
    -------
    FittedSignature
        The updated signature.

    Raises
    ------
    SignatureError
        A limit would move too far, with its location, or the run does not complete the stroke.
    UsageError
        `cap` or `reserve` is not above 0.

    Examples
    --------
    `cdtool.update_signature` updates a signature file run by run and has an example.
    """
    for name, value in (("cap", cap), ("reserve", reserve)):
        if not value > 0.0:
            raise UsageError(f"{name} is {value:g}", "a number of spreads above 0")
    check_complete(current, recording, signal)
    updated = current.with_run(recording, signal, effective_runs, cap)
    at = current.progress(recording, signal.time)
    unit = recording["position"].unit
    for part in _parts(first.with_safety_factor(updated.safety_factor), updated, at):
        part.check(reserve, unit)
    return updated


def largest_move(safety_factor: float, weight: float, cap: float) -> float:
    """Return how far one run can move a limit, in the largest spread near it.

    w c + k (sqrt((1 + 2 w c)^2 + w c^2) - 1), `weight` w as in `guarded`, `cap` c, safety factor k. With that spread S
    the mean moves by at most w c S, its deviation from its smoothed curve by twice that, the variance by at most
    w (c S)^2. A run that deviates by c spreads or more everywhere moves an even limit by
    w c + k (sqrt((1 - w) (1 + w c^2)) - 1) if runs are forgotten.
    """
    shift = weight * cap
    return shift + safety_factor * (float(np.sqrt((1.0 + 2.0 * shift) ** 2 + shift * cap)) - 1.0)


def check_complete(signature: FittedSignature, recording: Recording, signal: Signal) -> None:
    """Raise SignatureError, with the share that was covered, if a run ends before the stroke that was learned."""
    at = signature.progress(recording, signal.time)
    by_time = signature.alignment == "time"
    reached, end = (at.elapsed, signature.by_time.end) if by_time else (at.travel, signature.by_travel.end)
    share = float(np.nanmax(reached, initial=0.0)) / end if end > 0.0 else 1.0
    if share < _COMPLETE:
        raise SignatureError(
            f"covers {100.0 * share:.0f} % of the learned stroke: not completed", "update with whole strokes"
        )


@dataclass(frozen=True)
class _CurveLimits:
    """The limits of one curve before and after, (g, J), where they count; `spread` is that of the first."""

    axis: str
    grid: FloatArray
    first: tuple[FloatArray, FloatArray]
    updated: tuple[FloatArray, FloatArray]
    spread: FloatArray

    def check(self, reserve: float, unit: str) -> None:
        """Raise SignatureError if a limit is lost, or further than `reserve` spreads from the first one."""
        for old, new in zip(self.first, self.updated, strict=True):
            # At both ends of the stroke the number of runs changes from run to run.
            left = np.flatnonzero(~np.isnan(new).all(axis=1))
            within = np.arange(len(new)) > (left[0] if len(left) else 0)
            within &= np.arange(len(new)) < (left[-1] if len(left) else len(new))
            lost = np.isfinite(old) & np.isnan(new) & within[:, np.newaxis]
            if lost.any():
                raise SignatureError(
                    f"{self._place(lost, unit)} no limit would be left: too few runs are valid there",
                    "inspect the sensors there, then relearn",
                )
            known = np.isfinite(old) & np.isfinite(new)
            moved = np.where(known, np.abs(new - np.where(known, old, 0.0)) / self.spread, 0.0)
            if moved.max(initial=0.0) > reserve:
                place = self._place(moved == moved.max(), unit)
                raise SignatureError(
                    f"{place} the limit would be {moved.max():.1f} spreads from the one first learned; "
                    f"at most {reserve:g} allowed",
                    "inspect the machine there, then relearn",
                )

    def _place(self, mask: BoolArray, unit: str) -> str:
        at = float(self.grid[int(np.flatnonzero(mask.any(axis=1))[0])])
        return f"at {at:.2f} {unit}" if self.axis == "travel" else f"{at:.2f} s after the motion began"


def _parts(first: FittedSignature, updated: FittedSignature, at: Progress) -> list[_CurveLimits]:
    """Return the part that counts of each curve: of time until this run had accelerated, of travel from then."""
    running = np.flatnonzero(at.running)
    begun = int(running[0]) if len(running) else len(at.elapsed) - 1
    mixed = first.alignment == "time_then_position"
    parts = []
    if first.alignment != "position":
        until = float(at.elapsed[begun]) if mixed else np.inf
        parts.append(_part("time", first, updated, first.by_time, updated.by_time, (0.0, until)))
    if first.alignment != "time":
        since = float(at.travel[begun]) if mixed else 0.0
        parts.append(_part("travel", first, updated, first.by_travel, updated.by_travel, (since, np.inf)))
    return parts


def _part(
    axis: str, first: FittedSignature, updated: FittedSignature, old: Curve, new: Curve, span: tuple[float, float]
) -> _CurveLimits:
    use = (old.grid >= span[0]) & (old.grid <= span[1])
    spread = old.band(first.pooled)[1]
    old_low, old_high = (limit[use] for limit in first.limits(old))
    new_low, new_high = (limit[use] for limit in updated.limits(new))
    return _CurveLimits(axis, old.grid[use], (old_low, old_high), (new_low, new_high), spread[use])
