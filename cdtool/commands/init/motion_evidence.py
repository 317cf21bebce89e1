"""Evidence from values: derivatives that match, and streams that move like a drive. Offline: for drafts only.

Increments over some hundred windows are compared, so that neither noise nor the encoder's resolution matters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid

from cdtool.base.arrays import FloatArray
from cdtool.commands.init.stream import Stream
from cdtool.machines.plausibility.drive import explained

# Windows in which a log is compared: noise averages out in them, strokes do not.
_WINDOWS = 400
# Above this correlation one column is treated as another's derivative.
FITS = 0.9
# A single pair, or one without names, must fit better: of a tool on a circle one coordinate is nearly the derivative of
# the other.
FITS_ALONE = 0.98
# Share of the variance of an effort without a name that inertia and friction must explain.
DRIVES = 0.6
# A set value is ahead of its measured value by at least this share of a sample.
AHEAD = 0.2
# Above this correlation streams have a like course; a position is at most this share of its travel from its set value.
ALIKE, _APART = 0.97, 0.1


@dataclass(frozen=True)
class Fit:
    """How well one stream follows another: correlation and slope, each the median of the moving joints.

    The slope is that of joints with a clear correlation; NaN without one.
    """

    correlation: float
    slope: float


def integral_fit(whole: Stream, rate: Stream, *, centred: bool = False) -> Fit:
    """Compare increments of a position with those of the integrated speed, or of a speed with those of an acceleration.

    `centred`: a constant offset of the rate does not matter, as of an acceleration by the weight.
    """
    correlations, slopes = [], []
    if whole.width == rate.width and len(rate.time) > 2:
        window = max(1, len(whole.values) // _WINDOWS)
        ways = np.diff(integrated(rate).at(whole.time)[::window], axis=0)
        for x, y in zip(ways.T, np.diff(whole.values[::window], axis=0).T, strict=True):
            known = np.isfinite(x) & np.isfinite(y)
            x, y = (part[known] - (np.mean(part[known]) if centred and known.any() else 0.0) for part in (x, y))
            power = float(x @ x), float(y @ y)
            if min(power) > 0.0 and len(x) > 2:
                correlations.append(float(x @ y) / np.sqrt(power[0] * power[1]))
                slopes += [float(x @ y) / power[0]] * bool(abs(correlations[-1]) > FITS)
    return Fit(_median(correlations, 0.0), _median(slopes, float("nan")))


def likeness(one: Stream, other: Stream) -> float:
    """Return the correlation of two streams, as median of the moving joints: a set value and what follows it."""
    if one.width != other.width:
        return 0.0
    pairs = zip(np.nan_to_num(one.at(other.time)).T, np.nan_to_num(other.values).T, strict=True)
    return _median([float(np.corrcoef(x, y)[0, 1]) for x, y in pairs if np.ptp(x) and np.ptp(y)], 0.0)


def lead(one: Stream, other: Stream) -> float:
    """Return by how much the other stream is ahead of the first, in sample periods of the first; 0 if not clear.

    With x the first and y the other, y = a + b x + c dx/dt: the lead is c / b. It is clear if dx/dt explains at least
    a third of what a + b x leaves of y, in most of the joints that move.
    """
    if one.width != other.width or len(one.time) < 20:
        return 0.0
    whole = np.nan_to_num(one.values)
    half = max(1, len(whole) // (2 * _WINDOWS))
    rates = (whole[2 * half :] - whole[: -2 * half]) / (2.0 * half)
    longest = 0.5 / float(np.median(np.diff(one.time)))  # no controller follows its set value so late [s]
    leads = []
    for x, rate, y in zip(whole[half:-half].T, rates.T, np.nan_to_num(other.at(one.time))[half:-half].T, strict=True):
        if np.ptp(x) and np.ptp(y):
            known = np.column_stack([x, np.ones_like(x), rate])
            values, rest = _solved(known, y)
            # A delay is clear if the derivative leaves less than two thirds of the difference.
            clear = float(np.var(rest)) < 0.67 * float(np.var(_solved(known[:, :2], y)[1])) and values[0]
            ahead = float(values[2] / values[0]) if clear else 0.0
            leads.append(ahead if abs(ahead) < longest else 0.0)
    return _median(leads, 0.0)


def integral_lead(position: Stream, speed: Stream) -> float:
    """Return by how much a speed is ahead of the derivative of a position, in sample periods; 0 if not clear."""
    return lead(position, integrated(speed)) if position.width == speed.width else 0.0


def integrated(rate: Stream) -> Stream:
    """Return the integral of a stream over its times, by the trapezoidal rule, from 0."""
    return rate.with_values(cumulative_trapezoid(np.nan_to_num(rate.values), rate.time, axis=0, initial=0))


def derived(position: Stream) -> Stream:
    """Return the derivative of a position, not filtered."""
    return position.with_values(np.gradient(np.nan_to_num(position.values), position.time, axis=0))


def drive_fit(drive: Stream, speed: Stream, position: Stream | None = None) -> float:
    """Return the share of a stream's variance explained by inertia and friction: R2 of [dv/dt, v, sign v, 1], median.

    High for a drive's torque or current. With a position, its first three powers represent weight and springs. 0 for a
    joint where inertia and friction have opposite signs: no drive accelerates against its own friction.
    """
    window = max(1, len(speed.time) // _WINDOWS)
    time = speed.time[::window]
    if drive.width != speed.width or len(time) < 12:
        return 0.0
    place = position if position is not None and position.width == speed.width else None
    means = [
        _averaged(np.nan_to_num(stream.at(speed.time)), window).T
        for stream in (drive, speed, *([place] if place is not None else []))
    ]
    shares = []
    for tau, v, *places in zip(*means, strict=True):
        if not np.ptp(v) or not np.ptp(tau):
            continue
        moving = np.sign(np.where(np.abs(v) > 0.02 * np.max(np.abs(v)), v, 0.0))
        motion = np.column_stack([np.gradient(v, time), moving, v])
        share = _explained(tau, motion)
        for x in places:
            middle = (x - np.mean(x)) / (np.ptp(x) or 1.0)
            weight = np.column_stack([middle, middle**2, middle**3])
            both = np.column_stack([motion, weight])
            # A tool's pose depends on places alone.
            # Inertia and friction explain at least 0.4 of what weight and springs leave of an effort; of the
            # coordinates of a tool less than 0.35, by chance.
            if 1.0 - explained(both, tau) < 0.6 * (1.0 - explained(weight, tau)):
                share = max(share, _explained(tau, both))
        shares.append(share)
    return _median(shares, 0.0)


def same_values(one: Stream, other: Stream) -> bool:
    """Whether one stream may be the set values of the other: like courses, with equal values.

    The joints of a robot often move in proportion, so that like courses alone say nothing.
    """
    if likeness(one, other) <= ALIKE:
        return False
    apart = np.nanmedian(np.abs(one.at(other.time) - other.values), axis=0)
    travel = np.nanmax(one.values, axis=0) - np.nanmin(one.values, axis=0)
    return bool(np.all(apart <= _APART * np.maximum(travel, np.nanmax(travel) * _APART)))


def order(one: Stream, other: Stream) -> tuple[float, str]:
    """Return by how many samples the other of two like streams is ahead; without a lag 1 if it is smoother, else -1.

    A set value is ahead of what follows it, and smoother. The text says which.
    """
    ahead = lead(one, other)
    if abs(ahead) >= AHEAD:
        return ahead, f"ahead of it by {abs(ahead):.1f} samples"
    rough, its = roughness(one), roughness(other)
    return (0.0, "") if np.isclose(rough, its) else (1.0, "smoother") if its < rough else (-1.0, "rougher")


def roughness(stream: Stream) -> float:
    """Return how much a stream varies from sample to sample, relative to its range: a set value is the smoothest."""
    values = np.nan_to_num(stream.values)
    span = float(np.max(np.ptp(values, axis=0)))
    return float(np.sqrt(np.mean(np.diff(values, n=2, axis=0) ** 2))) / span if span and len(values) > 2 else np.inf


def stirs(position: Stream, speed: Stream) -> bool:
    """Whether a joint moves and its speed varies; values of a joint at rest are noise, and all constants fit."""
    # By more than 10 mm or 0.01 rad, and by more than half of its largest speed.
    return bool(np.ptp(position.known) > 0.01 and np.ptp(speed.known) > 0.5 * speed.reach)


def is_flag(stream: Stream) -> bool:
    """Whether a stream has only the values 0 and 1, as a state has."""
    return bool(np.isin(stream.known, (0.0, 1.0)).all())


def rests_and_peaks(stream: Stream) -> bool:
    """Whether a stream looks like a load cell: constant for most of the time, short high peaks, no integers."""
    values = stream.known
    if len(values) < 20 or not np.ptp(values) or np.array_equal(values, np.rint(values)):
        return False
    away = np.abs(values - np.median(values))
    return float(np.mean(away < 0.03 * np.max(away))) > 0.8 and float(np.max(away)) > 20.0 * float(np.median(away))


def _explained(tau: FloatArray, motion: FloatArray) -> float:
    """Return the share of an effort (w,) that [acceleration, sign of the speed, speed, ...] (w, k) explain."""
    known = np.column_stack([motion, np.ones_like(tau)])
    kept = np.ones(len(tau), dtype=bool)
    for _ in range(3):  # impacts obey another law: the windows that fit worst are left out
        values, _ = _solved(known[kept], tau[kept])
        rest = np.abs(tau - known @ values)
        kept = rest <= np.quantile(rest, 0.75)  # the others may contain impacts
    inertia, *friction = values[:3] * np.std(known[kept, :3], axis=0)
    whole = float(np.var(tau[kept]))
    weaker = min(abs(inertia), abs(sum(friction)))
    # Inertia and friction of opposite signs, each above a fifth of the effort's spread, are not those of a drive.
    if not whole or (inertia * sum(friction) < 0.0 and weaker > 0.2 * whole**0.5):
        return 0.0
    return 1.0 - float(np.var((tau - known @ values)[kept])) / whole


def _solved(known: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the coefficients by least squares, and what they leave."""
    solution = np.asarray(np.linalg.lstsq(known, values, rcond=None)[0], dtype=np.float64)
    return solution, values - known @ solution


def _median(values: list[float], default: float) -> float:
    return float(np.median(values)) if values else default


def _averaged(values: FloatArray, window: int) -> FloatArray:
    starts = np.arange(0, len(values), window)
    counts = np.diff(np.append(starts, len(values)))[:, np.newaxis]
    mean: FloatArray = np.add.reduceat(values, starts, axis=0) / counts
    return mean
