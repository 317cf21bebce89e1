"""`cdtool explain` from a user's view."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path

import pytest

import cdtool as api
from tests.command import Outcome, cdtool

GATE = Path(__file__).parents[3] / "sample_logs" / "gate"

LIMIT = "--set=threshold.limits="


@pytest.fixture
def explain(gate_folder: Path) -> Callable[..., Outcome]:
    def run(log: str, *arguments: object) -> Outcome:
        return cdtool("explain", gate_folder / log, "-m", gate_folder / "machine.toml", *arguments)

    return run


def margins(text: str) -> list[list[float]]:
    """The number rows of the printed tables."""
    rows = [line.split() for line in text.splitlines()]
    return [[float(cell) for cell in row] for row in rows if row and all(is_number(cell) for cell in row)]


def is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def test_a_detected_contact_is_explained_with_joint_limit_margins_and_first_mover(explain, feekf_signature, tmp_path):
    plot = tmp_path / "why.svg"
    done = explain("stiff/01.csv", "-s", feekf_signature, "--plot", plot)
    assert done.status == 0 and done.err == ""
    told = " ".join(done.out.split())
    assert "ms after the contact (onset at" in told and "load cell)" in told
    assert "gate: above its upper limit" in told and "debounce: 9 consecutive samples outside" in told
    assert "Moved first: acceleration down" in told
    assert "Compared with 11 impact-free runs at the same position in the motion." in told
    assert "reference_torque up" in told and "No departure: reference_speed (farthest 0.2 against 0.2 +- " in told
    assert "speed down" in told and " speed (" not in told.partition("No departure:")[2]
    rows = margins(done.out)
    assert [row[1] for row in rows if row[0] != 0.0] == pytest.approx([-100, -50, -20, -10, -5, 0])
    for _, _, signal, limit, margin, share in rows:
        assert margin == pytest.approx(limit - signal, abs=1.1)  # both are printed with four digits
        assert (margin < 0.0) == (share > 100.0)
    assert max(map(len, done.out.splitlines())) <= 100
    assert f"written: {plot}" in done.out and plot.read_text().count("<svg") == 1


def test_a_missed_contact_is_explained_with_its_closest_approach(explain):
    done = explain("soft/02.csv", "-d", "pi", "--set=threshold.limits=30")
    told = " ".join(done.out.split())
    assert done.status == 0
    assert "missed: no alarm within 1000 ms" in told
    assert "from its limit of" in told and "For 9 consecutive samples it was at" in told
    assert "Moved first: " in told and "speed down" in told
    assert max(map(len, done.out.splitlines())) <= 100


def test_a_log_without_events_states_that_there_is_nothing_to_explain(explain, feekf_signature, tmp_path):
    done = explain("holdout/01.csv", "-s", feekf_signature, "--plot", tmp_path / "why.png")
    assert done.status == 0 and "no alarm and no missed contact" in " ".join(done.out.split())
    assert list(tmp_path.iterdir()) == []


def test_the_json_is_strict_and_contains_every_number(explain):
    done = explain("soft/01.csv", "-d", "pi", "--set=threshold.limits=30", "--json")
    values = json.loads(done.out, parse_constant=lambda name: pytest.fail(name))
    (missed,) = values["missed"]
    assert values["alarms"] == [] and values["verdicts"][0]["verdict"] == "no alarm"
    near = missed["approaches"][0]
    assert missed["role"] == "missed" and missed["debounce"] == 9
    assert near["nearest"]["margin"] == pytest.approx(30.0 - abs(near["nearest"]["statistic"]))
    assert near["nearest"]["share"] == pytest.approx(abs(near["nearest"]["statistic"]) / 30.0)
    assert near["latched_from"] is None
    still = [item for item in missed["departed"] if item["time"] is None]
    assert {item["reason"] for item in still} == {"no departure"}
    assert missed["absent"] == "limits set by hand" and missed["runs"] == 0


def test_a_spike_is_named_on_screen_and_in_the_json(explain, gate_folder, feekf_signature):
    log = gate_folder / "spike.csv"
    head, *rows = (GATE / "holdout" / "03.csv").read_text().splitlines()
    speed = head.split(",").index("n_motor")
    for k in range(4000, 4006):
        cells = rows[k].split(",")
        cells[speed] = f"{float(cells[speed]) - 900.0:.6g}"
        rows[k] = ",".join(cells)
    log.write_text("\n".join((head, *rows)) + "\n")
    arguments = ("spike.csv", "-s", feekf_signature, "--set=activation.debounce=2")
    (alarm, *_) = json.loads(explain(*arguments, "--json").out)["alarms"]
    (found,) = alarm["glitches"]
    assert (found["kind"], found["channel"], found["joint"], found["samples"]) == ("spike", "speed", "gate", 6)
    assert found["end"] - found["start"] == pytest.approx(0.005) and found["unit"] == "m/s"
    assert "Spike of speed of gate: -0.1" in " ".join(explain(*arguments).out.split())


def test_the_alarm_in_the_json_is_that_of_detect(explain, feekf_signature, gate_folder):
    (alarm,) = json.loads(explain("stiff/01.csv", "-s", feekf_signature, "--json").out)["alarms"]
    machine = ("-m", gate_folder / "machine.toml", "-s", feekf_signature, "--json")
    (detected,) = json.loads(cdtool("detect", gate_folder / "stiff/01.csv", *machine).out)
    (shown,) = detected["alarms"]
    for key in ("joint", "side", "statistic", "limit"):
        assert alarm["alarm"][key] == shown[key]
    assert alarm["alarm"]["time"] == shown["time_s"] and alarm["role"] == "detection"
    assert alarm["contact"]["start"] == detected["contacts"][0]["onset_s"]
    assert alarm["alarm"]["time"] - alarm["left"] == pytest.approx(0.008)


def test_an_arm_is_explained_joint_by_joint():
    arm = GATE.parent / "arm" / "trial_1"
    command = ("explain", arm / "stiff" / "01.csv", "-m", arm / "machine.toml", "-d", "gm")
    done = cdtool(*command, "--set=threshold.limits=4", "--json")
    (alarm,) = json.loads(done.out)["alarms"]
    assert alarm["joint"] == "arm" and {item["joint"] for item in alarm["departed"]} == {"arm"}
    assert alarm["departed"][0]["channel"] == "acceleration"
    assert "position" in alarm["inputs"]  # a model of coupled links requires the pose


@pytest.mark.parametrize(
    ("log", "arguments", "words"),
    [
        ("stiff/01.csv", f"{LIMIT}250", ("no detector is given",)),
        ("stiff/01.csv", "-d gm", ("no threshold is given",)),
        ("stiff/01.csv", f"-d gm,pi {LIMIT}3", ("give one name",)),
        ("stiff/01.csv", f"-d gm {LIMIT}many", ("--set threshold.limits: is 'many'",)),
        ("stiff/01.csv", f"-d gmm {LIMIT}3", ("gmm", "did you mean gm")),
        ("stiff/01.csv", f"-d gm {LIMIT}3 --plot why.gif", ("why.gif", ".svg")),
        ("stiff/01.csv", f"-d gm {LIMIT}3 --set=activation.debounce=0", ("activation.debounce", "from 1 to 1e+09")),
        ("stiff/01.csv", f"-d gm {LIMIT}3 --set=joints=elbow", ("elbow", "gate")),
        ("stiff/none.csv", f"-d gm {LIMIT}3", ("none.csv", "no such file")),
        # The figure's folder is checked before the log.
        ("stiff/none.csv", f"-d gm {LIMIT}3 --plot absent/why.png", ("no folder absent", "create")),
        ("stiff/01.csv", f"-d gm {LIMIT}inf", ("--set threshold: limits are [inf", "no joint is monitored")),
        ("stiff/01.csv", f"-d gm {LIMIT}inf,inf", ("--set threshold: limits are [inf", "no joint is monitored")),
        ("machine.toml", f"-d gm {LIMIT}3", ("machine.toml",)),
    ],
)
def test_bad_input_is_one_line_and_status_2(explain, log, arguments, words):
    done = explain(log, *arguments.split())
    assert done.status == 2 and done.out == ""
    assert done.err.startswith("error: ") and done.err.count("\n") == 1, done.err
    assert all(word in done.err for word in words), done.err


def test_the_same_explanation_comes_from_python(gate_folder, feekf_signature, explain):
    from cdtool.report.explanation_words import words

    explained = api.explain(gate_folder / "stiff/01.csv", gate_folder / "machine.toml", signature=feekf_signature)
    ((_, event),) = explained.events
    (alarm,) = json.loads(explain("stiff/01.csv", "-s", feekf_signature, "--json").out)["alarms"]
    assert alarm["words"] == words(event) and alarm["alarm"]["time"] == event.alarm.time


def test_a_benchmark_compares_its_events_with_the_runs_learned_from(gate_folder):
    done = api.benchmark(gate_folder / "benchmark.toml", detectors=["pt"])
    told = [line for trace in done.traces for panel in trace.panels for line in panel.why]
    assert any(line.startswith("Compared with 11 impact-free runs") for line in told), told[:5]
    assert any(line.startswith("Moved first: acceleration down") for line in told)


def test_an_update_of_the_signature_updates_what_is_normal_too(gate_folder, feekf_signature, tmp_path):
    copy = tmp_path / "gate.json"
    copy.write_bytes(feekf_signature.read_bytes())
    before = json.loads(copy.read_text())["normal_motion"][0]
    done = cdtool("signature", "update", copy, gate_folder / "holdout" / "01.csv", "-m", gate_folder / "machine.toml")
    assert done.status == 0, done.err
    after = json.loads(copy.read_text())["normal_motion"][0]
    one, other = (item["torque"]["by_position"]["mean"][50][0] for item in (before, after))
    assert one != other and other == pytest.approx(one, rel=0.05)
