"""Collisions of two bodies, integrated with any contact law.

Equations (thesis 3.12 added to the motion, 3.2.2): d(delta)/dt = V_1 - V_2, M_1 dV_1/dt = push - friction V_1 - F,
M_2 dV_2/dt = F. Impulse, contact work and friction loss are integrated along, so that they are as exact as the motion.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import UsageError
from cdtool.impact.bodies import Bodies
from cdtool.impact.checks import require_positive
from cdtool.impact.contact_laws.base import ContactLaw, KeepsIndentation, StoresEnergy
from cdtool.impact.effort import bounded
from cdtool.impact.impact import Collision, Impact

# The state: penetration, V_1, V_2, impulse, contact work, friction loss.
_DEPTH, _SPEED_1, _SPEED_2, _IMPULSE, _WORK, _FRICTION = range(6)
# Samples of compression and of restitution; the moment between both is a sample.
_SAMPLES = 501
# The range in which the scale of a contact is sought [m]: from far below an atom to a kilometre.
_DEPTHS: FloatArray = np.geomspace(1e-13, 1e3, 1601)
# A rebound slower than this share of the approach is rest.
_AT_REST = 1e-9


@dataclass(frozen=True)
class _Stretch:
    """A part of a contact with one law: its solution, its end, and which event ended it (None: the time limit)."""

    law: ContactLaw
    solution: Callable[[Any], FloatArray]
    start: float
    end: float
    event: int | None

    def forces(self, times: FloatArray) -> FloatArray:
        """Force [N] at times (n,)."""
        states = self.solution(times)
        return np.asarray(self.law.force(states[_DEPTH], states[_SPEED_1] - states[_SPEED_2]), dtype=np.float64)


def collide(law: ContactLaw, bodies: Bodies, contacts: int = 1, longest: float | None = None) -> Collision:
    """Simulate the impact of two bodies with a contact law: at most `contacts` contacts, each at most `longest` [s].

    Integrated by Dormand and Prince's method of order 8 with a relative tolerance of 1e-10. Later contacts come only
    where a push brings the bodies together again; the surface has then come back, but for a permanent indentation. A
    contact that passes a least penetration without a separation lasts: less and less energy is in it, and the series
    stops. `longest` is a hundred times the duration without damping, unless it is given.
    Raises UsageError for a law without force, for numbers outside their range, and if the damping is so large that the
    motion lasts thousands of times as long as its quickest part.
    """
    if contacts < 1:
        raise UsageError(f"{contacts} contacts", "1 or more")
    if longest is not None:
        require_positive("the longest duration", longest, "s")
    impacts: list[Impact] = []
    time = 0.0
    while True:
        stretches = _contact(law, bodies, time, longest)
        impact = _impact(stretches, bodies)
        impacts.append(impact)
        if len(impacts) == contacts or not impact.separated:
            break
        speed_1, speed_2 = (float(speed) for speed in stretches[-1].solution(stretches[-1].end)[[_SPEED_1, _SPEED_2]])
        flight = bodies.flight(speed_1, speed_2)
        if flight is None:
            break
        law, time = stretches[-1].law, stretches[-1].end + flight[0]
        bodies = replace(bodies, speed_1=flight[1], speed_2=speed_2)
    return Collision(tuple(impacts))


def _contact(law: ContactLaw, bodies: Bodies, time: float, longest: float | None) -> list[_Stretch]:
    """Return compression, and restitution if compression ends: two phases, because some laws change between them."""
    depth, scale = _scales(law, bodies)
    patience = 100.0 * scale if longest is None else longest  # no contact of these laws lasts so long
    mass, speed = bodies.effective_mass, bodies.approach_speed
    energy = mass * speed**2
    size = np.array([depth, speed, speed, mass * speed, energy, energy])
    begin = np.array([_surface(law), bodies.speed_1, bodies.speed_2, 0.0, 0.0, 0.0])
    compression = _stretch(law, bodies, begin, size, (time, time + patience), _turns)
    if compression.event is None:
        return [compression]
    at = compression.solution(compression.end)
    law = law.pressed_to(float(at[_DEPTH])) if isinstance(law, KeepsIndentation) else law
    surface = _surface(law)
    if at[_DEPTH] <= surface:
        return [compression, _Stretch(law, compression.solution, compression.end, compression.end, 0)]

    def parts(_: float, state: FloatArray) -> float:
        return float(state[_DEPTH] - surface)

    until = (compression.end, time + patience)
    return [compression, _stretch(law, bodies, at, size, until, parts, _turns)]


def _stretch(
    law: ContactLaw,
    bodies: Bodies,
    begin: FloatArray,
    size: FloatArray,
    span: tuple[float, float],
    falling: Callable[[float, FloatArray], float],
    rising: Callable[[float, FloatArray], float] | None = None,
) -> _Stretch:
    """Return the motion until `falling` passes 0 downward (event 0), `rising` upward (event 1), or the span ends."""
    from scipy.integrate import solve_ivp

    mass, heavy = bodies.effective_mass, bodies.mass_1

    def motion(_: float, state: FloatArray) -> list[float]:
        depth, speed_1, speed_2 = state[_DEPTH], state[_SPEED_1], state[_SPEED_2]
        rate = speed_1 - speed_2
        force = float(law.force(depth, rate))
        drag = bodies.friction * speed_1
        outer = bodies.push - drag
        return [rate, (outer - force) / heavy, force / bodies.mass_2, force, force * rate, mass / heavy * drag * rate]

    events = [_event(falling, -1.0)] + ([] if rising is None else [_event(rising, 1.0)])
    found: Any = solve_ivp(
        bounded(motion), span, begin, "DOP853", events=events, dense_output=True, rtol=1e-10, atol=1e-13 * size
    )
    met = next((i for i, times in enumerate(found.t_events) if len(times)), None)
    return _Stretch(law, found.sol, span[0], float(found.t[-1]), met)


def _event(function: Callable[[float, FloatArray], float], direction: float) -> Any:
    def event(time: float, state: FloatArray) -> float:
        return function(time, state)

    event.terminal, event.direction = True, direction  # type: ignore[attr-defined]
    return event


def _turns(_: float, state: FloatArray) -> float:
    return float(state[_SPEED_1] - state[_SPEED_2])


def _surface(law: ContactLaw) -> float:
    return law.surface if isinstance(law, KeepsIndentation) else 0.0


def _scales(law: ContactLaw, bodies: Bodies) -> tuple[float, float]:
    """Return penetration [m] and duration [s] of the contact without damping, roughly: the scale of the step sizes."""
    depths = _surface(law) + _DEPTHS
    force = np.asarray(law.force(depths, np.zeros_like(depths)), dtype=np.float64)
    work = np.concatenate(([0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(depths))))
    energy = 0.5 * bodies.effective_mass * bodies.approach_speed**2 + bodies.push * _DEPTHS
    stopped = np.flatnonzero(work >= energy)
    if not len(stopped):
        raise UsageError("the contact law does not stop the bodies within a kilometre", "give it a larger stiffness")
    depth = float(_DEPTHS[stopped[0]])
    return depth, 3.0 * depth / bodies.approach_speed


def _impact(stretches: list[_Stretch], bodies: Bodies) -> Impact:
    """Return a contact as a function of time, from its phases; it ends when the force ends."""
    first, last = stretches[0], stretches[-1]
    end = _force_ends(last)
    times = np.linspace(first.start, first.end, _SAMPLES)
    states, forces = first.solution(times), first.forces(times)
    if len(stretches) > 1 and end > last.start:
        later = np.linspace(last.start, end, _SAMPLES)[1:]
        times, forces = np.append(times, later), np.append(forces, last.forces(later))
        states = np.append(states, last.solution(later), axis=1)
    turn = _SAMPLES - 1
    depth, rate = states[_DEPTH], states[_SPEED_1] - states[_SPEED_2]
    laws = [stretch.law for stretch in stretches]
    stored = np.append(_stored(laws[0], depth[: turn + 1]), _stored(laws[-1], depth[turn + 1 :]))
    resting = abs(rate[-1]) <= _AT_REST * rate[0]
    course = Impact(
        time=times,
        penetration=depth,
        rate=rate,
        force=forces,
        impulse=states[_IMPULSE],
        speeds=np.column_stack((states[_SPEED_1], states[_SPEED_2])),
        kinetic=0.5 * bodies.effective_mass * rate**2,
        stored=stored,
        contact_work=states[_WORK],
        friction_loss=states[_FRICTION],
        push_work=bodies.effective_mass / bodies.mass_1 * bodies.push * (depth - depth[0]),
        turn=turn,
        peak_force=max(_peak(stretch) for stretch in stretches),
        separated=len(stretches) > 1 and last.event == 0 and not (resting and bodies.push > 0.0),
    )
    for values in vars(course).values():
        if isinstance(values, np.ndarray):
            values.setflags(write=False)
    return course


def _stored(law: ContactLaw, depth: FloatArray) -> FloatArray:
    if isinstance(law, StoresEnergy):
        return np.asarray(law.stored_energy(depth))
    return np.full_like(depth, np.nan)


def _force_ends(stretch: _Stretch) -> float:
    """Return the last time with a force [s]: if a damper holds the surface back, before it has recovered."""
    if stretch.event != 0 or stretch.end == stretch.start:
        return stretch.end
    times = np.linspace(stretch.start, stretch.end, _SAMPLES)
    pressed = np.flatnonzero(stretch.forces(times) > 0.0)
    if not len(pressed) or pressed[-1] >= _SAMPLES - 2:
        return stretch.end
    with_force, without = times[pressed[-1]], times[pressed[-1] + 1]
    for _ in range(50):  # to the last bit of the time
        middle = 0.5 * (with_force + without)
        if stretch.forces(np.array([middle]))[0] > 0.0:
            with_force = middle
        else:
            without = middle
    return float(with_force)


def _peak(stretch: _Stretch) -> float:
    """Return the largest force [N] of a phase: the largest sample, refined by a search around it."""
    if stretch.end == stretch.start:
        return 0.0
    from scipy.optimize import minimize_scalar

    times = np.linspace(stretch.start, stretch.end, _SAMPLES)
    forces = stretch.forces(times)
    top = int(np.argmax(forces))
    beside = (times[max(top - 1, 0)], times[min(top + 1, _SAMPLES - 1)])
    found: Any = minimize_scalar(lambda time: -stretch.forces(np.array([time]))[0], bounds=beside, method="bounded")
    return max(float(forces[top]), -float(found.fun))
