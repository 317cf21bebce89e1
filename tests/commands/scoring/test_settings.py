"""--set KEY=VALUE: the same results as the key in the file, stated in them, and computed again with a store."""

from __future__ import annotations

import json

import pytest

from cdtool.base.errors import UsageError
from cdtool.commands.judging.settings_table import apply_settings, given_settings
from cdtool.commands.scoring.benchmark_file import read_benchmark_file
from tests.command import cdtool

MORE = '[activation]\ndebounce = 4\n[threshold]\nname = "limit"\nlimits = 250.0\n'
SET = ("--set", "activation.debounce=4", "--set", "threshold.name=limit", "--set", "threshold.limits=250.0")


@pytest.fixture(scope="module")
def results(gate_folder, tmp_path_factory):
    """Results by name, of a file with the keys, and of one whose keys --set gives."""
    folder = tmp_path_factory.mktemp("set")
    text = (gate_folder / "benchmark.toml").read_text(encoding="utf-8")
    (gate_folder / "edited.toml").write_text(text + MORE, encoding="utf-8")
    store = folder / "store"
    for name, file, more in (
        ("plain", "benchmark.toml", ("--store", store)),
        ("set", "benchmark.toml", ("--store", store, *SET)),
        ("edited", "edited.toml", ()),
    ):
        done = cdtool("benchmark", gate_folder / file, "--detectors", "gm", *more, "-o", folder / f"{name}.json")
        assert done.status in (0, 1), done.err
    return {name: json.loads((folder / f"{name}.json").read_text()) for name in ("plain", "set", "edited")}


def test_a_setting_does_what_the_key_in_the_file_does(results):
    assert results["set"]["contacts"] == results["edited"]["contacts"] != results["plain"]["contacts"]
    assert results["set"]["false_alarms"] == results["edited"]["false_alarms"]


def test_results_state_the_settings_and_differ_in_their_digest(results):
    stated = {"activation.debounce": 4, "threshold.name": "limit", "threshold.limits": 250.0}
    assert results["set"]["provenance"]["settings"] == stated and "settings" not in results["plain"]["provenance"]
    assert results["set"]["provenance"]["benchmark_sha256"] != results["plain"]["provenance"]["benchmark_sha256"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("activation.debounce=many", "--set activation.debounce: is 'many'"),
        ("activation.debonce=3", "--set activation.debonce: unknown key (did you mean debounce?"),
        ("activaton.debounce=3", "--set activaton: unknown key (did you mean activation"),
        ("debounce", "--set is 'debounce' (give KEY=VALUE"),
        ("activation.debounce_ms=9", "debounce_ms: unknown key (give activation.debounce: consecutive samples outside"),
        ("detectors=3", "--set detectors: is 3 (give names of detectors, as gm,eo)"),
        ("detectors=[]", "--set detectors: is "),
        ("objective=p95", "--set objective: unknown key (write tune.objective"),
        (
            "machine.load_mass=3",
            "--set machine: is a table (give the path of the machine file, which has",
        ),
        ("limits.a.b=3", "--set limits.a.b: is 3 (give { max = 50 }, { min = 1 } or both)"),
        ("limits.gm.stif.missed.max=3", "--set limits.gm.stif.missed: unknown group 'stif' (did you mean stiff"),
        ("impacts.stif.window_s=2", "--set impacts.stif: is not a group of the file (did you mean stiff"),
        ("tune.objective=p95", "--set tune.objective: has no effect in this command (cdtool tune reads it)"),
        ("triggers.clock=source", "--set triggers.clock: has no effect in this command (cdtool score reads it)"),
        ("protocol.number=7", "--set protocol.number: has no effect in this command (write it into the file)"),
        ("learn.logs=free/*.csv, frei/*.csv", "--set learn.logs: no file matches 'frei/*.csv'"),
        ("threshold.limit=400", "threshold.limit: is not a key of the threshold signature (name its threshold with"),
    ],
)
def test_a_wrong_setting_is_one_line_that_names_the_option(gate_folder, text, said):
    done = cdtool("benchmark", gate_folder / "benchmark.toml", "--set", text)
    assert done.status == 2 and said in done.err and "Traceback" not in done.err


def test_values_are_those_of_toml_and_a_bare_word_is_a_text():
    found = given_settings(["a.b=1.5", "a.c=word", "a.d=[1, 2]", "e=true", 'f="x"'])
    assert found == {"a.b": 1.5, "a.c": "word", "a.d": [1, 2], "e": True, "f": "x"}
    assert apply_settings({"a": {"b": 1}, "z": 2}, found) == {
        "a": {"b": 1.5, "c": "word", "d": [1, 2]},
        "z": 2,
        "e": True,
        "f": "x",
    }
    with pytest.raises(UsageError, match="--set is '=3'"):
        given_settings(["=3"])


def test_a_command_refuses_the_keys_that_it_does_not_read_and_names_one_that_does(gate_folder):
    file, log = gate_folder / "benchmark.toml", gate_folder / "stiff/01.csv"
    (gate_folder / "triggers.csv").write_text("recording,time_s\nstiff/01.csv,0.5\n", encoding="utf-8")
    score = ("score", gate_folder / "triggers.csv", "-b", file)
    for command, key in (
        (score, "activation.debounce=9"),
        (score, "threshold.name=cusum"),
        (("detect", log, "-b", file, "-d", "gm"), "limits.gm.stiff.missed.max=1"),
        (("tune", file, "--false-alarm-budget", "1/10op", "-o", "tuned"), "triggers.clock=source"),
        (("inject", file), "tune.objective=p95"),
    ):
        done = cdtool(*command, "--set", key)
        assert done.status == 2 and f"--set {key.partition('=')[0]}: has no effect in this command" in done.err, command
    assert cdtool(*score, "--set", "activation.rearm_s=0.1").status in (0, 1, 3)


def test_detectors_as_a_setting_are_those_of_the_option(gate_folder, tmp_path):
    text = (gate_folder / "benchmark.toml").read_text(encoding="utf-8")
    limits = '[limits]\n"gm.stiff.missed" = { max = 0 }\n"pi.stiff.missed" = { max = 0 }\n'
    (gate_folder / "limited.toml").write_text(text + limits, encoding="utf-8")
    for name, more in (("option", ("-d", "gm")), ("set", ("--set", "detectors=gm"))):
        done = cdtool("benchmark", gate_folder / "limited.toml", *more, "-q", "-o", tmp_path / f"{name}.json")
        assert done.status in (0, 1) and "1 of 2 limits not checked" in done.err, done.err
    assert (tmp_path / "option.json").read_bytes() == (tmp_path / "set.json").read_bytes()
    both = cdtool("benchmark", gate_folder / "limited.toml", "-d", "gm", "--set", "detectors=pi")
    assert both.status == 2 and "--set detectors: cannot be combined with --detectors" in both.err


def test_a_limit_needs_no_quotes_and_the_last_value_of_a_key_counts(gate_folder):
    given = given_settings(["limits.gm.stiff.missed.max=3", "window_s=1", "window_s=0.4"])
    setup = read_benchmark_file(gate_folder / "benchmark.toml", settings=given)
    assert setup.window == 0.4 and [rule.largest for rule in setup.limits if rule.group == "stiff"] == [3.0]
