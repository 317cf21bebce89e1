from __future__ import annotations

import hashlib

import numpy as np
import pytest

from cdtool.base.errors import ConfigurationError, RecordingError
from cdtool.formats.channels.channel_assembly import assemble_recording
from cdtool.formats.channels.channel_map import ChannelMap, ChannelSource, TimeSource
from cdtool.formats.channels.reading import read_recording
from cdtool.formats.columns import Column
from cdtool.formats.mcap.write import Stream, write_mcap
from cdtool.formats.source import Source
from tests.base.findings.facts import fact_of

RATIO = 2.0e-3


def table(columns, n=50):
    rows = "\n".join(",".join(f"{value[i]:.17g}" for value in columns.values()) for i in range(n))
    return ",".join(columns) + "\n" + rows + "\n"


def gate_columns(n=50):
    k = np.arange(n)
    return {"t": 10.0 * k, "i_motor": 0.1 * k, "n_motor": 1.0 + k}


def channels_and_facts(recording):
    return [(finding.channel, fact_of(finding)) for finding in recording.findings]


def test_columns_become_channels_in_si_on_the_load_side(log, machine):
    path = log(table(gate_columns()))
    recording = read_recording(path, machine())
    assert np.allclose(recording["torque"].time, 0.01 * np.arange(50))
    assert np.allclose(recording["torque"].values[:, 0], 0.1 * np.arange(50) * 0.5 / RATIO)
    assert np.allclose(recording["speed"].values[:, 0], (1.0 + np.arange(50)) * RATIO)
    assert recording["torque"].unit == "N"
    assert recording.name == "log"
    assert recording.source == str(path)
    assert recording.digest == hashlib.sha256(path.read_bytes()).hexdigest()
    assert recording.origin == 0.0
    assert "position" in recording
    assert ("position", ("integrated_position", {})) in channels_and_facts(recording)


def test_topics_become_channels_with_their_own_times(tmp_path, machine):
    from tests.formats.conftest import TOPICS

    time = np.arange(100) / 100
    path = tmp_path / "run.mcap"
    write_mcap(
        path,
        [
            Stream(
                "/joint_states",
                "sensor_msgs/msg/JointState",
                time,
                {"position[0]": time, "velocity[0]": time + 1, "effort[0]": time + 2},
            ),
            Stream("/imu", "sensor_msgs/msg/Imu", time[:50] + 0.001, {"linear_acceleration.x": time[:50]}),
            Stream("/load_cell", "geometry_msgs/msg/WrenchStamped", time, {"wrench.force.z": 5 * time}),
        ],
        start_ns=1_700_000_000 * 10**9,
    )
    recording = read_recording(path, machine(TOPICS))
    assert recording.origin == 1.7e9
    assert np.allclose(recording["acceleration"].values[:, 0], -time[:50])
    assert np.allclose(recording["acceleration"].time, time[:50] + 0.001)
    assert np.allclose(recording["torque"].values[:, 0], (time + 2) / RATIO)
    assert np.allclose(recording["force"].values[:, 0], 5 * time)


def test_an_epoch_clock_starts_at_zero_and_its_origin_is_stored(log, machine):
    columns = gate_columns()
    columns["t"] = columns["t"] + 1.7e12  # ms
    recording = read_recording(log(table(columns)), machine())
    assert np.array_equal(recording["torque"].time, 10.0 * np.arange(50) * 1e-3)
    assert recording.origin == pytest.approx(1.7e9)


def test_faulty_stamps_are_dropped_from_every_channel_and_reported_with_their_lines(log, machine):
    columns = gate_columns()
    columns["t"][[10, 20]] = [50.0, np.nan]
    recording = read_recording(log(table(columns)), machine())
    assert len(recording["torque"]) == len(recording["speed"]) == 48
    assert (
        "time",
        ("backward_stamps", {"count": 1, "rows": 50, "first": (12,), "row_name": "line", "restart": None}),
    ) in channels_and_facts(recording)
    assert (
        "time",
        ("unknown_stamps", {"count": 1, "rows": 50, "first": (22,), "row_name": "line"}),
    ) in channels_and_facts(recording)
    assert np.isclose(recording["torque"].values[10, 0], 0.1 * 11 * 0.5 / RATIO)


def test_missing_infinite_and_saturated_values_are_masked_and_counted(log, machine):
    columns = gate_columns()
    columns["i_motor"][3] = np.nan
    columns["i_motor"][4] = np.inf
    columns["i_motor"][45:] = 4.0
    found = machine(
        """
        [channels]
        time = { column = "t", unit = "ms" }
        torque = { column = "i_motor", unit = "A", scale = 0.5, saturation = [-4, 4] }
        speed = { column = "n_motor", unit = "rad/s" }
        """
    )
    recording = read_recording(log(table(columns)), found)
    missing = np.flatnonzero(np.isnan(recording["torque"].values[:, 0]))
    assert missing.tolist() == [3, 4, *range(40, 50)]
    for fact in (
        ("infinite_values", {"count": 1, "joint": ""}),
        ("saturated_values", {"count": 10, "joint": ""}),
        ("missing_values", {"count": 1, "values": 50}),
    ):
        assert ("torque", fact) in channels_and_facts(recording)


