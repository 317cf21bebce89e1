"""What a contact adds to a channel, on any clock."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.commands.inject.channel_change import ChannelChange

TIME = np.arange(6) * 0.1
CHANGE = np.array([0.0, 0.0, 0.0, 1.0, 3.0, 2.0])[:, np.newaxis]


def test_nothing_is_added_up_to_the_contact_and_nothing_is_known_after_the_end() -> None:
    change = ChannelChange(TIME, CHANGE, start=0.25)
    np.testing.assert_array_equal(change.at(np.array([0.0, 0.2, 0.25]))[:, 0], np.zeros(3))
    assert np.isnan(change.at(np.array([0.51]))[0, 0])


def test_a_continuous_channel_is_linear_between_the_samples() -> None:
    change = ChannelChange(TIME, CHANGE, start=0.2)
    np.testing.assert_allclose(change.at(np.array([0.3, 0.35, 0.45]))[:, 0], [1.0, 2.0, 2.5])


def test_a_held_channel_changes_only_at_the_samples() -> None:
    change = ChannelChange(TIME, CHANGE, start=0.2, held=True)
    np.testing.assert_allclose(change.at(np.array([0.3 - 1e-12, 0.35, 0.399, 0.4]))[:, 0], [1.0, 1.0, 1.0, 3.0])


@pytest.mark.parametrize("held", [True, False])
def test_no_value_comes_before_its_sample_by_more_than_a_period(held: bool) -> None:
    later = CHANGE.copy()
    later[4:] = 99.0
    first, second = (ChannelChange(TIME, values, 0.2, held) for values in (CHANGE, later))
    before = np.linspace(0.0, 0.3, 31)
    np.testing.assert_array_equal(first.at(before), second.at(before))
