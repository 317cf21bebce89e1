"""What every detector is, and what several share: gains with units, held samples, the momentum observer's recursion."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, TypeVar

import numpy as np

from cdtool.clock import previous_value
from cdtool.clock.lost import lost_samples
from cdtool.detection import Signal, Status, StatusArray
from cdtool.dynamics import Gain, Machine
from cdtool.errors import ConfigurationError, RecordingError
from cdtool.kernels import kernel
from cdtool.recording import BoolArray, FloatArray, Recording

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


# A filter goes on over a gap up to this long [s] even where its memory is shorter: no start-up behind it.
BRIDGED = 0.15

AnyDetector = TypeVar("AnyDetector", bound="DataclassInstance")


class Detector(Protocol):
    """The contract: a frozen dataclass of gains, the channels it needs, a unit, and `signal(recording, machine)`.

    `signal` is causal: its output up to sample k does not change when the samples after k do. It never reads the load
    cell or a label.
    """

    name: ClassVar[str]
    short_name: ClassVar[str]
    title: ClassVar[str]
    needs: ClassVar[tuple[str, ...]]
    signed: ClassVar[bool]

    def unit(self, machine: Machine) -> str:
        """Unit of the signal for that machine."""
        ...

    def signal(self, recording: Recording, machine: Machine) -> Signal:
        """The collision detection signal of a recording on the load side; raises RecordingError."""
        ...


def gain(default: float, unit: str, meaning: str) -> Any:
    """A gain of a detector: its default, unit and meaning stand here and nowhere else."""
    return field(default=default, metadata={"unit": unit, "meaning": meaning})


def require_positive(detector: object, *names: str) -> None:
    """Raise ConfigurationError, naming the gain, where one is not a finite number above zero, or one a joint."""
    for name in names:
        value = getattr(detector, name)
        numbers = np.atleast_1d(value)
        if not (numbers.size and np.all(np.isfinite(numbers) & (numbers > 0.0))):
            raise ConfigurationError(f"gain {name} is {value}", "a number above 0 is needed, or one a joint")


def per_joint(value: Gain, joints: int) -> FloatArray:
    """(J,): one number for all joints, or each joint's own; raises ConfigurationError where their number is another."""
    if isinstance(value, tuple) and len(value) != joints:
        many = "the whole machine" if joints == 1 else f"{joints} joints"
        raise ConfigurationError(f"a gain has {len(value)} values for {many}", "give one number, or one a joint")
    return np.array(np.broadcast_to(value, joints), dtype=np.float64)


def of_joint(detector: AnyDetector, joint: int, joints: int) -> AnyDetector:
    """The detector with the gains of one joint alone; raises ConfigurationError as `per_joint` does."""
    gains = {item.name: getattr(detector, item.name) for item in fields(detector)}
    return replace(detector, **{name: float(per_joint(value, joints)[joint]) for name, value in gains.items()})


def single(value: Gain) -> float:
    """A gain that is one number; raises ConfigurationError where it has one a joint (see `of_joint`)."""
    return float(per_joint(value, 1)[0])


def require_channels(detector: Detector, recording: Recording, *more: str) -> None:
    """Raise RecordingError, naming the channel, where one that the detector needs (or one of `more`) is absent."""
    for channel in (*detector.needs, *more):
        if channel not in recording:
            raise RecordingError(
                f"{recording.name}: {detector.name} needs the channel '{channel}'",
                f"map it in [channels] of the machine file; mapped here: {', '.join(recording.channels) or 'none'}",
                channel=channel,
            )


@dataclass(frozen=True)
class Drive:
    """Torque, position and speed (n, J) on the speed's clock, with the last value held where one is missing.

    `missing` (n, J) tells where anything has no sample; `speed_missing` where the motion is not known. Of a coupled
    machine all joints' motion is missing where one joint's is, since each feels the others. A machine that is not
    coupled needs no position: it is 0 there. `coupled`: the balances depend on the pose.
    """

    time: FloatArray
    torque: FloatArray
    position: FloatArray
    speed: FloatArray
    missing: BoolArray
    speed_missing: BoolArray
    coupled: bool = False

    @property
    def interrupted(self) -> BoolArray:
        """(n, J): where a filter of balances waits: the motion is missing, or a torque that there was before."""
        return self.speed_missing | (self.missing & (np.cumsum(~self.missing, axis=0) > 0))


