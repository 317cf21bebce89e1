"""[conditions] of a benchmark file: the same detectors on the machine under changed conditions."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

import cdtool
from cdtool.base.errors import ConfigurationError
from cdtool.commands.scoring.benchmark_file import BenchmarkFile, read_benchmark_file
from cdtool.commands.simulate.changed_machine import ChangedMachine
from cdtool.commands.tune.tuned_files import _rebase
from cdtool.execution.store.store import Store
from cdtool.results.changed_conditions import condition_rows
from cdtool.results.files.results_file import to_json
from tests.bits import every_value

HEAD = 'machine = "machine.toml"\ndetectors = ["gm", "pt"]\n'
TABLES = """[learn]
logs = ["free/*.csv"]
[holdout]
logs = ["holdout/*.csv"]
[impacts.stiff]
window_s = 0.8
logs = ["stiff/*.csv"]
[onset]
above_n = 20.0
back_to_n = 8.0
"""
WINTER = """[conditions."friction +40 %"]
holdout.logs = ["winter/holdout/*.csv"]
impacts.stiff = { logs = ["winter/stiff/*.csv"], from = "0.5s" }
"""
FREE, STRUCK = "friction +40 %/holdout", "friction +40 %/stiff"


@pytest.fixture(scope="module")
def gate(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("gate")
    cdtool.simulate_gate(folder, {"free": 12, "holdout": 2, "stiff": 2}, seed=31)
    changed = ChangedMachine(friction=1.4)
    cdtool.simulate_gate(folder / "winter", {"holdout": 2, "stiff": 2}, seed=32, changed=changed)
    return folder


def write(folder: Path, *parts: str, name: str = "b.toml") -> Path:
    file = folder / name
    file.write_text("".join((HEAD, TABLES, *parts)), encoding="utf-8")
    return file


@pytest.fixture
def read(gate):
    def run(*parts: str) -> BenchmarkFile:
        return read_benchmark_file(write(gate, *parts))

    return run


@pytest.fixture(scope="module")
def both(gate):
    return cdtool.benchmark(write(gate, WINTER, name="both.toml"))


def test_friction_raises_alarms_and_delays_the_detection(both):
    rows = {row.detector: row for row in condition_rows(both.evaluated)}
    for row in rows.values():
        assert row.condition == "friction +40 %" and row.changed.missed == (0, 2)
        assert row.changed.alarming == (2, 2) and row.unchanged.alarming == (0, 2)
    changed, before, _ = rows["momentum"].latency("stiff")
    # The signal is outside its limits when the contact begins, which only a later exit detects.
    assert before is not None and changed.value > 2.0 * before.value


def test_the_unchanged_machine_has_the_same_results_as_without_conditions(gate, both):
    alone = cdtool.benchmark(write(gate, name="alone.toml")).results
    found = both.results
    assert (found.groups, found.sweep, found.conclusion) == (alone.groups, alone.sweep, alone.conclusion)
    for rows in ("contacts", "false_alarms", "exposure", "recordings"):
        kept = [row for row in getattr(found, rows) if row.group in alone.groups]
        assert kept == list(getattr(alone, rows)) and len(kept) < len(getattr(found, rows))
    assert [(item.group, item.counterpart, item.impact_free) for item in found.conditions] == [
        (FREE, "holdout", True),
        (STRUCK, "stiff", False),
    ]


def test_a_group_has_the_window_of_its_counterpart_and_a_section_of_its_own(read):
    setup = read(WINTER)
    assert setup.groups == ("stiff", "holdout") and setup.groups_of_impacts == ("stiff",)
    assert setup.impacts[STRUCK].window == 0.8 and not setup.impacts[STRUCK].is_impact_free
    assert setup.impacts[FREE].is_impact_free and setup.scoring["window_s"] == {"stiff": 0.8}
    assert {str(setup.sections[path]) for path in setup.impacts[STRUCK].logs} == {"from 0.5 s"}
    assert setup.inputs and set(setup.impacts[FREE].logs) < set(setup.inputs)


def test_the_store_has_them(gate, tmp_path):
    file, store = write(gate, WINTER), Store(tmp_path / "store")
    first = cdtool.benchmark(file, store=store)
    again = cdtool.benchmark(file, store=store)
    assert again.stored is not None and again.stored.computed == 0
    assert to_json(again.results) == to_json(first.results)
    assert every_value(again.evaluated.conditions) == every_value(first.evaluated.conditions)


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ('impacts.soft.logs = ["winter/stiff/*.csv"]', "conditions.cold.impacts.soft: is not a group of [impacts]"),
        ("", "conditions.cold: has no logs"),
        ('holdout.logs = ["winter/none/*.csv"]', "conditions.cold.holdout.logs"),
        ('holdout = ["winter/holdout/*.csv"]', "add a table [conditions.cold.holdout]"),
        ('free.logs = ["winter/holdout/*.csv"]', "conditions.cold.free: unknown key"),
        ('impacts.stiff = { logs = "winter/stiff/*.csv", window_s = 2 }', "stiff.window_s: unknown key"),
        ('holdout.logs = ["free/*.csv"]', "is both learned from and scored"),
        ('holdout.logs = ["holdout/*.csv"]', "is scored in holdout and in cold/holdout"),
    ],
)
def test_what_is_wrong_is_named(read, tables, message):
    with pytest.raises(ConfigurationError, match=re.escape(message)):
        read(f"[conditions.cold]\n{tables}\n")


def test_a_tuned_benchmark_file_has_them_in_its_own_folder(gate, tmp_path):
    document = tomllib.loads(write(gate, WINTER).read_text(encoding="utf-8"))
    _rebase(document, gate, gate / "tuned")
    condition = document["conditions"]["friction +40 %"]
    assert condition["holdout"]["logs"] == ["../winter/holdout/*.csv"]
    assert condition["impacts"]["stiff"] == {"logs": ["../winter/stiff/*.csv"], "from": "0.5s"}
