"""`cdtool compare` shows few contacts as `cdtool benchmark` does, and reports a file compared with itself."""

from __future__ import annotations

import json

import pytest

from tests.command import cdtool


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
    reason = "Fewer than 10 contacts detected: median and range, no mean, std or P95."
    assert all(reason in text for text in (screen, shown, target.read_text(encoding="utf-8")))
    assert "range" in screen and " to " in screen


@pytest.mark.parametrize("copied", [False, True])
def test_a_file_compared_with_itself_or_a_copy_is_reported_as_identical(results, tmp_path, copied):
    old = results[0]
    other = old
    if copied:
        other = tmp_path / "copy.json"
        other.write_bytes(old.read_bytes())
    done = cdtool("compare", old, other)
    assert done.status == 0
    assert done.out.splitlines()[-1].endswith(": both files contain the same results")
    assert "too few" not in done.out and "would have been" not in done.out


@pytest.mark.parametrize(("options", "status"), [((), 0), (("--fail-if-later",), 1), (("--require-power",), 4)])
def test_later_on_the_same_contacts_exits_with_1_if_asked(options, status, results):
    old, new, _ = results
    done = cdtool("compare", old, new, *options)
    assert done.status == status and "on the same 2 contacts: 2 later by " in " ".join(done.out.split())
    assert cdtool("compare", new, old, *options).status == (0 if "--fail-if-later" in options else status)
