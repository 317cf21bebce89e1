"""Label files."""

from __future__ import annotations

import re

import numpy as np
import pytest

from cdtool.base.errors import ConfigurationError, RecordingError
from cdtool.detectors.detection import Alarm, Signal, Verdict
from cdtool.formats.labels.labels import read_labels
from cdtool.recordings.recording import Recording, Series, TableRows
from cdtool.truth.matching import match
from tests.base.findings.facts import fact_of

EPOCH = 1_743_681_600.25  # 2025-04-03T12:00:00.250Z


def write(tmp_path, text: str):
    path = tmp_path / "labels.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_contacts_are_found_by_path_or_by_file_name(tmp_path):
    labels = read_labels(
        write(tmp_path, "recording,start_s,end_s,kind\nsoft/01.csv,1.5,2.0,head\n02.csv,3,3.5,\nfree.csv,,,\n")
    )
    (contact,) = labels.contacts["soft/01.csv"]
    assert (contact.start, contact.end, contact.kind, contact.found_by) == (1.5, 2.0, "head", "label file")
    assert labels.name_of("soft/01.csv") == "soft/01.csv" and labels.name_of("deep/below/02.csv") == "02.csv"
    assert labels.contacts["02.csv"][0].start == 3.0
    assert labels.contacts[labels.name_of("free.csv")] == () and labels.name_of("03.csv") is None


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("recording,start_s\na.csv,1\n", "line 1: column 'end_s' is missing"),
        ("recording,start_s,end_s,knid\n", "unknown column 'knid'.*kind"),
        ("log,start_s,begin,stop\n", "unknown columns 'log', 'begin', 'stop'.*needed: recording, end_s"),
        ("recording,start_s,end_s\na.csv,one,2\n", "line 2: start_s is 'one'"),
        ("recording,start_s,end_s\na.csv,2,1\n", r"line 2: start 2 s, end 1 s \(the end must be after"),
        ("recording,start_s,end_s,uncertainty_s\na.csv,1,2,-1\n", "line 2: uncertainty -1 s"),
        ("recording,start_s,end_s\n", "contains no row.*one per label"),
        ("\n\nrecording,start_s\n", "line 3: column 'end_s' is missing"),
        ("recording,start_s,end_s\n,2,3\n", "line 2: no recording"),
        ("recording,start_s,end_s\na.csv,nan,3\n", "line 2: start_s is 'nan'"),
        ("recording,start_s,end_s\na.csv,1,5,2,0\n", "line 2: 5 cells under 3 columns"),
        ("recording,start_s,end_s\na.csv,1\n", "line 2: 2 cells under 3 columns"),
        ("recording,start_s,end_s,end_s\n", "line 1: column 'end_s' is repeated"),
    ],
)
def test_a_wrong_file_is_one_line_that_names_the_line(tmp_path, text, said):
    with pytest.raises(ConfigurationError) as fault:
        read_labels(write(tmp_path, text))
    assert re.search(said, str(fault.value))


def log(origin: float = 0.0, rows: TableRows | None = None) -> Recording:
    time = np.arange(1000) * 0.01
    return Recording("soft/01.csv", "", ("axis",), {"speed": Series(time, time, "m/s")}, origin=origin, rows=rows)


@pytest.mark.parametrize(
    ("separator", "mark", "encoding"), [(";", ",", "utf-8-sig"), ("\t", ",", "utf-16"), (";", ".", "cp1252")]
)
def test_a_label_file_may_be_written_like_a_log(tmp_path, separator, mark, encoding):
    rows = [
        ["recording", "start_s", "end_s", "kind"],
        ["a.csv", f"1{mark}25", f"1{mark}5", "stoß"],
        ["b.csv", "", "", ""],
    ]
    path = tmp_path / "labels.csv"
    path.write_text("\r\n".join(map(separator.join, rows)), encoding=encoding, newline="")
    (contact,) = (labels := read_labels(path)).contacts["a.csv"]
    assert (contact.start, contact.end, contact.kind, contact.resolution) == (1.25, 1.5, "stoß", 0.01)
    assert labels.contacts["b.csv"] == ()


def test_what_excel_adds_does_not_count_and_a_row_twice_is_one_contact(tmp_path):
    text = "sep=;\r\nrecording;start_s;end_s;;\r\na.csv;1,25;1,5;;\r\n;;;;\r\na.csv;1,25;1,5;;\r\n"
    labels = read_labels(write(tmp_path, text))
    assert [contact.start for contact in labels.contacts["a.csv"]] == [1.25]
    assert labels.lines["a.csv"] == (f"{tmp_path / 'labels.csv'} line 3",)


