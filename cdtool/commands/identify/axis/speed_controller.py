"""Identification of an axis's speed controller, P or PI, alone or under a proportional position controller.

The controller is simulated with the logged references and speeds, and its force compared with the logged one (output
error). The loop through the machine stays open in this: noise of the force sensor does not bias the gains. A structure
with more (a limit, a delay, another source of the error) is taken if it explains more by one
criterion, see `_is_better`.

Where the command is not logged, the measured force is compared, through a first-order lag that is fitted too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.commands.identify.axis.filtered_regression import known_sections
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
from cdtool.statistics.spread import MAD_TO_STD

SECTION = "model.controller"
Indices = np.ndarray[tuple[int], np.dtype[np.int64]]

# What a parameter is at rest: no gain, no limit, no lag.
_DEFAULTS = {
    "speed_gain": 0.0,
    "integral_gain": 0.0,
    "position_gain": 0.0,
    "anti_windup_rate": 0.0,
    "slew_limit": math.inf,
    "force_limit": math.inf,
    "speed_filter_hz": math.inf,
    "speed_filter_order": 0.0,
    "lag": 0.0,
    "delay_samples": 0.0,
    "substeps": 1.0,
}
_LIMITS = ("slew_limit", "force_limit")
_GAINS = ("speed_gain", "integral_gain", "position_gain")


class ControllerKind(Enum):
    """The structure of a controller that the data shows."""

    P = "P"
    PI = "PI"
    CASCADE_P = "P position, P speed"
    CASCADE_PI = "P position, PI speed"


@dataclass(frozen=True, kw_only=True)
class ControllerSettings:
    """How a controller is identified.

    `torque_filter_time` [s]: of the low-pass through which the torque is measured, 0 for none; if it is not known,
    force lag and torque filter are known only together. `units`: of force and travel.
    """

    torque_filter_time: float | None = None
    units: tuple[str, str] = ("N", "m")
    #: The largest delay between error and command [samples]: drives answer within a few of their periods.
    largest_delay: int = 8
    #: A parameter with a larger relative standard error is not identifiable: it does not describe a simulated contact.
    largest_relative_error: float = 0.3
    #: A section with fewer samples does not show an integral.
    fewest_samples: int = 100
    #: The first samples of a section are simulated, not compared: the filters' states are not known there.
    settling_samples: int = 20
    #: Structures are compared on about this many samples, which takes a second ...
    compared_samples: int = 25_000
    #: ... and the parameters of the chosen one are fitted to at most this many.
    most_samples: int = 400_000
    #: The periods of runs that are fitted together differ by less than this share.
    same_period: float = 0.02
    #: Output that is explained to less than this share is that of another controller.
    most_unexplained: float = 0.5
    #: A logged speed is that of a known filter if this share of its variance is left at most.
    unexplained_speed: float = 0.02


# A less plausible source of the error, or another rate of the controller, must leave less than this share of the cost.
_OTHER_SOURCE_SHARE = 0.5
# A gain within so many standard errors of 0 is compatible with 0.
SIGNIFICANT = 3.0
# A fit begins with a speed filter at this share of the sampling rate.
_FIRST_CORNER = 0.15
# A lag of this share of a period is none; a fit with a limit begins with at most so many periods, as a limit that is
# not in the model looks like a lag.
_LEAST_LAG, _LONGEST_FIRST_LAG = 0.2, 15.0
# The noise of a torque is compared over these times [s].
_NOISE_WINDOWS = (0.05, 0.4)
# A controller that may be faster than its log is also simulated so many times per sample.
_SUBSTEPS = 10.0
# Evaluations of a chosen structure, and of the last fit.
_CHOSEN, _LAST = 25, 50
# Windows, in shortest ones.
_SLOPE_WINDOWS = (1, 2, 4, 8, 16)


@dataclass(frozen=True, eq=False)
class ControllerComparison:
    """The logged command, or the measured force (`is_command` False), and the identified controller's (n,) [N, N m].

    Along the longest uninterrupted section of the logs, `time` [s] from its start.
    """

    time: FloatArray
    measured: FloatArray
    computed: FloatArray
    is_command: bool


@dataclass(frozen=True)
class ControllerFit:
    """An identified controller.

    `controller`: to simulate with; None if the speed gain is not identifiable. `kind`: its structure. `residual_rms`
    [N, N m]: of the command, or of the measured force where that was compared. `lag` [s]: from the command to the
    measured torque, through drive and torque sensor; NaN if unknown. `comparison`: None without references or gains.
    """

    identified: Identified
    controller: Controller | None
    kind: ControllerKind
    residual_rms: float
    lag: float = math.nan
    comparison: ControllerComparison | None = None


@dataclass(frozen=True, eq=False)
class _Sections:
    """Uninterrupted sections of all runs, one after the other.

    `starts` (sections + 1,): first samples, and n. `inputs` (3, n): see `speed_controller_kernel.INPUTS`. `output`
    (n,): what is compared [N]. `weight` (n,): 1 where it is, else 0. `demand` (n,): the speed that the references
    demand [m/s]. `commands` (sections,): the command at the start of each section [N]; NaN if it is not logged.
    """

    period: float
    starts: Indices
    inputs: FloatArray
    output: FloatArray
    weight: FloatArray
    demand: FloatArray
    commands: FloatArray

    def __len__(self) -> int:
        return len(self.output)

    @property
    def lengths(self) -> Indices:
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
        """Return the model in which these parameters are at rest."""
        values = {**self.values, **{name: _DEFAULTS[name] for name in names}}
        return _Model(values, tuple(name for name in self.free if name not in names))


@dataclass(frozen=True, eq=False)
class _Fit:
    """A fitted model: residual (n,) and its derivatives (n, free), free of the sections' integrals at their starts."""

    sections: _Sections
    model: _Model
    residual: FloatArray
    jacobian: FloatArray

    @property
    def cost(self) -> float:
        return float(np.einsum("n,n->", self.residual, self.residual))

    @property
    def residual_rms(self) -> float:
        return math.sqrt(self.cost / max(float(np.sum(self.sections.weight)), 1.0))

    @property
    def is_exact(self) -> bool:
        """Whether only the rounding of doubles is left."""
        return self.residual_rms < 1e-6 * float(np.std(self.sections.output))

    @property
    def unexplained(self) -> float:
        """Return the residual's share in the output's variation within its sections, of means over 0.1 s [-].

        White noise of the sensor, which no structure explains, is small in these.
        """
        sections = self.sections
        window = max(round(0.1 / sections.period), 5)
        means = sections.sums(sections.output) / sections.lengths
        varying = _mean_over((sections.output - sections.spread(means)) * sections.weight, window)
        left = _mean_over(self.residual, window)
        return float(left @ left) / max(float(varying @ varying), 1e-300)


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
        self._is_limited = any(math.isfinite(model.values[name]) for name in _LIMITS)

    def fit(self, evaluations: int, tolerance: float = 1e-6) -> _Fit:
        """Return the model of the least residual, after at most so many residuals."""
        from scipy.optimize import least_squares

        period = self.sections.period
        low, high = (np.array([bound(name, period) for name in self.model.free]) for bound in (_lowest, _highest))
        start = np.array([self.model.values[name] for name in self.model.free])
        # A start on a bound has no gradient there.
        inside = np.clip(start, low + 1e-3 * self._scales, high - 1e-3 * self._scales) / self._scales
        bounds = low / self._scales, high / self._scales
        found = least_squares(
            self._residual,
            inside,
            jac=self._jacobian,
            bounds=bounds,
            ftol=tolerance,
            xtol=1e-12,
            gtol=1e-14,
            max_nfev=evaluations,
        )
        vector = np.asarray(found.x, dtype=np.float64)
        jacobian = self._jacobian(vector)
        return _Fit(self.sections, self._model_of(vector), self._residual(vector), jacobian / self._scales)

    def _model_of(self, vector: FloatArray) -> _Model:
        values = (vector * self._scales).tolist()
        return self.model.with_values(dict(zip(self.model.free, values, strict=True)))

    def _simulated(self, model: _Model, integrals: FloatArray) -> FloatArray:
        sections = self.sections
        numbers = (sections.period, *(float(model.values[name]) for name in PARAMETER_ORDER[1:]))
        output = np.empty(len(sections))
        simulate_controller(numbers, sections.starts, integrals, sections.commands, sections.inputs, output)
        output -= sections.output
        output *= sections.weight
        return output

    def _sensitivity(self, model: _Model, residual: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the derivative by the sections' integrals (n,), and the sum of its squares per section."""
        sensitivity = (self._simulated(model, self._integrals + self._probe) - residual) / self._probe
        return sensitivity, np.maximum(self.sections.sums(sensitivity**2), 1e-12)

    def _residual(self, vector: FloatArray) -> FloatArray:
        model = self._model_of(vector)
        residual = self._simulated(model, self._integrals)
        for _ in range(3 if self._is_limited else 1):
            sensitivity, squares = self._sensitivity(model, residual)
            change = self.sections.sums(sensitivity * residual) / squares
            self._integrals = self._integrals - change
            if self._is_limited:
                residual = self._simulated(model, self._integrals)
            else:
                residual = residual - sensitivity * self.sections.spread(change)
        return residual

    def _jacobian(self, vector: FloatArray) -> FloatArray:
        self._residual(vector)
        model = self._model_of(vector)
        residual = self._simulated(model, self._integrals)
        jacobian = np.empty((len(residual), len(vector)), order="F")
        for index, name in enumerate(model.free):
            scale = float(self._scales[index])
            step = 1e-5 * max(scale, abs(model.values[name]))
            moved = model.with_values({name: model.values[name] + step})
            jacobian[:, index] = (self._simulated(moved, self._integrals) - residual) * (scale / step)
        sensitivity, squares = self._sensitivity(model, residual)
        overlap = self.sections.sums(sensitivity[:, np.newaxis] * jacobian) / squares[:, np.newaxis]
        jacobian -= sensitivity[:, np.newaxis] * self.sections.spread(overlap)
        return jacobian


def _scale(sections: _Sections, model: _Model, name: str) -> float:
    value = abs(model.values[name])
    if name == "integral_gain":
        return max(value, abs(model.values["speed_gain"]))
    defaults = {"position_gain": 10.0, "anti_windup_rate": 10.0, "lag": 10.0 * sections.period}
    return max(value, defaults.get(name, 1e-9))


def _lowest(name: str, period: float) -> float:
    # At 0 neither a lag nor a corner has an effect that shows which way to go.
    bounds = {"lag": _LEAST_LAG * period, "speed_filter_hz": 1e-3 / period}
    return -math.inf if name in _GAINS else bounds.get(name, 0.0)


def _highest(name: str, period: float) -> float:
    # A drive's torque follows within 0.2 s: a longer lag would stand for an integral.
    return {"speed_filter_hz": 1.0 / period, "lag": 0.2}.get(name, math.inf)


def _standard_errors(fit: _Fit, is_command: bool) -> FloatArray:
    """Return the standard errors of a fit's free parameters (free,), to a command or to a measured torque.

    The statistical part is the larger of two: from the residual's autocorrelation, and from the scatter between blocks.
    The systematic one is the larger of two: how far the part of the residual that no noise explains could move the
    parameter, and by how much other weightings of the residual move it. A wrong structure, or noise in the logged
    speed, acts differently on slow and fast, accelerated and settled samples.
    """
    scale = np.sqrt(np.maximum(np.sum(fit.jacobian**2, axis=0), 1e-300))
    jacobian = fit.jacobian / scale
    information = jacobian.T @ jacobian
    if np.linalg.cond(information) > 1e12:
        return np.full(len(scale), math.inf)
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
        systematic = np.maximum(systematic, np.where(moved > SIGNIFICANT * scatter, moved, 0.0))
    return np.asarray(np.hypot(statistical, systematic) / scale)


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
    # A larger ratio of the variances of means is no noise.
    return count * (long - expected) if long > 2.5 * expected else 0.0


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


def _blocks(sections: _Sections) -> Indices:
    """Return the first samples of blocks: the sections, cut where they are few."""
    # Errors are independent from block to block: 40 blocks.
    pieces = max(1, math.ceil(40 / len(sections.lengths)))
    cuts = [
        np.linspace(first, end, pieces, endpoint=False).astype(np.int64)
        for first, end in zip(sections.starts[:-1], sections.starts[1:], strict=True)
    ]
    return np.unique(np.concatenate(cuts))


def _weightings(sections: _Sections) -> list[Callable[[FloatArray], FloatArray]]:
    """Return other weightings of residual (n,) and derivatives (n, free): slow parts, accelerated and settled ones."""

    def slow(samples: float) -> Callable[[FloatArray], FloatArray]:
        return lambda values: _smoothed(values, math.exp(-1.0 / samples))

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
    # Better by 1 %, and by 20 times what one parameter does by chance.
    if gain <= 0.01 * old.cost or not np.all(np.any(new.jacobian != 0.0, axis=0)):
        return False
    covariance = _autocovariance(new.residual)
    independent = covariance[0] + 2.0 * float(np.sum(covariance[1:]))
    return bool(gain > 20.0 * max(independent, float(covariance[0]), 1e-300))


@dataclass(frozen=True)
class _Source:
    """From which channels error and output of the controller come.

    `is_command`: the output is the logged command, else the measured torque. `from_position`: the speed is the
    position's difference, to be filtered, else the logged one. `has_position_loop`: a position error is known.
    `has_speed_reference`: a speed reference is known.
    """

    is_command: bool
    from_position: bool = False
    has_position_loop: bool = False
    has_speed_reference: bool = False

    @property
    def orders(self) -> tuple[int, ...]:
        """Return the orders of the speed filter that are tried."""
        return (1, 2) if self.from_position else (0,)

    @property
    def output(self) -> str:
        return "reference_torque" if self.is_command else "torque"

    @property
    def channels(self) -> tuple[str, ...]:
        """Return the channels that every sample needs."""
        needed = [self.output, "position" if self.from_position else "speed"]
        if self.has_speed_reference:
            needed.append("reference_speed")
        if self.has_position_loop:
            needed += ["position", "reference_position"]
        return tuple(dict.fromkeys(needed))


def _sources(runs: Sequence[AxisRun]) -> list[_Source]:
    """Return the channels from which the controller's error can be computed, the likeliest first."""

    def logged(name: str) -> bool:
        return any(_is_logged(run, name) for run in runs)

    loop = logged("reference_position") and logged("position")
    if not (logged("reference_speed") or loop):
        return []
    ways = ([False] if logged("speed") else []) + ([True] if logged("position") else [])
    return [
        _Source(logged("reference_torque"), from_position, loop, logged("reference_speed")) for from_position in ways
    ]


def _is_logged(run: AxisRun, *channels: str) -> bool:
    """Return whether a run has these channels, none of them computed from another."""
    return all(getattr(run, channel) is not None and channel not in run.derived for channel in channels)


def _sections_of(runs: Sequence[AxisRun], source: _Source, settings: ControllerSettings) -> _Sections | None:
    """Return the sections of all runs in which the source's channels have samples; None without a long enough one."""
    pieces = [
        piece for run in runs if _is_logged(run, *source.channels) for piece in _run_pieces(run, source, settings)
    ]
    if not pieces:
        return None
    sections = _joined(pieces, runs, settings)
    return replace(sections, commands=sections.output[sections.starts[:-1]]) if source.is_command else sections


def _joined(pieces: Sequence[FloatArray], runs: Sequence[AxisRun], settings: ControllerSettings) -> _Sections:
    """Return pieces (5, samples) as sections: the inputs, the output and the demand."""
    starts = np.concatenate(([0], np.cumsum([piece.shape[1] for piece in pieces]))).astype(np.int64)
    values = np.ascontiguousarray(np.hstack(pieces))
    weight = np.ones(int(starts[-1]))
    for first in starts[:-1]:
        weight[first : first + settings.settling_samples] = 0.0
    period = float(np.mean([run.period for run in runs]))
    return _Sections(period, starts, values[:3], values[3], weight, values[4], np.full(len(pieces), np.nan))


def _run_pieces(run: AxisRun, source: _Source, settings: ControllerSettings) -> list[FloatArray]:
    """Return the sections of one run (5, samples): the inputs, the output and the demand."""
    known = run.known(*source.channels)
    if source.from_position or source.has_position_loop:
        known = _known_differences(known)
    position = _values(run, "position", source.from_position or source.has_position_loop)
    reference = _values(run, "reference_position", source.has_position_loop)
    demanded = _rate(run, reference)
    speed_reference = _values(run, "reference_speed", source.has_speed_reference)
    rows = (
        speed_reference,
        reference - position if source.has_position_loop else np.zeros(len(run)),
        _rate(run, position) if source.from_position else _values(run, "speed"),
        _values(run, source.output),
        speed_reference if source.has_speed_reference else demanded,
    )
    return _cut(known, rows, settings.fewest_samples)


def _known_differences(known: BoolArray) -> BoolArray:
    """Return where a sample and the one before it are known (n,)."""
    return known & np.concatenate(([False], known[:-1]))


def _cut(known: BoolArray, rows: Sequence[FloatArray], fewest: int) -> list[FloatArray]:
    """Return the uninterrupted known sections of the rows, each (rows, samples), that are long enough."""
    stacked = np.vstack(rows)
    return [stacked[:, a:b] for a, b in known_sections(known) if b - a >= fewest]


def _values(run: AxisRun, channel: str, used: bool = True) -> FloatArray:
    values: FloatArray | None = getattr(run, channel)
    return values if used and values is not None else np.zeros(len(run))


def _rate(run: AxisRun, values: FloatArray) -> FloatArray:
    rate: FloatArray = np.diff(values, prepend=values[:1]) / run.period
    return rate


def _mean_over(values: FloatArray, window: int) -> FloatArray:
    from scipy.ndimage import uniform_filter1d

    return np.asarray(uniform_filter1d(values, window))


def _smoothed(values: FloatArray, keep: float) -> FloatArray:
    from scipy.signal import lfilter

    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], values, axis=0))


