"""Identification of an axis's speed controller, P or PI, alone or under a proportional position controller.

The controller is simulated with the logged references and speeds, and its force compared with the logged one (output
error). The loop through the machine stays open in this: noise of the force sensor does not bias the gains.

With the command logged (`reference_torque`), differences of consecutive samples give the starting values::

    u_k - u_(k-1) = Kp (e_k - e_(k-1)) + Ki h e_(k-1)       neither sample slew-limited or clipped

Without it, the measured force is compared, through a first-order lag that is fitted too. Without any reference, only
sections of constant speed are used: whatever the reference was there, it is a polynomial of time in the command.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.commands.identify.axis.observed_slope import observed_slope
from cdtool.commands.identify.axis.speed_controller_kernel import PARAMETER_ORDER, simulate_controller
from cdtool.commands.identify.estimate import (
    Estimate,
    IdentificationError,
    Identified,
    Method,
    Missing,
    NotIdentifiable,
)
from cdtool.machines.axis_model.axis_run import AxisRun
from cdtool.machines.axis_model.parameters import Controller

SECTION = "model.controller"

# A section with fewer samples than this does not show an integral.
_FEWEST_SAMPLES = 100
# The first samples of a section are simulated, not compared: the filters' states are not known there.
_SETTLING_SAMPLES = 20
# Structures are compared on so many samples, parameters fitted to at most this many.
_COMPARED_SAMPLES, _MOST_SAMPLES = 25_000, 400_000
# A command above its limit by more than the log's rounding has another limit, or none.
_BEYOND_LIMIT = 1.005
# The periods of runs that are fitted together differ by less than this share.
_SAME_PERIOD = 0.02
# A value reached by so many samples, all within the log's quantum, is a limit.
_PLATEAU_SAMPLES = 20
# A structure is better if it reduces the cost by so many times what one parameter does by chance, and by this share.
_BETTER_GAIN, _BETTER_SHARE = 20.0, 0.01
# Another source of the speed must leave less than this share of the cost.
_OTHER_SOURCE_SHARE = 0.5
_BLOCKS = 40
# A fit begins with a speed filter at this share of the sampling rate, and with this anti-windup rate [1/s].
_FIRST_CORNER, _FIRST_ANTI_WINDUP = 0.15, 5.0
# A limit is tried with so many residuals.
_TRIAL_EVALUATIONS = 10
# A lag of this share of a period is none.
_LEAST_LAG = 0.2
# A fit with a limit begins with a lag of at most so many periods.
_LONGEST_FIRST_LAG = 15.0
_GAINS = ("speed_gain", "integral_gain")
# Output that is explained to less than a half is that of another structure.
_MOST_UNEXPLAINED = 0.5
# The speed is constant where its mean over a fifth of this time [s] varies by less than this share over all of it.
_STEADY_TIME, _STEADY_SPAN = 1.0, 0.1
# Without the reference, samples at unknown limits are fitted as any other: this share of a gain is added to its error.
_UNKNOWN_LIMITS = 1e-3
# The noise of a torque is compared over these times [s]; a larger ratio of the variances of means is no noise.
_NOISE_WINDOWS, _MORE_THAN_NOISE = (0.05, 0.4), 2.5
# A controller that may be faster than its log is also simulated so many times per sample.
_SUBSTEPS = 10.0
_REFERENCES = ("speed", "position", "torque")
# The damping of a fit, its change from step to step, and the damping at which no step helps.
_FIRST_DAMPING, _DAMPING_STEP, _MOST_DAMPING = 1e-3, 6.0, 1e8
# A fit ends where the residual is the rounding of doubles: this share of the output's sum of squares.
_ROUNDING = 1e-26
# A gain within so many standard errors of 0 is compatible with 0.
_SIGNIFICANT = 3.0
# A speed filter is reported if it leaves less than this share of the logged speed's variance about its mean.
_UNEXPLAINED_SPEED = 0.02


class ControllerKind(Enum):
    """The structure of a controller that the data shows."""

    P = "P"
    PI = "PI"
    CASCADE_P = "P position, P speed"
    CASCADE_PI = "P position, PI speed"


@dataclass(frozen=True, kw_only=True)
class ControllerSettings:
    """How a controller is identified.

    `largest_delay` [samples] between error and command. `largest_relative_error`: a parameter with a larger relative
    standard error is not identifiable. `torque_filter_time` [s]: of the low-pass through which the torque is measured,
    0 for none; if it is not known, force lag and torque filter are known only together. `units`: of force and travel.
    """

    largest_delay: int = 8
    largest_relative_error: float = 0.3
    torque_filter_time: float | None = None
    units: tuple[str, str] = ("N", "m")


@dataclass(frozen=True)
class ControllerFit:
    """An identified controller.

    `controller`: to simulate with; None if the speed gain is not identifiable. `kind`: its structure. `residual_rms`
    [N, N m]: of the command, or of the measured force where that was compared (`is_command`). `delay_samples`: may be
    -1 in a log that writes a command before the error from which it was computed. `lag` [s]: from the command to the
    measured torque, through drive and torque sensor; NaN if unknown. `speed_feed_forward`: whether the position
    reference's derivative is added to the speed reference. `speed_from_position`: whether the speed was computed from
    the position because no logged speed explains the command.
    """

    identified: Identified
    controller: Controller | None
    kind: ControllerKind
    residual_rms: float
    is_command: bool = True
    delay_samples: int = 0
    lag: float = math.nan
    speed_feed_forward: bool = False
    speed_from_position: bool = False


@dataclass(frozen=True, eq=False)
class _Sections:
    """Uninterrupted sections of all runs, one after the other.

    `starts` (sections + 1,): first samples, and n. `inputs` (3, n): see `speed_controller_kernel.INPUTS`. `output`
    (n,): what is compared [N]. `weight` (n,): 1 where it is, else 0. `demand` (n,): the speed that the references
    demand [m/s]. `commands` (sections,): the command at the start of each section [N]; NaN if it is not logged.
    """

    period: float
    starts: np.ndarray[tuple[int], np.dtype[np.int64]]
    inputs: FloatArray
    output: FloatArray
    weight: FloatArray
    demand: FloatArray
    commands: FloatArray

    def __len__(self) -> int:
        return len(self.output)

    @property
    def lengths(self) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
        return np.diff(self.starts)

    def sums(self, values: FloatArray) -> FloatArray:
        """Return the sum of each section (sections, ...)."""
        total: FloatArray = np.add.reduceat(values, self.starts[:-1], axis=0)
        return total

    def spread(self, values: FloatArray) -> FloatArray:
        """Return one value per section (sections, ...) for each of its samples (n, ...)."""
        repeated: FloatArray = np.repeat(values, self.lengths, axis=0)
        return repeated

    def part(self, samples: int) -> _Sections:
        """Return sections evenly chosen, with about so many samples; at least one."""
        count = max(1, round(len(self.lengths) * samples / len(self)))
        if count >= len(self.lengths):
            return self
        chosen = np.unique(np.linspace(0, len(self.lengths) - 1, count).astype(np.int64))
        kept = np.concatenate([np.arange(self.starts[index], self.starts[index + 1]) for index in chosen])
        starts = np.concatenate(([0], np.cumsum(self.lengths[chosen])))
        inputs = np.ascontiguousarray(self.inputs[:, kept])
        values = (self.output[kept], self.weight[kept], self.demand[kept], self.commands[chosen])
        return _Sections(self.period, starts, inputs, *values)


@dataclass(frozen=True)
class _Model:
    """Values of all parameters of the kernel but the period, and the names of those that are fitted."""

    values: Mapping[str, float]
    free: tuple[str, ...]

    def with_values(self, values: Mapping[str, float], free: Iterable[str] = ()) -> _Model:
        """Return the model with other values, and with more free parameters."""
        added = tuple(name for name in free if name not in self.free)
        return _Model({**self.values, **values}, self.free + added)

    def without(self, *names: str) -> _Model:
        """Return the model in which these parameters are at rest: no gain, no limit, no lag."""
        values = {**self.values, **{name: _DEFAULTS[name] for name in names}}
        return _Model(values, tuple(name for name in self.free if name not in names))

    @property
    def is_limited(self) -> bool:
        return math.isfinite(self.values["slew_limit"]) or math.isfinite(self.values["force_limit"])


@dataclass(frozen=True, eq=False)
class _Fit:
    """A fitted model: residual (n,) and its derivatives (n, free), free of the sections' integrals at their starts."""

    sections: _Sections
    model: _Model
    residual: FloatArray
    jacobian: FloatArray

    @property
    def cost(self) -> float:
        return _sum_of_squares(self.residual)

    @property
    def residual_rms(self) -> float:
        return math.sqrt(self.cost / max(float(np.sum(self.sections.weight)), 1.0))

    @property
    def is_exact(self) -> bool:
        """Whether only the rounding of doubles is left."""
        return self.residual_rms < 1e-6 * float(np.std(self.sections.output))


