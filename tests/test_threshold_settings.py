"""`threshold` of a benchmark file: every rule by name or table, class by class, with its settings checked."""

from __future__ import annotations

from pathlib import Path

import pytest

import cdtool
from cdtool.errors import ConfigurationError
from cdtool.thresholds.cusum import Cusum
from cdtool.thresholds.glr import Glr
from cdtool.thresholds.innovation import Innovation
from cdtool.thresholds.limit import Limit
from cdtool.workflows.benchmark_file import read_benchmark_file
from tests.test_workflows import MACHINE, write_log

HEAD = 'machine = "machine.toml"\ndetectors = ["gm"]\noperations = "motion"\n'
LOGS = '[learn]\nlogs = ["free.csv"]\n[impacts.push]\nlogs = ["hits.csv"]\n[holdout]\nlogs = ["quiet.csv"]\n'


@pytest.fixture(scope="module")
def door(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("door")
    (path / "machine.toml").write_text(MACHINE)
    write_log(path / "free.csv", 24, {}, 1)
    write_log(path / "quiet.csv", 6, {}, 2)
    write_log(path / "hits.csv", 6, {1: 60.0, 2: 60.0, 5: 60.0}, 3)
    return path


def written(folder: Path, text: str) -> Path:
    file = folder / "benchmark.toml"
    # A key of the file itself stands before its first table.
    key, table = (text, "") if text.startswith("threshold") else ("", text)
    file.write_text(HEAD + key + LOGS + table, encoding="utf-8")
    return file


@pytest.mark.parametrize(
    "text",
    [
        'threshold = "cusum"\n',
        'threshold = "glr"\n',
        '[threshold]\nname = "trend"\nsides = "one"\nsafety_factor = 8\n',
        '[threshold]\nname = "limit_and_trend"\nlead = 0.01\n',
        '[threshold]\nname = "combined"\nmembers = ["signature", "cusum"]\nactivation = "all"\n',
    ],
)
def test_contacts_in_both_directions_are_found_whatever_the_threshold(door, text):
    results = cdtool.benchmark(written(door, text)).results
    assert [row.outcome for row in results.contacts] == ["detected"] * 3
    assert all(5.0 < row.latency_ms < 200.0 for row in results.contacts)
    # Obstacles oppose the motion: below where it goes backward (strokes 1 and 5), above where it goes forward.
    if "combined" not in text:
        assert [row.side for row in results.contacts] == ["below", "above", "below"]


def test_a_budget_sets_the_factor_of_each_class_alike(door):
    text = '[threshold]\nname = "cusum"\ndrift = 1.0\n[signature]\nforce = true\n'
    done = cdtool.benchmark(written(door, text), false_alarm_budget="1/8op")
    assert [row.operations for row in done.results.calibration] == [24]
    assert all(row.not_assessable == 0 for row in done.results.exposure)
    assert all(row.outcome == "detected" for row in done.results.contacts)


def test_a_table_has_the_rules_own_settings(door):
    rule = read_benchmark_file(written(door, '[threshold]\nname = "glr"\nwindows = [8, 64]\nsafety_factor = 7\n')).rule
    assert isinstance(rule, Glr) and rule.windows == (8, 64) and rule.safety_factor == 7.0 and rule.sides == "one"
    rule = read_benchmark_file(written(door, '[threshold]\nname = "innovation"\norder = 6\nsides = "two"\n')).rule
    assert isinstance(rule, Innovation) and rule.order == 6 and rule.sides == "two"


def test_what_the_signature_learns_is_set_in_its_own_table(door):
    file = written(door, '[threshold]\nname = "cusum"\n[signature]\nposition_step = 0.01\nalignment = "position"\n')
    rule = read_benchmark_file(file).rule
    assert isinstance(rule, Cusum) and rule.safety_factor == Cusum.safety_factor
    assert rule.signature.position_step == 0.01 and rule.signature.alignment == "position"


def test_without_its_own_a_rule_takes_the_safety_factor_of_the_signature(door):
    rule = read_benchmark_file(written(door, '[threshold]\nname = "limit"\n[signature]\nsafety_factor = 9\n')).rule
    assert rule == Limit(9.0)
    assert read_benchmark_file(written(door, 'threshold = "limit"\n')).rule == Limit()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('threshold = "cusom"\n', "threshold: is 'cusom'.*did you mean cusum"),
        ('[threshold]\nname = "cusom"\n', "threshold.name: is 'cusom'.*did you mean cusum"),
        ('[threshold]\nname = "cusum"\ndrfit = 1\n', "threshold.drfit: unknown key.*did you mean drift"),
        ('[threshold]\nname = "cusum"\ndrift = "1"\n', "threshold.drift: is '1'.*a number"),
        ('[threshold]\nname = "cusum"\norder = 2.5\n', "threshold.order: is 2.5.*whole number"),
        ('[threshold]\nname = "cusum"\norder = 99\n', "threshold.name: 'cusum': order is 99"),
        ('[threshold]\nname = "cusum"\nsignature = "x"\n', "threshold.signature: unknown key"),
        ('[threshold]\nname = "glr"\nwindows = [0.5]\n', "threshold.windows: is .0.5.*whole numbers"),
        ('[threshold]\nname = "signature"\nsafety_factor = 3\n', r"threshold.safety_factor.*\[signature\]"),
        ('[threshold]\nname = "combined"\nmembers = ["limit"]\n', "two or more"),
    ],
)
def test_a_wrong_threshold_is_one_line_that_names_its_key(door, text, said):
    with pytest.raises(ConfigurationError, match=said):
        read_benchmark_file(written(door, text))