def _quantum(values: FloatArray) -> float:
    """Return the resolution of logged values: the smallest step between two of them beyond rounding."""
    steps = np.diff(np.unique(values))
    steps = steps[steps > 1e-9 * max(float(np.max(np.abs(values), initial=0.0)), 1e-300)]
    return float(np.min(steps, initial=math.inf)) if len(steps) else 0.0


def _search(runs: Sequence[AxisRun], settings: ControllerSettings) -> tuple[_Source, _Fit] | None:
    """Return the source and the structure, on part of the runs, that explain the output best; None without sections."""
    found: tuple[_Source, _Fit] | None = None
    for source in _sources(runs):
        sections = _sections_of(runs, source, settings)
        if sections is None:
            continue
        sections = sections.part(settings.compared_samples)
        fits = [_OutputError(sections, _starting_model(sections, source, n)).fit(_CHOSEN) for n in source.orders]
        fit = _improved(min(fits, key=lambda fit: fit.cost), source, settings)
        if found is not None:
            # A less plausible source must explain much more.
            share = 1.0 if source.from_position == found[0].from_position else _OTHER_SOURCE_SHARE
            if fit.residual_rms**2 >= share * found[1].residual_rms ** 2:
                continue
        found = source, fit
        # What is left is noise of the torque, which no other source explains.
        is_noise = not source.is_command and _model_error(fit, False) == 0.0
        # A residual within 1e-4 of the output's variance is explained: no more is looked for.
        is_explained = fit.residual_rms**2 < 1e-4 * float(np.var(sections.output))
        if is_explained or (is_noise and fit.unexplained < settings.most_unexplained):
            break
    return found


