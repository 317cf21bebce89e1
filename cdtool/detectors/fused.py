"""Fused evidence: every channel that shows a contact, compared together with the shapes of one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import ClassVar

import numpy as np

from cdtool.clock.lost_samples import lost_samples
from cdtool.detection import Signal, Status, StatusArray
from cdtool.detectors.base import gain, held_on, per_joint, require_channels, require_positive
from cdtool.detectors.friction_ekf import FrictionEkf
from cdtool.detectors.look import TEAL, Look
from cdtool.dynamics import Gain, Machine
from cdtool.errors import RecordingError
from cdtool.recording import BoolArray, FloatArray, Recording, Series
from cdtool.short_repr import short_repr


@dataclass(frozen=True)
class _Column:
    """One channel of one joint (n,) on the clock of the speed; positive opposes positive travel."""

    channel: str
    joint: str
    values: FloatArray
    status: StatusArray
    lost: BoolArray

    __repr__ = short_repr


@dataclass(frozen=True)
class Fused:
    """All channels that show a contact, for the threshold `matched_banks`, which judges them together.

    Parameters
    ----------
    sigma_acceleration : float or tuple of float
        Axis: standard deviation of the noise of the accelerometer, vibration of the structure included [m/s2].
    sigma_speed : float or tuple of float
        Axis: standard deviation of the noise of the speed [m/s].
    friction_drift : float or tuple of float
        Axis: how fast the friction may change [N s/m per sqrt(s)].
    minimum_speed : float or tuple of float
        Axis: speed below which the friction is not estimated [m/s].

    Raises
    ------
    ConfigurationError
        A gain is not a finite number above 0.

    Notes
    -----
    Not in the thesis. It estimates no contact force: its signal has several columns, and its own threshold
    (`own_threshold`) whitens them together and looks for the shapes of contacts; see `MatchedBanks`.

    * Axes: the deceleration -a of each, the force d max(|v|, v_min) in the direction of motion, with d from
      `FrictionEkf` with these gains, torque and -v. Without an accelerometer: torque and -v.
    * Robots, whose joints are coupled: torque, -v and -a of each joint.
    * Needs: speed, and torque or acceleration. Channels that a log does not have are left out; what is learned applies
      to logs with the same ones. Without acceleration, stiff contacts are seen later.
    * Unit: 1; all columns on the clock of the speed, the last value held.
    * Status: as the channels; the force of an axis is not applicable below `minimum_speed`.
    * Fails: see `MatchedBanks`: before the motion is settled it sees strong contacts only.

    Examples
    --------
    >>> import numpy as np
    >>> from cdtool.machines.linear_axis import LinearAxis
    >>> from cdtool.recording import Recording, Series
    >>> from cdtool.tables import Table
    >>> axis = LinearAxis.from_table(Table({"coordinates": "load", "load_mass": 600.0}, "machine.toml"))
    >>> time = np.arange(2001) * 1e-3
    >>> torque, speed = Series(time, np.where(time < 1.0, 30.0, 90.0), "N"), Series(time, np.full(2001, 0.2), "m/s")
    >>> steady = Series(time, np.zeros(2001), "m/s2")
    >>> run = Recording("run", "", ("axis",), {"torque": torque, "speed": speed, "acceleration": steady})
    >>> signal = Fused().signal(run, axis)
    >>> [channel for channel, _ in signal.channels]
    ['acceleration', 'force', 'torque', 'speed']
    >>> signal.values[[999, 2000], 1].round().tolist()
    [30.0, 90.0]
    """

    # No gain is searched: they shape one of several banks, and learning takes seconds.
    sigma_acceleration: Gain = gain(0.1, "m/s2", "axis: noise of the accelerometer, structure included", searched=False)
    sigma_speed: Gain = gain(3.5e-3, "m/s", "axis: noise of the speed (standard deviation)", searched=False)
    friction_drift: Gain = gain(220.0, "N s/m per sqrt(s)", "axis: how fast the friction may change", searched=False)
    minimum_speed: Gain = gain(0.03, "m/s", "axis: below it the friction is not estimated", searched=False)

    name: ClassVar[str] = "fused"
    short_name: ClassVar[str] = "fu"
    title: ClassVar[str] = "Fused evidence"
    needs: ClassVar[tuple[str, ...]] = ("speed",)
    signed: ClassVar[bool] = True
    contact_torque: ClassVar[bool] = False
    own_threshold: ClassVar[str] = "matched_banks"
    look: ClassVar[Look] = Look(TEAL, "X")

    def __post_init__(self) -> None:
        require_positive(self, "sigma_acceleration", "sigma_speed", "friction_drift", "minimum_speed")

    def unit(self, machine: Machine) -> str:  # noqa: ARG002 - the contract hands the machine over
        """Return "1": the columns have different units, and what is compared with a limit has none."""
        return "1"

    def signal(self, recording: Recording, machine: Machine) -> Signal:
        """Return the columns (n, C) of all joints; see `Detector.signal`."""
        require_channels(self, recording)
        for item in fields(self):
            per_joint(getattr(self, item.name), len(recording.joints))
        clock = recording["speed"].time
        columns = _robot(recording) if machine.coupled else self._axes(recording, machine)
        if not any(column.channel in ("torque", "acceleration") for column in columns):
            raise RecordingError(
                f"{recording.name}: {self.name} needs torque or acceleration next to the speed",
                f"map one in [channels] of the machine file; mapped here: {', '.join(recording.channels)}",
                channel="torque",
            )
        lost = np.column_stack([column.lost for column in columns])
        status = np.column_stack([column.status for column in columns])
        # Without the speed nothing is known of the motion; a joint that never has one is left out.
        missing: BoolArray = np.isnan(recording["speed"].values)
        known = ~missing.all(axis=0) if not missing.all() else np.ones(missing.shape[1], dtype=bool)
        unknown: BoolArray = np.any(missing[:, known], axis=1, keepdims=True)
        status[(status == Status.VALID) & unknown] = Status.GAP
        return Signal(
            clock,
            np.ascontiguousarray(np.column_stack([column.values for column in columns])),
            np.ascontiguousarray(status),
            self.unit(machine),
            self.signed,
            tuple(f"{column.joint} {column.channel}" for column in columns),
            notes=_notes(recording, columns),
            lost=lost if lost.any() else None,
            channels=tuple((column.channel, column.joint) for column in columns),
        )

    def _axes(self, recording: Recording, machine: Machine) -> list[_Column]:
        """Return -a, the estimated force, torque and -v of each axis; without one of them, what there is."""
        decelerations = _columns(recording, "acceleration", -1.0)
        if not decelerations:
            return _robot(recording)
        if "torque" not in recording:
            return [*decelerations, *_columns(recording, "speed", -1.0)]
        estimated = FrictionEkf(
            sigma_acceleration=self.sigma_acceleration,
            sigma_speed=self.sigma_speed,
            friction_drift=self.friction_drift,
            minimum_speed=self.minimum_speed,
        ).signal(recording, machine)
        speed, _ = held_on(estimated.time, recording["speed"])
        least = per_joint(self.minimum_speed, len(recording.joints))
        force = estimated.values * np.maximum(np.abs(speed), least) * np.sign(speed)
        lost = lost_samples(recording, ("torque", "speed", "acceleration"), estimated.time)
        lost = np.zeros(force.shape, dtype=bool) if lost is None else lost
        forces = [
            _Column("force", joint, force[:, j], estimated.status[:, j], lost[:, j])
            for j, joint in enumerate(recording.joints)
        ]
        slow = [*_columns(recording, "torque", 1.0), *_columns(recording, "speed", -1.0)]
        return [*decelerations, *forces, *slow]


def _notes(recording: Recording, columns: Sequence[_Column]) -> tuple[str, ...]:
    """Return what is not used for want of samples, and what that costs."""
    used = {(column.channel, column.joint) for column in columns}
    notes = [] if "acceleration" in recording else ["fused without acceleration: stiff contacts are detected later"]
    for joint in recording.joints:
        lost = [name for name in ("torque", "speed", "acceleration") if name in recording and (name, joint) not in used]
        if lost == ["acceleration"]:
            notes.append(f"fused without acceleration of {joint}: its stiff contacts are detected later")
        elif lost:
            notes.append(f"fused without {', '.join(lost)} of {joint}: contacts with it are detected later, if at all")
    return tuple(notes)


def _robot(recording: Recording) -> list[_Column]:
    """Return torque, -v and -a of each joint, of those that the log has."""
    signs = {"torque": 1.0, "speed": -1.0, "acceleration": -1.0}
    return [column for channel, sign in signs.items() for column in _columns(recording, channel, sign)]


def _columns(recording: Recording, channel: str, sign: float) -> list[_Column]:
    """Return a channel of each joint on the clock of the speed; without the joints for which it has no sample."""
    if channel not in recording:
        return []
    series: Series = recording[channel]
    clock = recording["speed"].time
    held, missing = held_on(clock, series)
    lost = lost_samples(recording, (channel,), clock)
    lost = np.zeros(held.shape, dtype=bool) if lost is None else lost
    before = clock < (series.time[0] if len(series) else np.inf)
    columns = []
    for j, joint in enumerate(recording.joints):
        if len(series) and not np.isfinite(series.values[:, j]).any():
            continue
        status = np.where(missing[:, j], np.uint8(Status.GAP), np.uint8(Status.VALID))
        status[before] = Status.START_UP
        columns.append(_Column(channel, joint, sign * held[:, j], status.astype(np.uint8), lost[:, j]))
    return columns
