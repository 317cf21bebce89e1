"""The driven load as transfer functions: free, in contact behind a rigid, and behind an elastic transmission."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdtool.base.errors import UsageError
from cdtool.impact.checks import require_not_negative, require_positive
from cdtool.impact.contact_laws.base import ContactLaw
from cdtool.impact.transmissions.transfer import Transfer
from cdtool.impact.transmissions.transmission import ElasticTransmission, RigidTransmission, Transmission

Polynomial = tuple[float, ...]


@dataclass(frozen=True)
class ContactStiffness:
    """A contact about one state: K_c = dF/d(delta) [N/m] and D_c = dF/d(delta') [N s/m] at the load."""

    stiffness: float
    damping: float


NO_CONTACT = ContactStiffness(0.0, 0.0)
"""Before the touch and between contacts."""


def linearised_contact(law: ContactLaw, penetration: float, rate: float) -> ContactStiffness:
    """K_c and D_c of a law about a penetration [m] and its rate [m/s]; r^2 times them is 4.17.

    Central differences, accurate to about 1e-8 of the value, for any law. Raises UsageError outside the contact.
    Both change with the state: `docs/impact.md` states how far from it they are valid.
    """
    require_positive("penetration", penetration, "m")
    depth, change = 1e-4 * penetration, 1e-4 * max(abs(rate), 1e-3)
    if law.force(penetration - depth, rate) <= 0.0:
        raise UsageError(f"no contact force at {penetration:g} m and {rate:g} m/s", "a state within the contact")
    return ContactStiffness(
        float(law.force(penetration + depth, rate) - law.force(penetration - depth, rate)) / (2.0 * depth),
        float(law.force(penetration, rate + change) - law.force(penetration, rate - change)) / (2.0 * change),
    )


def motor_by_torque(transmission: Transmission, contact: ContactStiffness = NO_CONTACT) -> Transfer:
    """Theta/tau_m [rad/(N m)], before the contact (4.8, 4.22) or about a state of it (4.18 with 4.16 and 4.17, 4.26).

    Rigid: 1 / (J_t s^2 + (d_t + r^2 D_c) s + r^2 K_c); before the contact poles 0 and -d_t/J_t, gain 1/d_t; in it
    `transfer.second_order` gives wn, xi and 1/K. Elastic: Q/(P Q - E^2/r^2) with P = J_m s^2 + d_t s + k_el,
    E = d_el s + k_el, d_t = d_m + d_el and Q = M_l s^2 + (d_l + D_c) s + K_c + E/r^2. It is the response to a small
    change of the torque while the contact stays about its state; an impact of a stiff contact leaves it within 1 ms.
    """
    motor, _, both = _driven(transmission, contact)
    return Transfer(motor, both, "rad/(N m)").reduced


def load_by_torque(transmission: Transmission, contact: ContactStiffness = NO_CONTACT) -> Transfer:
    """X_l/tau_m [m/(N m)] = [rad/N]: rigid r Theta/tau_m (4.7), elastic (E/r)/(P Q - E^2/r^2), see `motor_by_torque`.

    By reciprocity it is also -Theta/F_c, the motor's response to a force on the load.
    """
    _, load, both = _driven(transmission, contact)
    return Transfer(load, both, "m/(N m)").reduced


def penetration_by_momentum(
    transmission: ElasticTransmission, contact_stiffness: float, contact_damping: float = 0.0
) -> Transfer:
    """G_cd: penetration per unit of the load's initial momentum [m/(N s)] (4.27, 4.29 and 4.30 corrected, d_l added).

        (J_m s^2 + d_t s + k_el) / (a4 s^4 + a3 s^3 + a2 s^2 + a1 s + a0),  d_t = d_m + d_el

    `contact_stiffness` K_c [N/m] and `contact_damping` D_c [N s/m] belong to a linear contact (4.25 corrected); gain
    1/K_c. The friction of the load adds to D_c. Valid until the bodies part.
    """
    require_positive("contact stiffness", contact_stiffness, "N/m")
    require_not_negative("contact damping", contact_damping, "N s/m")
    t = transmission
    _, _, both = _driven(t, ContactStiffness(contact_stiffness, contact_damping))
    return Transfer((t.motor_inertia, t.motor_friction + t.damping, t.stiffness), both, "m/(N s)")


def motor_by_penetration(transmission: ElasticTransmission) -> Transfer:
    """G_dt: Theta/delta = (1/r) (d_el s + k_el) / (J_m s^2 + d_t s + k_el) [rad/m] (4.28 corrected): gain 1/r."""
    t = transmission
    friction = t.motor_friction + t.damping
    _, load, _ = _driven(t, NO_CONTACT)
    return Transfer(load, (t.motor_inertia, friction, t.stiffness), "rad/m").reduced


def undamped(transmission: ElasticTransmission) -> ElasticTransmission:
    """Return the transmission without friction and damping, as 4.31 to 4.35 assume."""
    t = transmission
    return ElasticTransmission(t.motor_inertia, t.load_mass, t.ratio, t.stiffness)


def resonances(transmission: ElasticTransmission, contact_stiffness: float) -> tuple[float, float]:
    """w1 < w2 [rad/s] of the undamped motion in contact (4.33, 4.34 corrected).

    A w^4 - B w^2 + C = 0, A = J_m M_l, B = J_m K_c + k_el M_l + J_m k_el/r^2, C = K_c k_el. Always
    w1 < sqrt(k_el/J_m) < w2.
    """
    denominator = penetration_by_momentum(undamped(transmission), contact_stiffness).denominator
    a, b, c = denominator[0], denominator[2], denominator[4]
    # Without cancellation: the larger root first, the smaller from their product.
    upper = (b + np.sqrt(b * b - 4.0 * a * c)) / (2.0 * a)
    return float(np.sqrt(c / (a * upper))), float(np.sqrt(upper))


def _driven(transmission: Transmission, contact: ContactStiffness) -> tuple[Polynomial, Polynomial, Polynomial]:
    """Numerators of Theta/tau_m and of X_l/tau_m and their denominator, from the highest power of s down.

    The denominator of an elastic drive is 4.29 (corrected; the friction d_l of the load added to D_c).
    """
    t, square, k_c = transmission, transmission.ratio**2, contact.stiffness
    if isinstance(t, RigidTransmission):
        return (1.0,), (t.ratio,), (t.inertia, t.friction + square * contact.damping, square * k_c)
    friction, d_c = t.motor_friction + t.damping, contact.damping + t.load_friction
    a1 = friction * k_c + d_c * t.stiffness + t.motor_friction * t.stiffness / square
    a2 = t.motor_inertia * k_c + d_c * friction + t.stiffness * t.load_mass
    a2 += (t.motor_inertia * t.stiffness + t.motor_friction * t.damping) / square
    a3 = t.motor_inertia * d_c + friction * t.load_mass + t.motor_inertia * t.damping / square
    motor = (t.load_mass, d_c + t.damping / square, k_c + t.stiffness / square)
    load = (t.damping / t.ratio, t.stiffness / t.ratio)
    return motor, load, (t.motor_inertia * t.load_mass, a3, a2, a1, k_c * t.stiffness)
