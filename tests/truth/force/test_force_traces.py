"""Stored force curves match their contact's verdict, from the beginning of the contact."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.commands.scoring.force_rows import force_rows
from cdtool.recordings.operations import operations_of
from cdtool.recordings.recording import Contact, Recording
from cdtool.results.results import ContactResult, RecordingResult, Results
from cdtool.results.traced_force import traced_forces
from cdtool.results.traces.trace import Trace, make_trace
from cdtool.truth.force.curve import force_time_curve
from cdtool.truth.force.limits import ForceProfile, ForceStep
from cdtool.truth.force.verdict import assess_force
from cdtool.truth.onset import OnsetRule, find_contacts

STEPS = (ForceStep(0.0, 400.0, "dynamic"), ForceStep(0.5, 150.0, "static"), ForceStep(60.0, 25.0, "residual"))
PROFILE = ForceProfile("gap", "A gap", "a standard", False, STEPS)


def scored(recording: Recording, contacts: list[Contact]) -> Results:
    """The rows of one log, every contact detected after 30 ms by one detector."""
    log = RecordingResult(recording.name, "stiff", "", 1.0, 1, len(contacts))
    curves = {i: force_time_curve(recording, contact) for i, contact in enumerate(contacts, 1)}
    verdicts = {i: assess_force(curve, PROFILE) for i, curve in curves.items()}
    late = [
        ContactResult(
            recording.name, "stiff", "direct", None, item.start, 0.0, None, 30.0, "detected", None, None, contact=i
        )
        for i, item in enumerate(contacts, 1)
    ]
    rows = tuple(force_rows(log, verdicts, curves))
    provenance = {"force_profiles": {"stiff": PROFILE.described}}
    return Results(provenance, ("direct",), ("stiff",), tuple(late), (), (), forces=rows)


def traced(recording: Recording, contacts: list[Contact]) -> Trace:
    return make_trace("stiff", operations_of(recording)[0], contacts, (), ())


@pytest.fixture
def hit(simulated) -> Recording:
    return simulated("stiff", 1)


@pytest.fixture
def contacts(hit: Recording) -> list[Contact]:
    return find_contacts(hit, OnsetRule(20.0, 8.0))


def test_a_kept_curve_is_the_contacts_force_with_its_verdict_and_alarms(hit, contacts):
    results, curve = scored(hit, contacts), force_time_curve(hit, contacts[0])
    (found,) = traced_forces(results, [traced(hit, contacts)])
    assert (found.recording, found.group, found.contact) == (hit.name, "stiff", 1)
    assert found.time[0] >= 0.0 and np.all(np.diff(found.time) > 0.0)
    assert found.force.max() == pytest.approx(curve.peak, rel=0.01)
    assert np.interp(found.time, curve.time, curve.force) == pytest.approx(found.force, abs=2.0)
    assert found.alarms == {"direct": pytest.approx(0.03)}
    verdict = assess_force(curve, PROFILE)
    assert [step.outcome for step in found.verdict.steps] == [step.outcome for step in verdict.steps]
    assert found.verdict.time_budget == pytest.approx(verdict.time_budget)
    assert found.verdict.steps[0].peak_at == pytest.approx(verdict.steps[0].peak_at, abs=0.02)
    assert np.isnan(found.verdict.steps[2].peak) and np.isnan(found.verdict.steps[2].peak_at)
