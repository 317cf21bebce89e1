"""Propose the low-pass for a speed that cdtool derives from a coarse or jittered position."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.commands.init.stream import Stream

# The default of the machine file [Hz].
_DEFAULT = 50.0
# Noise of the derived speed that is accepted, as a share of its largest value.
_NOISE = 0.01


@dataclass(frozen=True)
class LowPassGuess:
    """A corner frequency [Hz] for `speed_low_pass_hz`, and the reason."""

    corner: float
    why: str


def propose_low_pass(position: Stream, in_seconds: float) -> LowPassGuess | None:
    """Return a low-pass for the derived speed; None if the default suffices.

    White noise of the position with deviation s, sampled with period T, has after differentiation and an ideal low-pass
    at f the deviation s sqrt(8 pi^2 T f^3 / 3): f is where this is 1 % of the largest speed. The noise is that of the
    position's resolution, and of the stamps' jitter at the usual speed.

    Parameters
    ----------
    position : Stream
        The position.
    in_seconds : float
        Unit of its times [s].
    """
    time = position.time * in_seconds
    steps = np.diff(time)
    period = float(np.median(steps)) if len(steps) > 10 else 0.0
    if period <= 0.0:
        return None
    usual = steps[np.abs(steps - period) < period]  # without gaps
    jitter = float(np.std(usual)) / math.sqrt(2.0) if len(usual) > 2 else 0.0
    resolutions, lowest = [0.0], 0.4 / period  # below the Nyquist frequency
    for column in position.values.T:
        known = np.isfinite(column)
        x, t = column[known], time[known]
        span = max(1, len(x) // 200)
        rates = (x[span:] - x[:-span]) / (t[span:] - t[:-span]) if len(x) >= 20 else np.zeros(1)
        resolutions.append(_resolution(x))
        noise = math.hypot(resolutions[-1] / math.sqrt(12.0), float(np.sqrt(np.mean(rates**2))) * jitter)
        if noise and rates.any():
            top = float(np.max(np.abs(rates)))
            lowest = min(lowest, (3.0 * (_NOISE * top / noise) ** 2 / (8.0 * math.pi**2 * period)) ** (1.0 / 3.0))
    if lowest >= _DEFAULT:
        return None
    text = f"the speed is derived from positions in steps of {max(resolutions):.3g}, every {1e3 * period:.3g} ms"
    if jitter > 0.02 * period:
        text += f" with a jitter of {1e3 * jitter:.2g} ms"
    why = f"{text}: up to this frequency its noise is below {100 * _NOISE:g} % of its largest value"
    return LowPassGuess(max(1.0, float(f"{lowest:.2g}")), why)


def _resolution(values: FloatArray) -> float:
    """Return the smallest step between values, above rounding errors."""
    steps = np.abs(np.diff(values))
    steps = steps[steps > 1e-9 * np.max(np.abs(values), initial=0.0)]
    return float(np.min(steps)) if len(steps) else 0.0
