"""The friction's profile along the travel, and random profiles like it.

The residuals of a start are coloured by this profile, so that standard errors from their scatter alone cover in one
case of ten. What covers: where the profile is not known, it is replaced by profiles with the same spectrum and random
phases, each of which would have given other parameters.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.identification.axis_run import AxisRun
from cdtool.identification.start_ensemble import StartEnsemble, motor_speed
from cdtool.recording import FloatArray
from cdtool.short_repr import short_repr

# The motion is settled this long after it reached this share of the nominal speed, while it stays within a band [s, -].
_SETTLED_AFTER, _REACHED, _BAND = 0.5, 0.95, 0.3
# The grid over the travel: this long at nominal speed; force and speed are averaged over this long [s].
_GRID, _AVERAGED = 0.01, 0.1
# The unknown part has its friction at so many points, linear between them.
_KNOTS = 6
# Fewer grid points are no profile.
_FEWEST = 20


@dataclass(frozen=True, eq=False)
class FrictionProfile:
    """Deviation of the friction from its mean, every `spacing` [m, rad] from `begins`, along the direction of travel.

    `force` (n,) [N, N m] opposes the motion; empty if the motion never settles. `level_deviation`: standard deviation
    of the mean friction of the runs that were averaged. Positions count from the rest before the start.
    """

    begins: float
    spacing: float
    force: FloatArray
    level_deviation: float

    __repr__ = short_repr

    def at(self, travelled: FloatArray) -> FloatArray:
        """Return the known deviation at distances travelled [m, rad]; 0 where it is not known."""
        if not len(self.force):
            return np.zeros(len(travelled))
        grid = self.begins + self.spacing * np.arange(len(self.force))
        return np.interp(travelled, grid, self.force, left=0.0, right=0.0)

    def surrogates(self, travelled: FloatArray, count: int, rng: np.random.Generator) -> FloatArray:
        """Return `count` random deviations (count, n) from what is known, at distances travelled from the rest.

        Where the profile is known they are the random level of the mean of the runs alone.
        """
        moving = np.clip(travelled / self.spacing, 0.0, 1.0)
        unknown = travelled < self.begins
        drawn = np.empty((count, len(travelled)))
        for number in range(count):
            force = np.full(len(travelled), self.level_deviation * rng.standard_normal())
            if len(self.force):
                profile = random_phases(self.force, rng)
                grid = self.spacing * np.arange(len(profile))
                extended = np.interp(travelled, grid, profile, period=self.spacing * len(profile))
                force = force + np.where(unknown, extended, 0.0)
            drawn[number] = force * moving
        return drawn

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


def friction_profile(runs: Sequence[AxisRun], ensemble: StartEnsemble, total_mass: float) -> FrictionProfile:
    """Return the profile of the settled motion of an ensemble's runs: torque minus total mass times acceleration.

    The controller keeps the short waves of the friction out of the torque and leaves them in the speed, so that both
    are needed. It fails above the drive's resonance, where motor and load do not move as one.
    """
    spacing = _GRID * ensemble.nominal_speed
    parts = [
        part for number, first in ensemble.members if (part := _settled(runs[number], first, ensemble, total_mass))
    ]
    longest = max((len(force) for _, force in parts), default=0)
    level = _level_deviation(ensemble, [float(np.mean(force)) for _, force in parts])
    if longest < _FEWEST:
        return FrictionProfile(np.inf, spacing, np.zeros(0), level)
    begins = max(position[0] for position, _ in parts)
    ends = min(position[-1] for position, force in parts if len(force) >= 0.5 * longest)
    count = int((ends - begins) / spacing) + 1
    if count < _FEWEST:
        return FrictionProfile(np.inf, spacing, np.zeros(0), level)
    grid = begins + spacing * np.arange(count)
    mean = np.mean([np.interp(grid, position, force) for position, force in parts], axis=0)
    return FrictionProfile(float(begins), spacing, mean - np.mean(mean), level)


def _settled(
    run: AxisRun, first: int, ensemble: StartEnsemble, total_mass: float
) -> tuple[FloatArray, FloatArray] | None:
    """Return travelled distance and friction of one run's settled motion."""
    sign = float(ensemble.direction)
    speed = sign * np.nan_to_num(motor_speed(run)[first:])
    torque = sign * np.nan_to_num(run.torque[first:])
    width = max(round(_AVERAGED / run.period), 1)
    kernel = np.full(width, 1.0 / width)
    smooth = np.convolve(speed, kernel, mode="same")
    force = np.convolve(torque, kernel, mode="same") - total_mass * np.gradient(smooth, run.period)
    fast = np.flatnonzero(smooth >= _REACHED * ensemble.nominal_speed)
    if not len(fast):
        return None
    begin = int(fast[0]) + round(_SETTLED_AFTER / run.period)
    left = np.flatnonzero(np.abs(smooth[begin:] / ensemble.nominal_speed - 1.0) > _BAND)
    # The averages at the end of a log reach beyond it.
    end = min(begin + int(left[0]) if len(left) else len(speed), len(speed) - width)
    if end - begin < _FEWEST * width // 4:
        return None
    travelled = np.cumsum(speed) * run.period
    step = max(round(_GRID / run.period), 1)
    kept = slice(begin, end, step)
    return np.maximum.accumulate(travelled[kept]), force[kept]


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
