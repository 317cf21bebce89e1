"""The friction's profile along the travel, and random profiles like it.

The residuals of a start are coloured by this profile, so that standard errors from their scatter alone cover in one
case of ten. What covers: where the profile is not known, it is replaced by profiles with the same spectrum and random
phases, each of which would have given other parameters.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.commands.identify.axis.start_ensemble import StartEnsemble, motor_speed
from cdtool.machines.axis_model.axis_run import AxisRun

# The grid over the travel: this long at nominal speed; force and speed pass a Gaussian of this deviation, so that the
# third derivative of the speed is above its noise [s].
_GRID, _AVERAGED = 0.01, 0.04
# The unknown part has its friction at so many points, linear between them: with 6, waves of 0.13 m were lost.
_KNOTS = 10
# Fewer grid points are no profile.
_FEWEST = 20


@dataclass(frozen=True, eq=False)
class FrictionProfile:
    """Deviation of the friction from its mean, every `spacing` [m, rad] from `begins`, along the direction of travel.

    `parts` (4, n), without their means and empty if the motion never settles: force of the drive, acceleration and
    speed of the motor, second derivative of that force. Their sum weighted with `shares` (4,) is the friction, which
    opposes the motion. `level_deviation`: standard deviation of the mean friction of the runs that were averaged.
    Positions count from the rest before the start.
    """

    begins: float
    spacing: float
    parts: FloatArray
    level_deviation: float
    shares: FloatArray = field(default_factory=lambda: np.eye(4)[0])

    @property
    def force(self) -> FloatArray:
        """Return the deviation of the friction (n,) [N, N m]."""
        return np.asarray(self.shares @ self.parts)

    def at(self, travelled: FloatArray) -> FloatArray:
        """Return the parts (4, m) at distances travelled [m, rad]; 0 where they are not known."""
        grid = self.begins + self.spacing * np.arange(self.parts.shape[1])
        if not len(grid):
            return np.zeros((len(self.parts), len(travelled)))
        return np.stack([np.interp(travelled, grid, part, left=0.0, right=0.0) for part in self.parts])

    def surrogates(self, travelled: FloatArray, count: int, rng: np.random.Generator) -> FloatArray:
        """Return `count` random deviations (count, n) from what is known, at distances travelled from the rest.

        Where the profile is known they are the random level of the mean of the runs alone.
        """
        moving = np.clip(travelled / self.spacing, 0.0, 1.0)
        known, drawn = self.force, []
        grid = self.spacing * np.arange(len(known) + 1)
        for _ in range(count):
            level = self.level_deviation * rng.standard_normal()
            profile = np.interp(travelled, grid[:-1], random_phases(known, rng), period=grid[-1]) if len(known) else 0.0
            drawn.append((level + np.where(travelled < self.begins, profile, 0.0)) * moving)
        return np.array(drawn)

    def knots(self) -> tuple[FloatArray, FloatArray]:
        """Return positions (k,) [m, rad] where the profile is not known, and the covariance (k, k) of its forces there.

        The covariance is that of the known profile at these distances; without one there are no knots.
        """
        if not len(self.force):
            return np.zeros(0), np.zeros((0, 0))
        positions = np.linspace(0.0, self.begins, _KNOTS)
        centred = self.force - np.mean(self.force)
        lags = np.correlate(centred, centred, mode="full")[len(centred) - 1 :] / len(centred)
        distances = np.abs(positions[:, np.newaxis] - positions)
        covariance = np.interp(distances, self.spacing * np.arange(len(lags)), lags)
        covariance[np.diag_indices(_KNOTS)] *= 1.05  # an estimated covariance need not be positive definite
        values, vectors = np.linalg.eigh(covariance)
        floor = 1e-2 * float(values[-1])
        return positions, (vectors * np.maximum(values, floor)) @ vectors.T


def friction_shares(load_mass: float, stiffness: float, viscous: float) -> FloatArray:
    """Return the shares of the parts of a profile for a load, its drive and its viscous friction.

    The load moves as the motor does, less the wind-up: force of the drive over stiffness.
    """
    return np.array([1.0, -load_mass, -viscous, load_mass / stiffness])


def friction_profile(runs: Sequence[AxisRun], ensemble: StartEnsemble, motor_mass: float) -> FrictionProfile:
    """Return the profile of the settled motion of an ensemble's runs, with the shares of no load.

    The controller keeps the short waves of the friction out of the torque and leaves them in the speed, so that both
    are needed. With a guessed load the profile would pull the fit to the guess, and without the drive's elasticity
    friction near the resonance looks several times as large: the shares are those of the fit.
    """
    spacing = _GRID * ensemble.nominal_speed
    known = [
        part for number, first in ensemble.members if (part := _settled(runs[number], first, ensemble, motor_mass))
    ]
    longest = max((len(position) for position, _ in known), default=0)
    level = _level_deviation(ensemble, [float(np.mean(parts[0])) for _, parts in known])
    begins = max((position[0] for position, _ in known), default=0.0)
    ends = min((position[-1] for position, _ in known if len(position) >= 0.5 * longest), default=0.0)
    count = int((ends - begins) / spacing) + 1
    if longest < _FEWEST or count < _FEWEST:
        return FrictionProfile(np.inf, spacing, np.zeros((4, 0)), level)
    grid = begins + spacing * np.arange(count)
    mean = np.mean([[np.interp(grid, position, part) for part in parts] for position, parts in known], axis=0)
    return FrictionProfile(float(begins), spacing, mean - np.mean(mean, axis=1, keepdims=True), level)


def _settled(
    run: AxisRun, first: int, ensemble: StartEnsemble, motor_mass: float
) -> tuple[FloatArray, FloatArray] | None:
    """Return travelled distance (n,) and the parts of the friction (4, n) of one run's settled motion."""
    from scipy.ndimage import gaussian_filter1d

    def rate(values: FloatArray, order: int) -> FloatArray:
        width = _AVERAGED / run.period
        return np.asarray(gaussian_filter1d(values, width, order=order, mode="nearest") / run.period**order)

    speed, torque = (ensemble.direction * np.nan_to_num(values[first:]) for values in (motor_speed(run), run.torque))
    smooth, acceleration = rate(speed, 0), rate(speed, 1)
    force, curvature = (rate(torque, order) - motor_mass * rate(speed, order + 1) for order in (0, 2))
    # Settled 0.5 s after it reached 95 % of the nominal speed, while it stays within 30 % of it.
    is_fast = smooth >= 0.95 * ensemble.nominal_speed
    begin = int(np.argmax(is_fast)) + round(0.5 / run.period)
    left = np.flatnonzero(np.abs(smooth[begin:] / ensemble.nominal_speed - 1.0) > 0.3)
    # The averages at the end of a log reach beyond it.
    end = min(begin + int(left[0]) if len(left) else len(speed), len(speed) - round(3.0 * _AVERAGED / run.period))
    step = max(round(_GRID / run.period), 1)
    if not is_fast.any() or end - begin < _FEWEST * step:
        return None
    kept = slice(begin, end, step)
    travelled = np.maximum.accumulate((np.cumsum(speed) * run.period)[kept])
    return travelled, np.stack((force, acceleration, smooth, curvature))[:, kept]


def _level_deviation(ensemble: StartEnsemble, levels: Sequence[float]) -> float:
    """Return the standard deviation of the mean friction of the runs [N, N m]."""
    if len(levels) < 2:
        return 0.05 * float(np.max(np.abs(ensemble.mean["torque"])))
    return float(np.std(levels, ddof=1) / math.sqrt(len(levels)))


def random_phases(profile: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return a profile with the same magnitudes of its spectrum and random phases."""
    spectrum = np.abs(np.fft.rfft(profile))
    phases = rng.uniform(0.0, 2.0 * np.pi, len(spectrum))
    surrogate: FloatArray = np.fft.irfft(spectrum * np.exp(1j * phases), len(profile))
    return surrogate
