from __future__ import annotations

import os

import numpy as np
import pytest

from cdtool.base.errors import ConfigurationError, RecordingError
from cdtool.formats.channels.reading import choose_format, read_recording, survey
from cdtool.formats.mcap.write import Stream, write_mcap
from tests.data_folder import UR10E_LOGS
from tests.formats.conftest import TOPICS

ROWS = "t,i_motor,n_motor\n" + "".join(f"{10 * i},{i},{i + 1}\n" for i in range(20))


def test_the_first_bytes_determine_the_format_if_the_suffix_is_wrong(log, tmp_path):
    assert choose_format(log(ROWS, "a.mcap")).name == "csv"
    assert choose_format(log(ROWS, "a.log")).name == "csv"
    write_mcap(tmp_path / "b.csv", [Stream("/a", "std_msgs/msg/Float64", np.zeros(1), {"data": np.zeros(1)})])
    assert choose_format(tmp_path / "b.csv").name == "mcap"


@pytest.mark.parametrize(
    ("content", "name", "message"),
    [
        (b"\x89PNG\r\n\x1a\n\0\0", "a.csv", "is not a recording"),
        (b"<!doctype html><p>1,2", "a.csv", "is not a recording: it is HTML or XML"),
        (b"PK\x03\x04\0\0", "a.xlsx", "an Excel workbook"),
        (b"SQLite format 3\0", "a.db3", "an SQLite database"),
        (b'{"a": 1}', "a.json", "it is JSON"),
        (b"ULog\x01\x12\x35\x01" + bytes(8) + b"B", "a.ulg", "it is a ULog file of PX4"),
        (b"MDF     4.10    " + bytes(8) + b"B", "a.mf4", "it is an MDF file"),
        (b"ARROW1\0\0" + bytes(8) + b"B", "a.feather", "it is a Feather file"),
        (b"\x89MCAP", "a.mcap", "is not a recording, nor a complete MCAP file"),
        (bytes(200), "a.dat", "is not a recording"),
        ("a sentence.\nAnd another one.\n".encode("utf-16"), "a.csv", "contains no row of numbers"),
        ("<p>1,2</p>".encode("utf-16"), "a.csv", "is not a recording"),
        (b"\xfe\xff" + '{"a": 1}'.encode("utf-16-be"), "a.json", "is not a recording"),
        ("<p>1,2</p>".encode("utf-32"), "a.csv", "is not a recording"),
        (b"\xff\xfe" + bytes(30), "a.csv", "is not a recording"),
        (ROWS.encode("utf-16")[:90] + b"\x00\xdc" + ROWS.encode("utf-16")[92:], "a.csv", "nor a complete CSV file"),
        ("a sentence.\nAnd another one.\n".encode("utf-16"), "a.mcap", "contains no row of numbers"),
        (b"", "a.csv", "is empty"),
        (b"a sentence.\nAnd another one.\n", "a.txt", "contains no row of numbers"),
    ],
)
def test_a_file_that_is_not_a_recording_is_refused_in_one_line_with_its_name(log, content, name, message):
    path = log(content, name)
    with pytest.raises(RecordingError, match=message) as fault:
        survey(path)
    assert fault.value.message.startswith(f"{path}: ")
    assert fault.value.hint
    assert "\n" not in str(fault.value)


def test_a_folder_a_missing_file_and_a_pipe_are_refused(tmp_path):
    with pytest.raises(RecordingError, match="is a folder"):
        survey(tmp_path)
    with pytest.raises(RecordingError, match="no such file"):
        survey(tmp_path / "none.csv")
    os.mkfifo(tmp_path / "pipe.csv")
    with pytest.raises(RecordingError, match="not a regular file"):
        survey(tmp_path / "pipe.csv")


@pytest.mark.skipif(os.geteuid() == 0, reason="root can read every file")
def test_a_file_without_read_permission_is_refused(log):
    path = log(ROWS)
    path.chmod(0)
    with pytest.raises(RecordingError, match="cannot be read: Permission denied"):
        survey(path)


def test_a_machine_file_without_the_required_section_is_refused_with_its_name(log, tmp_path, machine):
    with pytest.raises(ConfigurationError, match=r"machine\.toml: no channel in \[channels\], which .*log\.csv needs"):
        read_recording(log(ROWS), machine(TOPICS))
    path = tmp_path / "a.mcap"
    write_mcap(path, [Stream("/a", "std_msgs/msg/Float64", np.zeros(1), {"data": np.zeros(1)})])
    with pytest.raises(ConfigurationError, match=r"no channel in \[channels.mcap\]"):
        read_recording(path, machine())


def test_a_six_joint_arm_logged_without_a_header_is_read_by_column_numbers(machine):
    joints = [f"joint{i}" for i in range(1, 7)]
    found = machine(
        f"""
        [channels]
        time = {{ column = 0, unit = "s" }}
        position = {{ columns = {list(range(1, 7))}, unit = "rad" }}
        speed = {{ columns = {list(range(7, 13))}, unit = "rad/s" }}
        torque = {{ columns = {list(range(13, 19))}, unit = "A", scale = [10.0, 10.7, 8.5, 9.0, 9.5, 10.1] }}
        """,
        f'[machine]\ntype = "rotary_axis"\nname = "arm"\ncoordinates = "load"\njoints = {joints}\nload_inertia = 1.0\n',
    )
    recording = read_recording(UR10E_LOGS / "link4.csv.gz", found)
    assert recording["torque"].values.shape == (1896, 6)
    assert recording.joints == tuple(joints)
    assert recording.duration == pytest.approx(19.72, abs=0.05)
    assert recording.start == pytest.approx(3262.867)
