"""Which sensor responds first to an impact, and at which force: figure 4.10 of the thesis, computed for one machine.

Conventions: the machine moves at steady speed under speed control and touches the obstacle at time 0. A sensor
measures the deviation from the steady motion; it has responded when that exceeds k sigma of its noise and its
resolution. The machine's own scatter (friction along the path, ripple) counts only if it is included in the noise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import UsageError, nearest
from cdtool.impact.checks import require_positive
from cdtool.impact.contact_laws.hunt_crossley import HuntCrossley
from cdtool.impact.drives import SpeedController
from cdtool.impact.rigidity import Rigidity, rigidity
from cdtool.impact.sensors import QUANTITIES, Sensor
from cdtool.impact.transmissions.transmission import ElasticTransmission
from cdtool.impact.transmissions.transmission_simulation import SimulatedMotion, Start, simulate_impact

# A change that saves less than this share of the time is not a remedy.
_WORTH = 0.02
ITSELF = "the impact itself"


@dataclass(frozen=True)
class ImpactCase:
    """A machine that hits an obstacle at steady `speed` [m/s]; observed for `window` [s] from the touch.

    The controller's reference is speed/r, in place of its own. Raises UsageError for values outside their range.
    """

    transmission: ElasticTransmission
    controller: SpeedController
    obstacle: HuntCrossley
    speed: float
    window: float = 0.5

    def __post_init__(self) -> None:
        require_positive("speed", self.speed, "m/s")
        require_positive("window", self.window, "s")
        if self.obstacle.exponent != 1.0:
            raise UsageError(
                f"the obstacle's exponent is {self.obstacle.exponent:g}", "a ranking takes a linear one: 1"
            )

    def simulate(self) -> SimulatedMotion:
        """The impact, simulated from the touch on."""
        reference = self.speed / self.transmission.ratio
        controller = replace(self.controller, reference=reference)
        return simulate_impact(
            self.transmission,
            controller,
            self.obstacle,
            Start(gap=0.0, load_speed=self.speed),
            duration=self.window,
            samples=10_000,  # 50 us of the usual window, as fine as sensors are sampled
        )


@dataclass(frozen=True)
class SensorResponse:
    """When a sensor responds to the impact [s], the contact force at that time [N], and what would help most.

    `peak_so_far` is the largest force up to that time [N]: on a load that has bounced off there may be no force then.
    `time`, `force` and `peak_so_far` are None if it does not respond within the window. `limited_by` is the one of its
    causes whose improvement by a factor of two saves the most, `saving` [s]; `remedy` names the improvement. If none
    of them saves 2 %, it is the impact itself.
    """

    sensor: Sensor
    threshold: float
    time: float | None
    force: float | None
    peak_so_far: float | None
    limited_by: str
    remedy: str
    saving: float | None


@dataclass(frozen=True)
class Ranking:
    """The sensors in the order in which they respond; those that do not respond come last.

    `time` (n,) and `contact_force` (n,) are those of the impact [s, N]; `factor` is the k of k sigma;
    `swing_duration` is how long the force's first swing lasts [s]: see `_swing_duration`.
    """

    case: ImpactCase
    factor: float
    responses: tuple[SensorResponse, ...]
    time: FloatArray
    contact_force: FloatArray
    swing_duration: float
    rigidity: Rigidity

    @property
    def peak_force(self) -> float:
        """The largest contact force within the window [N]."""
        return float(np.max(self.contact_force))

    @property
    def peak_time(self) -> float:
        """When that is [s]."""
        return float(self.time[int(np.argmax(self.contact_force))])


def rank_sensors(case: ImpactCase, sensors: Sequence[Sensor], factor: float = 5.0) -> Ranking:
    """Simulate the impact and return when each sensor exceeds `factor` sigma of its noise and its resolution.

    Times are for the least favourable sampling instants. Raises UsageError for an unknown quantity and k <= 0.
    """
    require_positive("k", factor)
    for sensor in sensors:
        if sensor.quantity not in QUANTITIES:
            raise UsageError(f"a sensor of '{sensor.quantity}'", nearest(sensor.quantity, QUANTITIES))
    motion = case.simulate()
    shown = deviations(case, motion)
    stronger = {cause: deviations(other, other.simulate()) for cause, other in _stronger_machines(case).items()}
    responses = [_response(sensor, factor, motion, shown, stronger) for sensor in sensors]
    order = sorted(responses, key=lambda item: np.inf if item.time is None else item.time)
    rigid = rigidity(case.transmission, case.obstacle.stiffness)
    return Ranking(case, factor, tuple(order), motion.time, motion.force, _swing_duration(motion), rigid)


def _swing_duration(motion: SimulatedMotion) -> float:
    """The first contact [s], or twice the rise to its first peak where a drive that pushes on makes it last."""
    falls = np.flatnonzero(np.diff(motion.force) < 0.0)
    duration = motion.contacts[0].duration
    return duration if not len(falls) else min(duration, 2.0 * float(motion.time[falls[0]]))


def deviations(case: ImpactCase, motion: SimulatedMotion) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Time (n,) and deviation (n,) from the steady motion, by quantity; on the load side."""
    transmission = case.transmission
    steady_drive = transmission.load_friction * case.speed
    steady_motor = transmission.steady_torque(case.speed) / transmission.ratio
    position = motion.motor_position - motion.motor_position[0]
    values = {
        "contact_force": motion.force,
        "drive_force": motion.drive_force - steady_drive,
        "load_acceleration": motion.load_acceleration,
        "motor_position": position * transmission.ratio - case.speed * motion.time,
        "motor_force": motion.motor_torque / transmission.ratio - steady_motor,
    }
    return {name: (motion.time, course) for name, course in values.items()}


