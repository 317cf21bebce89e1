"""Measure a candidate: limits that meet the budget, and latencies, with every recording assessed by the others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import Detection, judge_alone, judge_log, run_detector, signal_of_log
from cdtool.base.arrays import FloatArray
from cdtool.base.errors import CdtoolError, SignatureError
from cdtool.base.plain_text import counted
from cdtool.commands.tune.search.candidate import Candidate, Measured
from cdtool.commands.tune.search.held_out import MULTIPLIERS, HeldOut
from cdtool.commands.tune.search.recordings import StruckLog, TuningRecordings
from cdtool.detectors.detection import Signal, Status
from cdtool.machines.dynamics import Machine
from cdtool.recordings.operations import Operation
from cdtool.recordings.recording import Contact
from cdtool.results.curves.false_alarm_budget import Budget, MonitoredRun, factor_for
from cdtool.results.curves.sweep import sweep
from cdtool.thresholds.base import FittedThreshold, Threshold
from cdtool.truth.force.curve import ForceTimeCurve, force_at

Pair = tuple[Operation, Signal]
# Returns the thresholds that a rule learns from runs; raises SignatureError if it cannot.
Learn = Callable[[Threshold, Sequence[Pair]], tuple[FittedThreshold, ...]]
# The signals of so many gains are kept.
_KEPT = 3


@dataclass(frozen=True)
class Choice:
    """A candidate with the number of its debounce; `fold`: the one that it is to be assessed on."""

    candidate: Candidate
    debounce: int
    fold: int


@dataclass(frozen=True)
class Measuring:
    """All that measuring a candidate of one detector needs; called, it returns what the candidate gives.

    `activations` has one entry per debounce. A `Choice` is assessed on its fold.
    """

    recordings: TuningRecordings
    machine: Machine
    detector: Any
    watched: tuple[str, ...]
    budget: Budget
    activations: tuple[Activation, ...]
    learn: Learn
    grace: float
    _signals: dict[Any, tuple[list[Pair], list[Signal]]] = field(default_factory=dict, compare=False, repr=False)

    def __call__(self, item: Candidate | Choice) -> Measured | HeldOut:
        """Return what a candidate gives, or a choice on its fold; the reason if it cannot be used."""
        if isinstance(item, Choice):
            try:
                return self._held_out(item)
            except CdtoolError as fault:
                return HeldOut.unusable(fault.message)
        try:
            return self._measured(item)
        except CdtoolError as fault:
            return Measured.unusable(fault.message)

    def remember(self, candidate: Candidate, signals: tuple[list[Pair], list[Signal]]) -> None:
        """Keep the signals of a candidate's gains, of the impact-free operations and of the logs with contacts."""
        self._signals[candidate.gains] = signals

    def _measured(self, candidate: Candidate) -> Measured:
        recordings = self.recordings
        monitored, detected = self._assessed(candidate)
        shape = (len(self.activations), recordings.subsets)
        factors, alarming = np.empty(shape), np.zeros(shape, dtype=np.int64)
        for debounce, runs in enumerate(monitored):
            for subset in range(recordings.subsets):
                own = [runs[i] for i in recordings.free_in(subset)]
                factor = factor_for(self.budget, self.detector.name, own).factor
                factors[debounce, subset] = factor
                alarming[debounce, subset] = sum(run.critical > factor for run in own if run.seconds > 0.0)
        latency, force = (np.full((*shape, len(recordings.fold_of)), np.nan) for _ in range(2))
        assessable = np.zeros(len(recordings.fold_of), dtype=bool)
        begin = 0
        for log, of_log in zip(recordings.struck, detected, strict=True):
            for contacts, curves, detection in zip(log.contacts, log.curves, of_log, strict=True):
                columns = slice(begin, begin + len(contacts))
                assessable[columns] = _assessable(detection, contacts, log.window)
                for debounce, activation in enumerate(self.activations):
                    swept = sweep(detection, contacts, activation, log.window, factors[debounce])
                    latency[debounce, :, columns] = swept.latency
                    force[debounce, :, columns] = _forces(curves, swept.latency)
                begin += len(contacts)
        return Measured(factors, latency, force, assessable, alarming)

    def _assessed(self, candidate: Candidate) -> tuple[list[list[MonitoredRun]], list[list[Detection]]]:
        """Return the impact-free runs by debounce, and the detections of the logs with contacts.

        Each is assessed with what was learned without its fold.
        """
        recordings = self.recordings
        free, struck = self._signals_of(candidate)
        runs: list[dict[int, MonitoredRun]] = [{} for _ in self.activations]
        detected: dict[int, list[Detection]] = {}
        for fold in range(recordings.folds):
            thresholds = self._learned(candidate.rule, free, (fold,))
            for number, run in enumerate(recordings.free):
                if run.fold == fold:
                    detection = judge_alone(*_named(free[number], self.detector.name), thresholds, self.activations[0])
                    for of_debounce, made in zip(runs, MonitoredRun.of_each(detection, self.activations), strict=True):
                        of_debounce[number] = made
            for number, log in enumerate(recordings.struck):
                if log.fold == fold:
                    detected[number] = self._detections(log, struck[number], thresholds, self.activations[0])
        in_order = [[of_debounce[number] for number in range(len(free))] for of_debounce in runs]
        return in_order, [detected[number] for number in range(len(struck))]

    def _detections(
        self, log: StruckLog, signal: Signal, thresholds: Sequence[FittedThreshold], activation: Activation
    ) -> list[Detection]:
        return judge_log(log.operations, self.detector.name, signal, thresholds, activation, self.grace)

    def _held_out(self, choice: Choice) -> HeldOut:
        """Set the limit by cross-validation without the fold, and assess the fold with it."""
        recordings, fold, name = self.recordings, choice.fold, self.detector.name
        activation, rule = self.activations[choice.debounce], choice.candidate.rule
        free, struck = self._signals_of(choice.candidate)

        def monitored(number: int, thresholds: tuple[FittedThreshold, ...]) -> MonitoredRun:
            detection = judge_alone(*_named(free[number], name), thresholds, activation)
            return MonitoredRun.of_each(detection, [activation])[0]

        inner: list[MonitoredRun] = []
        for other in range(recordings.folds):
            if other != fold:
                thresholds = self._learned(rule, free, (fold, other))
                inner += [monitored(i, thresholds) for i, run in enumerate(recordings.free) if run.fold == other]
        factor = factor_for(self.budget, name, inner).factor
        thresholds = self._learned(rule, free, (fold,))
        own = [monitored(i, thresholds) for i, run in enumerate(recordings.free) if run.fold == fold]
        latencies, forces, valid = [], [], []
        factors = factor * MULTIPLIERS
        for number, log in enumerate(recordings.struck):
            if log.fold != fold:
                continue
            detections = self._detections(log, struck[number], thresholds, activation)
            for contacts, curves, detection in zip(log.contacts, log.curves, detections, strict=True):
                swept = sweep(detection, contacts, activation, log.window, factors)
                latencies.append(swept.latency)
                forces.append(_forces(curves, swept.latency))
                valid += _assessable(detection, contacts, log.window)
        nothing = np.empty((len(factors), 0))
        return HeldOut(
            np.flatnonzero(recordings.fold_of == fold),
            np.hstack([nothing, *latencies]),
            np.hstack([nothing, *forces]),
            np.array(valid, dtype=bool),
            np.array([run.critical / factor for run in own if run.seconds > 0.0]),
            sum(run.seconds for run in own),
        )

    def _learned(self, rule: Threshold, free: Sequence[Pair], without: Sequence[int]) -> tuple[FittedThreshold, ...]:
        runs = zip(self.recordings.free, free, strict=True)
        try:
            return self.learn(rule, [pair for run, pair in runs if run.fold not in without])
        except SignatureError as fault:
            parts = f"{len(without)} of {self.recordings.folds} parts"
            which = f"of {counted(len(free), 'impact-free run')}, those outside {parts}"
            raise SignatureError(f"{fault.message} ({which})", fault.hint) from fault

    def _signals_of(self, candidate: Candidate) -> tuple[list[Pair], list[Signal]]:
        """Return the signals of the impact-free operations, and of the logs with contacts."""
        if candidate.gains not in self._signals:
            detector = candidate.detector(self.detector)
            free = [
                (run.operation, run_detector(run.operation, self.machine, detector, self.watched))
                for run in self.recordings.free
            ]
            struck = [
                signal_of_log(log.operations[0], self.machine, detector, self.watched) for log in self.recordings.struck
            ]
            while len(self._signals) >= _KEPT:
                del self._signals[next(iter(self._signals))]
            self._signals[candidate.gains] = (free, struck)
        return self._signals[candidate.gains]


def _named(pair: Pair, detector: str) -> tuple[Operation, str, Signal]:
    return pair[0], detector, pair[1]


def _assessable(detection: Detection, contacts: Sequence[Contact], window: float) -> list[bool]:
    """Return whether the statistic is assessable anywhere in the window of each contact."""
    time, valid = detection.statistic.time, (detection.statistic.status == Status.VALID).any(axis=1)
    return [bool(valid[(time >= item.start) & (time <= item.start + window)].any()) for item in contacts]


def _forces(curves: Sequence[ForceTimeCurve | None], latency: FloatArray) -> FloatArray:
    """Return the force at the alarm (s, contacts) [N]; NaN if the contact was missed or its force is unknown."""
    force = np.full(latency.shape, np.nan)
    for number, curve in enumerate(curves):
        if curve is not None:
            for subset, value in enumerate(latency[:, number].tolist()):
                if np.isfinite(value):
                    force[subset, number] = force_at(curve, value)
    return force
