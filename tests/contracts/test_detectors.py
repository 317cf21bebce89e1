"""What holds for every registered detector, those of installed plug-ins included."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import numpy as np
import pytest

from cdtool.base.errors import CdtoolError, RecordingError
from cdtool.detectors import DETECTORS
from cdtool.detectors.detection import WHOLE_MACHINE, Status
from cdtool.detectors.look import MARKERS
from cdtool.recordings.recording import CHANNELS, GROUND_TRUTH, Recording, Series
from cdtool.report.plots.style import look_of
from tests.synthetic.motions import moving_recording
from tests.synthetic.robots import JOINTS as ROBOT_JOINTS
from tests.synthetic.robots import six_joint_robot

NAMES = DETECTORS.names(plugins=True)


@dataclass(frozen=True)
class Subject:
    """A machine and recordings of it: `free` and `hit` by seed."""

    machine: Any
    free: Callable[[int], Recording]
    hit: Callable[[int], Recording]


@pytest.fixture(scope="module", params=["gate: 1 joint", "arm: 2 joints", "robot: 6 joints"])
def subject(request, tmp_path_factory) -> Subject:
    """The simulated gate, and exact motions of a planar arm and of a robot with revolute and prismatic joints."""
    if request.param.startswith("gate"):
        simulated = request.getfixturevalue("simulated")
        return Subject(
            request.getfixturevalue("gate"), lambda seed: simulated("none", seed), lambda seed: simulated("stiff", seed)
        )
    if request.param.startswith("arm"):
        machine = request.getfixturevalue("arm")
    else:
        pytest.importorskip("pinocchio")
        machine = six_joint_robot(tmp_path_factory.mktemp("robot"))
    contact = np.linspace(5.0, 2.0, len(machine.joints))
    return Subject(
        machine,
        lambda seed: moving_recording(machine, seconds=7.2, seed=seed, noise=1e-3),
        lambda seed: moving_recording(machine, seconds=7.2, seed=seed, noise=1e-3, contact=contact, contact_at=6.0),
    )


def needs_of(name: str) -> tuple[str, ...]:
    return DETECTORS.load(name).needs


def cut(recording: Recording, end: float) -> Recording:
    return recording.between(-np.inf, end)


def needed(detector: Any, machine: Any) -> tuple[str, ...]:
    """A model of coupled joints needs their pose as well."""
    has_model = "torque" in detector.needs and not {"speed", "position"}.isdisjoint(detector.needs)
    more = ("position",) if machine.coupled and has_model else ()
    return tuple(dict.fromkeys((*detector.needs, *more)))


def changed(recording: Recording, channel: str, values: np.ndarray) -> Recording:
    series = recording[channel]
    return replace(recording, channels={**recording.channels, channel: replace(series, values=values)})


@pytest.mark.parametrize("name", NAMES)
def test_it_is_a_frozen_dataclass_whose_gains_have_default_unit_and_meaning(name):
    detector = DETECTORS.load(name)
    assert is_dataclass(detector) and detector.__dataclass_params__.frozen
    for item in fields(detector):
        assert isinstance(item.default, float)
        assert item.metadata["unit"] and item.metadata["meaning"]
    assert DETECTORS.canonical(detector.short_name) == name
    assert set(detector.needs) <= set(CHANNELS) - set(GROUND_TRUTH)
    assert detector.__doc__ and len(detector.__doc__) > 80


@pytest.mark.parametrize("name", DETECTORS.table)
def test_the_short_name_in_the_table_is_that_of_the_class(name):
    assert [short for short, full in DETECTORS.short_names.items() if full == name] == [DETECTORS.load(name).short_name]


def test_no_two_detectors_have_the_same_colour_nor_a_marker_while_one_is_free():
    looks = [DETECTORS.load(name).look for name in DETECTORS.table]
    assert len({look.colour for look in looks}) == len(looks)
    assert len({look.marker for look in looks}) == min(len(looks), len(MARKERS))
    assert all(look_of(name) is look for name, look in zip(DETECTORS.table, looks, strict=True))


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("kind", ["hit", "free"])
def test_it_is_causal_its_output_on_a_prefix_is_the_prefix_of_its_output(name, kind, subject):
    recording, gate = getattr(subject, kind)(1), subject.machine
    detector = DETECTORS.load(name)()
    whole = detector.signal(recording, gate)
    for end in (0.0105, 0.4, 1.2345, 3.0, 6.02, 6.1):
        part = detector.signal(cut(recording, end), gate)
        n = len(part.time)
        assert n == np.searchsorted(whole.time, end, side="right")
        np.testing.assert_array_equal(part.values, whole.values[:n])
        np.testing.assert_array_equal(part.status, whole.status[:n])


@pytest.mark.parametrize("name", NAMES)
def test_it_never_reads_the_load_cell_nor_the_pressure_of_the_contact(name, gate, simulated):
    recording = simulated("stiff", 1)
    force = recording["force"]
    pressure = Series(force.time, 1e3 * force.values, "Pa")
    recording = replace(recording, channels={**recording.channels, "contact_pressure": pressure})
    assert not set(GROUND_TRUTH) & set(recording.without_ground_truth().channels)
    detector = DETECTORS.load(name)()
    with_cell = detector.signal(recording, gate)
    without = detector.signal(recording.without_ground_truth(), gate)
    np.testing.assert_array_equal(with_cell.values, without.values)


@pytest.mark.parametrize("name", NAMES)
def test_a_time_shift_changes_nothing_but_the_time(name, subject):
    recording, gate = subject.hit(1), subject.machine
    shift = 512.0  # a power of two: the time steps keep their bits but for the last few
    moved = replace(
        recording,
        channels={n: replace(s, time=s.time + shift) for n, s in recording.channels.items()},
    )
    detector = DETECTORS.load(name)()
    here, there = detector.signal(recording, gate), detector.signal(moved, gate)
    np.testing.assert_allclose(there.values, here.values, rtol=1e-6, atol=1e-6 * np.abs(here.values).max())
    assert np.mean(there.status != here.status) < 1e-3


@pytest.mark.parametrize(("name", "channel"), [(name, channel) for name in NAMES for channel in needs_of(name)])
def test_missing_samples_are_masked_and_the_estimate_recovers(name, channel, subject):
    detector = DETECTORS.load(name)()
    recording, gate = subject.free(3), subject.machine
    values = recording[channel].values.copy()
    hole = slice(2500, 2700)
    values[hole] = np.nan
    clean = detector.signal(recording, gate)
    holed = detector.signal(changed(recording, channel, values), gate)
    assert np.isfinite(holed.values[holed.valid]).all()
    inside = (holed.time >= 2.56) & (holed.time <= 2.69)
    assert not holed.valid[inside].any()
    assert set(np.unique(holed.status[inside])) <= {Status.GAP, Status.START_UP}
    end = slice(6000, None)
    assert holed.valid[end].mean() == pytest.approx(clean.valid[end].mean(), abs=0.01)
    spread = clean.values[clean.valid].std()
    assert np.abs(holed.values[end] - clean.values[end]).max() < 0.05 * spread


def scale_of(detector: Any, subject: Subject) -> float:
    """The largest value with a contact, or for an estimate of torque the largest torque of the drive."""
    signal = detector.signal(subject.hit(3), subject.machine)
    torque = subject.hit(3)["torque"].values if detector.contact_torque else 0.0
    return max(float(np.abs(signal.values[signal.valid]).max()), float(np.abs(torque).max()))


@pytest.mark.parametrize("name", NAMES)
def test_blank_rows_are_rows_that_are_not_in_the_log(name, subject):
    detector, machine, recording = DETECTORS.load(name)(), subject.machine, subject.free(3).without_ground_truth()
    kept = np.r_[0:2500, 2600 : len(recording["speed"])]
    blank, absent = {}, {}
    for channel, series in recording.channels.items():
        values = series.values.copy()
        values[2500:2600] = np.nan
        blank[channel] = replace(series, values=values)
        absent[channel] = replace(series, time=series.time[kept], values=series.values[kept])
    found, expected = (detector.signal(replace(recording, channels=own), machine) for own in (blank, absent))
    assert not found.valid[2500:2600].any()
    both = found.valid[kept] & expected.valid
    assert both.mean() > 0.98 * expected.valid.mean()
    # These two cross a gap otherwise if it has rows: in steps of the filter, and with a window of so many rows.
    if name not in ("friction_ekf", "desired_dynamics"):
        off = np.abs(found.values[kept] - expected.values)[both].max()
        assert off < 1e-9 * scale_of(detector, subject)


@pytest.mark.parametrize(("name", "channel"), [(name, channel) for name in NAMES for channel in needs_of(name)])
def test_a_channel_that_begins_late_is_not_valid_before_the_estimate_has_settled(name, channel, subject):
    detector, machine, recording = DETECTORS.load(name)(), subject.machine, subject.free(3)
    clean = detector.signal(recording, machine)
    begun = replace(recording, channels={**recording.channels, channel: recording[channel].between(2.0, np.inf)})
    late = detector.signal(begun, machine)
    both = late.valid & clean.valid[len(clean.time) - len(late.time) :]
    assert both.any()
    off = np.abs(late.values - clean.values[len(clean.time) - len(late.time) :])[both].max()
    assert off < 0.1 * scale_of(detector, subject)  # 5 % of an error at the start may be left


@pytest.mark.parametrize("name", NAMES)
def test_scattered_missing_samples_leave_the_other_samples_valid(name, subject):
    detector = DETECTORS.load(name)()
    recording, gate = subject.free(4), subject.machine
    judged = detector.signal(recording, gate).valid
    rng = np.random.default_rng(0)
    for channel in detector.needs:
        values = recording[channel].values.copy()
        values[rng.random(len(values)) < 0.05] = np.nan  # all joints of a message at once
        recording = changed(recording, channel, values)
    signal = detector.signal(recording, gate)
    assert np.isfinite(signal.values[signal.valid]).all()
    judged[signal.time <= 3.0] = False
    assert 0.8 < signal.valid[judged].mean() < 0.97


@pytest.mark.parametrize("name", NAMES)
def test_an_all_missing_channel_is_never_valid_and_never_crashes(name, subject):
    detector, gate = DETECTORS.load(name)(), subject.machine
    for channel in needed(detector, gate):
        recording = subject.free(3)
        blind = changed(recording, channel, np.full_like(recording[channel].values, np.nan))
        assert not detector.signal(blind, gate).valid.any()


@pytest.mark.parametrize("name", NAMES)
def test_an_absent_channel_is_an_error_that_names_it(name, subject):
    detector, gate = DETECTORS.load(name)(), subject.machine
    for channel in needed(detector, gate):
        recording = subject.free(3)
        left = {n: s for n, s in recording.channels.items() if n != channel}
        with pytest.raises(RecordingError, match=channel):
            detector.signal(replace(recording, channels=left), gate)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("samples", [0, 1, 2])
def test_a_recording_of_hardly_any_samples_gives_a_signal_of_that_length(name, samples, subject):
    recording, gate = subject.free(3), subject.machine
    short = {n: replace(s, time=s.time[:samples], values=s.values[:samples]) for n, s in recording.channels.items()}
    signal = DETECTORS.load(name)().signal(replace(recording, channels=short), gate)
    columns = len(signal.joints or gate.joints)
    assert signal.values.shape == signal.status.shape == (samples, columns)


@pytest.mark.parametrize("name", NAMES)
def test_wrong_gains_are_refused_by_name(name):
    detector = DETECTORS.load(name)
    for item in fields(detector):
        with pytest.raises(CdtoolError, match=item.name):
            detector(**{item.name: -1.0})


@pytest.mark.parametrize("name", NAMES)
def test_several_joints_are_what_each_is_alone_and_their_order_does_not_matter(name, simulated):
    from tests.synthetic.machines import GATE, machine_of

    a, b = simulated("stiff", 5), simulated("soft", 6)
    n = min(len(a["speed"]), len(b["speed"]))

    def pair(first: Recording, second: Recording, joints: tuple[str, str]) -> Recording:
        channels = {}
        for channel in first.without_ground_truth().channels:
            values = np.hstack((first[channel].values[:n], second[channel].values[:n]))
            channels[channel] = Series(first[channel].time[:n], values, first[channel].unit)
        return Recording("pair", "pair", joints, channels)

    machine = machine_of({**GATE, "joints": ["x", "y"]})
    alone = machine_of(GATE)
    detector = DETECTORS.load(name)()
    both = detector.signal(pair(a, b, ("x", "y")), machine)
    swapped = detector.signal(pair(b, a, ("y", "x")), machine)
    one = detector.signal(cut(a, a["speed"].time[n - 1]), alone)
    np.testing.assert_array_equal(both.values[:, :1], one.values[:n])
    np.testing.assert_array_equal(both.values, swapped.values[:, ::-1])
    np.testing.assert_array_equal(both.status, swapped.status[:, ::-1])


@pytest.mark.parametrize("name", NAMES)
def test_the_order_of_a_robots_joints_does_not_matter(name, tmp_path):
    pytest.importorskip("pinocchio")
    order = [3, 0, 5, 1, 4, 2]
    straight, mixed = six_joint_robot(tmp_path), six_joint_robot(tmp_path, [ROBOT_JOINTS[i] for i in order])
    recording = moving_recording(straight, seconds=3.0, noise=1e-3, contact=np.arange(1.0, 7.0), contact_at=2.0)
    channels = {n: replace(s, values=s.values[:, order]) for n, s in recording.channels.items()}
    permuted = replace(recording, joints=mixed.joints, channels=channels)
    detector = DETECTORS.load(name)()
    one, other = detector.signal(recording, straight), detector.signal(permuted, mixed)
    columns = slice(None) if one.joints == WHOLE_MACHINE else order
    scale = np.abs(one.values).max()
    np.testing.assert_allclose(other.values, one.values[:, columns], rtol=1e-9, atol=1e-9 * scale)
    np.testing.assert_array_equal(other.status, one.status[:, columns])


@pytest.mark.parametrize("name", NAMES)
def test_a_jittering_clock_changes_the_signal_little(name, subject):
    recording = subject.hit(5)
    rng = np.random.default_rng(1)
    steps = rng.uniform(0.7, 1.3, len(recording["speed"])) * 1e-3
    clock = np.minimum(np.cumsum(steps), recording.end)
    clock = clock[np.concatenate(([True], np.diff(clock) > 0.0))]
    # Sampled at other instants, not the same samples with wrong stamps.
    jittered = {
        n: Series(clock, np.column_stack([np.interp(clock, s.time, column) for column in s.values.T]), s.unit)
        for n, s in recording.channels.items()
        if n not in GROUND_TRUTH
    }
    detector = DETECTORS.load(name)()
    even = detector.signal(recording, subject.machine)
    uneven = detector.signal(replace(recording, channels=jittered), subject.machine)
    at = np.searchsorted(clock, even.time[2000:6900])
    steady = even.valid[2000:6900] & uneven.valid[at]
    assert steady.mean() > 0.5
    difference = (uneven.values[at] - even.values[2000:6900])[steady]
    measured = np.ptp(even.values[2000:6900][steady])
    assert np.median(np.abs(difference)) < 0.05 * measured


@pytest.mark.parametrize("name", NAMES)
def test_at_rest_it_finds_nothing_or_says_that_it_cannot_judge(name, subject):
    machine = subject.machine
    time = np.arange(6000) * 1e-3
    pose = np.tile(np.linspace(0.2, 0.7, len(machine.joints)), (len(time), 1))
    still = np.zeros_like(pose)
    units = machine.load_units
    torque = machine.required_torque(pose, still, still)
    values = {"torque": torque, "speed": still, "position": pose, "acceleration": still, "reference_position": pose}
    values["reference_torque"] = torque
    channels = {n: Series(time, v, units[n.removeprefix("reference_")]) for n, v in values.items()}
    signal = DETECTORS.load(name)().signal(Recording("rest", "rest", machine.joints, channels), machine)
    assert set(np.unique(signal.status)) <= {Status.VALID, Status.START_UP, Status.NOT_APPLICABLE, Status.GAP}
    if name in ("energy", "friction_ekf"):
        assert (signal.status[4000:] == Status.NOT_APPLICABLE).all()
        assert "not applicable" in signal.why_not()
    elif name in DETECTORS.table:
        expected = torque if name == "pure_torque" else 0.0
        assert signal.valid[4000:].all()
        np.testing.assert_allclose(signal.values[4000:], (still + expected)[4000:], atol=1e-9)
