"""Evidence from values: derivatives that match, and streams that move like a drive. Offline: for drafts only.

Increments over some hundred windows are compared, so that neither noise nor the encoder's resolution matters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid

from cdtool.base.arrays import FloatArray
from cdtool.commands.init.stream import Stream

_WINDOWS = 400
_SURE = 0.9
# A delay is clear if the derivative leaves less than this share of the difference.
_CLEAR = 0.67
# No controller follows its set value so late [s].
_LONGEST_LEAD = 0.5
# Inertia and friction of opposite signs, each above this share of the effort's spread, are not those of a drive.
_CONTRADICTS = 0.2
# Inertia and friction explain at least this share of what weight and springs leave of an effort; of the coordinates of
# a tool less than 0.35, by chance.
_OF_MOTION = 0.4
# A speed varies by more than this share of its largest value: it starts, ends or turns round.
_VARIES = 0.5
# Share of the windows that may contain impacts.
_IMPACTS = 0.25


@dataclass(frozen=True)
class Fit:
    """How well one stream follows another: correlation and slope, each the median of the moving joints.

    The slope is that of joints with a clear correlation; NaN without one.
    """

    correlation: float
    slope: float


_NONE = Fit(0.0, float("nan"))


def integral_fit(position: Stream, speed: Stream) -> Fit:
    """Compare increments of the position with those of the integrated speed."""
    if position.width != speed.width or len(speed.time) < 3:
        return _NONE
    return _fit(_at(speed.time, integrated(speed), position.time), position.values)


def derivative_fit(acceleration: Stream, speed: Stream) -> Fit:
    """Compare the integrated acceleration with increments of the speed; negative correlation: opposite sign.

    A constant offset of the acceleration, as from the weight, does not matter.
    """
    if speed.width != acceleration.width or len(acceleration.time) < 3:
        return _NONE
    ways = _at(acceleration.time, integrated(acceleration), speed.time)
    return _fit(ways, speed.values, centred=True)


def likeness(one: Stream, other: Stream) -> float:
    """Return the correlation of two streams, as median of the moving joints: a set value and what follows it."""
    if one.width != other.width:
        return 0.0
    first, second = np.nan_to_num(_at(one.time, one.values, other.time)), np.nan_to_num(other.values)
    known = [j for j in range(one.width) if np.ptp(first[:, j]) and np.ptp(second[:, j])]
    found = [float(np.corrcoef(first[:, j], second[:, j])[0, 1]) for j in known]
    return float(np.median(found)) if found else 0.0


def lead(one: Stream, other: Stream) -> float:
    """Return by how much the other stream is ahead of the first, in sample periods of the first; 0 if not clear.

    With x the first and y the other, y = a + b x + c dx/dt: the lead is c / b. It is clear if dx/dt explains at least
    a third of what a + b x leaves of y, in most of the joints that move.
    """
    if one.width != other.width or len(one.time) < 20:
        return 0.0
    y, x = np.nan_to_num(_at(other.time, other.values, one.time)), np.nan_to_num(one.values)
    half = max(1, len(x) // (2 * _WINDOWS))
    rate = (x[2 * half :] - x[: -2 * half]) / (2.0 * half)
    x, y = x[half:-half], y[half:-half]
    period = float(np.median(np.diff(one.time)))
    leads = []
    for j in range(one.width):
        if not np.ptp(x[:, j]) or not np.ptp(y[:, j]):
            continue
        plain, full = (
            np.column_stack(columns) for columns in ((np.ones(len(x)), x[:, j]), (np.ones(len(x)), x[:, j], rate[:, j]))
        )
        without = y[:, j] - plain @ np.linalg.lstsq(plain, y[:, j], rcond=None)[0]
        values = np.linalg.lstsq(full, y[:, j], rcond=None)[0]
        rest = y[:, j] - full @ values
        clear = float(np.var(rest)) < _CLEAR * float(np.var(without)) and values[1]
        ahead = float(values[2] / values[1]) if clear else 0.0
        leads.append(ahead if abs(ahead) * period < _LONGEST_LEAD else 0.0)
    return float(np.median(leads)) if leads else 0.0


def integral_lead(position: Stream, speed: Stream) -> float:
    """Return by how much a speed is ahead of the derivative of a position, in sample periods; 0 if not clear."""
    if position.width != speed.width or len(speed.time) < 20:
        return 0.0
    return lead(position, Stream(speed.name, speed.columns, None, speed.time, integrated(speed)))


def integrated(speed: Stream) -> FloatArray:
    """Return the integral of a speed over its times, by the trapezoidal rule, from 0."""
    path: FloatArray = cumulative_trapezoid(np.nan_to_num(speed.values), speed.time, axis=0, initial=0)
    return path


def derived(position: Stream) -> Stream:
    """Return the derivative of a position, not filtered."""
    rate = np.gradient(np.nan_to_num(position.values), position.time, axis=0)
    return Stream(position.name, position.columns, None, position.time, rate)


def drive_fit(drive: Stream, speed: Stream, position: Stream | None = None) -> float:
    """Return the share of a stream's variance explained by inertia and friction: R2 of [dv/dt, v, sign v, 1], median.

    High for a drive's torque or current. With a position, its first three powers represent weight and springs. 0 for a
    joint where inertia and friction have opposite signs: no drive accelerates against its own friction.
    """
    if drive.width != speed.width:
        return 0.0
    window = max(1, len(speed.time) // _WINDOWS)
    time, velocity = speed.time[::window], _averaged(np.nan_to_num(speed.values), window)
    effort = _averaged(np.nan_to_num(_at(drive.time, drive.values, speed.time)), window)
    place = None
    if position is not None and position.width == speed.width:
        place = _averaged(np.nan_to_num(_at(position.time, position.values, speed.time)), window)
    if len(time) < 12:
        return 0.0
    shares = []
    for j in range(drive.width):
        v, tau = velocity[:, j], effort[:, j]
        if not np.ptp(v) or not np.ptp(tau):
            continue
        acceleration = np.gradient(v, time)
        share = _explained(tau, v, acceleration, None)
        if place is not None and _depends_on_motion(tau, v, acceleration, place[:, j]):
            share = max(share, _explained(tau, v, acceleration, place[:, j]))
        shares.append(share)
    return float(np.median(shares)) if shares else 0.0


def _explained(tau: FloatArray, v: FloatArray, acceleration: FloatArray, place: FloatArray | None) -> float:
    moving = np.sign(np.where(np.abs(v) > 0.02 * np.max(np.abs(v)), v, 0.0))
    columns = [acceleration, moving, v, np.ones_like(v)]
    if place is not None and np.ptp(place):
        middle = (place - np.mean(place)) / np.ptp(place)
        columns += [middle, middle**2, middle**3]
    known = np.column_stack(columns)
    kept = np.ones(len(tau), dtype=bool)
    for _ in range(3):  # impacts obey another law: the windows that fit worst are left out
        values = np.linalg.lstsq(known[kept], tau[kept], rcond=None)[0]
        rest = np.abs(tau - known @ values)
        kept = rest <= np.quantile(rest, 1.0 - _IMPACTS)
    spread = np.std(known[kept], axis=0)
    inertia, friction = values[0] * spread[0], values[1] * spread[1] + values[2] * spread[2]
    whole = float(np.var(tau[kept]))
    contradict = inertia * friction < 0.0 and min(abs(inertia), abs(friction)) > _CONTRADICTS * whole**0.5
    if not whole or contradict:
        return 0.0
    return 1.0 - float(np.var((tau - known @ values)[kept])) / whole


def _depends_on_motion(tau: FloatArray, v: FloatArray, acceleration: FloatArray, place: FloatArray) -> bool:
    """Whether speed and acceleration explain a part of what the place leaves: a tool's pose depends on places alone."""
    middle = (place - np.mean(place)) / (np.ptp(place) or 1.0)
    weight = np.column_stack([middle, middle**2, middle**3, np.ones_like(v)])
    moving = np.sign(np.where(np.abs(v) > 0.02 * np.max(np.abs(v)), v, 0.0))
    rest = [
        float(np.var(tau - known @ np.linalg.lstsq(known, tau, rcond=None)[0]))
        for known in (weight, np.column_stack([weight, acceleration, moving, v]))
    ]
    return rest[1] < (1.0 - _OF_MOTION) * rest[0]


