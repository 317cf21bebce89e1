"""Traces: stored data, selection of operations, and the file next to results.json."""

from __future__ import annotations

import gzip
from dataclasses import replace

import numpy as np
import pytest

from cdtool.base.errors import RecordingError
from cdtool.recordings.recording import Contact, Series
from cdtool.results.traces.choice import MOST_KEPT, TraceChoice
from cdtool.results.traces.file import encode_traces, read_traces
from cdtool.results.traces.trace import Trace, make_trace, rounded
from cdtool.truth.matching import match
from tests.bits import every_value
from tests.results.detections import OPERATION, TIME, detection

CONTACT = Contact(3.0, 3.2, 0.005, 900.0)


def trace(seed: int = 1, why: str = "sample") -> Trace:
    found = detection(seed)
    force = Series(TIME, np.where((TIME > 3.0) & (TIME < 3.2), 900.0, 0.0) + 0.01 * np.sin(40.0 * TIME), "N")
    recording = replace(OPERATION.recording, channels={**OPERATION.recording.channels, "force": force})
    operation = replace(OPERATION, recording=recording)
    matching = match(found.verdict, [CONTACT], found.statistic)
    return make_trace("stiff", operation, [CONTACT], [found], [matching], [["because"]], why)


def test_a_trace_keeps_extremes_the_view_and_the_outcome_of_the_contact():
    kept, found = trace(), detection(1)
    (panel,) = kept.panels
    assert len(panel.course.time) <= 4 * (200 + 250) < len(TIME)
    column = found.statistic.joints.index(panel.joint)
    assert panel.course.value.max() == pytest.approx(found.statistic.values[:, column].max(), rel=1e-4)
    assert kept.view[0] < 3.0 < kept.view[1] and kept.shown == CONTACT
    assert panel.seen[0].outcome == "detected" and panel.seen[0].late == pytest.approx(
        max(panel.seen[0].alarm - 3.0, 0.0)
    )
    assert kept.force.max() == pytest.approx(900.0, abs=0.02) and panel.why == ("because",)


def test_a_trace_is_rounded_within_a_pixel_and_comes_back_from_its_file_as_it_was(tmp_path):
    kept, found = trace(), detection(1)
    path = tmp_path / "results.traces.json.gz"
    path.write_bytes(encode_traces([kept]))
    assert every_value(read_traces(path)) == every_value((kept,))
    (panel,) = kept.panels
    column = found.statistic.joints.index(panel.joint)
    every = found.statistic.values[np.searchsorted(TIME, panel.course.time), column]
    np.testing.assert_allclose(panel.course.value, every, atol=1e-4 * np.ptp(every))


@pytest.mark.parametrize("scale", [1e-300, 1e-12, 1.0, 1e300])
def test_rounded_values_above_a_limit_stay_above_it_and_a_missing_limit_stays_missing(scale):
    value, upper = scale * np.random.default_rng(2).normal(1.0, 1e-3, (2, 500))
    upper[7] = np.nan
    drawn, limit, none = rounded(value, upper, np.full(500, -np.inf))
    assert np.isneginf(none).all() and np.flatnonzero(np.isnan(limit)).tolist() == [7]
    np.testing.assert_allclose(drawn, value, atol=1e-6 * scale)
    assert not np.any((drawn < limit) & (value > upper)) and not np.any((drawn > limit) & (value < upper))


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"not gzip",
        gzip.compress(b"{}", mtime=0),
        gzip.compress(b'{"schema_version": 7, "traces": []}', mtime=0),
    ],
)
def test_an_invalid_traces_file_is_one_clear_error(tmp_path, content):
    path = tmp_path / "t.json.gz"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=r"t\.json\.gz"):
        read_traces(path)


def choose(outcomes: list[tuple[str, float]], work: int | None = None) -> dict[int, str]:
    choice = TraceChoice(work or len(outcomes))
    for number, (striking, slowest) in enumerate(outcomes):
        choice.offer(number, "stiff", 1, striking, slowest)
    return choice.kept()


def test_all_missed_the_slowest_and_a_sample_are_kept_in_order():
    outcomes = [("missed by gm" if i % 500 == 7 else "", float(i % 997)) for i in range(3000)]
    kept = choose(outcomes)
    numbers = list(kept)
    assert numbers == sorted(numbers) and len(kept) <= MOST_KEPT + 1
    assert {7, 507, 1007, 1507, 2007, 2507} <= set(numbers)
    slowest = sorted(range(3000), key=lambda i: -(i % 997))[:3]
    assert set(slowest) <= set(numbers)
    assert sum(why == "evenly sampled from all" for why in kept.values()) == 20
