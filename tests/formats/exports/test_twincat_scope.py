"""Exports of TwinCAT Scope: every option of the export, each channel on its own clock, damaged and hostile files."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import cdtool
from cdtool.base.errors import RecordingError
from cdtool.formats.channels.reading import choose_format, read_recording, survey
from cdtool.formats.exports.twincat_scope import TwincatScope
from tests.base.findings.facts import fact_of
from tests.formats.scope_exports import START, START_S, Channel, Options, export, ramp, write_export

CHANNELS = [
    Channel("ActPos", "1", ramp(40), "mm"),
    Channel("ActVelo", "1", ramp(40, -0.5, 3.125), "mm/s"),
    Channel("fast", "0.2", ramp(196, 0.0625)),
    Channel("ActTorque", "5", ramp(8, 1.5), "N m"),
]
SORTED = [CHANNELS[2], *CHANNELS[:2], CHANNELS[3]]
CHANNEL_MAP = """[channels]
time = { column = "time", unit = "s" }
position = { column = "ActPos", unit = "mm" }
torque = { column = "ActTorque", unit = "N m" }
"""
VARIANTS = {
    "full header, tabs": Options(),
    "end mark": Options(eof=True),
    "decimal comma": Options(decimal=","),
    "a column of times for each channel": Options(shared=False),
    "a column of times for each channel, decimal comma": Options(shared=False, decimal=","),
    "colons": Options(separator=":"),
    "semicolons": Options(separator=";"),
    "semicolons, decimal comma": Options(separator=";", decimal=","),
    "commas": Options(separator=","),
    "values shifted to the row of their time": Options(interpolation="shift"),
    "gaps filled with the previous value": Options(interpolation="fill"),
    "FILETIME": Options(full_stamps=True),
    "FILETIME, gaps filled": Options(full_stamps=True, interpolation="fill"),
    "names only": Options(keys=("Name",)),
    "no lines about the file": Options(file_block=False),
    "no lines about the file, some keys": Options(file_block=False, keys=("Name", "SampleTime[ms]", "Port")),
    "TwinCAT 2": Options(version=2, shared=False, decimal=",", keys=("Name", "NetId", "Port", "SampleTime[ms]")),
    "line feeds": Options(end="\n"),
    "comments with line ends": Options(comment="(* torque\nscaled in the drive *)"),
}


def assert_read(source, channels, full_stamps=False):
    assert list(source.columns) == [channel.name for channel in channels]
    for channel in channels:
        column = source.columns[channel.name]
        assert column.values.tolist() == list(channel.values)
        assert column.time.tolist() == channel.seconds(full_stamps)


@pytest.mark.parametrize("order", [CHANNELS, SORTED], ids=["as displayed", "sorted by sample time"])
@pytest.mark.parametrize("options", VARIANTS.values(), ids=VARIANTS)
def test_each_channel_has_its_values_and_its_own_times_whatever_the_options(tmp_path, options, order):
    path = write_export(tmp_path / "run.csv", order, options)
    assert choose_format(path).name == "twincat_scope"
    source = survey(path)
    assert_read(source, order, options.full_stamps)
    known = options.full_stamps or options.file_block
    assert source.origin == (START_S if known else 0.0)
    stated = "Unit" in options.keys
    assert [column.unit for column in source.columns.values()] == [c.unit or None if stated else None for c in order]


def test_all_rows_of_a_block_may_end_before_the_last_clock(tmp_path, monkeypatch):
    monkeypatch.setattr("cdtool.formats.csv.text.BLOCK_BYTES", 512)
    channels = [Channel("a", "1", ramp(200)), Channel("b", "2", ramp(20))]
    assert_read(survey(write_export(tmp_path / "run.csv", channels, Options(full_stamps=True))), channels, True)


@pytest.mark.parametrize("digits", [20, 17, 16])
def test_a_stamp_with_another_number_of_digits_than_a_filetime_is_no_time(tmp_path, digits):
    text = export([Channel("a", "1", ramp(20))], Options(full_stamps=True, end="\n"))
    stamp = str(START + 50_000)
    (tmp_path / "run.csv").write_text(text.replace(stamp, f"{stamp}99"[:digits]))
    source = survey(tmp_path / "run.csv")
    assert source.columns["a"].time.tolist() == [i / 1000 for i in range(20) if i != 5]
    assert [fact_of(finding) for finding in source.findings] == [("values_without_time", {"count": 1})]


def test_an_export_separated_by_blanks_is_refused_with_the_option_that_helps(tmp_path):
    path = write_export(tmp_path / "run.csv", SORTED, Options(separator=" "))
    with pytest.raises(RecordingError, match=r"separated by blanks, .*export it again with tabs or semicolons"):
        survey(path)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-be", "latin-1"])
def test_any_encoding_of_text_is_read(tmp_path, encoding):
    channels = [replace(CHANNELS[0], name="Geschwindigkeit [ä²]"), *CHANNELS[1:]]
    path = write_export(tmp_path / "run.csv", channels, Options(decimal=","), encoding)
    assert choose_format(path).name == "twincat_scope"
    assert_read(survey(path), channels)


def test_channels_that_are_mapped_keep_their_own_clocks_for_every_command(tmp_path, machine):
    path = write_export(tmp_path / "run.csv", CHANNELS, Options(decimal=","))
    recording = read_recording(path, machine(CHANNEL_MAP))
    assert recording["position"].time.tolist() == CHANNELS[0].seconds()
    assert recording["torque"].time.tolist() == CHANNELS[3].seconds()
    assert recording.origin == START_S
    rates = {channel.name: channel.rate_hz for channel in cdtool.info(path).channels}
    assert rates == pytest.approx({"ActPos": 1000.0, "ActVelo": 1000.0, "fast": 5000.0, "ActTorque": 200.0})
    assert not cdtool.info(path).findings
    assert 'time = { column = "time", unit = "s" }' in cdtool.init(path, tmp_path / "draft.toml").text


def test_repeated_rows_are_counted_and_equal_values_at_new_times_are_samples(tmp_path):
    channels = [Channel("a", "1", ramp(20)), Channel("b", "4", [1.0] * 5)]
    source = survey(write_export(tmp_path / "run.csv", channels, Options(interpolation="fill")))
    assert_read(source, channels)
    assert [fact_of(finding) for finding in source.findings] == [("repeated_rows", {"count": 15})]


def test_a_sample_time_that_the_clock_contradicts_is_a_warning(tmp_path):
    text = export([Channel("a", "4", ramp(20))], Options(decimal=",")).replace("SampleTime[ms]\t4", "SampleTime[ms]\t2")
    (tmp_path / "run.csv").write_text(text)
    assert ("stated_period_differs", {"stated": 0.002, "step": 0.004}) in [
        fact_of(finding) for finding in survey(tmp_path / "run.csv").findings
    ]


def test_a_time_without_a_value_is_a_missing_sample_and_a_value_without_a_time_is_a_loss(tmp_path):
    lines = export([Channel("a", "1", ramp(20)), Channel("b", "2", ramp(20))], Options(end="\n")).splitlines()
    lines[-3] = "17\t \t34\t4.25"
    lines[-5] = "15\t3.75\t \t3.75"
    (tmp_path / "run.csv").write_text("\n".join(lines) + "\n")
    source = survey(tmp_path / "run.csv")
    assert np.flatnonzero(np.isnan(source.columns["a"].values)).tolist() == [17]
    assert source.columns["a"].time.tolist() == [i / 1000 for i in range(20)]
    assert source.columns["b"].time.tolist() == [i / 500 for i in range(20) if i != 15]
    assert [(fact_of(finding), finding.channel) for finding in source.findings] == [
        (("values_without_time", {"count": 1}), "b")
    ]


def test_words_in_a_channel_leave_it_out_of_a_survey_and_are_an_error_where_it_is_mapped(tmp_path, machine):
    channels = [*CHANNELS, Channel("sState", "5", ramp(8))]
    text = export(channels, Options(shared=False))
    lines = [line + ("\tRUN" if line.count("\t") == 8 else "") for line in text.splitlines()]
    text = "\n".join(
        line.rsplit("\t", 1)[0] + "\tRUN" if line.count("\t") == 9 and line[0].isdigit() else line for line in lines
    )
    (tmp_path / "run.csv").write_text(text + "\n")
    source = survey(tmp_path / "run.csv")
    assert list(source.columns) == [channel.name for channel in CHANNELS]
    assert source.findings[0].kind == "not_numeric"
    with pytest.raises(RecordingError, match="column 'sState': 'RUN' is not a number"):
        read_recording(tmp_path / "run.csv", machine(CHANNEL_MAP.replace("ActTorque", "sState")))


def test_a_truncated_line_is_dropped_and_reported(tmp_path):
    path = write_export(tmp_path / "run.csv", SORTED, Options())
    path.write_bytes(path.read_bytes()[:-6])
    source = survey(path)
    assert source.columns["fast"].values.tolist() == SORTED[0].values[:-1]
    assert [(finding.kind, finding.severity) for finding in source.findings] == [("last_line_cut", "loss")]


def test_an_export_without_columns_of_times_is_refused_with_the_option_that_helps(tmp_path):
    names = "Name\ta\tb\nSampleTime[ms]\t1\t1\nPort\t851\t851\n\n"
    (tmp_path / "run.csv").write_text(names + "".join(f"{i}\t{i + 0.5}\n" for i in range(20)))
    with pytest.raises(RecordingError, match=r"line 5 has 2 cells for 3 names: no columns of times\? .*Timelines"):
        survey(tmp_path / "run.csv")


def test_pinned_lines_are_those_of_a_table(tmp_path, machine):
    path = write_export(tmp_path / "run.csv", CHANNELS[:2], Options(end="\n"))
    lines = 2 + path.read_text().split("\n\n0\t")[0].count("\n")
    channels = CHANNEL_MAP.replace('"time", unit = "s"', '0, unit = "ms"').replace('"ActPos"', "1")
    pins = f"[csv]\nskip_lines = {lines}\nheader = false\n"
    found = read_recording(path, machine(channels.replace('"ActTorque"', "2") + pins))
    assert found["position"].time.tolist() == pytest.approx(CHANNELS[0].seconds())


def test_short_rows_of_many_channels_do_not_fill_the_memory(tmp_path):
    """Each row of two cells has 3,000 missing values: the file would become 5,000 times as large."""
    names = "Name" + "\tx" * 3_000 + "\nSampleTime[ms]" + "\t1" * 3_000 + "\n\n"
    rows = "".join(f"{i}\t1\n" for i in range(1, 15_000))
    (tmp_path / "run.csv").write_text(names + "0" + "\t0" * 3_000 + "\n" + rows)
    with pytest.raises(RecordingError, match="times its size: refused"):
        TwincatScope().columns(tmp_path / "run.csv")


def test_a_head_without_end_is_refused(tmp_path):
    (tmp_path / "run.csv").write_text("Name\ta\nFile\tb\nStarttime of export\t1\n\n" + "Name\t" * (1 << 20))
    with pytest.raises(RecordingError, match="no row of numbers in its first 4 MiB"):
        survey(tmp_path / "run.csv")


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_any_rates_and_values_are_read_to_the_bit(tmp_path, data):
    numbers = st.floats(-1e9, 1e9, allow_nan=False).map(lambda value: round(value, 6) + 0.0)
    periods = data.draw(st.lists(st.sampled_from(["0.05", "0.2", "1", "2.5", "10"]), min_size=1, max_size=5))
    rows = data.draw(st.integers(2, 30))
    channels = [
        Channel(f"c{i}", period, data.draw(st.lists(numbers, min_size=rows, max_size=rows)))
        for i, period in enumerate(periods)
    ]
    separator, decimal = data.draw(st.sampled_from(["\t.", "\t,", ";.", ";,", ",.", ":."]))
    options = Options(
        separator=separator, decimal=decimal, shared=data.draw(st.booleans()), eof=data.draw(st.booleans())
    )
    options = replace(options, full_stamps=data.draw(st.booleans()))
    source = survey(write_export(tmp_path / "run.csv", channels, options))
    assert_read(source, channels, options.full_stamps)


def test_names_without_number_are_refused(tmp_path):
    names = "Name" + "\tx" * 200_000 + "\nSampleTime[ms]" + "\t1" * 200_000 + "\n\n"
    (tmp_path / "run.csv").write_text(names + "0" + "\t0" * 200_000 + "\n1\t1\n")
    with pytest.raises(RecordingError, match="names 200001 columns, more than 16384"):
        TwincatScope().columns(tmp_path / "run.csv")