def drive_of(detector: Detector, recording: Recording, machine: Machine) -> Drive:
    """What a detector with a model starts from; raises RecordingError or ConfigurationError where something is lacking.

    Of a coupled machine the position is needed too: M, C and g depend on the pose.
    """
    require_channels(detector, recording, *(("position",) if machine.coupled else ()))
    machine.require_inertia(detector.name)
    return drive_on_speed_clock(recording, machine)


def drive_on_speed_clock(recording: Recording, machine: Machine) -> Drive:
    """Everything by previous value on the clock of the speed: held between its samples, never interpolated."""
    speed = recording["speed"]
    torque = previous_value(recording["torque"], speed.time)
    torque_missing = ~np.isfinite(torque)
    motion_missing = ~np.isfinite(speed.values)
    position: FloatArray = np.broadcast_to(0.0, torque.shape)
    if machine.coupled:
        angles = previous_value(recording["position"], speed.time)
        # A pose that is held for a sample that did not come would be one of another instant than the speed.
        late = lost_samples(recording, ("position",), speed.time)
        lost = ~np.isfinite(angles) if late is None else late | ~np.isfinite(angles)
        position = hold_last(angles, lost)
        motion_missing = for_every_joint(motion_missing | lost)
    return Drive(
        speed.time,
        hold_last(torque, torque_missing),
        position,
        hold_last(speed.values, ~np.isfinite(speed.values)),
        torque_missing | motion_missing,
        motion_missing,
        machine.coupled,
    )


def for_every_joint(missing: BoolArray) -> BoolArray:
    """(n, J): True for all joints of a sample where it is for one."""
    return np.repeat(np.any(missing, axis=1, keepdims=True), missing.shape[1], axis=1)


def hold_last(values: FloatArray, missing: BoolArray) -> FloatArray:
    """The last present value held where one is missing (0 before the first)."""
    if not missing.any():
        return values
    rows = np.where(missing, -1, np.arange(len(values))[:, np.newaxis])
    last = np.maximum.accumulate(rows, axis=0)
    held = np.take_along_axis(values, np.maximum(last, 0), axis=0)
    result: FloatArray = np.where(last < 0, 0.0, held)
    return result


def observe_momentum(
    drive: Drive, net_force: FloatArray, momentum: FloatArray, bandwidth: Gain, ready: FloatArray
) -> tuple[FloatArray, StatusArray]:
    """Residual and status (n, J) of the generalized momentum observer (thesis 2.18-2.19 corrected).

    res_k = a res_{k-1} + (1 - a) (mean net force - (p_k - p_{k-1}) / T_k), a = exp(-K T_k): exact for a piecewise
    constant force and any T_k. Over missing samples it waits: the next step is longer. Where only the speed is missing
    the force goes on; where the torque is, or the pose of coupled joints, a straight line stands for it. It restarts
    behind a gap longer than 3/K and 0.15 s. `ready` (J,) is the time from which the residual may be judged. `momentum`
    is used up: the residual is written over it, since on long logs fresh memory costs as much as the filter.
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
            np.ascontiguousarray(drive.speed_missing[:, j]),
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
    speed_missing: BoolArray,
    coupled: bool,
    bandwidth: float,
    ready: float,
    residual: FloatArray,
    status: StatusArray,
) -> None:
    settle = 3.0 / bandwidth
    longest_gap = max(settle, BRIDGED)
    started = False
    seen = False
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
        seen = seen or not missing[k]
        if speed_missing[k] or (missing[k] and seen):
            # p or its rate is unknown: the residual waits for the next whole sample.
            bridged = bridged or coupled or not speed_missing[k]
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
                # 1 - exp(-x) to the last bit, without the call of exp.
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
        if missing[k]:
            status[k] = Status.GAP
        elif time[k] < ready:
            status[k] = Status.START_UP
        else:
            status[k] = Status.VALID
