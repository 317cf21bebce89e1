"""The information-theoretic bound on the delay of a detector's signal, after Lorden (1971).

A detector of a known change in unit Gaussian noise, with gamma samples between two false alarms on average, needs on
average at least the time until the Kullback-Leibler divergence of the samples after the change from those before,
summed, reaches log(gamma) (for large gamma, at the worst instant). A known mean m_k in standard deviations diverges by
m_k^2 / 2 per sample; a steady one thus needs log(gamma) / (m^2 / 2) samples.

The bound applies to one signal as whitened: shape and amplitude of the response known, the noise Gaussian and white.
Another signal of the same contact, or a longer whitening, has another bound.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq
from timing import table

from cdtool.alarms.pipeline import run_detector
from cdtool.base.arrays import FloatArray
from cdtool.commands.scoring.benchmark_file import HOLDOUT, BenchmarkFile
from cdtool.detectors.detection import Signal
from cdtool.recordings.operations import Operation
from cdtool.thresholds.cusum import Cusum
from cdtool.truth.onset import find_contacts

# Bounds [ms] by machine and group over all channels with a VAR(80) noise model, at 1 false alarm in 1000 operations:
# quoted from the specification (quickest_detection.md), not measured here.
QUOTED = {
    "gate": {"stiff": 7.8, "soft": 42.9},
    "T1": {"stiff": 0.7, "soft": 15.6},
    "T2": {"stiff": 1.1, "soft": 60.0},
}
# Page's sum overshoots its limit by this much on average [standard deviations] (Siegmund 1985).
_OVERSHOOT = 1.166
# Number of summed innovations to check whether they are white.
_SUMS = (8, 32, 128)
# A sample counts if at least this share of the impacts is assessable there.
_COVERAGE = 0.5


def after_onset(innovations: Signal, onset: float, samples: int, side: int) -> FloatArray:
    """Return the monitored innovation (`samples`,) from the first sample at `onset` [s] on, positive to the limit.

    NaN where it is not assessable, and after the recording's end. `side` -1: the lower limit is monitored.
    """
    result = np.full(samples, np.nan)
    first = int(np.searchsorted(innovations.time, onset, side="left"))
    values = np.where(innovations.valid[:, 0], innovations.values[:, 0], np.nan)[first : first + samples]
    result[: len(values)] = values if side >= 0 else -values
    return result


def summed_divergence(responses: FloatArray) -> FloatArray:
    """Divergence (K,) in nats up to each sample, of the mean of several responses (n, K) in standard deviations.

    The square of a mean of n noisy samples is s^2 / n too large on average: that is taken off, so that the sum of a
    response that is not there stays about 0. NaN from the first sample that fewer than half of the impacts have.
    """
    number = np.count_nonzero(np.isfinite(responses), axis=0)
    known = np.cumprod(number >= max(2.0, _COVERAGE * len(responses))).astype(bool)
    present = np.where(np.isfinite(responses), responses, 0.0)[:, known]
    number = number[known]
    mean = present.sum(axis=0) / number
    squares = np.where(np.isfinite(responses[:, known]), (present - mean) ** 2, 0.0).sum(axis=0)
    result = np.full(responses.shape[1], np.nan)
    result[known] = np.cumsum(0.5 * (mean**2 - squares / (number - 1.0) / number))
    return result


def samples_to(divergence: FloatArray, wanted: float) -> float:
    """Return the number of samples (fractional, by a straight line) until the summed divergence (K,) reaches `wanted`.

    Infinite if it does not.
    """
    reached = np.flatnonzero(divergence >= wanted)
    if not len(reached):
        return math.inf
    last = int(reached[0])
    before = float(divergence[last - 1]) if last else 0.0
    return last + (wanted - before) / (float(divergence[last]) - before)


def delay_bound(divergence: FloatArray, between_alarms: float, period: float) -> float:
    """Lorden's bound on the mean latency [s]: `between_alarms` samples between two false alarms, `period` [s].

    The sample at the onset is the first and comes at latency 0. Infinite where the samples given hold too little.
    """
    return max(samples_to(divergence, math.log(between_alarms)) - 1.0, 0.0) * period


def white_limit(between_alarms: float, drift: float) -> float:
    """The limit at which Page's sum of white Gaussian noise alarms once in `between_alarms` samples on average.

    gamma = (exp(2 d b) - 1 - 2 d b) / (2 d^2), b = h + 1.166: Siegmund's approximation, within some per cent. `drift` d
    and the limit h in standard deviations. A signal that needs much more is not white.
    """
    reach = brentq(lambda x: math.expm1(x) - x - 2.0 * drift**2 * between_alarms, 1e-9, 700.0)
    return float(reach) / (2.0 * drift) - _OVERSHOOT


def spread_of_sums(runs: Sequence[FloatArray], length: int) -> float:
    """Standard deviation of the sum of `length` successive innovations, over that of white ones: 1 = white.

    `runs`: the innovations (n,) of each; a rest below `length` is left out. Above 1 sums wander, below 1 they cancel.
    """
    sums = [values[: len(values) // length * length].reshape(-1, length).sum(axis=1) for values in runs]
    return float(np.sqrt(np.mean(np.concatenate(sums) ** 2) / length))


@dataclass(frozen=True)
class Limit:
    """A detector's innovations: samples judged in an operation, sample period [s], responses (n, K) by group.

    `sums`: spread of the sums of so many of them in impact-free runs.
    """

    samples: float
    period: float
    responses: Mapping[str, FloatArray]
    sums: Mapping[int, float]

    def bound(self, group: str, budget: float) -> float:
        """Return Lorden's bound on the mean latency [ms] at `budget` false alarms per operation."""
        return 1e3 * delay_bound(summed_divergence(self.responses[group]), self.samples / budget, self.period)


