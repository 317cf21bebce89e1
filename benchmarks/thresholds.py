"""Every threshold with every detector of the gate and arm benchmarks, at one false-alarm budget, with the bound.

    python benchmarks/thresholds.py              # seed 901, all machines, about 40 minutes
    python benchmarks/thresholds.py 902 gate     # another seed, one machine: gate, T1, T2

1000 impact-free runs to learn from and to set each safety factor on (1 alarming operation in 100, by cross-validation,
as `cdtool benchmark --false-alarm-budget 1/100op` does it), 300 others to check it on, 100 stiff and 100 soft impacts,
simulated in memory as in gate_accuracy.py and arm_accuracy.py. Settings are each threshold's defaults. The bound is
that of delay_bound.py, in the innovations that `innovation`, `cusum` and `glr` share. No target: the last lines say in
how many cells the check gives p > 0.01, and in how many it would not by chance alone.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from statistics import mean
from typing import Any

import arm_accuracy
import gate_accuracy
import numpy as np
from accuracy import IMPACTS, Bench, written_setup
from delay_bound import Limit, limit_of, print_bounds, print_whiteness
from scipy.stats import betabinom, binomtest
from timing import environment, table

from cdtool.alarms.pipeline import detect_operation
from cdtool.commands.scoring.benchmark_file import HOLDOUT, BenchmarkFile
from cdtool.commands.scoring.learned_thresholds import learn_thresholds
from cdtool.commands.simulate.arm_recordings import simulate_arm
from cdtool.commands.simulate.gate_recordings import simulate_gate
from cdtool.detectors.detection import Signal
from cdtool.recordings.operations import Operation, operations_of
from cdtool.recordings.recording import Recording
from cdtool.results.curves.false_alarm_budget import Budget
from cdtool.thresholds import THRESHOLDS
from cdtool.thresholds.sequential import FittedSequential
from cdtool.thresholds.settings import with_context
from cdtool.truth.matching import match
from cdtool.truth.onset import find_contacts

SEED = 901
COUNTS = {"free": 1000, HOLDOUT: 300, "stiff": 100, "soft": 100}
BUDGET = Budget(1 / 100, "operation")
LEAST_P = 0.01
BENCHES: Mapping[str, tuple[Any, Any]] = {
    "gate": (partial(simulate_gate, seed=0), gate_accuracy.simulate),
    "T1": (partial(simulate_arm, seed=0, trial=1), partial(arm_accuracy.simulate, 1)),
    "T2": (partial(simulate_arm, seed=0, trial=2), partial(arm_accuracy.simulate, 2)),
}
# Thresholds with the same whitening: the same signature, the same order.
WHITENING = ("innovation", "cusum", "glr")
DEBOUNCE_1 = "cusum, debounce 1"

Operations = Mapping[str, Sequence[Operation]]


@dataclass
class Remembered:
    """A detector whose signals are computed once and shared by all thresholds; recordings are known by their names."""

    detector: Any
    signals: dict[str, Signal] = field(default_factory=dict)

    @property
    def name(self) -> str:
        return str(self.detector.name)

    def signal(self, recording: Recording, machine: Any) -> Signal:
        if recording.name not in self.signals:
            self.signals[recording.name] = self.detector.signal(recording, machine)
        return self.signals[recording.name]


@dataclass
class SharedWhitening:
    """One of WHITENING as a rule whose whitening is learned once for all of them, from the same runs."""

    rule: Any
    learned: dict[tuple[str, ...], FittedSequential]
    by_class: bool = True

    def __getattr__(self, name: str) -> Any:
        return getattr(self.rule, name)

    def fit(self, pairs: Sequence[tuple[Recording, Signal]]) -> FittedSequential:
        runs = tuple(recording.name for recording, _ in pairs)
        if runs not in self.learned:
            self.learned[runs] = self.rule.fit(pairs)
        return replace(self.learned[runs], rule=self.rule).with_safety_factor(self.rule.safety_factor)


@dataclass
class Row:
    """One detector with one threshold: its factor, latencies [ms], misses, contacts not assessable, alarming runs."""

    title: str
    factor: float
    alarming: int = 0
    latencies: dict[str, list[float]] = field(default_factory=lambda: {group: [] for group in IMPACTS})
    missed: dict[str, int] = field(default_factory=lambda: dict.fromkeys(IMPACTS, 0))
    not_assessable: dict[str, int] = field(default_factory=lambda: dict.fromkeys(IMPACTS, 0))

    @property
    def p(self) -> float:
        """Two-sided binomial test of the alarming hold-out operations against the budget."""
        return float(binomtest(self.alarming, COUNTS[HOLDOUT], BUDGET.rate).pvalue)

    def mean(self, group: str) -> float:
        """Mean latency of the contacts that were detected [ms]; NaN without any."""
        return mean(self.latencies[group]) if self.latencies[group] else math.nan

    def late(self, group: str) -> float:
        """Return the latency met by 95 % of the contacts [ms]; infinite if more are missed."""
        every = [*self.latencies[group], *[math.inf] * self.missed[group]]
        return float(np.quantile(every, 0.95, method="inverted_cdf")) if every else math.nan


@dataclass(frozen=True)
class Study:
    """One detector on one machine: a row for each threshold, and the bound; None where nothing could be learned."""

    machine: str
    detector: str
    rows: tuple[Row, ...]
    limit: Limit | None

    def row(self, title: str) -> Row:
        return next(row for row in self.rows if row.title == title)


def rules(setup: BenchmarkFile) -> Iterator[tuple[str, BenchmarkFile]]:
    """Every registered threshold with its default settings; both shapes of one, and the sum without debounce."""
    shared: dict[tuple[str, ...], FittedSequential] = {}
    for name in THRESHOLDS.names():
        for shape in ("line", "table") if name == "limit_and_trend" else ("",):
            settings = {"shape": shape} if shape else {}
            rule = with_context(THRESHOLDS.load(name)(**settings), setup.signature.sides, setup.signature)
            # What a benchmark file says in [signature] is the signature's own rule.
            rule = setup.signature if name == "signature" else rule
            rule = SharedWhitening(rule, shared) if name in WHITENING else rule
            used = replace(setup, threshold=name, rule=rule, budget=BUDGET)
            yield f"{name}, {shape}" if shape else name, used
            if name == "cusum":
                yield DEBOUNCE_1, replace(used, activation=replace(setup.activation, debounce=1))


def study(name: str, seed: int) -> Iterator[Study]:
    """Simulate a machine's runs; every detector of its benchmark file with every threshold."""
    write, simulate = BENCHES[name]
    bench = Bench(written_setup(write), COUNTS, simulate)
    machine = bench.setup.machine_file.machine
    operations: dict[str, list[Operation]] = {}
    for group, count in COUNTS.items():
        logs = (bench.simulate(seed, group, number) for number in range(1, count + 1))
        operations[group] = [item for log in logs for item in operations_of(machine.referred_to_load(log))]
    for known in bench.setup.detectors:
        detector = Remembered(bench.setup.machine_file.detector(known))
        rows, limit = [], None
        for title, setup in rules(bench.setup):
            learned = learn_thresholds(setup, operations["free"], [detector], [])
            if learned.skipped:
                sys.exit(f"error: {learned.skipped[0].recording}: {learned.skipped[0].reason}")
            fitted = learned.thresholds[detector.name]
            rows.append(_scored(title, setup, operations, detector, fitted))
            if title == "cusum" and fitted:
                limit = limit_of(setup, operations, detector, fitted[0])
        yield Study(name, detector.detector.short_name, tuple(rows), limit)