_DEFAULTS = {
    "speed_gain": 0.0,
    "integral_gain": 0.0,
    "position_gain": 0.0,
    "anti_windup_rate": 0.0,
    "slew_limit": math.inf,
    "force_limit": math.inf,
    "speed_filter_hz": math.inf,
    "speed_filter_order": 0.0,
    "error_offset": 0.0,
    "lag": 0.0,
    "delay_samples": 0.0,
    "substeps": 1.0,
}


class _OutputError:
    """The residual of a model on sections, and its derivatives, with each section's first integral eliminated.

    The integrals are those of the least residual (variable projection), found by one linear step, or three where
    limits make the command nonlinear in them.
    """

    def __init__(self, sections: _Sections, model: _Model) -> None:
        self.sections, self.model = sections, model
        self._integrals = np.zeros(len(sections.lengths))
        self._scales = np.array([_scale(sections, model, name) for name in model.free])
        self._probe = 1e-3 * max(float(np.std(sections.output)), 1e-9)

    def fit(self, evaluations: int, tolerance: float = 1e-6) -> _Fit:
        """Return the model of the least residual, after at most so many residuals.

        Levenberg's and Marquardt's method on the normal equations: with few parameters and many samples it takes half
        the time of the singular values of the derivatives. It ends where the cost falls by less than `tolerance`.
        """
        lower, upper = self._bounds()
        vector = np.clip([self.model.values[name] for name in self.model.free] / self._scales, lower, upper)
        residual, jacobian = self._residual(vector), self._jacobian(vector)
        cost, damping = _sum_of_squares(residual), _FIRST_DAMPING
        rounding = _ROUNDING * _sum_of_squares(self.sections.output)
        information, slope = _products(jacobian, jacobian), _products(jacobian, residual)
        for _ in range(evaluations):
            held = ((vector <= lower) & (slope > 0.0)) | ((vector >= upper) & (slope < 0.0))
            trial = np.clip(vector + _damped_step(information, slope, held, damping), lower, upper)
            integrals = self._integrals
            tried = self._residual(trial)
            gain = cost - _sum_of_squares(tried)
            if gain > 0.0:
                vector, residual, jacobian = trial, tried, self._jacobian(trial)
                information, slope = _products(jacobian, jacobian), _products(jacobian, residual)
                cost, damping = cost - gain, damping / _DAMPING_STEP
            else:
                self._integrals = integrals
                damping *= _DAMPING_STEP
            if 0.0 <= gain <= tolerance * cost or cost < rounding or damping > _MOST_DAMPING:
                break
        return _Fit(self.sections, self._model_of(vector), residual, jacobian / self._scales)

    def _bounds(self) -> tuple[FloatArray, FloatArray]:
        lower = np.array([_lower_bound(name, self.sections.period) for name in self.model.free]) / self._scales
        upper = np.array([_upper_bound(name, self.sections.period) for name in self.model.free]) / self._scales
        return lower, upper

    def _model_of(self, vector: FloatArray) -> _Model:
        values = (vector * self._scales).tolist()
        return self.model.with_values(dict(zip(self.model.free, values, strict=True)))

    def _simulated(self, model: _Model, integrals: FloatArray) -> FloatArray:
        numbers = (self.sections.period, *(float(model.values[name]) for name in PARAMETER_ORDER[1:]))
        output = np.empty(len(self.sections))
        sections = self.sections
        simulate_controller(numbers, sections.starts, integrals, sections.commands, sections.inputs, output)
        output -= self.sections.output
        output *= self.sections.weight
        return output

    def _sensitivity(self, model: _Model, residual: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the derivative by the sections' integrals (n,), and the sum of its squares per section."""
        sensitivity = (self._simulated(model, self._integrals + self._probe) - residual) / self._probe
        return sensitivity, np.maximum(self.sections.sums(sensitivity**2), 1e-12)

    def _residual(self, vector: FloatArray) -> FloatArray:
        model = self._model_of(vector)
        residual = self._simulated(model, self._integrals)
        for _ in range(3 if model.is_limited else 1):
            sensitivity, squares = self._sensitivity(model, residual)
            change = self.sections.sums(sensitivity * residual) / squares
            self._integrals = self._integrals - change
            if model.is_limited:
                residual = self._simulated(model, self._integrals)
            else:
                residual = residual - sensitivity * self.sections.spread(change)
        return residual

    def _jacobian(self, vector: FloatArray) -> FloatArray:
        model = self._model_of(vector)
        residual = self._simulated(model, self._integrals)
        sensitivity, squares = self._sensitivity(model, residual)
        jacobian = np.empty((len(residual), len(vector)), order="F")
        for index, name in enumerate(model.free):
            scale = float(self._scales[index])
            step = 1e-5 * max(scale, abs(model.values[name]))
            moved = model.with_values({name: model.values[name] + step})
            jacobian[:, index] = (self._simulated(moved, self._integrals) - residual) * (scale / step)
        overlap = self.sections.sums(sensitivity[:, np.newaxis] * jacobian) / squares[:, np.newaxis]
        jacobian -= sensitivity[:, np.newaxis] * self.sections.spread(overlap)
        return jacobian


def _sum_of_squares(values: FloatArray) -> float:
    # Without the threads of a matrix product, which wait for each other on a busy machine.
    return float(np.einsum("n,n->", values, values))


def _products(columns: FloatArray, values: FloatArray) -> FloatArray:
    """Return columns' (n, p) sums of products with values (n,) or (n, q)."""
    product: FloatArray = np.einsum("np,n...->p...", columns, values)
    return product


def _damped_step(information: FloatArray, slope: FloatArray, held: BoolArray, damping: float) -> FloatArray:
    """Return the damped step of the parameters that are not held by their bounds and that have an effect."""
    free = np.flatnonzero(~held & (np.diag(information) > 0.0))
    step: FloatArray = np.zeros(len(slope))
    if len(free):
        chosen = information[np.ix_(free, free)]
        step[free] = -np.linalg.solve(chosen + damping * np.diag(np.diag(chosen)), slope[free])
    return step


def _scale(sections: _Sections, model: _Model, name: str) -> float:
    value = abs(model.values[name])
    if name == "integral_gain":
        return max(value, abs(model.values["speed_gain"]))
    defaults = {"position_gain": 10.0, "anti_windup_rate": 10.0, "lag": 10.0 * sections.period}
    if name == "error_offset":
        return max(1e-3 * float(np.ptp(sections.inputs[2])), 1e-9)
    return max(value, defaults.get(name, 1e-9))


def _lower_bound(name: str, period: float) -> float:
    # At 0 neither a lag nor a corner has an effect that shows which way to go.
    bounds = {"lag": _LEAST_LAG * period, "speed_filter_hz": 1e-3 / period}
    if name in ("speed_gain", "integral_gain", "position_gain", "error_offset"):
        return -math.inf
    return bounds.get(name, 0.0)


def _upper_bound(name: str, period: float) -> float:
    return 1.0 / period if name == "speed_filter_hz" else math.inf


@dataclass(frozen=True)
class _Uncertainty:
    """Standard errors of a fit's free parameters (free,).

    `statistical`: the larger of two: from the residual's autocorrelation, and from the scatter between blocks.
    `systematic`: the larger of two: how far the part of the residual that no noise explains could move the parameter,
    and by how much other weightings of the residual move it. A wrong structure, or noise in the logged speed, acts
    differently on slow and fast, accelerated and settled samples.
    """

    statistical: FloatArray
    systematic: FloatArray

    @property
    def total(self) -> FloatArray:
        return np.hypot(self.statistical, self.systematic)


def _uncertainty(fit: _Fit, is_command: bool) -> _Uncertainty:
    """Return the standard errors of a fit to a command, which is a digital value, or to a measured torque."""
    scale = np.sqrt(np.maximum(np.sum(fit.jacobian**2, axis=0), 1e-300))
    jacobian = fit.jacobian / scale
    information = jacobian.T @ jacobian
    if np.linalg.cond(information) > 1e12:
        unknown = np.full(len(scale), math.inf)
        return _Uncertainty(unknown, np.zeros(len(scale)))
    inverse = np.linalg.inv(information)
    blocks = _blocks(fit.sections)
    influence = np.add.reduceat(jacobian * fit.residual[:, np.newaxis], blocks, axis=0) @ inverse
    degrees = len(blocks) / max(len(blocks) - len(scale), 1)
    between = degrees * np.sum(influence**2, axis=0)
    correlated = np.diag(inverse @ jacobian.T @ _correlated(fit.residual, jacobian) @ inverse)
    statistical = np.sqrt(np.maximum(between, correlated))
    systematic = math.sqrt(_model_error(fit, is_command)) * np.sqrt(np.diag(inverse))
    for weigh in _weightings(fit.sections):
        weighted, residual = weigh(jacobian), weigh(fit.residual)
        other = np.linalg.pinv(weighted.T @ weighted, hermitian=True)
        other_influence = np.add.reduceat(weighted * residual[:, np.newaxis], blocks, axis=0) @ other
        moved = np.abs(np.sum(other_influence, axis=0))
        scatter = np.sqrt(degrees * np.sum((other_influence - influence) ** 2, axis=0))
        systematic = np.maximum(systematic, np.where(moved > _SIGNIFICANT * scatter, moved, 0.0))
    return _Uncertainty(statistical / scale, systematic / scale)


def _model_error(fit: _Fit, is_command: bool) -> float:
    """Return the sum of squares that no noise of the output explains [N2].

    A command has no noise but its quantum. Noise of a measured torque is flat below a few hertz: the variance of its
    mean falls with the time over which it is taken.
    """
    count = float(np.sum(fit.sections.weight))
    if is_command:
        return max(fit.cost - count * _quantum(fit.sections.output) ** 2 / 12.0, 0.0)
    windows = [max(round(seconds / fit.sections.period), 2) for seconds in _NOISE_WINDOWS]
    short, long = (float(np.var(_mean_over(fit.residual, window))) for window in windows)
    expected = short * windows[0] / windows[1]
    return count * (long - expected) if long > _MORE_THAN_NOISE * expected else 0.0


def _correlated(residual: FloatArray, jacobian: FloatArray) -> FloatArray:
    """Return C J (n, free): C the residual's covariance over lags, up to three times where its correlation ends."""
    from scipy.signal import fftconvolve

    covariance = _autocovariance(residual)
    both_sides = np.concatenate((covariance[:0:-1], covariance))
    return np.asarray(fftconvolve(jacobian, both_sides[:, np.newaxis], mode="same", axes=0))


def _autocovariance(residual: FloatArray) -> FloatArray:
    """Return the covariance by lag (lags,), with weights that fall to 0 so that it stays one (Newey and West)."""
    count = len(residual)
    size = 1 << (2 * count - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(residual, size)) ** 2
    covariance: FloatArray = np.fft.irfft(spectrum, size)[: max(count // 10, 2)] / count
    ended = np.flatnonzero(covariance < 0.05 * covariance[0])
    lags = min(3 * int(ended[0]) if len(ended) else len(covariance), len(covariance))
    kept: FloatArray = covariance[:lags] * (1.0 - np.arange(lags) / max(lags, 1))
    return kept if len(kept) else covariance[:1]


def _blocks(sections: _Sections) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Return the first samples of blocks: the sections, cut where they are few."""
    pieces = max(1, math.ceil(_BLOCKS / len(sections.lengths)))
    cuts = [
        np.linspace(first, end, pieces, endpoint=False).astype(np.int64)
        for first, end in zip(sections.starts[:-1], sections.starts[1:], strict=True)
    ]
    return np.unique(np.concatenate(cuts))


def _weightings(sections: _Sections) -> list[Callable[[FloatArray], FloatArray]]:
    """Return other weightings of residual (n,) and derivatives (n, free): slow parts, accelerated and settled ones."""
    from scipy.signal import lfilter

    def slow(samples: float) -> Callable[[FloatArray], FloatArray]:
        keep = math.exp(-1.0 / samples)
        return lambda values: np.asarray(lfilter([1.0 - keep], [1.0, -keep], values, axis=0))

    def only(share: FloatArray) -> Callable[[FloatArray], FloatArray]:
        return lambda values: values * (share if values.ndim == 1 else share[:, np.newaxis])

    weightings = [slow(10.0), slow(50.0)]
    changing = _changing(sections)
    if 0.02 < np.mean(changing) < 0.98:
        weightings += [only(changing.astype(np.float64)), only((~changing).astype(np.float64))]
    return weightings


def _changing(sections: _Sections) -> BoolArray:
    """Return where the demanded speed changed within the last 0.2 s (n,)."""
    reference = sections.demand
    window = max(round(0.2 / sections.period), 2)
    before = np.maximum(np.arange(len(reference)) - window, np.repeat(sections.starts[:-1], sections.lengths))
    change = np.abs(reference - reference[before])
    return np.asarray(change > 0.02 * float(np.max(change, initial=0.0)))


def _is_better(new: _Fit, old: _Fit) -> bool:
    """Return whether a structure explains more than another on the same sections, beyond what noise would allow it."""
    gain = old.cost - new.cost
    if gain <= _BETTER_SHARE * old.cost or old.is_exact or not np.all(np.any(new.jacobian != 0.0, axis=0)):
        return False
    covariance = _autocovariance(new.residual)
    independent = covariance[0] + 2.0 * float(np.sum(covariance[1:]))
    return bool(gain > _BETTER_GAIN * max(independent, float(covariance[0]), 1e-300))


@dataclass(frozen=True)
class _Source:
    """From which channels error and output of the controller come.

    `is_command`: the output is the logged command, else the measured torque. `from_position`: the speed is the
    position's difference, to be filtered, else the logged one. `has_position_loop`: a position error is known.
    `has_speed_reference`: a speed reference is known. `feed_forward`: it is the position reference's difference.
    """

    is_command: bool
    from_position: bool
    has_position_loop: bool
    has_speed_reference: bool
    feed_forward: bool = False

    @property
    def orders(self) -> tuple[int, ...]:
        """Return the orders of the speed filter that are tried."""
        return (1, 2) if self.from_position else (0,)

    @property
    def channels(self) -> tuple[str, ...]:
        """Return the channels that every sample needs."""
        needed = ["reference_torque" if self.is_command else "torque", "position" if self.from_position else "speed"]
        if self.has_speed_reference:
            needed.append("reference_speed")
        if self.has_position_loop:
            needed += ["position", "reference_position"]
        return tuple(dict.fromkeys(needed))


def _sections_of(runs: Sequence[AxisRun], source: _Source) -> _Sections | None:
    """Return the sections of all runs in which these channels have samples; None without a long enough one."""
    usable = [run for run in runs if _is_logged(run, *source.channels)]
    pieces = [piece for run in usable for piece in _run_pieces(run, source)]
    if not pieces:
        return None
    sections = _joined(pieces, float(np.mean([run.period for run in runs])))
    return replace(sections, commands=sections.output[sections.starts[:-1]]) if source.is_command else sections


def _joined(pieces: Sequence[FloatArray], period: float) -> _Sections:
    """Return pieces (5, samples) as sections: the inputs, the output and the demand."""
    if not pieces:
        raise IdentificationError("no section has torque, speed and reference", "check the channels with cdtool info")
    starts = np.concatenate(([0], np.cumsum([piece.shape[1] for piece in pieces]))).astype(np.int64)
    values = np.ascontiguousarray(np.hstack(pieces))
    weight = np.ones(int(starts[-1]))
    for first in starts[:-1]:
        weight[first : first + _SETTLING_SAMPLES] = 0.0
    unknown = np.full(len(pieces), np.nan)
    return _Sections(period, starts, values[:3], values[3], weight, values[4], unknown)


def _run_pieces(run: AxisRun, source: _Source) -> list[FloatArray]:
    """Return the sections of one run (5, samples): the inputs, the output and the demand."""
    known = run.known(*source.channels)
    if source.from_position or source.has_position_loop:
        known = _known_differences(known)
    nothing = np.zeros(len(run))
    position = _values(run, "position", source.from_position or source.has_position_loop)
    reference = _values(run, "reference_position", source.has_position_loop)
    demanded = _difference(reference) / run.period
    speed_reference = _values(run, "reference_speed", source.has_speed_reference)
    rows = (
        speed_reference + demanded if source.feed_forward else speed_reference,
        reference - position if source.has_position_loop else nothing,
        _difference(position) / run.period if source.from_position else _values(run, "speed", True),
        _values(run, "reference_torque" if source.is_command else "torque", True),
        speed_reference if source.has_speed_reference else demanded,
    )
    return _cut(known, rows)


def _known_differences(known: BoolArray) -> BoolArray:
    """Return where a sample and the one before it are known (n,)."""
    return known & np.concatenate(([False], known[:-1]))


def _cut(known: BoolArray, rows: Sequence[FloatArray]) -> list[FloatArray]:
    """Return the uninterrupted known sections of the rows, each (rows, samples), that are long enough."""
    stacked = np.vstack(rows)
    edges = np.flatnonzero(np.diff(np.concatenate(([False], known, [False])).astype(np.int8)))
    return [stacked[:, a:b] for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a >= _FEWEST_SAMPLES]


def _values(run: AxisRun, channel: str, used: bool) -> FloatArray:
    values: FloatArray | None = getattr(run, channel)
    return values if used and values is not None else np.zeros(len(run))


def _difference(values: FloatArray) -> FloatArray:
    return np.diff(values, prepend=values[:1])


@dataclass(frozen=True)
class _Search:
    """A fit on part of the runs, its source of errors and outputs, and whether a plateau shows its slew limit."""

    source: _Source
    fit: _Fit


def _search(runs: Sequence[AxisRun], settings: ControllerSettings) -> _Search | None:
    """Return the structure that explains the output best; None without sections in which all is known."""
    found: _Search | None = None
    for source in _sources(runs):
        if found is not None and _needs_no_other(found):
            break
        sections = _sections_of(runs, source)
        if sections is None:
            continue
        sections = sections.part(_COMPARED_SAMPLES)
        starts = [_starting_model(sections, source, order, settings.largest_delay) for order in source.orders]
        if found is not None:
            starts = [_with_limits_of(found.fit.model, model) for model in starts]
        fit = min((_OutputError(sections, model).fit(25) for model in starts), key=lambda fit: fit.cost)
        if found is None or fit.cost < _share_needed(source, found.source) * found.fit.cost:
            found = _Search(source, _with_structure(fit, source, settings))
    return found


def _with_limits_of(model: _Model, other: _Model) -> _Model:
    """Return the other model with the limits of a model, and its gains."""
    limits = [name for name in ("slew_limit", "force_limit", "anti_windup_rate") if name in model.free]
    taken = (*limits, "speed_gain", "integral_gain")
    return other.with_values({name: model.values[name] for name in taken}, limits)


def _sources(runs: Sequence[AxisRun]) -> list[_Source]:
    """Return the channels from which the controller's error can be computed, the likeliest first."""
    logged, measured = (any(_is_logged(run, name) for run in runs) for name in ("speed", "position"))
    references = {name: any(_is_logged(run, "reference_" + name) for run in runs) for name in _REFERENCES}
    loop = references["position"] and measured
    if not (references["speed"] or loop):
        return []
    ways = ([False] if logged else []) + ([True] if measured else [])
    return [
        _Source(references["torque"], from_position, loop, references["speed"], feed_forward)
        for from_position in ways
        for feed_forward in ((False,) if references["speed"] else (False, True))
    ]


def _is_logged(run: AxisRun, *channels: str) -> bool:
    """Return whether a run has these channels, none of them computed from another."""
    return all(getattr(run, channel) is not None and channel not in run.derived for channel in channels)


# The speed's own channel, without a controller's output.
_LOGGED_ALONE = _Source(is_command=False, from_position=False, has_position_loop=False, has_speed_reference=False)


def _share_needed(source: _Source, before: _Source) -> float:
    """Return the cost ratio below which a less plausible source is preferred."""
    return 1.0 if source.from_position == before.from_position else _OTHER_SOURCE_SHARE


def _needs_no_other(search: _Search) -> bool:
    """Return whether no other source of the error can explain much more: what is left is noise of the torque."""
    is_noise = not search.source.is_command and _model_error(search.fit, False) == 0.0
    return _explains_all(search.fit) or (is_noise and _is_explained(search.fit))


def _explains_all(fit: _Fit) -> bool:
    """Return whether the residual is within 1e-4 of the output's variance: no other source is needed."""
    output = fit.sections.output
    return fit.residual_rms**2 < 1e-4 * float(np.var(output))


def _with_structure(fit: _Fit, source: _Source, settings: ControllerSettings) -> _Fit:
    """Return the fit with the limits, the delay and the offset of the error that explain more."""
    fit = _with_offset(fit)
    suggested = fit.model.is_limited
    for name in ("force_limit", "slew_limit"):
        if name in fit.model.free:
            fit = _without_inactive(fit, name)
    if not suggested and not _explains_all(fit):
        fit = _with_limit(fit, "slew_limit", _slew_candidates(fit, source))
    if "force_limit" not in fit.model.free and not _explains_all(fit):
        limited = _with_limit(fit, "force_limit", _force_candidates(fit))
        fit = fit if source.is_command and _exceeds_its_limit(limited) else limited
        if "slew_limit" not in fit.model.free and "force_limit" in fit.model.free:
            fit = _with_limit(fit, "slew_limit", _slew_candidates(fit, source))
    fit = _with_delay(fit, source, settings.largest_delay)
    if 0.0 < fit.model.values["lag"] < 1.01 * _LEAST_LAG * fit.sections.period:
        fit = _OutputError(fit.sections, fit.model.without("lag")).fit(15)
    return _with_offset(fit)


def _exceeds_its_limit(fit: _Fit) -> bool:
    """Whether the logged command is larger than the force limit of the fit: then it has no such limit."""
    limit = fit.model.values["force_limit"] if "force_limit" in fit.model.free else math.inf
    return _largest(fit.sections.output) > _BEYOND_LIMIT * limit


def _with_offset(fit: _Fit) -> _Fit:
    """Return the fit with an offset of the error, as a bias of the logged speed has it, where it explains more."""
    if "error_offset" in fit.model.free or fit.is_exact:
        return fit
    offset = _OutputError(fit.sections, fit.model.with_values({}, ("error_offset",))).fit(15)
    return offset if _is_better(offset, fit) else fit


def _starting_model(sections: _Sections, source: _Source, order: int, largest_delay: int) -> _Model:
    """Return gains from a linear regression, and the parameters to be fitted."""
    corner = _FIRST_CORNER / sections.period
    values = {**_DEFAULTS, "speed_filter_order": float(order)}
    free = ["speed_gain", "integral_gain"]
    if order:
        values["speed_filter_hz"] = corner
        free.append("speed_filter_hz")
    if source.has_position_loop:
        free.append("position_gain")
    if not source.is_command:
        values["lag"] = 2.0 * sections.period
        free.append("lag")
    speed = _smoothed(sections.inputs[2], math.exp(-2.0 * math.pi * corner * sections.period) if order else 0.0)
    error = sections.inputs[0] - speed
    delays = range(-1, largest_delay + 1) if source.is_command else (0,)
    regressions = [_regression(sections, error, source.is_command, delay) for delay in delays]
    limits = _plateaus(sections) if source.is_command else {}
    if limits:
        values |= {**limits, "anti_windup_rate": _FIRST_ANTI_WINDUP}
        free += [*limits, "anti_windup_rate"]
    _, delay, gains = min(regressions, key=lambda regression: regression[0])
    values["delay_samples"] = float(delay)
    values["speed_gain"] = gains[0] if gains[0] > 0.0 else float(np.std(sections.output) / max(np.std(error), 1e-12))
    values["integral_gain"] = gains[1]
    values["position_gain"] = gains[2] / values["speed_gain"] if source.has_position_loop else 0.0
    return _Model(values, tuple(free))


def _regression(
    sections: _Sections, error: FloatArray, differences: bool, delay: int
) -> tuple[float, int, tuple[float, float, float]]:
    """Return residual variance, delay and (Kp, Ki, Kp position gain) from differences of the output, or from levels.

    Differences leave out the pairs in a plateau of the largest ones: the slew limit. Of levels, each section's mean is
    subtracted.
    """
    earlier = np.roll(np.vstack((error, sections.inputs[1])), delay, axis=1)
    used = np.ones(len(sections), dtype=np.bool_)
    for shift in range(-abs(delay) - 1, abs(delay) + 2):
        used[np.clip(sections.starts + shift, 0, len(sections) - 1)] = False
    if differences:
        change = np.diff(sections.output, prepend=sections.output[:1])
        plateau = _plateau(np.abs(change[used]))
        if plateau is not None:
            used &= np.abs(change) < (1.0 - 1e-3) * plateau - _quantum(sections.output)
        columns = np.vstack(
            (
                np.diff(earlier[0], prepend=0.0),
                np.roll(earlier[0], 1) * sections.period,
                np.diff(earlier[1], prepend=0.0),
                np.ones(len(sections)),
            )
        )
        target = change
    else:
        columns = np.vstack((earlier[0], np.cumsum(earlier[0]) * sections.period, earlier[1]))
        means = sections.sums(columns.T) / sections.lengths[:, np.newaxis]
        columns = columns - sections.spread(means).T
        target = sections.output - sections.spread(sections.sums(sections.output) / sections.lengths)
    gains = np.linalg.lstsq(columns[:, used].T, target[used], rcond=None)[0]
    left = target[used] - gains @ columns[:, used]
    return float(np.mean(left**2)) if used.any() else math.inf, delay, (gains[0], gains[1], gains[2])


def _smoothed(values: FloatArray, keep: float) -> FloatArray:
    from scipy.signal import lfilter

    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], values))


