"""Every command treats the runs of one file as recordings of their own: the same results as from separate files."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

import cdtool
from cdtool.base.errors import ConfigurationError, UsageError
from cdtool.commands.judging.runs import find_logs
from cdtool.results.files.results_file import to_json
from tests.command import FEW, one_line
from tests.command import cdtool as command

GATE = Path(__file__).parents[3] / "sample_logs" / "gate"
RUNS = ("free/03", "free/04", "holdout/03", "stiff/03", "soft/03")
IDS = tuple(name.replace("/", "_") for name in RUNS)
FILE = """machine = "machine.toml"
detectors = ["gm"]
{operations}
[learn]
logs = {learn}
[signature]
force = true
[holdout]
logs = {holdout}
[impacts.stiff]
logs = {stiff}
[impacts.soft]
logs = {soft}
[onset]
above_n = 20.0
back_to_n = 8.0
"""


def rows(name: str) -> tuple[str, list[str]]:
    """Header and rows of a sample log at a fifth of its rate."""
    head, *lines = (GATE / f"{name}.csv").read_text().splitlines()
    return head, lines[::5]


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("runs")
    (folder / "machine.toml").write_text((GATE / "machine.toml").read_text())
    together: list[str] = []
    for name, key in zip(RUNS, IDS, strict=True):
        head, lines = rows(name)
        (folder / f"{key}.csv").write_text("\n".join([head, *lines, ""]))
        together += [f"{line},{key}" for line in lines]
    (folder / "all.csv").write_text("\n".join([f"{head},run_id", *together, ""]))
    return folder


def benchmark_file(folder: Path, name: str, operations: str, logs: str) -> Path:
    """Write a benchmark file whose groups have the logs that `logs` names for an id pattern."""
    path = folder / f"{name}.toml"
    groups = {"learn": "free_*", "holdout": "holdout_*", "stiff": "stiff_*", "soft": "soft_*"}
    path.write_text(
        FILE.format(operations=operations, **{key: f'["{logs.format(ids)}"]' for key, ids in groups.items()})
    )
    return path


@pytest.fixture(scope="module")
def separate(folder) -> cdtool.BenchmarkResult:
    return cdtool.benchmark(benchmark_file(folder, "separate", "", "{}.csv"))


@pytest.fixture(scope="module")
def together(folder) -> Path:
    return benchmark_file(folder, "together", 'operations = "column:run_id"', "all.csv#{}")


def figures(results) -> list[dict]:
    """The rows of contacts by everything but the names."""
    return [
        {key: pytest.approx(value, rel=1e-9) if isinstance(value, float) else value for key, value in row.items()}
        | {"recording": None, "operation": None}
        for row in json.loads(to_json(results))["contacts"]
    ]


@pytest.mark.parametrize("operations", ['operations = "column:run_id"', 'operations = "label:run_id"'])
def test_a_benchmark_of_runs_has_the_results_of_separate_files(folder, separate, operations):
    done = cdtool.benchmark(benchmark_file(folder, "cut", operations, "all.csv#{}"))
    assert figures(done.results) == figures(separate.results)
    assert [(row.group, row.recordings, row.operations, row.hours) for row in done.results.exposure] == [
        (row.group, row.recordings, row.operations, row.hours) for row in separate.results.exposure
    ]
    assert [row.recording for row in done.results.recordings] == [
        "all.csv#stiff_03",
        "all.csv#soft_03",
        "all.csv#holdout_03",
    ]
    assert not done.results.skipped
    assert done.results.provenance["learned_runs"] == ["all.csv#free_03", "all.csv#free_04"]
    assert {trace.recording for trace in done.traces} == {row.recording for row in done.results.recordings}


def test_a_run_that_is_learned_from_cannot_be_scored(folder, together):
    path = folder / "twice.toml"
    path.write_text(together.read_text().replace("#holdout_*", "#free_04"))
    with pytest.raises(ConfigurationError, match=r"all\.csv#free_04 has the same content as all\.csv#free_04, which"):
        cdtool.benchmark(path)
    path.write_text(together.read_text().replace("#soft_*", "#s*"))
    with pytest.raises(ConfigurationError, match=r"all\.csv#stiff_03 is scored twice"):
        cdtool.benchmark(path)


def test_a_run_that_is_named_twice_is_learned_from_once(folder, together):
    path = folder / "again.toml"
    path.write_text(together.read_text().replace('"all.csv#free_*"', '"all.csv#free_*", "all.csv#*_04"'))
    results = cdtool.benchmark(path).results
    assert results.provenance["learned_runs"] == ["all.csv#free_03", "all.csv#free_04"]
    assert [(item.recording, item.reason) for item in results.skipped] == [
        ("all.csv#free_04", "given more than once, used once")
    ]


def test_runs_are_named_only_where_logs_are_cut_and_the_file_may_contain_the_mark(folder, tmp_path):
    path = benchmark_file(folder, "uncut", "", "all.csv#{}")
    with pytest.raises(ConfigurationError, match=r"no file matches 'all\.csv#free_\*' .*set operations = "):
        cdtool.benchmark(path)
    (tmp_path / "a#1.csv").touch()
    (tmp_path / "b.csv").touch()
    assert find_logs(["a#1.csv#7*", "a#1.csv", "?.csv#x"], tmp_path, runs=True) == [
        tmp_path / "a#1.csv#7*",
        tmp_path / "a#1.csv",
        tmp_path / "b.csv#x",
    ]
    with pytest.raises(UsageError, match=r"no file matches 'c\.csv#7' .*check the path"):
        find_logs(["c.csv#7"], tmp_path, runs=True)


def test_labels_name_runs_and_one_without_a_run_is_reported(folder, together):
    labels = folder / "labels.csv"
    onset = next(
        row for row in csv.reader((GATE / "contacts.csv").read_text().splitlines()) if row[0] == "stiff/03.csv"
    )
    path = folder / "labelled.toml"
    path.write_text(together.read_text() + 'labels = "labels.csv"\n')
    labels.write_text(
        f"recording,start_s,end_s\nall.csv#stiff_03,{onset[1]},{float(onset[1]) + 0.2}\nall.csv#gone,1,2\n"
    )
    results = cdtool.benchmark(path).results
    assert [row.found_by for row in results.contacts if row.group == "stiff"] == ["label file"]
    assert [item.recording for item in results.skipped] == ["all.csv#gone"]
    labels.write_text("recording,start_s,end_s\nall.csv,1,2\n")
    with pytest.raises(ConfigurationError, match=r"'all\.csv' is cut into runs \(name the run, as all\.csv#1"):
        cdtool.benchmark(path)


def test_triggers_name_runs_even_one_with_the_id_zero(tmp_path):
    (tmp_path / "machine.toml").write_text((GATE / "machine.toml").read_text())
    head, lines = rows("stiff/03")
    together = [f"{line},{run}" for run in (0, 1) for line in lines]
    (tmp_path / "all.csv").write_text("\n".join([f"{head},run", *together, ""]))
    (tmp_path / "b.toml").write_text(
        'machine = "machine.toml"\noperations = "column:run"\n[impacts.stiff]\nlogs = ["all.csv"]\n'
        "[onset]\nabove_n = 20.0\n"
    )
    triggers = tmp_path / "t.csv"
    triggers.write_text("recording,time_s\nall.csv#0,6.3\nall.csv#7,1.0\nall.csv,2.0\n")
    results = cdtool.score(triggers, tmp_path / "b.toml").evaluated.results
    assert [(row.recording, row.outcome) for row in results.contacts] == [
        ("all.csv#0", "detected"),
        ("all.csv#1", "missed"),
    ]
    reasons = {item.recording: item.reason for item in results.skipped}
    assert "no such run" in reasons["all.csv#7"] and "cut into runs" in reasons["all.csv"]
    assert "t: 1 of 2 recordings without a row" in next(item.reason for item in results.findings)
    listed = cdtool.score(triggers, tmp_path / "b.toml", settings={"triggers.listed_only": True}).evaluated.results
    assert [row.recording for row in listed.recordings] == ["all.csv#0"]


def test_detect_and_explain_show_each_run_by_name(folder):
    limit = ("-m", folder / "machine.toml", "-d", "gm", "--set=threshold.limits=400")
    options = (*limit, "--set=operations=column:run_id")
    shown = command("detect", folder / "all.csv", *options, "--json")
    found = json.loads(shown.out)
    assert [(Path(item["log"]).name, item["verdict"]) for item in found] == [
        (f"all.csv#{key}", "alarm" if key.startswith(("stiff", "soft")) else "no alarm") for key in IDS
    ]
    alone = json.loads(command("detect", folder / "stiff_03.csv", *limit, "--json").out)
    (of_run,) = (item["alarms"] for item in found if item["log"].endswith("#stiff_03"))
    named = {name: of_run[0][name] for name in ("recording", "operation")}
    assert of_run == [alarm | named for alarm in alone[0]["alarms"]]
    explained = json.loads(command("explain", f"{folder / 'all.csv'}#s*", *options, "--json").out)
    assert [Path(item["log"]).name for item in explained] == ["all.csv#stiff_03", "all.csv#soft_03"]
    refused = command("detect", folder / "all.csv", *options, "--plot", folder / "one.png")
    assert refused.status == 2 and "--plot names one file for 5 runs" in one_line(refused.err)


def test_a_signature_learned_from_runs_knows_these_runs(folder, tmp_path):
    signature = tmp_path / "gate.json"
    learned = command(
        "learn-signature", f"{folder / 'all.csv'}#free_*", "-m", folder / "machine.toml", "-d", "gm",
        "--set=operations=column:run_id", FEW, "-o", signature,
    )  # fmt: skip
    assert learned.status == 0, learned.err
    runs = json.loads(signature.read_text())["runs"]
    assert [Path(run["name"]).name for run in runs] == ["all.csv#free_03", "all.csv#free_04"]
    shown = command(
        "detect", folder / "all.csv", "-m", folder / "machine.toml", "-s", signature, "--set=operations=column:run_id"
    )
    assert "free_04: the signature was learned from this log" in one_line(shown.err)
    assert "holdout_03: the signature was learned" not in one_line(shown.err)
    checked = command("signature", "check", signature, folder / "all.csv#holdout_03", "-m", folder / "machine.toml")
    assert checked.status in (0, 3) and "no such file" not in checked.err


def test_the_files_of_runs_may_not_be_overwritten(folder, together):
    before = (folder / "all.csv").read_bytes()
    refused = command("benchmark", together, "-o", folder / "all.csv", "--force")
    assert refused.status == 2 and (folder / "all.csv").read_bytes() == before


def changed(folder: Path, name: str, operations: str, logs: str, *changes: tuple[str, str]) -> Path:
    """Write the benchmark file with some of its text replaced."""
    path = benchmark_file(folder, name, operations, logs)
    text = path.read_text()
    for before, after in changes:
        assert before in text
        text = text.replace(before, after)
    path.write_text(text)
    return path


def test_runs_are_learned_from_until_their_onset_and_scored_without_their_own_part(folder):
    until = (
        ("[learn]", '[signature]\nforce = true\n[learn]\nuntil = "onset"'),
        ("[signature]\nforce = true\n[holdout]", "[holdout]"),
    )
    several = '"{0}stiff_*", "{0}soft_*", "{0}free_*"'
    plain = changed(
        folder,
        "plain",
        'threshold = "limit"',
        "{}.csv",
        *until,
        ('"free_*.csv"', several.format("").replace("*", "*.csv")),
    )
    text = plain.read_text()
    cut = folder / "cut.toml"
    named = text.replace('threshold = "limit"', 'threshold = "limit"\noperations = "column:run_id"')
    for key in ("free", "holdout", "stiff", "soft"):
        named = named.replace(f'"{key}_*.csv"', f'"all.csv#{key}_*"')
    cut.write_text(named)
    one, other = cdtool.benchmark(plain).results, cdtool.benchmark(cut).results
    assert figures(other) == figures(one)
    patterns = ("all.csv#stiff_*", "all.csv#soft_*")
    assert other.provenance["scored_without_own_part"] == list(patterns)
    cut.write_text(named.replace('"all.csv#stiff_*", "all.csv#soft_*", "all.csv#free_*"', '"all.csv#[fs]*"'))
    assert figures(cdtool.benchmark(cut).results) == figures(one), "other patterns name the same runs"


def test_a_label_may_be_about_a_run_of_a_file_that_is_only_learned_from(folder):
    (folder / "learned.csv").write_text((folder / "all.csv").read_text())
    (folder / "about_runs.csv").write_text(
        "recording,start_s,end_s\nlearned.csv#free_03,2.0,2.1\nall.csv#stiff_03,6.2,6.4\n"
    )
    onset = ("above_n = 20.0\nback_to_n = 8.0", 'labels = "about_runs.csv"')
    path = changed(
        folder,
        "about",
        'operations = "column:run_id"\nthreshold = "baseline"',
        "all.csv#{}",
        onset,
        ("all.csv#free", "learned.csv#free"),
    )
    done = cdtool.benchmark(path).results
    assert [item.recording for item in done.skipped if "shows a contact" in item.reason] == ["learned.csv#free_03"]


def test_a_load_cell_in_a_file_of_its_own_cannot_be_divided_into_runs(folder):
    machine = (folder / "machine.toml").read_text().splitlines()
    own = 'force = { file = "cell_{stem}.csv", column = "F", unit = "N", time_offset = 0.0, '
    own += 'time = { column = "t", unit = "s" } }'
    lines = [own if line.startswith("force = { column") else line for line in machine]
    (folder / "own.toml").write_text("\n".join(lines))
    path = changed(folder, "own_cell", 'operations = "column:run_id"', "all.csv#{}", ("machine.toml", "own.toml"))
    with pytest.raises(ConfigurationError, match="operations: cannot divide a channel that is in a file of its own"):
        cdtool.benchmark(path)
    arguments = ("-m", folder / "own.toml", "--set=operations=column:run_id", "-d", "gm", "--set=threshold.limits=200")
    done = command("detect", f"{folder / 'all.csv'}#stiff_03", *arguments)
    assert done.status == 2 and "cannot be divided into the runs of" in one_line(done.err)
