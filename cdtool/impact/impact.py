"""One impact: motion and force over time, impulse, and the balance of its energy."""

from __future__ import annotations

from dataclasses import dataclass

from cdtool.base.arrays import FloatArray
from cdtool.impact.restitution import Restitution, newton, poisson, stronge


@dataclass(frozen=True)
class Impact:
    """One contact, from the moment at which its force begins to the moment at which it ends; arrays (n,), frozen.

    `time` s (0 = first touch of the first contact), `penetration` m, `rate` m/s, `force` N, `impulse` N s since the
    contact began, `speeds` (n, 2) m/s of both bodies. Energies in J, of the relative motion (m v^2/2 with 3.7), which
    is all that an impact can change: `kinetic`; `stored`, elastic, NaN if the law does not define it;
    `contact_work`, done on the contact; `friction_loss` and `push_work`, of the outer forces. `turn` is the sample at
    t_c, where compression ends. `separated` is False if the bodies stay together: the arrays then end when they
    are least pressed, or at the time limit.
    """

    time: FloatArray
    penetration: FloatArray
    rate: FloatArray
    force: FloatArray
    impulse: FloatArray
    speeds: FloatArray
    kinetic: FloatArray
    stored: FloatArray
    contact_work: FloatArray
    friction_loss: FloatArray
    push_work: FloatArray
    turn: int
    peak_force: float
    separated: bool

    @property
    def duration(self) -> float:
        """t_f [s]: how long the force lasts."""
        return float(self.time[-1] - self.time[0])

    @property
    def approach_speed(self) -> float:
        """Relative speed at the first touch [m/s]."""
        return float(self.rate[0])

    @property
    def greatest_penetration(self) -> float:
        """delta_c [m]."""
        return float(self.penetration[self.turn])

    @property
    def dissipated(self) -> FloatArray:
        """Energy that the contact does not return (n,) [J]; NaN if the law defines no stored energy."""
        return self.contact_work - self.stored

    @property
    def energy_loss(self) -> float:
        """1 - e^2: share of the relative kinetic energy that is gone; negative where a push brought more in."""
        return float(1.0 - self.kinetic[-1] / self.kinetic[0])

    @property
    def contact_loss(self) -> float:
        """The part of the kinetic energy at the first touch that the contact itself took."""
        return float(self.contact_work[-1] / self.kinetic[0])

    @property
    def restitution(self) -> Restitution:
        """Newton's, Poisson's and Stronge's coefficient (thesis 3.2, 3.4, 3.8); equal where no outer force acts.

        An outer force during the contact affects Newton's, which uses only the speeds; Stronge's is of the contact.
        Meaningless if `separated` is False.
        """
        work = -self.contact_work
        return Restitution(
            newton(float(self.rate[0]), min(float(self.rate[-1]), 0.0)),
            poisson(float(self.impulse[self.turn]), float(self.impulse[-1])),
            stronge(float(work[self.turn]), float(work[-1] - work[self.turn])),
        )


@dataclass(frozen=True)
class Collision:
    """Impacts in their order; if the bodies come to rest, the last one does not separate."""

    impacts: tuple[Impact, ...]

    @property
    def first(self) -> Impact:
        """The first impact."""
        return self.impacts[0]

    @property
    def stays(self) -> bool:
        """Whether the bodies stay in contact in the end."""
        return not self.impacts[-1].separated