def _quantum(values: FloatArray) -> float:
    """Return the resolution of logged values: the smallest step between two of them beyond rounding."""
    steps = np.diff(np.unique(values))
    steps = steps[steps > 1e-9 * max(float(np.max(np.abs(values), initial=0.0)), 1e-300)]
    return float(np.min(steps, initial=math.inf)) if len(steps) else 0.0


def _plateau(values: FloatArray) -> float | None:
    """Return the value in the upper half at which most lie within the quantum; None where no 20 do."""
    ordered = np.sort(values)
    if not len(ordered) or ordered[-1] <= 0.0:
        return None
    width = max(2.0 * _quantum(ordered), 1e-6 * float(ordered[-1]))
    upper = ordered[ordered > 0.5 * ordered[-1]]
    within = np.searchsorted(upper, upper + width, side="right") - np.arange(len(upper))
    most = int(np.argmax(within))
    around = np.searchsorted(upper, upper[most] + 10.0 * width) - np.searchsorted(upper, upper[most] - 10.0 * width)
    if within[most] < _PLATEAU_SAMPLES or within[most] < 0.5 * around:
        return None
    return float(np.median(upper[most : most + within[most]]))


def _steps(sections: _Sections) -> FloatArray:
    """Return the size of the output's change from each sample to the next within a section, else 0 (n - 1,)."""
    change: FloatArray = np.abs(np.diff(sections.output))
    change[sections.starts[1:-1] - 1] = 0.0
    return change


