"""Tune the detectors of a benchmark file at a false-alarm budget, one after the other."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from cdtool.alarms.activation import DEBOUNCE_TIME, Activation
from cdtool.alarms.pipeline import run_detector, signal_of_log
from cdtool.base.errors import CdtoolError, SignatureError, UsageError
from cdtool.base.value_words import value_in_words
from cdtool.commands.judging.settings_table import detectors_of
from cdtool.commands.learning.calibration import kept
from cdtool.commands.learning.fitting import Fitted, fitting, for_machine
from cdtool.commands.scoring.benchmark_file import (
    BenchmarkFile,
    read_benchmark_file,
    refuse_limits_by_hand,
    with_detectors,
)
from cdtool.commands.tune.options import TuningOptions
from cdtool.commands.tune.recordings_to_tune import ReadRecordings, read_recordings, to_check
from cdtool.commands.tune.result import TuningResult
from cdtool.commands.tune.search.candidate import Candidate, Measured
from cdtool.commands.tune.search.coordinate_search import movable_gains
from cdtool.commands.tune.search.grid import debounces_to_try, rules_to_try
from cdtool.commands.tune.search.held_out import HeldOut, Pooled, pooled
from cdtool.commands.tune.search.measuring import Choice, Measuring, Pair
from cdtool.commands.tune.search.objective import Goal, Objective
from cdtool.commands.tune.search.recordings import TuningRecordings
from cdtool.commands.tune.search.search import Scored, Searched, search
from cdtool.commands.tune.search.tuned import (
    ChoiceResults,
    Rejection,
    TunedDetector,
    apparent_results,
    held_out_results,
    sensitivities_of,
    settings_of,
)
from cdtool.execution.workers import Workers, in_order
from cdtool.recordings.motion.applicable import GRACE
from cdtool.results.results import Skipped
from cdtool.thresholds import THRESHOLDS
from cdtool.thresholds.base import FittedThreshold, Threshold
from cdtool.thresholds.settings import with_context


def tune(  # the public function: a keyword for each setting
    file: str | Path | BenchmarkFile,
    false_alarm_budget: str,
    *,
    detectors: Sequence[str] = (),
    settings: Mapping[str, Any] | None = None,
    workers: Workers | None = None,
) -> TuningResult:
    """Search gains, threshold and debounce of the detectors of a benchmark file at a false-alarm budget.

    Parameters
    ----------
    file : str, Path or BenchmarkFile
        The benchmark file: [learn] has the impact-free runs, [impacts] or [inject] the contacts. The hold-out is not
        used.
    false_alarm_budget : str
        As "1/100op" or "0.1/h", met on average, or "1/100op at 95%".
    detectors : sequence of str, optional
        Detectors in place of the file's.
    settings : mapping, optional
        Values in place of keys of the file, as {"tune.objective": "p95"}; docs/tuning.md has those of [tune].
    workers : Workers, optional
        How many candidates are measured at a time; the result does not depend on it.

    Returns
    -------
    TuningResult
        What was chosen and gained, the best detector first; figures and files.

    Raises
    ------
    UsageError
        The runs cannot support the budget, real and injected contacts are mixed, or there is no contact.
    ConfigurationError
        The benchmark file is wrong.

    Examples
    --------
    >>> import cdtool
    >>> cdtool.tune("sample_logs/gate/benchmark.toml", false_alarm_budget="1/20op", detectors=["momentum"])
    Traceback (most recent call last):
    cdtool.base.errors.UsageError: 10 impact-free runs for a false-alarm budget of 1/20op: 19 are needed to set...
    """
    if not isinstance(file, BenchmarkFile):
        detectors, others = detectors_of(detectors, settings)
        file = read_benchmark_file(file, detectors=detectors, settings=others, command="tune")
    return tune_detectors(file, TuningOptions.of(file, false_alarm_budget, detectors=detectors, workers=workers))


def tune_detectors(setup: BenchmarkFile, options: TuningOptions) -> TuningResult:
    """Search gains, threshold and debounce of the detectors of a benchmark; `cdtool.tune` states the errors."""
    workers = options.workers or Workers()
    setup = with_detectors(setup, options.detectors) if options.detectors else setup
    refuse_limits_by_hand(replace(setup, budget=options.budget))
    readers = workers.limited_by(setup.execution)
    setup = _with_impacts(setup, options.impacts, readers)
    with workers.ready():
        read = read_recordings(setup, options.budget, options.seed, readers)
        if options.objective is Goal.FORCE and not np.isfinite(read.recordings.peak_of).any():
            raise UsageError("objective is 'force', but no log has the force of its contact", "map the load cell")
        made: list[TunedDetector] = []
        unusable: dict[str, str] = {}
        skipped = list(read.skipped)
        for name in setup.detectors:
            try:
                tuned, left_out = _TuningOf(setup, options, read, name, workers).tuned()
            except CdtoolError as fault:
                unusable[name] = fault.message
                continue
            made.append(tuned)
            skipped += left_out
    if not made:
        name, reason = next(iter(unusable.items()))
        raise UsageError(f"no detector can be tuned; {name}: {reason}", "check the logs with cdtool info")
    groups = dict(zip(read.recordings.groups, _counts(read.recordings), strict=True))
    return TuningResult(
        setup,
        options,
        tuple(sorted(made, key=lambda item: item.honest.score)),
        unusable,
        read.runs,
        groups,
        all(item.nested is not None for item in made),
        tuple(dict.fromkeys((*skipped, *setup.not_made))),
        read.findings,
    )


def _counts(recordings: TuningRecordings) -> list[int]:
    return [int(count) for count in np.bincount(recordings.group_of, minlength=len(recordings.groups))]


def _with_impacts(setup: BenchmarkFile, impacts: str | None, workers: Workers) -> BenchmarkFile:
    """Return the benchmark with the contacts to tune on; raises UsageError if two kinds would be mixed unasked."""
    real = setup.groups_of_impacts
    if impacts is None and real and setup.made is not None:
        raise UsageError(
            f"{setup.path} has real contacts ({', '.join(real)}) and injected ones",
            "set tune.impacts to real, injected or both",
        )
    if impacts == "real":
        return replace(setup, made=None)
    if impacts == "injected" and setup.made is None:
        raise UsageError(
            f"impacts is 'injected', but {setup.path} has no section [inject]", "add one: docs/injection.md"
        )
    setup = setup.with_made(workers)
    if impacts != "injected":
        return setup
    left_out = [name for name in setup.groups_of_impacts if setup.impacts[name].injected is None]
    return replace(setup, impacts={name: group for name, group in setup.impacts.items() if name not in left_out})


@dataclass(frozen=True)
class _TuningOf:
    """The tuning of one detector."""

    setup: BenchmarkFile
    options: TuningOptions
    read: ReadRecordings
    name: str
    workers: Workers

    def tuned(self) -> tuple[TunedDetector, list[Skipped]]:
        """Return the tuned detector, and the recordings that it cannot use."""
        recordings, signals, skipped = self._usable()
        period = float(np.median([signal.period for _, signal in signals[0]]))
        debounces, activations = self._activations(period)
        rule = for_machine(self.setup.rule, self.setup.machine_file.machine)
        default = Candidate.of(self._detector, rule)
        measuring = self._measuring(recordings, activations)
        measuring.remember(default, signals)
        objective = Objective(self.options.objective, recordings, self.options.worse_at_most)
        words = [_debounce_words(activation) for activation in activations]
        gains = movable_gains(self._detector, default)
        measure = _MeasuresAll(measuring, self.workers)
        channels = set.intersection(*(set(run.operation.recording.channels) for run in recordings.free))
        grid = [Candidate(default.gains, item) for item in self._rules(rule, channels)]
        found = search(default, grid, gains, objective, measure)
        if not np.isfinite(found.best.score):
            reason = found.measured[default.key].reason or "no candidate is acceptable"
            raise UsageError(f"{self.name} cannot be tuned: {reason}", "check the logs with cdtool info")
        return self._result(found, objective, measure, debounces, words), skipped

    @property
    def _detector(self) -> Any:
        return self.setup.machine_file.detector(self.name)

    def _usable(self) -> tuple[TuningRecordings, tuple[list[Pair], list[Any]], list[Skipped]]:
        """Return the recordings that the detector can use with its signals of them, and what is left out."""
        recordings, setup = self.read.recordings, self.setup
        machine, skipped = setup.machine_file.machine, []
        free, pairs, struck, signals = [], [], [], []
        for run in recordings.free:
            try:
                pairs.append((run.operation, run_detector(run.operation, machine, self._detector, setup.watched)))
                free.append(run)
            except CdtoolError as fault:
                skipped.append(Skipped(run.operation.name, str(fault)))
        for log in recordings.struck:
            refused = setup.impacts[log.group].refused.get(self.name)
            if refused is not None:
                skipped.append(Skipped(log.operations[0].whole.name, f"{self.name}: not tested: {refused}"))
                continue
            try:
                signals.append(signal_of_log(log.operations[0], machine, self._detector, setup.watched))
                struck.append(log)
            except CdtoolError as fault:
                skipped.append(Skipped(log.operations[0].whole.name, str(fault)))
        if not pairs or not struck:
            reason = skipped[0].reason if skipped else "injected contacts cannot test it"
            raise UsageError(f"{self.name} cannot be used on these logs: {reason}", "check the logs with cdtool info")
        try:
            fitted = fitting(for_machine(setup.signature, machine))(pairs)
        except SignatureError:  # other thresholds learn from fewer runs
            fitted = Fitted((), (), ())
        skipped += fitted.skipped
        usable = kept(pairs, fitted)
        names = {operation.name for operation, _ in usable}
        made = replace(recordings, free=tuple(run for run in free if run.operation.name in names), struck=tuple(struck))
        is_nested = made.is_nested and not made.why_not_nested(self.options.budget) and self._has_hours(made, usable)
        return replace(made, is_nested=is_nested), (usable, signals), skipped

    def _has_hours(self, recordings: TuningRecordings, pairs: Sequence[Pair]) -> bool:
        """Return whether the runs without any fold are monitored long enough for a budget per hour."""
        budget = self.options.budget
        if budget.per == "operation":
            return True
        seconds = np.array([signal.period * float(signal.valid.any(axis=1).sum()) for _, signal in pairs])
        fewest = min(float(seconds[recordings.free_in(fold + 1)].sum()) for fold in range(recordings.folds))
        # A statistic may be assessable for less time than its signal.
        return fewest / 3600.0 >= 1.1 * budget.needed

    def _why_not_nested(self, recordings: TuningRecordings, chosen: Sequence[HeldOut]) -> str:
        """Return why there are no results on recordings not used for the choice."""
        budget = self.options.budget
        unit = "impact-free runs" if budget.per == "operation" else "monitored hours"
        needed = f"{to_check(budget):.3g} {unit} are needed to check the limit"
        return next((item.reason for item in chosen if item.reason), recordings.why_not_nested(budget) or needed)

    def _activations(self, period: float) -> tuple[list[int], tuple[Activation, ...]]:
        """Return the debounces to try [samples] and their activations, the benchmark file's first."""
        given = self.setup.activation
        own = given.debounce or max(1, round(DEBOUNCE_TIME / period))
        others = [count for count in debounces_to_try(period, 1e-3 * self.options.shortest_debounce_ms) if count != own]
        return [own, *others], (given, *(replace(given, debounce=count) for count in others))

    def _rules(self, default: Threshold, channels: set[str]) -> list[Threshold]:
        """Return the rules to try: every registered one, the benchmark file's with its own settings."""
        machine, setup = self.setup.machine_file.machine, self.setup
        signature = replace(setup.signature, adaptive_level=0.0, speed_range=False)
        rules: list[Threshold] = []
        for name in self.options.thresholds or THRESHOLDS.usable_names():
            rule = THRESHOLDS.load(name)
            made = setup.signature if name == "signature" else with_context(rule(), setup.signature.sides, signature)
            rules.append(default if name == default.name else for_machine(made, machine))
        return rules_to_try(rules, channels)

    def _measuring(self, recordings: TuningRecordings, activations: tuple[Activation, ...]) -> Measuring:
        setup = self.setup
        grace = max(GRACE, *(log.window for log in recordings.struck))
        machine = setup.machine_file.machine
        return Measuring(
            recordings, machine, self._detector, setup.watched, self.options.budget, activations, learned, grace
        )

    def _result(
        self, found: Searched, objective: Objective, measure: _MeasuresAll, debounces: list[int], words: list[str]
    ) -> TunedDetector:
        gains = movable_gains(self._detector, found.default)
        default = found.subsets[0].default
        default_reason = found.measured[found.default.key].reason
        default_nested = None
        if len(found.subsets) > 1 and not default_reason:
            by_default = measure.pooled([default] * (len(found.subsets) - 1), corrects=False)
            default_nested = held_out_results(objective, by_default)
        best, chosen, made, rejected = _checked_choice(found, objective, measure, default_nested)
        nested, correction = held_out_results(objective, made), made.multiplier if made else 1.0
        why = "" if nested else self._why_not_nested(objective.recordings, measure.held_out(chosen))
        apparent = apparent_results(objective, found, best)
        assert apparent is not None, "the best candidate can be used"
        measured = found.measured[best.candidate.key]
        unusable: dict[str, str] = {}
        for key, item in found.measured.items():
            if item.reason:
                unusable.setdefault(_rule_name(key), item.reason)
        given = self.setup.activation.debounce
        return TunedDetector(
            detector=self.name,
            short_name=self._detector.short_name,
            default=found.default,
            choice=best.candidate,
            debounce=debounces[best.debounce] if best.debounce else given,
            factor=float(measured.factors[best.debounce, 0]) * correction,
            correction=correction,
            apparent=apparent,
            nested=nested,
            default_apparent=None if default_reason else apparent_results(objective, found, default),
            default_nested=default_nested,
            default_reason=default_reason,
            sensitivities=sensitivities_of(found, best, debounces, gains),
            candidates=len(found.measured),
            unusable=unusable,
            chosen_in_folds=tuple(in_words(item, words, gains) for item in chosen),
            rejected=tuple(rejected),
            why_not_nested=why,
        )


