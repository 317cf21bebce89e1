"""`cdtool init` on look-alikes of public logs: the share of channels mapped right, and nothing wrong without a mark."""

from __future__ import annotations

import dataclasses
from collections import Counter

import numpy as np
import pytest

from cdtool.commands.init.drafting import init
from cdtool.formats.channels.reading import read_recording
from cdtool.formats.machine_file import read_machine_file
from tests.commands.init.layouts import LAYOUTS, Truth, sealed, sealed_fourth, sealed_second, sealed_third
from tests.commands.init.layouts.layout import Table, table_layout
from tests.commands.init.layouts.score import score
from tests.commands.init.layouts.variants import is_table, without_each_channel, without_names, written

# Tables that can be read in two ways, with the reason.
REFUSED = {
    "ericc-lacet": "numbers above the rows have another decimal mark",
    "arduino-oscillator-sd": "the last name contains separators: ten names above eight cells",
}
# Few small ones, for tests that run with every change.
QUICK = [layout for layout in LAYOUTS if layout.name in ("german gate", "chinese servo", "odrive", "lift door")]


def test_the_corpus_has_layouts_of_all_machines_with_names_of_their_own():
    assert len(LAYOUTS) >= 40 and len({layout.name for layout in LAYOUTS}) == len(LAYOUTS)
    assert {layout.machine for layout in LAYOUTS} == {"linear axis", "rotary axis", "robot"}
    assert all(layout.source and layout.truth for layout in LAYOUTS)


@pytest.mark.parametrize("layout", QUICK, ids=lambda layout: layout.name)
def test_every_channel_of_a_small_layout_is_mapped(layout, tmp_path):
    done = score(layout, tmp_path, audited=True)
    assert set(done.right) == set(done.expected) and not done.unmarked and not done.fault
    text = (tmp_path / "machine.toml").read_text(encoding="utf-8")
    assert score(layout, tmp_path) == done and (tmp_path / "machine.toml").read_text(encoding="utf-8") == text


def test_nine_of_ten_channels_of_all_layouts_are_mapped_and_nothing_wrong_is_unmarked(tmp_path):
    scores = [score(layout, tmp_path) for layout in LAYOUTS]
    assert {item.name for item in scores if item.fault} == set(REFUSED)
    assert not [text for item in scores for text in item.unmarked]
    right, expected = sum(len(item.right) for item in scores), sum(len(item.expected) for item in scores)
    assert right >= 0.9 * expected


@pytest.mark.parametrize(
    "layouts", [sealed.LAYOUTS, sealed_second.LAYOUTS, sealed_third.LAYOUTS, sealed_fourth.LAYOUTS]
)
def test_the_same_holds_for_layouts_by_somebody_who_had_not_seen_the_guesser(tmp_path, layouts):
    scores = [score(layout, tmp_path) for layout in layouts]
    assert not [text for item in scores for text in item.unmarked]
    right, expected = sum(len(item.right) for item in scores), sum(len(item.expected) for item in scores)
    assert right >= 0.9 * expected


@pytest.mark.parametrize(
    "layouts", [LAYOUTS, sealed.LAYOUTS, sealed_second.LAYOUTS, sealed_third.LAYOUTS, sealed_fourth.LAYOUTS]
)
def test_the_unit_of_no_drafted_channel_is_in_doubt(tmp_path, layouts):
    for layout in (item for item in layouts if item.name not in REFUSED):
        log = written(layout, tmp_path)
        init(log, tmp_path / "machine.toml", force=True)
        found = read_recording(log, read_machine_file(tmp_path / "machine.toml")).findings
        doubted = [item for item in found if item.kind == "unit_contradicted"]
        doubted = [item for item in doubted if item.severity == "loss" or item.channel == "force"]
        assert {item.numbers["advice"] for item in doubted} <= {"confirm"}, (
            layout.name
        )  # a unit that the log does not state


