"""The onset rule on load-cell curves with a known onset."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.base.errors import RecordingError
from cdtool.recordings.recording import Recording, Series
from cdtool.truth.onset import OnsetRule, find_contacts

TIME = np.arange(4000) * 1e-3
GATE_RULE = OnsetRule(above=20.0, back_to=8.0)


def recording(force: np.ndarray, channel: str = "force") -> Recording:
    return Recording("r", "r", ("axis",), {channel: Series(TIME, force, "N")})


def ramp(start: float, slope: float, noise: float = 0.0, offset: float = 0.0, end: float = 9.0) -> np.ndarray:
    rng = np.random.default_rng(1)
    force = slope * np.clip(TIME - start, 0.0, 1.0) * (end > TIME)
    return offset + force + noise * rng.normal(size=len(TIME))


def test_the_onset_is_where_the_force_left_the_lower_level():
    (contact,) = find_contacts(recording(ramp(2.0, 1000.0)), GATE_RULE)
    assert contact.start == pytest.approx(2.0085, abs=6e-4)  # the first sample above 8 N
    assert contact.uncertainty == pytest.approx(0.0005 + 0.0125, abs=6e-4)
    assert contact.peak_force == pytest.approx(1000.0)


@pytest.mark.parametrize("step", [0.05, 1.0, 20.0])
@pytest.mark.parametrize("offset", [0.0, 312.7])
def test_a_flicker_of_one_step_of_a_coarse_load_cell_is_no_contact(step, offset):
    force = np.full(4000, offset)
    force[2000:2010] += step  # the only step: the median noise is 0
    assert find_contacts(recording(force), OnsetRule()) == []
    force[3000:3010] -= step
    assert find_contacts(recording(force), OnsetRule()) == []


@pytest.mark.parametrize("step", [0.05, 1.0, 20.0])
def test_without_noise_a_contact_begins_above_eight_deviations_of_the_rounding(step):
    heights = step * np.floor(np.clip(TIME - 2.0, 0.0, 0.5) * 100.0 + 1e-9)  # a step every 10 ms after 2 s
    (contact,) = find_contacts(recording(heights), OnsetRule())
    assert 8.0 / np.sqrt(12.0) == pytest.approx(2.309, abs=1e-3)
    # Upper level 2.31 steps, first exceeded at 3; lower level 1.15 steps, exceeded where the reading reaches 2.
    assert contact.start == pytest.approx(2.020)
    assert contact.uncertainty == pytest.approx(0.0005 + 0.010)
    assert contact.peak_force == pytest.approx(50 * step)


def test_labels_replace_a_missing_load_cell():
    label = ((TIME > 1.0) & (TIME <= 1.5)).astype(float)
    (contact,) = find_contacts(recording(label, "label"), GATE_RULE)
    assert (contact.start, contact.end) == (pytest.approx(1.001), pytest.approx(1.5))
    assert contact.found_by == "label"


def test_events_mark_the_beginning_of_contacts_and_a_rebound_is_none():
    times = np.array([1.0, 1.2, 5.0, 6.5])
    events = Recording("r", "r", ("a",), {"event": Series(times, np.array([1.0, 1.0, 0.0, 2.0]), "1")})
    contacts = find_contacts(events, GATE_RULE)
    assert [(item.start, item.found_by) for item in contacts] == [(1.0, "event"), (6.5, "event")]


def test_without_any_ground_truth_the_error_says_what_to_map():
    with pytest.raises(RecordingError, match="force"):
        find_contacts(Recording("r", "r", ("a",), {"speed": Series(TIME, TIME, "m/s")}), GATE_RULE)


def test_a_missing_label_does_not_split_a_contact():
    label = ((TIME > 1.0) & (TIME <= 1.5)).astype(float)
    label[1200] = np.nan
    assert len(find_contacts(recording(label, "label"), GATE_RULE)) == 1


def kinds_of(values: np.ndarray) -> list[tuple[str, float, bool]]:
    kinds = ((1.0, "hard"), (2.5, "soft"))
    found = find_contacts(replace(recording(values, "label"), label_kinds=kinds), GATE_RULE)
    return [(item.kind, round(item.start, 3), item.in_progress) for item in found]


def test_a_label_with_kinds_has_a_contact_for_each_stay_at_one_of_its_values():
    values = np.select([(TIME > 1.0) & (TIME <= 1.2), (TIME > 1.2) & (TIME <= 1.4), TIME > 2.0], [1.0, 2.5, 3.0], 0.0)
    assert kinds_of(values) == [("hard", 1.001, False), ("soft", 1.201, False)]


@pytest.mark.parametrize(
    ("label", "kinds"),
    [
        ([(0.9, 1.3, 1.0), (2.9, 3.3, 2.5)], ["hard", "soft"]),
        ([(1.4, 1.6, 1.0), (2.9, 3.3, 2.5)], ["hard", "soft"]),
        ([(1.0, 1.05, 2.5), (1.05, 1.3, 1.0)], ["hard", ""]),
        ([], ["", ""]),
    ],
    ids=["during the contacts", "beside a contact", "the longer one", "no label"],
)
def test_the_contacts_of_a_load_cell_have_the_kinds_of_a_label_channel(label, kinds):
    force = ramp(1.0, 1000.0, end=1.2) + ramp(3.0, 1000.0, end=3.2)
    values = sum((number * ((first <= TIME) & (last > TIME)) for first, last, number in label), np.zeros(len(TIME)))
    both = recording(force)
    both = replace(both, channels={**both.channels, "label": Series(TIME, values, "1")})
    plain = find_contacts(both, GATE_RULE)
    named = find_contacts(replace(both, label_kinds=((1.0, "hard"), (2.5, "soft"))), GATE_RULE)
    assert [item.kind for item in named] == kinds
    assert [replace(item, kind="") for item in named] == plain


def test_behind_many_missing_labels_another_contact_may_have_begun_at_any_time():
    """A program writes nothing while there is no contact."""
    values = np.where(((TIME >= 1.0) & (TIME < 1.3)) | ((TIME >= 2.0) & (TIME < 2.3)), 1.0, np.nan)
    first, second = find_contacts(recording(values, "label"), GATE_RULE)
    assert (first.start, first.end, second.start) == pytest.approx((1.0, 1.299, 2.0))
    assert first.uncertainty == pytest.approx(1.0) and second.uncertainty == pytest.approx(0.701)
    assert not first.in_progress and (first.hole, second.hole) == pytest.approx((1.0, 0.701))
