"""`cdtool compare` in a pipeline: exit status, table, JSON, Markdown."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cdtool.results.files.results_file import to_json
from cdtool.results.results import Results
from tests.command import cdtool
from tests.report.hostile import HOSTILE
from tests.synthetic.builds import MISSED, NOT_ASSESSABLE, build_results

LATENCIES = np.random.default_rng(1).normal(40.0, 6.0, 30).tolist()
OLD = {("momentum", "stiff"): LATENCIES, ("pure_torque", "stiff"): LATENCIES}
SLOWER = {**OLD, ("momentum", "stiff"): [x + 5.0 for x in LATENCIES]}
FASTER = {**OLD, ("momentum", "stiff"): [x - 5.0 for x in LATENCIES]}
MIXED = {**SLOWER, ("pure_torque", "stiff"): [x - 5.0 for x in LATENCIES]}

Written = Callable[[str, Results], Path]


@pytest.fixture
def written(tmp_path: Path) -> Written:
    def write(name: str, results: Results) -> Path:
        path = tmp_path / name
        path.write_text(to_json(results), encoding="utf-8", errors="replace")
        return path

    return write


@pytest.mark.parametrize(
    ("new", "status", "last"),
    [
        (OLD, 0, "no change shown: both files contain the same results"),
        (SLOWER, 1, "worse: 2 worse of 4 tests (family-wise error rate 0.05)"),
        (FASTER, 0, "better: 2 better of 4 tests (family-wise error rate 0.05)"),
        (MIXED, 1, "mixed: 2 worse and 2 better of 4 tests (family-wise error rate 0.05)"),
    ],
    ids=["same", "slower", "faster", "mixed"],
)
def test_anything_worse_exits_with_1_and_the_verdict_is_the_last_line(written, new, status, last):
    done = cdtool("compare", written("old.json", build_results(OLD)), written("new.json", build_results(new)))
    assert (done.status, done.err) == (status, "")
    assert "inconclusive" not in done.out
    assert done.out.splitlines()[-1] == last


def test_the_table_precedes_the_words_and_shows_misses_with_latencies(written):
    new = {("momentum", "stiff"): [MISSED, NOT_ASSESSABLE, *[x + 5.0 for x in LATENCIES[2:]]]}
    old = written("old.json", build_results(OLD, false_alarms={("momentum", "stiff"): 3}, debounce_samples=5))
    done = cdtool("compare", old, written("new.json", build_results(new)))
    assert done.status == 1
    assert re.search(
        r"^stiff +momentum +30 +\d\d\.\d / \d\d\.\d +0 / 1 +0 / 1 +3 / 0 +\d+ / \d+ *$", done.out, re.MULTILINE
    )
    assert "stiff, momentum: slower by 5.0 ms (5.0 to 5.0)" in done.out
    assert "1 of 30 contacts not assessable in one of the builds" in " ".join(done.out.split())
    assert "differs: debounce_samples: 5, now 9" in done.out
    assert "only in old, not compared: detector pure_torque" in done.out


def test_json_contains_every_question_and_is_strict(written, tmp_path):
    old, new = written("old.json", build_results(OLD)), written("new.json", build_results(SLOWER))
    done = cdtool("compare", old, new, "--json", "-o", tmp_path / "compare.json")

    def refuse(name: str) -> None:
        raise AssertionError(name)

    values = json.loads(done.out, parse_constant=refuse)
    assert done.status == 1 and (tmp_path / "compare.json").read_text(encoding="utf-8") == done.out
    assert values["verdict"] == "worse" and values["asked"] == 4
    (row,) = [item for item in values["rows"] if item["detector"] == "momentum"]
    by_figure = {item["figure"]: item for item in row["questions"]}
    exact = {"value": 5.0, "low": 5.0, "high": 5.0, "level": 0.95, "reason": ""}
    assert by_figure["latency_ms"]["change"] == exact
    assert by_figure["missed"]["p"] is None and by_figure["missed"]["outcome"] == "not_asked"
    assert set(by_figure) == {"latency_ms", "missed", "not_assessable", "false_alarms", "force_at_alarm_n"}


def test_markdown_has_a_row_per_detector_and_group_with_its_words(written, tmp_path):
    old, new = written("old.json", build_results(OLD)), written("new.json", build_results(SLOWER, debounce_samples=14))
    done = cdtool("compare", old, new, "-o", tmp_path / "compare.md")
    assert done.status == 1 and f"written: {tmp_path / 'compare.md'}" in done.out
    text = (tmp_path / "compare.md").read_text(encoding="utf-8")
    assert text.startswith("**cdtool compare: worse")
    rows = [line for line in text.splitlines() if line.startswith("| stiff | ")]
    assert [line.count(" | ") for line in rows] == [6, 6, 8, 8], "narrow ones, then folded ones"
    assert rows[0].endswith("| **worse** |") and rows[1].endswith("| no change shown |")
    assert "more force at the alarm by 50.0 N (50.0 to 50.0); on the same 30 contacts: 30 later by 5.0 ms" in rows[2]
    assert "slower by 5.0 ms" in rows[2]
    shown = text[: text.index("<details>")]
    assert "\n\nstiff, momentum: " in shown and "slower by 5.0 ms" in shown
    assert "| debounce\\_samples | 9 | 14 |" in text or "| debounce_samples | 9 | 14 |" in text
    assert "not a certificate" in text and "“No change shown” does not mean that there is no change" in text


@pytest.mark.parametrize("name", HOSTILE.values(), ids=HOSTILE)
def test_names_from_files_stay_text_in_the_terminal_and_in_markdown(written, tmp_path, name):
    names = {"onset": name, "machine": name, "gains": {name: {name: name}}, "window_s": {}, "force_profiles": {}}
    old = build_results({(name, name): LATENCIES}, **names)
    new = build_results(
        {(name, name): LATENCIES, (f"{name}2", f"{name}3"): LATENCIES}, **{**names, "machine": f"{name}!"}
    )
    done = cdtool("compare", written("old.json", old), written("new.json", new), "-o", tmp_path / "c.md")
    assert done.status == 0, done.err
    text = (tmp_path / "c.md").read_text(encoding="utf-8")
    for shown in (done.out, text):
        assert not re.search("[\x00-\x09\x0b-\x1f\u202a-\u202e\u2066-\u2069]", shown)
    assert "<script" not in re.sub(r"\\<", "", text) and not re.search(r"(?<!\\)\]\(", text)
    rows = [line for line in text.splitlines() if line.endswith("(every latency is the same) |")]
    assert len(rows) == 1 and len(re.findall(r"(?<!\\)\|", rows[0])) == 10


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("old.json", "absent.json"), "absent.json: no such file"),
        (("old.json", "other.json"), "onset differs: load cell above 20 N"),
        (("old.json", "old.json", "--level", "1"), "significance level is 1"),
        (("old.json", "old.json", "-o", "compare.html"), "a name that ends in .md or .json"),
        (("old.json", "old.json", "-o", "absent/compare.md"), "no folder absent"),
        (("old.json",), "NEW"),
    ],
)
def test_invalid_comparisons_exit_with_2_and_one_line(written, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    written("old.json", build_results(OLD))
    written("other.json", build_results(OLD, onset="above 30 N"))
    done = cdtool("compare", *arguments)
    assert done.status == 2 and message in done.err and done.out == ""


def test_a_better_build_with_an_open_question_exits_with_4_if_power_is_required(written):
    values = {("momentum", "stiff"): LATENCIES, ("momentum", "soft"): LATENCIES[:3]}
    faster = {key: [x - 5.0 for x in items] for key, items in values.items()}
    old, new = written("old.json", build_results(values)), written("new.json", build_results(faster))
    assert [cdtool("compare", old, new, *option).status for option in ((), ("--require-power",))] == [0, 4]
    assert (
        "better: " in cdtool("compare", old, new).out
        and "inconclusive in 1 of 2 rows" in cdtool("compare", old, new).out
    )
