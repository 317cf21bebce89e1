"""How often do the intervals of the evaluation contain the true value? Each should in 95 of 100 tests.

python benchmarks/interval_coverage.py [repetitions] [--few]

--few: only the exact intervals and those of 4 to 9 contacts. Exits with 1 if a requirement is not met.

The exact intervals (missed share, false-alarm rate) are enumerated, without chance. The others are simulated on
latencies with known true values. Seeded by row, so the numbers do not depend on the number of cores.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, stats
from timing import environment, table

from cdtool.statistics.interval import Interval
from cdtool.statistics.kaplan_meier import latency_quantile
from cdtool.statistics.rates import binomial_at_most, binomial_share, poisson_at_most, poisson_rate
from cdtool.statistics.small_sample import FEWEST, median_of, p95_of
from cdtool.statistics.spread import mean_interval

REPETITIONS = 1000
NOMINAL = 0.95
# Of the mean of 50 contacts, and of 10 normal ones.
LEAST_MEAN = 0.9

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Latencies:
    """Latencies [ms] with known statistics: each share of them has one distribution."""

    groups: tuple[tuple[float, Any], ...]

    def draw(self, rng: np.random.Generator, n: int) -> Floats:
        which = rng.choice(len(self.groups), n, p=[share for share, _ in self.groups])
        return np.choose(which, [group.rvs(n, random_state=rng) for _, group in self.groups])

    def later(self, latency: float | Floats) -> Any:
        """Return the share above a latency."""
        return sum(share * group.sf(latency) for share, group in self.groups)

    def quantile(self, share: float) -> float:
        return float(optimize.brentq(lambda latency: self.later(latency) - 1.0 + share, 0.0, 1e4))

    def figure(self, statistic: str) -> float:
        if statistic == "median":
            return self.quantile(0.5)
        mean = sum(share * group.mean() for share, group in self.groups)
        square = sum(share * (group.var() + group.mean() ** 2) for share, group in self.groups)
        return float(mean if statistic == "mean" else math.sqrt(square - mean**2))

    def watched(self, missed: float) -> float:
        """Mean of an exponential time of watching that ends before this share of the alarms."""
        middles = (np.arange(4000) + 0.5) / 4000
        return float(optimize.brentq(lambda mean: np.mean(self.later(-mean * np.log(middles))) - missed, 1.0, 1e4))


LATENCIES = {
    "normal, 40 +- 6 ms": Latencies(((1.0, stats.norm(40, 6)),)),
    "lognormal, 30 ms, sigma 0.5": Latencies(((1.0, stats.lognorm(0.5, scale=30)),)),
    "gamma, shape 2, mean 30 ms": Latencies(((1.0, stats.gamma(2, scale=15)),)),
    "80 % at 38, 20 % at 80 ms": Latencies(((0.8, stats.norm(38, 4)), (0.2, stats.norm(80, 8)))),
    "50 % at 38, 50 % at 80 ms": Latencies(((0.5, stats.norm(38, 4)), (0.5, stats.norm(80, 8)))),
}
# A few slow cases: no interval of ten or twenty contacts covers.
SLOW = {
    "95 % at 40, 5 % slow at 90 ms": Latencies(((0.95, stats.norm(40, 4)), (0.05, stats.norm(90, 8)))),
    "85 % at 40, 15 % slow at 90 ms": Latencies(((0.85, stats.norm(40, 4)), (0.15, stats.norm(90, 8)))),
}
SIZES = (10, 20, 50)
# Few contacts show median and range; the mixture with 15 % slow cases is the hardest one.
FEW = (4, 5, 6, 7, 8, 9)
FEW_LATENCIES = {
    "normal, 40 +- 6 ms": LATENCIES["normal, 40 +- 6 ms"],
    "lognormal, 30 ms, sigma 0.5": LATENCIES["lognormal, 30 ms, sigma 0.5"],
    "85 % at 38, 15 % slow at 120 ms": Latencies(((0.85, stats.norm(38, 4)), (0.15, stats.norm(120, 8)))),
}
# Recordings, contacts in each, and the latencies: half of the variance lies between recordings.
RECORDINGS = ((30, 4), (10, 10))
RECORDED = Latencies(((1.0, stats.norm(40, 6)),))
CENSORED = ("lognormal, 30 ms, sigma 0.5", "80 % at 38, 20 % at 80 ms")
MISSED = (0.0, 0.1, 0.3)


def main(repetitions: int, few_only: bool) -> int:
    """Print every table; return 0 if the coverage is sufficient: exact intervals, few contacts, n = 30."""
    print(f"== coverage of 95 % intervals [%]\n{environment()}", flush=True)
    held = print_exact()
    error = 100 * math.sqrt(NOMINAL * (1 - NOMINAL) / repetitions)
    print(f"\nsimulated: {repetitions} tests each, standard error of a figure about {error:.1f}", flush=True)
    samples = [(name, n) for name in LATENCIES | SLOW for n in SIZES]
    cut = [(name, n, missed) for name in CENSORED for n in (30, 100) for missed in MISSED]
    few = [(name, n) for name in FEW_LATENCIES for n in FEW]
    with ProcessPoolExecutor() as pool:
        shown = [Row(pool, few_hits, sample, repetitions) for sample in few]
        held &= print_few(few, shown, repetitions)
        if few_only:
            return 0 if held else 1
        independent = [Row(pool, mean_hits, sample, repetitions) for sample in samples]
        recordings = [Row(pool, recording_hits, numbers, repetitions) for numbers in RECORDINGS]
        quantiles = [Row(pool, quantile_hits, sample, repetitions) for sample in cut]
        held &= print_means(samples, independent)
        print_recordings(recordings)
        print_quantiles(cut, quantiles)
    return 0 if held else 1


class Row:
    """The repetitions of one row as jobs of a pool, in chunks with a seed each."""

    CHUNKS = 8

    def __init__(self, pool: Executor, hits: Callable[..., Floats], sample: tuple[Any, ...], repetitions: int) -> None:
        number = max(1, repetitions // self.CHUNKS)
        self.jobs: list[Future[Floats]] = [pool.submit(hits, *sample, number, seed) for seed in range(self.CHUNKS)]

    def shares(self) -> Floats:
        return np.mean([job.result() for job in self.jobs], axis=0)


def print_exact() -> bool:
    """Return the least coverage over every true share or rate, enumerated, for three treatments of a count of 0."""
    found = {f"missed share of {n}": missed_coverage(n) for n in (5, 10, 30, 100, 300)}
    found["false alarms, up to 40 expected"] = false_alarm_coverage(40.0)
    print("\nexact intervals, least coverage over every true value")
    table(("", "interval", "at most", "mixed"), [(title, *map(percent, least)) for title, least in found.items()])
    print("mixed: the one-sided bound where the count is 0 (or all), the interval elsewhere; cdtool does not use it")
    sound = all(min(interval, at_most) >= NOMINAL - 1e-9 for interval, at_most, _ in found.values())
    return said("interval and at most hold any true value with 95 %", sound)


def missed_coverage(n: int) -> list[float]:
    counts = np.arange(n + 1)
    intervals = np.array([(i.low, i.high) for i in (binomial_share(int(x), n) for x in counts)])
    at_most = np.array([(0.0, binomial_at_most(int(x), n)) for x in counts])
    mixed = np.vstack((at_most[:1], intervals[1:-1], 1.0 - at_most[:1, ::-1]))
    rules = (intervals, at_most, mixed)
    return [least_coverage(rule, lambda share: stats.binom.pmf(counts, n, share), 1.0) for rule in rules]


def false_alarm_coverage(highest: float) -> list[float]:
    # Counts of three times what is expected at most: more do not happen.
    counts = np.arange(3 * int(highest))
    intervals = np.array([(i.low, i.high) for i in (poisson_rate(int(x), 1.0) for x in counts)])
    at_most = np.array([(0.0, poisson_at_most(int(x), 1.0)) for x in counts])
    mixed = np.vstack((at_most[:1], intervals[1:]))
    rules = (intervals, at_most, mixed)
    return [least_coverage(rule, lambda mean: stats.poisson.pmf(counts, mean), highest) for rule in rules]


def least_coverage(bounds: Floats, probabilities: Callable[[float], Floats], highest: float) -> float:
    """Return the least probability that the bounds contain the true value; it occurs next to a bound."""
    beside = (bounds.ravel()[:, np.newaxis] * (1.0 - 1e-9, 1.0 + 1e-9)).ravel()
    true = beside[(beside > 0.0) & (beside < highest)]
    return min(float(probabilities(value)[(bounds[:, 0] <= value) & (value <= bounds[:, 1])].sum()) for value in true)


def mean_hits(name: str, n: int, repetitions: int, seed: int) -> Floats:
    """Return the share of the tests whose interval contains the true mean."""
    rng, latencies = np.random.default_rng((seed, n)), (LATENCIES | SLOW)[name]
    true = latencies.figure("mean")
    return np.array(
        [np.mean([holds(mean_interval(latencies.draw(rng, n), range(n)), true) for _ in range(repetitions)])]
    )


def few_hits(name: str, n: int, repetitions: int, seed: int) -> Floats:
    """Share of the tests that show an interval of mean, median and P95, and of those whose interval holds it.

    Last: the share of the tests in which Student's interval of the mean, which is not shown, would have held it.
    """
    rng, latencies = np.random.default_rng((seed, n)), FEW_LATENCIES[name]
    mean, median, p95 = latencies.figure("mean"), latencies.quantile(0.5), latencies.quantile(0.95)
    hits = np.zeros(7)
    for _ in range(repetitions):
        sample, seen = latencies.draw(rng, n), np.zeros(n, dtype=bool)
        shown = (mean_interval(sample, range(n)), median_of(sample, seen, range(n)), p95_of(sample, seen, range(n)))
        hits[:3] += [not math.isnan(interval.low) for interval in shown]
        hits[3:6] += [holds(interval, true) for interval, true in zip(shown, (mean, median, p95), strict=True)]
        bounds = stats.ttest_1samp(sample, 0.0).confidence_interval(NOMINAL)
        hits[6] += bounds.low <= mean <= bounds.high
    return hits / repetitions


def recording_hits(recordings: int, contacts: int, repetitions: int, seed: int) -> Floats:
    """Return the same by recording and, wrongly, by contact."""
    rng = np.random.default_rng((seed, recordings))
    recording = np.repeat(np.arange(recordings), contacts)
    mean, std = RECORDED.figure("mean"), RECORDED.figure("std")
    hits = np.zeros(2)
    for _ in range(repetitions):
        between = rng.normal(size=recordings)[recording]
        sample = mean + std * math.sqrt(0.5) * (between + rng.normal(size=len(recording)))
        hits += [holds(mean_interval(sample, clusters), mean) for clusters in (recording, range(len(recording)))]
    return hits / repetitions


def quantile_hits(name: str, n: int, missed: float, repetitions: int, seed: int) -> Floats:
    """Share of the tests whose interval holds the true median and P95; share with an upper limit of either."""
    rng, latencies = np.random.default_rng((seed, n)), LATENCIES[name]
    true = [latencies.quantile(share) for share in (0.5, 0.95)]
    mean = latencies.watched(missed) if missed else math.inf
    hits = np.zeros((2, 2))
    for _ in range(repetitions):
        latency, watched = latencies.draw(rng, n), mean * rng.exponential(size=n)
        found = [latency_quantile(np.minimum(latency, watched), latency > watched, share) for share in (0.5, 0.95)]
        hits += [
            [holds(interval, value) for interval, value in zip(found, true, strict=True)],
            [math.isfinite(interval.high) for interval in found],
        ]
    return hits.ravel() / repetitions


def holds(interval: Interval, true: float) -> bool:
    return interval.low <= true <= interval.high


def print_means(samples: Sequence[tuple[str, int]], rows: Sequence[Row]) -> bool:
    """Print the coverage of the mean by number of contacts; return whether 50 suffice, and 10 normal ones."""
    found = {sample: float(row.shares()[0]) for sample, row in zip(samples, rows, strict=True)}
    print("\nmean, independent contacts: Student's interval")
    head = ("", *(f"n = {n}" for n in SIZES))
    table(head, [(name, *(percent(found[name, n]) for n in SIZES)) for name in LATENCIES | SLOW])
    least = min(found[name, SIZES[-1]] for name in LATENCIES)
    text = f"mean of {SIZES[-1]}, and of 10 normal ones: at least {percent(LEAST_MEAN)}"
    return said(text, min(least, found["normal, 40 +- 6 ms", 10]) >= LEAST_MEAN)


def print_few(few: Sequence[tuple[str, int]], rows: Sequence[Row], repetitions: int) -> bool:
    """Print the intervals of 4 to 9 contacts; return whether each contains 95 %, within three errors."""
    lines, least, sound = [], 1.0, True
    for (name, n), row in zip(few, rows, strict=True):
        shares = row.shares()
        pairs = zip(shares[:3], shares[3:6], strict=True)
        cells = [percent(held / shown) if shown else "-" for shown, held in pairs]
        lines.append((f"{name}, n = {n}", *cells, percent(shares[6])))
        sound &= not shares[0] and not shares[2] and bool(shares[1]) == (n >= 6)
        least = min(least, float(shares[4] / shares[1])) if shares[1] else least
    print(f"\nbelow {FEWEST} contacts: what is shown (- no interval), and Student's interval of the mean, which is not")
    table(("", "mean", "median", "P95", "mean, not shown"), lines)
    error = math.sqrt(NOMINAL * (1.0 - NOMINAL) / repetitions)
    text = f"only the median has one, with 6 contacts or more; it holds in {percent(NOMINAL)} (least {percent(least)})"
    return said(text, sound and least >= NOMINAL - 3.0 * error)


def print_recordings(rows: Sequence[Row]) -> None:
    titles = [f"{recordings} recordings of {contacts}" for recordings, contacts in RECORDINGS]
    print("\nmean, contacts of a recording alike (half of the variance between recordings)")
    head = ("", "by recording", "wrongly by contact")
    table(head, [(title, *map(percent, row.shares())) for title, row in zip(titles, rows, strict=True)])


def print_quantiles(cut: Sequence[tuple[str, int, float]], rows: Sequence[Row]) -> None:
    print("\nKaplan-Meier quantiles, missed at random times of watching; bounded: has an upper limit")
    titles = [f"{name}, n = {n}, {100 * missed:.0f} % missed" for name, n, missed in cut]
    head = ("", "median", "P95", "median bounded", "P95 bounded")
    table(head, [(title, *map(percent, row.shares())) for title, row in zip(titles, rows, strict=True)])


def percent(share: float) -> str:
    return f"{100 * share:.1f}"


def said(text: str, good: bool) -> bool:
    print(f"{'ok  ' if good else 'FAIL'}  {text}", flush=True)
    return good


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("repetitions", type=int, nargs="?", default=REPETITIONS)
    parser.add_argument("--few", action="store_true", help="only exact intervals and those of 4 to 9 contacts")
    asked = parser.parse_args()
    sys.exit(main(asked.repetitions, asked.few))