def _checked_choice(
    found: Searched, objective: Objective, measure: _MeasuresAll, default: ChoiceResults | None
) -> tuple[Scored, list[Scored], Pooled | None, list[Rejection]]:
    """Return the choice, those without each fold, what these give on it, and the kinds of rules that were rejected.

    A kind that makes a group much worse than by default on recordings not used for the choice is left out of the
    search: either what was chosen without each fold, or the choice itself with limits that were set without the fold.
    """
    rejected: list[Rejection] = []
    while True:
        without = [item.rule for item in rejected]
        best = found.subsets[0].best_without(without)
        chosen = [subset.best_without(without) for subset in found.subsets[1:]]
        is_default = best.candidate.key == found.default.key and best.debounce == 0
        nested = measure.pooled(chosen, corrects=not is_default)
        if default is None or nested is None or best.candidate.key == found.default.key:
            return best, chosen, nested, rejected
        of_choice = measure.pooled([best] * len(chosen), corrects=True)
        results = [held_out_results(objective, made) for made in (nested, of_choice)]
        checked = [item for item in results if item is not None]
        ratios = np.max([item.costs / default.costs for item in checked], axis=0)
        if all(objective.is_acceptable(item.costs, default.costs) for item in checked):
            return best, chosen, nested, rejected
        worst = int(np.nanargmax(ratios))
        group = objective.recordings.groups[worst]
        rejected.append(Rejection(best.candidate.rule.name, group, float(ratios[worst])))


