"""Impacts for the figures of the thesis's chapter 3. The thesis has no numbers for them: these are examples."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.impact.bodies import Bodies
from cdtool.impact.collision import collide
from cdtool.impact.contact_laws.base import ContactLaw
from cdtool.impact.contact_laws.hertz import Hertz
from cdtool.impact.contact_laws.hunt_crossley import HuntCrossley
from cdtool.impact.contact_laws.hysteresis_damping import HysteresisDamping
from cdtool.impact.contact_laws.kelvin_voigt import KelvinVoigt
from cdtool.impact.impact import Impact
from cdtool.impact.restitution import (
    damping_for_restitution,
    hunt_crossley_restitution,
    kelvin_voigt_restitution,
)

# A body of 1 kg at 0.5 m/s, a stiffness as of plastic on steel with a radius of 1 mm, and a fairly lossy contact.
_BODIES = Bodies(mass_1=1.0, speed_1=0.5)
_STIFFNESS = 1e8
_RESTITUTION = 0.7


@dataclass(frozen=True)
class RestitutionCurve:
    """e over a variable (n,): exact; by 3.21 and 3.22 if they define one (else NaN)."""

    name: str
    variable: FloatArray
    exact: FloatArray
    hunt_crossley: FloatArray
    lankarani_nikravesh: FloatArray


def two_bodies() -> Impact:
    """Figure 3.2: body 1 runs into body 2, the contact keeps a dent, and half of the relative energy is lost."""
    bodies = Bodies(mass_1=2.0, speed_1=0.6, mass_2=3.0, speed_2=0.1)
    deepest = Hertz(_STIFFNESS).greatest_penetration(bodies.effective_mass, bodies.approach_speed)
    return collide(Hertz(_STIFFNESS, permanent_indentation=0.5 * deepest), bodies).first


def loops() -> dict[str, dict[str, Impact]]:
    """Figure 3.5: the same body on contacts that all rebound with e = 0.7; by panel, by law."""
    mass, speed = _BODIES.effective_mass, _BODIES.approach_speed
    deepest = Hertz(_STIFFNESS).greatest_penetration(mass, speed)
    linear = mass * (speed / deepest) ** 2  # as deep as Hertz's spring, without damping
    laws: dict[str, dict[str, ContactLaw]] = {
        "Hertz": {
            "permanent indentation (3.16)": Hertz(_STIFFNESS, permanent_indentation=(1.0 - _RESTITUTION**2) * deepest),
            "none (3.13)": Hertz(_STIFFNESS),
        },
        "Linear spring": {
            "Kelvin-Voigt (3.17)": KelvinVoigt(linear, 2.0 * _damping_ratio() * math.sqrt(linear * mass)),
            "hysteresis damping (3.18)": HysteresisDamping(
                linear, damping_for_restitution(_RESTITUTION, speed, linear)
            ),
        },
        "Hunt-Crossley": {
            "e = 0.7 (3.19)": HuntCrossley(_STIFFNESS, damping_for_restitution(_RESTITUTION, speed, _STIFFNESS)),
            "e = 0.3 (3.19)": HuntCrossley(_STIFFNESS, damping_for_restitution(0.3, speed, _STIFFNESS)),
        },
    }
    return {panel: {name: collide(law, _BODIES).first for name, law in group.items()} for panel, group in laws.items()}


def restitution_over_speed() -> list[RestitutionCurve]:
    """Figure 3.4: e of Hunt-Crossley contacts over the approach speed [m/s], by alpha of e = 1 - alpha v [s/m]."""
    speed = np.linspace(0.0, 6.0, 301)
    return [_curve(f"α = {alpha:g} s/m", speed, 1.5 * alpha) for alpha in (0.08, 0.2, 0.5)]


def restitution_over_damping() -> RestitutionCurve:
    """Return e over the damping number x = (mu/k) v, exact and by 3.21 and 3.22."""
    return _curve("exact", np.linspace(0.0, 2.5, 501), 1.0)


def simulated_restitution(damping_numbers: FloatArray) -> FloatArray:
    """e (n,) of simulated Hunt-Crossley impacts with these damping numbers (n,)."""
    speed = _BODIES.approach_speed
    laws = (HuntCrossley(_STIFFNESS, float(x) * _STIFFNESS / speed) for x in damping_numbers)
    return np.array([collide(law, _BODIES).first.restitution.newton for law in laws])


def _curve(name: str, variable: FloatArray, scale: float) -> RestitutionCurve:
    x = scale * variable
    first_order = np.where(x <= 1.5, 1.0 - x / 1.5, np.nan)
    with np.errstate(invalid="ignore"):
        second = np.sqrt(1.0 - x / 0.75)
    return RestitutionCurve(name, variable, hunt_crossley_restitution(x), first_order, second)


def _damping_ratio() -> float:
    from scipy.optimize import brentq

    return float(brentq(lambda zeta: float(kelvin_voigt_restitution(zeta)) - _RESTITUTION, 0.0, 1.0))
