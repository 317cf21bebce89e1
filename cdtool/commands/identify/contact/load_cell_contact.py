"""A contact with a load cell as identification uses it: motor, torque and force at one place, equally smoothed.

The motor's position is differentiated twice. A symmetrical Gaussian low-pass makes that possible; all channels pass it,
so that a linear model relates them as before. Offline only: it uses samples of the future.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.errors import RecordingError
from cdtool.machines.axis_model.axis_run import AxisRun, axis_run
from cdtool.machines.axis_model.parameters import AxisModel, Sensors
from cdtool.recordings.recording import Contact, Recording

# What is compared: from this long before the contact, at least, to the separation or this long after the contact [s].
_LEAD, _SHORTEST_LEAD, _LONGEST = 0.1, 0.03, 0.2
# A shorter contact does not wind up a drive [s].
_SHORTEST = 0.01
# The load has left the load cell below this share of the peak force.
_SEPARATED = 0.02
# Standard deviation of the common low-pass: at least this many samples, at most this time [s].
_FEWEST_SMOOTHED, _LONGEST_SMOOTHED = 1.5, 0.012
# The inertia force of the motor may be as noisy as this share of the torque's noise.
_NOISE_SHARE = 0.5
# An axis below this share of its highest speed does not approach.
_APPROACH_SHARE = 0.02


@dataclass(frozen=True, eq=False)
class LoadCellContact:
    """A contact as the fit uses it, in the direction of approach, on the load side (SI), every `period` [s].

    `time` (n,) counts from the onset. What is simulated needs a margin of m samples before and after it: `motor`
    (2, m + n + m) is the motor's position and speed [m, m/s]. What is compared has passed a symmetrical low-pass with
    the weights `low_pass` (2 m + 1,): `motor_acceleration`, `torque` and `acceleration` (n,) [m/s2, N, m/s2], the last
    from its level before the contact, or None. `force` [N] over its rest level at `force_time` [s] from the onset, on
    the load cell's clock. `level` [N]: mean drive force before the contact; `noise`: scatter of torque and acceleration
    there. The motion `is_motion_exact` if it comes from the position, or from a speed whose low-pass is known.
    """

    name: str
    direction: int
    period: float
    time: FloatArray
    motor: FloatArray
    low_pass: FloatArray
    motor_acceleration: FloatArray
    torque: FloatArray
    acceleration: FloatArray | None
    force_time: FloatArray
    force: FloatArray
    level: float
    noise: tuple[float, float]
    is_motion_exact: bool = True

    @property
    def margin(self) -> int:
        """Return m, the samples before and after those that are compared."""
        return len(self.low_pass) // 2

    @property
    def approach_speed(self) -> float:
        """Return the speed of the motor at the onset, over the last 20 ms or more [m/s]."""
        count = max(round(_SHORTEST_LEAD / self.period), 2)
        onset = self.margin + int(np.searchsorted(self.time, 0.0))
        return float(np.mean(self.motor[1, max(onset - count, 0) : onset]))

    def drive_force_of(self, motor_mass: float) -> FloatArray:
        """Return what the motor exerts on the drive (n,) [N]: torque less the motor's inertia force."""
        force: FloatArray = self.torque - motor_mass * self.motor_acceleration
        return force

    def force_at(self, delay: float) -> FloatArray:
        """Return the contact force (m + n + m,) [N] if the load cell is late by `delay` [s]."""
        begin = self.time[0] - self.margin * self.period
        time = begin + self.period * np.arange(self.motor.shape[1])
        force: FloatArray = np.interp(time, self.force_time - delay, self.force, left=0.0)
        return force


