"""What the outputs of an identification show: unseen runs, starts, controller; and the files by suffix."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import cdtool
from cdtool.base.errors import UsageError
from cdtool.commands.identify.axis.rigid_axis import identify_rigid_axis
from cdtool.commands.identify.axis.speed_controller import identify_controller
from cdtool.commands.identify.axis.two_mass import TwoMassSettings, identify_two_mass
from cdtool.commands.identify.estimate import Missing
from cdtool.commands.identify.files import check_identification_files, write_identification
from cdtool.commands.identify.identification_outputs import (
    JointEvidence,
    compare_controller,
    compare_starts,
    evidence_of,
    identification_summary,
    plan_of,
    predict_unseen,
)
from cdtool.commands.identify.identifying import IdentifiedMachine
from cdtool.machines.axis_model.axis_run import AxisRun
from tests.command import cdtool as command
from tests.data_folder import DATA, needs_data
from tests.synthetic.gate_runs import GATE as PARAMETERS
from tests.synthetic.gate_runs import free_runs

ROOT = Path(__file__).parents[3]
GATE = ROOT / "sample_logs" / "gate"
LOGS = [GATE / "free" / f"0{number}.csv" for number in (3, 4, 5)]


@pytest.fixture(scope="module")
def identified() -> tuple[IdentifiedMachine, tuple[JointEvidence, ...]]:
    done = cdtool.identify(LOGS, GATE / "machine.toml")
    return done, evidence_of(done, LOGS, GATE / "machine.toml")


@pytest.fixture(scope="module")
def runs() -> Sequence[AxisRun]:
    return free_runs(PARAMETERS, 404, 3)


def test_the_run_that_is_described_worst_is_left_out_and_predicted(runs: Sequence[AxisRun]) -> None:
    heavy = replace(runs[1], torque=runs[1].torque + 60.0 * (np.abs(runs[1].speed) > 0.02))  # type: ignore[arg-type]
    changed = [runs[0], heavy, runs[2]]
    unseen = predict_unseen(identify_rigid_axis(changed, PARAMETERS.motor_mass), changed)
    assert unseen is not None
    assert unseen.run == heavy.name
    assert unseen.of_runs == 3
    # The other runs do not contain the 60 N: that is what the residual shows.
    moving = unseen.moving & np.isfinite(unseen.residual)
    assert np.mean(unseen.residual[moving]) == pytest.approx(60.0, abs=12.0)
    assert unseen.moving_error > 50.0


def test_of_a_single_run_only_the_part_that_was_left_out_is_shown(runs: Sequence[AxisRun]) -> None:
    unseen = predict_unseen(identify_rigid_axis(runs[:1], PARAMETERS.motor_mass), runs[:1])
    assert unseen is not None
    assert unseen.of_runs == 1
    shown = np.isfinite(unseen.residual)
    assert 0.2 < np.mean(shown) < 0.5
    assert np.flatnonzero(shown)[0] > 0.5 * len(shown)


def test_the_starts_follow_the_model_and_a_wrong_drive_shows(runs: Sequence[AxisRun]) -> None:
    fit = identify_two_mass(runs, TwoMassSettings(motor_mass=PARAMETERS.motor_mass))
    (start,) = compare_starts(fit)
    error = np.sqrt(np.mean((start.measured["torque"] - start.modelled["torque"]) ** 2))
    assert start.count == 3
    assert error < 0.05 * np.max(np.abs(start.measured["torque"]))
    assert start.time[0] == pytest.approx(-0.3)
    soft = replace(fit, model=replace(fit.model, drive=replace(fit.model.drive, stiffness=2e4)))
    (wrong,) = compare_starts(soft)
    assert np.sqrt(np.mean((wrong.measured["torque"] - wrong.modelled["torque"]) ** 2)) > 2.0 * error


def test_the_computed_command_is_the_logged_one_and_a_wrong_gain_shows(runs: Sequence[AxisRun]) -> None:
    fit = identify_controller(runs)
    compared = compare_controller(fit, runs)
    assert compared is not None
    assert compared.is_command
    assert np.max(np.abs(compared.measured - compared.computed)) < 1e-3
    assert fit.controller is not None
    wrong = compare_controller(replace(fit, controller=replace(fit.controller, integral_gain=9000.0)), runs)
    assert wrong is not None
    assert np.max(np.abs(wrong.measured - wrong.computed)) > 5.0


def test_without_references_there_is_no_command_to_compute(runs: Sequence[AxisRun]) -> None:
    fit = identify_controller(runs)
    bare = [replace(run, reference_speed=None) for run in runs]
    assert compare_controller(fit, bare) is None
    assert compare_controller(replace(fit, controller=None), runs) is None


def test_the_plan_of_the_gate_names_speeds_and_the_other_direction(
    identified: tuple[IdentifiedMachine, tuple[JointEvidence, ...]],
) -> None:
    (joint,) = identified[0].joints
    plans = {plan.missing: plan for plan in plan_of(joint)}
    assert plans[Missing.SECOND_SPEED].directions == (1, -1)
    assert all(0.05 < speed < 0.2 for speed in plans[Missing.SECOND_SPEED].speeds)
    assert plans[Missing.REVERSALS].directions == (-1,)
    assert plans[Missing.REVERSALS].travel == pytest.approx(1.43, rel=0.1)


def test_a_drive_without_the_motors_inertia_has_it_in_the_plan_and_another_refusal_has_no_motion(
    identified: tuple[IdentifiedMachine, tuple[JointEvidence, ...]], runs: Sequence[AxisRun]
) -> None:
    (joint,) = identified[0].joints
    for motor_mass, wanted in ((0.0, [Missing.MOTOR_INERTIA]), (PARAMETERS.motor_mass, [])):
        refused = replace(
            joint, rigid=identify_rigid_axis(runs, motor_mass), two_mass=None, refused={"two_mass": "ends at a bound"}
        )
        plans = [plan for plan in plan_of(refused) if "model.drive.stiffness" in plan.keys]
        assert [plan.missing for plan in plans] == wanted


def test_all_outputs_are_written_together(
    identified: tuple[IdentifiedMachine, tuple[JointEvidence, ...]], tmp_path: Path
) -> None:
    targets = [tmp_path / f"identified{suffix}" for suffix in (".toml", ".html", ".json")]
    write_identification(*identified, targets)
    toml, page, values = (target.read_text(encoding="utf-8") for target in targets)
    assert toml == identified[0].text
    assert page.count("data:image/png;base64,") == 4
    for words in ("Excitation plan", "Prediction of unseen runs", "machine.viscous_friction", "condition number"):
        assert words in page
    assert "<script" not in page
    assert not re.search(r"(src|href)=\"(?!data:|#)", page)
    joint = json.loads(values)["joints"][0]
    assert joint["plan"][0]["missing"] == "second_speed"
    assert joint["unseen_run"]["moving_error"] > 0.0
    assert joint["excitation"]["speeds"] == pytest.approx([0.2], rel=0.05)
    # A report and a JSON may be rewritten, a machine file may not.
    check_identification_files(targets[1:], GATE / "machine.toml")
    with pytest.raises(UsageError, match="already exists"):
        check_identification_files(targets[:1], GATE / "machine.toml")


def test_an_output_that_cannot_be_written_leaves_no_other(
    identified: tuple[IdentifiedMachine, tuple[JointEvidence, ...]], tmp_path: Path
) -> None:
    with pytest.raises(UsageError):
        write_identification(*identified, [tmp_path / "m.toml", tmp_path / "no_folder" / "m.json"])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (["a.pdf"], "a.pdf"),
        (["a"], "a"),
        (["a.html", "a.html"], "twice"),
        (["nowhere/a.html"], "no folder"),
        (["foreign.html"], "contains no HTML report"),
        (["foreign.json"], "contains no results"),
    ],
)
def test_a_wrong_output_is_refused_before_anything_is_read(tmp_path: Path, names: list[str], message: str) -> None:
    for suffix in (".html", ".json"):
        (tmp_path / f"foreign{suffix}").write_text("of another program", encoding="utf-8")
    before = sorted(tmp_path.iterdir())
    outputs = [part for name in names for part in ("-o", tmp_path / name)]
    done = command("identify", "no_such_log.csv", "-m", GATE / "machine.toml", *outputs)
    assert done.status == 2
    assert len(done.err.strip().splitlines()) == 1
    assert message in done.err
    assert sorted(tmp_path.iterdir()) == before


def test_the_names_of_logs_and_machines_are_text_in_the_page(
    identified: tuple[IdentifiedMachine, tuple[JointEvidence, ...]], tmp_path: Path
) -> None:
    done, evidence = identified
    hostile = replace(done, machine="<script>alert(1)</script>")
    write_identification(hostile, evidence, [tmp_path / "page.html"])
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "<script" not in page
    assert "&lt;script&gt;" in page


def test_a_machine_without_fits_has_a_page_too(
    identified: tuple[IdentifiedMachine, tuple[JointEvidence, ...]], tmp_path: Path
) -> None:
    done = identified[0]
    bare = replace(done, joints=(replace(done.joints[0], rigid=None, two_mass=None, controller=None),))
    evidence = evidence_of(bare, ["not read"], "not read")
    write_identification(bare, evidence, [tmp_path / "page.html"])
    assert "data:image" not in (tmp_path / "page.html").read_text(encoding="utf-8")
    assert identification_summary(bare, evidence)["joints"][0]["plan"] == []


def test_a_robots_page_has_the_errors_of_its_joints_and_the_machine_file_is_written(tmp_path: Path) -> None:
    arm = ROOT / "sample_logs" / "arm" / "trial_1"
    outputs = ["-o", tmp_path / "arm.html", "-o", tmp_path / "arm.toml"]
    done = command("identify", arm / "free" / "0[1-4].*", "-m", arm / "machine.toml", *outputs)
    assert done.status == 0
    assert "new: viscous and Coulomb friction" in done.out
    assert "old: the joint does not move" in done.out
    assert "plan: 4 runs backward at " in done.out
    assert f"written: {tmp_path / 'arm.toml'} (machine file)" in done.out
    page = (tmp_path / "arm.html").read_text(encoding="utf-8")
    assert "Torque that is not explained" in page
    assert "Logged motion of each joint" in page
    assert page.count("data:image/png;base64,") == 2
    assert "forearm" in page
    assert (tmp_path / "arm.toml").exists()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--payload", 2.0], "belong together"),
        (["--loaded-logs", "x.csv"], "belong together"),
        (["--loaded-logs", "x.csv", "--payload", 2.0, "--by", "day"], "--by with logs of a payload or of contacts"),
        (["--loaded-logs", "x.csv", "--payload", -2.0], "--payload is -2"),
        (["--payload-link", "hand"], "--payload-link without --payload"),
        (["--payload-centre", "0,0,1"], "--payload-centre without --payload"),
        (["--loaded-logs", "x.csv", "--payload", 2.0, "--payload-centre", "0,1"], "--payload-centre is '0,1'"),
        (["--loaded-logs", "x.csv", "--payload", 2.0, "--payload-centre", "0,inf,1"], "--payload-centre is '0,inf,1'"),
        (["--loaded-logs", "x.csv", "--payload", 2.0, "--payload-link", ""], "--payload-link is empty"),
    ],
)
def test_a_payload_without_its_logs_is_one_line(options: list[object], message: str) -> None:
    done = command("identify", LOGS[0], "-m", GATE / "machine.toml", *options)
    assert done.status == 2
    assert len(done.err.strip().splitlines()) == 1
    assert message in done.err


@needs_data("emps")
def test_the_unseen_part_of_the_real_axis_is_predicted_within_the_required_error() -> None:
    assert DATA is not None
    machine = ROOT / "docs" / "examples" / "emps.toml"
    done = cdtool.identify([DATA / "emps" / "DATA_EMPS.mat"], machine)
    (evidence,) = evidence_of(done, [DATA / "emps" / "DATA_EMPS.mat"], machine)
    assert evidence.unseen is not None
    assert evidence.unseen.moving_error < 1.65
    assert evidence.controller is not None
    difference = evidence.controller.measured - evidence.controller.computed
    assert np.sqrt(np.mean(difference**2)) < 0.5