def test_a_time_offset_shifts_only_its_channel(log, machine):
    found = machine(
        """
        [channels]
        time = { rate_hz = 100 }
        torque = { column = "i_motor", unit = "A", scale = 0.5, time_offset = -0.025 }
        speed = { column = "n_motor", unit = "rad/s" }
        """
    )
    recording = read_recording(log(table(gate_columns())), found)
    assert recording["torque"].time[0] == -0.025
    assert np.allclose(recording["speed"].time, np.arange(50) / 100)


def test_a_header_with_another_unit_is_reported(log, machine):
    found = machine(
        """
        [channels]
        time = { column = "t", unit = "s" }
        torque = { column = "i", unit = "A", scale = 0.5 }
        speed = { column = "n", unit = "rad/s" }
        """
    )
    recording = read_recording(log("t [ms],i [A],n [mm/s]\n0,1,2\n1,2,3\n2,3,4\n"), found)
    contradicted = {
        channel: fact.numbers["header"]
        for channel, fact in channels_and_facts(recording)
        if fact.kind in ("clock_unit_contradicted", "unit_contradicted")
    }
    assert contradicted == {"time": "t [ms]", "speed": "n [mm/s]"}


DUTY = """
[channels]
time = {{ column = "t", unit = "ms" }}
torque = {{ column = "u", unit = "{unit}", kind = "duty", supply_voltage = 24, resistance = 2.0, {motor} }}
{motion}
"""
MOTOR = "back_emf_constant = 0.1, torque_constant = 0.2"


@pytest.mark.parametrize(("unit", "volts"), [("%", 0.24), ("1", 24.0), ("V", 1.0)])
def test_torque_is_computed_from_voltage_and_speed(log, machine, unit, volts):
    found = machine(DUTY.format(unit=unit, motor=MOTOR, motion='speed = { column = "n", unit = "rad/s" }'))
    n = np.arange(50.0)
    recording = read_recording(log(table({"t": 10 * n, "u": 0.5 * n, "n": n})), found)
    expected = 0.2 * (0.5 * n * volts - 0.1 * n) / 2.0
    assert np.allclose(recording["torque"].values[:, 0], expected / RATIO)


def test_torque_from_the_voltage_uses_the_derivative_of_the_position_without_a_speed(log, machine):
    found = machine(DUTY.format(unit="V", motor=MOTOR, motion='position = { column = "q", unit = "rad" }'))
    n = np.arange(50.0)
    recording = read_recording(log(table({"t": 10 * n, "u": 12 + 0 * n, "q": 0.3 * n})), found)
    assert np.isnan(recording["torque"].values[0, 0])
    assert np.allclose(recording["torque"].values[1:, 0], 0.2 * (12 - 0.1 * 30.0) / 2.0 / RATIO)


@pytest.mark.parametrize("motion", ["", 'speed = { column = "n", unit = "m/s" }'])
def test_torque_from_the_voltage_without_the_motors_speed_is_a_clear_error(log, machine, motion):
    found = machine(DUTY.format(unit="V", motor=MOTOR, motion=motion))
    with pytest.raises(ConfigurationError, match="needs the motor's speed"):
        read_recording(log("t,u,n\n0,1,2\n1,2,3\n"), found)


def test_a_channel_that_is_constant_while_the_machine_moves_is_reported(log, machine):
    columns = gate_columns()
    columns["i_motor"][:] = 1.5
    assert ("torque", ("stuck_channel", {"joint": ""})) in channels_and_facts(
        read_recording(log(table(columns)), machine())
    )
    columns["n_motor"][:] = 0.0
    assert ("torque", ("stuck_channel", {"joint": ""})) not in channels_and_facts(
        read_recording(log(table(columns)), machine())
    )


def test_a_field_with_more_values_than_joints_is_a_clear_error(tmp_path, machine):
    path = tmp_path / "two.mcap"
    time = np.arange(5.0)
    write_mcap(path, [Stream("/drive", "std_msgs/msg/Float64MultiArray", time, {"data": np.ones((5, 2))})])
    found = machine('[channels.mcap]\ntorque = { topic = "/drive", field = "data[:]" }\n')
    with pytest.raises(RecordingError, match=r"data\[:\]\) has 2 values per sample for 1 joints"):
        read_recording(path, found)


def test_a_clock_without_a_number_is_a_clear_error(log, machine):
    with pytest.raises(RecordingError, match="column 't' contains no time stamp"):
        read_recording(log("t,i_motor,n_motor\nnan,1,2\n,2,3\n"), machine())


def test_columns_of_different_lengths_for_one_channel_are_refused_in_one_line(tmp_path, machine):
    columns = {name: Column(name, np.arange(count)) for name, count in {"t": 5.0, "a": 5.0, "b": 4.0}.items()}
    sources = (ChannelSource("position", columns=("a", "b"), keys=("a", "b"), factor=(1.0, 1.0), unit="rad"),)
    mapped = ChannelMap(TimeSource(column="t", key="t"), sources, ("one", "two"))
    with pytest.raises(RecordingError, match=r"channel 'position' .* has 4 values, its clock 5"):
        assemble_recording(Source(tmp_path / "log.mat", "mat", columns), mapped, machine().machine, "digest")
