"""When does a transmission count as rigid? Condition 4.36 with the margin that it needs."""

from __future__ import annotations

from dataclasses import dataclass

from cdtool.impact.linearised import resonances
from cdtool.impact.transmissions.transmission import ElasticTransmission

#: Up to this share of the limit 4.36 the motor's motion differs from the load's by some 10 %.
RIGID_SHARE = 0.1


@dataclass(frozen=True)
class Rigidity:
    """K_c and the limit of 4.36 [N/m], the resonances in contact and that of the transmission [rad/s].

    `motion_ratio` is theta r / delta at the lower resonance: 1 where motor and load move as one.
    """

    contact_stiffness: float
    limit: float
    lower_resonance: float
    upper_resonance: float
    transmission_frequency: float
    motion_ratio: float

    @property
    def share(self) -> float:
        """K_c / limit."""
        return self.contact_stiffness / self.limit

    @property
    def rigid(self) -> bool:
        """Whether K_c is at most a tenth of the limit: motor and load then differ by 10 to 11 %."""
        return self.share <= RIGID_SHARE

    @property
    def words(self) -> str:
        """One sentence for a report."""
        error = 100.0 * (self.motion_ratio - 1.0)
        verdict = "may be taken as rigid" if self.rigid else "is not rigid"
        return (
            f"the transmission {verdict} in this impact: the contact's stiffness is {100.0 * self.share:.3g} % of the "
            f"limit {self.limit:.3g} N/m (4.36; at most 10 % is needed), the motor's motion is off by {error:.3g} %"
        )


def rigidity(transmission: ElasticTransmission, contact_stiffness: float) -> Rigidity:
    """Compare K_c with k_el J_t / (J_m r^2) (4.36), with the true error of the motion at the lower resonance.

    The limit equates the contact's resonance of the rigid machine, sqrt(K_c r^2/J_t), with sqrt(k_el/J_m). There the
    motor already moves 2.5 times as far as the load (with J_t = 2.35 J_m), so a margin is needed: a tenth of the limit
    gives 10 to 11 %, a twentieth 5 %. Without damping theta r/delta = 1 / (1 - (w1/w_a)^2) (4.32 corrected).
    Raises UsageError for a stiffness not above 0.
    """
    t = transmission
    lower, upper = resonances(t, contact_stiffness)
    limit = t.stiffness * t.rigid.inertia / (t.motor_inertia * t.ratio**2)
    ratio = 1.0 / (1.0 - (lower / t.transmission_frequency) ** 2)
    return Rigidity(contact_stiffness, limit, lower, upper, t.transmission_frequency, ratio)