@pytest.mark.parametrize(
    ("text", "uncertainty"),
    [
        ("start_s,end_s\n1.2530,", 0.005),  # half a sample of the log is more
        ("start_s,end_s\n1.25,", 0.01),
        ("start_s,end_s\n1.250,", 0.005),
        ("start_s,end_s\n2,", 1.0),
        ("start_s,end_s,uncertainty_s\n1.25,,0.002", 0.002),
        ("start_s,end_s,uncertainty_s\n1.25,,0", 0.0),
        ("start_s,end_s,uncertainty_s\n1.25,,", 0.01),
        ("start_ms,end_ms\n1250,", 0.005),
        ("start_ns,end_ns\n1250000000,", 0.005),
        ("start_time,end_time\n1970-01-01T00:00:01,", 1.0),
        ("start_time,end_time\n1970-01-01T00:00:01.25Z,", 0.01),
        ("start_row,end_row\n125,", 0.005),
    ],
)
def test_a_label_is_as_uncertain_as_its_log_or_its_last_digit(tmp_path, text, uncertainty):
    header, row = text.split("\n")
    labels = read_labels(write(tmp_path, f"recording,{header}\n01.csv,{row}\n"))
    (contact,) = labels.contacts_in(log(rows=TableRows(np.arange(1000) * 0.01)))
    assert contact.uncertainty == pytest.approx(uncertainty)
    early = Alarm(contact.start - 0.9 * uncertainty, "axis", "above", 2.0, 1.0)
    time = np.arange(1000) * 0.01
    signal = Signal(time, np.zeros((1000, 1)), np.zeros((1000, 1), dtype=np.uint8), "N")
    matching = match(Verdict("alarm", (early,), crossings=(early,)), [contact], signal)
    assert (matching.matches[0].outcome, matching.matches[0].latency, matching.false_alarms) == ("detected", 0.0, ())


ON_SOURCE = {
    "seconds": ("start_s,end_s", "1743681602.75,1743681603.25"),
    "milliseconds": ("start_ms,end_ms", "1743681602750,1743681603250.0"),
    "microseconds": ("start_us,end_us", "1743681602750000,1743681603250000"),
    "nanoseconds": ("start_ns,end_ns", "1743681602750000000,1743681603250000000"),
    "dates with Z": ("start_time,end_time", "2025-04-03T12:00:02.750Z,2025-04-03T12:00:03.250Z"),
    "dates with a zone": ("start_time,end_time", "2025-04-03T14:00:02.75+02:00,2025-04-03 14:00:03.250000000+0200"),
    "dates without a zone": ("start_time,end_time", "2025-04-03T12:00:02.750,2025-04-03 12:00:03.25"),
    "dates with decimal commas": ("start_time,end_time", '"2025-04-03T12:00:02,750Z","2025-04-03T12:00:03,250Z"'),
}


@pytest.mark.parametrize(("columns", "row"), ON_SOURCE.values(), ids=ON_SOURCE)
def test_a_contact_on_the_clock_of_the_source_is_on_that_of_the_recording(tmp_path, columns, row):
    path = write(tmp_path, f"recording,{columns},kind\n01.csv,{row},hard\n")
    (contact,) = read_labels(path, clock="source").contacts_in(log(EPOCH))
    assert (contact.start, contact.end) == pytest.approx((2.5, 3.0), abs=1e-6)
    assert contact.kind == "hard" and contact.found_by == "label file"


def test_a_date_is_on_the_clock_of_the_source_without_saying_so(tmp_path):
    labels = read_labels(write(tmp_path, "recording,start_time,end_time\n01.csv,2025-04-03T12:00:02.750Z,\n"))
    (contact,) = labels.contacts_in(log(EPOCH))
    assert contact.start == contact.end == pytest.approx(2.5, abs=1e-6)
    assert labels.findings == ()


def test_dates_without_a_zone_are_utc_and_that_is_stated(tmp_path):
    path = write(tmp_path, "recording,start_time,end_time\n01.csv,2025-04-03T14:00:02.750,\n")
    assert [item.kind for item in read_labels(path).findings] == ["labels_without_zone"]
    zoned = read_labels(path, zone="+02:00")
    assert zoned.findings == () and zoned.contacts_in(log(EPOCH))[0].start == pytest.approx(2.5, abs=1e-6)
    with pytest.raises(RecordingError, match="labels_zone"):
        read_labels(path).contacts_in(log(EPOCH))


