"""Every unusual table is read exactly, or refused in one line; skipped and lost lines are reported."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from cdtool.base.errors import RecordingError
from cdtool.base.settings import Place
from cdtool.formats.channels.channel_map import ChannelMap, TimeSource
from cdtool.formats.csv import Csv
from cdtool.formats.csv_dialect.pins import read_pins
from tests.formats.csv_cases import Case, cases

SEEDS = (1, 2, 3)
NAMES = [case.name for case in cases(0)]


def pinned(case: Case, names: list[str]) -> ChannelMap | None:
    """Return a channel map of all columns with the pins of the case; None without pins."""
    if not case.pins:
        return None
    from cdtool.formats.channels.channel_map import ChannelSource

    pins = read_pins(tomllib.loads(case.pins), Place("machine.toml", "csv."))
    sources = tuple(ChannelSource(f"c{i}", (name,)) for i, name in enumerate(names[1:]))
    return ChannelMap(TimeSource(column=names[0]), sources, ("axis",), pins=pins)


def read(case: Case, folder):
    path = folder / "log.csv"
    path.write_bytes(case.content)
    names = list(case.columns or {"t": [], "a": [], "b": []})
    return Csv().columns(path, pinned(case, names))


def check(case: Case, folder) -> None:
    if case.columns is None:
        with pytest.raises(RecordingError) as fault:
            read(case, folder)
        assert case.words in str(fault.value)
        assert "\n" not in str(fault.value) and fault.value.message.startswith(str(folder / "log.csv"))
        return
    source = read(case, folder)
    assert list(source.columns) == list(case.columns)
    for name, truth in case.columns.items():
        assert np.array_equal(source.columns[name].values, truth, equal_nan=True), name
    kinds = {finding.kind for finding in source.findings}
    assert not case.kind or kinds & set(case.kind.split(" or "))


def test_there_are_at_least_eighty_cases_with_unique_names():
    assert len(set(NAMES)) == len(NAMES) >= 80


@pytest.mark.parametrize("number", range(len(NAMES)), ids=NAMES)
def test_a_case_is_read_as_expected_or_refused(tmp_path, number):
    for seed in SEEDS:
        check(cases(seed)[number], tmp_path)
