"""Add doubts to guesses: a channel is certain only if another channel confirms it, by physics."""

from __future__ import annotations

import dataclasses

from cdtool.commands.init import motion_evidence as motion
from cdtool.commands.init.names.words import says
from cdtool.commands.init.stream import Stream
from cdtool.commands.init.streams import Channels, Found

# Correlations above which a position's derivative is the speed, and a set value that of the measured channel.
_FITS, _FOLLOWS = 0.9, 0.9
# Share of an effort that inertia, friction and weight must explain.
_DRIVES = 0.4
# A speed that is ahead of the position's derivative by more samples than this is doubtful.
_AHEAD = 1.5


def add_doubts(channels: Channels) -> None:
    """Add to each channel what its values do not confirm, as a text to check; nothing for one that is confirmed."""
    for name, found in list(channels.found.items()):
        doubt = _doubt(name, found.stream, channels)
        if doubt:
            check = f"{found.check}; {doubt}" if found.check else doubt
            channels.found[name] = dataclasses.replace(found, check=check)


def _doubt(name: str, stream: Stream, channels: Channels) -> str:
    if name in ("position", "speed"):
        return _motion_doubt(name, channels)
    if name == "torque":
        return _drive_doubt(stream, channels)
    if name == "acceleration":
        speed = _stream(channels, "speed")
        if speed is None:
            return "no speed confirms it"
        correlation = abs(motion.derivative_fit(stream, speed).correlation)
        return "" if correlation > _FITS else f"its integral does not fit the speed, r = {correlation:.2f}"
    if name.startswith("reference_"):
        return _reference_doubt(name.removeprefix("reference_"), stream, channels)
    return ""


def _motion_doubt(name: str, channels: Channels) -> str:
    position, speed = _stream(channels, "position"), _stream(channels, "speed")
    if position is None or speed is None:
        acceleration = _stream(channels, "acceleration")
        if speed is not None and acceleration is not None:
            correlation = abs(motion.derivative_fit(acceleration, speed).correlation)
            if correlation > _FITS:
                return ""
        other = "speed" if name == "position" else "position"
        return f"no {other} confirms it"
    correlation = motion.integral_fit(position, speed).correlation
    if correlation < -_FITS:
        return "opposite in sign to the position's derivative: reverse one of them by scale = -1"
    if correlation <= _FITS:
        return f"the position's derivative does not fit the speed, r = {correlation:.2f}"
    ahead = motion.integral_lead(position, speed)
    if name == "speed" and ahead > _AHEAD:
        return f"ahead of the position's derivative by {ahead:.1f} samples: is it a set value?"
    return ""


def _drive_doubt(stream: Stream, channels: Channels) -> str:
    speed, position = _stream(channels, "speed"), _stream(channels, "position")
    if speed is None and position is not None:
        speed = motion.derived(position)
    if speed is None:
        return "no motion confirms it"
    share = motion.drive_fit(stream, speed, position)
    return "" if share > _DRIVES else f"inertia, friction and weight explain only {100 * max(share, 0.0):.0f} % of it"


def _reference_doubt(quantity: str, stream: Stream, channels: Channels) -> str:
    measured = _stream(channels, quantity)
    if measured is None:
        return "no measured channel follows it"
    if not says("reference", stream.name):
        return ""
    correlation = motion.likeness(measured, stream)
    return "" if correlation > _FOLLOWS else f"the measured channel does not follow it, r = {correlation:.2f}"


def _stream(channels: Channels, name: str) -> Stream | None:
    found: Found | None = channels.found.get(name)
    return found.stream if found is not None else None
