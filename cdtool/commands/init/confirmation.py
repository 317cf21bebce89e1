"""Confirm guesses by physics: a channel is certain only if another channel agrees; what does not agree is a doubt."""

from __future__ import annotations

from dataclasses import replace

from cdtool.commands.init import motion_evidence as motion
from cdtool.commands.init.names.words import says
from cdtool.commands.init.stream import Stream
from cdtool.commands.init.streams import Channels

# Share of an effort that inertia, friction and weight must explain.
_DRIVES = 0.4


def confirm(channels: Channels) -> None:
    """Add to each channel that its values confirm how they do so, and to any other what to check."""
    streams = {name: found.stream for name, found in channels.found.items()}
    for name, found in list(channels.found.items()):
        why, doubt = _answer(name, streams)
        channels.found[name] = replace(
            found,
            why="; ".join(part for part in (found.why, why) if part),
            check="; ".join(part for part in (found.check, doubt) if part),
        )


def _answer(name: str, streams: dict[str, Stream]) -> tuple[str, str]:
    """Return what confirms a channel, and what does not; both empty if there is nothing to compare."""
    if name in ("position", "speed"):
        return _of_motion(name, streams)
    if name == "torque":
        return _of_drive(streams)
    if name == "acceleration":
        if "speed" not in streams:
            return "", "no speed confirms it"
        correlation = motion.integral_fit(streams["speed"], streams[name], centred=True).correlation
        fits = abs(correlation) > motion.FITS
        text = f"its integral {'fits' if fits else 'does not fit'} the speed, r = {correlation:.3f}"
        return (text, "") if fits else ("", text)
    if name.startswith("reference_"):
        measured = streams.get(name.removeprefix("reference_"))
        if measured is None:
            return "", "no measured channel follows it"
        correlation = motion.likeness(measured, streams[name])
        named = bool(says("reference", streams[name].name)) and correlation <= motion.FITS
        return "", f"the measured channel does not follow it, r = {correlation:.2f}" if named else ""
    return "", ""


def _of_motion(name: str, streams: dict[str, Stream]) -> tuple[str, str]:
    position, speed, acceleration = (streams.get(item) for item in ("position", "speed", "acceleration"))
    if position is not None and speed is not None:
        correlation = motion.integral_fit(position, speed).correlation
        if correlation < -motion.FITS:
            return "", "opposite in sign to the position's derivative: reverse one of them by scale = -1"
        if correlation <= motion.FITS:
            return "", f"the position's derivative does not fit the speed, r = {correlation:.2f}"
        ahead = motion.integral_lead(position, speed) if name == "speed" else 0.0
        late = f"ahead of the position's derivative by {ahead:.1f} samples: is it a set value?"
        told = f"its derivative fits the speed, r = {correlation:.3f}" if name == "position" else ""
        # A speed that is further ahead of the position's derivative [samples] is doubtful.
        return told, late if ahead > 1.5 else ""
    fit = (
        motion.integral_fit(speed, acceleration, centred=True)
        if speed is not None and acceleration is not None
        else None
    )
    if fit is not None and abs(fit.correlation) > motion.FITS:
        return "", ""
    return "", f"no {'speed' if name == 'position' else 'position'} confirms it"


def _of_drive(streams: dict[str, Stream]) -> tuple[str, str]:
    speed, position = streams.get("speed"), streams.get("position")
    rate = speed or (motion.derived(position) if position is not None else None)
    if rate is None:
        return "", "no motion confirms it"
    percent = 100 * max(0.0, motion.drive_fit(streams["torque"], rate, position))
    if percent > 100 * _DRIVES:
        return f"inertia, friction and weight explain {percent:.0f} % of it", ""
    return "", f"inertia, friction and weight explain only {percent:.0f} % of it"