def learned(rule: Threshold, pairs: Sequence[Pair]) -> tuple[FittedThreshold, ...]:
    """Return the thresholds that a rule learns from runs; raises SignatureError, also for a run that is left out."""
    return fitting(rule)(pairs).thresholds


def _rule_name(key: str) -> str:
    from json import loads

    return str(loads(key)[1]["rule"])


def _debounce_words(activation: Activation) -> str:
    return "9 ms" if activation.debounce is None else f"{activation.debounce} samples"


def in_words(item: Scored, debounces: Sequence[str], gains: Sequence[str]) -> str:
    """Return a choice in words: threshold, settings and searched gains, debounce."""
    chosen = settings_of(item.candidate, gains).items()
    settings = ", ".join(f"{name} {value_in_words(value)}" for name, value in chosen)
    return f"{item.candidate.rule.name}, {settings}, debounce {debounces[item.debounce]}"


@dataclass(frozen=True)
class _MeasuresAll:
    """Measures candidates and choices with several workers."""

    measuring: Measuring
    workers: Workers
    _held_out: dict[tuple[str, int, int], HeldOut] = field(default_factory=dict)

    def __call__(self, candidates: Sequence[Candidate]) -> list[Measured]:
        """Return what each candidate gives."""
        return list(self._all(candidates))

    def held_out(self, chosen: Sequence[Scored]) -> list[HeldOut]:
        """Return what the choice without each fold gives on that fold."""
        choices = [Choice(item.candidate, item.debounce, fold) for fold, item in enumerate(chosen)]
        new = [item for item in choices if self._key(item) not in self._held_out]
        for item, made in zip(new, self._all(new), strict=True):
            self._held_out[self._key(item)] = made
        return [self._held_out[self._key(item)] for item in choices]

    def pooled(self, chosen: Sequence[Scored], *, corrects: bool) -> Pooled | None:
        """Return what the choices without each fold give on all folds together; None if one cannot be used."""
        contacts = len(self.measuring.recordings.fold_of)
        return pooled(self.measuring.budget, self.held_out(chosen), contacts, corrects=corrects)

    @staticmethod
    def _key(choice: Choice) -> tuple[str, int, int]:
        return choice.candidate.key, choice.debounce, choice.fold

    def _all(self, items: Sequence[Any]) -> Iterator[Any]:
        return in_order(self.measuring, items, len(items), self.workers)