@pytest.mark.parametrize(
    ("text", "settings", "said"),
    [
        ("start_time,end_time\na,2025-04-03T12:00Z,2025-04-03T12:01", {}, "line 2: a date without a zone, .* has one"),
        ("start_time,end_time\na,2025-04-03,", {}, "line 2: start_time is '2025-04-03'"),
        ("start_time,end_time\na,03.04.2025 12:00:00,", {}, "line 2: start_time is '03.04.2025 12:00:00'"),
        ("start_time,end_time\na,2025-13-03T12:00:00Z,", {}, "start_time is '2025-13-03T12:00:00Z'"),
        ("start_time,end_time\na,1743681602,", {}, "start_time is '1743681602'"),
        ("start_time,end_time\na,2025-04-03T12:00Z,", {"zone": "CEST"}, "labels_zone is 'CEST'"),
        ("start_s,end_s\na,1,2", {"zone": "+02:00"}, "the labels are no dates"),
        ("start_row,end_row\na,1.5,2", {}, "start_row is '1.5'"),
        ("start_row,end_row\na,-1,2", {}, "start_row is '-1'"),
        ("start_row,end_row\na,1234567890123456,", {}, "start_row is '1234567890123456'"),
        ("start_row,end_row\na,1,2", {"clock": "source"}, "the labels count rows"),
        ("start_ms,end_s\na,1,2", {}, "line 1: unknown column 'end_s'"),
        ("start_ms,end_ms\na,1e999999999,2", {}, "start_ms is '1e999999999'"),
        ("start_s,end_s,kind\na,1,2,hard", {"not_contacts": ["hrad"]}, "'hrad', which no label has.*hard"),
    ],
)
def test_a_wrong_time_is_one_line_that_names_it(tmp_path, text, settings, said):
    path = write(tmp_path, f"recording,{text}\n")
    with pytest.raises(ConfigurationError, match=said) as fault:
        read_labels(path, **settings)
    assert len(str(fault.value)) <= 300 + len(str(path)) * 2


def test_rows_are_those_of_the_table_and_the_first_is_0(tmp_path):
    labels = read_labels(write(tmp_path, "recording,start_row,end_row\n01.csv,250,300\n"))
    (contact,) = labels.contacts_in(log(rows=TableRows(np.arange(1000) * 0.01)))
    assert (contact.start, contact.end, contact.uncertainty) == pytest.approx((2.5, 3.0, 0.005))


def test_a_dropped_row_begins_at_the_next_one_and_widens_the_uncertainty(tmp_path):
    labels = read_labels(write(tmp_path, "recording,start_row,end_row\n01.csv,250,999\n"))
    kept = np.ones(1000, dtype=bool)
    kept[245:255] = kept[990:] = False
    (contact,) = labels.contacts_in(log(rows=TableRows((np.arange(1000) * 0.01)[kept], kept)))
    assert (contact.start, contact.end) == pytest.approx((2.55, 9.89))
    assert contact.uncertainty == pytest.approx(0.115)


def test_a_row_outside_the_table_or_in_a_log_without_one_is_named(tmp_path):
    labels = read_labels(write(tmp_path, "recording,start_row,end_row\n01.csv,1000,1001\n"))
    with pytest.raises(RecordingError, match=r"row 1000, soft/01.csv has 1000 rows"):
        labels.contacts_in(log(rows=TableRows(np.arange(1000) * 0.01)))
    with pytest.raises(RecordingError, match="no table with one clock"):
        labels.contacts_in(log())


@pytest.mark.parametrize(("clock", "start"), [("recording", EPOCH + 2.5), ("source", 2.5)])
def test_a_label_on_the_other_clock_is_named_with_the_setting(tmp_path, clock, start):
    labels = read_labels(write(tmp_path, f"recording,start_s,end_s\n01.csv,{start},\n"), clock=clock)
    other = "source" if clock == "recording" else "recording"
    with pytest.raises(RecordingError, match=f'labels.csv line 2.*set labels_clock = "{other}"'):
        labels.contacts_in(log(EPOCH))


def test_kinds_that_are_no_contacts_are_left_out_and_counted(tmp_path):
    path = write(tmp_path, "recording,start_s,end_s,kind\n01.csv,1,2,intended\n01.csv,3,4,hard\n01.csv,5,6,intended\n")
    labels = read_labels(path, not_contacts=["intended"])
    assert [item.start for item in labels.contacts_in(log())] == [3.0]
    assert labels.kinds == ("hard",)
    (note,) = labels.findings
    assert fact_of(note) == ("kinds_excluded", {"count": 2, "kinds": ("intended",)})