def _plateaus(sections: _Sections) -> dict[str, float]:
    """Return the limits that plateaus of a command suggest, by name: of its steps, and of its size."""
    slew, force = _plateau(_steps(sections)), _plateau(np.abs(sections.output))
    limits = {"slew_limit": slew / sections.period} if slew is not None else {}
    return {**limits, "force_limit": force} if force is not None else limits


def _slew_candidates(fit: _Fit, source: _Source) -> list[float]:
    """Return slew limits to try [N/s]: high quantiles of the slope over several samples, so that noise is less."""
    sections = fit.sections
    lags = min(fit.model.values["lag"] / sections.period, _LONGEST_FIRST_LAG)
    window = 4 if source.is_command else max(4, round(3.0 * lags))
    if window >= len(sections) // 4:
        return []
    smooth = sections.output if source.is_command else _mean_over(sections.output, window)
    slope = np.abs(smooth[window:] - smooth[:-window]) / (window * sections.period)
    return [float(value) for value in np.quantile(slope, (0.8, 0.9, 0.95, 0.99)) if value > 0.0]


def _without_inactive(fit: _Fit, name: str) -> _Fit:
    """Return the fit without a limit that a plateau suggested, unless the limit explains more."""
    other = "slew_limit" if name == "force_limit" else "force_limit"
    names = (name,) if other in fit.model.free else (name, "anti_windup_rate")
    free = _OutputError(fit.sections, fit.model.without(*names)).fit(25)
    return fit if _is_better(fit, free) else free


