"""The links of a planar arm from its identified base parameters.

M11, M22, h, g1 and g2 are five numbers, but four links' values once the masses are known: h = m2 l1 lG2 and
g2 = m2 lG2 g contain the same product. The base parameters are shifted by the least that makes h / l1 = g2 / g, in the
metric of their covariance (least squares with an equality constraint). Then, with the masses of the machine file,

    lG2 = g2 / (m2 g),  lG1 = (g1 / g - m2 l1) / m1,  J1 = M11 - m1 lG1^2 - m2 l1^2,  J2 = M22 - m2 lG2^2
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.commands.identify.estimate import Estimate, IdentificationError, Method
from cdtool.commands.identify.robot.robot_dynamics import RobotFit
from cdtool.machines.planar_arm import PlanarArm

_LINKS = 2


@dataclass(frozen=True, eq=False)
class PlanarLinks:
    """`estimates` of centre_of_mass [m] and link_inertia [kg m2] of both links, given their masses.

    `shift`: the largest shift of a base parameter by the constraint, in its standard errors.
    """

    estimates: tuple[Estimate, ...]
    shift: float


def planar_links(fit: RobotFit) -> PlanarLinks:
    """Return the links of a planar arm whose inertial parameters were free.

    Raises IdentificationError without gravity, which alone separates the links' centres of mass from their inertias,
    and for links that no body with these masses can have: a negative moment of inertia.
    """
    arm = fit.machine
    assert isinstance(arm, PlanarArm)
    gravity, length = arm.gravity_acceleration, arm.link_length
    if gravity == 0.0:
        raise IdentificationError(
            "an arm that moves horizontally shows no centre of mass", "give centre_of_mass from the drawing"
        )
    values, covariance, shift = _constrained(fit, length, gravity)
    jacobian = np.zeros((2 * _LINKS, len(values)))
    (m1, m2), (inertia_1, inertia_2, _, g1, g2) = arm.link_mass, values
    second = g2 / (m2 * gravity)
    first = (g1 / gravity - m2 * length) / m1
    links = np.array([first, second, inertia_1 - m1 * first**2 - m2 * length**2, inertia_2 - m2 * second**2])
    jacobian[0, 3], jacobian[1, 4] = 1.0 / (m1 * gravity), 1.0 / (m2 * gravity)
    jacobian[2, 0], jacobian[2, 3] = 1.0, -2.0 * first / gravity
    jacobian[3, 1], jacobian[3, 4] = 1.0, -2.0 * second / gravity
    errors = np.sqrt(np.diag(jacobian @ covariance @ jacobian.T))
    for link in range(_LINKS):
        if links[2 + link] < -2.0 * errors[2 + link]:
            raise IdentificationError(
                f"link '{arm.joints[link]}' of {arm.link_mass[link]:g} kg would have an inertia of "
                f"{links[2 + link]:.3g} kg m2",
                "check link_mass, link_length and the scale of the torque",
            )
    links[2:] = np.maximum(links[2:], 0.0)
    keys = (("centre_of_mass", "m"),) * _LINKS + (("link_inertia", "kg m2"),) * _LINKS
    estimates = (
        Estimate("machine", key, float(value), float(error), unit, Method.FEASIBLE_LEAST_SQUARES, place % _LINKS)
        for place, ((key, unit), value, error) in enumerate(zip(keys, links, errors, strict=True))
    )
    return PlanarLinks(tuple(estimates), shift)


def _constrained(fit: RobotFit, length: float, gravity: float) -> tuple[FloatArray, FloatArray, float]:
    """Return M11, M22, h, g1, g2 (5,) with h / l1 = g2 / g, their covariance, and the largest shift."""
    places = [fit.grouping.base.index(column) for column in range(5)]
    values, covariance = fit.base.values[places], fit.base.covariance[np.ix_(places, places)]
    row = np.array([0.0, 0.0, 1.0 / length, 0.0, -1.0 / gravity])
    gain = covariance @ row / float(row @ covariance @ row)
    change = -gain * float(row @ values)
    errors = np.sqrt(np.diag(covariance))
    shift = float(np.max(np.abs(change) / np.maximum(errors, 1e-300)))
    return values + change, covariance - np.outer(gain, row @ covariance), shift if math.isfinite(shift) else math.inf
