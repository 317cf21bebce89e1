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
from tests.synthetic.builds import build_results

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
    ("new", "status", "first"),
    [
        (OLD, 0, "no change shown: both files contain the same results"),
        (SLOWER, 1, "worse: 2 worse of 4 tests (family-wise error rate 0.05)"),
        (FASTER, 0, "better: 2 better of 4 tests (family-wise error rate 0.05)"),
        (MIXED, 1, "mixed: 2 worse and 2 better of 4 tests (family-wise error rate 0.05)"),
    ],
    ids=["same", "slower", "faster", "mixed"],
)
def test_anything_worse_exits_with_1_and_the_verdict_is_the_first_line(written, new, status, first):
    done = cdtool("compare", written("old.json", build_results(OLD)), written("new.json", build_results(new)))
    assert (done.status, done.err) == (status, "")
    assert "inconclusive" not in done.out
    assert done.out.splitlines()[0] == first


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


@pytest.fixture(scope="module")
def results(gate_folder, tmp_path_factory):
    """Results of two contacts per group, and the same with every latency of the first half 50 % longer."""
    path = tmp_path_factory.mktemp("results") / "old.json"
    done = cdtool("benchmark", gate_folder / "benchmark.toml", "--detectors", "gm,pt", "-o", path)
    assert done.status == 0, done.err
    values = json.loads(path.read_text(encoding="utf-8"))
    for row in values["contacts"]:
        row["latency_ms"] = 1.5 * row["latency_ms"] + (7.0 if row["recording"].endswith("01.csv") else 0.0)
    new = path.with_name("new.json")
    new.write_text(json.dumps(values), encoding="utf-8")
    return path, new, done.out


def test_fewer_than_ten_contacts_show_a_median_with_its_range(results, tmp_path):
    old, new, shown = results
    target = tmp_path / "compare.md"
    done = cdtool("compare", old, new, "-o", target, "--json")
    rows = json.loads(done.out)["rows"]
    latencies: dict[tuple[str, str], list[float]] = {}
    for row in json.loads(old.read_text(encoding="utf-8"))["contacts"]:
        latencies.setdefault((row["detector"], row["group"]), []).append(row["latency_ms"])
    for row in rows:
        for item in (item for item in row["questions"] if item["figure"] == "latency_ms"):
            values = latencies[row["detector"], row["group"]]
            assert item["old"] == pytest.approx(sum(values) / 2)  # the median of two values is their mean
            assert item["ranges"][0] == [min(values), max(values)]
    screen = cdtool("compare", old, new).out
    reason = "Fewer than 10 contacts detected: median and range, no mean, std or P95"
    assert all(reason in text for text in (shown, target.read_text(encoding="utf-8")))
    assert "median below ten contacts" in screen


@pytest.mark.parametrize(("options", "status"), [((), 0), (("--fail-if-later",), 1), (("--require-power",), 4)])
def test_later_on_the_same_contacts_exits_with_1_if_asked(options, status, results):
    old, new, _ = results
    done = cdtool("compare", old, new, *options)
    assert done.status == status and "on the same 2 contacts: 2 later by " in " ".join(done.out.split())
    assert cdtool("compare", new, old, *options).status == (0 if "--fail-if-later" in options else status)
