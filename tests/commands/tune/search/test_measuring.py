"""Candidates measured on the simulated gate: whatever assesses a recording has not learned from its fold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.alarms.activation import Activation
from cdtool.base.errors import SignatureError
from cdtool.commands.tune.search.candidate import Candidate
from cdtool.commands.tune.search.measuring import Choice, Measuring
from cdtool.commands.tune.search.recordings import FreeRun, StruckLog, TuningRecordings
from cdtool.commands.tune.tuning import learned
from cdtool.detectors.momentum import Momentum
from cdtool.recordings.operations import operations_of
from cdtool.recordings.recording import Series
from cdtool.results.curves.false_alarm_budget import Budget
from cdtool.thresholds.signature import Signature
from cdtool.truth.onset import OnsetRule, find_contacts

ONSET = OnsetRule(above=20.0, back_to=8.0)
DEBOUNCES = (Activation(3), Activation(9))
FOLDS = 5


@pytest.fixture(scope="module")
def recordings(simulated) -> TuningRecordings:
    free = tuple(FreeRun(operations_of(simulated("none", number))[0], number % FOLDS) for number in range(20))
    struck = []
    for number, kind in enumerate(["stiff"] * 5 + ["soft"] * 5):
        log = simulated(kind, number)
        contacts = tuple(find_contacts(log, ONSET))
        unknown = (None,) * len(contacts)
        struck.append(StruckLog((operations_of(log)[0],), (contacts,), (unknown,), kind, 1.0, number % FOLDS))
    return TuningRecordings(free, tuple(struck), FOLDS, is_nested=True)


def measuring(recordings, gate, budget="1/5op", rule_learned=learned):
    return Measuring(recordings, gate, Momentum(), (), Budget.parse(budget), DEBOUNCES, rule_learned, 1.0)


CANDIDATE = Candidate.of(Momentum(), Signature(sides="one"))


def disturbed(recordings, fold):
    """The same recordings, with the torque of the free runs of a fold out of all bounds."""

    def changed(run):
        if run.fold != fold:
            return run
        whole = run.operation.recording
        torque = whole["torque"]
        values = torque.values.copy()
        values[len(values) // 2 : len(values) // 2 + 400] += 5.0 * np.abs(values).max()
        channels = {**whole.channels, "torque": Series(torque.time, values, torque.unit)}
        return replace(run, operation=replace(run.operation, recording=replace(whole, channels=channels)))

    return replace(recordings, free=tuple(map(changed, recordings.free)))


def test_a_candidate_is_measured_on_every_contact_and_subset(recordings, gate):
    made = measuring(recordings, gate)(CANDIDATE)
    assert made.latency.shape == (2, 6, 10) and made.assessable.all()
    assert np.isfinite(made.latency).all() and (made.latency[0] < made.latency[1]).mean() > 0.8
    # Of 20 runs, 1/5 allows three above the limit; of the 16 outside a fold, two.
    assert (made.alarming[:, 0] == 3).all() and (made.alarming[:, 1:] == 2).all()


def test_the_free_runs_of_a_fold_neither_teach_nor_limit_what_assesses_it(recordings, gate):
    choice = Choice(CANDIDATE, 0, 2)
    usual = measuring(recordings, gate)(choice)
    other = measuring(disturbed(recordings, 2), gate)(choice)
    assert np.array_equal(usual.latency, other.latency, equal_nan=True) and usual.latency.shape == (48, 2)
    assert len(usual.ratios) == 4 and (other.ratios > 1.0).all() and usual.ratios.max() < other.ratios.min()


def test_a_rule_that_cannot_learn_is_unusable_with_its_reason(recordings, gate):
    def fails(rule, pairs):
        raise SignatureError("nothing can be learned", "hint")

    made = measuring(recordings, gate, rule_learned=fails)
    of_all = "nothing can be learned (of 20 impact-free runs, those outside {} of 5 parts)"
    assert made(CANDIDATE).reason == of_all.format(1)
    assert made(Choice(CANDIDATE, 0, 1)).reason == of_all.format(2)
