"""Two bodies on one line, and their flight between two contacts."""

from __future__ import annotations

import math
from dataclasses import dataclass

from cdtool.base.errors import UsageError
from cdtool.impact.checks import require_not_negative, require_positive


def effective_mass(mass_1: float, mass_2: float = math.inf) -> float:
    """m = M_1 M_2/(M_1 + M_2) (thesis 3.7) [kg]; an infinite mass is an obstacle that does not move."""
    return mass_1 / (1.0 + mass_1 / mass_2)


@dataclass(frozen=True)
class Bodies:
    """Body 1 runs after body 2 and hits it: masses [kg], speeds before the impact [m/s], positive in one direction.

    Without `mass_2` body 2 is an obstacle at rest. `push` [N] is a constant force on body 1 towards body 2: a drive, or
    the weight of a ball that falls. `friction` [N s/m] acts on body 1, against its own speed.
    Raises UsageError if body 1 does not approach, and for constants outside their range.
    """

    mass_1: float
    speed_1: float
    mass_2: float = math.inf
    speed_2: float = 0.0
    push: float = 0.0
    friction: float = 0.0

    def __post_init__(self) -> None:
        require_positive("mass 1", self.mass_1, "kg")
        if not self.mass_2 > 0.0:
            raise UsageError(f"mass 2 is {self.mass_2:g} kg", "a number above 0, or infinity for an obstacle")
        require_not_negative("the push", self.push, "N")
        require_not_negative("the friction", self.friction, "N s/m")
        if not 0.0 < self.approach_speed < math.inf:
            raise UsageError(
                f"body 1 at {self.speed_1:g} m/s does not come nearer to body 2 at {self.speed_2:g} m/s",
                "speed_1 has to be larger than speed_2",
            )

    @property
    def approach_speed(self) -> float:
        """-v_i of thesis 3.3 [m/s], positive."""
        return self.speed_1 - self.speed_2

    @property
    def effective_mass(self) -> float:
        """m of thesis 3.7 [kg]."""
        return effective_mass(self.mass_1, self.mass_2)

    def flight(self, speed_1: float, speed_2: float) -> tuple[float, float] | None:
        """Return when bodies that part at these speeds touch again [s], and the speed of body 1 then [m/s], or None.

        Closed form of M_1 dV_1/dt = push - friction V_1, V_2 constant.
        """
        if self.friction == 0.0:
            if self.push == 0.0:
                return None
            return 2.0 * (speed_2 - speed_1) * self.mass_1 / self.push, 2.0 * speed_2 - speed_1
        final, settling = self.push / self.friction, self.mass_1 / self.friction
        if final <= speed_2:
            return None

        def nearer(time: float) -> float:
            return (final - speed_2) * time - (speed_1 - final) * settling * math.expm1(-time / settling)

        from scipy.optimize import brentq

        # The bodies are farthest apart where their speeds are equal; after that they approach.
        farthest = settling * math.log((final - speed_1) / (final - speed_2))
        late = 2.0 * farthest
        while nearer(late) <= 0.0:
            late *= 2.0
        time = float(brentq(nearer, farthest, late, xtol=1e-15, rtol=1e-14))
        return time, final + (speed_1 - final) * math.exp(-time / settling)
