"""Label files."""

from __future__ import annotations

import pytest

from cdtool.errors import ConfigurationError
from cdtool.evaluation.truth.labels import read_labels


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


def test_every_contact_has_its_line_in_the_order_of_time(tmp_path):
    labels = read_labels(write(tmp_path, "recording,start_s,end_s\na.csv,3,4\nfree.csv,,\na.csv,1,2\n"))
    assert [line.rpartition("/")[2] for line in labels.lines["a.csv"]] == ["labels.csv line 4", "labels.csv line 2"]
    assert labels.lines["free.csv"][0].endswith("line 3")


def test_a_byte_order_mark_and_spaces_in_the_header_do_not_matter(tmp_path):
    labels = read_labels(write(tmp_path, "\ufeffrecording, start_s, end_s\na.csv,1,2\n"))
    assert labels.contacts["a.csv"][0].start == 1.0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("recording,start_s\na.csv,1\n", "line 1: column 'end_s' is missing"),
        ("recording,start_s,end_s,knid\n", "unknown column 'knid'.*kind"),
        ("recording,start_s,end_s\na.csv,one,2\n", "line 2: start_s is 'one'"),
        ("recording,start_s,end_s\na.csv,2,1\n", "line 2: start 2 s, end 1 s"),
        ("recording,start_s,end_s\n,2,3\n", "line 2: no recording"),
        ("recording,start_s,end_s\na.csv,nan,3\n", "line 2: start_s is 'nan'"),
        ("recording,start_s,end_s\na.csv,1,5,2,0\n", "line 2: 5 cells under 3 columns"),
        ("recording,start_s,end_s\na.csv,1\n", "line 2: 2 cells under 3 columns"),
        ("recording,start_s,end_s,end_s\n", "line 1: column 'end_s' is repeated"),
    ],
)
def test_a_wrong_file_is_one_line_that_names_the_line(tmp_path, text, said):
    with pytest.raises(ConfigurationError, match=said):
        read_labels(write(tmp_path, text))
