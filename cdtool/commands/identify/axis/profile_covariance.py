"""A friction that depends on the position, as a source of standard errors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.commands.identify.axis.filtered_regression import IntArray

# The wave numbers of a profile that the fitted coefficients absorb: their magnitude comes from those above.
_ABSORBED = 2


def profile_covariance(
    influence: FloatArray,
    residuals: FloatArray,
    position: FloatArray,
    direction: FloatArray,
    count: int = 50,
    seed: int = 0,
) -> FloatArray:
    """Return the covariance (p, p) of the coefficients due to a friction that depends on the position.

    Parameters
    ----------
    influence : ndarray, shape (p, m)
        What the coefficients change by per unit of force; see `LinearFit`.
    residuals, position, direction : ndarray, shape (m,)
        Residual [N, N m], position [m, rad] and direction (1, -1) of each equation.
    count, seed : int
        Number of random profiles, and the seed of their phases.

    Notes
    -----
    The profile is the mean residual over position, per direction. It is the same in every stroke, so that a comparison
    of strokes does not show its effect; it is not white, so that its scatter does not show it either. Profiles of the
    same spectrum with random phases (Theiler et al., Physica D 58, 1992) act on the coefficients as the true one did.
    The two longest waves, which the fit absorbs, get the magnitude of the next two, if that is larger.

    It fails if the track is hardly longer than the longest wave of its friction: one draw of it was seen.
    """
    rng = np.random.default_rng(seed)
    profiles = [(chosen, *_profile(position[chosen], residuals[chosen])) for chosen in _by_direction(direction)]
    changes = np.zeros((count, len(influence)))
    for row in changes:
        for chosen, begins, spacing, profile in profiles:
            force = _random_phases(profile, rng)
            grid = (position[chosen] - begins) / spacing
            row += influence[:, chosen] @ np.interp(grid, np.arange(len(force)), force, period=len(force))
    covariance: FloatArray = changes.T @ changes / count
    return covariance


def _by_direction(direction: FloatArray) -> Sequence[IntArray]:
    return [rows for sign in (1.0, -1.0) if len(rows := np.flatnonzero(direction == sign))]


def _profile(position: FloatArray, residuals: FloatArray) -> tuple[float, float, FloatArray]:
    """Return begin, spacing and mean residual on a grid over the positions."""
    low, high = float(np.min(position)), float(np.max(position))
    # At most 256 points over the travel, with at least four equations for each.
    points = int(np.clip(len(position) // 4, 1, 256))
    spacing = max((high - low) / points, 1e-12)
    number = np.minimum(((position - low) / spacing).astype(np.int64), points - 1)
    counts = np.bincount(number, minlength=points)
    sums = np.bincount(number, weights=residuals, minlength=points)
    filled = np.flatnonzero(counts)
    profile = np.interp(np.arange(points), filled, sums[filled] / counts[filled])
    return low + 0.5 * spacing, spacing, profile


def _random_phases(profile: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return a profile (2 n,) with the spectrum of this one and random phases, without its mean.

    It belongs to the profile and its mirror image: the two ends of the travel are not next to each other.
    """
    magnitude = np.abs(np.fft.rfft(np.concatenate((profile, profile[::-1]))))
    # The mean is the Coulomb friction.
    magnitude[0] = 0.0
    absorbed, above = magnitude[1 : 2 * _ABSORBED + 1], magnitude[2 * _ABSORBED + 1 : 4 * _ABSORBED + 1]
    if len(above):
        np.maximum(absorbed, float(np.sqrt(np.mean(above**2))), out=absorbed)
    phases = rng.uniform(0.0, 2.0 * np.pi, len(magnitude))
    surrogate: FloatArray = np.fft.irfft(magnitude * np.exp(1j * phases), 2 * len(profile))
    return surrogate