def _mean_over(values: FloatArray, window: int) -> FloatArray:
    from scipy.ndimage import uniform_filter1d

    return np.asarray(uniform_filter1d(values, window))


def _force_candidates(fit: _Fit) -> list[float]:
    """Return a force limit to try [N]: that above which only noise is."""
    largest = float(np.quantile(np.abs(fit.sections.output), 0.995))
    return [largest] if largest > 0.0 else []


def _with_limit(fit: _Fit, name: str, candidates: Sequence[float]) -> _Fit:
    """Return the fit with this limit if one of the candidates explains more, else the fit as it is."""
    best = fit
    for value in candidates:
        rate = fit.model.values["anti_windup_rate"] or _FIRST_ANTI_WINDUP
        # A limit that is not in the model looks like a lag.
        lag = min(fit.model.values["lag"], _LONGEST_FIRST_LAG * fit.sections.period)
        changed = {name: value, "anti_windup_rate": rate, "lag": lag}
        model = fit.model.with_values(changed, (name, "anti_windup_rate"))
        limited = _OutputError(fit.sections, model).fit(_TRIAL_EVALUATIONS, 1e-4)
        if limited.cost < best.cost:
            best = limited
    if not _is_better(best, fit):
        return fit
    return _OutputError(fit.sections, best.model).fit(25)


