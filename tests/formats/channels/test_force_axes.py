"""The axes of a force from columns and topics: mapped, on one clock, masked and named axis by axis."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import ConfigurationError, RecordingError
from cdtool.base.findings import Finding
from cdtool.commands.convert.converting import convert
from cdtool.formats.channels.channel_map import ChannelSource
from cdtool.formats.channels.force_axes import on_one_clock
from cdtool.formats.channels.reading import read_as_logged, survey
from cdtool.formats.columns import Column
from cdtool.formats.machine_file import read_machine_file
from cdtool.formats.mcap.write import Stream, write_mcap
from cdtool.recordings.recording import Recording
from tests.base.findings.facts import fact_of

AXIS = '[machine]\ntype = "linear_axis"\ncoordinates = "load"\nload_mass = 10.0\n'
COLUMNS = '[channels]\ntime = { column = "t", unit = "s" }\nspeed = { column = "v", unit = "m/s" }\n'
VECTOR = 'force = { columns = ["fx", "fy", "fz"], unit = "N" }'


def read(folder: Path, force: str, table: str, machine: str = AXIS) -> Recording:
    (folder / "machine.toml").write_text(f"{machine}{COLUMNS}{force}\n", encoding="utf-8")
    (folder / "log.csv").write_text(table, encoding="utf-8")
    return read_as_logged(folder / "log.csv", read_machine_file(folder / "machine.toml")).recording


def table(header: str = "t,v,fx,fy,fz", rows: int = 20) -> str:
    lines = [f"{k / 100:.2f},{0.1 * k:.2f},{k},{-2 * k},{2 * k + 10}" for k in range(rows)]
    return "\n".join([header, *lines]) + "\n"


def test_a_force_of_three_columns_has_an_axis_each(tmp_path):
    force = read(tmp_path, VECTOR, table())["force"]
    assert force.values[3].tolist() == [3.0, -6.0, 16.0]


@pytest.mark.parametrize(
    ("direction", "expected"),
    [('"x"', 3.0), ('"-z"', -16.0), ("[0, 0, -1]", -16.0), ("[3, 4, 0]", -3.0), ("[0.0, -2.0, 0.0]", 6.0)],
)
def test_a_direction_selects_the_component_along_it(tmp_path, direction, expected):
    force = read(tmp_path, VECTOR.replace("}", f", direction = {direction} }}"), table())["force"]
    assert force.joint_count == 1 and force.values[3, 0] == pytest.approx(expected)


def test_an_axis_that_a_direction_does_not_need_may_be_missing(tmp_path):
    text = table().replace("0.03,0.30,3,-6,16", "0.03,0.30,,-6,16").replace("0.05,0.50,5,-10,20", "0.05,0.50,5,-10,")
    force = read(tmp_path, VECTOR.replace("}", ', direction = "z" }'), text)["force"]
    assert force.values[3, 0] == 16.0 and np.isnan(force.values[5, 0])


def test_each_axis_has_its_scale(tmp_path):
    vector = 'force = { columns = ["fx", "fy", "fz"], unit = "V", scale = [10.0, 20.0, -5.0] }'
    assert read(tmp_path, vector, table())["force"].values[3].tolist() == [30.0, -120.0, -80.0]


def test_a_saturated_axis_is_named(tmp_path):
    recording = read(tmp_path, VECTOR.replace("}", ", saturation = [-30.0, 1000.0] }"), table())
    (found,) = [item for item in recording.findings if item.kind == "saturated_values"]
    assert (found.channel, found.numbers["count"]) == ("force fy", 5)


def test_an_axis_in_another_unit_is_named(tmp_path):
    recording = read(tmp_path, VECTOR, table("t,v,fx [N],fy [kN],fz [N]").replace("t,v,", "t,v,"))
    (found,) = [fact_of(item) for item in recording.findings if item.kind == "unit_contradicted"]
    assert (found.numbers["header"], found.numbers["stated"]) == ("fy [kN]", "N")


@pytest.mark.parametrize(
    "machine", [AXIS, AXIS.replace("linear_axis", "rotary_axis").replace("load_mass = 10.0\n", "")]
)
def test_the_number_of_joints_does_not_matter(tmp_path, machine):
    joints = machine + 'joints = ["a", "b"]\n'
    speed = COLUMNS.replace('column = "v", unit = "m/s"', 'columns = ["v", "v"], unit = "UNIT"')
    unit = "rad/s" if "rotary" in machine else "m/s"
    (tmp_path / "machine.toml").write_text(f"{joints}{speed.replace('UNIT', unit)}{VECTOR}\n", encoding="utf-8")
    (tmp_path / "log.csv").write_text(table(), encoding="utf-8")
    recording = read_as_logged(tmp_path / "log.csv", read_machine_file(tmp_path / "machine.toml")).recording
    assert recording["speed"].joint_count == 2 and recording["force"].joint_count == 3


def test_a_log_without_one_axis_has_no_force(tmp_path):
    recording = read(tmp_path, VECTOR, table("t,v,fx,fy,other"))
    assert "force" not in recording
    assert [item.channel for item in recording.findings if item.kind in ("absent_truth", "absent_file")] == ["force"]


@pytest.mark.parametrize(
    ("force", "expected"),
    [
        ('{ columns = ["a", "b", "c", "d"], unit = "N" }', "names 4 axes"),
        ('{ columns = [], unit = "N" }', "columns: is empty"),
        ('{ columns = ["a", "a"], unit = "N" }', "an axis twice"),
        ('{ columns = ["a", "b"], unit = "N", direction = "z" }', "is 'z'"),
        ('{ columns = ["a", "b"], unit = "N", direction = [1.0] }', "has 1 values"),
        ('{ columns = ["a", "b"], unit = "N", direction = [0.0, 0.0] }', "has no length"),
        ('{ columns = ["a", "b"], unit = "N", direction = 3 }', "is 3"),
        ('{ column = "a", unit = "N", direction = "x" }', "several columns"),
        ('{ columns = ["a", "b"], unit = "N", scale = [1.0, 2.0, 3.0] }', "has 3 values"),
    ],
)
def test_a_wrong_vector_is_refused_by_its_key(tmp_path, force, expected):
    (tmp_path / "machine.toml").write_text(f"{AXIS}{COLUMNS}force = {force}\n", encoding="utf-8")
    with pytest.raises(ConfigurationError, match=expected) as fault:
        read_machine_file(tmp_path / "machine.toml")
    assert "channels.force." in str(fault.value)


MCAP = '[channels.mcap]\nspeed = { topic = "/joints", field = "velocity[0]" }\n'
TOPIC = 'force = { topic = "/cell", fields = ["wrench.force.x", "wrench.force.y", "wrench.force.z"] }'


def write_log(folder: Path, axes: FloatArray, time: FloatArray) -> Path:
    speed = Stream("/joints", "sensor_msgs/msg/JointState", time, {"velocity": np.ones((len(time), 1))}, ("axis",))
    fields = {f"wrench.force.{name}": axes[:, k] for k, name in enumerate("xyz")}
    write_mcap(folder / "log.mcap", [speed, Stream("/cell", "geometry_msgs/msg/WrenchStamped", time, fields)])
    return folder / "log.mcap"


@pytest.mark.parametrize(
    "force", ['topic = "/cell", fields = ["wrench.force.y"]', 'topics = ["/cell"], field = "wrench.force.y"']
)
def test_a_single_field_is_a_single_load_cell(tmp_path, force):
    (tmp_path / "machine.toml").write_text(f"{AXIS}{MCAP}force = {{ {force} }}\n", encoding="utf-8")
    axes = np.random.default_rng(0).normal(size=(200, 3))
    log = write_log(tmp_path, axes, np.arange(200) * 5e-3)
    recording = read_as_logged(log, read_machine_file(tmp_path / "machine.toml")).recording
    assert recording["force"].values.tolist() == axes[:, 1:2].tolist()


@pytest.mark.parametrize("also", ["", ', direction = "-z"'])
def test_the_fields_of_a_topic_are_the_axes_and_convert_keeps_them(tmp_path, also):
    time = np.arange(200) * 5e-3
    axes = np.random.default_rng(0).normal(size=(200, 3))
    force = TOPIC.replace(" }", f"{also} }}")
    (tmp_path / "machine.toml").write_text(f"{AXIS}{MCAP}{force}\n", encoding="utf-8")
    log, machine = write_log(tmp_path, axes, time), read_machine_file(tmp_path / "machine.toml")
    found = read_as_logged(log, machine).recording["force"].values
    assert found.tolist() == (-axes[:, 2:] if also else axes).tolist()
    for name in ("new.csv", "new.mcap", "new.parquet"):
        convert(log, tmp_path / name, machine=machine)
        again = read_machine_file(tmp_path / f"{name}.machine.toml")
        assert read_as_logged(tmp_path / name, again).recording["force"].values.tolist() == found.tolist()


def test_an_infinite_value_of_an_axis_of_a_container_with_clocks_names_the_axis(tmp_path):
    axes = np.random.default_rng(0).normal(size=(200, 3))
    axes[7, 1] = np.inf
    (tmp_path / "machine.toml").write_text(f"{AXIS}{MCAP}{TOPIC}\n", encoding="utf-8")
    log = write_log(tmp_path, np.where(np.isinf(axes), 1.0, axes), np.arange(200) * 5e-3)
    convert(log, tmp_path / "new.parquet", machine=read_machine_file(tmp_path / "machine.toml"))
    with h5py.File(tmp_path / "new.h5", "w") as file:
        for name, column in survey(tmp_path / "new.parquet").columns.items():
            file[name] = column.values
            file[name].attrs["unit"] = column.unit or "1"
        file["force y"][7] = np.inf
    again = read_machine_file(tmp_path / "new.parquet.machine.toml")
    (found,) = (
        item for item in read_as_logged(tmp_path / "new.h5", again).recording.findings if item.severity == "loss"
    )
    assert (found.kind, found.channel) == ("infinite_values", "force force y")


def test_each_axis_may_have_a_topic_and_a_clock_of_its_own(tmp_path):
    time = np.arange(200) * 5e-3
    speed = Stream("/joints", "sensor_msgs/msg/JointState", time, {"velocity": np.ones((200, 1))}, ("axis",))
    late = time + 0.002
    streams = [
        Stream(f"/f{name}", "geometry_msgs/msg/WrenchStamped", clock, {"wrench.force.x": 100.0 * clock})
        for name, clock in (("x", time), ("y", late))
    ]
    write_mcap(tmp_path / "log.mcap", [speed, *streams])
    force = 'force = { topics = ["/fx", "/fy"], field = "wrench.force.x" }'
    (tmp_path / "machine.toml").write_text(f"{AXIS}{MCAP}{force}\n", encoding="utf-8")
    recording = read_as_logged(tmp_path / "log.mcap", read_machine_file(tmp_path / "machine.toml")).recording
    series = recording["force"]
    assert series.values[1:, 0] == pytest.approx(100.0 * series.time[1:])
    assert series.values[1:, 1] == pytest.approx(100.0 * (series.time[1:] - 0.003))
    (note,) = [fact_of(item) for item in recording.findings if item.kind == "axes_held"]
    assert note.numbers["age"] == pytest.approx(0.003, abs=1e-6)


@pytest.mark.parametrize(
    ("force", "said"),
    [
        ('topics = ["/a", "/b"], fields = ["x", "y", "z"]', "names 2 topics for 3 fields"),
        ('topics = ["/a", "/b"], topic = "/a", field = "x"', "cannot be combined with 'topic'"),
        ('topic = "/a", field = "x", fields = ["x", "y"]', "cannot be combined with 'field'"),
        ('topics = ["/a", "/a"], field = "x"', "an axis twice"),
        ('fields = ["x", "y"]', "force.topic: is missing"),
    ],
)
def test_wrong_topics_of_a_vector_name_their_key(tmp_path, force, said):
    (tmp_path / "machine.toml").write_text(f"{AXIS}{MCAP}force = {{ {force} }}\n", encoding="utf-8")
    with pytest.raises(ConfigurationError, match=said):
        read_machine_file(tmp_path / "machine.toml")


def test_a_whole_array_is_no_axis(tmp_path):
    text = f'{AXIS}{MCAP}force = {{ topic = "/cell", fields = ["data[:]"] }}\n'
    (tmp_path / "machine.toml").write_text(text, encoding="utf-8")
    with pytest.raises(ConfigurationError, match="a whole array"):
        read_machine_file(tmp_path / "machine.toml")


def source() -> ChannelSource:
    return ChannelSource("force", columns=("a", "b"), factor=(1.0, 1.0), unit="N", keys=("a", "b"))


def test_axes_with_clocks_of_their_own_are_held_and_never_from_the_future():
    slow, fast = np.arange(100) * 0.01, np.arange(1000) * 0.001 + 0.0004
    findings: list[Finding] = []
    column = on_one_clock(source(), [Column("a", fast.copy(), fast), Column("b", slow.copy(), slow)], findings)
    assert column.time is not None and column.time.tolist() == slow.tolist()
    held = column.values[1:, 0]
    assert np.all(held <= slow[1:]) and np.all(held > slow[1:] - 0.0011)
    assert np.isnan(column.values[0, 0])
    (note,) = findings
    assert note.kind == "axes_held" and note.numbers["slowest"] == "b" and note.numbers["age"] == pytest.approx(6e-4)


def test_an_axis_that_pauses_is_missing_and_not_held():
    slow, fast = np.arange(100) * 0.01, np.arange(1000) * 0.001
    kept = (fast < 0.3) | (fast > 0.5)
    axes = [Column("a", fast[kept], fast[kept]), Column("b", slow.copy(), slow)]
    column = on_one_clock(source(), axes, [])
    missing = slow[np.isnan(column.values[:, 0])]
    assert missing[0] == pytest.approx(0.31, abs=0.011) and missing[-1] == pytest.approx(0.5, abs=0.011)


def test_an_axis_without_samples_is_refused():
    time = np.arange(10.0)
    with pytest.raises(RecordingError, match=r"'b' .* has no sample"):
        on_one_clock(source(), [Column("a", time, time), Column("b", time[:0], time[:0])], [])
