"""An impact of a driven load, simulated: before, during and between its contacts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import UsageError
from cdtool.impact.checks import require_positive
from cdtool.impact.contact_laws.base import ContactLaw
from cdtool.impact.drives import Drive
from cdtool.impact.effort import bounded
from cdtool.impact.transmissions.transmission import Transmission

# More is a load that chatters: its contacts become ever shorter, without an end.
_MOST_CONTACTS = 200
# A contact may be far shorter than the time between two samples of the whole.
_SAMPLES_PER_CONTACT = 1000
_SETTINGS: dict[str, Any] = {"method": "DOP853", "rtol": 1e-9, "atol": 1e-13, "dense_output": True}


@dataclass(frozen=True)
class SimulatedContact:
    """One contact: when it begins and how long it lasts [s], speeds [m/s], peaks [N, m], and the energy lost.

    `energy_loss` = 1 - (v_f/v_i)^2 of the load's speed; `contact_loss` is the work on the obstacle over the energy at
    the touch: the rest is lost in friction, motor and transmission. A contact that does not end within the simulation
    is `lasting`: its duration reaches to the end of it, and its losses are those up to there.
    """

    start: float
    duration: float
    lasting: bool
    approach_speed: float
    final_speed: float
    peak_force: float
    max_penetration: float
    contact_loss: float

    @property
    def energy_loss(self) -> float:
        """The share of the load's kinetic energy at the touch that is lost at the end of the contact."""
        return 1.0 - (self.final_speed / self.approach_speed) ** 2


@dataclass(frozen=True)
class SimulatedMotion:
    """Motion and force (n,) over strictly increasing `time` [s], and the contacts.

    `penetration` x_l - x_o [m] (negative before the touch), `load_speed` [m/s], `load_acceleration` [m/s2], `force` F_c
    [N], `motor_position` relative to the obstacle [rad], `motor_speed` [rad/s], `motor_torque` [N m], and
    `drive_force`, that of an elastic transmission on the load [N]; NaN where the transmission is rigid.
    """

    time: FloatArray
    penetration: FloatArray
    load_speed: FloatArray
    load_acceleration: FloatArray
    force: FloatArray
    motor_position: FloatArray
    motor_speed: FloatArray
    motor_torque: FloatArray
    drive_force: FloatArray
    contacts: tuple[SimulatedContact, ...]


@dataclass(frozen=True)
class Start:
    """The state in which a simulated impact starts.

    `gap` [m]: distance of the load from the obstacle; negative: the load already presses into it. `load_speed` [m/s].
    `motor_speed` [rad/s]: only with an elastic transmission; None: as the load.
    """

    gap: float
    load_speed: float = 0.0
    motor_speed: float | None = None


def simulate_impact(
    transmission: Transmission, drive: Drive, law: ContactLaw, start: Start, *, duration: float, samples: int = 2000
) -> SimulatedMotion:
    """Solve 4.20, or 4.21 and 4.23 (corrected), from `start` on.

    There are at least `samples` samples over `duration` [s], and a thousand more per contact. Events find touch
    and separation, relative tolerance 1e-9. Raises UsageError for values without meaning, for a law with a memory,
    where the contacts never end (a law that loses nothing against a steady push), and where the motion is far quicker
    than the duration.
    """
    require_positive("duration", duration, "s")
    require_positive("samples", samples)
    if getattr(law, "permanent_indentation", 0.0):
        raise UsageError("the contact law leaves a dent", "its memory is followed by cdtool.impact.collision only")
    solver = _Solver(transmission, drive, law, duration)
    steady = transmission.steady_torque(start.load_speed)
    state = [*transmission.start(-start.gap, start.load_speed, start.motor_speed), *drive.start(steady), 0.0]
    touching = start.gap < 0.0 or (start.gap == 0.0 and start.load_speed > 0.0)
    time, parts, contacts = 0.0, [], []
    while time < duration:
        part = solver.until_crossing(time, state, -1.0 if touching else +1.0)
        end, state = float(part.t[-1]), [float(value) for value in part.y[:, -1]]
        count = max(2, int(np.ceil(samples * (end - time) / duration)), _SAMPLES_PER_CONTACT if touching else 2)
        times = np.linspace(time, end, count)
        states = part.sol(times)
        if touching:
            contacts.append(_contact(transmission, law, times, states, lasting=part.status == 0))
        if len(contacts) > _MOST_CONTACTS:
            raise UsageError(
                f"more than {_MOST_CONTACTS} contacts in {time:g} s", "a shorter duration, or more damping"
            )
        parts.append((times, states))
        if part.status == 1:
            state[0] = 0.0
        time, touching = end, not touching
    return _motion(transmission, drive, law, parts, tuple(contacts))


