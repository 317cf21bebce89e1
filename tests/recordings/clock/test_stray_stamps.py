"""A stray time stamp drops only its own row: in a whole clock, piece by piece, and in a log up to the verdict."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import cdtool
from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.recordings.clock import clean_time
from cdtool.recordings.clock.stamps import ClockCleaner

COUNT = 6106
CLOCK = 0.01 * np.arange(COUNT)


def pieces_of(stamps: np.ndarray, cuts: list[int]) -> tuple[np.ndarray, list]:
    cleaner = ClockCleaner()
    times = [cleaner.times(piece, piece) for piece in np.split(stamps, cuts)]
    times.append(cleaner.times(np.empty(0), np.empty(0), final=True))
    return np.concatenate(times), cleaner.findings(0)


@pytest.mark.parametrize("start", [0.0, -3.0, 1.7e9], ids=["from 0", "negative", "epoch"])
@pytest.mark.parametrize("stray", [1e306, 1e9, 1e5, 4294.967295, 75.0])
@pytest.mark.parametrize("row", [0, 1, 2, 3000, COUNT - 3, COUNT - 2])
def test_one_stamp_far_ahead_drops_its_own_row_only(row, stray, start):
    stamps = start + CLOCK
    stamps[row] = start + stray
    clean = clean_time(stamps)
    assert np.flatnonzero(~clean.keep).tolist() == [row]
    assert clean.findings == (
        Finding("stray_stamps", "time", {"count": 1, "rows": COUNT, "first": (row,), "row_name": "sample"}),
    )
    times, findings = pieces_of(stamps, [1, 700, 3001])
    assert np.array_equal(times, clean.time) and tuple(findings) == clean.findings


@pytest.mark.parametrize("row", [0, 1, 3000, COUNT - 1])
@pytest.mark.parametrize("stray", [-1e9, 0.0])
def test_one_stamp_far_behind_an_epoch_drops_its_own_row_only(row, stray):
    stamps = 1.7e9 + CLOCK
    stamps[row] = stray
    assert np.flatnonzero(~clean_time(stamps).keep).tolist() == [row]


def test_samples_after_a_pause_are_kept_and_a_stamp_that_runs_backward_is_dropped_alone():
    paused = CLOCK + np.where(np.arange(COUNT) > 3000, 3600.0, 0.0)
    assert clean_time(paused).keep.all()
    paused[4000] -= 0.5
    assert np.flatnonzero(~clean_time(paused).keep).tolist() == [4000]


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 400), st.data(), st.sampled_from([0.0, 1.7e9]), st.sampled_from([0.0, 0.003]), st.integers(1, 9))
def test_random_jumps_are_cleaned_alike_in_pieces_and_a_row_depends_only_on_the_next_hundred(
    count, data, start, jitter, seed
):
    rng = np.random.default_rng(seed)
    stamps = start + 0.01 * np.arange(count) + jitter * rng.random(count)
    for _ in range(data.draw(st.integers(0, 4)) if count else 0):
        first, rows = data.draw(st.integers(0, count - 1)), data.draw(st.sampled_from([1, 1, 2, 30, 60]))
        stamps[first : first + rows] += data.draw(st.sampled_from([1e306, 1e9, 7.0, 0.05, -0.05, -7.0, np.nan]))
    cuts = sorted(data.draw(st.lists(st.integers(0, count), max_size=6)))
    try:
        whole = clean_time(stamps)
    except RecordingError as fault:
        assert "stands still" in str(fault)
        return
    assert not len(whole.time) or np.all(np.diff(whole.time) > 0.0)
    times, findings = pieces_of(stamps, cuts)
    if any(
        finding.kind == "coarse_clock" for finding in whole.findings
    ):  # only the whole clock is replaced by a straight line
        return
    assert np.array_equal(times, whole.time) and tuple(findings) == whole.findings
    cut = data.draw(st.integers(0, count))
    if 110 < cut < count:
        assert np.array_equal(clean_time(stamps[:cut]).keep[: cut - 101], whole.keep[: cut - 101])


@pytest.mark.parametrize("stamp", ["4294967295", "1e12", "1700000000000"])
@pytest.mark.parametrize("row", [1, 2, 700])
def test_one_stray_stamp_does_not_change_the_verdict(tmp_path, row, stamp):
    """Earlier, 6,104 of 6,106 rows were dropped, and the verdict on the other two was "no alarm"."""
    gate = Path(__file__).parents[3] / "sample_logs" / "gate"
    lines = (gate / "stiff" / "03.csv").read_text().splitlines()
    lines[row] = ",".join([stamp, *lines[row].split(",")[1:]])
    log = tmp_path / "03.csv"
    log.write_text("\n".join(lines) + "\n")
    whole, stray = (
        cdtool.detect(path, gate / "machine.toml", detector="momentum", settings={"threshold.limits": 300})
        for path in (gate / "stiff" / "03.csv", log)
    )
    assert [alarm.time for item in whole.detections for alarm in item.verdict.alarms]
    assert [item.verdict.outcome for item in stray.detections] == ["alarm"]
    times = [[alarm.time for item in found.detections for alarm in item.verdict.alarms] for found in (whole, stray)]
    assert times[1] == pytest.approx(times[0], abs=0.002)
    assert any(item.kind == "stray_stamps" for item in stray.recording.findings)