def test_a_missing_channel_is_not_replaced_by_another_one_without_a_mark(tmp_path):
    layouts = [layout for layout in LAYOUTS[::4] if is_table(layout) and layout.name not in REFUSED]
    scores = [score(variant, tmp_path) for layout in layouts for variant in without_each_channel(layout)]
    assert not [(item.name, item.fault or item.unmarked) for item in scores if item.fault or item.unmarked]


def test_without_names_nothing_wrong_is_unmarked(tmp_path):
    layouts = [layout for layout in LAYOUTS[::3] if is_table(layout) and layout.name not in REFUSED]
    scores = [score(without_names(layout), tmp_path) for layout in layouts]
    assert not [(item.name, item.fault or item.unmarked) for item in scores if item.fault or item.unmarked]


@pytest.mark.parametrize("layout", QUICK, ids=lambda layout: layout.name)
def test_every_column_is_mapped_or_listed_exactly_once(layout, tmp_path):
    drafted = init(written(layout, tmp_path), tmp_path / "machine.toml")
    listed = Counter(column for item in drafted.unmapped for column in item.columns)
    assert set(listed.values()) <= {1}
    for column in layout.truth:
        assert (f'"{column}"' in drafted.text.split("# Not mapped")[0]) is (column not in listed)
    assert all(item.why for item in drafted.unmapped)


def small(truths):
    def columns(generator):
        time = np.arange(400) / 100.0
        known = {"t [s]": (Truth("time", unit="s"), time)}
        return {**known, **{name: (truth, values(time)) for name, (truth, values) in truths.items()}}

    return table_layout("small", "a test", "linear axis", columns, Table())


def test_the_score_counts_a_wrong_column_and_its_missing_mark(tmp_path):
    """The truth is wrong here, so the right guess of the tool is what the score must refuse."""
    layout = small(
        {
            "pos [m]": (Truth("", unit="m"), np.sin),
            "vel [m/s]": (Truth("speed", unit="mm/s"), np.cos),
            "state": (Truth("position", unit="m"), lambda time: np.floor(time)),
        }
    )
    done = score(layout, tmp_path)
    assert done.right == ("speed", "time") and not done.missing
    assert [text.split(":")[0] for text in done.wrong] == ["position"]
    assert [text.split(":")[0] for text in done.units] == ["speed"]
    assert {text.split(":")[0] for text in done.unmarked} == {"position", "speed"}


def test_the_score_counts_joints_that_are_left_out(tmp_path):
    layout = small(
        {
            **{f"q{j}": (Truth("position", str(j)), lambda time, j=j: np.sin(j * time)) for j in (1, 2)},
            **{f"qd{j}": (Truth("speed", str(j)), lambda time, j=j: j * np.cos(j * time)) for j in (1, 2)},
            "q_third": (Truth("position", "3"), np.cos),
        }
    )
    done = score(layout, tmp_path)
    assert "speed" in done.right and [text.split(":")[0] for text in done.wrong if "joints" in text] == ["position"]


def test_the_score_accepts_further_channels_of_a_column_and_optional_columns(tmp_path):
    """The position is a set value that may be mapped as a measured one; the current may stay unmapped."""
    layout = small({"pos [m]": (Truth("", unit="m"), np.sin), "strange": (Truth("torque"), np.ones_like)})
    strict = score(layout, tmp_path)
    assert strict.missing == ("torque",) and [text.split(":")[0] for text in strict.wrong] == ["position"]
    accepting = dataclasses.replace(layout, accept={"pos [m]": ("position",), "strange": ("",)})
    done = score(accepting, tmp_path)
    assert done.expected == done.right == ("time",) and not done.missing


def test_the_score_knows_columns_by_their_order_where_the_reader_has_other_names(tmp_path):
    layout = small({"pos [m]": (Truth("position", unit="m"), np.sin)})
    renamed = dataclasses.replace(layout, truth=dict(zip(("A", "B"), layout.truth.values(), strict=True)))
    assert set(score(renamed, tmp_path).right) == {"time", "position"}
