"""`cdtool tune` on a few simulated recordings: choices, honest results, files that can be used, and refusals."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

import cdtool as api
from cdtool import simulate_gate
from cdtool.base.errors import UsageError
from cdtool.commands.scoring.benchmark_file import BenchmarkFile, read_benchmark_file
from cdtool.commands.tune.command import _show
from cdtool.commands.tune.files import open_folder, write_tuning
from cdtool.commands.tune.options import TuningOptions
from cdtool.commands.tune.page import tuning_html
from cdtool.commands.tune.recordings_to_tune import read_recordings
from cdtool.commands.tune.search.objective import Goal
from cdtool.commands.tune.tuned_files import tuning_summary
from cdtool.commands.tune.tuning import tune_detectors
from cdtool.execution.workers import Workers
from cdtool.formats.signature_store import read_signature
from cdtool.thresholds.limit import Limit
from tests.command import cdtool as command

BUDGET = "1/20op"
OPTIONS = TuningOptions(BUDGET, detectors=("momentum",), thresholds=("signature", "glr"))
QUICK = TuningOptions("1/5op", detectors=("momentum",), thresholds=("limit",))
ARGUMENTS = ("--detectors", "gm", "--set", "tune.thresholds=['signature', 'glr']", "--false-alarm-budget", "1/20op")


def tune(setup, options, **more):
    return tune_detectors(setup, replace(options, **more))


@pytest.fixture(scope="module")
def gate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("tuned") / "gate"
    simulate_gate(folder, {"free": 25, "stiff": 4, "soft": 4, "holdout": 2}, seed=31)
    return folder


@pytest.fixture(scope="module")
def quick(gate: Path) -> BenchmarkFile:
    """Few runs and a threshold that is learned and assessed in no time."""
    setup = read_benchmark_file(gate / "benchmark.toml")
    return replace(setup, learn=setup.learn[:12], rule=Limit())


@pytest.fixture(scope="module")
def done(gate: Path):
    return tune(read_benchmark_file(gate / "benchmark.toml"), OPTIONS)


@pytest.fixture(scope="module")
def written(gate: Path, tmp_path_factory: pytest.TempPathFactory):
    folder = tmp_path_factory.mktemp("out") / "tuned"
    outcome = command("tune", gate / "benchmark.toml", *ARGUMENTS, "-o", folder)
    assert outcome.status == 0, outcome.err
    return folder, outcome


def test_the_choice_is_faster_than_the_default_on_recordings_that_chose_nothing(done):
    (tuned,) = done.detectors
    assert done.is_nested and tuned.nested and tuned.default_nested
    assert tuned.choice.rule.name == "glr"
    for group in ("stiff", "soft"):
        assert tuned.nested.groups[group].mean_ms < 0.9 * tuned.default_nested.groups[group].mean_ms
    assert tuned.nested.groups["stiff"].contacts == 4 and tuned.nested.free == 25
    assert len(tuned.chosen_in_folds) == 5 and sum("glr" in words for words in tuned.chosen_in_folds) >= 3


def test_the_result_does_not_depend_on_the_number_of_workers(quick):
    expected = json.dumps(tuning_summary(tune(quick, QUICK)), default=str)
    assert json.dumps(tuning_summary(tune(quick, QUICK, workers=Workers(2))), default=str) == expected


def test_the_files_can_be_used(written, gate):
    folder = written[0]
    names = {path.name for path in folder.iterdir()}
    assert names == {
        "machine.toml",
        "machine.schema.json",
        "benchmark.toml",
        "benchmark.schema.json",
        "signature_momentum.json",
        "tuning.html",
        "tuning.json",
    }
    made = api.benchmark(folder / "benchmark.toml").results
    summary = json.loads((folder / "tuning.json").read_text(encoding="utf-8"))
    chosen = summary["detectors"][0]
    assert made.provenance["gains"]["momentum"] == chosen["choice"]["gains"]
    assert made.provenance["threshold"] == chosen["choice"]["threshold"]["rule"] == "glr"
    assert made.provenance["debounce_samples"] == chosen["debounce"] == 3
    signature = read_signature(folder / "signature_momentum.json")
    factor = signature.current[0].safety_factor
    assert made.provenance["threshold_rule"]["safety_factor"] == factor
    # The factor of the search has five folds, that of learning ten.
    assert chosen["factor"] == pytest.approx(factor, rel=0.15)
    log = gate / "stiff" / "01.csv"
    found = command("detect", log, "-m", folder / "machine.toml", "-s", folder / "signature_momentum.json")
    assert found.status == 0 and "alarm" in found.out


def test_it_may_run_again_into_its_folder_but_replaces_no_other_file(written, tmp_path):
    folder = tmp_path / "tuned"
    shutil.copytree(written[0], folder)
    open_folder(folder, ())
    (folder / "machine.toml").write_text("[machine]\n", encoding="utf-8")
    with pytest.raises(UsageError, match="already exists and contains no file of cdtool tune"):
        open_folder(folder, ())
    open_folder(folder, (), force=True)
    with pytest.raises(UsageError, match="exists and is not a folder"):
        open_folder(folder / "tuning.html", ())


def test_too_few_runs_are_refused_with_the_numbers_needed(tmp_path):
    simulate_gate(tmp_path / "gate", {"free": 14, "stiff": 1}, seed=32)
    done = command("tune", tmp_path / "gate" / "benchmark.toml", "--false-alarm-budget", "1/20op", "-o", tmp_path / "t")
    assert done.status == 2
    assert "19 are needed to set the limit, 25 to check it, 59 to be 95 % sure of it" in done.err


def test_real_and_injected_contacts_are_not_mixed_unasked(gate, tmp_path):
    model = "[model.drive]\nstiffness = 8e4\n[model.controller]\nperiod = 0.001\nspeed_gain = 4300\n"
    machine = (gate / "machine.toml").read_text(encoding="utf-8")
    (gate / "model.toml").write_text(machine + model, encoding="utf-8")
    text = (gate / "benchmark.toml").read_text(encoding="utf-8").replace('"machine.toml"', '"model.toml"')
    inject = '[inject]\nlogs = ["free/01.csv", "free/02.csv"]\npositions = ["0.5m"]\nfolder = "injected_here"\n'
    inject += "[inject.obstacles.hard]\nstiffness_n_per_mm = 500\n"
    (gate / "both.toml").write_text(text + inject, encoding="utf-8")
    both = read_benchmark_file(gate / "both.toml")
    both = replace(both, learn=both.learn[:12], rule=Limit())
    with pytest.raises(UsageError, match=r"has real contacts \(stiff, soft\) and injected ones"):
        tune(both, QUICK)
    made = tune(both, replace(QUICK, impacts="injected"))
    assert set(made.groups) == {"injected_hard"}
    injected = replace(both, impacts={}).with_made(Workers(1))
    read = read_recordings(injected, QUICK.budget, 0, Workers(1)).recordings
    fold_of = {run.operation.recording.source: run.fold for run in read.free}
    assert [log.fold for log in read.struck] == [fold_of[log.made_from] for log in read.struck]
    real = tune(both, replace(QUICK, impacts="real"))
    assert set(real.groups) == {"stiff", "soft"}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--set", "tune.objective=speed"), "--set tune.objective: is 'speed'"),
        (("--set", "tune.thresholds=glx"), "tune.thresholds: contains 'glx'"),
        (("--set", "tune.impacts=all"), "--set tune.impacts: is 'all'"),
        (("--set", "tune.impacts=injected"), "has no section [inject]"),
        (("--set", "tune.worse_at_most=-1"), "--set tune.worse_at_most: is -1"),
        (("--set", "tune.sed=1"), "did you mean seed?"),
        (("--false-alarm-budget", "often"), "false-alarm budget is 'often'"),
        (("--detectors", "gx"), "gx"),
    ],
)
def test_wrong_options_are_one_line(gate, tmp_path, arguments, words):
    done = command("tune", gate / "benchmark.toml", "--false-alarm-budget", "1/20op", "-o", tmp_path / "t", *arguments)
    assert done.status == 2 and words in done.err and done.err.count("\n") == 1


def test_files_of_others_in_the_folder_are_not_replaced(tmp_path):
    (tmp_path / "signature_momentum.json").write_text('{"my": 1}', encoding="utf-8")
    with pytest.raises(UsageError, match="contains no signature"):
        open_folder(tmp_path, (), ["momentum"])
    mine = tmp_path / "benchmark_momentum.toml"
    mine.write_text("machine = 'x'", encoding="utf-8")
    with pytest.raises(UsageError, match="is read by this command"):
        open_folder(tmp_path, (mine,), ["momentum"], force=True)


def test_a_detector_that_cannot_be_tuned_is_reported(quick, gate, tmp_path):
    machine = "\n".join(
        line for line in quick.machine_file.path.read_text(encoding="utf-8").splitlines() if "acc_x" not in line
    )
    (gate / "no_acceleration.toml").write_text(machine, encoding="utf-8")
    text = (gate / "benchmark.toml").read_text(encoding="utf-8").replace('"machine.toml"', '"no_acceleration.toml"')
    (gate / "no_acceleration_benchmark.toml").write_text(text, encoding="utf-8")
    arguments = ("--detectors", "gm,feekf", "--set", "tune.thresholds=limit", "--false-alarm-budget", "1/2op")
    done = command("tune", gate / "no_acceleration_benchmark.toml", *arguments, "-o", tmp_path / "t")
    assert done.status == 3 and "friction_ekf: not tuned:" in done.err


def test_its_own_input_is_never_overwritten(gate):
    arguments = ("--false-alarm-budget", "1/20op", "-o", gate, "--force")
    done = command("tune", gate / "benchmark.toml", *arguments)
    assert done.status == 2 and "is read by this command" in done.err


VERDICTS = {
    "within": ({"alarming": 4}, True, "good", "momentum with glr at 1/5op: stiff "),
    "above": ({"alarming": 5}, True, "unknown", "more false alarms than the budget: 5 of 20 runs alarm where 1/5op "),
    "apparent": ({"alarming": 0}, False, "unknown", "apparent, on the recordings used for the choice: momentum with"),
}


@pytest.mark.parametrize("name", VERDICTS)
def test_every_surface_opens_with_the_worst_fact_of_a_tuning(name, done, capsys):
    counts, nested, tone, words = VERDICTS[name]
    best = replace(done.detectors[0].nested, free=20, **counts)
    tuned = replace(done.detectors[0], nested=best if nested else None, apparent=best)
    made = replace(done, options=replace(done.options, false_alarm_budget="1/5op"), detectors=(tuned,))
    assert made.verdict[0] == tone and made.verdict[1].startswith(words)
    _show(made, quiet=True)
    assert " ".join(capsys.readouterr().out.split()).startswith(made.verdict[1])
    assert made.verdict[1] in tuning_html(made) and tuning_summary(made)["verdict"] == made.verdict[1]


def test_the_force_is_not_minimised_where_none_is_known(quick, tmp_path):
    text = "recording,start_s,end_s\n" + "".join(
        f"{group}/{path.name},6.0,6.2\n" for group in ("stiff", "soft") for path in quick.impacts[group].logs
    )
    (quick.path.parent / "labels.csv").write_text(text, encoding="utf-8")
    machine = "\n".join(
        line
        for line in quick.machine_file.path.read_text(encoding="utf-8").splitlines()
        if not line.startswith("force")
    )
    (quick.path.parent / "no_cell.toml").write_text(machine, encoding="utf-8")
    written = quick.path.read_text(encoding="utf-8").replace('"machine.toml"', '"no_cell.toml"')
    written = written.replace("[onset]", '[onset]\nlabels = "labels.csv"')
    (quick.path.parent / "labelled.toml").write_text(written, encoding="utf-8")
    setup = read_benchmark_file(quick.path.parent / "labelled.toml")
    setup = replace(setup, learn=setup.learn[:12], rule=Limit())
    with pytest.raises(UsageError, match="no log has the force of its contact"):
        tune(setup, QUICK, objective=Goal.FORCE)
    made = tune(setup, QUICK)
    folder = tmp_path / "a [b] c" / "out"
    open_folder(folder, ())
    write_tuning(made, folder)
    again = read_benchmark_file(folder / "benchmark.toml")
    assert again.labels is not None and len(again.labels.contacts) == 8
