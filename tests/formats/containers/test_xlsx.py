"""Excel workbooks: tables by the rules of text tables, dates, errors, formulas, several sheets, hostile files."""

from __future__ import annotations

import datetime as dt
import math
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.base.errors import RecordingError
from cdtool.formats.channels.reading import choose_format, read_as_logged, survey
from cdtool.formats.containers.xlsx import Xlsx
from cdtool.formats.csv import Csv
from tests.base.findings.facts import fact_of
from tests.command import cdtool

openpyxl = pytest.importorskip("openpyxl")

NOON = dt.datetime(2025, 4, 3, 12)
SHEETS = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"


def save(path: Path, **sheets: list[list]) -> Path:
    workbook = openpyxl.Workbook()
    workbook.remove(workbook.active)
    for name, rows in sheets.items():
        sheet = workbook.create_sheet(name)
        for row in rows:
            sheet.append(row)
    workbook.save(path)
    return path


def replaced_part(path: Path, change) -> Path:
    """Change the XML of the first sheet, as no library writes it."""
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    parts["xl/worksheets/sheet1.xml"] = change(parts["xl/worksheets/sheet1.xml"])
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            archive.writestr(name, content)
    return path


def ramp(rows=30, step=0.01):
    return [[step * i, round(math.sin(0.1 * i), 9)] for i in range(rows)]


def test_a_sheet_is_read_with_its_names_and_the_row_of_units(tmp_path):
    path = save(tmp_path / "log.xlsx", Run=[["Zeit", "Drehmoment"], ["ms", "Nm"], *ramp()])
    source = survey(path)
    assert choose_format(path).name == source.format == "xlsx" and source.names == ("Zeit", "Drehmoment")
    assert [column.unit for column in source.columns.values()] == ["ms", "Nm"]
    assert source.columns["Drehmoment"].values.tolist() == [row[1] for row in ramp()]
    assert source.details == {"sheets": "Run"} and source.first_row == 3


# Decimals of 12 digits: the library that writes this test's files stores 16 digits, Excel 17.
NUMBERS = st.builds(
    lambda digits, power: float(f"{digits}e{power}"), st.integers(-(10**12), 10**12), st.integers(-30, 9)
)


@settings(max_examples=10, deadline=None)
@given(table=st.lists(st.lists(NUMBERS, min_size=3, max_size=3), min_size=2, max_size=9))
def test_numbers_are_read_to_the_bit_as_from_a_text_table(tmp_path_factory, table):
    folder = tmp_path_factory.mktemp("xlsx")
    path = save(folder / "log.xlsx", Run=[["a", "b", "c"], *table])
    text = folder / "log.csv"
    text.write_text("a\tb\tc\n" + "".join("\t".join(map(repr, row)) + "\n" for row in table))
    for name, column in Csv().columns(text).columns.items():
        assert Xlsx().columns(path).columns[name].values.tobytes() == column.values.tobytes()


def test_a_table_opened_with_the_wrong_decimal_mark_is_a_warning(tmp_path):
    """1,234 became 1234, and 1,5 stayed a text."""
    rows = [[0.01 * i, 1234 if i % 5 == 0 else f"1,{i}"] for i in range(20)]
    source = survey(save(tmp_path / "log.xlsx", Run=[["t", "F"], *rows]))
    (finding,) = [finding for finding in source.findings if finding.kind == "numbers_among_texts"]
    assert (finding.channel, finding.severity) == ("F", "warning")
    assert fact_of(finding) == ("numbers_among_texts", {"count": 16, "text": "1,1", "row": 3, "integers": 4})


