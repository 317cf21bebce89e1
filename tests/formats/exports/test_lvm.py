"""LabVIEW's measurement files are tables; one whose column X_Value is not the clock of all channels is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cdtool.base.errors import RecordingError
from cdtool.formats.channels.reading import choose_format, read_recording, survey
from tests.formats.lvm_files import Channel, Style, measurement

FORCE = Channel("Force", [1.5 * i for i in range(40)], unit="N")
TORQUE = Channel("Torque", [-0.5 * i for i in range(40)], unit="A")
SLOW = Channel("Temperature", [20.0 + i for i in range(10)], 0.004, unit="Deg C")
CHANNEL_MAP = """[channels]
time = { column = "X_Value", unit = "s" }
force = { column = "Force", unit = "N" }
torque = { column = "Torque", unit = "N m" }
"""
STYLES = {
    "tabs": Style(),
    "line feeds": Style(end="\n"),
    "decimal comma": Style(decimal=","),
    "commas": Style(separator=","),
    "version 1, without a decimal separator": Style(states_decimal=False),
    "absolute preference with relative times, as LabVIEW writes it": Style(preference="Absolute"),
}


@pytest.mark.parametrize("style", STYLES.values(), ids=STYLES)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
def test_a_file_is_a_table_with_the_units_of_its_head(log, machine, style, encoding):
    path = log(measurement(style, [FORCE, TORQUE]).encode(encoding), "gate.lvm")
    assert choose_format(path).name == "csv"
    columns = survey(path).columns
    assert [(name, column.unit) for name, column in columns.items()] == [
        ("X_Value", None),
        ("Force", "N"),
        ("Torque", "A"),
    ]
    for channel in (FORCE, TORQUE):
        assert columns[channel.name].values.tolist() == list(channel.values)
    recording = read_recording(path, machine(CHANNEL_MAP))
    assert recording["force"].time == pytest.approx(FORCE.seconds, abs=1e-12)


@pytest.mark.parametrize("names", [["V"], ["N"], ["V", "A"], ["m/s", "Torque"], ["1", "2"], ["Channels", "Samples"]])
@pytest.mark.parametrize("rows", [1, 2, 3, 4, 5, 6, 40, 400])
@pytest.mark.parametrize("x_columns", ["One", "Multi"])
def test_the_names_are_in_the_line_of_x_value_whatever_they_are(log, names, rows, x_columns):
    channels = [Channel(name, [1.5 + i for i in range(rows)], unit="Nm") for name in names]
    source = survey(log(measurement(Style(x_columns=x_columns), channels), "gate.lvm"))
    columns = {name: column for name, column in source.columns.items() if not name.startswith("X_Value")}
    assert {name: column.values.tolist() for name, column in columns.items()} == {
        channel.name: channel.values for channel in channels
    }
    assert {column.unit for column in columns.values()} == {"Nm"}
    assert not source.findings or x_columns == "Multi"


@pytest.mark.parametrize("rows", [3, 40, 20_000])
def test_fewer_rows_than_the_head_states_are_a_loss(log, machine, rows):
    force = replace(FORCE, values=[1.5 * i for i in range(rows)])
    text = measurement(Style(), [force])
    short = text.replace(f"Samples\t{rows}", f"Samples\t{rows + 7}")
    expected = f"the file has {rows} of the {rows + 7} rows that its head states"
    path = log(short, "gate.lvm")
    assert [str(each) for each in survey(path).findings if each.severity == "loss"] == [expected]
    channels = '[channels]\ntime = { column = "X_Value", unit = "s" }\nforce = { column = "Force", unit = "N" }\n'
    recording = read_recording(path, machine(channels))
    assert expected in [str(each) for each in recording.findings]
    for stated in (rows - 1, "", "many"):
        source = survey(log(text.replace(f"Samples\t{rows}", f"Samples\t{stated}"), "gate.lvm"))
        assert not source.findings and len(source.columns["Force"].values) == rows


def test_a_comment_in_the_first_row_is_no_channel(log):
    text = measurement(Style(comment="gate 3, stiff"), [FORCE, TORQUE])
    source = survey(log(text, "gate.lvm"))
    assert list(source.columns) == ["X_Value", "Force", "Torque"]
    assert source.columns["Force"].values.tolist() == FORCE.values


LATER = replace(TORQUE, time="12:00:01")
REFUSED = {
    "another rate": (Style(), [FORCE, replace(TORQUE, step=0.004)], "differ in Delta_X"),
    "another length": (Style(), [FORCE, SLOW], "differ in Samples: 10, 40"),
    "another rate beside its own times": (Style(x_columns="Multi"), [FORCE, SLOW], "differ in Samples"),
    "another start": (Style(), [FORCE, LATER], "differ in Time: 12:00:00.25, 12:00:01"),
    "another first time": (Style(), [FORCE, replace(TORQUE, first=0.5)], "differ in X0"),
    "an unknown start": (Style(), [FORCE, replace(TORQUE, date="1903/12/31")], "differ in Date"),
    "a channel without samples": (Style(), [FORCE, replace(TORQUE, values=[])], "differ in Samples: 0, 40"),
    "no times": (Style(x_columns="No"), [FORCE, TORQUE], "no column of times"),
    "times from 1904": (Style(), [replace(FORCE, first=3_792_484_800.25)], "count from 1904"),
}


@pytest.mark.parametrize(("style", "channels", "reason"), REFUSED.values(), ids=REFUSED)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_times_that_are_not_those_of_all_channels_are_refused(log, style, channels, reason, encoding):
    path = log(measurement(style, channels).encode(encoding), "gate.lvm")
    with pytest.raises(RecordingError, match=reason) as caught:
        survey(path)
    assert "write TDMS" in str(caught.value) and "\n" not in str(caught.value)


def test_an_axis_other_than_time_is_refused(log):
    text = measurement(Style(), [FORCE]).replace("X_Dimension\tTime", "X_Dimension\tFrequency")
    with pytest.raises(RecordingError, match="its x axis is 'Frequency', not Time"):
        survey(log(text, "gate.lvm"))


def test_a_head_that_is_cut_off_is_no_table(log):
    text = measurement(Style(), [FORCE])
    for size in range(30, text.index("X_Value"), 10):
        with pytest.raises(RecordingError, match="its head has no line that begins with X_Value"):
            survey(log(text[:size], "gate.lvm"))


@settings(max_examples=50, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_several_segments_are_refused(log, machine, data):
    style = Style(
        *data.draw(st.sampled_from(["\t.", "\t,", ",."])),
        data.draw(st.sampled_from(["One", "Multi"])),
        "Yes",
        end=data.draw(st.sampled_from(["\n", "\r\n"])),
    )
    names = [f"c{k}" for k in range(data.draw(st.integers(1, 4)))]
    segments = [
        [replace(FORCE, name=name, values=np.arange(rows) / 8.0, time=f"12:00:{second:02d}") for name in names]
        for second, rows in enumerate(data.draw(st.lists(st.integers(1, 20), min_size=2, max_size=4)))
    ]
    path = log(measurement(style, *segments), "gate.lvm")
    channels = '[channels]\ntime = { column = 0, unit = "s" }\nforce = { column = 1, unit = "N" }\n'
    with pytest.raises(RecordingError, match=f"it has {len(segments)} segments .write TDMS"):
        read_recording(path, machine(channels))


def test_a_segment_that_begins_below_the_first_lines_is_seen(log):
    long = [replace(FORCE, values=np.arange(20_000) / 8.0)]
    with pytest.raises(RecordingError, match="it has 2 segments"):
        survey(log(measurement(Style(headings="Yes"), long, [FORCE]), "gate.lvm"))
