"""The checks of a machine file's channels by mechanics, on impact-free logs or on what is before a contact.

Three answers for each: it agrees, it contradicts, or the motion does not show it. What contradicts is a loss: no
detector may use the channel until the machine file is corrected, or confirms it with `confirmed = true`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from cdtool.base.findings import Finding
from cdtool.machines.dynamics import Machine
from cdtool.machines.plausibility.derivatives import derivative_checks
from cdtool.machines.plausibility.drive import drive_checks
from cdtool.recordings.recording import Recording


def check_channels(recordings: Sequence[Recording], machine: Machine) -> tuple[Finding, ...]:
    """Return the answer of each check of torque, speed and acceleration, for all logs together.

    Parameters
    ----------
    recordings : sequence of Recording
        Logs of one machine on the load side, without contacts.
    machine : Machine
        The machine: its inertia is compared with what starts show.

    Returns
    -------
    tuple of Finding
        Of `ChannelCheck` each: a contradiction is a loss, all else a note. A channel that the machine file confirms is
        not checked.

    Examples
    --------
    >>> import cdtool
    >>> machine = cdtool.read_machine_file("sample_logs/gate/machine.toml")
    >>> log = cdtool.read("sample_logs/gate/free/03.csv", machine)
    >>> [(item.channel, item.numbers["answer"]) for item in check_channels([log], machine.machine)][0]
    ('speed', 'agrees')
    """
    found = derivatives(recordings)
    if getattr(machine, "ratio_unit", "") == "m/rad" and 1.0 in getattr(machine, "transmission_ratio", ()):
        # The placeholder of a draft is a factor between motor and accelerometer: a warning names the ratio.
        found = [replace(item, severity="note") if item.channel == "acceleration" else item for item in found]
    if any(item.severity == "loss" and item.channel == "speed" for item in found):
        return tuple(found)  # by such a speed nothing can be said of a torque
    return (*found, *drive_checks(_with("torque", recordings), machine))


def derivatives(recordings: Sequence[Recording]) -> list[Finding]:
    """Return whether the speed is the derivative of the position and the acceleration that of the speed.

    A speed that contradicts the position says nothing about the acceleration. One that is derived is not checked.
    """
    measured = [
        item
        for item in _with("speed", recordings)
        if not any(found.kind in ("derived_speed", "integrated_position") for found in item.findings)
    ]
    found = list(derivative_checks(measured, "speed", "position"))
    if any(item.severity == "loss" for item in found):
        return found
    return [*found, *derivative_checks(_with("acceleration", recordings), "acceleration", "speed")]


def _with(channel: str, recordings: Sequence[Recording]) -> list[Recording]:
    """Return the logs with a speed and the channel, unless the machine file confirms it."""
    return [
        item
        for item in recordings
        if {"speed", channel} <= item.channels.keys()
        and not any(found.channel == channel and found.kind == "confirmed" for found in item.findings)
    ]
