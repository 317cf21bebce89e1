"""A simulated machine that has changed: what changes, by how much, and what stays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import cdtool
from cdtool.commands.simulate.arm_model import simulate_arm_run
from cdtool.commands.simulate.arm_parameters import ArmParameters
from cdtool.commands.simulate.changed_machine import FLUX_PER_KELVIN, ChangedMachine
from cdtool.commands.simulate.gate_model import GateParameters, GateRun, simulate_gate_run
from cdtool.formats.machine_file import read_machine_file
from tests.command import cdtool as command
from tests.command import keys

ONE_RUN = keys(free=1, holdout=0, stiff=0, soft=0)
GATE, ARM = GateParameters(), ArmParameters()
# Without what differs from run to run, so that levels can be compared with closed forms.
QUIET = replace(
    GATE,
    friction_waviness=0.0,
    friction_scatter=0.0,
    disturbance_force=0.0,
    cogging_force=0.0,
    torque_noise=0.0,
    panel_acceleration=0.0,
    accelerometer_noise=0.0,
)


def gate_run(changed: ChangedMachine, impact: str = "none", new: GateParameters = QUIET) -> GateRun:
    run = simulate_gate_run(changed.gate(new), np.random.default_rng(1), impact)  # type: ignore[arg-type]
    return changed.logged_gate(run, 0.5)


def settled(run: GateRun) -> slice:
    return slice(int(0.7 * len(run.time)), int(0.95 * len(run.time)))


def test_no_change_leaves_every_number_as_it_is():
    assert ChangedMachine().gate(GATE) == GATE
    assert ChangedMachine().arm(ARM) == ARM


def test_friction_changes_the_force_at_constant_speed_by_its_part():
    levels = {factor: gate_run(ChangedMachine(friction=factor)).motor_force for factor in (1.0, 1.2)}
    friction = GATE.coulomb_friction + GATE.viscous_friction * GATE.nominal_speed
    at = settled(gate_run(ChangedMachine()))
    assert np.mean(levels[1.2][at] - levels[1.0][at]) == pytest.approx(0.2 * friction, rel=0.02)


def test_sensors_and_heat_change_what_is_logged_and_not_the_motion():
    before = gate_run(ChangedMachine())
    offset = gate_run(ChangedMachine(current_offset=0.3, acceleration_offset=0.2))
    warm = gate_run(ChangedMachine(warming=10.0))
    for run in (offset, warm):
        assert np.array_equal(run.leaf_position, before.leaf_position)
    assert offset.motor_torque - before.motor_torque == pytest.approx(0.15, rel=1e-9)
    assert np.mean(offset.acceleration - before.acceleration) == pytest.approx(0.2, abs=2e-3)
    assert warm.motor_torque == pytest.approx(before.motor_torque / (1.0 + 10.0 * FLUX_PER_KELVIN), rel=1e-9)
    assert np.array_equal(offset.reference_torque, before.reference_torque)
    assert np.max(np.abs(warm.reference_torque)) > np.max(np.abs(before.reference_torque))


def test_an_arm_has_other_friction_mass_and_offsets():
    changed = ChangedMachine(friction=0.8, mass=1.1, current_offset=0.2, acceleration_offset=0.1)
    arm = changed.arm(ARM)
    assert arm.coulomb_friction == pytest.approx((2.0, 1.32)) and arm.viscous_friction == pytest.approx(0.32)
    assert arm.link_mass == pytest.approx((1.43, 1.76)) and arm.imu_bias == pytest.approx(0.12)
    run = simulate_arm_run(arm, np.random.default_rng(3), 1, "none")
    assert changed.logged_arm(run, 0.05).motor_torque - run.motor_torque == pytest.approx(0.01)


def test_the_machine_file_is_that_of_the_unchanged_machine(tmp_path):
    done = command("simulate", "gate", *ONE_RUN, "--set", "mass=1.5", "-o", tmp_path / "g")
    assert done.status == 0
    assert read_machine_file(tmp_path / "g" / "machine.toml").machine.load_inertia[0] == pytest.approx(620.0)
    heavier = cdtool.read(tmp_path / "g" / "free" / "01.csv", tmp_path / "g" / "machine.toml")
    cdtool.simulate_gate(tmp_path / "h", {"free": 1}, seed=1)
    as_before = cdtool.read(tmp_path / "h" / "free" / "01.csv", tmp_path / "h" / "machine.toml")
    assert not np.array_equal(heavier["torque"].values, as_before["torque"].values)
    refused = command("simulate", "arm", "--set", "friction=0", "-o", tmp_path / "a")
    assert refused.status == 2 and "--set friction: is 0" in refused.err and not (tmp_path / "a").exists()