def _starting_model(sections: _Sections, source: _Source, order: int) -> _Model:
    """Return gains from a linear regression of the output on both errors and their integrals."""
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
    keep = math.exp(-2.0 * math.pi * corner * sections.period) if order else 0.0
    error = sections.inputs[0] - _smoothed(sections.inputs[2], keep)
    errors = np.stack((error, sections.inputs[1]))
    columns = np.column_stack((*errors, *(np.cumsum(errors, axis=1) * sections.period), sections.output))
    columns -= sections.spread(sections.sums(columns) / sections.lengths[:, np.newaxis])
    gains = np.linalg.lstsq(columns[:, :4], columns[:, 4], rcond=None)[0]
    usual = float(np.std(sections.output) / max(np.std(error), 1e-12))
    values["speed_gain"] = float(gains[0]) if gains[0] > 0.0 else usual
    values["integral_gain"] = float(gains[2])
    values["position_gain"] = float(gains[1]) / values["speed_gain"] if source.has_position_loop else 0.0
    return _Model(values, tuple(free))


def _improved(fit: _Fit, source: _Source, settings: ControllerSettings) -> _Fit:
    """Return the fit with what explains most, one after another: another delay, limits."""
    while not fit.is_exact:
        trials = [_OutputError(fit.sections, model).fit(10, 1e-4) for model in _more(fit, source, settings)]
        trials = [trial for trial in trials if not (source.is_command and _exceeds_its_limit(trial))]
        best = min(trials, key=lambda trial: trial.cost)
        if not _is_better(best, fit):
            return fit
        # With limits a fit that goes on from other integrals may end worse.
        fit = min(best, _OutputError(fit.sections, best.model).fit(_CHOSEN), key=lambda trial: trial.cost)
    return fit


