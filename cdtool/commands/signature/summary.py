"""A stored signature in a few numbers: stroke, spread, and how far its limits have moved since first learned."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.recordings.motion import MotionClass
from cdtool.thresholds.fitted_signature import FittedSignature
from cdtool.thresholds.signature_curve import Curve


@dataclass(frozen=True)
class JointSummary:
    """One joint of a signature: its typical spread [signal's unit], and the largest move of a limit [spreads].

    `moved` is 0 if no run was added; `moved_at` is its location on `moved_along` (travel or time), NaN without one.
    """

    joint: str
    spread: float
    moved: float
    moved_at: float
    moved_along: str


@dataclass(frozen=True)
class SignatureSummary:
    """One class of a signature: `runs` now and when first learned, and the stroke on which it has limits."""

    motion: MotionClass
    runs: int
    first_runs: int
    safety_factor: float
    sides: str
    travel: tuple[float, float]
    joints: tuple[JointSummary, ...]


def summarise_signature(current: FittedSignature, first: FittedSignature) -> SignatureSummary:
    """Summarise a stored signature.

    Parameters
    ----------
    current : FittedSignature
        The signature.
    first : FittedSignature
        The signature as first learned, on the same grid.

    Returns
    -------
    SignatureSummary
        Runs, stroke, spread, and the largest move of a limit per joint.

    Examples
    --------
    `cdtool.learn_signature` learns one; `cdtool signature show` shows the summary.
    """
    along = [("travel", current.by_travel, first.by_travel), ("time", current.by_time, first.by_time)]
    parts = [
        part for part in along if current.alignment in (part[0].replace("travel", "position"), "time_then_position")
    ]
    limited = np.isfinite(current.by_travel.band(current.pooled)[0]).any(axis=1)
    grid = current.by_travel.grid[limited]
    return SignatureSummary(
        motion=current.motion.without_course,
        runs=current.runs,
        first_runs=first.runs,
        safety_factor=current.safety_factor,
        sides=current.sides,
        travel=(float(grid[0]), float(grid[-1])) if len(grid) else (np.nan, np.nan),
        joints=tuple(_joint(j, current, first, parts) for j in range(len(current.joints))),
    )


def _joint(
    j: int, current: FittedSignature, first: FittedSignature, parts: list[tuple[str, Curve, Curve]]
) -> JointSummary:
    spreads = np.concatenate([curve.band(current.pooled)[1][:, j] for _, curve, _ in parts])
    moves = []
    for along, curve, old in parts:
        change = _moved(current, first, curve, old)[:, j]
        at = int(np.argmax(change))
        moves.append((float(change[at]), float(curve.grid[at]) if change[at] > 0.0 else float("nan"), along))
    moved, place, along = max(moves, key=lambda item: item[0])
    known = spreads[np.isfinite(spreads)]
    return JointSummary(current.joints[j], float(np.median(known)) if len(known) else float("nan"), moved, place, along)


def _moved(current: FittedSignature, first: FittedSignature, curve: Curve, old: Curve) -> FloatArray:
    """Return the larger movement of the two limits (g, J), in spreads of the first signature; 0 without a limit."""
    spread = old.band(first.pooled)[1]
    moved = np.zeros(spread.shape)
    for new_limit, old_limit in zip(current.limits(curve), first.limits(old), strict=True):
        known = np.isfinite(new_limit) & np.isfinite(old_limit)
        change = np.abs(np.where(known, new_limit, 0.0) - np.where(known, old_limit, 0.0))
        moved = np.maximum(moved, np.divide(change, spread, out=np.zeros(spread.shape), where=known & (spread > 0.0)))
    return moved