def _with_delay(fit: _Fit, source: _Source, largest: int) -> _Fit:
    """Return the fit at the delay from which a sample more or less is worse."""
    for step in (1, -1):
        while not fit.is_exact and -1 <= fit.model.values["delay_samples"] + step <= largest:
            moved = fit.model.with_values({"delay_samples": fit.model.values["delay_samples"] + step})
            if not source.is_command and moved.values["delay_samples"] < 0.0:
                break
            other = _OutputError(fit.sections, moved).fit(15)
            if not _is_better(other, fit):
                break
            fit = other
    return fit


def identify_controller(runs: Sequence[AxisRun], settings: ControllerSettings | None = None) -> ControllerFit:
    """Identify the speed controller of one axis from impact-free runs.

    Parameters
    ----------
    runs : sequence of AxisRun
        Runs of the same axis with the same controller settings and sampling period.
    settings : ControllerSettings, optional
        Limits of the search, units, and the time constant of the torque's low-pass where it is known.

    Returns
    -------
    ControllerFit
        Estimates under the keys of `Controller`, in the section "model.controller". An integral gain or a position
        gain compatible with zero is in neither list: the controller has none, see `kind`.

    Raises
    ------
    IdentificationError
        There are no runs, their sampling periods differ by more than 2 %, or the output falls where the speed error
        rises: a channel has the wrong sign.

    Notes
    -----
    Standard errors are the larger of two, from the residual's autocorrelation and from the scatter between blocks of
    the runs. Added are how far a parameter moves if slow, accelerated or settled samples alone are compared, if the
    controller is faster than the log, and if the logged speed is noisier; for a logged command also how far its whole
    residual could move it. They do not cover what noise of a measured torque hides: a logged speed with a low-pass of
    its own at 20 Hz moves the integral gain of the simulated gate by 3 %, at 5 Hz by 8 %, where no position is logged
    and the lag comes out as 0.

    Without references, a P position controller and the integral of a P speed controller act alike at constant speed:
    the result is the PI controller that acts alike.
    """
    settings = settings or ControllerSettings()
    _check(runs)
    search = _search(runs, settings)
    if search is None:
        return _without_references(runs, settings)
    sections = _sections_of(runs, search.source)
    assert sections is not None
    fit = _OutputError(sections.part(_MOST_SAMPLES), search.fit.model).fit(50, 1e-9)
    fit, uncertainty = _without_zeros(fit, search.source.is_command)
    fit, uncertainty = _with_unknown_rate(fit, uncertainty, search.source.is_command)
    if not (search.source.is_command or search.source.from_position):
        uncertainty = _with_noisy_speed(fit, uncertainty)
    return _reported(runs, replace(search, fit=fit), uncertainty, settings)


def _check(runs: Sequence[AxisRun]) -> None:
    if not runs:
        raise IdentificationError("no runs to identify a controller from", "give at least one impact-free recording")
    shortest, longest = min(runs, key=lambda run: run.period), max(runs, key=lambda run: run.period)
    if longest.period > (1.0 + _SAME_PERIOD) * shortest.period:
        raise IdentificationError(
            f"{shortest.name} has a sample every {shortest.period:.4g} s, {longest.name} every {longest.period:.4g} s",
            "identify a controller from recordings of one sampling rate",
        )


def _without_zeros(fit: _Fit, is_command: bool) -> tuple[_Fit, _Uncertainty]:
    """Return the fit without the gains that are compatible with zero, and its uncertainty."""
    uncertainty = _uncertainty(fit, is_command)
    for name in ("error_offset", "position_gain", "integral_gain"):
        if name not in fit.model.free:
            continue
        value = fit.model.values[name]
        if abs(value) > _SIGNIFICANT * uncertainty.total[fit.model.free.index(name)]:
            continue
        fit = _OutputError(fit.sections, fit.model.without(name)).fit(50, 1e-9)
        uncertainty = _uncertainty(fit, is_command)
    return fit, uncertainty


def _with_unknown_rate(fit: _Fit, uncertainty: _Uncertainty, is_command: bool) -> tuple[_Fit, _Uncertainty]:
    """Return the better fit of two, a controller as fast as the log and a faster one, with their difference.

    The difference is a systematic error where the data does not decide. Where it decides for the faster one, its true
    rate remains unknown.
    """
    if fit.is_exact:
        return fit, uncertainty
    faster = _OutputError(fit.sections, fit.model.with_values({"substeps": _SUBSTEPS})).fit(50, 1e-9)
    moved = _distance(fit, faster)
    if fit.cost < _OTHER_SOURCE_SHARE * faster.cost:
        return fit, uncertainty
    if faster.cost < fit.cost:
        decided = faster.cost < _OTHER_SOURCE_SHARE * fit.cost
        fit, uncertainty = faster, _uncertainty(faster, is_command)
        moved = moved / _SUBSTEPS if decided else moved
    return fit, replace(uncertainty, systematic=np.hypot(uncertainty.systematic, moved))


def _with_noisy_speed(fit: _Fit, uncertainty: _Uncertainty) -> _Uncertainty:
    """Return the uncertainty with what noise of the logged speed may have done, which the controller never saw.

    As much noise again moves the parameters about as far (Cook and Stefanski's simulation extrapolation). Its level is
    that of white noise with the fourth differences of the logged speed, so at least what it is.
    """
    sections = fit.sections
    fourth = np.diff(sections.inputs[2], 4)
    # Median, as at the edges of sections the differences are large; 70 is the sum of the squared weights.
    deviation = float(np.median(np.abs(fourth))) / (0.6745 * math.sqrt(70.0))
    if deviation <= 0.0:
        return uncertainty
    inputs = sections.inputs.copy()
    inputs[2] += deviation * np.random.default_rng(0).standard_normal(len(sections))
    noisier = _OutputError(replace(sections, inputs=inputs), fit.model).fit(50, 1e-9)
    return replace(uncertainty, systematic=np.hypot(uncertainty.systematic, _distance(fit, noisier)))


def _distance(fit: _Fit, other: _Fit) -> FloatArray:
    """Return how far apart the free parameters of two fits are (free,)."""
    return np.array([abs(other.model.values[name] - fit.model.values[name]) for name in fit.model.free])


@dataclass(frozen=True)
class _Measured:
    """A value with its standard error."""

    value: float
    error: float


