"""`cdtool study`: ranking of a machine's sensors, and the thesis's figures."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.command import cdtool

ROOT = Path(__file__).parents[3]
GATE = ROOT / "sample_logs" / "gate" / "machine.toml"
STUDY = ROOT / "docs" / "examples" / "gate_study.toml"
ARM = ROOT / "sample_logs" / "arm" / "trial_1" / "machine.toml"
ORDER = ["load_cell", "torque_sensor", "accelerometer", "motor_position", "motor_speed", "motor_torque"]

BARRIER = """
[machine]
type = "rotary_axis"
name = "barrier"
motor_inertia = {motor}
load_inertia = 12.0
transmission_ratio = 0.01
"""


def ranked(*arguments: object) -> dict[str, dict[str, object]]:
    done = cdtool("study", "sensors", *arguments, "--json")
    assert (done.status, done.err) == (0, ""), done.err
    return {item["sensor"]: item for item in json.loads(done.out)["sensors"]}


@pytest.fixture
def barrier(tmp_path: Path) -> Path:
    path = tmp_path / "barrier.toml"
    path.write_text(BARRIER.format(motor=0.0005), encoding="utf-8")
    return path


def test_the_gate_is_ranked_from_the_contact_to_the_controller():
    found = ranked("-m", GATE, "--set", "impact.speed=0.2", "--set", "impact.stiffness=5e5")
    assert list(found) == ORDER
    assert found["load_cell"]["time_ms"] < 2.0
    assert found["motor_torque"]["force_n"] > 10 * found["load_cell"]["force_n"]


def test_with_the_gates_own_values_the_ranking_is_near_the_latencies_of_the_thesis():
    found = ranked("-m", GATE, "--study", STUDY)
    order = list(found)
    assert order.index("accelerometer") < order.index("motor_speed") < order.index("motor_torque")
    # Thesis 5.2.4, stiff impact: PI 21 ms, GM (of the motor's speed) 76 ms, PT 186 ms, debounce included.
    assert 5.0 < found["accelerometer"]["time_ms"] < 21.0
    assert 40.0 < found["motor_speed"]["time_ms"] < 80.0
    assert 100.0 < found["motor_torque"]["time_ms"] < 190.0


def test_a_stiffer_drive_shows_the_impact_earlier_and_an_option_overrides_the_file():
    soft, stiff = (ranked("-m", GATE, "--study", STUDY, "--set", f"drive.stiffness={k}") for k in (8e4, 8e6))
    assert stiff["motor_speed"]["time_ms"] < 0.7 * soft["motor_speed"]["time_ms"]
    assert soft == ranked("-m", GATE, "--study", STUDY)


def test_a_larger_k_never_detects_earlier():
    low, high = (ranked("-m", GATE, "--set", f"k={k}") for k in (3, 8))
    assert all(low[name]["time_ms"] <= high[name]["time_ms"] for name in ORDER)
    assert low["motor_torque"]["time_ms"] < high["motor_torque"]["time_ms"]


def test_a_rotary_axis_is_referred_to_the_lever_of_its_contact(barrier, tmp_path):
    found = ranked("-m", barrier, "--set", "impact.lever=2.0", "--set", "impact.speed=0.5")
    assert set(found) == set(ORDER)
    # 12 kg m2 and 0.0005 / 0.01^2 = 5 kg m2 at 2 m: the same as 3 kg and 1.25 kg on a slide with r = 0.02 m/rad.
    slide = tmp_path / "slide.toml"
    slide.write_text(
        '[machine]\ntype = "linear_axis"\nmotor_inertia = 0.0005\nload_mass = 3.0\ntransmission_ratio = 0.02\n',
        encoding="utf-8",
    )
    assert ranked("-m", slide, "--set", "impact.speed=0.5") == found


@pytest.mark.parametrize(
    ("key", "values", "row"),
    [
        ("encoder.counts_per_turn", (16384, 4096, 1024, 256), ("motor_position", "motor_speed")),
        ("accelerometer.vibration", (0.0, 0.1, 0.4), ("accelerometer",)),
        ("accelerometer.noise_density", (0.0, 0.003, 0.02), ("accelerometer",)),
        ("motor_torque.noise", (1, 10, 50), ("motor_torque",)),
    ],
)
def test_a_coarser_or_noisier_sensor_is_never_earlier_and_moves_no_other_row(tmp_path, key, values, row):
    table, _, name = key.partition(".")
    found = []
    for value in values:
        (tmp_path / "study.toml").write_text(f"[sensors.{table}]\n{name} = {value}\n", encoding="utf-8")
        found.append(ranked("-m", GATE, "--study", tmp_path / "study.toml"))
    for sensor in ORDER:
        times = [one[sensor]["time_ms"] for one in found]
        if sensor in row:
            assert times == sorted(times) and times[0] < times[-1]
        else:
            assert len(set(times)) == 1


def test_a_joint_of_an_arm_is_studied_while_the_other_stands(tmp_path):
    # The forearm of the simulated arm: M22 without its motor, hit 0.3 m from the elbow, is that rotary axis.
    done = cdtool("study", "sensors", "-m", ARM, "--set", "joint=forearm", "--set", "impact.lever=0.3")
    assert done.status == 0
    assert "the other joints are at rest: 0.06984 kg m2 at forearm, without its motor" in done.out
    alone = tmp_path / "forearm.toml"
    alone.write_text(
        '[machine]\ntype = "rotary_axis"\nmotor_inertia = 1.5e-5\nload_inertia = 0.06984\n'
        "transmission_ratio = 0.016666666666666666\nviscous_friction = 0.00011111111111111112\n",
        encoding="utf-8",
    )
    same = ranked("-m", alone, "--set", "impact.lever=0.3")
    for name, found in ranked("-m", ARM, "--set", "joint=forearm", "--set", "impact.lever=0.3").items():
        assert found["time_ms"] == pytest.approx(same[name]["time_ms"], abs=1e-3)
        assert found["peak_so_far_n"] == pytest.approx(same[name]["peak_so_far_n"], rel=1e-3)


def test_a_derivative_part_and_a_force_limit_of_the_controller_count(tmp_path):
    def with_controller(lines: str) -> Any:
        (tmp_path / "study.toml").write_text(f"[controller]\n{lines}\n", encoding="utf-8")
        return json.loads(cdtool("study", "sensors", "-m", GATE, "--study", tmp_path / "study.toml", "--json").out)

    plain, quick, held = (with_controller(lines) for lines in ("", "derivative = 200", "force_limit = 1200"))
    torque = {name: one["sensors"][-1] for name, one in (("plain", plain), ("quick", quick), ("held", held))}
    assert {one["sensor"] for one in torque.values()} == {"motor_torque"}
    assert torque["quick"]["time_ms"] < torque["plain"]["time_ms"] == pytest.approx(torque["held"]["time_ms"])
    # Without a limit the controller force keeps growing; with it the load's own oscillation is the largest.
    assert plain["peak_time_ms"] > 400.0 and held["peak_time_ms"] < 100.0
    assert held["peak_force_n"] < 0.85 * plain["peak_force_n"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--set", "impact.speed=0"), "--set impact.speed: is 0"),
        (("--set", "impact.stiffness=-1"), "--set impact.stiffness: is -1"),
        (("--set", "impact.stiffness=nan"), "--set impact.stiffness: is nan"),
        (("--set", "k=0"), "--set k: is 0"),
        (("--set", "impact.lever=1"), "a lever is given for a linear axis"),
        (("--set", "joint=gat"), "no joint 'gat' (did you mean gate?"),
        (("--study", "absent.toml"), "absent.toml: no such file"),
        (("--study", "wrong.toml"), "wrong.toml: sensors.encoder.counts: unknown key (did you mean counts_per_turn?"),
        (("--study", "kind.toml"), "kind.toml: impact: is 3"),
        (("--study", "limit.toml"), "controller.force_limit is 5 N, but steady motion requires 30 N"),
        (("--study", "negative.toml"), "negative.toml: sensors.load_cell.noise: is -1"),
        (("-o", "ranking.txt"), "--output is 'ranking.txt'"),
    ],
)
def test_invalid_input_exits_with_2_and_one_line(tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wrong.toml").write_text("[sensors.encoder]\ncounts = 10\n", encoding="utf-8")
    (tmp_path / "kind.toml").write_text("impact = 3\n", encoding="utf-8")
    (tmp_path / "limit.toml").write_text("[controller]\nforce_limit = 5\n", encoding="utf-8")
    (tmp_path / "negative.toml").write_text("[sensors.load_cell]\nnoise = -1\n", encoding="utf-8")
    done = cdtool("study", "sensors", "-m", GATE, *arguments)
    assert done.status == 2 and done.out == ""
    assert message in done.err and done.err.count("\n") == 1


def test_a_machine_without_inertias_is_refused(tmp_path):
    bare = tmp_path / "bare.toml"
    bare.write_text(BARRIER.format(motor=0.0), encoding="utf-8")
    done = cdtool("study", "sensors", "-m", bare)
    assert done.status == 2 and "machine.motor_inertia is missing or 0" in done.err
    done = cdtool("study", "sensors", "-m", ROOT / "docs" / "examples" / "ur10e.toml", "--set", "joint=elbow")
    assert done.status == 2 and "coordinates = 'motor' with motor_inertia" in done.err
    done = cdtool("study", "sensors", "-m", ROOT / "docs" / "examples" / "scara.toml")
    assert done.status == 2 and "must all rotate or all slide" in done.err
    done = cdtool("study", "sensors", "-m", ARM)
    assert done.status == 2 and "2 joints (set joint to one of them: arm, forearm)" in done.err
    done = cdtool("study", "sensors", "-m", ARM, "--set", "joint=arm")
    assert done.status == 2 and "no lever is given" in done.err


def test_the_order_of_the_thesis_does_not_always_hold(tmp_path):
    stiff = tmp_path / "stiff.toml"
    stiff.write_text(
        "[drive]\nstiffness = 5e7\n[controller]\nproportional = 3e4\nintegral = 1e5\n"
        "[sensors.accelerometer]\nvibration = 0.3\n",
        encoding="utf-8",
    )
    assert list(ranked("-m", GATE, "--study", stiff))[-1] == "accelerometer"