def _stronger_machines(case: ImpactCase) -> dict[tuple[str, str], ImpactCase]:
    """The case with one part of the machine twice as good, by (cause, remedy)."""
    transmission, controller = case.transmission, case.controller
    stiffer = replace(transmission, stiffness=2.0 * transmission.stiffness)
    gains = (controller.proportional, controller.integral, controller.derivative)
    proportional, integral, derivative = (2.0 * gain for gain in gains)
    quicker = replace(controller, proportional=proportional, integral=integral, derivative=derivative)
    found = {
        ("elastic drive", "twice the stiffness"): replace(case, transmission=stiffer),
        ("speed controller", "twice the gains"): replace(case, controller=quicker),
    }
    if np.isfinite(controller.slew_limit):
        steeper = replace(controller, slew_limit=2.0 * controller.slew_limit)
        found["slew limit", "twice the slope"] = replace(case, controller=steeper)
    return found


def _response(
    sensor: Sensor,
    factor: float,
    motion: SimulatedMotion,
    shown: Mapping[str, tuple[FloatArray, FloatArray]],
    stronger: Mapping[tuple[str, str], Mapping[str, tuple[FloatArray, FloatArray]]],
) -> SensorResponse:
    time = sensor.time_to_see(*shown[sensor.quantity], factor)
    better = {
        ("noise", "half the noise"): sensor.half_the_noise(),
        ("resolution", "twice the counts"): sensor.half_the_step(),
        ("low-pass", "twice the bandwidth"): sensor.twice_the_bandwidth(),
        ("sampling", "twice the rate"): sensor.twice_the_rate(),
    }
    times = {cause: other.time_to_see(*shown[sensor.quantity], factor) for cause, other in better.items()}
    times |= {cause: sensor.time_to_see(*other[sensor.quantity], factor) for cause, other in stronger.items()}
    window = float(motion.time[-1])
    known = {cause: window if value is None else value for cause, value in times.items()}
    cause = min(known, key=lambda item: known[item])
    saving = (window if time is None else time) - known[cause]
    force = peak = None
    if time is not None:
        force = float(np.interp(time, motion.time, motion.force))
        peak = max(force, float(np.max(motion.force[motion.time <= time])))
    threshold = sensor.threshold(factor)
    if saving <= _WORTH * (window if time is None else time):
        return SensorResponse(sensor, threshold, time, force, peak, ITSELF, "", None)
    # Without a response the time saved by a remedy is unknown.
    return SensorResponse(sensor, threshold, time, force, peak, *cause, None if time is None else saving)
