"""Lost samples: no detector with any threshold mistakes a gap for a contact, or is unable to assess for long after one.

A reduced form of benchmarks/lost_samples.py of commit def748d0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import binomtest

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import Detection, judge_alone, run_detector
from cdtool.commands.simulate.gate_model import GateParameters, simulate_gate_run
from cdtool.detectors import DETECTORS
from cdtool.detectors.detection import Signal
from cdtool.formats.channels.reading import read_as_logged
from cdtool.formats.machine_file import read_machine_file
from cdtool.recordings.clock.lost_samples import lost_samples
from cdtool.recordings.operations import Operation, operations_of
from cdtool.recordings.recording import Recording, Series
from cdtool.results.curves.sweep import critical_factor
from cdtool.thresholds import THRESHOLDS
from cdtool.truth.onset import OnsetRule, find_contacts
from tests.contracts.damaged_logs import KINDS, Fault, damaged, filled, random_faults
from tests.contracts.lost_evidence import cost_of
from tests.synthetic.gate_as_recording import as_recording
from tests.synthetic.machines import ARM, GATE, arm_of, machine_of
from tests.synthetic.motions import moving_recording
from tests.synthetic.robots import six_joint_robot

ARM_LOGS = Path(__file__).parents[2] / "sample_logs" / "arm"
CELLS = [(detector, threshold) for detector in DETECTORS.names() for threshold in THRESHOLDS.names()]
AT_ONCE = Activation(debounce=1)
LEARNED, OTHERS, JUDGED = 12, 12, 3
# No chance explains a larger share of what impact-free runs reach: 7 to 39 with filters that leap behind a gap. Whether
# faults add alarms is counted, and tested in full by the benchmark.
SHARE = 1.6
CHANNELS = ("torque", "speed", "position", "acceleration")


@cache
def run(kind: str, seed: int) -> Recording:
    """A gate run as logged."""
    simulated = simulate_gate_run(GateParameters(), np.random.default_rng([77, seed]), kind)  # type: ignore[arg-type]
    return as_recording(simulated, f"{kind}{seed}", GateParameters())


class Learned:
    """Thresholds of the gate, learned once; operations and signals are kept."""

    def __init__(self) -> None:
        self.machine = machine_of(GATE)
        self.fitted: dict[tuple[str, str], Any] = {}
        self.signals: dict[tuple[str, str], Any] = {}

    def pair(self, detector: str, recording: Recording) -> Any:
        key = (detector, recording.name)
        if key not in self.signals:
            operation = operations_of(self.machine.referred_to_load(recording))[0]
            signal = run_detector(operation, self.machine, DETECTORS.load(detector)())
            self.signals[key] = (operation, signal)
        return self.signals[key]

    def judged(self, detector: str, threshold: str, recording: Recording, activation: Activation) -> Detection:
        operation, signal = self.pair(detector, recording)
        return judge_alone(operation, detector, signal, [self.threshold(detector, threshold)], activation)

    def threshold(self, detector: str, name: str) -> Any:
        """Fitted to some impact-free runs, its factor the largest that others reach."""
        if (detector, name) not in self.fitted:
            pairs = [self.pair(detector, run("none", seed)) for seed in range(LEARNED)]
            known = [(operation.recording.without_ground_truth(), signal) for operation, signal in pairs]
            fitted = THRESHOLDS.load(name)().fit(known)
            others = [self.pair(detector, run("none", 100 + seed)) for seed in range(OTHERS)]
            found = [judge_alone(operation, detector, signal, [fitted], AT_ONCE) for operation, signal in others]
            factor = max(critical_factor(item, AT_ONCE) for item in found)
            self.fitted[detector, name] = fitted.with_safety_factor(max(factor, 1.0))
        return self.fitted[detector, name]


@pytest.fixture(scope="module")
def learned() -> Learned:
    return Learned()


def with_faults(recording: Recording, faults: Sequence[Fault], name: str) -> Recording:
    return replace(damaged(recording, faults), name=f"{recording.name} {name}")


@pytest.mark.parametrize("threshold", THRESHOLDS.names())
def test_ten_faults_in_an_impact_free_run_are_no_contact(threshold, learned):
    added = lost = 0
    for detector in DETECTORS.names():
        factor = learned.threshold(detector, threshold).safety_factor
        for seed in range(JUDGED):
            whole = run("none", 200 + seed)
            faults = random_faults(whole, 10, np.random.default_rng(seed))
            before = critical_factor(learned.judged(detector, threshold, whole, AT_ONCE), AT_ONCE)
            found = learned.judged(detector, threshold, with_faults(whole, faults, "faults"), AT_ONCE)
            after = critical_factor(found, AT_ONCE)
            assert after <= SHARE * max(before, factor), (detector, seed)
            added += before <= factor < after
            lost += after <= factor < before
    # As many runs alarm only with faults as only without: one-sided, 1 in 10,000 over all thresholds together.
    if added + lost:
        assert binomtest(added, added + lost, alternative="greater").pvalue > 1e-4 / len(THRESHOLDS.names())


@pytest.mark.parametrize("threshold", ["cusum", "signature"])
@pytest.mark.parametrize("detector", ["friction_ekf", "inertial_momentum", "direct"])
@pytest.mark.parametrize("at", [0.0, 0.9, 3.0], ids=["start", "acceleration", "running"])
def test_one_fault_of_each_kind_is_no_contact_wherever_it_lies(detector, threshold, at, learned):
    factor = learned.threshold(detector, threshold).safety_factor
    whole = run("none", 300)
    before = critical_factor(learned.judged(detector, threshold, whole, AT_ONCE), AT_ONCE)
    faults = [Fault(kind, at, count) for kind in KINDS[:2] for count in (1, 10)]
    faults += [Fault(kind, at, count, channel) for kind in KINDS[2:] for channel in CHANNELS for count in (1, 10)]
    for i, fault in enumerate(faults):
        after = learned.judged(detector, threshold, with_faults(whole, [fault], f"{at} {i}"), AT_ONCE)
        assert critical_factor(after, AT_ONCE) <= SHARE * max(before, factor), fault


def test_a_fault_at_a_contact_costs_its_own_length_and_20_ms(learned):
    outcomes: dict[str, list[Any]] = {}
    for seed, kind in enumerate(("stiff", "soft")):
        whole = run(kind, 400 + seed)
        contact = find_contacts(learned.machine.referred_to_load(whole), OnsetRule(above=20.0, back_to=8.0))[0]
        rng = np.random.default_rng(seed)
        # One behind the gate's slowest alarms, the others about the onset and within the contact.
        spans = ((-0.02, 0.01), (-0.1, 0.1), (0.0, 0.3), (1.1, 1.2))
        faults = [
            replace(random_faults(whole, 1, rng)[0], start=float(contact.start + rng.uniform(*span))) for span in spans
        ]
        copies = [with_faults(whole, [fault], f"at {i}") for i, fault in enumerate(faults)]
        fillings = [
            [replace(log, name=f"{whole.name} filled {i} {j}") for j, log in enumerate(filled(whole, fault))]
            for i, fault in enumerate(faults)
        ]
        for detector, threshold in CELLS:
            factor = learned.threshold(detector, threshold).safety_factor
            found = learned.judged(detector, threshold, whole, AT_ONCE)
            judged = partial(learned.judged, detector, threshold, activation=AT_ONCE)
            for fault, copy, logs in zip(faults, copies, fillings, strict=True):
                span = fault.start, 1e-3 * fault.count
                cost = cost_of(found, judged(copy), contact, span, AT_ONCE, factor, partial(list, map(judged, logs)))
                if cost is not None:
                    outcomes.setdefault(cost.outcome, []).append((detector, threshold, kind, fault, cost))
                    assert cost.damaged == cost.whole or fault.start <= cost.whole + 1e-9, (detector, threshold, cost)
    assert len(outcomes.pop("in time")) > 500
    assert len(outcomes.pop("late", [])) <= 3 and not outcomes.pop("missed", [])  # 4 of 26,784 are usual
    assert sum(map(len, outcomes.values())) <= 20


def first_after(found: Detection, onset: float) -> float:
    return min((alarm.time for alarm in found.verdict.crossings if alarm.time >= onset), default=np.inf)


@pytest.mark.parametrize("threshold", ["cusum", "signature", "trend", "predicted_limit"])
@pytest.mark.parametrize("detector", ["friction_ekf", "inertial_momentum", "momentum", "pure_torque"])
def test_a_sensor_that_loses_10_samples_every_200_ms_is_still_judged_and_what_is_not_is_counted(
    detector, threshold, learned
):
    channel = DETECTORS.load(detector).needs[-1]

    def flaky(recording: Recording) -> Recording:
        times = np.arange(0.1, 6.9, 0.2)
        return with_faults(recording, [Fault("NaN", float(t), 10, channel) for t in times], "flaky")

    free, hit = run("none", 500), run("stiff", 500)
    factor = learned.threshold(detector, threshold).safety_factor
    whole = learned.judged(detector, threshold, free, AT_ONCE)
    found = learned.judged(detector, threshold, flaky(free), AT_ONCE)
    assert critical_factor(found, AT_ONCE) <= SHARE * max(critical_factor(whole, AT_ONCE), factor)
    assert 0.8 * whole.assessed_seconds < found.assessed_seconds < whole.assessed_seconds
    assert found.statistic.shares()["missing samples"] > 0.03
    onset = find_contacts(learned.machine.referred_to_load(hit), OnsetRule(above=20.0, back_to=8.0))[0].start
    before = first_after(learned.judged(detector, threshold, hit, AT_ONCE), onset)
    assert first_after(learned.judged(detector, threshold, flaky(hit), AT_ONCE), onset) <= before + 0.03


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        *(("arm", name) for name in DETECTORS.names()),
        *(("robot", name) for name in ("momentum", "kalman_momentum", "inertial_momentum", "energy")),
    ],
)
@pytest.mark.parametrize("threshold", ["cusum", "signature"])
def test_lost_samples_of_coupled_joints_are_no_contact(name, threshold, kind, tmp_path):
    if kind == "robot":
        pytest.importorskip("pinocchio")
    machine = arm_of(ARM) if kind == "arm" else six_joint_robot(tmp_path)
    base = moving_recording(machine, seconds=3.0)

    def noisy(seed: int) -> Recording:
        rng = np.random.default_rng(seed)
        channels = {
            channel: replace(s, values=s.values + 1e-2 * s.values.std(axis=0) * rng.standard_normal(s.values.shape))
            for channel, s in base.channels.items()
            if channel in CHANNELS
        }
        return replace(base, name=f"run{seed}", channels={**base.channels, **channels})

    def found(recording: Recording, fitted: Sequence[Any]) -> Detection:
        operation = Operation(recording, operations_of(base)[0].motion)
        signal = run_detector(operation, machine, detector)
        return judge_alone(operation, name, signal, fitted, AT_ONCE)

    detector = DETECTORS.load(name)()
    learned = [noisy(seed) for seed in range(LEARNED)]
    pairs = [(r, run_detector(Operation(r, operations_of(base)[0].motion), machine, detector)) for r in learned]
    fitted = [THRESHOLDS.load(threshold)(sides="two").fit(pairs)]
    normal = max(critical_factor(found(noisy(100 + seed), fitted), AT_ONCE) for seed in range(6))
    # Rows and speed samples lost while the joints turn, among others.
    for seed in (10, 43, 49):
        whole = noisy(200 + seed)
        faults = random_faults(whole, 5, np.random.default_rng(seed), longest=10)
        before = critical_factor(found(whole, fitted), AT_ONCE)
        assert critical_factor(found(damaged(whole, faults), fitted), AT_ONCE) <= SHARE * max(before, normal)


@pytest.mark.parametrize("period", [1, 4, 16], ids=lambda ms: f"{ms} ms")
def test_a_log_that_lost_nothing_has_nothing_marked_as_lost(period, learned):
    whole = run("none", 600)
    slower = {n: replace(s, time=s.time[::period], values=s.values[::period]) for n, s in whole.channels.items()}
    clock = slower["speed"].time
    assert lost_samples(replace(whole, channels=slower), CHANNELS, clock) is None
    accelerometer = whole["acceleration"]
    for step in (1, 3, 10):
        own = Series(accelerometer.time[step::step] + 3e-4, accelerometer.values[step::step], "m/s2")
        assert lost_samples(replace(whole, channels={**slower, "acceleration": own}), CHANNELS, clock) is None


def test_clocks_of_36_to_50_hz_that_jitter_have_lost_nothing():
    rng = np.random.default_rng(0)
    times = [np.cumsum(rng.uniform(0.02, 0.028, 2000)) for _ in range(2)]
    times = [time[time < 40.0] for time in times]
    channels = {name: Series(t, t, "m/s") for name, t in zip(("speed", "torque"), times, strict=True)}
    lost = lost_samples(Recording("jitter", "made up", ("x",), channels), ("torque",), times[0])
    assert lost is None


@pytest.mark.parametrize("kind", ["NaN", "lost samples"])
@pytest.mark.parametrize("count", [1, 2, 10])
def test_exactly_the_lost_samples_of_a_channel_are_marked_sample_by_sample_and_causally(kind, count):
    whole = run("none", 600)
    recording = damaged(whole, [Fault(kind, 2.0, count, "acceleration")])
    clock = recording["speed"].time
    lost = lost_samples(recording, CHANNELS, clock)
    assert lost is not None
    first = int(np.searchsorted(clock, 2.0))
    np.testing.assert_array_equal(np.flatnonzero(lost[:, 0]), np.arange(first, first + count))
    for end in (1.9995, 2.0005, 2.003, 2.5):
        part = recording.between(-np.inf, end)
        cut = lost_samples(part, CHANNELS, part["speed"].time)
        marks = np.zeros((len(part["speed"]), 1), dtype=bool) if cut is None else cut
        np.testing.assert_array_equal(marks, lost[: len(marks)])


@pytest.mark.parametrize(("kind", "channel"), [("NaN", "position"), ("NaN", "speed"), ("lost rows", "")])
def test_an_arms_energy_rests_on_a_guess_until_what_was_guessed_of_a_long_gap_has_decayed(kind, channel):
    folder = ARM_LOGS / "trial_2"
    machine_file = read_machine_file(folder / "machine.toml")
    machine, detector = machine_file.machine, machine_file.detector("energy")
    raw = read_as_logged(folder / "free" / "01.csv", machine_file).recording

    def signal(recording: Recording) -> Signal:
        return run_detector(operations_of(machine.referred_to_load(recording))[0], machine, detector)

    whole = signal(raw)
    swing = float(np.ptp(whole.values[whole.valid[:, 0]]))
    for start in np.arange(1.5, 2.5, 0.1):
        fault = Fault(kind, start, 37, channel)
        found = signal(damaged(raw, [fault]))
        assert found.lost is not None
        known = found.valid[:, 0] & ~found.lost[:, 0]
        behind = known & (found.time >= start + 0.037) & (found.time < start + 0.2)
        off = np.abs(found.values[behind] - whole.values[np.searchsorted(whole.time, found.time[behind] - 1e-9)])
        assert float(off.max()) < 0.2 * swing, start
        # The signal rests on the guess for at most 15 ms.
        assert found.time[behind][0] < start + 0.037 + 0.0165
