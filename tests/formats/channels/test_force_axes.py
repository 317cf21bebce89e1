"""The axes of a force from columns and topics: mapped, on one clock, masked and named axis by axis."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import ConfigurationError, RecordingError
from cdtool.commands.convert.converting import convert
from cdtool.formats.channels.reading import read_as_logged
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


def test_each_axis_has_its_scale(tmp_path):
    vector = 'force = { columns = ["fx", "fy", "fz"], unit = "V", scale = [10.0, 20.0, -5.0] }'
    assert read(tmp_path, vector, table())["force"].values[3].tolist() == [30.0, -120.0, -80.0]


def test_an_axis_in_another_unit_is_named(tmp_path):
    recording = read(tmp_path, VECTOR, table("t,v,fx [N],fy [kN],fz [N]").replace("t,v,", "t,v,"))
    (found,) = [fact_of(item) for item in recording.findings if item.kind == "unit_contradicted"]
    assert (found.numbers["header"], found.numbers["stated"]) == ("fy [kN]", "N")


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


@pytest.mark.parametrize(
    ("force", "said"),
    [
        ('topics = ["/a", "/b"], fields = ["x", "y"]', "force.topics: unknown key"),
        ('topic = "/a", field = "x", fields = ["x", "y"]', "cannot be combined with 'field'"),
        ('topic = "/a", fields = ["x", "x"]', "an axis twice"),
        ('fields = ["x", "y"]', "force.topic: is missing"),
    ],
)
def test_wrong_fields_of_a_vector_name_their_key(tmp_path, force, said):
    (tmp_path / "machine.toml").write_text(f"{AXIS}{MCAP}force = {{ {force} }}\n", encoding="utf-8")
    with pytest.raises(ConfigurationError, match=said):
        read_machine_file(tmp_path / "machine.toml")


def test_a_whole_array_is_no_axis(tmp_path):
    text = f'{AXIS}{MCAP}force = {{ topic = "/cell", fields = ["data[:]"] }}\n'
    (tmp_path / "machine.toml").write_text(text, encoding="utf-8")
    with pytest.raises(ConfigurationError, match="a whole array"):
        read_machine_file(tmp_path / "machine.toml")


def test_axes_with_clocks_of_their_own_are_refused(tmp_path):
    (tmp_path / "machine.toml").write_text(f"{AXIS}{COLUMNS}{VECTOR}\n".replace('"t"', '"time"'), encoding="utf-8")
    with h5py.File(tmp_path / "log.h5", "w") as file:
        for group, names, rate in (("a", ("v", "fx", "fy"), 100.0), ("b", ("fz",), 50.0)):
            file[f"{group}/time"] = np.arange(40) / rate
            file[f"{group}/time"].attrs["unit"] = "s"
            for name in names:
                file[f"{group}/{name}"] = np.arange(40.0)
    text = (tmp_path / "machine.toml").read_text(encoding="utf-8")
    for name, group in (("v", "a"), ("fx", "a"), ("fy", "a"), ("fz", "b")):
        text = text.replace(f'"{name}"', f'"{group}/{name}"')
    (tmp_path / "machine.toml").write_text(text, encoding="utf-8")
    with pytest.raises(RecordingError, match=r"'a/fx' and 'b/fz' of channel 'force' have different clocks"):
        read_as_logged(tmp_path / "log.h5", read_machine_file(tmp_path / "machine.toml"))
