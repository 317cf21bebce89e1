"""The contract of a detector, and what several share: gains, held samples, the momentum observer's recursion."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, TypeVar

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.errors import ConfigurationError, FieldsError, RecordingError
from cdtool.base.kernels import kernel
from cdtool.base.value_words import value_in_words
from cdtool.detectors.detection import Signal, Status, StatusArray
from cdtool.machines.dynamics import Gain, Machine
from cdtool.recordings.clock import previous_value
from cdtool.recordings.clock.held_samples import hold_last
from cdtool.recordings.clock.lost_samples import lost_samples
from cdtool.recordings.recording import Recording, Series

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


# A filter bridges a gap up to this long [s] even if its memory is shorter, without a start-up after it.
BRIDGED = 0.15

AnyDetector = TypeVar("AnyDetector", bound="DataclassInstance")


class Detector(Protocol):
    """The contract of a detector: a frozen dataclass whose fields are its gains, made by `gain`.

    Attributes
    ----------
    name : str
        Name in files and reports, and of the entry point of a plug-in.
    short_name : str
        Short name on the command line; unique.
    title : str
        Name in figures and tables.
    needs : tuple of str
        Channels that `signal` reads; the load cell and labels are never among them.
    signed : bool
        True if the sign of the signal follows the axis, False if positive always opposes the motion.

    Notes
    -----
    Optional attributes are `look` (`cdtool.detectors.look.Look`), and `contact_torque`: False if a signal in N or N m
    is not the contact torque. docs/own-detector.md has a complete example.
    """

    name: ClassVar[str]
    short_name: ClassVar[str]
    title: ClassVar[str]
    needs: ClassVar[tuple[str, ...]]
    signed: ClassVar[bool]

    def unit(self, machine: Machine) -> str:
        """Return the unit of the signal for that machine."""
        ...

    def signal(self, recording: Recording, machine: Machine) -> Signal:
        """Return the collision detection signal of a recording.

        Parameters
        ----------
        recording : Recording
            A recording on the load side, without load cell and label.
        machine : Machine
            The model of its machine; used by its methods, never by its type.

        Returns
        -------
        Signal
            Times (n,) s, values and status (n, J), J joints. Causal: the output up to a sample does not depend on later
            samples. Missing samples are marked in the status, not filled.

        Raises
        ------
        RecordingError
            A channel in `needs` is missing.
        ConfigurationError
            The machine file does not give an inertia that the detector needs, or a gain has another number of joints.
        """
        ...


def gain(default: float, unit: str, meaning: str, *, searched: bool = True) -> Any:
    """Return the dataclass field of a gain, with its unit and meaning as metadata.

    Parameters
    ----------
    default : float
        Default value; a machine file may replace it by one number, or by one number per joint.
    unit : str
        Unit for a linear axis, for example "rad/s"; "1" for a ratio.
    meaning : str
        What the gain sets, as `cdtool list detectors` shows it.
    searched : bool
        Whether `cdtool tune` searches it: not what belongs to a sensor, or decides where the method applies.

    Returns
    -------
    dataclasses.Field
        The field, to be assigned to an annotated attribute.

    Examples
    --------
    >>> from dataclasses import dataclass, fields
    >>> from cdtool.machines.dynamics import Gain
    >>> @dataclass(frozen=True)
    ... class TorqueRate:
    ...     cutoff: Gain = gain(2.0, "Hz", "cut-off frequency of the low-pass")
    >>> fields(TorqueRate)[0].default, fields(TorqueRate)[0].metadata["unit"]
    (2.0, 'Hz')
    """
    return field(default=default, metadata={"unit": unit, "meaning": meaning, "searched": searched})


def require_positive(detector: object, *names: str) -> None:
    """Check that gains are finite and above 0, for each joint.

    Parameters
    ----------
    detector : object
        The detector whose gains are checked.
    *names : str
        Names of the gains.

    Raises
    ------
    FieldsError
        A gain is not a finite number above 0; the message names it.

    Examples
    --------
    >>> from cdtool.detectors.momentum import Momentum
    >>> require_positive(Momentum(bandwidth=(80.0, 60.0)), "bandwidth")
    """
    for name in names:
        value = getattr(detector, name)
        if isinstance(value, float) and 0.0 < value < math.inf:
            continue
        numbers = np.atleast_1d(value)
        if not (numbers.size and np.all(np.isfinite(numbers) & (numbers > 0.0))):
            raise FieldsError((name,), f"is {value_in_words(value)}", "give a number above 0, or one per joint")


def per_joint(value: Gain, joints: int) -> FloatArray:
    """Return a gain as an array with one value per joint.

    Parameters
    ----------
    value : float or tuple of float
        One number for all joints, or one per joint.
    joints : int
        Number of joints J.

    Returns
    -------
    ndarray of float, shape (J,)
        The value for each joint, in the unit of the gain.

    Raises
    ------
    ConfigurationError
        A tuple has another number of values than there are joints.

    Examples
    --------
    >>> per_joint(10.0, 3).tolist()
    [10.0, 10.0, 10.0]
    >>> per_joint((80.0, 60.0), 2).tolist()
    [80.0, 60.0]
    """
    if isinstance(value, tuple) and len(value) != joints:
        many = "the whole machine" if joints == 1 else f"{joints} joints"
        raise ConfigurationError(f"a gain has {len(value)} values for {many}", "give one number, or one per joint")
    return np.full(joints, value, dtype=np.float64)


def of_joint(detector: AnyDetector, joint: int, joints: int) -> AnyDetector:
    """Return the detector with the gains of a single joint.

    Parameters
    ----------
    detector : Detector
        A detector whose gains are numbers or one number per joint.
    joint : int
        Index of the joint, from 0.
    joints : int
        Number of joints J.

    Returns
    -------
    Detector
        A copy in which every gain is one number.

    Raises
    ------
    ConfigurationError
        A gain has another number of values than there are joints.

    Examples
    --------
    >>> from cdtool.detectors.momentum import Momentum
    >>> of_joint(Momentum(bandwidth=(80.0, 60.0)), joint=1, joints=2)
    Momentum(bandwidth=60.0)
    """
    gains = {item.name: getattr(detector, item.name) for item in fields(detector)}
    numbers = {
        name: value if isinstance(value, float) else float(per_joint(value, joints)[joint])
        for name, value in gains.items()
    }
    return replace(detector, **numbers)


def single(value: Gain) -> float:
    """Return a gain that must be one number.

    Parameters
    ----------
    value : float or tuple of float
        The gain; a tuple may have one value only (see `of_joint`).

    Returns
    -------
    float
        The number, in the unit of the gain.

    Raises
    ------
    ConfigurationError
        The gain has several values.

    Examples
    --------
    >>> single((80.0,))
    80.0
    """
    return value if isinstance(value, float) else float(per_joint(value, 1)[0])


def require_channels(detector: Detector, recording: Recording, *more: str) -> None:
    """Check that a recording has the channels that a detector needs.

    Parameters
    ----------
    detector : Detector
        The detector; its `needs` are checked.
    recording : Recording
        The recording.
    *more : str
        Further channels that are needed.

    Raises
    ------
    RecordingError
        A channel is missing; the message names it and lists those that are mapped.

    Examples
    --------
    >>> from cdtool.detectors.pure_torque import PureTorque
    >>> from cdtool.recordings.recording import Recording, Series
    >>> recording = Recording("run.csv", "run.csv", ("axis",), {"torque": Series([0.0, 0.1], [5.0, 5.0], "N")})
    >>> require_channels(PureTorque(), recording)
    >>> require_channels(PureTorque(), recording, "speed")
    Traceback (most recent call last):
    cdtool.base.errors.RecordingError: run.csv: pure_torque needs the channel 'speed'...
    """
    for channel in (*detector.needs, *more):
        if channel not in recording:
            raise RecordingError(
                f"{recording.name}: {detector.name} needs the channel '{channel}'",
                f"map it in [channels] of the machine file; mapped here: {', '.join(recording.channels) or 'none'}",
                channel=channel,
            )


@dataclass(frozen=True)
class Drive:
    """Torque, position and speed (n, J) on the speed's clock, the last value held where a sample is missing.

    Attributes
    ----------
    time : ndarray of float, shape (n,)
        Times of the speed samples [s].
    torque, position, speed : ndarray of float, shape (n, J)
        Load side [N, m, m/s] or [N m, rad, rad/s]. Without coupling no position is needed: it is 0.
    torque_missing : ndarray of bool, shape (n, J)
        Where the torque has no sample.
    motion_missing : ndarray of bool, shape (n, J)
        Where the speed, or with coupled joints the position, has no sample. With coupled joints a missing motion of one
        joint counts for all, because each affects the others.
    coupled : bool
        Whether the force balances depend on the pose.
    """

    time: FloatArray
    torque: FloatArray
    position: FloatArray
    speed: FloatArray
    torque_missing: BoolArray
    motion_missing: BoolArray
    coupled: bool = False

    @cached_property
    def missing(self) -> BoolArray:
        """Where any of the three has no sample (n, J): a filter of force balances waits there."""
        return self.torque_missing | self.motion_missing


def drive_of(detector: Detector, recording: Recording, machine: Machine) -> Drive:
    """Return the inputs of a detector that uses a model of the machine.

    Parameters
    ----------
    detector : Detector
        The detector; its `needs` are checked, and for coupled joints also the position, because M, C and g depend on
        it.
    recording : Recording
        A recording on the load side.
    machine : Machine
        The model of its machine.

    Returns
    -------
    Drive
        Torque, position and speed on the speed's clock.

    Raises
    ------
    RecordingError
        A channel is missing.
    ConfigurationError
        The machine file does not give the inertia of a joint.

    Examples
    --------
    >>> from cdtool.detectors.momentum import Momentum
    >>> from cdtool.machines.linear_axis import LinearAxis
    >>> from cdtool.recordings.recording import Recording, Series
    >>> axis = LinearAxis.of({"coordinates": "load", "load_mass": 600.0})
    >>> torque, speed = Series([0.0, 0.3], [5.0, 7.0], "N"), Series([0.1, 0.2, 0.3], [0.2, 0.2, 0.2], "m/s")
    >>> drive = drive_of(Momentum(), Recording("run", "", ("axis",), {"torque": torque, "speed": speed}), axis)
    >>> drive.time.tolist(), drive.torque[:, 0].tolist()
    ([0.1, 0.2, 0.3], [5.0, 5.0, 7.0])
    """
    require_channels(detector, recording, *(("position",) if machine.coupled else ()))
    machine.require_inertia(detector.name)
    return drive_on_speed_clock(recording, machine)


def drive_on_speed_clock(recording: Recording, machine: Machine) -> Drive:
    """Return torque, position and speed on the clock of the speed.

    Parameters
    ----------
    recording : Recording
        A recording on the load side with torque and speed, and for coupled joints also position.
    machine : Machine
        The model of its machine.

    Returns
    -------
    Drive
        Each value is held until the next sample of its channel, never interpolated across a later one.

    Examples
    --------
    See `drive_of`, which also checks that everything needed is present.
    """
    speed = recording["speed"]
    torque, torque_missing = held_on(speed.time, recording["torque"])
    motion_missing = speed_missing = ~np.isfinite(speed.values)
    position: FloatArray = np.broadcast_to(0.0, torque.shape)
    if machine.coupled:
        angles = previous_value(recording["position"], speed.time)
        # A pose held for a missing sample would belong to another time than the speed.
        late = lost_samples(recording, ("position",), speed.time)
        lost = ~np.isfinite(angles) if late is None else late | ~np.isfinite(angles)
        position = hold_last(angles, lost)
        motion_missing = for_every_joint(motion_missing | lost)
    return Drive(
        speed.time,
        torque,
        position,
        hold_last(speed.values, speed_missing),
        torque_missing,
        motion_missing,
        machine.coupled,
    )


def held_on(clock: FloatArray, series: Series) -> tuple[FloatArray, BoolArray]:
    """Return a channel on another clock, the last value held where a sample is missing.

    Parameters
    ----------
    clock : ndarray of float, shape (n,)
        Increasing times [s].
    series : Series
        The channel.

    Returns
    -------
    held : ndarray of float, shape (n, J)
        The values at these times, in the unit of the channel; 0 before the first one.
    missing : ndarray of bool, shape (n, J)
        Where the channel has no sample, or one that is too old (see `cdtool.recordings.clock.previous_value`).

    Examples
    --------
    >>> import numpy as np
    >>> from cdtool.recordings.recording import Series
    >>> torque = Series([0.1, 0.2, 0.3], [5.0, np.nan, 7.0], "N")
    >>> held, missing = held_on(np.array([0.0, 0.15, 0.25, 0.35]), torque)
    >>> held[:, 0].tolist(), missing[:, 0].tolist()
    ([0.0, 5.0, 5.0, 7.0], [True, False, True, False])
    """
    values = previous_value(series, clock)
    missing: BoolArray = ~np.isfinite(values)
    return hold_last(values, missing), missing


def for_every_joint(missing: BoolArray) -> BoolArray:
    """Mark all joints of a sample that is missing for one of them.

    Parameters
    ----------
    missing : ndarray of bool, shape (n, J)
        Where each joint has no sample.

    Returns
    -------
    ndarray of bool, shape (n, J)
        True for all joints wherever it is True for one. If no sample is missing, it is `missing` itself, not a copy.

    Examples
    --------
    >>> import numpy as np
    >>> for_every_joint(np.array([[False, True], [False, False]])).tolist()
    [[True, True], [False, False]]
    """
    if not missing.any():
        return missing
    return np.repeat(np.any(missing, axis=1, keepdims=True), missing.shape[1], axis=1)


def observe_momentum(
    drive: Drive, net_force: FloatArray, momentum: FloatArray, bandwidth: Gain, ready: FloatArray
) -> tuple[FloatArray, StatusArray]:
    """Return residual and status of the generalised momentum observer, joint by joint.

    Parameters
    ----------
    drive : Drive
        Times [s], and where samples are missing.
    net_force : ndarray of float, shape (n, J)
        What changes the momentum, tau - beta [N, N m].
    momentum : ndarray of float, shape (n, J)
        p = M(q) v [N s, N m s]. It is overwritten: the result is stored in it, because on long logs a new array costs
        as much as the filter.
    bandwidth : float or tuple of float
        Observer gain K [rad/s].
    ready : ndarray of float, shape (J,)
        Time [s] before which the residual is marked as start-up.

    Returns
    -------
    residual : ndarray of float, shape (n, J)
        Estimate of tau_c [N, N m].
    status : ndarray of uint8, shape (n, J)
        A `Status` for each value.

    Raises
    ------
    ConfigurationError
        The number of gains is not that of the joints.

    Notes
    -----
    Thesis 2.18 and 2.19 in the corrected form (docs/errata.md): d(phat)/dt = tau - beta - res, res = K (phat - p), with
    phat(0) = p(0). Sampled with the measured step T_k:

        res_k = a res_{k-1} + (1 - a) (mean net force - (p_k - p_{k-1}) / T_k),   a = exp(-K T_k)

    This is exact for a net force and a contact that are constant between samples. It starts with the first complete
    sample. Over missing ones the observer waits, and the next step is longer: if only the speed of an uncoupled joint
    is missing, the impulse of the force is accumulated; if its torque is missing too, or any input of coupled joints,
    the force is interpolated by a straight line. After a gap longer than 3/K and 0.15 s it restarts. For 3/K after each
    start the status is start-up.

    Examples
    --------
    A mass at rest that is pushed against an obstacle by 30 N: after 1/K the residual is 63 % of it.

    >>> import numpy as np
    >>> time = np.arange(2001) * 1e-3
    >>> no, still = np.zeros((2001, 1), dtype=bool), np.zeros((2001, 1))
    >>> push = np.where(time >= 1.0, 30.0, 0.0)[:, np.newaxis]
    >>> drive = Drive(time, push, still, still, no, no)
    >>> residual, status = observe_momentum(drive, push, still.copy(), 10.0, np.array([-np.inf]))
    >>> residual[[1000, 1100, 2000], 0].round(1).tolist()
    [0.1, 19.0, 30.0]
    """
    residual = momentum
    status = np.empty(net_force.shape, dtype=np.uint8)
    gains = per_joint(bandwidth, net_force.shape[1])
    for j in range(net_force.shape[1]):
        _observe(
            drive.time,
            np.ascontiguousarray(net_force[:, j]),
            np.ascontiguousarray(momentum[:, j]),
            np.ascontiguousarray(drive.missing[:, j]),
            np.ascontiguousarray(drive.torque_missing[:, j]),
            drive.coupled,
            gains[j],
            ready[j],
            residual[:, j],
            status[:, j],
        )
    return residual, status


@kernel(
    "void(Array(float64, 1, 'C', readonly=True), float64[::1], float64[::1], b1[::1], b1[::1], b1, "
    "float64, float64, float64[:], uint8[:])"
)
def _observe(  # noqa: PLR0913  a kernel takes arrays and scalars one by one
    time: FloatArray,
    net_force: FloatArray,
    momentum: FloatArray,
    missing: BoolArray,
    torque_missing: BoolArray,
    coupled: bool,
    bandwidth: float,
    ready: float,
    residual: FloatArray,
    status: StatusArray,
) -> None:
    settle = 3.0 / bandwidth
    longest_gap = max(settle, BRIDGED)
    started = False
    bridged = False
    force_before = 0.0
    value = 0.0
    impulse = 0.0
    elapsed = 0.0
    last_momentum = 0.0
    for k in range(len(time)):
        if started:
            step = time[k] - time[k - 1]
            impulse += 0.5 * (net_force[k] + net_force[k - 1]) * step
            elapsed += step
        if missing[k]:
            # p or its rate is unknown: the residual waits for the next complete sample.
            bridged = bridged or coupled or torque_missing[k]
            residual[k] = value
            status[k] = Status.GAP
            continue
        if bridged:
            impulse = 0.5 * (net_force[k] + force_before) * elapsed
            bridged = False
        if not started:
            started = True
            ready = max(ready, time[k] + settle)
        elif elapsed > longest_gap:
            value = 0.0
            ready = time[k] + settle
        else:
            x = bandwidth * elapsed
            if x < 0.02:
                # 1 - exp(-x) to 1e-14 of it: a call of expm1 makes the whole filter take 1.4 times as long.
                tail = 1.0 / 24.0 - x * (1.0 / 120.0 - x * (1.0 / 720.0))
                weight = x * (1.0 - x * (0.5 - x * (1.0 / 6.0 - x * tail)))
            else:
                weight = 1.0 - math.exp(-x)
            value += weight * ((impulse - (momentum[k] - last_momentum)) / elapsed - value)
        last_momentum = momentum[k]
        force_before = net_force[k]
        impulse = 0.0
        elapsed = 0.0
        residual[k] = value
        status[k] = Status.START_UP if time[k] < ready else Status.VALID