def _more(fit: _Fit, source: _Source, settings: ControllerSettings) -> Iterator[_Model]:
    """Yield the models that differ from a fit in one thing."""
    model, period = fit.model, fit.sections.period
    # A delay or a limit that is not in the model looks like a filter, a limit also like a lag.
    filtered = {"speed_filter_hz": _FIRST_CORNER / period} if "speed_filter_hz" in model.free else {}
    lag = min(model.values["lag"], _LONGEST_FIRST_LAG * period)
    first = {**filtered, "lag": lag, "anti_windup_rate": model.values["anti_windup_rate"] or 5.0}
    # Above this only noise is.
    largest = float(np.quantile(np.abs(fit.sections.output), 0.995))
    for name, candidates in (("slew_limit", _slopes(fit, source)), ("force_limit", [largest])):
        if name not in model.free:
            for value in candidates:
                if value > 0.0:
                    yield model.with_values({**first, name: value}, (name, "anti_windup_rate"))
    present, every = model.values["delay_samples"], range(-1 if source.is_command else 0, settings.largest_delay + 1)
    for delay in every:
        # In a measured torque, which lags, a delay shows from sample to sample only.
        if delay != present and (source.is_command or abs(delay - present) <= 1.0):
            yield model.with_values({**filtered, "delay_samples": float(delay)})


