"""The discrete approach (thesis 3.2.1): two rigid bodies in a plane, hit in no time, with Coulomb friction.

Conventions: the normal points from body 1 to body 2, the tangent is the normal turned by -90 degrees. The relative
velocity u = (u_t, u_n) is that of body 2 at the contact minus that of body 1 (3.3): u_n < 0 while they approach. The
impulse p = (p_t, p_n) acts on body 2, its opposite on body 1 (3.1, 3.11), and u changes by W p. For central bodies
1/W_nn is the effective mass of 3.7.

Impulses grow with the normal one from 0. While the bodies slide, dp_t = -mu sign(u_t) dp_n. When sliding stops they
stick, if mu is at least |W_tn|/W_tt, or slide back. So u_n is a broken line over p_n, and the works are its areas.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import UsageError
from cdtool.impact.checks import require_not_negative, require_restitution

Hypothesis = Literal["newton", "poisson", "stronge"]
Slip = Literal["sticks", "slides", "slides, then sticks", "slides, then back", "slides back"]
# Shares of the normal kinetic energy, and of a slope, that are rounding.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class RigidBody:
    """A body in the plane: mass [kg], inertia about its centre [kg m2], centre (2,) m, velocity (2,) m/s, spin [rad/s].

    Mass and inertia are infinite for an obstacle.
    """

    mass: float
    inertia: float
    centre: tuple[float, float]
    velocity: tuple[float, float] = (0.0, 0.0)
    spin: float = 0.0

    def __post_init__(self) -> None:
        if not (self.mass > 0.0 and self.inertia > 0.0):
            raise UsageError(
                f"a body of {self.mass:g} kg and {self.inertia:g} kg m2",
                "both are above 0, or infinite for an obstacle",
            )

    def velocity_at(self, point: FloatArray) -> FloatArray:
        """Velocity (2,) m/s of the material at a point (2,) m."""
        arm = point - np.asarray(self.centre)
        return np.asarray(self.velocity) + self.spin * np.array([-arm[1], arm[0]])

    def mobility_at(self, point: FloatArray) -> FloatArray:
        """Change of `velocity_at` by a unit impulse at the point: (2, 2) 1/kg."""
        arm = point - np.asarray(self.centre)
        turned = np.array([-arm[1], arm[0]])
        return np.asarray(np.eye(2) / self.mass + np.outer(turned, turned) / self.inertia)

    def struck(self, impulse: FloatArray, point: FloatArray) -> RigidBody:
        """The body after an impulse (2,) N s at a point (2,) m."""
        arm = point - np.asarray(self.centre)
        velocity = np.asarray(self.velocity) + impulse / self.mass
        moment = float(arm[0] * impulse[1] - arm[1] * impulse[0])
        return RigidBody(
            self.mass,
            self.inertia,
            self.centre,
            (float(velocity[0]), float(velocity[1])),
            self.spin + moment / self.inertia,
        )


@dataclass(frozen=True)
class ImpulseResult:
    """Both bodies after the impact, the impulse on body 2 [N s] and the energy lost [J].

    `energy_loss` is never negative. `hypothesis` is the one used: "stronge" if the one requested
    would have created energy.
    """

    body_1: RigidBody
    body_2: RigidBody
    normal_impulse: float
    tangential_impulse: float
    energy_loss: float
    friction_loss: float
    slip: Slip
    hypothesis: Hypothesis


def strike(
    body_1: RigidBody,
    body_2: RigidBody,
    point: tuple[float, float],
    normal: tuple[float, float],
    restitution: float,
    friction: float = 0.0,
    hypothesis: Hypothesis = "stronge",
) -> ImpulseResult:
    """Both bodies after an impact at a point (2,) m: `restitution` e, Coulomb's `friction` mu, `normal` from 1 to 2.

    The hypothesis defines when restitution ends: Newton (3.2), u_n is -e times its initial value; Poisson (3.4),
    the normal impulse is 1 + e times that of compression; Stronge (3.8), the normal work of restitution is e^2 times
    that of compression. They agree unless friction acts on an eccentric impact whose sliding stops or turns. There
    Newton's may create energy. If the one requested does, Stronge's is used, which never does: it
    returns e^2 <= 1 of the normal work, and friction only dissipates. A body on a pivot (infinite mass, finite inertia)
    that sticks is locked: there is no rebound. Raises UsageError if the bodies do not approach. Fails if the
    contact lasts so long that the bodies move during it: use `cdtool.impact.collision` then.
    """
    require_restitution(restitution)
    require_not_negative("the friction", friction)
    at = np.asarray(point, dtype=np.float64)
    axes = _axes(normal)
    velocity = axes @ (body_2.velocity_at(at) - body_1.velocity_at(at))
    if not velocity[1] < 0.0:
        raise UsageError(f"the bodies part with {velocity[1]:g} m/s", "the normal points from body 1 to body 2")
    mobility = axes @ (body_1.mobility_at(at) + body_2.mobility_at(at)) @ axes.T
    if not mobility[1, 1] > 0.0:
        raise UsageError("two obstacles cannot move", "one of the bodies needs a finite mass")
    course = _GrowingImpulse(velocity, mobility, friction)
    used = hypothesis
    impulse = course.impulse(course.end(restitution, hypothesis))
    if course.work(impulse) > _ROUNDING * velocity[1] ** 2 / mobility[1, 1]:
        used = "stronge"
        impulse = course.impulse(course.end(restitution, used))
    on_body_2 = axes.T @ impulse
    return ImpulseResult(
        body_1.struck(-on_body_2, at),
        body_2.struck(on_body_2, at),
        float(impulse[1]),
        float(impulse[0]),
        max(-course.work(impulse), 0.0),
        max(course.normal_work(float(impulse[1])) - course.work(impulse), 0.0),
        course.slip(float(impulse[1])),
        used,
    )


def _axes(normal: tuple[float, float]) -> FloatArray:
    """Rows: tangent and normal, of length 1."""
    length = math.hypot(*normal)
    if not 0.0 < length < math.inf:
        raise UsageError(f"the normal {normal} has no direction", "give a vector from body 1 to body 2")
    x, y = normal[0] / length, normal[1] / length
    return np.array([[y, -x], [x, y]])


class _GrowingImpulse:
    """The growing impulse: until sliding stops, and after that."""

    def __init__(self, velocity: FloatArray, mobility: FloatArray, friction: float) -> None:
        self.velocity, self.mobility = velocity, mobility
        slide, coupling = float(velocity[0]), float(mobility[0, 1])
        needed = coupling / float(mobility[0, 0]) if mobility[0, 0] > 0.0 else 0.0
        # Ratio of tangential to normal impulse, before and after sliding stops.
        self.before = -math.copysign(friction, slide) if slide else 0.0
        self.sticks = abs(needed) <= friction
        self.after = -needed if self.sticks else -math.copysign(friction, coupling)
        slowing = coupling + float(mobility[0, 0]) * self.before
        # Signs, not a product: the product of very small velocities would be 0.
        slows = slide < 0.0 < slowing or slowing < 0.0 < slide
        self.stop = 0.0 if slide == 0.0 else -slide / slowing if slows else math.inf

    def impulse(self, normal: float) -> FloatArray:
        """(p_t, p_n) when the normal impulse has that size."""
        tangential = self.before * min(normal, self.stop) + self.after * max(normal - self.stop, 0.0)
        return np.array([tangential, normal])

    def work(self, impulse: FloatArray) -> float:
        """Work on the bodies [J] by an impulse: its mean velocity times itself."""
        return float((self.velocity + 0.5 * self.mobility @ impulse) @ impulse)

    def slopes(self) -> tuple[float, float]:
        """du_n/dp_n before and after sliding stops; 0 where a body on a pivot is locked."""
        row = self.mobility[1]
        after = float(row[1] + row[0] * self.after)
        return float(row[1] + row[0] * self.before), after if after > _ROUNDING * row[1] else 0.0

    def normal_velocity(self, normal: float) -> float:
        """u_n [m/s] at a normal impulse [N s]."""
        return float(self.velocity[1] + self.mobility[1] @ self.impulse(normal))

    def normal_work(self, normal: float) -> float:
        """Area under u_n up to a normal impulse [J]."""
        first = min(normal, self.stop)
        rest = normal - first
        return 0.5 * first * (float(self.velocity[1]) + self.normal_velocity(first)) + 0.5 * rest * (
            self.normal_velocity(first) + self.normal_velocity(normal)
        )

    def end(self, restitution: float, hypothesis: Hypothesis) -> float:
        """Normal impulse [N s] at which the restitution ends."""
        compression = self.reaches(0.0)
        if hypothesis == "newton":
            return self.reaches(-restitution * float(self.velocity[1]))
        if hypothesis == "poisson":
            return (1.0 + restitution) * compression
        return self._restored(compression, -(restitution**2) * self.normal_work(compression))

    def reaches(self, wanted: float) -> float:
        """Normal impulse at which u_n rises to a velocity >= 0; after sliding has stopped it always rises."""
        before, after = self.slopes()
        if before > 0.0:
            found = (wanted - float(self.velocity[1])) / before
            if found <= self.stop:
                return found
        return self.stop + ((wanted - self.normal_velocity(self.stop)) / after if after else 0.0)

    def _restored(self, compression: float, work: float) -> float:
        """Normal impulse at which the work since compression has come to `work`: triangle, then trapezium."""
        before, after = self.slopes()
        if compression < self.stop:
            found = compression + math.sqrt(2.0 * work / before)
            if found <= self.stop:
                return found
            if not after:
                return self.stop
            speed = self.normal_velocity(self.stop)
            left = work - 0.5 * (self.stop - compression) * speed
            return self.stop + 2.0 * left / (speed + math.sqrt(speed**2 + 2.0 * after * left))
        return compression + (math.sqrt(2.0 * work / after) if after else 0.0)

    def slip(self, normal: float) -> Slip:
        """Return how the contact points moved along the tangent."""
        if self.stop >= normal:
            return "slides"
        if self.stop == 0.0:
            return "sticks" if self.sticks else "slides back"
        return "slides, then sticks" if self.sticks else "slides, then back"
