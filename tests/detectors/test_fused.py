"""The detector with several columns: what it reads, what it leaves out, and its own rule wherever one is fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import cdtool
from cdtool.activation import Activation
from cdtool.detection import WHOLE_MACHINE, Status
from cdtool.detectors.friction_ekf import FrictionEkf
from cdtool.detectors.fused import Fused
from cdtool.errors import ConfigurationError, RecordingError, UsageError
from cdtool.operations import operations_of
from cdtool.pipeline import detect_operation, run_detector
from cdtool.recording import Recording, Series
from cdtool.signature_store import read_signature, write_signature
from cdtool.simulation.changed_machine import ChangedMachine
from cdtool.simulation.gate_model import GateParameters, simulate_gate_run
from cdtool.simulation.gate_recordings import as_recording
from cdtool.thresholds.glr import Glr
from cdtool.thresholds.matched_banks import FittedMatchedBanks, MatchedBanks
from cdtool.thresholds.sequential import FittedSequential
from cdtool.workflows.benchmark.benchmark_file import read_benchmark_file
from cdtool.workflows.signature.fitting import fit_operations

SEEDS = range(10, 24)
AT_3 = Activation(debounce=3)


def without(recording: Recording, *channels: str) -> Recording:
    return replace(recording, channels={n: s for n, s in recording.channels.items() if n not in channels})


def seen(recording: Recording, *channels: str) -> Recording:
    return without(recording, "force", *channels)


@pytest.mark.parametrize(
    ("missing", "columns"),
    [
        ((), ["acceleration", "force", "torque", "speed"]),
        (("acceleration",), ["torque", "speed"]),
        (("torque",), ["acceleration", "speed"]),
    ],
)
def test_it_uses_the_channels_that_an_axis_has(gate, simulated, missing, columns):
    signal = Fused().signal(seen(simulated("none", 1), *missing), gate)
    assert [channel for channel, _ in signal.channels] == columns
    assert signal.values.shape == (len(signal.time), len(columns)) and signal.valid[4000:6000].all()
    assert bool(signal.notes) == ("acceleration" in missing)


def test_a_speed_alone_is_not_enough(gate, simulated):
    with pytest.raises(RecordingError, match="torque or acceleration"):
        Fused().signal(seen(simulated("none", 1), "torque", "acceleration"), gate)


def test_a_robot_has_three_columns_per_joint_and_none_for_a_joint_without_samples(arm):
    time = np.arange(500) * 1e-3
    zeros = np.zeros((500, 2))
    half = zeros.copy()
    half[:, 1] = np.nan
    units = {"torque": "N m", "speed": "rad/s", "position": "rad", "acceleration": "rad/s2"}
    channels = {name: Series(time, half if name == "acceleration" else zeros, unit) for name, unit in units.items()}
    signal = Fused().signal(Recording("run", "run", arm.joints, channels), arm)
    first, second = arm.joints
    assert signal.channels == (
        ("torque", first),
        ("torque", second),
        ("speed", first),
        ("speed", second),
        ("acceleration", first),
    )
    assert signal.notes == (f"fused without acceleration of {second}: its stiff contacts are detected later",)


def test_the_force_of_an_axis_is_the_estimated_friction_times_the_speed(gate, simulated):
    run = seen(simulated("none", 2))
    signal, friction = Fused().signal(run, gate), FrictionEkf().signal(run, gate)
    at = 5000
    np.testing.assert_allclose(signal.values[at, 1], friction.values[at, 0] * run["speed"].values[at, 0], rtol=1e-12)
    np.testing.assert_array_equal(signal.status[:, 1], friction.status[:, 0])


def test_a_missing_acceleration_is_lost_in_its_column_and_in_the_force(gate, simulated):
    run = seen(simulated("none", 3))
    values = run["acceleration"].values.copy()
    values[5000:5010] = np.nan
    holed = replace(run, channels={**run.channels, "acceleration": run["acceleration"].with_values(values, "m/s2")})
    signal = Fused().signal(holed, gate)
    assert (signal.status[5000:5010, 0] == Status.GAP).all()
    assert signal.lost is not None and signal.lost[5000:5010].all(axis=0).tolist() == [True, True, False, False]
    assert not signal.lost[:, 2:].any()


def test_a_watched_joint_leaves_all_columns_and_an_unknown_one_is_refused(gate, simulated):
    signal = Fused().signal(seen(simulated("none", 1)), gate)
    assert signal.watching(("gate",)) is signal and signal.watching(WHOLE_MACHINE) is signal
    with pytest.raises(ConfigurationError, match="unknown joint"):
        signal.watching(("door",))


def test_a_joint_without_a_single_sample_is_left_out_and_said(tmp_path):
    """The log of a robot of which one joint is not mapped: the others are assessed."""
    pytest.importorskip("pinocchio")
    from tests.synthetic.robots import six_joint_robot

    machine = six_joint_robot(tmp_path)
    last = machine.joints[-1]

    def unmapped(recording: Recording) -> Recording:
        channels = {}
        for name, series in recording.channels.items():
            values = series.values.copy()
            values[:, -1] = np.nan if name in ("torque", "speed", "acceleration") else values[:, -1]
            channels[name] = series.with_values(values, series.unit)
        return replace(recording, channels=channels)

    known = [operations_of(unmapped(robot_stroke(machine, seed)))[0] for seed in range(12)]
    signal = run_detector(known[0], machine, Fused())
    assert signal.values.shape[1] == 15 and signal.valid[1500:2400].all()
    assert signal.notes == (
        f"fused without torque, speed, acceleration of {last}: contacts with it are detected later, if at all",
    )
    learned = fit_operations(known, machine, Fused(), MatchedBanks(order=4)).thresholds
    hit = operations_of(unmapped(robot_stroke(machine, 91, 1.6)))[0]
    verdict = detect_operation(hit, machine, Fused(), learned, AT_3).verdict
    assert verdict.outcome == "alarm" and 1.6 <= verdict.alarms[0].time < 1.65


@pytest.fixture(scope="module")
def operations(simulated):
    return [operations_of(simulated("none", seed))[0] for seed in SEEDS]


@pytest.fixture(scope="module")
def thresholds(gate, operations):
    return fit_operations(operations, gate, Fused(), Glr()).thresholds


def test_its_own_rule_is_fitted_whatever_the_rule_of_the_others_is(gate, operations, thresholds):
    assert [type(item) for item in thresholds] == [FittedMatchedBanks]
    (other,) = fit_operations(operations, gate, FrictionEkf(), Glr()).thresholds
    assert type(other) is FittedSequential


@pytest.mark.parametrize(("kind", "within"), [("stiff", 0.03), ("soft", 0.12)])
def test_it_sees_contacts_and_judges_the_whole_machine(gate, simulated, thresholds, kind, within):
    recording = simulated(kind, 3)
    detection = detect_operation(operations_of(recording)[0], gate, Fused(), thresholds, AT_3)
    onset = float(recording["force"].time[np.flatnonzero(recording["force"].values[:, 0] > 20.0)[0]])
    assert detection.verdict.outcome == "alarm"
    assert -0.005 < detection.verdict.alarms[0].time - onset < within
    assert detection.statistic.joints == WHOLE_MACHINE and detection.exceedance().shape == detection.band.upper.shape


def test_a_slower_start_is_no_contact(gate, thresholds):
    """The speed column would see it; the motion is not assessable once it is settled at another speed."""
    slower = ChangedMachine(speed=0.9).gate(GateParameters())
    for seed in (31, 32, 33):
        recording = as_recording(simulate_gate_run(slower, np.random.default_rng(seed), "none"), "slower", slower)
        verdict = detect_operation(operations_of(recording)[0], gate, Fused(), thresholds, AT_3).verdict
        assert verdict.outcome == "not_assessable" and not verdict.alarms


def test_a_very_soft_contact_is_seen_in_torque_and_speed_first(gate, thresholds):
    soft = GateParameters(bumper_stiffness=8e3)
    for seed in (41, 42, 43):
        recording = as_recording(simulate_gate_run(soft, np.random.default_rng(seed), "soft"), "very soft", soft)
        onset = float(recording["force"].time[np.flatnonzero(recording["force"].values[:, 0] > 20.0)[0]])
        operation = operations_of(recording)[0]
        limited = [item.with_safety_factor(4.0) for item in thresholds]
        (alarm, *_) = detect_operation(operation, gate, Fused(), limited, AT_3).verdict.alarms
        signal = run_detector(operation, gate, Fused())
        evidence = thresholds[0].explained(recording.without_ground_truth(), signal, alarm.time)
        assert 0.0 < alarm.time - onset < 0.16
        assert evidence is not None and "gate speed" in evidence.columns


def test_without_an_accelerometer_it_is_slower_and_still_sees_them(gate, simulated):
    blind = [operations_of(without(simulated("none", seed), "acceleration"))[0] for seed in SEEDS]
    learned = fit_operations(blind, gate, Fused(), MatchedBanks()).thresholds
    for kind, seed in (("stiff", 4), ("soft", 4)):
        recording = without(simulated(kind, seed), "acceleration")
        verdict = detect_operation(operations_of(recording)[0], gate, Fused(), learned, AT_3).verdict
        assert verdict.outcome == "alarm"


def test_channels_with_clocks_of_their_own_are_judged(gate, simulated):
    def slower(recording: Recording) -> Recording:
        acceleration = recording["acceleration"]
        own = Series(acceleration.time[::2] + 0.0004, acceleration.values[::2], acceleration.unit)
        return replace(recording, channels={**recording.channels, "acceleration": own})

    known = [operations_of(slower(simulated("none", seed)))[0] for seed in SEEDS]
    learned = fit_operations(known, gate, Fused(), MatchedBanks()).thresholds
    for kind, outcome in (("none", "no alarm"), ("stiff", "alarm")):
        run = operations_of(slower(simulated(kind, 6)))[0]
        assert detect_operation(run, gate, Fused(), learned, AT_3).verdict.outcome == outcome


def test_its_signal_is_causal_with_its_rule(gate, simulated, thresholds):
    recording = simulated("soft", 7).without_ground_truth()
    (fitted,) = thresholds
    whole, _ = fitted.evaluate(recording, run_detector(operations_of(recording)[0], gate, Fused()))
    for end in (0.9, 1.9, 3.3, 6.05):
        part = recording.between(-np.inf, end)
        cut, _ = fitted.evaluate(part, run_detector(operations_of(part)[0], gate, Fused()))
        np.testing.assert_array_equal(cut.values, whole.values[: len(cut.time)])
        np.testing.assert_array_equal(cut.status, whole.status[: len(cut.time)])


def test_it_is_learned_stored_and_used_from_a_signature_file(tmp_path):
    cdtool.simulate_gate(tmp_path / "gate", {"free": 12, "stiff": 1}, seed=4)
    free, machine = sorted((tmp_path / "gate" / "free").iterdir()), tmp_path / "gate" / "machine.toml"
    learned = cdtool.learn_signature(free, machine, "fused")
    assert learned.signature.rule.name == "matched_banks" and learned.signature.joints == WHOLE_MACHINE
    write_signature(tmp_path / "fused.json", learned.signature)
    assert read_signature(tmp_path / "fused.json").current[0].to_dict() == learned.signature.current[0].to_dict()
    found = cdtool.detect(tmp_path / "gate" / "stiff" / "01.csv", machine, signature=tmp_path / "fused.json")
    assert found.detections[0].verdict.outcome == "alarm"
    with pytest.raises(UsageError, match="its own threshold matched_banks"):
        cdtool.learn_signature(free, machine, "fused", rule=Glr())


def robot_stroke(machine, seed: int, hit_at: float = np.inf) -> Recording:
    """A stroke of all joints at constant speed with correlated noise; from `hit_at` [s] on the first joint slows."""
    rng = np.random.default_rng(seed)
    time = np.arange(2500) * 1e-3
    ways = np.linspace(0.3, 0.1, len(machine.joints))
    pace = np.clip((time - 0.3) / 0.3, 0.0, 1.0)[:, np.newaxis]
    lost = np.zeros((len(time), len(machine.joints)))
    lost[:, 0] = 0.2 * np.clip((time - hit_at) / 0.03, 0.0, 1.0) ** 2 if np.isfinite(hit_at) else 0.0
    speed = ways * pace - lost
    acceleration = np.vstack((np.zeros((1, speed.shape[1])), np.diff(speed, axis=0) / 1e-3))
    position = np.cumsum(speed, axis=0) * 1e-3
    torque = machine.required_torque(position, speed, np.zeros_like(speed))
    channels = {}
    for name, values, size in (
        ("torque", torque, 0.5),
        ("speed", speed, 2e-3),
        ("position", position, 1e-6),
        ("acceleration", acceleration, 0.3),
    ):
        noise = rng.normal(size=values.shape)
        for k in range(1, len(noise)):
            noise[k] += 0.8 * noise[k - 1]
        channels[name] = Series(time, values + size * noise, machine.load_units[name])
    return Recording(f"stroke {seed}", "stroke", machine.joints, channels)


def test_a_robot_of_six_joints_is_learned_and_judged_as_one(tmp_path):
    pytest.importorskip("pinocchio")
    from tests.synthetic.robots import six_joint_robot

    machine = six_joint_robot(tmp_path)
    known = [operations_of(robot_stroke(machine, seed))[0] for seed in range(12)]
    learned = fit_operations(known, machine, Fused(), MatchedBanks(order=4)).thresholds
    free = detect_operation(operations_of(robot_stroke(machine, 90))[0], machine, Fused(), learned, AT_3)
    hit = detect_operation(operations_of(robot_stroke(machine, 91, 1.6))[0], machine, Fused(), learned, AT_3)
    assert free.verdict.outcome == "no alarm" and free.statistic.valid[1500:2400].all()
    assert hit.verdict.outcome == "alarm" and 1.6 <= hit.verdict.alarms[0].time < 1.65


def test_a_benchmark_judges_each_detector_by_its_own_rule(tmp_path):
    folder = tmp_path / "gate"
    cdtool.simulate_gate(folder, {"free": 12, "holdout": 2, "stiff": 2}, seed=5)
    text = (folder / "benchmark.toml").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if not line.startswith("detectors")]
    lines.insert(2, 'detectors = ["feekf", "fused"]\nthreshold = "glr"')
    (folder / "benchmark.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    setup = read_benchmark_file(folder / "benchmark.toml")
    assert [setup.rule_of(name).name for name in setup.detectors] == ["glr", "matched_banks"]
    results = cdtool.benchmark(folder / "benchmark.toml").results
    assert {contact.detector for contact in results.contacts} == {"friction_ekf", "fused"}
    assert all(contact.outcome == "detected" for contact in results.contacts)
    assert not [alarm for alarm in results.false_alarms if alarm.group == "holdout"]