def _exceeds_its_limit(fit: _Fit) -> bool:
    """Whether the logged command is larger than the force limit of the fit: then it has no such limit."""
    # By more than the log's rounding.
    return _largest(fit.sections.output) > 1.005 * fit.model.values["force_limit"]


def _slopes(fit: _Fit, source: _Source) -> list[float]:
    """Return high quantiles of the output's slope [N/s]: slew limits to try."""
    sections = fit.sections
    lags = min(fit.model.values["lag"] / sections.period, _LONGEST_FIRST_LAG)
    window = 4 if source.is_command else max(4, round(3.0 * lags))
    if window >= len(sections) // 4:
        return []
    smooth = sections.output if source.is_command else _mean_over(sections.output, window)
    slope = np.abs(smooth[window:] - smooth[:-window]) / (window * sections.period)
    return [float(value) for value in np.quantile(slope, (0.8, 0.95, 0.99))]


def _largest(values: FloatArray) -> float:
    return float(np.max(np.abs(values), initial=0.0))


def observed_slope(runs: Sequence[AxisRun], is_command: bool, lag: float = math.nan) -> float:
    """Return a slope that the command reached in these runs [N/s, N m/s]; NaN where no run is long enough.

    Of a logged command it is the largest change from sample to sample. Of the measured torque, which follows the
    command later and flatter by the time constant `lag` [s], it is the largest mean slope over a window of at
    least three lags, less what noise adds: never more than the command had.
    """
    found = [slope for run in runs if math.isfinite(slope := _slope_of_run(run, is_command, lag))]
    return max(found, default=math.nan)


def _slope_of_run(run: AxisRun, is_command: bool, lag: float) -> float:
    values = run.reference_torque if is_command else run.torque
    if values is None:
        return math.nan
    if is_command:
        return float(np.fmax.reduce(np.abs(np.diff(values)), initial=math.nan)) / run.period
    # Averaged over at least four samples; after three lags the torque has followed the command.
    shortest = max(4, round(3.0 * lag / run.period) if math.isfinite(lag) else 0)
    known = np.isfinite(values)
    # A long window has little noise, a short one sees a short rise: each is a bound, and the highest counts.
    slopes = [
        _rise(values[a:b], window) / (window * run.period)
        for a, b in known_sections(known)
        for window in (shortest * factor for factor in _SLOPE_WINDOWS)
        if b - a > 3 * window
    ]
    return max(slopes, default=math.nan)