def _scored(title: str, setup: BenchmarkFile, operations: Operations, detector: Any, fitted: Any) -> Row:
    row, machine = Row(title, fitted[0].safety_factor if fitted else math.nan), setup.machine_file.machine
    for group in (HOLDOUT, *IMPACTS):
        for operation in operations[group]:
            found = detect_operation(operation, machine, detector, fitted, setup.activation, setup.watched)
            if group == HOLDOUT:
                row.alarming += bool(found.verdict.alarms)
                continue
            contacts = find_contacts(operation.recording, setup.onset)
            if len(contacts) != 1:
                sys.exit(f"error: {operation.name}: {len(contacts)} contacts found")
            item = match(found.verdict, contacts, found.statistic, setup.impacts[group].window).matches[0]
            if item.outcome == "detected":
                row.latencies[group].append(1e3 * item.latency)
            else:
                (row.missed if item.outcome == "missed" else row.not_assessable)[group] += 1
    return row


def print_rows(item: Study) -> None:
    """A detector's thresholds: factor, each group's latencies [ms] and what was not detected, and the check."""
    if all(row.not_assessable[group] == COUNTS[group] for row in item.rows for group in IMPACTS):
        print(f"{item.machine} {item.detector}: not assessable in any contact, whatever the threshold\n", flush=True)
        return
    groups = [head for group in IMPACTS for head in (group, "P95", "missed", "n/a")]
    rows = []
    for row in item.rows:
        cells = [row.title, f"{row.factor:.3g}"]
        for group in IMPACTS:
            cells += [f"{row.mean(group):.1f}", f"{row.late(group):.0f}"]
            cells += [f"{row.missed[group]}", f"{row.not_assessable[group]}"]
        rows.append([*cells, f"{row.alarming}", f"{row.p:.3f}" + ("" if row.p > LEAST_P else " *")])
    table((f"{item.machine} {item.detector}", "factor", *groups, f"alarms/{COUNTS[HOLDOUT]}", "p"), rows)
    print(flush=True)


