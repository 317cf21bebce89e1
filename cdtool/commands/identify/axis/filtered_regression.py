"""Linear regression of the force in the filtered inverse-dynamics form, with standard errors for coloured residuals.

The equation F = M a + friction is not evaluated sample by sample: each side goes through the same low-pass w with a
finite impulse response. The derivatives fall on the low-pass, w * x'' = w'' * x, so that the position is never
differentiated and the filters cancel. A missing sample spoils only the equations within reach of the response.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import UsageError
from cdtool.commands.identify.estimate import IdentificationError
from cdtool.machines.axis_model.axis_run import AxisRun

IntArray = npt.NDArray[np.int64]

# The low-pass is a moving average applied this many times: a B-spline, whose second derivative is still continuous.
_AVERAGES = 4
# Its corner (-3 dB) times the length of one average [-].
_CORNER = 0.2256
# A fourth difference of white noise has the variance 70 times that of the noise.
_FOURTH_DIFFERENCE = math.sqrt(70.0)


class LowPass:
    """A symmetric low-pass of finite length, with the derivatives of the signal, on one uniform clock.

    `corner` [Hz] (-3 dB) is lowered where the clock with `period` [s] is too slow for it: `corner_hz` has the real one.
    """

    def __init__(self, corner: float, period: float) -> None:
        if not 0.0 < corner < math.inf:
            raise UsageError(f"low-pass of {corner:g} Hz", "give a frequency above 0")
        self.steps = max(round(_CORNER / (corner * period)), 2)
        self.period = period
        self.corner_hz = _CORNER / (self.steps * period)
        average = _integral(self.steps) / self.steps
        difference = np.zeros(self.steps + 1)
        difference[[0, -1]] = np.array([1.0, -1.0]) / (self.steps * period)
        twice = np.convolve(average, average)
        self._weights = np.convolve(twice, twice)
        self._slope = np.convolve(np.convolve(twice, average), difference)
        self._curvature = np.convolve(twice, np.convolve(difference, difference))

    @property
    def reach(self) -> int:
        """Return how many samples to either side an output depends on."""
        return _AVERAGES * self.steps // 2

    def value(self, signal: FloatArray) -> FloatArray:
        """Return the low-passed signal (n,); NaN where a sample within reach is missing."""
        return _convolved(signal, self._weights)

    def slope(self, signal: FloatArray) -> FloatArray:
        """Return the low-passed first derivative (n,) [1/s]; NaN as in `value`."""
        return _convolved(signal, self._slope)

    def curvature(self, signal: FloatArray) -> FloatArray:
        """Return the low-passed second derivative (n,) [1/s2]; NaN as in `value`."""
        return _convolved(signal, self._curvature)

    def slope_noise(self, noise: float) -> float:
        """Return the standard deviation of `slope` for white noise of that standard deviation."""
        return noise * float(np.linalg.norm(self._slope))

    def curvature_noise(self, noise: float) -> float:
        """Return the standard deviation of `curvature` for white noise of that standard deviation."""
        return noise * float(np.linalg.norm(self._curvature))


def _integral(steps: int) -> FloatArray:
    """Return the weights (steps + 1,) of an integral over samples, in steps, exact for cubic signals.

    A difference of the position is the exact integral of the speed: that of the force must be as exact. Simpson's rule
    for 2 steps, else Gregory's.
    """
    if steps == 2:
        return np.array([1.0, 4.0, 1.0]) / 3.0
    weights = np.ones(steps + 1)
    weights[[0, -1]], weights[[1, -2]] = 5.0 / 12.0, 13.0 / 12.0
    return weights


def _convolved(signal: FloatArray, weights: FloatArray) -> FloatArray:
    result = np.full(len(signal), np.nan)
    if len(signal) >= len(weights):
        reach = len(weights) // 2
        result[reach : len(signal) - reach] = np.convolve(signal, weights, mode="valid")
    return result


def known_sections(known: npt.NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return first sample and end of each uninterrupted section of known samples (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], known, [False])).astype(np.int8))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def white_noise(signal: FloatArray) -> float:
    """Return the standard deviation of the white noise of a smooth signal, from its fourth differences.

    It is the root mean square over blocks of the signal: noise may grow with the speed, as that of a jittered clock
    does. In each block the largest differences are left out: they may be motion. Samples at rest, which repeat each
    other, do not count: an encoder is only noisy while it moves. Every second sample counts too, since samples that are
    interpolated between those of a jittered clock share their noise with the next one. 0 with fewer than 10 samples.
    Noise that was filtered before it was logged is underestimated.
    """
    return max(_noise_of(signal), _noise_of(signal[::2]))


def _noise_of(signal: FloatArray) -> float:
    if len(signal) < 10:
        return 0.0
    steps = np.diff(signal)
    repeats = (steps[3:] == 0.0) & (steps[2:-1] == 0.0) & (steps[1:-2] == 0.0) & (steps[:-3] == 0.0)
    differences = np.abs(np.diff(signal, 4))
    differences = differences[np.isfinite(differences) & ~repeats]
    if len(differences) < 6:
        return 0.0
    # In 400 samples the noise is about the same.
    blocks = np.array_split(differences, max(len(differences) // 400, 1))
    variances = [_trimmed_mean_square(block) for block in blocks]
    lengths = [len(block) for block in blocks]
    return math.sqrt(float(np.average(variances, weights=lengths))) / _FOURTH_DIFFERENCE


def _trimmed_mean_square(differences: FloatArray) -> float:
    # At most the largest 5 % are motion rather than noise.
    kept = np.sort(differences)[: max(int(0.95 * len(differences)), 1)]
    # Without its largest 5 % the square of a normal variable has 0.759 of its mean.
    return float(np.mean(kept**2)) / 0.759


@dataclass(frozen=True, eq=False)
class FilteredRun:
    """A run's channels through one low-pass; all arrays (n,) on the run's clock, NaN where they are unknown.

    `inner_speed` is the speed from a low-pass of half the length: friction is a function of it, before the low-pass.
    `unknown_speed` [m/s, rad/s]: below it the sign of the speed is unknown. `position` is the measured one, or the
    integral of the speed. `force_slope`: the derivative of `force` [N/s, N m/s]. `instruments` (n, 4): the `columns` of
    the reference; None without one.
    """

    run: AxisRun
    low_pass: LowPass
    force: FloatArray
    force_slope: FloatArray
    acceleration: FloatArray
    speed: FloatArray
    position: FloatArray
    inner_speed: FloatArray
    instruments: FloatArray | None
    acceleration_noise: float
    unknown_speed: float

    @cached_property
    def columns(self) -> FloatArray:
        """Return what multiplies mass, viscous, Coulomb and constant friction (n, 4)."""
        return _columns(self.low_pass, self.acceleration, self.speed, self.inner_speed, self.unknown_speed)

    @property
    def is_hidden(self) -> bool:
        """Whether the axis moves, but the noise of its speed hides in which direction."""
        known = self.position[np.isfinite(self.position)]
        travel = float(np.ptp(known)) if len(known) else 0.0
        seen_as_rest = self.unknown_speed * self.low_pass.reach * self.run.period
        # A travel is motion if it is three times what the noise alone can look like.
        is_moving = travel > 3.0 * seen_as_rest
        # Noise hides the motion where the sign is unknown up to half of the usual highest speed.
        return is_moving and self.unknown_speed >= 0.5 * _usual_highest(self.inner_speed)

    @cached_property
    def complete(self) -> npt.NDArray[np.bool_]:
        """Return where force, speed, acceleration and the sign of the speed within reach are known or zero (n,)."""
        reached = self.low_pass.value(self.inner_speed)
        return np.isfinite(self.force + self.speed + self.acceleration + reached)

    @cached_property
    def moving(self) -> npt.NDArray[np.bool_]:
        """Return where the run is complete and the axis moves almost all the time within reach (n,)."""
        unknown = np.where(np.isnan(self.inner_speed), np.nan, np.abs(self.inner_speed) < self.unknown_speed)
        weight = self.low_pass.value(unknown)
        # An equation is used if at most a tenth of its weight falls on samples whose sign of speed is unknown.
        moving: npt.NDArray[np.bool_] = np.nan_to_num(weight, nan=1.0) <= 0.1
        return moving & self.complete & (self.stroke >= 0)

    @cached_property
    def usable(self) -> npt.NDArray[np.bool_]:
        """Return where the equation can be used (n,): moving, without starts from rest and stops.

        These last up to 15 % of the stroke's highest speed.
        """
        usable = self.moving.copy()
        for first, last, after_rest, before_rest in self._stroke_ends:
            fast = first + np.flatnonzero(self._start_up_over(first, last))
            if after_rest:
                usable[first : fast[0]] = False
            if before_rest:
                usable[fast[-1] + 1 : last + 1] = False
        return usable

    def _start_up_over(self, first: int, last: int) -> npt.NDArray[np.bool_]:
        speed = np.nan_to_num(np.abs(self.inner_speed[first : last + 1]))
        # From rest to 15 % of the stroke's highest speed, and back, a drive winds up and sticks: motor and load do not
        # move as one.
        over: npt.NDArray[np.bool_] = speed >= 0.15 * np.max(speed)
        return over

    @cached_property
    def _stroke_ends(self) -> list[tuple[int, int, bool, bool]]:
        """Return first and last sample of each stroke, and whether it starts from and ends in rest."""
        reach = self.low_pass.reach
        is_rest = np.abs(self.inner_speed) < self.unknown_speed
        ends = []
        for number in range(int(self.stroke.max(initial=-1)) + 1):
            inside = np.flatnonzero(self.stroke == number)
            first, last = int(inside[0]), int(inside[-1])
            before, after = is_rest[max(first - reach, 0) : first], is_rest[last + 1 : last + 1 + reach]
            ends.append((first, last, _is_rest(before, reach), _is_rest(after, reach)))
        return ends

    @cached_property
    def stroke(self) -> IntArray:
        """Return the number of the stroke of each sample (n,), counted from 0; -1 at rest and where it is unknown.

        A stroke ends where the axis reverses or rests, or where samples are missing.
        """
        direction = np.where(np.abs(self.inner_speed) >= self.unknown_speed, np.sign(self.inner_speed), 0.0)
        direction[np.isnan(self.inner_speed)] = 0.0
        moving = np.flatnonzero(direction != 0.0)
        number = np.full(len(direction), -1, dtype=np.int64)
        if not len(moving):
            return number
        rests = np.diff(moving) > self.low_pass.reach
        turns = np.diff(direction[moving]) != 0.0
        stroke = np.concatenate(([0], np.cumsum(rests | turns)))
        highest = np.zeros(stroke[-1] + 1)
        np.maximum.at(highest, stroke, np.abs(self.inner_speed[moving]))
        # A slower stroke is an oscillation at rest.
        is_stroke = highest >= 0.1 * _usual_highest(self.inner_speed)
        number[moving] = np.where(is_stroke, np.cumsum(is_stroke) - 1, -1)[stroke]
        return number


def _is_rest(near: npt.NDArray[np.bool_], reach: int) -> bool:
    """Whether the axis rests in all of the samples next to a stroke, and there are enough of them."""
    return len(near) == reach and bool(np.all(near))


def _usual_highest(speed: FloatArray) -> float:
    """Return the 95 % quantile of |speed|; 0 without any."""
    known = np.abs(speed[np.isfinite(speed)])
    return float(np.quantile(known, 0.95)) if len(known) else 0.0


def filter_run(run: AxisRun, corner: float, torque_lag: float = 0.0) -> FilteredRun:
    """Return a run's channels through a low-pass of `corner` [Hz].

    Speed and acceleration come from the measured position, or from the speed if the position is missing or is
    its integral. The sign of the speed is unknown below 0.5 % of the usual highest speed, and below 4 standard
    deviations of the speed's noise. `torque_lag` [s], of a low-pass of the torque, is undone: F + lag F'. Raises
    IdentificationError without position and speed.
    """
    low_pass, inner = LowPass(corner, run.period), LowPass(2.0 * corner, run.period)
    by_position = run.position is not None and ("position" not in run.derived or run.speed is None)
    if by_position and run.position is not None:
        source = run.position
        speed, acceleration, inner_speed = low_pass.slope(source), low_pass.curvature(source), inner.slope(source)
        noise = white_noise(source)
        speed_noise, acceleration_noise = inner.slope_noise(noise), low_pass.curvature_noise(noise)
    elif run.speed is not None:
        source = run.speed
        speed, acceleration, inner_speed = low_pass.value(source), low_pass.slope(source), inner.value(source)
        noise = white_noise(source)
        speed_noise, acceleration_noise = noise / math.sqrt(inner.steps), low_pass.slope_noise(noise)
    else:
        raise IdentificationError(f"{run.name}: no speed or position", "map one of them in [channels]")
    # Rounding of a channel relative to its largest value.
    rounding = 1e-12 * float(np.max(np.abs(source[np.isfinite(source)]), initial=0.0))
    speed_noise += inner.slope_noise(rounding) if by_position else rounding
    # Below it the sign of a speed is unknown: one of 16,000 samples of noise is above four standard deviations.
    unknown_speed = max(0.005 * _usual_highest(inner_speed), 4.0 * speed_noise)
    position = run.position
    if position is None:
        position = np.cumsum(np.nan_to_num(source)) * run.period
    force, slope, curvature = low_pass.value(run.torque), low_pass.slope(run.torque), low_pass.curvature(run.torque)
    return FilteredRun(
        run,
        low_pass,
        force + torque_lag * slope,
        slope + torque_lag * curvature,
        acceleration,
        speed,
        low_pass.value(position),
        inner_speed,
        _instruments(run, low_pass, inner, unknown_speed),
        acceleration_noise,
        unknown_speed,
    )


def _instruments(run: AxisRun, low_pass: LowPass, inner: LowPass, unknown_speed: float) -> FloatArray | None:
    """Return the columns (n, 4) of the reference; the position reference, if logged, comes first."""
    position, speed = run.reference_position, run.reference_speed
    if position is not None and "reference_position" not in run.derived and _is_mostly_known(position):
        motion = low_pass.curvature(position), low_pass.slope(position), inner.slope(position)
    elif speed is not None and "reference_speed" not in run.derived and _is_mostly_known(speed):
        motion = low_pass.slope(speed), low_pass.value(speed), inner.value(speed)
    else:
        return None
    return _columns(low_pass, *motion, unknown_speed)


def _columns(
    low_pass: LowPass, acceleration: FloatArray, speed: FloatArray, inner_speed: FloatArray, unknown_speed: float
) -> FloatArray:
    """Return acceleration, speed, low-passed sign of the speed, and 1 (n, 4).

    The sign is straight through the speeds at which it is unknown.
    """
    sign = np.clip(inner_speed / max(unknown_speed, 1e-12), -1.0, 1.0)
    return np.column_stack((acceleration, speed, low_pass.value(sign), np.ones(len(speed))))


def _is_mostly_known(reference: FloatArray) -> bool:
    return bool(np.isfinite(reference).mean() > 0.5)


@dataclass(frozen=True, eq=False)
class LinearFit:
    """Coefficients (p,) of a linear regression, and the residuals (m,) of its equations.

    `condition_number`: of the regressors (m, p) scaled to unit length (least squares), or of the equally scaled product
    of instruments (m, p) and regressors.
    """

    coefficients: FloatArray
    residuals: FloatArray
    condition_number: float
    regressors: FloatArray = field(repr=False)
    instruments: FloatArray = field(repr=False)

    @cached_property
    def influence(self) -> FloatArray:
        """Return (p, m) of coefficients = influence @ force."""
        scale = _lengths(self.regressors)
        product = self.instruments.T @ (self.regressors / scale)
        influence: FloatArray = np.linalg.solve(product, self.instruments.T) / scale[:, None]
        return influence


def fit_linear(regressors: FloatArray, force: FloatArray, instruments: FloatArray | None = None) -> LinearFit:
    """Fit force = regressors @ coefficients by least squares, or by instrumental variables.

    Parameters
    ----------
    regressors : ndarray, shape (m, p)
        One equation per row.
    force : ndarray, shape (m,)
        In N or N m.
    instruments : ndarray, shape (m, p), optional
        Correlated with the regressors, not with the noise. A controller feeds the noise back into the motion, so that
        regressors from measurements are correlated with it, and those from references are not.

    Returns
    -------
    LinearFit

    Raises
    ------
    IdentificationError
        Fewer equations than coefficients, or regressors that depend on each other.

    Notes
    -----
    Soderstrom and Stoica, "System Identification", 1989, chapter 8: Z' (F - X c) = 0 with the instruments Z, for
    least squares Z = X.

    Examples
    --------
    >>> import numpy as np
    >>> regressors = np.column_stack((np.arange(4.0), np.ones(4)))
    >>> fit_linear(regressors, np.array([1.0, 3.0, 5.0, 7.0])).coefficients.round(6).tolist()
    [2.0, 1.0]
    """
    count, unknowns = regressors.shape
    if count < max(unknowns, 1):
        raise IdentificationError(
            f"{count} equations for {unknowns} parameters", "the recordings need more motion at known speed"
        )
    scale = _lengths(regressors)
    scaled = regressors / scale
    given = scaled if instruments is None else instruments / _lengths(instruments)
    condition = _condition(given.T @ scaled, instruments is None)
    if not condition < 1e7:  # they depend on each other
        raise IdentificationError(
            f"the regressors depend on each other (condition number {condition:.3g})",
            "the recordings need more varied motion",
        )
    coefficients = np.asarray(np.linalg.solve(given.T @ scaled, given.T @ force), dtype=np.float64)
    return LinearFit(coefficients / scale, force - scaled @ coefficients, condition, regressors, given)


def _condition(product: FloatArray, is_square_of_regressors: bool) -> float:
    """Return the condition number of the regressors from their Gram matrix, or that of a product with instruments."""
    strengths = np.linalg.svd(product, compute_uv=False)
    ratio = float(strengths[0] / strengths[-1]) if strengths[-1] > 0.0 else math.inf
    return math.sqrt(ratio) if is_square_of_regressors else ratio


def _lengths(columns: FloatArray) -> FloatArray:
    lengths = np.asarray(np.sqrt(np.einsum("ij,ij->j", columns, columns)), dtype=np.float64)
    lengths[lengths == 0.0] = 1.0
    return lengths


def block_covariance(fit: LinearFit, block: IntArray) -> FloatArray:
    """Return the covariance (p, p) of the coefficients for residuals that are correlated within blocks.

    `block` (m,): the number of the block, such as a stroke, of each equation. It is the jackknife over blocks,

        (G - 1)/G sum over g of (c - c_g)(c - c_g)',   c_g: without block g

    which is exact enough with few blocks, where the plain sandwich estimate is too small (MacKinnon, Nielsen and Webb,
    "Cluster-robust inference", Journal of Econometrics 232, 2023). What is the same in every block, such as friction
    over position in equal strokes, is not in it: see `profile_covariance`. NaN with fewer than 2 blocks; the variance
    of a coefficient that depends on a single block is infinite.
    """
    numbers = np.unique(block)
    unknowns = len(fit.coefficients)
    if len(numbers) < 2:
        return np.full((unknowns, unknowns), np.nan)
    changes = np.empty((len(numbers), unknowns))
    scale = _lengths(fit.regressors)
    lost = np.zeros(unknowns, dtype=np.bool_)
    for row, number in enumerate(numbers):
        inside = block == number
        influence = fit.influence[:, inside]
        # (A - A_g)^-1 u_g with A^-1 A_g = influence @ regressors of the block.
        remaining = np.eye(unknowns) - (influence @ fit.regressors[inside]) * scale[:, None] / scale
        left, strength, right = np.linalg.svd(remaining)
        # A block without which nothing of an excitation remains, but for rounding, cannot be left out.
        is_lost = strength < 1e-6
        # Coefficients that take part in a combination that is lost.
        lost |= np.any(np.abs(right[is_lost]) > 1e-3, axis=0)
        change = (influence @ fit.residuals[inside]) * scale
        inverse = np.divide(1.0, strength, out=np.zeros(unknowns), where=~is_lost)
        changes[row] = (right.T @ (inverse * (left.T @ change))) / scale
    covariance: FloatArray = (len(numbers) - 1) / len(numbers) * changes.T @ changes
    covariance[np.diag_indices(unknowns)] = np.where(lost, np.inf, np.diag(covariance))
    return covariance
