"""Runs are found by their ids, or where the clock starts again; single stray rows are no new run."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.formats.channels.run_segments import segments_by_id, segments_by_reset

NAN = float("nan")


def spans(segments) -> list[tuple[int, int]]:
    return list(zip(segments.start.tolist(), segments.stop.tolist(), strict=True))


def names(segments) -> list[str]:
    return segments.names(np.arange(len(segments)))


@given(st.lists(st.tuples(st.sampled_from([0.0, 1.0, 2.5, -3.0, NAN]), st.integers(1, 5)), max_size=12))
def test_every_sample_with_an_id_is_in_exactly_one_run_which_has_this_id(parts):
    ids = np.array([value for value, count in parts for _ in range(count)])
    for bridged in (True, False):
        found = segments_by_id(ids, {}, bridged)
        taken = np.full(len(ids), -1)
        for run, (start, stop) in enumerate(spans(found)):
            assert start < stop and np.all(taken[start:stop] == -1)
            taken[start:stop] = run
            inside = ids[start:stop]
            assert np.all(np.isnan(inside) | (inside == found.ids[run])) and inside[0] == inside[-1] == found.ids[run]
            assert bridged or not np.isnan(inside).any()
        assert np.all((taken >= 0) | np.isnan(ids))
        if bridged:
            assert np.all(found.ids[1:] != found.ids[:-1])
        assert len(set(names(found))) == len(found)


def test_texts_that_would_have_the_same_name_have_names_of_their_own():
    words = {-1.0: "A", -2.0: "A/2", -3.0: " A_2", -4.0: "..\\A"}
    assert names(segments_by_id(np.array([-2.0, -3.0, -4.0]), words, True)) == ["A_2", "A_2/2", ".._A"]
    assert names(segments_by_id(np.array([-1.0, -2.0, -1.0, -2.0]), words, True)) == ["A", "A_2", "A/2", "A_2/2"]


@settings(max_examples=40)
@given(
    st.lists(st.integers(8, 120), min_size=1, max_size=6),
    st.floats(-1e3, 1e3),
    st.sampled_from([0.001, 0.004, 1.0]),
    st.integers(0, 2**32 - 1),
)
def test_each_jittered_clock_that_starts_again_at_the_same_stamp_is_one_run(lengths, begin, step, seed):
    rng = np.random.default_rng(seed)
    runs = [begin + step * (np.arange(n) + rng.uniform(-0.3, 0.3, n) * (np.arange(n) > 0)) for n in lengths]
    found = segments_by_reset(np.concatenate(runs))
    ends = np.cumsum(lengths)
    assert spans(found) == list(zip((ends - lengths).tolist(), ends.tolist(), strict=True))
    assert names(found) == [str(k) for k in range(1, len(lengths) + 1)]


@pytest.mark.parametrize("stray", [0.0, 0.5, 70.0, NAN])
def test_single_stray_or_missing_stamps_are_no_new_run(stray):
    stamps = np.arange(400) * 0.01
    stamps[200] = stray
    stamps[300] = stamps[299]
    assert len(segments_by_reset(stamps)) == 1


@pytest.mark.parametrize(("bits", "step"), [(16, 10), (32, 1000000)])
def test_a_counter_that_wraps_is_no_new_run(bits, step):
    assert len(segments_by_reset((np.arange(20000) * step % 2**bits).astype(float))) == 1
