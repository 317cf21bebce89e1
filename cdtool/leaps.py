"""What comes behind a step that no sensor makes: until the value is back, or moves on from a new zero."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cdtool.recording import BoolArray, FloatArray

# Within so many samples from its begin a log may begin with what is wrong.
_EDGE = 3
# From a new zero a position moves on once it has kept within so many reaches of the usual ones for so long [s], and has
# moved by this share of the reach.
_AMONG, _SETTLED, _MOVED = 1.5, 0.1, 0.02


@dataclass(frozen=True)
class Leap:
    """A step from `before` to `after` at `time` [s]; from `new_zero` [s] on values count as they are, NaN if never."""

    time: float
    before: float
    after: float
    new_zero: float = math.nan


def behind_leaps(
    time: FloatArray, values: FloatArray, is_leap: BoolArray, near: float, usual: tuple[float, float] | None
) -> tuple[BoolArray, list[Leap]]:
    """Return True (n,) for the values behind a leap, and the leaps; `is_leap` (n - 1,): the steps that are one.

    A value is back where it is within `near` of the one before the leap. With `usual` (centre and reach) a position may
    have been set to a new zero too: one that is reset stands among the usual positions and moves on there,
    which one that reads nothing does not. Causal, but for a log that begins with what is wrong.
    """
    wrong = np.zeros(len(values), dtype=bool)
    leaps = []
    end, places = 0, np.flatnonzero(is_leap).tolist()
    for number, at in enumerate(places):
        if at < end:
            continue
        leap = Leap(float(time[at + 1]), float(values[at]), float(values[at + 1]))
        if at < _EDGE and end == 0 and len(values) > 2 * _EDGE:
            wrong[: at + 1] = True
            leaps.append(leap)
            end = at + 2
            continue
        end, moves_on = _end(time, values, [*places[number:], len(values) - 1], near, usual)
        wrong[at + 1 : end] = True
        new_zero = float(time[end]) if moves_on else math.nan
        leaps.append(Leap(leap.time, leap.before, leap.after, new_zero))
    return wrong, leaps


def _end(
    time: FloatArray, values: FloatArray, leaps: Sequence[int], near: float, usual: tuple[float, float] | None
) -> tuple[int, bool]:
    """The first value behind `leaps[0]` that counts again, and whether from a new zero; the last row ends `leaps`."""
    before = values[leaps[0]]
    for first, last in pairwise(leaps):
        part = slice(first + 1, last + 1)
        back = np.abs(values[part] - before) <= near
        on = _moves_on(time[part], values[part], *usual) if usual else np.zeros_like(back)
        if (back | on).any():
            found = int(np.argmax(back | on))
            return first + 1 + found, not back[found]
    return len(values), False


def _moves_on(time: FloatArray, values: FloatArray, centre: float, reach: float) -> BoolArray:
    """True (n,) where the values behind a leap have kept among the usual ones so far, and have moved."""
    among = np.logical_and.accumulate(np.abs(values - centre) <= _AMONG * reach)
    moved = np.abs(values - values[0]) >= _MOVED * reach
    on: BoolArray = among & moved & (time - time[0] >= _SETTLED)
    return on
