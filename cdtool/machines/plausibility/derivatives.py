"""Whether the speed is the derivative of the position, and the acceleration that of the speed: sign, size, course."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.findings import Finding
from cdtool.machines.plausibility.check import ChannelCheck
from cdtool.machines.plausibility.windows import windows_of
from cdtool.recordings.recording import Recording
from cdtool.recordings.units import STANDARD_GRAVITY

# Compared are changes of both channels above this share of the usual largest, and this multiple of their noise.
_LARGE, _ABOVE_NOISE = 0.2, 3.0
# At least so many changes. All but this share of them have the same sign if the channels are related; of unrelated ones
# more than the second share have either. The size is sure if half of them lie within this share of it.
_FEWEST, _ODD = 12, 0.1
# A size that is right: filters, jitter and an elastic drive change it by less; and the next unit is further away.
_LEAST, _MOST = 0.7, 1.4
_FACTORS = (
    (180.0 / np.pi, "deg and rad"),
    (1000.0, "mm and m, or ms and s"),
    (1e6, "um and m, or us and s"),
    (3600.0, "h and s"),
    (60.0, "min and s"),
    (2.0 * np.pi, "turns and rad"),
)
_OF_SPEED = ((60.0 / (2.0 * np.pi), "rpm and rad/s"), (6.0, "rpm and deg/s"))
_OF_ACCELERATION = ((STANDARD_GRAVITY, "g and m/s2"),)


def derivative_checks(recordings: Sequence[Recording], channel: str, other: str) -> Iterator[Finding]:
    """Yield for each joint whether `channel` is the derivative of `other`, by the ratios of changes over four windows.

    A minority of leaps, gaps and impacts does not change the median of the ratios.
    """
    windows = windows_of(recordings, (channel, other))
    if windows is None:
        return
    joints = recordings[0].joints
    path, of_path = windows.changes(channel, integrated=True)
    change, of_change = windows.changes(other)
    if channel == "acceleration":  # its offset, as from the weight
        known = np.isfinite(path).any(axis=0)
        path[:, known] -= np.nanmedian(path[:, known], axis=0)
    for j, joint in enumerate(joints):
        check = ChannelCheck(
            "derivative", "not checked", "rest", joint if len(joints) > 1 else "", channel, other=other
        )
        ratios = [_ratios(path[:, j], of_path[j], change[:, k], of_change[k]) for k in range(len(joints))]
        if len(ratios[j]) >= _FEWEST:
            fits = [_is_size(found) and _LEAST < float(np.median(found)) < _MOST for found in ratios]
            others = [joints[k] for k in np.flatnonzero(fits).tolist() if k != j]
            check = _checked(check, ratios[j], others)
            if check.answer == "agrees" and channel == "speed":
                expected = np.abs(path[:, j]) / check.value
                seen = expected > max(_LARGE * float(np.nanquantile(expected, 0.95)), _ABOVE_NOISE * of_change[j])
                # A change below a tenth of what the speed says is none.
                still = float(np.mean(np.abs(change[seen, j]) < 0.1 * expected[seen]))
                if still > _ODD:  # no ratio shows it: at rest there is no ratio
                    check = replace(check, answer="contradicts", found="still", share=still)
        yield check.finding()


def _ratios(path: FloatArray, of_path: float, change: FloatArray, of_change: float) -> FloatArray:
    """Return the ratio of both where both are large (r,)."""
    large = [
        np.abs(values) > max(_LARGE * float(np.nanquantile(np.abs(values), 0.95)), _ABOVE_NOISE * noise)
        for values, noise in ((path, of_path), (change, of_change))
        if np.isfinite(values).any()
    ]
    return path[large[0] & large[1]] / change[large[0] & large[1]] if len(large) == 2 else np.empty(0)


def _is_size(ratios: FloatArray) -> bool:
    """Whether ratios are those of a channel and its derivative, but for their unit."""
    if len(ratios) < _FEWEST:
        return False
    low, middle, high = np.quantile(ratios, (0.25, 0.5, 0.75))
    # The size is sure if half of them lie within 30 % of it.
    return bool(np.mean(ratios < 0.0) < _ODD and high - low < 0.6 * middle)


def _checked(check: ChannelCheck, ratios: FloatArray, others: Sequence[str]) -> ChannelCheck:
    """Return the answer by the ratios; `others` are the joints whose channel this one is the derivative of."""
    backward, size = float(np.mean(ratios < 0.0)), float(np.median(ratios))
    if _is_size(ratios):
        if _LEAST < size < _MOST:
            return replace(check, answer="agrees", found="size", value=size)
        between = units_apart(size, check.channel)
        text = f" (a factor as between {between})" if between else ""
        return replace(check, answer="contradicts", found="size", value=size, between=text)
    if _is_size(-ratios) or (check.channel == "acceleration" and backward > 1.0 - _ODD):
        return replace(check, answer="contradicts", found="sign", value=size)
    if others:
        return replace(check, answer="contradicts", found="joints", between=others[0])
    # Of unrelated channels a quarter of the changes or more have either sign.
    if not 0.25 < backward < 0.75:
        return replace(check, found="apart", value=backward)
    return replace(check, answer="contradicts", found="course", share=backward)


def units_apart(ratio: float, channel: str = "speed") -> str:
    """Return the units that differ by a factor, the nearest ones within the tolerance; empty if it is none of theirs.

    >>> units_apart(1000.0), units_apart(1.0 / 60.0), units_apart(57.3), units_apart(3.0)
    ('mm and m, or ms and s', 'min and s', 'deg and rad', '')
    """
    ratio = max(ratio, 1.0 / max(ratio, 1e-300))
    factors = (*_FACTORS, *(_OF_ACCELERATION if channel == "acceleration" else _OF_SPEED))
    factor, units = min(factors, key=lambda item: abs(math.log(ratio / item[0])))
    # A factor between two units is named within 15 %: noise and filters change that of an accelerometer.
    return units if abs(ratio / factor - 1.0) < 0.15 else ""