def _reported(
    runs: Sequence[AxisRun], search: _Search, uncertainty: _Uncertainty, settings: ControllerSettings
) -> ControllerFit:
    """Return a fit's parameters as estimates, or as not identifiable with what is missing."""
    fit, source = search.fit, search.source
    model, period = fit.model, fit.sections.period
    errors = dict(zip(model.free, uncertainty.total.tolist(), strict=True))
    fitted = {name: _Measured(model.values[name], errors[name]) for name in model.free}
    speed_filter, order = _speed_filter(runs, fitted, source, model)
    lag = fitted.get("lag", _Measured(model.values["lag"], math.nan))
    if source.is_command:
        lag = _force_lag(runs)
    report = _Report(settings, period)
    if model.values["speed_gain"] < -_SIGNIFICANT * errors["speed_gain"]:
        raise IdentificationError(
            f"{runs[0].name}: the controller's output falls where the speed error rises",
            "check the signs (scale) of torque, speed and references in [channels]",
        )
    needed = Missing.ACCELERATION
    if not _is_explained(fit):
        # At a constant reference no structure can be told from another one.
        fitted, needed = {}, Missing.OTHER_CONTROLLER if np.ptp(fit.sections.demand) > 0.0 else Missing.ACCELERATION
    for key in ("speed_gain", "integral_gain", "position_gain"):
        if key == "speed_gain" or key in model.free:
            report.add(key, fitted.get(key), (needed,), {"unexplained_share": _unexplained(fit)})
    limits = (Missing.SATURATION,) if source.is_command else (Missing.SATURATION, Missing.REFERENCE_TORQUE)
    report.add("anti_windup_rate", fitted.get("anti_windup_rate"), limits, {})
    slope = observed_slope(runs, source.is_command, model.values["lag"])
    report.add("slew_limit", fitted.get("slew_limit"), limits, {"largest_n_per_s": slope})
    report.add("force_limit", fitted.get("force_limit"), limits, {"largest_n": _largest(fit.sections.output)})
    report.add("speed_filter_hz", speed_filter, (Missing.HIGHER_RATE,), {})
    report.add_lag(lag)
    delay = _Measured(max(model.values["delay_samples"], 0.0) * period, period / math.sqrt(12.0))
    report.add("delay", delay if source.is_command else None, (Missing.REFERENCE_TORQUE,), {"lag_s": lag.value})
    return ControllerFit(
        identified=report.identified,
        controller=report.controller(model, speed_filter, order, lag.value),
        kind=_kind(model),
        residual_rms=fit.residual_rms,
        is_command=source.is_command,
        delay_samples=int(model.values["delay_samples"]),
        lag=lag.value,
        speed_feed_forward=source.feed_forward,
        speed_from_position=source.from_position,
    )


def _kind(model: _Model) -> ControllerKind:
    cascade, integral = "position_gain" in model.free, "integral_gain" in model.free
    if cascade:
        return ControllerKind.CASCADE_PI if integral else ControllerKind.CASCADE_P
    return ControllerKind.PI if integral else ControllerKind.P


class _Report:
    """Estimates, and what is not identifiable, collected key by key."""

    def __init__(self, settings: ControllerSettings, period: float, method: Method = Method.OUTPUT_ERROR) -> None:
        self.settings, self.period, self.method = settings, period, method
        self._estimates: list[Estimate] = []
        self._not_identifiable: list[NotIdentifiable] = []

    @property
    def identified(self) -> Identified:
        return Identified(tuple(self._estimates), tuple(self._not_identifiable))

    def add(
        self, key: str, measured: _Measured | None, missing: tuple[Missing, ...], numbers: Mapping[str, float]
    ) -> None:
        """Add an estimate, or that it is missing or too uncertain."""
        if measured is None:
            self._not_identifiable.append(NotIdentifiable(SECTION, key, missing, numbers))
            return
        if self.method is Method.LEAST_SQUARES:
            measured = replace(measured, error=math.hypot(measured.error, _UNKNOWN_LIMITS * measured.value))
        relative = measured.error / abs(measured.value) if measured.value else math.inf
        # A delay of 0 is known as well as any other.
        certain = relative <= self.settings.largest_relative_error or key in ("delay", "force_lag")
        if certain and measured.value >= 0.0 and math.isfinite(measured.error):
            self._estimates.append(Estimate(SECTION, key, measured.value, measured.error, self._unit(key), self.method))
            return
        numbers = {**numbers, "value": measured.value, "relative_error": relative}
        self._not_identifiable.append(NotIdentifiable(SECTION, key, missing, numbers))

    def add_lag(self, lag: _Measured) -> None:
        """Add the force lag: the lag between command and measured torque without the torque's own low-pass."""
        known = self.settings.torque_filter_time
        if known is None or not math.isfinite(lag.error):
            missing: tuple[Missing, ...] = ()
            if not math.isfinite(lag.value):
                missing = (Missing.REFERENCE_TORQUE,)
            elif known is None:  # the lag contains that of the low-pass
                missing = (Missing.TORQUE_FILTER,)
            self._not_identifiable.append(NotIdentifiable(SECTION, "force_lag", missing, {"lag_s": lag.value}))
            return
        self.add("force_lag", _Measured(max(lag.value - known, 0.0), lag.error), (), {})

    def controller(self, model: _Model, speed_filter: _Measured | None, order: int, lag: float) -> Controller | None:
        """Return the controller to simulate with; None without a speed gain."""
        if "speed_gain" not in self.identified:
            return None
        known = self.settings.torque_filter_time
        keys = [estimate.key for estimate in self.identified.estimates]
        gains = {name: max(model.values[name], 0.0) for name in ("integral_gain", "position_gain") if name in keys}
        limits = {name: model.values[name] for name in ("slew_limit", "force_limit") if name in keys}
        # Faster, the sampled integral would overshoot.
        rate = min(model.values["anti_windup_rate"], 0.5 / self.period) if limits else 0.0
        filtered = speed_filter is not None and "speed_filter_hz" in keys
        return Controller(
            period=self.period,
            speed_gain=model.values["speed_gain"],
            anti_windup_rate=rate,
            speed_filter_hz=speed_filter.value if speed_filter is not None and filtered else math.inf,
            speed_filter_order=order if filtered else 0,
            force_lag=max(lag - known, 0.0) if known is not None and math.isfinite(lag) else 0.0,
            delay=max(model.values["delay_samples"], 0.0) * self.period,
            **gains,
            **limits,
        )

    def _unit(self, key: str) -> str:
        force, length = self.settings.units
        return {
            "speed_gain": f"{force} s/{length}",
            "integral_gain": f"{force}/{length}",
            "position_gain": "1/s",
            "anti_windup_rate": "1/s",
            "slew_limit": f"{force}/s",
            "force_limit": force,
            "speed_filter_hz": "Hz",
        }.get(key, "s")


def _unexplained(fit: _Fit) -> float:
    """Return the residual's share in the output's variation within its sections, of means over 0.1 s [-].

    White noise of the sensor, which no structure explains, is small in these.
    """
    sections = fit.sections
    window = max(round(0.1 / sections.period), 5)
    means = sections.sums(sections.output) / sections.lengths
    varying = _mean_over((sections.output - sections.spread(means)) * sections.weight, window)
    left = _mean_over(fit.residual, window)
    return float(left @ left) / max(float(varying @ varying), 1e-300)


def _is_explained(fit: _Fit) -> bool:
    return _unexplained(fit) < _MOST_UNEXPLAINED


def _largest(values: FloatArray) -> float:
    return float(np.max(np.abs(values), initial=0.0))


def _speed_filter(
    runs: Sequence[AxisRun], fitted: Mapping[str, _Measured], source: _Source, model: _Model
) -> tuple[_Measured | None, int]:
    """Return the corner of the controller's speed filter [Hz], and its order; None where it is not known."""
    if source.from_position:
        return fitted.get("speed_filter_hz"), int(model.values["speed_filter_order"])
    if model.values["delay_samples"] < 0.0:
        # The logged speed is later than the controller's: it went through other filters.
        return None, 0
    pieces = [
        piece
        for run in runs
        if _is_logged(run, "speed", "position") and run.speed is not None and run.position is not None
        for piece in _speed_pieces(run, run.speed, run.position)
    ]
    if not pieces:
        return None, 0
    sections = _joined(pieces, float(np.mean([run.period for run in runs]))).part(_COMPARED_SAMPLES)
    values = {**_DEFAULTS, "speed_gain": 1.0, "speed_filter_hz": _FIRST_CORNER / sections.period}
    models = [_Model({**values, "speed_filter_order": order}, ("speed_filter_hz",)) for order in (1.0, 2.0)]
    fit = min((_OutputError(sections, model).fit(30, 1e-12) for model in models), key=lambda fit: fit.cost)
    if _unexplained(fit) > _UNEXPLAINED_SPEED:
        return None, 0
    corner = _Measured(fit.model.values["speed_filter_hz"], float(_uncertainty(fit, True).total[0]))
    return corner, int(fit.model.values["speed_filter_order"])