def load_cell_contact(
    recording: Recording, contact: Contact, model: AxisModel, joint: int = 0, lever_arm: float = 1.0
) -> LoadCellContact:
    """Return a contact of a recording on the load side, prepared for `identify_contacts`.

    `lever_arm` [m]: of a rotary axis, from its axis to the load cell. Raises RecordingError without a load cell,
    where the log has gaps at the contact or begins too late before it, or where the axis does not move.
    """
    run = axis_run(recording, joint)
    start = contact.start
    position = _motor_position(run, model)
    force_time, force = contact_force(recording, contact, lever_arm)
    end = min(start + _LONGEST, _separation(force_time, force, start))
    if end - start < _SHORTEST:
        raise RecordingError(f"{run.name}: the contact lasts {1e3 * (end - start):.0f} ms", "use a longer contact")
    smoothing = _smoothing(run, position, start, model.drive.motor_mass)
    margin = math.ceil(4.0 * smoothing / run.period) + 1
    first, last = _compared(run, start, end, 2 * margin)
    around = slice(first - margin, last + margin + 1)
    wide = slice(first - 2 * margin, last + 2 * margin + 1)
    if not np.all(np.isfinite(position[wide]) & np.isfinite(run.torque[wide])):
        raise RecordingError(f"{run.name}: samples are missing at the contact at {start:.3f} s", "use other contacts")
    time = run.time[first : last + 1] - start
    before = time < -2.0 * smoothing
    little = [_gaussian(run.period, run.period, margin, order) for order in (0, 1)]
    motor = np.stack([np.convolve(position[wide], item, mode="valid") for item in little])
    weights = _gaussian(smoothing, run.period, margin, 0)
    bent = np.convolve(position[around], _gaussian(smoothing, run.period, margin, 2), mode="valid")
    direction = _direction(run, motor[1, margin:-margin][before])
    torque = direction * np.convolve(run.torque[around], weights, mode="valid")
    acceleration = _acceleration(run, model.sensors, around, weights, before)
    level = float(np.mean((torque - direction * model.drive.motor_mass * bent)[before]))
    scatter = (float(np.std(torque[before])), 0.0 if acceleration is None else float(np.std(acceleration[before])))
    return LoadCellContact(
        name=run.name,
        direction=direction,
        period=run.period,
        time=time,
        motor=np.ascontiguousarray(direction * motor),
        low_pass=weights,
        motor_acceleration=direction * bent,
        torque=torque,
        acceleration=None if acceleration is None else direction * acceleration,
        force_time=force_time - start,
        force=force,
        level=level,
        noise=scatter,
        is_motion_exact=_is_position_logged(run) or _speed_corner(model) < math.inf,
    )


def _compared(run: AxisRun, start: float, end: float, margin: int) -> tuple[int, int]:
    """Return the first and the last sample that are compared; the log has `margin` samples more on both sides."""
    last = math.floor((end - run.start) / run.period + 1e-6)
    first = max(math.ceil((start - _LEAD - run.start) / run.period), margin)
    if last + margin >= len(run) or run.start + first * run.period > start - _SHORTEST_LEAD:
        least = _SHORTEST_LEAD + margin * run.period
        raise RecordingError(
            f"{run.name}: the log does not cover the contact at {start:.3f} s",
            f"it must begin {1e3 * least:.0f} ms before a contact and end {1e3 * margin * run.period:.0f} ms after it",
        )
    return first, last


def _direction(run: AxisRun, speed: FloatArray) -> int:
    """Return the direction of approach from the speed before the contact (n,)."""
    mean = float(np.mean(speed))
    position = run.position if run.position is not None else np.nancumsum(np.asarray(run.speed)) * run.period
    steps = np.diff(position[np.isfinite(position)])
    width = max(round(0.02 / run.period), 1)
    fastest = float(np.max(np.abs(np.convolve(steps, np.full(width, 1.0 / width), mode="same")))) / run.period
    if mean == 0.0 or abs(mean) < _APPROACH_SHARE * fastest:
        raise RecordingError(f"{run.name}: the axis does not move before the contact", "use contacts in motion")
    return 1 if mean > 0.0 else -1


def _is_position_logged(run: AxisRun) -> bool:
    return run.position is not None and "position" not in run.derived


def _speed_corner(model: AxisModel) -> float:
    """Return the corner of the speed channel's low-pass [Hz]; infinite if it is not known."""
    if model.sensors.speed_hz > 0.0:
        return model.sensors.speed_hz
    return model.controller.speed_filter_hz if model.controller is not None else math.inf