class _Solver:
    """The equations of motion; the last item of the state is the work done on the obstacle [J]."""

    def __init__(self, transmission: Transmission, drive: Drive, law: ContactLaw, duration: float) -> None:
        self.transmission, self.drive, self.law, self.duration = transmission, drive, law, duration
        # Between events the step is bounded: a load that swings into the obstacle and out again is not stepped over.
        self.longest_step = min(transmission.swing_period / 20.0, duration)
        self.motion = bounded(self.rates)

    def rates(self, _: float, now: FloatArray) -> list[float]:
        transmission, drive = self.transmission, self.drive
        state: list[float] = now.tolist()
        force = contact_force(self.law, state[0], state[1])
        torque = drive.torque_of(state[:-1])
        moving = transmission.rates(state, torque, force)
        _, speed = transmission.motor(state)
        return [*moving, *drive.rates(state[:-1], speed), force * state[1]]

    def until_crossing(self, start: float, state: list[float], direction: float) -> Any:
        """Integrate until the penetration crosses zero, upward (+1) or downward (-1), or the end."""
        from scipy.integrate import solve_ivp

        def crosses(_: float, now: FloatArray) -> float:
            return float(now[0])

        crosses.terminal, crosses.direction = True, direction  # type: ignore[attr-defined]
        span = (start, self.duration)
        return solve_ivp(self.motion, span, state, events=crosses, max_step=self.longest_step, **_SETTINGS)


def contact_force(law: ContactLaw, penetration: float, rate: float) -> float:
    """F_c [N] of a law, 0 without contact; 4.2 with its clamp, so that it never pulls."""
    return max(0.0, float(law.force(penetration, rate))) if penetration > 0.0 else 0.0


def _forces(law: ContactLaw, states: FloatArray) -> FloatArray:
    touching = states[0] > 0.0
    pushed = np.maximum(law.force(np.maximum(states[0], 0.0), states[1]), 0.0)
    return np.asarray(np.where(touching, pushed, 0.0), dtype=np.float64)


def _contact(
    transmission: Transmission, law: ContactLaw, times: FloatArray, states: FloatArray, *, lasting: bool
) -> SimulatedContact:
    approach = float(states[1, 0])
    energy = 0.5 * transmission.moving_mass * approach**2
    return SimulatedContact(
        start=float(times[0]),
        duration=float(times[-1] - times[0]),
        lasting=lasting,
        approach_speed=approach,
        final_speed=float(states[1, -1]),
        peak_force=float(np.max(_forces(law, states))),
        max_penetration=float(np.max(states[0])),
        contact_loss=float(states[-1, -1] - states[-1, 0]) / energy if energy else 0.0,
    )


def _motion(
    transmission: Transmission,
    drive: Drive,
    law: ContactLaw,
    parts: list[tuple[FloatArray, FloatArray]],
    contacts: tuple[SimulatedContact, ...],
) -> SimulatedMotion:
    # The first sample of a part is the last one of the part before.
    kept = [(times, states) if i == 0 else (times[1:], states[:, 1:]) for i, (times, states) in enumerate(parts)]
    time = np.concatenate([times for times, _ in kept])
    states = np.concatenate([values for _, values in kept], axis=1)
    force = _forces(law, states)
    torque = np.broadcast_to(drive.torque_of(states[:-1]), time.shape).copy()
    position, speed = transmission.motor(states)
    return SimulatedMotion(
        time=time,
        penetration=states[0],
        load_speed=states[1],
        load_acceleration=np.asarray(transmission.rates(states, torque, force)[1]),
        force=force,
        motor_position=position,
        motor_speed=speed,
        motor_torque=torque,
        drive_force=transmission.drive_force(states),
        contacts=contacts,
    )