def _rise(values: FloatArray, window: int) -> float:
    """Return the largest change of the mean over a window to the next window, less what noise adds to it.

    The noise of a measured torque has passed its filter and is not white: its size is that of the usual change, which
    is noise alone as long as the torque is steady for more than half of the run.
    """
    means = np.convolve(values, np.full(window, 1.0 / window), mode="valid")
    changes = np.abs(means[window:] - means[:-window])
    noise = MAD_TO_STD * float(np.median(changes))
    # The largest of thousands of values of noise is four standard deviations.
    return max(float(np.max(changes)) - 4.0 * noise, 0.0)


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
        There are no runs, no references, their sampling periods differ by more than 2 %, or the output falls where the
        speed error rises: a channel has the wrong sign.

    Notes
    -----
    Standard errors are the larger of two, from the residual's autocorrelation and from the scatter between blocks of
    the runs. Added are how far a parameter moves if slow, accelerated or settled samples alone are compared, if the
    controller is faster than the log, and if the logged speed is noisier; for a logged command also how far its whole
    residual could move it. They do not cover what noise of a measured torque hides: a logged speed with a low-pass of
    its own at 20 Hz moves the integral gain of the simulated gate by 3 %, at 5 Hz by 8 %, where no position is logged
    and the lag comes out as 0.
    """
    settings = settings or ControllerSettings()
    _check(runs, settings)
    search = _search(runs, settings)
    if search is None:
        raise IdentificationError(
            "no section of the logs has torque, speed and a reference: gains show only in the answer to one",
            "log the speed reference, or the position reference and the position",
        )
    source, fit = search
    sections = _sections_of(runs, source, settings)
    assert sections is not None
    fit = _OutputError(sections.part(settings.most_samples), fit.model).fit(_LAST, 1e-12)
    fit, errors = _without_zeros(fit, source.is_command)
    fit, errors = _with_unknown_rate(fit, errors, source.is_command)
    if not (source.is_command or source.from_position):
        errors = np.hypot(errors, _moved_by_noise(fit))
    if fit.model.values["speed_gain"] < -SIGNIFICANT * errors[fit.model.free.index("speed_gain")]:
        raise IdentificationError(
            f"{runs[0].name}: the controller's output falls where the speed error rises",
            "check the signs (scale) of torque, speed and references in [channels]",
        )
    return _reported(runs, source, fit, errors, settings)


def _check(runs: Sequence[AxisRun], settings: ControllerSettings) -> None:
    if not runs:
        raise IdentificationError("no runs to identify a controller from", "give at least one impact-free recording")
    shortest, longest = min(runs, key=lambda run: run.period), max(runs, key=lambda run: run.period)
    if longest.period > (1.0 + settings.same_period) * shortest.period:
        raise IdentificationError(
            f"{shortest.name} has a sample every {shortest.period:.4g} s, {longest.name} every {longest.period:.4g} s",
            "identify a controller from recordings of one sampling rate",
        )


def _without_zeros(fit: _Fit, is_command: bool) -> tuple[_Fit, FloatArray]:
    """Return the fit without the gains that are compatible with zero and a lag of nothing, and its errors."""
    if fit.model.values["lag"] < 1.01 * _LEAST_LAG * fit.sections.period and "lag" in fit.model.free:
        fit = _OutputError(fit.sections, fit.model.without("lag")).fit(_LAST, 1e-12)
    errors = _standard_errors(fit, is_command)
    for name in ("position_gain", "integral_gain"):
        free, value = fit.model.free, abs(fit.model.values[name])
        if name in free and not value > SIGNIFICANT * errors[free.index(name)]:
            fit = _OutputError(fit.sections, fit.model.without(name)).fit(_LAST, 1e-12)
            errors = _standard_errors(fit, is_command)
    return fit, errors


def _with_unknown_rate(fit: _Fit, errors: FloatArray, is_command: bool) -> tuple[_Fit, FloatArray]:
    """Return the better fit of two, a controller as fast as the log and a faster one, errors with their difference.

    The difference is a systematic error where the data does not decide. Where it decides for the faster one, its true
    rate remains unknown.
    """
    if fit.is_exact:
        return fit, errors
    faster = _OutputError(fit.sections, fit.model.with_values({"substeps": _SUBSTEPS})).fit(_LAST, 1e-9)
    moved = _distance(fit, faster)
    if fit.cost < _OTHER_SOURCE_SHARE * faster.cost:
        return fit, errors
    if faster.cost < fit.cost:
        decided = faster.cost < _OTHER_SOURCE_SHARE * fit.cost
        fit, errors = faster, _standard_errors(faster, is_command)
        moved = moved / _SUBSTEPS if decided else moved
    return fit, np.hypot(errors, moved)


def _moved_by_noise(fit: _Fit) -> FloatArray:
    """Return how far noise of the logged speed may have moved the parameters (free,), which the controller never saw.

    As much noise again moves the parameters about as far (Cook and Stefanski's simulation extrapolation). Its level is
    that of white noise with the fourth differences of the logged speed, so at least what it is.
    """
    sections = fit.sections
    fourth = np.diff(sections.inputs[2], 4)
    # Median, as at the edges of sections the differences are large; 70 is the sum of the squared weights.
    deviation = MAD_TO_STD * float(np.median(np.abs(fourth))) / math.sqrt(70.0)
    inputs = sections.inputs.copy()
    inputs[2] += deviation * np.random.default_rng(0).standard_normal(len(sections))
    noisier = _OutputError(replace(sections, inputs=inputs), fit.model).fit(_LAST, 1e-9)
    return _distance(fit, noisier)


def _distance(fit: _Fit, other: _Fit) -> FloatArray:
    """Return how far apart the free parameters of two fits are (free,)."""
    return np.array([abs(other.model.values[name] - fit.model.values[name]) for name in fit.model.free])


@dataclass(frozen=True)
class _Measured:
    """A value with its standard error."""

    value: float
    error: float


def _reported(
    runs: Sequence[AxisRun], source: _Source, fit: _Fit, errors: FloatArray, settings: ControllerSettings
) -> ControllerFit:
    """Return a fit's parameters as estimates, or as not identifiable with what is missing."""
    model, period = fit.model, fit.sections.period
    fitted = {
        name: _Measured(model.values[name], error) for name, error in zip(model.free, errors.tolist(), strict=True)
    }
    speed_filter, order = fitted.get("speed_filter_hz"), int(model.values["speed_filter_order"])
    # A logged speed that is later than the controller's went through other filters.
    if not source.from_position:
        is_own = model.values["delay_samples"] >= 0.0
        speed_filter, order = _speed_filter(runs, settings) if is_own else (None, 0)
    lag = _force_lag(runs, settings) if source.is_command else fitted.get("lag", _Measured(0.0, math.nan))
    is_explained = fit.unexplained < settings.most_unexplained
    needed = Missing.ACCELERATION
    if not is_explained and np.ptp(fit.sections.demand) > 0.0:
        # At a constant reference no structure can be told from another one.
        needed = Missing.OTHER_CONTROLLER
    known = fitted if is_explained else {}
    limits = (Missing.SATURATION,) if source.is_command else (Missing.SATURATION, Missing.REFERENCE_TORQUE)
    slope = observed_slope(runs, source.is_command, model.values["lag"])
    delay = _Measured(max(model.values["delay_samples"], 0.0) * period, period / math.sqrt(12.0))
    rows: list[tuple[str, _Measured | None, tuple[Missing, ...], dict[str, float]]] = [
        *(
            (key, known.get(key), (needed,), {"unexplained_share": fit.unexplained})
            for key in _GAINS
            if key == "speed_gain" or key in model.free
        ),
        ("anti_windup_rate", known.get("anti_windup_rate"), limits, {}),
        ("slew_limit", known.get("slew_limit"), limits, {"largest_n_per_s": slope}),
        ("force_limit", known.get("force_limit"), limits, {"largest_n": _largest(fit.sections.output)}),
        ("speed_filter_hz", speed_filter, (Missing.HIGHER_RATE,), {}),
        ("delay", delay if source.is_command else None, (Missing.REFERENCE_TORQUE,), {"lag_s": lag.value}),
    ]
    identified = Identified.of([*(_answer(*row, settings) for row in rows), _lag_answer(lag, settings)])
    controller = _controller(identified, model, period, order)
    return ControllerFit(
        identified=identified,
        controller=controller,
        kind=_kind(model),
        residual_rms=fit.residual_rms,
        lag=lag.value,
        comparison=_comparison(fit, source.is_command) if controller is not None else None,
    )


def _comparison(fit: _Fit, is_command: bool) -> ControllerComparison:
    sections = fit.sections
    longest = int(np.argmax(sections.lengths))
    own = np.arange(sections.starts[longest], sections.starts[longest + 1])
    compared = own[sections.weight[own] > 0.0]
    measured = sections.output[compared]
    return ControllerComparison(
        sections.period * (compared - own[0]), measured, measured + fit.residual[compared], is_command
    )


def _kind(model: _Model) -> ControllerKind:
    cascade, integral = "position_gain" in model.free, "integral_gain" in model.free
    if cascade:
        return ControllerKind.CASCADE_PI if integral else ControllerKind.CASCADE_P
    return ControllerKind.PI if integral else ControllerKind.P


def _units(settings: ControllerSettings) -> dict[str, str]:
    force, travel = settings.units
    return {
        "speed_gain": f"{force} s/{travel}",
        "integral_gain": f"{force}/{travel}",
        "position_gain": "1/s",
        "anti_windup_rate": "1/s",
        "slew_limit": f"{force}/s",
        "force_limit": force,
        "speed_filter_hz": "Hz",
        "force_lag": "s",
        "delay": "s",
    }


def _answer(
    key: str,
    measured: _Measured | None,
    missing: tuple[Missing, ...],
    numbers: Mapping[str, float],
    settings: ControllerSettings,
) -> Estimate | NotIdentifiable:
    """Return an estimate, or that it is missing or too uncertain."""
    if measured is not None:
        value, error = measured.value, measured.error
        relative = error / abs(value) if value else math.inf
        # A delay of 0 is known as well as any other.
        certain = relative <= settings.largest_relative_error or key in ("delay", "force_lag")
        if certain and value >= 0.0 and math.isfinite(error):
            return Estimate(SECTION, key, value, error, _units(settings)[key], Method.OUTPUT_ERROR)
        numbers = {**numbers, "value": value, "relative_error": relative}
    return NotIdentifiable(SECTION, key, missing, numbers)


def _lag_answer(lag: _Measured, settings: ControllerSettings) -> Estimate | NotIdentifiable:
    """Return the force lag: the lag between command and measured torque without the torque's own low-pass."""
    known = settings.torque_filter_time
    missing: tuple[Missing, ...] = ()
    if not math.isfinite(lag.value):
        missing = (Missing.REFERENCE_TORQUE,)
    elif known is None:
        missing = (Missing.TORQUE_FILTER,)
    measured = None
    if known is not None and math.isfinite(lag.error):
        measured = _Measured(max(lag.value - known, 0.0), lag.error)
    return _answer("force_lag", measured, missing, {"lag_s": lag.value}, settings)


def _controller(identified: Identified, model: _Model, period: float, order: int) -> Controller | None:
    """Return the controller to simulate with; None without a speed gain."""
    values = {item.key: item.value for item in identified.estimates}
    if "speed_gain" not in values:
        return None
    if not values.keys() & set(_LIMITS):
        values.pop("anti_windup_rate", None)
    else:
        # Faster, the sampled integral would overshoot.
        values["anti_windup_rate"] = min(model.values["anti_windup_rate"], 0.5 / period)
    values["delay"] = max(model.values["delay_samples"], 0.0) * period
    known: dict[str, Any] = {**values, "speed_filter_order": order if "speed_filter_hz" in values else 0}
    return Controller(period=period, **known)


def _speed_filter(runs: Sequence[AxisRun], settings: ControllerSettings) -> tuple[_Measured | None, int]:
    """Return the corner of the low-pass from the position's difference to the logged speed [Hz], and its order.

    It is the controller's; None where it is not known.
    """
    pieces = []
    for run in runs:
        if _is_logged(run, "speed", "position"):
            known, nothing = _known_differences(run.known("speed", "position")), np.zeros(len(run))
            rows = (nothing, nothing, -_rate(run, _values(run, "position")), _values(run, "speed"), nothing)
            pieces += _cut(known, rows, settings.fewest_samples)
    first = _FIRST_CORNER / float(np.mean([run.period for run in runs]))
    values = {**_DEFAULTS, "speed_gain": 1.0, "speed_filter_hz": first}
    models = [_Model({**values, "speed_filter_order": order}, ("speed_filter_hz",)) for order in (1.0, 2.0)]
    fit = _transfer(pieces, runs, models, settings.unexplained_speed, settings)
    if fit is None:
        return None, 0
    corner = _Measured(fit.model.values["speed_filter_hz"], float(_standard_errors(fit, True)[0]))
    return corner, int(fit.model.values["speed_filter_order"])


def _force_lag(runs: Sequence[AxisRun], settings: ControllerSettings) -> _Measured:
    """Return the lag from the logged command to the measured torque [s]; NaN where none is seen."""
    pieces = []
    for run in runs:
        command, nothing = _values(run, "reference_torque"), np.zeros(len(run))
        rows = (command, nothing, nothing, run.torque, command)
        pieces += _cut(run.known("torque", "reference_torque"), rows, settings.fewest_samples)
    first = 5.0 * float(np.mean([run.period for run in runs]))
    model = _Model({**_DEFAULTS, "speed_gain": 1.0, "lag": first}, ("speed_gain", "lag"))
    fit = _transfer(pieces, runs, [model], settings.most_unexplained, settings)
    if fit is None:
        return _Measured(math.nan, math.nan)
    return _Measured(fit.model.values["lag"], float(_standard_errors(fit, False)[1]))


def _transfer(
    pieces: Sequence[FloatArray],
    runs: Sequence[AxisRun],
    models: Sequence[_Model],
    most: float,
    settings: ControllerSettings,
) -> _Fit | None:
    """Return the best fit of a filter between two channels; None if it leaves more than a share of the output."""
    if not pieces:
        return None
    sections = _joined(pieces, runs, settings).part(settings.compared_samples)
    fit = min((_OutputError(sections, model).fit(_LAST, 1e-12) for model in models), key=lambda fit: fit.cost)
    return fit if fit.unexplained <= most else None