def roughness(stream: Stream) -> float:
    """Return how much a stream varies from sample to sample, relative to its range: a set value is the smoothest."""
    values = np.nan_to_num(stream.values)
    span = float(np.max(np.ptp(values, axis=0)))
    return float(np.sqrt(np.mean(np.diff(values, n=2, axis=0) ** 2))) / span if span and len(values) > 2 else np.inf


def is_regular(stream: Stream) -> bool:
    """Whether a stream only rises by equal steps, as a clock or a counter does."""
    steps = np.diff(stream.values[np.isfinite(stream.values)])
    return len(steps) > 2 and float(np.min(steps)) > 0.0 and float(np.ptp(steps)) < 0.5 * float(np.median(steps))


def is_flag(stream: Stream) -> bool:
    """Whether a stream has only the values 0 and 1, as a state has."""
    return bool(np.isin(stream.values[np.isfinite(stream.values)], (0.0, 1.0)).all())


def rests_and_peaks(stream: Stream) -> bool:
    """Whether a stream looks like a load cell: constant for most of the time, short high peaks, no integers."""
    values = stream.values[np.isfinite(stream.values)]
    if len(values) < 20 or not np.ptp(values) or np.array_equal(values, np.rint(values)):
        return False
    away = np.abs(values - np.median(values))
    return float(np.mean(away < 0.03 * np.max(away))) > 0.8 and float(np.max(away)) > 20.0 * float(np.median(away))


