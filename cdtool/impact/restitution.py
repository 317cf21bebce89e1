"""Coefficients of restitution: from speeds, impulses and works, and from the constants of a contact law.

Conventions: e lies between 0 (plastic) and 1 (elastic). Speeds of approach are positive; the damping number is
x = (mu/k) v of Hunt-Crossley's law. Functions of arrays work element by element; scalars give a scalar.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import UsageError
from cdtool.impact.checks import require_not_negative, require_positive, require_restitution

# Powers 1, 2, ... of x in e(x) - 1 and of 1 - e in x(e): the exact relation, solved as a power series about x = 0.
_RESTITUTION_SERIES = (-2 / 3, 4 / 9, -44 / 135, 104 / 405, -40 / 189, 7648 / 42525, -2848 / 18225)
_DAMPING_SERIES = (3 / 2, 3 / 2, 27 / 20, 6 / 5, 759 / 700, 351 / 350, 6639 / 7000)
# Below it a series of seven terms is more exact than the closed form, which subtracts near-equal numbers there.
_SERIES_BELOW = 0.02


@dataclass(frozen=True)
class Restitution:
    """The three coefficients of one impact; they differ where friction or an outer force acts during the contact."""

    newton: float
    poisson: float
    stronge: float


def newton(approach_rate: float, separation_rate: float) -> float:
    """e = -v_f/v_i (thesis 3.2) of the relative speeds [m/s] before and after; raises UsageError for a v_i of 0."""
    if approach_rate == 0.0:
        raise UsageError("the bodies do not approach: v_i is 0", "give the relative speed before the impact")
    return -separation_rate / approach_rate


def poisson(compression_impulse: float, whole_impulse: float) -> float:
    """e = (p_f - p_c)/p_c (thesis 3.4 without its minus) of the impulses [N s] up to t_c and of the whole contact."""
    require_positive("the impulse of compression", compression_impulse, "N s")
    return (whole_impulse - compression_impulse) / compression_impulse


def stronge(compression_work: float, restitution_work: float) -> float:
    """e = sqrt(-W_rs/W_c) (thesis 3.8) of the works [J] on the bodies: W_c < 0 in compression, W_rs >= 0 after it.

    With 3.9 corrected, W_rs = m v_i^2/2 (1 - p_f/p_c)^2, it is the e of 3.2 and 3.4 in a direct impact.
    """
    require_positive("the work taken up in compression, -W_c,", -compression_work, "J")
    return float(np.sqrt(max(-restitution_work / compression_work, 0.0)))


def coefficients(time: FloatArray, rate: FloatArray, force: FloatArray) -> Restitution:
    """Newton's, Poisson's and Stronge's coefficient (3.2, 3.4, 3.8) of one contact, simulated or measured.

    `time` (n,) s from first touch to separation, `rate` (n,) of the penetration m/s, positive while the bodies
    approach, `force` (n,) N. Trapezoids between the samples; compression ends where the rate passes 0. Fails where
    samples are so few that the force's peak falls between them. Raises UsageError where compression or its end is
    missing.
    """
    if not (time.ndim == 1 and time.shape == rate.shape == force.shape and len(time) > 2):
        raise UsageError(f"shapes {time.shape}, {rate.shape}, {force.shape}", "three arrays of one length above 2")
    after = np.flatnonzero(rate <= 0.0)
    if rate[0] <= 0.0 or not len(after):
        raise UsageError("the penetration's rate does not fall from positive to 0", "give one whole contact")
    turn = int(after[0])
    share = rate[turn - 1] / (rate[turn - 1] - rate[turn])
    at = time[turn - 1] + share * (time[turn] - time[turn - 1])
    force_at = force[turn - 1] + share * (force[turn] - force[turn - 1])
    times, rates, forces = (
        np.insert(values, turn, value) for values, value in ((time, at), (rate, 0.0), (force, force_at))
    )
    steps = np.diff(times)
    impulses = np.cumsum(0.5 * (forces[1:] + forces[:-1]) * steps)
    power = -forces * rates
    works = np.cumsum(0.5 * (power[1:] + power[:-1]) * steps)
    return Restitution(
        newton(float(rate[0]), float(rate[-1])),
        poisson(float(impulses[turn - 1]), float(impulses[-1])),
        stronge(float(works[turn - 1]), float(works[-1] - works[turn - 1])),
    )


def rate_from_force(time: FloatArray, force: FloatArray, mass: float, approach_speed: float) -> FloatArray:
    """Penetration rate (n,) [m/s] from a measured force (n,) [N]: v - p/m (thesis 3.6), trapezoids.

    `mass` is the effective mass of 3.7 [kg]; the mass must be free: a pushing drive is not included.
    """
    require_positive("the mass", mass, "kg")
    impulses = np.concatenate(([0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(time))))
    return np.asarray(approach_speed - impulses / mass)


def goldsmith(approach_speed: npt.ArrayLike, alpha: float, beta: float = 1.0) -> FloatArray:
    """e = sqrt(1 - alpha |v|^beta) (thesis 3.10 with the magnitude); NaN beyond the speed at which it would be 0.

    alpha [(s/m)^beta] and beta depend on material and geometry. Raises UsageError where one of them is below 0.
    """
    require_not_negative("alpha", alpha)
    require_not_negative("beta", beta)
    left = 1.0 - alpha * np.abs(np.asarray(approach_speed, dtype=np.float64)) ** beta
    return np.where(left >= 0.0, np.sqrt(np.maximum(left, 0.0)), np.nan)[()]


def hunt_crossley_restitution(damping_number: npt.ArrayLike) -> FloatArray:
    """e of x = (mu/k) v: x (1 + e) = ln[(1 + x)/(1 - e x)], exact for every n and mass; 3.19 integrated.

    Solved by Lambert's function: 1 - e x = -W(-(1 + x) exp(-1 - x)). Raises UsageError for an x below 0.
    """
    from scipy.special import lambertw

    principal_branch: Any = lambertw
    x = np.asarray(damping_number, dtype=np.float64)
    if np.any(x < 0.0):
        raise UsageError(f"a damping number is {np.min(x):g}", "x = (mu/k) v is 0 or above")
    large = np.maximum(x, _SERIES_BELOW)
    closed = (1.0 + np.real(principal_branch(-(1.0 + large) * np.exp(-1.0 - large)))) / large
    return np.where(x < _SERIES_BELOW, 1.0 + _series(_RESTITUTION_SERIES, np.minimum(x, large)), closed)[()]


def hunt_crossley_damping_number(restitution: npt.ArrayLike) -> FloatArray:
    """x = (mu/k) v of a wanted e: the inverse of `hunt_crossley_restitution`; infinite for e = 0.

    u = e x lies between 1 - e and 1: at 1 - e the difference of both sides is largest, at 1 it is -infinite. That
    bracket is halved. Raises UsageError for an e outside 0 .. 1.
    """
    e = np.asarray(restitution, dtype=np.float64)
    if np.any((e < 0.0) | (e > 1.0)):
        raise UsageError("a restitution lies outside 0 to 1", "e is 0 for plastic, 1 for elastic")
    within = np.clip(e, np.finfo(np.float64).tiny, 1.0 - _SERIES_BELOW)
    low, high = 1.0 - within, np.ones_like(within)
    for _ in range(64):  # halvings, to the last bit
        middle = 0.5 * (low + high)
        with np.errstate(divide="ignore"):
            below = middle / within + middle - np.log1p(middle / within) + np.log1p(-middle) > 0.0
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    found = np.where(
        1.0 - e < _SERIES_BELOW, _series(_DAMPING_SERIES, np.minimum(1.0 - e, _SERIES_BELOW)), low / within
    )
    return np.where(e > 0.0, found, np.inf)[()]


def damping_for_restitution(restitution: float, approach_speed: float, stiffness: float) -> float:
    """mu [N s/m^(n+1)] with which Hunt-Crossley's law rebounds with e at a speed [m/s]: exact, for every n and mass.

    Raises UsageError for e = 0, which no damping achieves, and for constants that are not positive.
    """
    require_restitution(restitution)
    require_positive("the restitution", restitution)
    require_positive("the approach speed", approach_speed, "m/s")
    require_positive("the stiffness", stiffness, "N/m^n")
    return float(hunt_crossley_damping_number(restitution)) * stiffness / approach_speed


def hunt_crossley_damping(restitution: float, approach_speed: float, stiffness: float) -> float:
    """mu = 3/2 alpha k, alpha = (1 - e)/v (thesis 3.21): of first order; half of what is needed at e = 0.5."""
    require_restitution(restitution)
    require_positive("the stiffness", stiffness, "N/m^n")
    require_positive("the approach speed", approach_speed, "m/s")
    return 1.5 * (1.0 - restitution) * stiffness / approach_speed


def lankarani_nikravesh_damping(restitution: float, approach_speed: float, stiffness: float) -> float:
    """mu = 3 k (1 - e^2)/(4 v) (thesis 3.22 with the alpha of 3.21): of first order, and less than 3.21."""
    require_restitution(restitution)
    require_positive("the stiffness", stiffness, "N/m^n")
    require_positive("the approach speed", approach_speed, "m/s")
    return 0.75 * (1.0 - restitution**2) * stiffness / approach_speed


def kelvin_voigt_restitution(damping_ratio: npt.ArrayLike, tension: bool = False) -> FloatArray:
    """e of 3.17 by zeta = d/(2 sqrt(k m)): exp(-2 zeta acos(zeta)/sqrt(1 - zeta^2)), where the force ends at 0.

    With `tension`, as 3.17 is printed: exp(-pi zeta/sqrt(1 - zeta^2)), the bodies part at delta = 0 and pull before;
    0 from zeta = 1 on. Raises UsageError for a damping ratio below 0.
    """
    zeta = np.asarray(damping_ratio, dtype=np.float64)
    if np.any(zeta < 0.0):
        raise UsageError(f"a damping ratio is {np.min(zeta):g}", "it is 0 or above")
    under = np.sqrt(np.maximum(1.0 - zeta**2, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        if tension:
            return np.where(zeta < 1.0, np.exp(-np.pi * zeta / under), 0.0)[()]
        below = 2.0 * zeta * np.arccos(np.minimum(zeta, 1.0)) / under
        above = 2.0 * zeta * np.arccosh(np.maximum(zeta, 1.0)) / np.sqrt(np.maximum(zeta**2 - 1.0, 0.0))
    return np.exp(-np.where(zeta < 1.0, below, np.where(zeta > 1.0, above, 2.0)))[()]


def _series(factors: tuple[float, ...], variable: FloatArray) -> FloatArray:
    total = np.zeros_like(variable)
    for factor in reversed(factors):
        total = (total + factor) * variable
    return total