@pytest.mark.parametrize("epoch", ["1900", "1904"])
def test_dates_are_a_clock_to_the_microsecond(tmp_path, epoch):
    workbook = openpyxl.Workbook()
    workbook.epoch = openpyxl.utils.datetime.CALENDAR_MAC_1904 if epoch == "1904" else workbook.epoch
    sheet = workbook.active
    sheet.append(["Zeit", "F"])
    for i in range(50):
        sheet.append([NOON + dt.timedelta(microseconds=1250 * i), 1.0 * i])
    workbook.save(tmp_path / "log.xlsx")
    # The library writes milliseconds; Excel stores days with all their digits.
    first = (NOON - dt.datetime(1899, 12, 30)).days + 0.5 - (1462 if epoch == "1904" else 0)

    def exact(content: bytes) -> bytes:
        from xml.etree import ElementTree

        root = ElementTree.fromstring(content)
        for i, row in enumerate(root.findall(f".//{{{SHEETS}}}row")[1:]):
            row[0].find(f"{{{SHEETS}}}v").text = repr(first + 1.25e-3 * i / 86400)
        return ElementTree.tostring(root)

    source = survey(replaced_part(tmp_path / "log.xlsx", exact))
    assert source.origin == NOON.replace(tzinfo=dt.UTC).timestamp()
    np.testing.assert_allclose(source.columns["Zeit"].values, 1.25e-3 * np.arange(50), rtol=0.0, atol=1.1e-6)


def test_a_time_of_day_in_any_format_passes_midnight(tmp_path):
    workbook = openpyxl.Workbook()
    workbook.active.append(["t", "F"])
    for i in range(40):
        workbook.active.append([1.0 + (i - 20) / 86400, 1.0 * i])
        workbook.active.cell(i + 2, 1).number_format = "[$-de-DE]hh:mm:ss"
    workbook.save(tmp_path / "log.xlsx")
    steps = np.diff(survey(tmp_path / "log.xlsx").columns["t"].values)
    np.testing.assert_allclose(steps, 1.0, rtol=0.0, atol=1e-5)


def test_cells_with_errors_are_missing_and_counted(tmp_path):
    rows = ramp()
    rows[4][1], rows[6][1] = "#N/A", "#DIV/0!"
    source = survey(save(tmp_path / "log.xlsx", Run=[["t", "F"], *rows]))
    assert np.isnan(source.columns["F"].values[[4, 6]]).all()
    (finding,) = [finding for finding in source.findings if finding.kind == "error_cells"]
    assert finding.channel == "F" and fact_of(finding) == ("error_cells", {"count": 2, "error": "#N/A", "row": 6})


def test_formulas_that_were_never_calculated_are_a_loss(tmp_path):
    rows = ramp()
    rows[4][1] = rows[5][1] = "=A2*2"
    path = save(tmp_path / "log.xlsx", Run=[["t", "F"], *rows])
    (finding,) = [finding for finding in survey(path).findings if finding.severity == "loss"]
    assert (finding.channel, fact_of(finding)) == ("F", ("formulas_without_value", {"count": 2, "row": 6}))

    def calculated(content: bytes) -> bytes:
        assert content.count(b"<v></v>") + content.count(b"<v />") + content.count(b"<v/>") == 2
        for empty in (b"<v></v>", b"<v />", b"<v/>"):
            content = content.replace(empty, b"<v>7.5</v>")
        return content

    source = survey(replaced_part(path, calculated))
    assert source.columns["F"].values[4] == 7.5 and not source.findings


def test_a_sheet_without_rows_of_numbers_is_named(tmp_path):
    source = survey(save(tmp_path / "log.xlsx", Run=[["t [s]", "torque [Nm]"], *ramp()], Notes=[["a hard stop"]]))
    assert list(source.columns) == ["t [s]", "torque [Nm]"]
    assert [finding.numbers["sheet"] for finding in source.findings if finding.kind == "sheet_left_out"] == ["Notes"]


def test_several_sheets_with_rows_of_numbers_are_refused_with_their_names(tmp_path, machine):
    path = save(tmp_path / "log.xlsx", Run=[["t", "v"], *ramp()], Other=[["t", "F"], *ramp(9)])
    mapped = machine('[channels]\ntime = { column = "t", unit = "s" }\nspeed = { column = "v", unit = "rad/s" }\n')
    for read in (lambda: survey(path), lambda: read_as_logged(path, mapped)):
        with pytest.raises(RecordingError, match=r"several sheets contain rows of numbers: 'Run', 'Other' \(save each"):
            read()


