"""Whether two recordings hold the same measurement: exported again, with other numbers, samples or sample rate.

Conventions: two force-time curves are shifted in time until they agree best. A sample agrees if the forces differ by at
most half of the coarser resolution, or by half of the noise of the quieter curve, whichever is more: rounding and
resampling change no more. In a new measurement the noise is new as well. With a standard deviation s in both, their
difference has 1.4 s, and 72 % of its samples are beyond 0.5 s. A cell that is coarser than its noise repeats its
readings; there the samples count at which a reading changes, and in a new measurement these are others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.statistics.spread import MAD_TO_STD
from cdtool.truth.force.curve import ForceTimeCurve
from cdtool.truth.load_cell import ROUNDING
from cdtool.truth.missing_samples import CellClock

# The shift is first sought in steps of this length [s], within the rise of a contact.
_COARSE = 2e-3
# Resolutions, and sample rates, are the same within this share.
_SAME = 0.02
# Fewer samples at which a reading changes show nothing.
_ENOUGH = 20
# The onset of one measurement is found this much earlier or later after it was exported again [s].
_SHIFT = 0.05
# The shift is found in the first part of the contact: this time [s], at most so many samples.
_FIRST, _MOST = 1.0, 1500


class _Curve(NamedTuple):
    """A curve with its sample period [s], resolution [N] and noise [N, standard deviation]."""

    time: FloatArray
    force: FloatArray
    period: float
    resolution: float
    noise: float


def hold_same_measurement(one: ForceTimeCurve, other: ForceTimeCurve) -> bool:
    """Return whether two force-time curves are one measurement that was exported twice.

    Parameters
    ----------
    one, other : ForceTimeCurve
        Force (n,) [N] over the time after the onset (n,) [s] of two recordings.

    Returns
    -------
    bool
        True if 90 % of the samples agree up to rounding, also after samples were cut, left out, interpolated or
        averaged. False for fewer than 20 samples at which a reading changes.

    Notes
    -----
    Fails: a curve that was filtered or scaled is another one; so is one that was resampled from finer readings than
    either recording has, if the noise is below the resolution. Two simulations without noise are one measurement.

    Examples
    --------
    The same readings with one decimal are the same measurement; with other noise they are not.

    >>> random = np.random.default_rng(1)
    >>> time = np.arange(1000) * 1e-3
    >>> push = 300.0 * np.sin(np.pi * time)
    >>> first, second = (push + random.normal(0.0, 0.3, 1000) for _ in range(2))
    >>> curves = [
    ...     ForceTimeCurve(time, force, np.zeros(1000, dtype=bool), end=1.0)
    ...     for force in (first, first.round(1), second)
    ... ]
    >>> hold_same_measurement(curves[0], curves[1]), hold_same_measurement(curves[0], curves[2])
    (True, False)
    """
    finer, coarser = sorted((_prepared(one), _prepared(other)), key=lambda curve: curve.period)
    highest = [float(curve.force.max()) for curve in (finer, coarser)]
    cell, noise = max(finer.resolution, coarser.resolution), max(finer.noise, coarser.noise)
    if min(len(finer.time), len(coarser.time)) < _ENOUGH or finer.period <= 0.0:
        return False
    # An average over a longer period lowers a peak by less than 5 %.
    if abs(highest[0] - highest[1]) > 0.05 * max(highest) + cell + 4.0 * noise:
        return False
    least = 0.5 * min(finer.noise, coarser.noise)  # two measurements differ by the noise of both
    # Readings of one resolution, sample by sample, are equal; in every other comparison they are rounded.
    is_same = abs(finer.resolution - coarser.resolution) <= _SAME * cell
    by_number = _by_number(finer, coarser)
    if by_number and _agree(*by_number, max(least, (0.25 if is_same else 0.5) * cell)):
        return True
    # Of one quiet cell at one rate, all rounded readings of one force agree after interpolation: it shows nothing.
    # With less noise than the standard deviation of rounding most readings are repeated.
    if by_number and is_same and min(finer.noise, coarser.noise) < ROUNDING * cell:
        return False
    return any(_agree(*pair, max(least, 0.51 * cell)) for pair in _resampled(finer, coarser))


def _prepared(curve: ForceTimeCurve) -> _Curve:
    bent = np.diff(curve.force, 2)
    # Six times the variance of white noise is that of its second differences, which a smooth force has not.
    noise = MAD_TO_STD * float(np.median(np.abs(bent))) / np.sqrt(6.0) if len(bent) else 0.0
    return _Curve(curve.time, curve.force, CellClock(curve.time).period, curve.resolution, noise)


def _by_number(finer: _Curve, coarser: _Curve) -> tuple[FloatArray, FloatArray] | None:
    """Return both forces sample by sample, whatever their times, if they have one sample rate."""
    if coarser.period > (1.0 + _SAME) * finer.period:
        return None
    most = max(10, round(_SHIFT / finer.period))
    first = min(len(finer.force), len(coarser.force), max(_ENOUGH, round(_FIRST / finer.period)), _MOST)

    def shifted(shift: int) -> tuple[FloatArray, FloatArray]:
        one, other = finer.force[max(shift, 0) :], coarser.force[max(-shift, 0) :]
        count = min(len(one), len(other))
        return one[:count], other[:count]

    def distance(shift: int) -> float:
        one, other = shifted(shift)
        return float(np.var(one[:first] - other[:first])) if len(one) >= _ENOUGH else np.inf

    coarse = max(1, round(_COARSE / finer.period))
    best = min(range(-most, most + 1, coarse), key=distance)
    return shifted(min(range(best - coarse, best + coarse + 1), key=distance))


def _resampled(finer: _Curve, coarser: _Curve) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield both forces at the times of one of them: the other one interpolated, or averaged over its period."""
    yield _at_times(finer, coarser.time, coarser.force, finer.period)
    if coarser.period > (1.0 + _SAME) * finer.period:
        yield _at_times(coarser, finer.time, finer.force, finer.period)
        # The mean from one time to another is the difference of the sums up to them.
        edges = np.concatenate((finer.time, [finer.time[-1] + finer.period])) - 0.5 * finer.period
        sums = np.concatenate(([0.0], np.cumsum(finer.force * np.diff(edges))))
        inside = (coarser.time >= edges[0] + _SHIFT + coarser.period) & (
            coarser.time <= edges[-1] - _SHIFT - coarser.period
        )
        begins = coarser.time[inside] - 0.5 * coarser.period

        def averaged(shift: float) -> FloatArray:
            until, since = (np.interp(begins + more + shift, edges, sums) for more in (coarser.period, 0.0))
            mean: FloatArray = (until - since) / coarser.period
            return mean

        if np.count_nonzero(inside) >= _ENOUGH:
            force = coarser.force[inside]
            first = min(len(force), max(_ENOUGH, round(_FIRST / coarser.period)), _MOST)
            shift = _best_shift(lambda shift: float(np.var((averaged(shift) - force)[:first])), finer.period)
            yield averaged(shift), force