def limit_of(setup: BenchmarkFile, operations: Mapping[str, Sequence[Operation]], detector: Any, fitted: Any) -> Limit:
    """Return the innovations of the hold-out runs and of the impacts, the latter from the onset for the window."""

    def innovations(operation: Operation) -> Signal:
        signal = run_detector(operation, setup.machine_file.machine, detector, setup.watched)
        whitened: Signal = fitted.whitening.innovations(operation.recording.without_ground_truth(), signal)
        return whitened

    free = [item.values[item.valid[:, 0], 0] for item in map(innovations, operations[HOLDOUT])]
    period, responses = fitted.whitening.period, {}
    for group in (name for name in operations if name in setup.impacts and name != HOLDOUT):
        length = round(setup.impacts[group].window / period)
        onsets = [find_contacts(item.recording, setup.onset)[0].start for item in operations[group]]
        rows = zip(operations[group], onsets, strict=True)
        responses[group] = np.array([after_onset(innovations(x), onset, length, fitted.side) for x, onset in rows])
    samples = float(np.mean([len(values) for values in free]))
    return Limit(samples, period, responses, {length: spread_of_sums(free, length) for length in _SUMS})


def print_bounds(studies: Sequence[Any], budget: float, titles: Sequence[str]) -> None:
    """Return each study's bound, and the mean latencies of the thresholds `titles` with their multiples of it."""
    rows = []
    for item in studies:
        for group in item.limit.responses if item.limit else ():
            bound = item.limit.bound(group, budget)
            cells = [f"{item.machine} {group} {item.detector}", f"{QUOTED[item.machine][group]:.1f}", f"{bound:.1f}"]
            for title in titles:
                latency = item.row(title).mean(group)
                cells += [f"{latency:.1f}", f"{latency / bound:.1f}" if 0.0 < bound < math.inf else "-"]
            rows.append(cells)
    heads = [cell for title in titles for cell in (title, "x bound")]
    table(("mean latency [ms]", "all channels", "bound", *heads), rows)
    print("bound: Lorden's, mean response known, in the innovations of an AR(4); inf: not reached within the window;")
    print("all channels: quoted from the specification (quickest_detection.md), VAR(80), 1 false alarm in 1000\n")


def print_whiteness(studies: Sequence[Any], budget: float, title: str) -> None:
    """Return the limit that Page's sum `title` needs (default drift, no debounce), and that for white noise."""
    rows = []
    for item in studies:
        if item.limit:
            white = white_limit(item.limit.samples / budget, Cusum.drift)
            sums = [f"{value:.2f}" for value in item.limit.sums.values()]
            rows.append((f"{item.machine} {item.detector}", f"{item.row(title).factor:.1f}", f"{white:.1f}", *sums))
    table((f"limit of {title}", "set", "white noise", *(f"sums of {length}" for length in _SUMS)), rows)
    print("sums of n innovations: their spread over that of white ones; above 1 the sum accumulates noise\n")
