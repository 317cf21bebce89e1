"""[onset] is in seconds and newtons."""

from __future__ import annotations

import pytest

from cdtool.base.errors import ConfigurationError
from cdtool.base.settings import Place, read
from cdtool.commands.judging.named_logs import OnsetTable
from cdtool.truth.onset_rule import OnsetRule


def rule(**values: object) -> OnsetRule:
    place = Place("b.toml", "onset.")
    found = read(OnsetTable, values, place)
    place.finish()
    assert found is not None
    return found.rule


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"hold_s": 0.5}, r"onset\.hold_s: is 0\.5 .give a number from 0 to 0\.1"),
        ({"above_n": 5.0, "back_to_n": 8.0}, "onset.back_to_n: is 8, more than above_n"),
        ({"samples": 3}, r"onset\.samples: unknown key"),
    ],
)
def test_a_wrong_setting_is_named(values, said):
    with pytest.raises(ConfigurationError, match=said):
        rule(**values)