def print_check(studies: Sequence[Study]) -> None:
    """Print how many cells meet the budget on the hold-out runs, and how many would by chance."""
    rows = [(f"{item.machine} {item.detector}", row) for item in studies if item.limit for row in item.rows]
    failing = [f"{who} {row.title} {row.alarming}" for who, row in rows if row.p <= LEAST_P]
    # Just above the c-th largest of n critical factors the true rate is distributed as Beta(c, n + 1 - c).
    among = math.floor(BUDGET.rate * (COUNTS["free"] + 1) + 1e-9)
    counts = np.arange(COUNTS[HOLDOUT] + 1)
    unlikely = [k for k in counts if binomtest(int(k), COUNTS[HOLDOUT], BUDGET.rate).pvalue <= LEAST_P]
    chance = float(betabinom(COUNTS[HOLDOUT], among, COUNTS["free"] + 1 - among).pmf(unlikely).sum())
    print(f"budget {BUDGET}, checked on {COUNTS[HOLDOUT]} operations: p > {LEAST_P} in {len(rows) - len(failing)} of")
    print(f"{len(rows)} cells (machine, detector, threshold); not in: {', '.join(failing) or 'none'}")
    print(f"by chance alone, as a factor rests on {COUNTS['free']} runs: not in {chance * len(rows):.1f} cells;")
    average = mean(row.alarming for _, row in rows)
    print(f"cells of one machine share their runs and so their luck; alarming operations: {average:.2f} on average")


def main(seed: int, machines: Sequence[str]) -> int:
    """Print everything, each detector as soon as it is through."""
    print(f"== detector x threshold at {BUDGET}, seed {seed}\n{environment()}\n", flush=True)
    studies = []
    for item in (item for name in machines for item in study(name, seed)):
        studies.append(item)
        print_rows(item)
    print("means over the contacts detected, ms; P95: over all, missed = inf; n/a: not assessable; alarms: alarming")
    print(f"hold-out operations; p: binomial test of these against the budget, * where not above {LEAST_P}\n")
    print_bounds(studies, BUDGET.rate, ("cusum", DEBOUNCE_1, "glr"))
    print_whiteness(studies, BUDGET.rate, DEBOUNCE_1)
    print_check(studies)
    return 0


if __name__ == "__main__":
    seeds = [int(word) for word in sys.argv[1:] if word.isdigit()] or [SEED]
    wanted = [word for word in sys.argv[1:] if not word.isdigit()] or list(BENCHES)
    if len(seeds) > 1 or not set(wanted) <= set(BENCHES):
        sys.exit(f"error: {' '.join(sys.argv[1:])}: a seed, and machines of {', '.join(BENCHES)}")
    sys.exit(main(seeds[0], wanted))
