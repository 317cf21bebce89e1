"""`benchmark`, `detect --benchmark` and `explain --benchmark` agree on every number of the same recording."""

from __future__ import annotations

import json
import re
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from cdtool.commands.console.console import number
from cdtool.commands.detecting import prepared
from tests.command import cdtool

SAMPLES = Path(__file__).parents[3] / "sample_logs"
OF_THE_LOG = ("recording", "group", "detector")
# Other settings that affect numbers, all different from their defaults.
SETTINGS = """
joints = {joints}
operations = "motion"
window_s = 0.4
[activation]
debounce = 12
hysteresis = 0.1
[signature]
safety_factor = 4.0
[onset]
above_n = {above}
hold_s = 0.005
sigmas = 6.0
separation_s = 0.5
synchronisation_s = 0.004
labels = "labels.csv"
[force]
mass_before_cell_kg = {mass}
"""


@pytest.fixture(autouse=True)
def learn_once(monkeypatch):
    """Learn the threshold once per file and detector instead of in each command."""
    prepare_again = prepared._of_benchmark
    prepare_once = cache(prepare_again)

    def prepare(file, detector, signature, settings):
        if settings:
            return prepare_again(file, detector, signature, settings)
        return prepare_once(file, detector, signature, None)

    monkeypatch.setattr(prepared, "_of_benchmark", prepare)


def benchmark_with_other_settings(folder: Path, sample: str) -> Path:
    """Return a copy of a sample's benchmark in which every setting that affects numbers differs from its default."""
    base = SAMPLES / sample
    values = tomllib.loads((base / "benchmark.toml").read_text(encoding="utf-8"))
    gate = sample == "gate"

    def logs(table: dict[str, Any]) -> str:
        return json.dumps([str(base / pattern) for pattern in table["logs"]])

    groups = "".join(f"[impacts.{name}]\nlogs = {logs(item)}\n" for name, item in values["impacts"].items())
    settings = SETTINGS.format(
        joints='["gate"]' if gate else '["arm"]', above=30.0 if gate else 0.8, mass=20.0 if gate else 0.0
    )
    first = sorted((base / "stiff").glob("*.csv"))[0]
    (folder / "labels.csv").write_text(
        f"recording,start_s,end_s,kind,uncertainty_s\n{first},{6.25 if gate else 1.5},,bump,0.02\n", encoding="utf-8"
    )
    head = f'machine = "{base / "machine.toml"}"\ndetectors = {json.dumps(values["detectors"])}\n'
    file = folder / "benchmark.toml"
    top, tables = settings.split("[activation]")
    file.write_text(
        f"{head}{top}[activation]{tables}[learn]\nlogs = {logs(values['learn'])}\n{groups}", encoding="utf-8"
    )
    return file


def rows_of(values: Any) -> dict[tuple[str, int], dict[str, Any]]:
    """Contact rows by log and number, without the fields that only a benchmark has."""
    found = {}
    for row in values:
        log = str(row.get("recording") or row["operation"].partition("#")[0])
        found[log, row["contact"]] = {
            name: value for name, value in row.items() if name not in (*OF_THE_LOG, "operation")
        }
    return found


def check(file: Path, detector: str) -> int:
    done = cdtool("benchmark", file, "--json", "--detectors", detector)
    assert done.status in (0, 1, 3), done.err
    results = json.loads(done.out)
    truth = rows_of(results["contacts"])
    assert truth
    paths = sorted({str(file.parent / log) for log, _ in truth})
    detected = cdtool("detect", *paths, "--benchmark", file, "--detectors", detector, "--json")
    items = json.loads(detected.out)
    assert rows_of([row for item in items for row in item["contacts"]]) == truth
    shown = cdtool("detect", *paths, "--benchmark", file, "--detectors", detector).out
    false = {}
    for path in paths:
        values = json.loads(cdtool("explain", path, "--benchmark", file, "--detectors", detector, "--json").out)
        own = rows_of(values["contacts"])
        assert own and all(truth[key] == row for key, row in own.items())
        alarms = {item["alarm"]["time"]: item for item in values["alarms"] if item["role"] == "detection"}
        missed = {item["contact"]["start"]: item for item in values["missed"]}
        for row in own.values():
            if row["outcome"] == "detected":
                item = alarms[row["alarm_s"]]
                assert item["contact"]["start"] == row["onset_s"]
                for name in ("statistic", "limit", "side", "joint"):
                    assert item["alarm"][name] == row[name]
                (late,) = re.findall(r"(-?\d+) ms after the contact", item["words"][0]) or [None]
                if late is not None and not row["clipped"]:
                    assert int(late) == round(row["latency_ms"])
                assert number(row["latency_ms"], 3) in shown
            else:
                assert 1e3 * missed[row["onset_s"]]["watched"] == row["watched_ms"]
        for item in values["alarms"]:
            if item["role"] == "false alarm":
                false[item["operation"].partition("#")[0], item["alarm"]["time"]] = item["alarm"]["statistic"]
    names = {item["recording"] for item in results["recordings"] if item["group"] != "holdout"}
    alone = [item for item in results["false_alarms"] if item["recording"] in names]
    assert {(item["recording"], item["time_s"]): item["statistic"] for item in alone} == false
    return len(truth)


