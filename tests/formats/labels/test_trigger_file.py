"""Trigger files: the meaning of rows, and no silent misreading."""

from __future__ import annotations

from pathlib import Path

import pytest

from cdtool.base.errors import ConfigurationError
from cdtool.formats.labels.trigger_file import Triggered, TriggerFile, read_triggers

HEADER = "recording,time_s,detector,blind_until_s\n"


def read(folder: Path, text: str | bytes) -> TriggerFile:
    path = folder / "plc.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_triggers(path)


def test_rows_are_alarms_recordings_without_alarms_and_unassessable_sections(tmp_path):
    rows = "a.csv,1.5,gm,\na.csv,2.5,gm,\na.csv,3,gm,4.5\nb.csv,,gm,\nb.csv,0.5,edge,\n"
    given = read(tmp_path, HEADER + rows)
    assert given.rows["gm"] == {"a.csv": Triggered([1.5, 2.5], [(3.0, 4.5)]), "b.csv": Triggered()}
    assert given.rows["edge"] == {"b.csv": Triggered([0.5])}
    assert list(given.rows) == ["gm", "edge"]


def test_without_a_detector_the_file_name_is_used(tmp_path):
    assert list(read(tmp_path, "recording,time_s\na.csv,1\n").rows) == ["plc"]
    assert list(read(tmp_path, "recording,time_s,detector\na.csv,1, \n").rows) == ["plc"]


def test_a_recording_is_named_by_its_path_or_by_a_file_name_that_is_unique(tmp_path):
    given = read(tmp_path, "recording,time_s\nstiff/01.csv,1\n02.csv,2\nsoft/02.csv,3\nother.csv,4\nfree/02.csv,5\n")
    said, strangers = given.assigned({"stiff/01.csv", "soft/02.csv"})
    assert said == {"plc": {"stiff/01.csv": Triggered([1.0]), "soft/02.csv": Triggered([2.0, 3.0])}}
    assert strangers == ["free/02.csv", "other.csv"]


def test_a_file_name_that_fits_several_recordings_is_refused(tmp_path):
    given = read(tmp_path, "recording,time_s\n01.csv,1\n")
    with pytest.raises(ConfigurationError, match=r"'01.csv' fits soft/01.csv, stiff/01.csv") as fault:
        given.assigned({"stiff/01.csv", "soft/01.csv"})
    assert "path" in fault.value.hint
    assert given.assigned({"01.csv", "soft/01.csv"})[0]["plc"] == {"01.csv": Triggered([1.0])}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "line 1: column 'recording' is missing"),
        ("recording\na.csv\n", "line 1: column 'time_s' is missing"),
        ("recording,time_s,detecter\n", "line 1: unknown column 'detecter'"),
        ("recording:time_s\na.csv:1\n", "line 1: unknown column 'recording:time_s'"),
        ("recording,time_s,time_s\na.csv,1,2\n", "line 1: column 'time_s' is repeated"),
        ("recording,time_s\n", "contains no row"),
        ("recording,time_s\na.csv,1\n\n,2\n", "line 4: no recording is named"),
        ("recording,time_s\na.csv,6,123\n", "line 2: 3 cells under 2 columns"),
        ("recording,time_s\na.csv\n", "line 2: 1 cell under 2 columns"),
        ("recording,time_s\na.csv,soon\n", "line 2: time_s is 'soon'"),
        ("recording,time_s\na.csv,nan\n", "line 2: time_s is 'nan'"),
        ("recording,time_s\na.csv,1e999\n", "line 2: time_s is '1e999'"),
        (HEADER + "a.csv,2,gm,1\n", "line 2: blind from 2 until 1"),
        (HEADER + "a.csv,,gm,1\n", "line 2: blind_until_s is 1, time_s is missing"),
        ('recording,time_s\n"a.csv,1\n', "not a trigger file: damaged at line 2"),
        (b"\x00\xff\xfe\x01\x02", "not a trigger file: not text"),
        (b"\x89PNG\r\n\x1a\n\x00\x00", "not a trigger file"),
    ],
)
def test_a_wrong_file_is_refused_with_its_line(tmp_path, text, said):
    with pytest.raises(ConfigurationError, match=said) as fault:
        read(tmp_path, text)
    assert "plc.csv" in fault.value.message and fault.value.hint
