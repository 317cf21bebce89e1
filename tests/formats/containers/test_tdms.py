from __future__ import annotations

import numpy as np
import pytest

from cdtool.formats.channels.reading import survey
from tests.base.findings.facts import fact_of

nptdms = pytest.importorskip("nptdms")


def channel(group, name, data, **properties):
    return nptdms.ChannelObject(group, name, data, properties=properties)


@pytest.fixture
def saved(tmp_path):
    def save(*segments):
        path = tmp_path / "log.tdms"
        with nptdms.TdmsWriter(str(path)) as writer:
            for objects in segments:
                writer.write_segment(objects)
        return path

    return save


def test_a_waveforms_increment_is_its_clock_and_its_unit_is_read(saved):
    start = np.datetime64("2025-03-04T05:06:07.5", "us")
    path = saved(
        [
            channel(
                "m", "i", np.arange(5.0), wf_increment=0.01, wf_start_offset=0.5, wf_start_time=start, unit_string="A"
            ),
            channel("m", "F", np.arange(9.0), wf_increment=0.001, wf_start_time=start + np.timedelta64(250_000, "us")),
        ]
    )
    source = survey(path)
    assert source.columns["i"].unit == "A"
    np.testing.assert_allclose(source.columns["i"].time, 0.25 + 0.01 * np.arange(5), rtol=1e-15)
    np.testing.assert_allclose(source.columns["F"].time, 0.001 * np.arange(9), rtol=1e-15)
    assert source.origin == (start - np.datetime64(0, "s")) / np.timedelta64(1, "s") + 0.25


def test_segments_are_joined_and_equal_names_in_two_groups_are_distinguished(saved):
    parts = [[channel("a", "v", np.arange(3.0) + 3 * k), channel("b", "v", np.arange(2))] for k in range(3)]
    source = survey(saved(*parts))
    assert source.columns["a/v"].values.tolist() == list(range(9)) and len(source.columns["b/v"].values) == 6


def test_texts_and_time_stamps_are_named_and_left_out(saved):
    stamps = np.array(["2025-01-01", "2025-01-02"], dtype="datetime64[us]")
    source = survey(
        saved([channel("m", "word", ["a", "b"]), channel("m", "when", stamps), channel("m", "v", np.ones(3))])
    )
    assert list(source.columns) == ["v"]
    facts = [fact_of(finding) for finding in source.findings]
    assert ("column_left_out", {"column": "word", "what": "not numeric"}) in facts
    assert ("column_left_out", {"column": "when", "what": "of time stamps"}) in facts


def test_the_complete_part_of_a_cut_file_is_read_and_the_loss_is_reported(saved):
    data = np.random.default_rng(1).normal(size=1000)
    path = saved(*[[channel("m", "v", data[k : k + 100])] for k in range(0, 1000, 100)])
    whole = path.read_bytes()
    for cut in (len(whole) - 8, len(whole) - 400, len(whole) // 2):
        path.write_bytes(whole[:cut])
        source = survey(path)
        values = source.columns["v"].values
        assert 400 <= len(values) < 1000 and values.tobytes() == data[: len(values)].tobytes()
        assert any(finding.severity == "loss" for finding in source.findings), cut


START = np.datetime64("2025-03-04T05:06:07.5", "us")


def test_a_clock_with_its_own_start_is_not_shifted_and_is_reported(saved):
    path = saved(
        [
            channel("a", "i", np.arange(5.0), wf_increment=0.01, wf_start_time=START),
            channel("b", "time", np.arange(5.0) / 1000.0, unit_string="s"),
            channel("b", "F", np.arange(5.0)),
        ]
    )
    source = survey(path)
    assert source.columns["F"].time.tolist() == [0.0, 0.001, 0.002, 0.003, 0.004]
    assert ("no_start_time", {"channels": ("F",)}) in [fact_of(finding) for finding in source.findings]