def _at_times(curve: _Curve, time: FloatArray, force: FloatArray, step: float) -> tuple[FloatArray, FloatArray]:
    """Return a curve, interpolated at other times and shifted to agree best, and the force at these."""
    inside = (time >= curve.time[0] + _SHIFT) & (time <= curve.time[-1] - _SHIFT)
    time, force = time[inside], force[inside]
    if len(time) < _ENOUGH:
        return time, force[:0]
    first = min(len(time), max(_ENOUGH, int(np.searchsorted(time, time[0] + _FIRST))), _MOST)

    def distance(shift: float) -> float:
        return float(np.var(np.interp(time[:first] + shift, curve.time, curve.force) - force[:first]))

    return np.interp(time + _best_shift(distance, step), curve.time, curve.force), force


def _best_shift(distance: Callable[[float], float], step: float) -> float:
    """Return the shift of the least distance [s]: the best of a grid, then of finer ones about it."""
    best, reach = 0.0, _SHIFT
    for grid in (max(step, _COARSE), step, step / 8.0, step / 64.0, step / 512.0):
        count = round(reach / grid)
        best = min((best + grid * number for number in range(-count, count + 1)), key=distance)
        reach = grid
    return best


def _agree(one: FloatArray, other: FloatArray, tolerance: float) -> bool:
    """Return whether the samples agree within a tolerance [N], apart from an offset: the level at rest may differ."""
    if len(one) != len(other) or len(one) < _ENOUGH:
        return False
    changes = (np.diff(one) != 0.0) | (np.diff(other) != 0.0)
    apart = np.sort((one - other)[1:][changes])
    if len(apart) < _ENOUGH:
        return False
    within = np.searchsorted(apart, apart + 2.0 * tolerance, side="right") - np.arange(len(apart))
    # One measurement agrees in 90 % of its samples, apart from those at which exports round the time.
    return bool(within.max() >= 0.9 * len(apart))