def stirs(position: Stream, speed: Stream) -> bool:
    """Whether a joint moves and its speed varies; values of a joint at rest are noise, and all constants fit."""
    way, rate = (np.nan_to_num(stream.values) for stream in (position, speed))
    return bool(np.ptp(way) > 0.01 and np.ptp(rate) > _VARIES * np.max(np.abs(rate)))


def _fit(ways: FloatArray, places: FloatArray, *, centred: bool = False) -> Fit:
    window = max(1, len(places) // _WINDOWS)
    there, here = np.diff(ways[::window], axis=0), np.diff(places[::window], axis=0)
    correlations, slopes = [], []
    for j in range(places.shape[1]):
        known = np.isfinite(there[:, j]) & np.isfinite(here[:, j])
        x, y = there[known, j], here[known, j]
        if centred and len(x):
            x, y = x - np.mean(x), y - np.mean(y)
        power = float(x @ x), float(y @ y)
        if min(power) <= 0.0 or len(x) < 3:
            continue
        correlations.append(float(x @ y) / np.sqrt(power[0] * power[1]))
        if abs(correlations[-1]) > _SURE:
            slopes.append(float(x @ y) / power[0])
    slope = float(np.median(slopes)) if slopes else float("nan")
    return Fit(float(np.median(correlations)) if correlations else 0.0, slope)


def _at(time: FloatArray, values: FloatArray, clock: FloatArray) -> FloatArray:
    if len(time) == len(clock) and np.array_equal(time, clock):
        return values
    return np.column_stack([np.interp(clock, time, column) for column in values.T])


def _averaged(values: FloatArray, window: int) -> FloatArray:
    starts = np.arange(0, len(values), window)
    counts = np.diff(np.append(starts, len(values)))[:, np.newaxis]
    mean: FloatArray = np.add.reduceat(values, starts, axis=0) / counts
    return mean
