"""Write docs/robustness.md: how every detector with every threshold performs when a simulated machine has changed.

    python docs/make_robustness.py                       # simulate and score everything: about 20 minutes on two cores
    python docs/make_robustness.py --page                # only page and picture again, from docs/robustness.csv
    python docs/make_robustness.py --machines gate --seeds 1 --runs 4 --impacts 2 -o try

Each seed of a machine: runs to learn from and recordings of the machine as it is, and of each change; a benchmark file
with [conditions] for each threshold. Results of all seeds are added up in robustness.csv, from which page and picture
are made: every sentence about the results follows from them by a rule in this file.
"""

from __future__ import annotations

import argparse
import csv
import math
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from cdtool import benchmark, simulate_arm, simulate_gate
from cdtool.base.plain_text import counted
from cdtool.commands.simulate.changed_machine import ChangedMachine
from cdtool.detectors import DETECTORS
from cdtool.report.plots.figures import drawing, new_figure, save
from cdtool.results.changed_conditions import OnMachine, condition_rows
from cdtool.statistics.rates import binomial_share
from cdtool.thresholds import THRESHOLDS

DOCS = Path(__file__).resolve().parent
PAGE, RESULTS, PICTURE = "robustness.md", "robustness.csv", "images/robustness.png"
COMMAND = "python docs/make_robustness.py"
FIRST_SEED = 701
LEARNED_RUNS = 30
GROUPS = ("stiff", "soft")
UNCHANGED = "as learned"
CHANGES = {
    "friction +20 %": ChangedMachine(friction=1.2),
    "friction -20 %": ChangedMachine(friction=0.8),
    "speed +20 %": ChangedMachine(speed=1.2),
    "speed +10 %": ChangedMachine(speed=1.1),
    "speed -10 %": ChangedMachine(speed=0.9),
    "speed -20 %": ChangedMachine(speed=0.8),
    "mass +10 %": ChangedMachine(mass=1.1),
    "current +0.1 A": ChangedMachine(current_offset=0.1),
    "acceleration +0.05 m/s²": ChangedMachine(acceleration_offset=0.05),
    "motor +10 K": ChangedMachine(warming=10.0),
}
STATES = (UNCHANGED, *CHANGES)
SIMULATORS: Mapping[str, Callable[..., int]] = {"gate": simulate_gate, "arm": partial(simulate_arm, trial=1)}
TITLES = {"gate": "Sliding gate", "arm": "Arm, hit on its first link"}
# The signature with options that help, as lines of [signature], and the threshold that a detector brings.
FOLLOWING, RANGE = "signature, adaptive_level", "signature, speed_range"
OPTIONS = {FOLLOWING: "adaptive_level = 6", RANGE: "speed_range = true"}
# With speed_range, a third of the runs is learned from at each of these shares of the nominal speed.
LEARNED_SPEEDS = {"slow": 0.8, "nominal": 1.0, "fast": 1.2}
# The largest shares of alarming runs, and of runs, contacts and further samples that are not assessable, with which a
# combination of a detector and a threshold tolerates a change.
MOST_ALARMING, MOST_NOT_ASSESSABLE = 0.05, 0.1
PAIRS = {
    "friction ±20 %": ("friction +20 %", "friction -20 %"),
    "speed ±10 %": ("speed +10 %", "speed -10 %"),
    "speed ±20 %": ("speed +20 %", "speed -20 %"),
}
SPEEDS = (*PAIRS["speed ±10 %"], *PAIRS["speed ±20 %"])
_MOST_NAMED = 4
# Tolerated, not tolerated, hardly assessable: pale enough for black numbers, apart for colour-blind readers.
_COLOURS = ("#A8DDB5", "#F4B183", "#E3E3E3")
COUNTS = ("seeds", "runs", "assessable", "alarming", "contacts", "not_assessable", "missed")
KEYS = ("machine", "detector", "threshold", "state")

CONDITION = """
[conditions."{change}"]
holdout.logs = ["{folder}/holdout/*.csv"]
impacts.stiff.logs = ["{folder}/stiff/*.csv"]
impacts.soft.logs = ["{folder}/soft/*.csv"]
"""