def test_the_section_csv_of_a_machine_file_applies(tmp_path, machine):
    rows = [[0.01 * i, "overload" if i == 3 else 1.0 * i] for i in range(20)]
    path = save(tmp_path / "log.xlsx", Run=[["t", "v"], *rows])
    channels = '[channels]\ntime = { column = "t", unit = "s" }\nspeed = { column = "v", unit = "rad/s" }\n'
    with pytest.raises(RecordingError, match=r"log\.xlsx: sheet 'Run': line 5"):
        read_as_logged(path, machine(channels))
    recording = read_as_logged(path, machine(channels + '[csv]\nmissing = ["overload"]\n')).recording
    assert np.isnan(recording["speed"].values[3, 0])


def test_commands_read_a_workbook(tmp_path):
    path = save(tmp_path / "log.xlsx", Run=[["t [s]", "v [m/s]", "F [N]"], *([*row, 0.0] for row in ramp(200))])
    assert "v [m/s]" in cdtool("info", path).out
    assert cdtool("convert", path, tmp_path / "log.csv").status == 0
    assert (tmp_path / "log.csv").read_text().count("\n") > 200
    assert cdtool("init", path, "-o", tmp_path / "machine.toml").status == 0
    assert 'column = "v [m/s]"' in (tmp_path / "machine.toml").read_text()


# --- Damaged and hostile files


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda xml: xml.replace(b'r="20"', b'r="99999999"'), "more than 4096 columns or 1048576 rows: refused"),
        (lambda xml: xml.replace(b'r="B20"', b'r="ZZZ20"'), "more than 4096 columns or 1048576 rows: refused"),
        (lambda xml: xml + bytes(300 * 2**20), "unpacks to 300 MiB"),
        (lambda xml: xml.replace(b"</row>", b"", 1), "damaged or not an Excel workbook"),
        (
            lambda xml: b'<!DOCTYPE x [<!ENTITY a "aaaa">]>' + xml.replace(b"<v>", b"<v>&b;", 1),
            "damaged or not an Excel",
        ),
    ],
    ids=["far row", "far column", "bomb", "broken XML", "unknown entity"],
)
def test_hostile_sheets_are_refused_in_one_line(tmp_path, change, message):
    path = replaced_part(save(tmp_path / "log.xlsx", Run=[["t", "F"], *ramp()]), change)
    with pytest.raises(RecordingError, match=message) as fault:
        Xlsx().columns(path)
    assert "\n" not in str(fault.value) and "cdtool-" not in str(fault.value)


def test_a_wrong_size_in_the_sheet_cuts_nothing_off(tmp_path):
    def smaller(xml: bytes) -> bytes:
        assert b'ref="A1:B31"' in xml
        return xml.replace(b'ref="A1:B31"', b'ref="A1:A5"')

    path = replaced_part(save(tmp_path / "log.xlsx", Run=[["t", "F"], *ramp()]), smaller)
    assert len(survey(path).columns["F"].values) == 30


def test_other_archives_and_a_workbook_without_numbers_are_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / "log.zip", "w") as archive:
        archive.writestr("log.csv", "t,F\n")
    assert not Xlsx().sniff(tmp_path / "log.zip")
    with pytest.raises(RecordingError, match="a ZIP archive"):
        survey(tmp_path / "log.zip")
    with pytest.raises(RecordingError, match="no sheet contains rows of numbers"):
        survey(save(tmp_path / "log.xlsx", Notes=[["a"], ["b"]]))


def test_times_of_day_and_elapsed_times_are_seconds(tmp_path):
    rows = [[dt.time(12, 0, i), dt.timedelta(hours=30, seconds=i), 1.0 * i] for i in range(20)]
    source = survey(save(tmp_path / "log.xlsx", Run=[["clock", "elapsed", "F"], *rows]))
    assert np.diff(source.columns["clock"].values).tolist() == pytest.approx([1.0] * 19, abs=1e-5)
    assert source.columns["elapsed"].values[0] == pytest.approx(108000.0)
