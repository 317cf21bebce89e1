"""LabVIEW's measurement files: text tables with a head of keys and values."""

from __future__ import annotations

import numpy as np
import pytest

import cdtool
from cdtool.errors import RecordingError
from cdtool.findings.tables import NotNumeric, WordsAboveRows
from cdtool.ingest.reading import choose_format, read_recording, survey

HEAD = """LabVIEW Measurement\t
Writer_Version\t2
Reader_Version\t2
Separator\tTab
Decimal_Separator\t.
Multi_Headings\t{headings}
X_Columns\tOne
Time_Pref\tRelative
Operator\tlab
Date\t2024/03/05
Time\t12:00:00.1234567
***End_of_Header***\t
"""
SEGMENT = """\t
Channels\t2\t\t
Samples\t40\t40\t
Date\t2024/03/05\t2024/03/05\t
Time\t12:00:00.1234567\t12:00:00.1234567\t
Y_Unit_Label\tN\tA\t
X_Dimension\tTime\tTime\t
X0\t0.0000000000000000E+0\t0.0000000000000000E+0\t
Delta_X\t0.001000\t0.001000\t
***End_of_Header***\t\t\t
X_Value\tForce\tTorque\tComment
"""
ROWS = "".join(f"{i / 1000:.6f}\t{1.5 * i:.6f}\t{-0.5 * i:.6f}\n" for i in range(40))
MEASUREMENT = HEAD.format(headings="No") + SEGMENT + ROWS


@pytest.mark.parametrize("end", ["\n", "\r\n"], ids=["LF", "CRLF"])
@pytest.mark.parametrize("decimal", [".", ","], ids=["point", "comma"])
def test_a_measurement_file_is_read_by_its_suffix_with_names_units_and_times(log, decimal, end):
    rows = ROWS.replace(".", decimal)
    text = MEASUREMENT.replace("Decimal_Separator\t.", f"Decimal_Separator\t{decimal}").replace(ROWS, rows)
    path = log(text.replace("\n", end), "gate.lvm")
    assert ".lvm" in choose_format(path).suffixes
    source = survey(path)
    assert {key: column.unit for key, column in source.columns.items()} == {
        "X_Value": None,
        "Force": "N",
        "Torque": "A",
    }
    assert source.columns["X_Value"].values.tolist() == [i / 1000 for i in range(40)]
    assert source.columns["Force"].values.tolist() == [1.5 * i for i in range(40)]
    assert np.array_equal(source.columns["Torque"].values, [-0.5 * i for i in range(40)])
    assert isinstance(source.findings[0].fact, WordsAboveRows)


def test_a_comment_after_a_row_is_named_and_left_out(log):
    rows = [f"{row}\t{'gate closed' if i == 3 else ''}\n" for i, row in enumerate(ROWS.splitlines())]
    source = survey(log(MEASUREMENT.replace(ROWS, "".join(rows))))
    assert list(source.columns) == ["X_Value", "Force", "Torque"]
    assert NotNumeric("Comment", 27, "gate closed") in [finding.fact for finding in source.findings]


def test_a_second_heading_is_refused_with_its_line(log):
    path = log(HEAD.format(headings="Yes") + SEGMENT + ROWS + SEGMENT + ROWS, "two.lvm")
    with pytest.raises(RecordingError, match="line 64 has 2 cells, the header has 3"):
        survey(path)


def test_each_channel_has_its_own_clock(log, machine):
    """`X_Columns Multi`: the keys of a channel are above its values, and each channel has a column of times."""
    lines = []
    for line in SEGMENT.splitlines():
        key, *values = line.split("\t")
        lines.append("\t".join([key, *(f"{value}\t" for value in values[:2])]))
    lines[-1] = "X_Value\tforce\tX_Value\tspeed\tComment"
    rows = [f"{i / 1000:.6f}\t{1.5 * i:.6f}\t{i / 250:.6f}\t{-0.5 * i:.6f}" for i in range(40)]
    path = log(HEAD.format(headings="No") + "\n".join([*lines, *rows]) + "\n", "multi.lvm")
    channels = '[channels]\ntime = { column = "time", unit = "s" }\nforce = { column = "force", unit = "N" }\n'
    recording = read_recording(path, machine(channels + 'speed = { column = "speed", unit = "rad/s" }\n'))
    assert recording["force"].time.tolist() == [i / 1000 for i in range(40)]
    assert recording["speed"].time.tolist() == [i / 250 for i in range(40)]
    with pytest.raises(RecordingError, match="column 'speed' is beside the clock 'X_Value#2'"):
        read_recording(
            path, machine(channels.replace('"time"', "0") + 'speed = { column = "speed", unit = "rad/s" }\n')
        )


def test_info_uses_the_first_column_as_the_clock(log):
    info = cdtool.info(log(MEASUREMENT, "gate.lvm"))
    assert info.format == "csv"
    assert [channel.rate_hz for channel in info.channels] == pytest.approx([1000.0] * 3)
