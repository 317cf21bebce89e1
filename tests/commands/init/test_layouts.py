"""`cdtool init` on look-alikes of public logs: the share of channels mapped right, and nothing wrong without a mark."""

from __future__ import annotations

from collections import Counter

import pytest

from cdtool.commands.init.drafting import init
from cdtool.formats.channels.reading import read_recording
from cdtool.formats.machine_file import read_machine_file
from tests.commands.init.layouts import LAYOUTS, SEALED, VENDORS
from tests.commands.init.layouts.score import score
from tests.commands.init.layouts.variants import is_table, without_each_channel, without_names

# Tables that can be read in two ways, with the reason.
REFUSED = {
    "ericc-lacet": "numbers above the rows have another decimal mark",
    "arduino-oscillator-sd": "the last name contains separators: ten names above eight cells",
}
SETS = {"public": LAYOUTS, "vendors": VENDORS, **SEALED}
TABLES = [layout for layout in LAYOUTS if layout.name not in REFUSED and is_table(layout)]
# Few small ones, for tests that run with every change.
QUICK = [layout for layout in LAYOUTS if layout.name in ("german gate", "chinese servo", "odrive", "lift door")]


@pytest.mark.parametrize("layout", QUICK, ids=lambda layout: layout.name)
def test_every_channel_of_a_small_layout_is_mapped(layout, tmp_path):
    done = score(layout, tmp_path, audited=True)
    assert set(done.right) == set(done.expected) and not done.unmarked and not done.fault
    text = (tmp_path / "machine.toml").read_text(encoding="utf-8")
    assert score(layout, tmp_path) == done and (tmp_path / "machine.toml").read_text(encoding="utf-8") == text


@pytest.mark.parametrize("name", SETS)
def test_nine_of_ten_channels_are_mapped_and_nothing_wrong_is_unmarked(tmp_path, name):
    """Also no unit of a drafted channel is in doubt, apart from one that the log does not state."""
    scores = []
    for layout in SETS[name]:
        scores.append(score(layout, tmp_path))
        machine_file = None if scores[-1].fault else read_machine_file(tmp_path / "machine.toml")
        if machine_file and (machine_file.columns.sources or machine_file.topics.sources):
            found = read_recording(layout.log, machine_file).findings
            doubted = [item for item in found if item.kind == "unit_contradicted"]
            doubted = [item for item in doubted if item.severity == "loss" or item.channel == "force"]
            assert {item.numbers["advice"] for item in doubted} <= {"confirm"}, layout.name
    assert {item.name for item in scores if item.fault} == {layout.name for layout in SETS[name]} & REFUSED.keys()
    assert not [text for item in scores for text in item.unmarked]
    right, expected = sum(len(item.right) for item in scores), sum(len(item.expected) for item in scores)
    assert right >= 0.9 * expected


def test_a_missing_channel_is_not_replaced_by_another_one_without_a_mark(tmp_path):
    scores = [score(variant, tmp_path) for layout in TABLES[::4] for variant in without_each_channel(layout, tmp_path)]
    assert not [(item.name, item.fault or item.unmarked) for item in scores if item.fault or item.unmarked]


def test_without_names_nothing_wrong_is_unmarked(tmp_path):
    scores = [score(without_names(layout, tmp_path), tmp_path) for layout in TABLES[::3]]
    assert not [(item.name, item.fault or item.unmarked) for item in scores if item.fault or item.unmarked]


@pytest.mark.parametrize("layout", QUICK, ids=lambda layout: layout.name)
def test_every_column_is_mapped_or_listed_exactly_once(layout, tmp_path):
    drafted = init(layout.log, tmp_path / "machine.toml")
    listed = Counter(column for item in drafted.unmapped for column in item.columns)
    assert set(listed.values()) <= {1}
    for column in layout.truth:
        assert (f'"{column}"' in drafted.text.split("# Not mapped")[0]) is (column not in listed)
    assert all(item.why for item in drafted.unmapped)