def _speed_pieces(run: AxisRun, speed: FloatArray, position: FloatArray) -> list[FloatArray]:
    known = _known_differences(run.known("speed", "position"))
    nothing = np.zeros(len(run))
    return _cut(known, (nothing, nothing, -_difference(position) / run.period, speed, nothing))


def _force_lag(runs: Sequence[AxisRun]) -> _Measured:
    """Return the lag from the logged command to the measured torque [s]; NaN where none is seen."""
    pieces = [
        piece for run in runs if run.reference_torque is not None for piece in _torque_pieces(run, run.reference_torque)
    ]
    sections = _joined(pieces, float(np.mean([run.period for run in runs]))).part(_COMPARED_SAMPLES)
    values = {**_DEFAULTS, "speed_gain": 1.0, "lag": 5.0 * sections.period}
    fit = _OutputError(sections, _Model(values, ("speed_gain", "lag"))).fit(30)
    if not _is_explained(fit):
        return _Measured(math.nan, math.nan)
    return _Measured(fit.model.values["lag"], float(_uncertainty(fit, False).total[1]))


def _torque_pieces(run: AxisRun, command: FloatArray) -> list[FloatArray]:
    nothing = np.zeros(len(run))
    return _cut(run.known("torque", "reference_torque"), (command, nothing, nothing, run.torque, command))


def _without_references(runs: Sequence[AxisRun], settings: ControllerSettings) -> ControllerFit:
    """Identify the gains from sections of constant speed, in which the reference is a slow polynomial of time."""
    is_command = any(run.reference_torque is not None for run in runs)
    pieces = [piece for run in runs for piece in _steady_pieces(run, is_command)]
    report = _Report(settings, runs[0].period, Method.LEAST_SQUARES)
    fit = None
    if pieces:
        fit = _constant_speed_fit(_joined(pieces, float(np.mean([run.period for run in runs]))), is_command)
    uncertainty = _uncertainty(fit, is_command) if fit is not None else None
    model = _Model(_DEFAULTS, ()) if fit is None else fit.model
    needed = (Missing.REFERENCE_SPEED,)
    for index, key in enumerate(("speed_gain", "integral_gain")):
        if fit is None or uncertainty is None or not _is_explained(fit):
            report.add(key, None, needed, {"constant_speed_sections": float(len(pieces))})
            continue
        report.add(key, _Measured(model.values[key], float(uncertainty.total[index])), needed, {})
    slope = observed_slope(runs, is_command, model.values["lag"])
    report.add("slew_limit", None, needed, {"largest_n_per_s": slope})
    for key in ("position_gain", "anti_windup_rate", "force_limit", "delay", "force_lag"):
        report.add(key, None, needed, {})
    speed_filter, order = _speed_filter(runs, {}, _LOGGED_ALONE, model)
    report.method = Method.OUTPUT_ERROR
    report.add("speed_filter_hz", speed_filter, (Missing.HIGHER_RATE,), {})
    lag = model.values["lag"] if fit is not None and not is_command else math.nan
    return ControllerFit(
        identified=report.identified,
        controller=report.controller(model, speed_filter, order, math.nan),
        kind=ControllerKind.PI if "integral_gain" in report.identified else ControllerKind.P,
        residual_rms=fit.residual_rms if fit is not None else math.nan,
        is_command=is_command,
        delay_samples=int(model.values["delay_samples"]),
        lag=lag,
    )


def _steady_pieces(run: AxisRun, is_command: bool) -> list[FloatArray]:
    """Return the sections of a run in which the speed is constant but for what the controller corrects."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    output = run.reference_torque if is_command else run.torque
    window = max(round(_STEADY_TIME / run.period), 2 * _FEWEST_SAMPLES)
    if run.speed is None or output is None or not _is_logged(run, "speed") or len(run) <= window:
        return []
    known = run.known("speed", "reference_torque" if is_command else "torque")
    speed = np.where(known, run.speed, 0.0)
    smooth = _mean_over(speed, max(window // 5, 1))
    span = maximum_filter1d(smooth, window) - minimum_filter1d(smooth, window)
    level = np.abs(_mean_over(speed, window))
    steady = (span < _STEADY_SPAN * level) & (level > 0.2 * float(np.max(level)))
    nothing = np.zeros(len(run))
    rows = (nothing, nothing, speed, np.where(known, output, 0.0), nothing)
    return [piece for piece in _cut(known & steady, rows) if piece.shape[1] >= window]


def _constant_speed_fit(sections: _Sections, is_command: bool) -> _Fit:
    """Return Kp and Ki, and the lag of a measured torque, from u = -Kp v - Ki integral of v + polynomial of time.

    The polynomial of each section holds the unknown reference, constant or ramp, its integral and the integral's start.
    """
    from scipy.optimize import minimize_scalar

    base = _polynomials(sections)

    def fit(lag: float, delay: int = 0) -> _Fit:
        values = {**_DEFAULTS, "lag": lag, "delay_samples": float(delay)}
        columns = np.column_stack(
            [_without(base, sections, _response(sections, {**values, name: 1.0})) for name in _GAINS]
        )
        target = _without(base, sections, sections.output)
        gains = np.linalg.lstsq(columns, target, rcond=None)[0]
        model = _Model({**values, **dict(zip(_GAINS, gains.tolist(), strict=True))}, _GAINS)
        return _Fit(sections, model, columns @ gains - target, columns)

    if is_command:
        return min((fit(0.0, delay) for delay in range(-1, 5)), key=lambda fitted: fitted.cost)
    shortest, longest = math.log(0.1 * sections.period), math.log(0.2)
    found = minimize_scalar(lambda exponent: fit(math.exp(exponent)).cost, bounds=(shortest, longest), method="bounded")
    return fit(math.exp(float(found.x)))


def _response(sections: _Sections, values: Mapping[str, float]) -> FloatArray:
    """Return the output of a controller (n,) whose sections start with an integral of 0."""
    numbers = (sections.period, *(float(values[name]) for name in PARAMETER_ORDER[1:]))
    output = np.empty(len(sections))
    nothing = np.zeros(len(sections.lengths))
    simulate_controller(numbers, sections.starts, nothing, nothing + np.nan, sections.inputs, output)
    return output


def _polynomials(sections: _Sections) -> list[FloatArray]:
    """Return an orthonormal basis (samples, 3) of the polynomials of second degree, per section."""
    bases = []
    for first, end in zip(sections.starts[:-1], sections.starts[1:], strict=True):
        time = np.linspace(-1.0, 1.0, int(end - first))
        weight = sections.weight[first:end, np.newaxis]
        bases.append(np.linalg.qr(np.column_stack((np.ones_like(time), time, time**2)) * weight)[0])
    return bases


def _without(bases: Sequence[FloatArray], sections: _Sections, values: FloatArray) -> FloatArray:
    """Return what no polynomial of each section explains of the compared values (n,)."""
    left = values * sections.weight
    for basis, first, end in zip(bases, sections.starts[:-1], sections.starts[1:], strict=True):
        left[first:end] -= basis @ (basis.T @ left[first:end])
    return left