@dataclass
class Cell:
    """A detector with a threshold in one state of a machine: counts, and the sum of the latencies [ms] by group.

    `alarming` of `assessable` impact-free runs alarm, of `runs`. Of `contacts` some are missed or not assessable.
    `unassessed` is the sum over the seeds of the share of the samples that were not assessable.
    """

    alarming: int = 0
    assessable: int = 0
    runs: int = 0
    contacts: int = 0
    missed: int = 0
    not_assessable: int = 0
    seeds: int = 0
    unassessed: float = 0.0
    detected: dict[str, int] = field(default_factory=lambda: dict.fromkeys(GROUPS, 0))
    latency_sum: dict[str, float] = field(default_factory=lambda: dict.fromkeys(GROUPS, 0.0))

    def add(self, seen: OnMachine) -> None:
        """Add the results of a benchmark."""
        alarming, assessable = seen.alarming
        self.alarming += alarming
        self.assessable += assessable
        self.runs += seen.free.operations if seen.free else 0
        not_assessable, contacts = seen.not_assessable
        self.contacts += contacts
        self.not_assessable += not_assessable
        self.missed += seen.missed[0]
        self.seeds += 1
        # A detector that fails on every log has no sample.
        self.unassessed += 1.0 if math.isnan(seen.not_assessable_share) else seen.not_assessable_share
        for group, summary in seen.struck.items():
            if summary.detected:
                self.detected[group] += summary.detected
                self.latency_sum[group] += summary.detected * summary.mean_ms

    @property
    def row(self) -> dict[str, float]:
        """Return the values as they are in robustness.csv."""
        means = {f"{group}_ms": round(self.mean(group), 3) for group in GROUPS}
        counts = {name: getattr(self, name) for name in COUNTS}
        detected = {f"{group}_detected": count for group, count in self.detected.items()}
        return {**counts, **detected, **means, "unassessed_samples": round(self.unassessed / self.seeds, 4)}

    @classmethod
    def of_row(cls, row: Mapping[str, str]) -> Cell:
        """Return the cell of a row of robustness.csv."""
        counts = {name: int(row[name]) for name in COUNTS}
        detected = {group: int(row[f"{group}_detected"]) for group in GROUPS}
        sums = {group: count * float(row[f"{group}_ms"]) if count else 0.0 for group, count in detected.items()}
        unassessed = counts["seeds"] * float(row["unassessed_samples"])
        return cls(**counts, unassessed=unassessed, detected=detected, latency_sum=sums)

    def mean(self, group: str) -> float:
        """Return the mean latency [ms] of the detected contacts; NaN without any."""
        return self.latency_sum[group] / self.detected[group] if self.detected[group] else math.nan

    @property
    def typical(self) -> float:
        """Return the geometric mean of the mean latencies [ms]; infinite where a group has none."""
        means = [self.mean(group) for group in GROUPS]
        return math.inf if any(map(math.isnan, means)) else math.exp(sum(map(math.log, means)) / len(means))

    @property
    def alarming_share(self) -> float:
        """Return the share of the assessable runs that alarm; NaN without any."""
        return self.alarming / self.assessable if self.assessable else math.nan

    def is_assessable(self, unchanged: Cell) -> bool:
        """Whether nearly all runs and contacts could be assessed, and hardly fewer samples than of another cell."""
        return (
            self.runs - self.assessable <= MOST_NOT_ASSESSABLE * self.runs
            and self.not_assessable <= MOST_NOT_ASSESSABLE * self.contacts
            and self.unassessed / self.seeds <= unchanged.unassessed / unchanged.seeds + MOST_NOT_ASSESSABLE
        )


def tolerates(states: Mapping[str, Cell], state: str) -> bool:
    """Return whether, as learned and in a state, hardly a run alarms, no contact is missed, and all is assessable."""
    unchanged = states[UNCHANGED]
    return all(
        cell is not None and cell.is_assessable(unchanged) and not cell.missed and cell.alarming_share <= MOST_ALARMING
        for cell in (unchanged, states.get(state))
    )


# By detector, threshold and state of the machine.
Cells = dict[str, dict[str, dict[str, Cell]]]