def _motor_position(run: AxisRun, model: AxisModel) -> FloatArray:
    """Return the motor's position (n,): logged, or the sum of the speeds with their low-passes undone [m]."""
    if run.position is not None and _is_position_logged(run):
        return run.position
    assert run.speed is not None
    corner, speed = _speed_corner(model), run.speed
    if 0.0 < corner < math.inf:
        keep = math.exp(-2.0 * math.pi * corner * run.period)
        is_own = model.sensors.speed_hz > 0.0 or model.controller is None
        order = 2 if is_own or model.controller is None else model.controller.speed_filter_order
        for _ in range(order):
            speed = np.concatenate((speed[:1], (speed[1:] - keep * speed[:-1]) / (1.0 - keep)))
    return np.cumsum(speed) * run.period


def contact_force(recording: Recording, contact: Contact, lever_arm: float) -> tuple[FloatArray, FloatArray]:
    """Return times [s] and force over the rest level before the contact, positive in the contact [N, N m]."""
    if "force" not in recording:
        raise RecordingError(f"{recording.name}: no load cell", "map its channel 'force' in [channels]")
    series = recording["force"]
    known = np.all(np.isfinite(series.values), axis=1)
    time, values = series.time[known], series.values[known]
    before = (time > contact.start - 0.5) & (time < contact.start - 0.02)
    within = (time >= contact.start) & (time <= contact.start + _LONGEST)
    if np.count_nonzero(before) < 3 or np.count_nonzero(within) < 3:
        raise RecordingError(f"{recording.name}: the load cell does not cover the contact", "use other contacts")
    over = values - np.median(values[before], axis=0)
    along = np.mean(over[within], axis=0)
    return time, lever_arm * over @ (along / max(float(np.linalg.norm(along)), 1e-300))


def _separation(time: FloatArray, force: FloatArray, start: float) -> float:
    after = time >= start
    peak = np.maximum.accumulate(force[after])
    lost = (force[after] <= _SEPARATED * peak) & (peak > 0.5 * np.max(peak))
    return float(time[after][np.argmax(lost)]) if lost.any() else math.inf


def _smoothing(run: AxisRun, position: FloatArray, start: float, motor_mass: float) -> float:
    """Return the shortest low-pass after which the motor's inertia force is hardly noisier than the torque [s].

    White noise of a position with the standard deviation q has, through a Gaussian of s, an acceleration of
    q sqrt(3 h / (8 sqrt(pi) s^5)).
    """
    before = (run.time > start - 0.3) & (run.time < start)
    known = position[before & np.isfinite(position)]
    torque = run.torque[before & np.isfinite(run.torque)]
    shortest = _FEWEST_SMOOTHED * run.period
    if len(known) < 8 or len(torque) < 8:
        return shortest
    noise = float(np.std(np.diff(known, 3))) / math.sqrt(20.0)
    wanted = _NOISE_SHARE * max(float(np.std(torque)), 1e-3 * float(np.max(np.abs(torque))))
    needed = (motor_mass * noise / wanted) ** 2 * 3.0 * run.period / (8.0 * math.sqrt(math.pi))
    return float(np.clip(needed**0.2, shortest, max(shortest, _LONGEST_SMOOTHED)))


def _gaussian(deviation: float, period: float, reach: int, order: int) -> FloatArray:
    """Return the weights (2 reach + 1,) of a Gaussian low-pass and of its first two derivatives, for np.convolve."""
    at: FloatArray = period * np.arange(-reach, reach + 1, dtype=np.float64)
    weights: FloatArray = np.exp(-0.5 * (at / deviation) ** 2)
    if order == 0:
        weights /= np.sum(weights)
    elif order == 1:
        # np.convolve turns the weights round: the later sample has the negative index.
        weights *= at
        weights /= -np.sum(weights * at)
    else:
        weights *= at**2 / deviation**2 - 1.0
        weights -= np.mean(weights)
        weights *= 2.0 / np.sum(weights * at**2)
    return weights


def _acceleration(
    run: AxisRun, sensors: Sensors, around: slice, weights: FloatArray, before: BoolArray
) -> FloatArray | None:
    """Return the smoothed acceleration over its mean before the contact; None where it cannot be compared."""
    if run.acceleration is None or sensors.accelerometer_hz <= 0.0:
        return None
    values = run.acceleration[around]
    if not np.all(np.isfinite(values)):
        return None
    smooth = np.convolve(values, weights, mode="valid")
    changed: FloatArray = smooth - np.mean(smooth[before])
    return changed
