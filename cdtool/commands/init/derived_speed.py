"""Propose the low-pass for a speed that cdtool derives from a coarse or jittered position."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.commands.init.stream import Stream
from cdtool.commands.init.streams import Channels

# The default of the machine file [Hz], and the lowest corner that is proposed.
_DEFAULT, _LOWEST = 50.0, 1.0
# Noise of the derived speed that is accepted, as a share of its largest value.
_NOISE = 0.01
# The corner is at most this share of the sampling rate.
_OF_RATE = 0.4


@dataclass(frozen=True)
class LowPassGuess:
    """A corner frequency [Hz] for `speed_low_pass_hz`, and the reason."""

    corner: float
    why: str


def propose_low_pass(channels: Channels, in_seconds: float) -> LowPassGuess | None:
    """Return a low-pass for the derived speed; None if a speed is logged or the default suffices.

    White noise of the position with deviation s, sampled with period T, has after differentiation and an ideal low-pass
    at f the deviation s sqrt(8 pi^2 T f^3 / 3): f is where this is 1 % of the largest speed.

    Parameters
    ----------
    channels : Channels
        The channels found.
    in_seconds : float
        Unit of the streams' times [s]; 0 without a clock.
    """
    if "speed" in channels.found or "position" not in channels.found or in_seconds <= 0.0:
        return None
    stream = channels.found["position"].stream
    time = stream.time * in_seconds
    steps = np.diff(time)
    period = float(np.median(steps)) if len(steps) > 10 else 0.0
    if period <= 0.0:
        return None
    corners = [
        corner for column in stream.values.T if (corner := _corner(time, column, _jitter(steps, period), period))
    ]
    if not corners:
        return None
    lowest = min(min(corners), _OF_RATE / period)
    if lowest >= _DEFAULT:
        return None
    rounded = max(_LOWEST, float(f"{lowest:.2g}"))
    resolution = _resolution(stream)
    text = f"the speed is derived from positions in steps of {resolution:.3g}, every {1e3 * period:.3g} ms"
    jitter = _jitter(steps, period)
    if jitter > 0.02 * period:
        text += f" with a jitter of {1e3 * jitter:.2g} ms"
    return LowPassGuess(
        rounded, f"{text}: up to this frequency its noise is below {100 * _NOISE:g} % of its largest value"
    )


def _jitter(steps: FloatArray, period: float) -> float:
    """Return the deviation of a stamp [s], without gaps."""
    usual = steps[np.abs(steps - period) < period]
    return float(np.std(usual)) / math.sqrt(2.0) if len(usual) > 2 else 0.0


def _corner(time: FloatArray, position: FloatArray, jitter: float, period: float) -> float:
    known = np.isfinite(position)
    if np.count_nonzero(known) < 20:
        return 0.0
    x, t = position[known], time[known]
    span = max(1, len(x) // 200)
    rates = (x[span:] - x[:-span]) / (t[span:] - t[:-span])
    top, usual = float(np.max(np.abs(rates))), float(np.sqrt(np.mean(rates**2)))
    if not top > 0.0:
        return 0.0
    noise = math.hypot(_step(x) / math.sqrt(12.0), usual * jitter)
    if noise == 0.0:
        return 0.0
    return float((3.0 * (_NOISE * top) ** 2 / (8.0 * math.pi**2 * period * noise**2)) ** (1.0 / 3.0))


def _step(values: FloatArray) -> float:
    """Return the resolution of values: the smallest step between them, above rounding errors."""
    steps = np.abs(np.diff(values))
    steps = steps[steps > 1e-9 * float(np.max(np.abs(values)))]
    return float(np.min(steps)) if len(steps) else 0.0


def _resolution(stream: Stream) -> float:
    return max(_step(column[np.isfinite(column)]) for column in stream.values.T if np.isfinite(column).any())
