"""Blank lines in tables: with one column each is a missing sample, so that the time is not shortened."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cdtool.base.findings import lines_of
from cdtool.formats.channels.reading import read_recording
from cdtool.formats.csv import Csv
from cdtool.formats.pieces import join_pieces
from tests.base.findings.facts import fact_of

RATE = '[channels]\ntime = { rate_hz = 100.0 }\nspeed = { column = "x", unit = "rad/s" }\n'


def facts_of(source, severity: str) -> list[tuple]:
    return [fact_of(finding) for finding in source.findings if finding.severity == severity]


def test_a_blank_line_in_one_column_is_a_missing_sample_with_its_time(log, machine):
    recording = read_recording(log("x\n1.5\n2.5\n\n3.5\n4.5\n"), machine(RATE))
    assert recording["speed"].time.tolist() == [0.0, 0.01, 0.02, 0.03, 0.04]
    assert np.isnan(recording["speed"].values[:, 0]).tolist() == [False, False, True, False, False]
    assert ("blank_rows", lines_of((4,))) in facts_of(recording, "warning")
    assert facts_of(recording, "loss") == []


def test_if_every_other_line_is_blank_it_only_separates_the_rows(log):
    source = Csv().columns(log("x\n" + "".join(f"{i}.5\n\n" for i in range(9))))
    assert source.columns["x"].values.tolist() == [i + 0.5 for i in range(9)]
    assert facts_of(source, "note") == [("blank_lines", lines_of(tuple(range(3, 18, 2))))]


def test_a_blank_line_in_several_columns_is_not_a_row(log):
    source = Csv().columns(log("t;x\n0;1.5\n\n1;2.5\n"))
    assert source.columns["x"].values.tolist() == [1.5, 2.5] and facts_of(source, "note") == [
        ("blank_lines", lines_of((3,)))
    ]


def test_a_blank_line_in_a_column_of_times_is_a_missing_stamp(log):
    source = Csv().columns(log("t\n12:00:01\n\n12:00:03\n12:00:04\n"))
    assert np.array_equal(source.columns["t"].values, [43201, np.nan, 43203, 43204], equal_nan=True)


@pytest.mark.parametrize("end", ["\n", "\n\n", "\n\n\n", "\n \t\n", "", "\n  "], ids=repr)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_blank_lines_at_the_end_are_not_samples(log, end, encoding):
    source = Csv().columns(log(("x\n1.25\n\n2.25\n3.25" + end).encode(encoding)))
    assert np.array_equal(source.columns["x"].values, [1.25, np.nan, 2.25, 3.25], equal_nan=True)


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(
    lines=st.lists(st.sampled_from(["", " ", "\t"]) | st.integers(-99, 99).map(lambda x: f"{x}.5"), max_size=60),
    end=st.sampled_from(["\n", "\r\n", "\r"]),
    blocks=st.sampled_from([16, 64, 1 << 20]),
)
def test_every_line_between_the_first_and_the_last_number_is_a_sample(tmp_path, monkeypatch, lines, end, blocks):
    lines = ["0.5", "1.5", *lines, *(["2.5"] * (len(lines) + 2))]  # fewer than half of them are blank
    path = tmp_path / "log.csv"
    path.write_bytes(end.join(["x", *lines, ""]).encode())
    monkeypatch.setattr("cdtool.formats.csv.text.BLOCK_BYTES", blocks)
    truth = [float(line) if line.strip() else np.nan for line in lines]
    for source in (Csv().columns(path), join_pieces(Csv().pieces(path), sort=False)):
        assert np.array_equal(source.columns["x"].values, truth, equal_nan=True)
        assert source.first_row == 2