@pytest.mark.parametrize(
    ("sample", "detector"), [("gate", "pi"), ("gate", "pt"), ("arm/trial_1", "igm"), ("arm/trial_2", "gm")]
)
def test_of_every_impact_of_the_sample_logs(sample, detector):
    assert check(SAMPLES / sample / "benchmark.toml", detector) == (8 if sample == "gate" else 6)


@pytest.mark.parametrize(("sample", "detector"), [("gate", "gm"), ("arm/trial_1", "igm")])
def test_with_every_relevant_setting_changed_from_its_default(sample, detector, tmp_path):
    assert check(benchmark_with_other_settings(tmp_path, sample), detector) >= 6


def test_single_keys_give_the_results_of_the_file(tmp_path):
    """The results of `detect` with --set and with the file are the same: levels, limit, latency."""
    log, machine = SAMPLES / "gate" / "soft" / "03.csv", SAMPLES / "gate" / "machine.toml"
    file = tmp_path / "benchmark.toml"
    file.write_text(
        f'machine = "{machine}"\ndetectors = ["pi"]\nthreshold = {{ name = "limit", limits = 1.2 }}\n'
        f'[learn]\nlogs = ["{SAMPLES}/gate/free/*.csv"]\n[impacts.soft]\nlogs = ["{log}"]\nwindow_s = 0.7\n'
        "[onset]\nabove_n = 25.0\nback_to_n = 5.0\nhold_s = 0.004\nseparation_s = 0.8\nsynchronisation_s = 0.003\n"
        "[force]\nmass_before_cell_kg = 10.0\n",
        encoding="utf-8",
    )
    keys = ("threshold.limits=1.2", "window_s=0.7", "onset.above_n=25", "onset.back_to_n=5", "onset.hold_s=0.004")
    keys += ("onset.separation_s=0.8", "onset.synchronisation_s=0.003", "force.mass_before_cell_kg=10")
    options = [f"--set={key}" for key in keys]
    by_file = json.loads(cdtool("benchmark", file, "--json").out)["contacts"]
    for command in ("detect", "explain"):
        by_hand = json.loads(cdtool(command, log, "-m", machine, "-d", "pi", *options, "--json").out)
        rows = by_hand[0]["contacts"] if command == "detect" else by_hand["contacts"]
        assert list(rows_of(rows).values()) == list(rows_of(by_file).values())


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("-m", "m.toml"), "a machine file cannot be combined with a benchmark file"),
        (("--set=from=1s",), "--set from: unknown key"),
        (("-s", "s.json", "--set=threshold=limit"), "--set threshold: cannot be combined with a signature"),
        (("-s", "s.json", "--set=signature.rule=thesis"), "--set signature: cannot be combined with a signature"),
    ],
)
def test_what_a_benchmark_file_or_a_signature_has_of_its_own_is_refused(options, words):
    gate = SAMPLES / "gate"
    done = cdtool("detect", gate / "stiff" / "03.csv", "-b", gate / "benchmark.toml", "-d", "gm", *options)
    assert done.status == 2 and done.err.startswith(f"error: {words}"), done.err


def test_a_detector_is_required_if_the_file_has_several():
    file = SAMPLES / "gate" / "benchmark.toml"
    done = cdtool("explain", SAMPLES / "gate" / "stiff" / "03.csv", "--benchmark", file)
    assert done.status == 2 and "names 5 detectors (give --detectors, one of pure_inertia" in done.err
    done = cdtool("detect", SAMPLES / "gate" / "stiff" / "03.csv", "--benchmark", file, "-d", "vo")
    assert done.status == 2 and "does not name detector 'vo'" in done.err
    done = cdtool("detect", SAMPLES / "gate" / "stiff" / "03.csv", "-d", "pi")
    assert done.status == 2 and "no machine file is given (give --machine FILE or --benchmark FILE)" in done.err