@dataclass(frozen=True)
class Simulated:
    """The results of a machine, and of how many seeds, runs and impacts of a kind they are."""

    cells: Cells
    seeds: int
    runs: int
    impacts: int

    @classmethod
    def of_cells(cls, cells: Cells) -> Simulated:
        """Return the results with the numbers that any of their cells has."""
        cell = next(states[UNCHANGED] for rules in cells.values() for states in rules.values())
        return cls(cells, cell.seeds, cell.runs // cell.seeds, cell.contacts // cell.seeds // len(GROUPS))

    @property
    def all_runs(self) -> int:
        """Return the number of impact-free runs of each cell."""
        return self.seeds * self.runs

    @property
    def all_contacts(self) -> int:
        """Return the number of contacts of each cell."""
        return self.seeds * self.impacts * len(GROUPS)


def threshold_names() -> tuple[str, ...]:
    """Return the thresholds, without those that need a list of others."""
    names = [name for name in THRESHOLDS.names() if name != "combined"]
    return ("signature", *OPTIONS, *(name for name in names if name != "signature"))


def benchmark_text(simulated: str, threshold: str, changes: Sequence[str]) -> str:
    """Return the benchmark file of a simulator with a threshold, and the changed machine as its conditions."""
    text = simulated
    if threshold in OPTIONS:
        text = text if "[signature]" in text else f"{text}\n[signature]\n"
        text = text.replace("[signature]\n", f"[signature]\n{OPTIONS[threshold]}\n")
        if threshold == RANGE:
            logs = ", ".join(f'"{folder}/free/*.csv"' for folder in LEARNED_SPEEDS)
            text = text.replace('logs = ["free/*.csv"]', f"logs = [{logs}]")
    else:
        text = text.replace("\n[learn]", f'threshold = "{threshold}"\n\n[learn]')
    return text + "".join(CONDITION.format(change=name, folder=f"changed_{i}") for i, name in enumerate(changes, 1))


def simulate(
    folder: Path, machine: str, seed: int, changes: Mapping[str, ChangedMachine], counts: tuple[int, int]
) -> None:
    """Write the machine as it is, and in a folder each as it has changed; `counts` are runs and impacts of a kind."""
    runs, impacts = counts
    numbers = {"holdout": runs, **dict.fromkeys(GROUPS, impacts)}
    SIMULATORS[machine](folder, {"free": LEARNED_RUNS, **numbers}, seed=seed)
    for number, (name, speed) in enumerate(LEARNED_SPEEDS.items(), 1):
        free = {"free": LEARNED_RUNS // len(LEARNED_SPEEDS)}
        SIMULATORS[machine](folder / name, free, seed=seed + 100_000 * number, changed=ChangedMachine(speed=speed))
    for number, changed in enumerate(changes.values(), 1):
        SIMULATORS[machine](folder / f"changed_{number}", numbers, seed=seed + 1000 * number, changed=changed)


def score(
    folder: Path, threshold: str, changes: Sequence[str], detectors: Sequence[str]
) -> Iterator[tuple[str, str, OnMachine]]:
    """Yield the results of each detector with a threshold, in each state of the machine."""
    file = folder / "benchmark_of_threshold.toml"
    simulated = (folder / "benchmark.toml").read_text(encoding="utf-8")
    file.write_text(benchmark_text(simulated, threshold, changes), encoding="utf-8")
    seen = set()
    for row in condition_rows(benchmark(file, detectors=detectors, jobs=2).evaluated):
        if row.unchanged.free is None or not row.unchanged.struck:
            continue  # nothing could be learned for it
        if row.detector not in seen:
            seen.add(row.detector)
            yield row.detector, UNCHANGED, row.unchanged
        yield row.detector, row.condition, row.changed


def usable(folder: Path) -> list[str]:
    """Return the detectors that can assess the recordings of a machine."""
    results = benchmark(folder / "benchmark.toml", detectors=["all"], jobs=2).results
    known = {item.detector for item in results.exposure if item.not_assessable < item.operations}
    return [name for name in DETECTORS.names() if name in known]


def simulated_cells(
    machine: str,
    seeds: int,
    counts: tuple[int, int],
    *,
    changes: Mapping[str, ChangedMachine] = CHANGES,
    detectors: Sequence[str] = (),
    thresholds: Sequence[str] = (),
) -> Cells:
    """Simulate and score a machine; by default every detector with every threshold under every change."""
    cells: Cells = {}
    every = list(detectors)
    for seed in range(FIRST_SEED, FIRST_SEED + seeds):
        with tempfile.TemporaryDirectory() as made:
            folder = Path(made)
            simulate(folder, machine, seed, changes, counts)
            every = every or usable(folder)
            for threshold in [name for name in threshold_names() if name in (thresholds or (name,))]:
                for detector, state, seen in score(folder, threshold, tuple(changes), every):
                    of_threshold = cells.setdefault(detector, {}).setdefault(threshold, {})
                    of_threshold.setdefault(state, Cell()).add(seen)
                print(machine, seed, threshold, file=sys.stderr, flush=True)
    return {name: cells[name] for name in DETECTORS.names() if name in cells}


def write_results(path: Path, machines: Mapping[str, Simulated]) -> None:
    """Write robustness.csv: a row per machine, detector, threshold and state."""
    rows = [
        dict(zip(KEYS, (machine, detector, threshold, state), strict=True)) | cell.row
        for machine, simulated in machines.items()
        for detector, rules in simulated.cells.items()
        for threshold, states in rules.items()
        for state, cell in states.items()
    ]
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def read_results(path: Path) -> dict[str, Simulated]:
    """Return the results of each machine in robustness.csv."""
    machines: dict[str, Cells] = {}
    with path.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            machine, detector, threshold, state = (row[key] for key in KEYS)
            of_detector = machines.setdefault(machine, {}).setdefault(detector, {})
            of_detector.setdefault(threshold, {})[state] = Cell.of_row(row)
    return {name: Simulated.of_cells(cells) for name, cells in machines.items()}


HEAD = """# When the machine has changed

A threshold is learned from a machine on some day. Later its friction is higher because it is cold, its speed is set to
another value, a sensor drifts. This page shows how every registered detector then performs with every threshold but
`combined`; every combination in every state is a row of [robustness.csv](robustness.csv). All of it is written by a
command:

```sh
{commands}
python docs/make_robustness.py --page   # only page and picture again, from robustness.csv
```

* Machines: the simulated [sliding gate](simulators.md) and the simulated arm that is hit on its first link, {numbers}
  for each state of the machine. {learned} impact-free runs of the unchanged machine are learned from; all settings are
  the defaults.
* Changes: as `cdtool simulate gate --set friction=1.2` makes them. Friction, speed and mass are those of the load; the
  offsets are added to the logged motor current and to the accelerometers; a motor that is warmer by 10 K needs 1.1 %
  more current for a torque.
{options}

## In short

A combination of a detector and a threshold **tolerates** a change if, before and after it, at most {alarming:.0f} % of
the impact-free runs alarm, no contact is missed, and hardly anything is not assessable: at most {not_assessable:.0f} %
of the runs and of the contacts, and of the samples at most {not_assessable:.0f} % more than before. The fastest one has
the smallest geometric mean of the two mean latencies.

![Detectors and changes, with three settings of the signature: share of alarming runs, green if tolerated]({picture})

Share of the assessable impact-free runs that alarm [%] if any does. Green: the change is tolerated. Orange: it is not;
without a number, contacts are missed, then or already as learned. Grey: hardly assessable.

"""
LEARNED_FROM = {
    RANGE: f", learned from {LEARNED_RUNS // len(LEARNED_SPEEDS)} runs at each of "
    f"{', '.join(f'{100 * share:.0f}' for share in LEARNED_SPEEDS.values())} % of the nominal speed"
}
TAIL = """## Your own machine

The same comparison on your recordings needs no simulator: list the logs of the changed machine under
[`[conditions]`](benchmark-file.md#changed-conditions) of the benchmark file. Runs without impacts are enough to see the
false alarms.

## What this page does not show

* Everything is simulated. No change on this page was seen in real recordings.
* In the simulators a change is pure: friction rises everywhere by the same share; noise, controller and obstacles stay
  the same. A real winter changes several of these at once.
* The thresholds have their default settings, not a common false-alarm budget:
  [Thresholds](thresholds.md#compared-at-the-same-false-alarm-budget) has that comparison for the unchanged machine.
* The numbers are those of few runs: {few} of {count} alarming has a 95 % interval of {low:.1f} to {high:.0f} %.
"""


def page_text(machines: Mapping[str, Simulated]) -> str:
    """Return the page of these results."""
    head = HEAD.format(
        learned=LEARNED_RUNS,
        commands="\n".join(
            f"{COMMAND} --machines {machine} --seeds {item.seeds} --runs {item.runs} --impacts {item.impacts}"
            for machine, item in machines.items()
        ),
        numbers=" and ".join(
            dict.fromkeys(
                f"{item.all_runs} impact-free runs and {item.all_contacts} contacts" for item in machines.values()
            )
        ),
        options="\n".join(
            f"* `{name}` is the signature with `{option}`{LEARNED_FROM.get(name, '')}, see [Signature](signature.md)."
            for name, option in OPTIONS.items()
        ),
        picture=PICTURE,
        alarming=100 * MOST_ALARMING,
        not_assessable=100 * MOST_NOT_ASSESSABLE,
    )
    parts = [head, *(f"{_in_short(machine, simulated.cells)}\n" for machine, simulated in machines.items())]
    count = min(simulated.all_runs for simulated in machines.values())
    few = round(MOST_ALARMING * count)
    share = binomial_share(few, count)
    return "".join(
        [*parts, TAIL.format(learned=LEARNED_RUNS, few=few, count=count, low=100 * share.low, high=100 * share.high)]
    )


def _in_short(machine: str, cells: Cells) -> str:
    """Return the table of the fastest combinations that tolerate each change, and what follows from all of them."""
    every = _combinations(cells)
    head = ("change", f"tolerate it, of {len(every)}", "fastest of them", "alarming [%]", "stiff/soft [ms]")
    rows = []
    for state in STATES:
        good = {key: states for key, states in every.items() if tolerates(states, state)}
        best = min(good, key=lambda key: good[key][state].typical, default=None)
        shown = (_named(*best), *_in_words(good[best], state)) if best else ("–",) * 3
        rows.append((state, str(len(good)), *shown))
    lines = "".join(f"* {line}\n" for line in conclusions(cells))
    return f"### {TITLES[machine]} in short\n\n{_table(head, rows)}\n{lines}"


def _combinations(cells: Cells) -> dict[tuple[str, str], dict[str, Cell]]:
    """Return the states of each combination of a detector and a threshold."""
    return {(name, rule): states for name, rules in cells.items() for rule, states in rules.items()}


def conclusions(cells: Cells) -> Iterator[str]:
    """Yield the sentences that follow from the results of a machine, each by a rule."""
    every = _combinations(cells)
    count = {key: sum(tolerates(states, state) for state in CHANGES) for key, states in every.items()}
    most = max(count.values())
    best = sorted((key for key in count if count[key] == most), key=lambda key: every[key][UNCHANGED].typical)
    named = ", ".join(f"{_named(*key)} ({_in_words(every[key], UNCHANGED)[1]} ms)" for key in best[:_MOST_NAMED])
    more = f" and {len(best) - _MOST_NAMED} more" if len(best) > _MOST_NAMED else ""
    which = "Every change is" if most == len(CHANGES) else f"Most changes, {most} of {len(CHANGES)}, are"
    yield f"{which} tolerated by {named}{more}{', the fastest first' if len(best) > 1 else ''}."
    lasting = [state for state in CHANGES if state not in SPEEDS]
    steady = [key for key, states in every.items() if all(tolerates(states, state) for state in lasting)]
    if steady:
        fastest = min(steady, key=lambda key: every[key][UNCHANGED].typical)
        yield (
            f"Every change but that of the speed is tolerated by {counted(len(steady), 'combination')}; the fastest is "
            f"{_named(*fastest)} ({_in_words(every[fastest], UNCHANGED)[1]} ms)."
        )
    for words, states in PAIRS.items():
        counts = {}
        for rule in ("signature", *OPTIONS):
            rows = [rules[rule] for rules in cells.values() if rule in rules]
            counts[rule] = f"{sum(all(tolerates(row, state) for state in states) for row in rows)} of {len(rows)}"
        yield (
            f"{words}: tolerated by {counts['signature']} detectors with `signature`, by {counts[FOLLOWING]} with its "
            f"`adaptive_level`, by {counts[RANGE]} with its `speed_range`."
        )
    for option in OPTIONS:
        costs = _costs_of(option, cells)
        if costs:
            name, group, cost = max(costs, key=lambda item: item[2])
            words = option.removeprefix("signature, ")
            yield f"`{words}` costs at most {100.0 * cost:.0f} % latency as learned (`{name}`, {group})."


def _costs_of(option: str, cells: Cells) -> list[tuple[str, str, float]]:
    """Return by how much the latency as learned is longer with an option, as a share, by detector and group."""
    pairs = [
        (name, rules["signature"][UNCHANGED], rules[option][UNCHANGED])
        for name, rules in cells.items()
        if "signature" in rules and option in rules
    ]
    return [
        (name, group, with_option.mean(group) / without.mean(group) - 1.0)
        for name, without, with_option in pairs
        for group in GROUPS
        if without.detected[group] and with_option.detected[group]
    ]


def _in_words(states: Mapping[str, Cell], state: str) -> tuple[str, str]:
    """Return the share of alarming runs in per cent, and the mean latencies with the missed contacts."""
    cell = states.get(state)
    if cell is None:
        return "–", "–"
    alarming = "n.a."
    if cell.assessable:
        alarming = f"{100.0 * cell.alarming_share:.0f}{'' if cell.is_assessable(states[UNCHANGED]) else '*'}"
    if cell.contacts == cell.not_assessable:
        return alarming, "n.a."
    means = "/".join(f"{cell.mean(group):.0f}" if cell.detected[group] else "–" for group in GROUPS)
    missed = f" ({cell.missed})" if cell.missed else ""
    mark = "" if cell.not_assessable <= MOST_NOT_ASSESSABLE * cell.contacts else "*"
    return alarming, f"{means}{missed}{mark}"


def _named(detector: str, rule: str) -> str:
    return f"`{detector}` with `{rule}`"


def draw(machines: Mapping[str, Simulated], image: Path) -> None:
    """Draw the share of alarming runs by detector and change: for the signature, and with each of its options."""
    from matplotlib.colors import ListedColormap

    rules = ("signature", *OPTIONS)
    with drawing():
        figure = new_figure(10.5, 0.5 + sum(0.6 + 0.22 * len(item.cells) for item in machines.values()))
        heights = [len(item.cells) for item in machines.values()]
        panels = figure.subplots(len(machines), len(rules), squeeze=False, sharex=True, height_ratios=heights)
        for row, (machine, simulated) in zip(panels, machines.items(), strict=True):
            for axes, rule in zip(row, rules, strict=True):
                cells = [states.get(rule, {}) for states in simulated.cells.values()]
                kinds = [[_kind(states, state) for state in STATES] for states in cells]
                axes.pcolormesh(kinds, cmap=ListedColormap(_COLOURS), vmin=0, vmax=2, edgecolors="white", linewidth=1)
                for line, states in enumerate(cells):
                    for column, state in enumerate(STATES):
                        text = _in_words(states, state)[0].removesuffix("n.a.") if states else "–"
                        axes.text(
                            column + 0.5, line + 0.5, "" if text == "0" else text, ha="center", va="center", fontsize=6
                        )
                axes.set_title(f"{machine}: {rule}", fontsize=9)
                names = [name.replace("-", "−") for name in STATES]
                axes.set_xticks([column + 0.5 for column in range(len(names))], names, rotation=60, ha="right")
                axes.set_yticks([line + 0.5 for line in range(len(cells))])
                axes.set_yticklabels(simulated.cells if axes is row[0] else [])
                axes.invert_yaxis()
        save(figure, image)


def _kind(states: Mapping[str, Cell], state: str) -> int:
    """Return 0 for a change that is tolerated, 1 for one that is not, 2 where hardly anything can be assessed."""
    if state not in states or not states[state].is_assessable(states[UNCHANGED]):
        return 2
    return 0 if tolerates(states, state) else 1


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [f"| {' | '.join(head)} |", f"|{'---|' * len(head)}", *(f"| {' | '.join(row)} |" for row in rows)]
    return "\n".join(lines) + "\n"


def main(arguments: list[str]) -> int:
    """Simulate, score and write both files, or only the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--page", action="store_true", help="write page and picture from robustness.csv")
    parser.add_argument(
        "--machines", nargs="+", choices=list(SIMULATORS), default=list(SIMULATORS), help="those simulated again"
    )
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--runs", type=int, default=20, help="impact-free runs of each seed and state of the machine")
    parser.add_argument("--impacts", type=int, default=5, help="impacts of each kind, seed and state")
    parser.add_argument("-o", "--output", type=Path, default=DOCS, help="folder of the two files")
    options = parser.parse_args(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    results = options.output / RESULTS
    machines = read_results(results) if results.exists() else {}
    for name in [] if options.page else options.machines:
        cells = simulated_cells(name, options.seeds, (options.runs, options.impacts))
        machines[name] = Simulated(cells, options.seeds, options.runs, options.impacts)
        write_results(results, machines)
    (options.output / PICTURE).parent.mkdir(exist_ok=True)
    draw(machines, options.output / PICTURE)
    (options.output / PAGE).write_text(page_text(machines), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
