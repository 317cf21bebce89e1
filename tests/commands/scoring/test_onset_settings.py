"""[onset] is in seconds; settings in samples are converted with a note, or refused with a hint to migrate."""

from __future__ import annotations

import pytest

from cdtool.base.errors import ConfigurationError, UsageError
from cdtool.base.tables import Table
from cdtool.commands.scoring.benchmark_file import migrated_onset, read_onset
from cdtool.truth.onset_rule import OnsetRule


def read(**values: object) -> OnsetRule:
    return read_onset(Table(values, "b.toml", "onset."))


def test_the_default_is_three_milliseconds_and_is_stated_in_time():
    assert read().hold == 0.003
    assert read(above_n=20.0, back_to_n=8.0).described == "load cell above 20 N for 3 ms, followed back to 8 N"


@pytest.mark.parametrize("samples", [1, 3, 9, 100])
def test_samples_are_read_at_1_khz_with_a_hint_to_migrate(samples):
    table = Table({"samples": samples}, "b.toml", "onset.")
    (words,) = migrated_onset(table)
    assert words == f"b.toml: onset.samples: read as hold_s = {samples / 1000:g} (samples at 1 kHz): use hold_s instead"
    assert read_onset(table).hold == pytest.approx(samples * 1e-3)
    assert migrated_onset(Table({"hold_s": 0.003}, "b.toml", "onset.")) == ()


def test_unreadable_settings_are_refused_with_a_hint_to_migrate():
    with pytest.raises(
        ConfigurationError, match=r"onset\.samples: is 200: the onset rule now counts in seconds"
    ) as found:
        read(samples=200)
    assert found.value.hint == "set hold_s, at most 0.1"
    with pytest.raises(ConfigurationError, match=r"onset\.samples: cannot be combined with hold_s"):
        read(samples=3, hold_s=0.003)
    with pytest.raises(ConfigurationError, match=r"onset\.hold_s: is 0.5"):
        read(hold_s=0.5)
    with pytest.raises(UsageError, match="hold is"):
        OnsetRule(hold=float("nan"))
