"""Put a contact into a recording: the change of each channel on that channel's own clock and in its own unit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.commands.inject.channel_change import ChannelChange
from cdtool.machines.dynamics import Machine
from cdtool.recordings.recording import Recording, Series

# The channels that a contact changes where they are logged; the references do not react.
_CHANGED = ("torque", "speed", "position", "acceleration", "reference_torque")


def injected_recording(
    logged: Recording,
    machine: Machine,
    changes: Mapping[str, ChannelChange],
    force: ChannelChange,
    joints: tuple[int, ...],
) -> Recording:
    """Return a recording as logged, with a contact in every channel; it ends with what was simulated.

    `changes` (n, len(joints)) are on the load side, `force` (n, 1) is added to the load cell, or is a load cell without
    noise if the log has none. A channel whose change is not known is left out. Samples that are missing stay missing.
    Raises RecordingError if no channel of the log changes.
    """
    end = float(force.time[-1])
    channels: dict[str, Series] = {}
    changed = False
    for name, series in logged.channels.items():
        part = series.between(-np.inf, end)
        if not len(part):
            continue
        if name == "force":
            added = np.zeros(part.values.shape)
            added[:, :1] = force.at(part.time)
            channels[name] = part.with_values(part.values + added, part.unit)
        elif name not in _CHANGED:
            channels[name] = part
        elif name in changes:
            factor = machine.load_factor(name, series.unit)
            added = np.zeros(part.values.shape)
            added[:, list(joints)] = changes[name].at(part.time) / factor[list(joints)]
            changed |= bool(np.any(np.nan_to_num(added)))
            channels[name] = part.with_values(part.values + added, part.unit)
    if not changed:
        raise RecordingError(
            f"{logged.name}: the contact at {force.start:.3f} s changes no channel of the log",
            "log torque, speed or acceleration",
        )
    if "force" not in channels:
        clock = _clock(channels)
        channels["force"] = Series(clock, force.at(clock), machine.accepted_units("force")[0])
    fact = {"start": force.start, "peak": float(np.max(force.values))}
    return replace(
        logged,
        channels=channels,
        findings=(*logged.findings, Finding("injected_contact_fact", "force", fact)),
        digest="",
    )


def _clock(channels: Mapping[str, Series]) -> FloatArray:
    """Return the clock of the channel with the most samples."""
    return max(channels.values(), key=len).time
