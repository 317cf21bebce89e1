"""What counts as a contact that lay in its fault: by what was lost alone, never by what the code made of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import Detection, judge
from cdtool.detectors.detection import Signal, Status
from cdtool.recordings.operations import operations_of
from cdtool.recordings.recording import Contact, Series
from cdtool.thresholds.limit import Limit
from tests.contracts.lost_evidence import ALLOWED, Cost, cost_of, pressed_outside
from tests.thresholds.strokes import TIME, N, noise_runs, stroke

AT_ONCE = Activation(debounce=1)
ONSET, LENGTH = 2.0, 0.03
CONTACT = Contact(ONSET, 2.5, 0.0, rest=0.0)
FACTOR = 6.0


def within(span: tuple[float, float]) -> np.ndarray:
    rows = np.zeros(N, dtype=bool)
    rows[slice(*np.searchsorted(TIME, np.array(span) - 1e-9))] = True
    return rows


def force_of(pulse: tuple[float, float], height: float = 100.0) -> np.ndarray:
    return np.where(within(pulse), height, 0.0)


def detection(force: np.ndarray, missing: tuple[float, float] = (9.0, 9.0)) -> Detection:
    """A stroke whose signal is the force and noise, against a limit; GAP within `missing`."""
    whole = stroke()
    recording = replace(whole, channels={**whole.channels, "force": Series(TIME, force, "N")})
    limit = Limit().fit(noise_runs(12, mean=0.0))
    gap = within(missing)
    status = np.where(gap, Status.GAP, Status.VALID).astype(np.uint8)[:, np.newaxis]
    values = (force + np.random.default_rng(1).normal(size=N))[:, np.newaxis]
    signal = Signal(TIME, np.where(status == Status.GAP, np.nan, values), status, "N", True, ("axis",))
    return judge(operations_of(recording)[0], "made up", signal, [limit], AT_ONCE)


def outcome(force: np.ndarray, fault: float, missing: tuple[float, float]) -> str:
    whole, damaged = detection(force), detection(force, missing)
    cost = cost_of(whole, damaged, CONTACT, (fault, LENGTH), AT_ONCE, FACTOR, lambda: [straight(force, fault)])
    assert cost is not None
    return cost.outcome


def straight(force: np.ndarray, fault: float) -> Detection:
    """The whole log with a straight line where the fault lies."""
    lost = within((fault, fault + LENGTH))
    return detection(np.where(lost, np.interp(TIME, TIME[~lost], force[~lost]), force))


LASTING, PULSE = force_of((ONSET, 2.5)), force_of((ONSET, ONSET + 0.02))


def test_a_lasting_contact_may_cost_the_fault_and_20_ms_and_not_a_sample_more():
    fault = ONSET - 0.001
    assert outcome(LASTING, fault, (fault, fault + LENGTH)) == "in time"
    assert outcome(LASTING, fault, (fault, ONSET + LENGTH + ALLOWED)) == "in time"
    assert outcome(LASTING, fault, (fault, ONSET + LENGTH + ALLOWED + 0.001)) == "late"
    assert outcome(LASTING, fault, (fault, 3.5)) == "missed"


def test_a_pulse_within_its_fault_is_lost_and_one_beside_it_is_not():
    assert outcome(PULSE, ONSET - 0.005, (ONSET - 0.005, ONSET - 0.005 + LENGTH)) == "evidence lost"
    # Samples that are not assessable after the fault, or before it, excuse nothing.
    assert outcome(PULSE, ONSET - LENGTH, (ONSET - LENGTH, ONSET + 0.1)) == "missed"
    assert outcome(PULSE, ONSET + 0.02, (ONSET, ONSET + 0.05)) == "missed"
    # Half of the pulse shows behind the fault: longer than the whole log needed.
    fault = ONSET + 0.01 - LENGTH
    assert outcome(PULSE, fault, (fault, fault + LENGTH)) == "in time"
    assert outcome(PULSE, fault, (fault, 3.5)) == "missed"


def test_a_fault_that_takes_no_sample_of_the_detector_excuses_nothing():
    # The fault is one of a channel that the detector does not read: all its samples are judged.
    whole = detection(LASTING)
    level = whole.statistic.values[:, 0].copy()
    later = detection(np.where(TIME < ONSET + 0.2, 0.0, LASTING))
    cost = cost_of(whole, later, CONTACT, (ONSET, LENGTH), AT_ONCE, FACTOR, lambda: [whole])
    assert cost is not None
    assert cost.reachable == cost.whole
    assert cost.outcome == "late"
    assert np.nanmax(level) > 50.0


def test_what_a_filter_remembers_of_a_pulse_in_the_fault_is_lost_and_what_a_log_without_the_pulse_shows_is_not():
    # The statistic stays high long behind the pulse, so that the whole log's shows it outside the fault, too.
    whole, fault = detection(force_of((ONSET, ONSET + 0.2))), ONSET - 0.005
    calm, late, span = np.zeros(N), force_of((ONSET + 0.1, ONSET + 0.2)), (ONSET - 0.005, LENGTH)

    def outcome_of(damaged: np.ndarray, filled: np.ndarray) -> str:
        gap = (fault, fault + LENGTH)
        cost = cost_of(
            whole, detection(damaged, gap), CONTACT, span, AT_ONCE, FACTOR, lambda: [whole, detection(filled)]
        )
        assert cost is not None
        assert cost.reachable <= ONSET + LENGTH
        return cost.outcome

    assert outcome_of(calm, calm) == "evidence lost"
    assert outcome_of(late, late) == "evidence lost"
    assert outcome_of(calm, late) == "missed"
    assert outcome_of(late, force_of((ONSET + 0.05, ONSET + 0.2))) == "late"


def test_a_contact_that_hangs_by_a_hair_is_one_that_wider_limits_miss():
    cost = Cost(LENGTH, whole=ONSET, damaged=np.inf, reachable=ONSET, wider=np.inf, filled=ONSET, pressed=True)
    assert cost.outcome == "by a hair"
    assert replace(cost, wider=ONSET).outcome == "missed"
    assert replace(cost, wider=ONSET + 0.1, damaged=ONSET + 0.14).outcome == "by a hair"
    assert replace(cost, wider=ONSET + 0.1, damaged=ONSET + 0.16).outcome == "late"


@pytest.mark.parametrize(("fault", "enough"), [(1.9, True), (1.98, False), (2.0, False), (2.3, True)])
def test_what_the_load_cell_felt_outside_the_fault_is_compared_up_to_the_time_allowed(fault, enough):
    # A falling force: what is left behind the fault is less than what was seen within the first 10 ms.
    force = np.where(TIME >= ONSET, 100.0 * np.exp(-(TIME - ONSET) / 0.02), 0.0)
    recording = detection(force).operation.recording
    assert pressed_outside(recording, CONTACT, (fault, LENGTH), ONSET + 0.01) is enough


def test_a_fault_behind_the_alarm_changes_nothing():
    whole, fault = detection(LASTING), ONSET + 0.02
    damaged = detection(LASTING, (fault, fault + LENGTH))
    cost = cost_of(whole, damaged, CONTACT, (fault, LENGTH), AT_ONCE, FACTOR, lambda: pytest.fail("not needed"))
    assert cost is not None
    assert cost.damaged == cost.whole
