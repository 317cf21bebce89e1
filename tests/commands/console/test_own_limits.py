"""Limits from the run's own first seconds (threshold `baseline`): without runs to learn from, and stroke by stroke."""

import json

import numpy as np
import pytest

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import judge_log
from cdtool.detectors.detection import Signal, Status
from cdtool.recordings.operations import operations_of
from cdtool.recordings.recording import Recording, Series
from cdtool.thresholds.baseline import Baseline
from tests.command import cdtool, one_line

BENCHMARK = """machine = "machine.toml"
detectors = ["gm", "feekf"]
threshold = {{ name = "baseline", warm_up = 0.8 }}
{learn}
[holdout]
logs = ["holdout/*.csv"]
[impacts.stiff]
logs = ["stiff/*.csv"]
[onset]
above_n = 20.0
back_to_n = 8.0
"""


def own(seconds):
    """Return the options of limits from the first seconds."""
    return ("--set=threshold.name=baseline", f"--set=threshold.warm_up={seconds}")


@pytest.mark.parametrize("learn", ["", '[learn]\nlogs = ["free/*.csv"]'])
def test_a_benchmark_needs_no_runs_to_learn_from_and_ignores_them_for_the_limits(gate_folder, tmp_path, learn):
    file = gate_folder / f"own{bool(learn)}.toml"
    file.write_text(BENCHMARK.format(learn=learn), encoding="utf-8")
    done = cdtool("benchmark", file, "-o", tmp_path / "r.json")
    assert done.status == 0, done.err
    results = json.loads((tmp_path / "r.json").read_text(encoding="utf-8"))
    outcomes = [row["outcome"] for row in results["contacts"]]
    assert outcomes and set(outcomes) == {"detected"} and results["false_alarms"] == []
    assert results["provenance"]["threshold_rule"] == {
        "safety_factor": 10.0,
        "warm_up": 0.8,
        "sides": "one",
        "widen": False,
    }
    assert bool(results["provenance"]["learned_runs"]) is False


def test_detect_and_explain_use_the_first_seconds_with_warm_up(gate_folder):
    log, machine = gate_folder / "stiff" / "01.csv", gate_folder / "machine.toml"
    done = cdtool("detect", log, "-m", machine, "-d", "gm", *own(0.8))
    assert done.status == 0 and "threshold 'baseline', from each run itself" in one_line(done.out)
    why = cdtool("explain", log, "-m", machine, "-d", "gm", *own(0.8))
    assert why.status == 0 and "the limits are those of the run's own first seconds" in one_line(why.out)
    late = cdtool("detect", log, "-m", machine, "-d", "gm", *own(60))
    assert late.status == 3 and "not assessable" in late.out and "start-up 100 %" in one_line(late.out)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (own(1), "no detector is given"),
        ((*own(0), "-d", "gm"), "--set threshold.warm_up: is 0"),
        ((*own(1), "--set=threshold.limits=40", "-d", "gm"), "--set threshold.limits: unknown key"),
        (("-d", "gm"), "no threshold is given (give --signature FILE, or set threshold.limits"),
        (("-d", "gm", "--set=threshold=cusum"), "--set threshold: 'cusum' is learned from impact-free runs"),
    ],
)
def test_a_wrong_combination_is_one_line(gate_folder, arguments, words):
    done = cdtool("detect", gate_folder / "stiff" / "01.csv", "-m", gate_folder / "machine.toml", *arguments)
    assert done.status == 2 and words in one_line(done.err) and "Traceback" not in done.err


def there_and_back():
    """A slide that moves forward and backward with friction that no model knows; a contact on the way back."""
    rng = np.random.default_rng(9)
    time = np.arange(2000) / 100.0
    speed = np.select([(time > 1) & (time < 9), (time > 10) & (time < 19)], [0.5, -0.5], 0.0)
    signal = 10.0 * np.sign(speed) + 0.3 * rng.standard_normal(len(time))
    signal[1500:1600] -= 8.0
    speed = speed + 1e-3 * rng.standard_normal(len(time))
    recording = Recording("slide", "slide.csv", ("slide",), {"speed": Series(time, speed, "m/s")})
    return recording, Signal(time, signal[:, np.newaxis], np.zeros((2000, 1), dtype=np.uint8), "N", joints=("slide",))


def detections(how, sides):
    recording, signal = there_and_back()
    limits = Baseline(sides=sides).fit([])
    return judge_log(operations_of(recording, how), "any", signal, (limits,), Activation(), 1.0)


def test_each_stroke_of_a_log_that_is_cut_has_limits_of_its_own():
    forward, back = detections("motion", "one")
    assert forward.verdict.outcome == "no alarm"
    assert [round(alarm.time, 1) for alarm in back.verdict.alarms][:1] == [15.0]
    assert back.statistic.status[(back.statistic.time > 10.2) & (back.statistic.time < 11.0)].all()
    assert Status.OTHER_SPEED not in np.unique(back.statistic.status)


@pytest.mark.parametrize("limits", ["15", "[15]"])
def test_a_limit_set_by_hand_needs_no_runs_to_learn_from(gate_folder, tmp_path, limits):
    file = gate_folder / "by_hand.toml"
    text = BENCHMARK.format(learn="").replace('name = "baseline", warm_up = 0.8', f'name = "limit", limits = {limits}')
    file.write_text(text.replace('["gm", "feekf"]', '["gm"]'), encoding="utf-8")
    done = cdtool("benchmark", file, "-o", tmp_path / "r.json")
    assert done.status == 0, done.err
    rows = json.loads((tmp_path / "r.json").read_text(encoding="utf-8"))["contacts"]
    assert {(row["outcome"], row["limit"]) for row in rows} == {("detected", -15.0)}
    done = cdtool("detect", gate_folder / rows[0]["recording"], "--benchmark", file)
    assert done.status == 0 and "set by hand" in one_line(done.out), done.err


def test_a_contact_that_halts_the_axis_is_judged_by_the_limits_of_its_stroke():
    recording, signal = there_and_back()
    time = signal.time
    speed = recording["speed"].values[:, 0] * (time < 5.0)
    rising = np.where(time < 5.0, signal.values[:, 0], 10.0 + 30.0 * (time - 5.0))
    halted = Recording("slide", "slide.csv", ("slide",), {"speed": Series(time, speed, "m/s")})
    pressed = signal.changed(values=rising[:, np.newaxis])
    limits = (Baseline(sides="one").fit([]),)
    found = judge_log(operations_of(halted, "motion"), "any", pressed, limits, Activation(), 1.0)
    assert 5.0 < found[0].verdict.alarms[0].time < 5.3


def test_a_log_that_is_not_cut_keeps_the_limits_of_its_first_seconds_and_monitors_the_present_direction():
    (whole,) = detections("whole", "one")
    assert 10.0 <= whole.verdict.alarms[0].time < 10.2, "unknown friction changes sign"
    (both,) = detections("whole", "two")
    assert 9.0 <= both.verdict.alarms[0].time < 9.2, "unknown friction ends with the motion"
