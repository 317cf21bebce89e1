"""Friction over speed and over position: as a curve, and as a source of standard errors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.commands.identify.axis.filtered_regression import IntArray

# The wave numbers of a profile that the fitted coefficients absorb: their magnitude comes from those above.
_ABSORBED = 2
# The most points of a profile over the travel, and the fewest equations per point.
_MOST_POINTS, _FEWEST_PER_POINT = 256, 4


@dataclass(frozen=True, eq=False)
class FrictionCurve:
    """A force over speed or position: mean, standard error and number of equations of each point, all (g,).

    `abscissa`: signed speed [m/s, rad/s] or position [m, rad]; the middle of each interval. `mean` and
    `standard_error` [N, N m]. The standard error is that between strokes (NaN for a single stroke). An interval that
    no equation falls into is left out.
    """

    abscissa: FloatArray
    mean: FloatArray
    standard_error: FloatArray
    count: IntArray

    def __len__(self) -> int:
        return len(self.abscissa)


def friction_curve(abscissa: FloatArray, force: FloatArray, stroke: IntArray, edges: FloatArray) -> FrictionCurve:
    """Return the mean force in intervals of speed or position.

    Parameters
    ----------
    abscissa, force : ndarray, shape (m,)
        Speed [m/s, rad/s] or position [m, rad], and the force [N, N m] there.
    stroke : ndarray of int, shape (m,)
        The stroke of each: the residuals of a stroke are correlated, so that strokes are what is independent.
    edges : ndarray, shape (g + 1,)
        Increasing edges of the intervals; what is outside is left out.

    Returns
    -------
    FrictionCurve
        The mean of the strokes' means, weighted by the number of equations.

    Examples
    --------
    >>> import numpy as np
    >>> speed, force, stroke = np.array([0.1, 0.1, 0.1, 0.3]), np.array([1.0, 1.0, 3.0, 5.0]), np.array([0, 0, 1, 1])
    >>> friction_curve(speed, force, stroke, np.array([0.0, 0.2, 0.4])).mean.round(3).tolist()
    [1.667, 5.0]
    """
    interval = np.searchsorted(edges, abscissa, side="right") - 1
    interval[abscissa == edges[-1]] = len(edges) - 2
    is_inside = (interval >= 0) & (interval < len(edges) - 1) & np.isfinite(force)
    middle = 0.5 * (edges[1:] + edges[:-1])
    rows: list[tuple[float, float, float, int]] = []
    for number in np.unique(interval[is_inside]):
        chosen = is_inside & (interval == number)
        _, which = np.unique(stroke[chosen], return_inverse=True)
        counts = np.bincount(which)
        means = np.bincount(which, weights=force[chosen]) / counts
        weights = counts / float(counts.sum())
        mean = float(weights @ means)
        error = math.nan
        if len(means) > 1:
            # Cluster-robust standard error of a weighted mean.
            error = math.sqrt(len(means) / (len(means) - 1) * float(np.sum((weights * (means - mean)) ** 2)))
        rows.append((float(middle[number]), mean, error, int(counts.sum())))
    columns = np.array(rows, dtype=np.float64).reshape(-1, 4).T
    return FrictionCurve(columns[0], columns[1], columns[2], columns[3].astype(np.int64))


def speed_edges(speed: FloatArray, intervals: int = 20) -> FloatArray:
    """Return edges (g + 1,) of equal intervals over the signed speeds, with an edge at 0."""
    low, high = min(float(np.min(speed)), 0.0), max(float(np.max(speed)), 0.0)
    width = max((high - low) / intervals, 1e-12)
    return width * np.arange(math.floor(low / width), math.ceil(high / width) + 1, dtype=np.float64)


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
    points = int(np.clip(len(position) // _FEWEST_PER_POINT, 1, _MOST_POINTS))
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
