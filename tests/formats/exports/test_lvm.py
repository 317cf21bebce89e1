"""LabVIEW's measurement files: clocks of the channels, segments, marks, and damaged and hostile files."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import cdtool
from cdtool.base.errors import RecordingError
from cdtool.formats.channels.reading import choose_format, read_recording, survey
from cdtool.formats.exports.lvm import Lvm
from tests.base.findings.facts import fact_of
from tests.formats.lvm_files import START_S, Channel, Style, measurement

FORCE = Channel("Force", [1.5 * i for i in range(40)], unit="N")
TORQUE = Channel("Torque", [-0.5 * i for i in range(40)], unit="A")
SLOW = Channel("Temperature", [20.0 + i for i in range(10)], 0.004, unit="Deg C")
CHANNEL_MAP = """[channels]
time = { column = "time", unit = "s" }
force = { column = "Force", unit = "N" }
torque = { column = "Torque", unit = "N m" }
"""
STYLES = {
    "tabs": Style(),
    "line feeds": Style(end="\n"),
    "decimal comma": Style(decimal=","),
    "commas": Style(separator=","),
    "version 1, without a decimal separator": Style(states_decimal=False),
    "a comment": Style(comment="gate closed"),
    "a column of times per channel": Style(x_columns="Multi"),
    "a column of times per channel, decimal comma": Style(x_columns="Multi", decimal=","),
    "no column of times": Style(x_columns="No"),
    "no column of times, decimal comma": Style(x_columns="No", decimal=","),
    "absolute preference with relative times, as LabVIEW writes it": Style(preference="Absolute"),
}


def assert_read(source, *channels):
    assert list(source.columns) == [channel.name for channel in channels]
    for channel in channels:
        column = source.columns[channel.name]
        assert column.values.tolist() == list(channel.values)
        assert column.time == pytest.approx(channel.seconds, abs=1e-12)
        assert column.unit == (channel.unit or None)


@pytest.mark.parametrize("style", STYLES.values(), ids=STYLES)
def test_each_channel_has_its_values_unit_and_times(log, style):
    path = log(measurement(style, [FORCE, TORQUE]), "gate.lvm")
    assert choose_format(path).name == "lvm"
    source = survey(path)
    assert_read(source, FORCE, TORQUE)
    assert source.origin == START_S and not source.findings


def test_the_content_decides_whatever_the_suffix(log):
    assert choose_format(log(measurement(Style(), [FORCE]), "gate.txt")).name == "lvm"
    assert choose_format(log("X_Value\tForce\n" + "".join(f"{i}\t{i}\n" for i in range(9)), "rows.lvm")).name == "csv"


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "latin-1"])
def test_any_encoding_of_text_is_read(log, encoding):
    channel = replace(FORCE, name="Kraft ä²")
    path = log(measurement(Style(), [channel]).encode(encoding), "gate.lvm")
    assert_read(survey(path), channel)


@pytest.mark.parametrize("columns", ["One", "Multi", "No"])
def test_a_channel_of_a_lower_rate_has_its_own_times(log, columns):
    source = survey(log(measurement(Style(x_columns=columns), [FORCE, SLOW]), "gate.lvm"))
    assert_read(source, FORCE, SLOW)
    derived = [("derived_times", {"channels": ("Temperature",)})] if columns == "One" else []
    assert [fact_of(finding) for finding in source.findings] == derived


@pytest.mark.parametrize("columns", ["One", "No"])
def test_packets_without_headings_repeat_the_rows_of_a_slow_channel(log, columns):
    """As LabVIEW appends: in each packet of four rows the slow channel has two values, in its first rows."""
    style = Style(x_columns=columns)
    packets = [
        [
            Channel("Force", [4.0 * p + i for i in range(4)], 0.5, 2.0 * p),
            Channel("Temperature", [20.0 + 2 * p, 21.0 + 2 * p], 1.0, 2.0 * p),
        ]
        for p in range(5)
    ]
    text = measurement(style, packets[0])
    for packet in packets[1:]:
        text += measurement(style, packet).split("Comment\r\n")[1]
    source = survey(log(text, "gate.lvm"))
    assert source.columns["Force"].time.tolist() == [0.5 * i for i in range(20)]
    assert source.columns["Temperature"].time.tolist() == [float(i) for i in range(10)]
    assert source.columns["Temperature"].values.tolist() == [20.0 + i for i in range(10)]


@pytest.mark.parametrize("columns", ["One", "Multi", "No"])
def test_segments_follow_each_other_at_the_times_of_their_heads(log, columns):
    later = [replace(channel, time="12:00:01.75") for channel in (FORCE, TORQUE)]
    style = Style(x_columns=columns, headings="Yes", comment="run")
    source = survey(log(measurement(style, [FORCE, TORQUE], later), "gate.lvm"))
    assert source.columns["Force"].values.tolist() == 2 * FORCE.values
    times = [*FORCE.seconds, *(1.5 + time for time in FORCE.seconds)]
    assert source.columns["Torque"].time == pytest.approx(times, abs=1e-12)
    assert source.details["segments"] == "2" and not source.findings


def test_segments_with_other_channels_give_each_channel_its_own_rows(log):
    later = replace(TORQUE, time="12:00:02.25")
    source = survey(log(measurement(Style(headings="Yes"), [FORCE, TORQUE], [later], [SLOW]), "gate.lvm"))
    assert [len(column.values) for column in source.columns.values()] == [40, 80, 10]
    assert source.columns["Torque"].time[40] == 2.0
    assert np.isfinite(source.columns["Torque"].values).all()


def test_absolute_times_count_from_1904(log):
    first = 3_792_484_800.25  # 2024-03-05 12:00:00.25
    channel = replace(FORCE, first=first, values=[1.0, 2.0, 3.0], step=0.5)
    source = survey(log(measurement(Style(preference="Absolute"), [channel]), "gate.lvm"))
    assert source.origin == START_S
    assert source.columns["Force"].time.tolist() == [0.0, 0.5, 1.0]


def test_a_channel_without_a_date_is_taken_to_begin_with_the_others_and_reported(log):
    """LabVIEW writes an empty time stamp as the evening before 1904, west of Greenwich."""
    undated = replace(TORQUE, date="1903/12/31", time="19:00:00")
    source = survey(log(measurement(Style(x_columns="No"), [FORCE, undated]), "gate.lvm"))
    assert_read(source, FORCE, undated)
    assert [fact_of(finding) for finding in source.findings] == [("start_assumed", {"channels": ("Torque",)})]


def test_a_channel_without_samples_is_left_out_with_a_note(log):
    source = survey(log(measurement(Style(), [FORCE, replace(TORQUE, values=[])]), "gate.lvm"))
    assert_read(source, FORCE)
    assert [fact_of(finding) for finding in source.findings] == [
        ("column_left_out", {"column": "Torque", "what": "empty"})
    ]


def test_more_rows_than_stated_are_all_read_and_fewer_are_a_loss(log):
    """Without headings, LabVIEW states the samples of the first packet only."""
    text = measurement(Style(), [FORCE, TORQUE])
    source = survey(log(text.replace("Samples\t40\t40", "Samples\t10\t10"), "gate.lvm"))
    assert len(source.columns["Force"].values) == 40 and not source.findings
    source = survey(log(text.replace("Samples\t40\t40", "Samples\t100\t100"), "gate.lvm"))
    assert [(fact_of(finding), finding.severity) for finding in source.findings] == [
        (("segment_cut_off", {"line": 24, "stated": 100, "rows": 40}), "loss")
    ]


def test_numbers_that_no_file_can_mean_are_no_error_of_the_program(log):
    text = measurement(Style(), [FORCE, SLOW])
    stated = text.replace("Samples\t40\t10", "Samples\t4000000000000000000000\t10")
    facts = [finding.kind for finding in survey(log(stated, "gate.lvm")).findings]
    assert "segment_cut_off" in facts
    source = survey(log(text.replace("0.000000\t0.000000", "1e999\t0.000000", 1), "gate.lvm"))
    assert len(source.columns["Force"].values) == 39


def test_mapped_channels_keep_their_clocks_for_every_command(log, machine, tmp_path):
    path = log(measurement(Style(), [FORCE, TORQUE, SLOW]), "gate.lvm")
    channels = CHANNEL_MAP.replace('torque = { column = "Torque"', 'torque = { column = "Temperature"')
    recording = read_recording(path, machine(channels))
    assert recording["force"].time == pytest.approx(FORCE.seconds)
    assert recording["torque"].time == pytest.approx(SLOW.seconds)
    info = cdtool.info(path)
    assert info.format == "lvm"
    assert [channel.rate_hz for channel in info.channels] == pytest.approx([1000.0, 1000.0, 250.0])
    assert 'time = { column = "time", unit = "s" }' in cdtool.init(path, tmp_path / "draft.toml").text


def test_a_machine_file_that_names_the_column_of_times_is_followed(log, machine):
    path = log(measurement(Style(), [FORCE, TORQUE]), "gate.lvm")
    recording = read_recording(path, machine(CHANNEL_MAP.replace('"time", unit', '"X_Value", unit')))
    assert recording["force"].time.tolist() == FORCE.seconds
    multi = log(measurement(Style(x_columns="Multi"), [FORCE, SLOW]), "multi.lvm")
    channels = CHANNEL_MAP.replace('"time", unit', "0, unit").replace("Torque", "Temperature")
    with pytest.raises(RecordingError, match="column 'Temperature' is beside the clock 'X_Value#2'"):
        read_recording(multi, machine(channels))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("Separator\tTab", "Separator\tPipe", "states the separator 'pipe', which is not Tab or Comma"),
        ("Decimal_Separator\t.", "Decimal_Separator\t;", "states the decimal separator ';'"),
        ("Channels\t2", "Channels\t1000000000", "has 2 names, but 1000000000 channels are stated above it"),
        ("X_Dimension\tTime\tTime", "X_Dimension\tTime\tFrequency", "x axis of channel 'Torque' is 'Frequency'"),
        ("0.000000\t0.000000", "a\t0.000000", r"line 24 \('a'\) is below the names, but not a row"),
        ("0.010000\t", "x0.010000\t", "line 34"),
    ],
    ids=["separator", "decimal separator", "channels", "dimension", "first row", "a row"],
)
def test_what_contradicts_itself_is_refused_in_one_line(log, machine, old, new, message):
    path = log(measurement(Style(), [FORCE, TORQUE]).replace(old, new, 1), "gate.lvm")
    with pytest.raises(RecordingError, match=message) as caught:
        read_recording(path, machine(CHANNEL_MAP))
    assert len(str(caught.value)) < 400 and "\n" not in str(caught.value)


def test_several_segments_are_read_in_any_encoding(log):
    narrow, wide = (
        survey(log(measurement(Style(headings="Yes"), [FORCE], [FORCE]).encode(encoding), f"{encoding}.lvm"))
        for encoding in ("utf-8", "utf-16")
    )
    assert wide.details["segments"] == "2" and wide.columns.keys() == narrow.columns.keys()
    for name, column in narrow.columns.items():
        assert wide.columns[name].values.tobytes() == column.values.tobytes()


def test_a_head_that_is_cut_off_is_a_loss_of_its_segment_only(log):
    text = measurement(Style(headings="Yes"), [FORCE], [FORCE])
    second = text.rindex("Channels")
    for size in range(second + 10, text.rindex("0.000000\t0.000000"), 40):
        source = survey(log(text[:size], "gate.lvm"))
        assert source.columns["Force"].values.tolist() == FORCE.values
        assert (("last_segment_incomplete", {}), "loss") in [
            (fact_of(found), found.severity) for found in source.findings
        ]


def test_a_row_that_is_cut_off_is_dropped_and_reported(log):
    source = survey(log(measurement(Style(), [FORCE, TORQUE])[:-12], "gate.lvm"))
    assert source.columns["Force"].values.tolist() == FORCE.values[:-1]
    assert {finding.kind for finding in source.findings} == {"last_line_cut", "segment_cut_off"}


def test_words_below_the_rows_are_a_note_and_between_them_an_error(log):
    text = measurement(Style(end="\n"), [FORCE, TORQUE])
    assert [finding.kind for finding in survey(log(text + "stopped\n")).findings] == ["words_below_rows"]
    with pytest.raises(RecordingError, match="'stopped' between the rows"):
        survey(log(text + "stopped\n" + "0.040000\t1.0\t2.0\n"))


def test_words_between_the_rows_of_a_segment_that_is_not_the_last_are_an_error(log):
    later = replace(FORCE, time="12:00:02")
    text = measurement(Style(headings="Yes", end="\n"), [FORCE, TORQUE], [later, TORQUE])
    with pytest.raises(RecordingError, match="line 34 has 1 cell, the header has 4: 'stopped' between the rows"):
        survey(log(text.replace("0.010000\t", "stopped\n0.010000\t", 1), "gate.lvm"))


def test_more_segments_than_any_recording_has_are_refused(log):
    text = measurement(Style(headings="Yes", end="\n"), [replace(FORCE, values=[1.0])])
    segment = text[text.index("Channels") :]
    with pytest.raises(RecordingError, match="more than 10000 segments"):
        survey(log(text + segment * 10_001, "gate.lvm"))


def test_a_file_without_rows_is_refused(log):
    text = measurement(Style(), [FORCE])
    for size in (30, 200, text.index("Channels") + 3, text.index("Comment") + 8):
        with pytest.raises(RecordingError, match=r"gate\.lvm: "):
            survey(log(text[:size], "gate.lvm"))


@settings(max_examples=50, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_any_channels_and_segments_are_read_to_the_bit(log, data):
    numbers = st.integers(-(10**12), 10**12).map(lambda value: value / 1e6)
    columns = data.draw(st.sampled_from(["One", "Multi", "No"]))
    style = Style(
        *data.draw(st.sampled_from(["\t.", "\t,", ",."])),
        columns,
        "Yes",
        end=data.draw(st.sampled_from(["\n", "\r\n"])),
    )
    count, segments = data.draw(st.integers(1, 4)), []
    for second in range(data.draw(st.integers(1, 4))):
        rows = data.draw(st.integers(1, 20))
        values = st.lists(numbers, min_size=rows, max_size=rows)
        segments.append([Channel(f"c{k}", data.draw(values), time=f"12:00:{second:02d}") for k in range(count)])
    source = survey(log(measurement(style, *segments), "gate.lvm"))
    for k in range(count):
        column = source.columns[f"c{k}"]
        assert column.values.tolist() == [value for segment in segments for value in segment[k].values]
        times = [second + time for second, segment in enumerate(segments) for time in segment[k].seconds]
        assert column.time == pytest.approx(times, abs=1e-9)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damaged_bytes_are_read_or_refused_in_one_line(log, data):
    style = Style(x_columns=data.draw(st.sampled_from(["One", "Multi", "No"])), headings="Yes")
    content = bytearray(measurement(style, [FORCE, SLOW], [FORCE, SLOW]).encode())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(content) - 1))
        damage = data.draw(st.sampled_from(["byte", "cut", "remove", "repeat"]))
        if damage == "byte":
            content[at] = data.draw(st.integers(0, 255))
        elif damage == "cut":
            del content[at + 20 :]
        elif damage == "remove":
            del content[at : at + data.draw(st.integers(1, 200))]
        else:
            content[at:at] = content[at : at + 100]
        content = content or bytearray(b"LabVIEW")
    try:
        source = Lvm().columns(log(bytes(content), "gate.lvm"))
    except RecordingError as fault:
        assert "\n" not in str(fault)
    else:
        assert all(len(column.time) == len(column.values) for column in source.columns.values())
