"""The simulated gate: its mechanics against closed forms and balances, its sensors against their definitions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from cdtool.commands.simulate import sensors
from cdtool.commands.simulate.gate_model import (
    Array,
    GateParameters,
    GateRun,
    Impact,
    integrate_gate,
    simulate_gate_run,
)

GATE = GateParameters()
QUIET = replace(
    GATE,
    resolver_counts=0,
    cogging_force=0.0,
    disturbance_force=0.0,
    torque_noise=0.0,
    panel_acceleration=0.0,
    accelerometer_noise=0.0,
    load_cell_noise=0.0,
)
"""Without noise, quantiser and cogging: what remains converges with the step."""
PASSIVE = replace(QUIET, speed_gain=0.0, integral_gain=0.0)
LOSSLESS = replace(
    PASSIVE,
    take_up_damping=0.0,
    drive_damping=0.0,
    post_damping=0.0,
    load_cell_damping=0.0,
    bumper_damping=0.0,
    motor_friction=0.0,
    coulomb_friction=0.0,
    static_friction=0.0,
    viscous_friction=0.0,
)


@cache
def run_of(impact: Impact, seed: int = 1) -> GateRun:
    return simulate_gate_run(GATE, np.random.default_rng(seed), impact)


def coast(parameters: GateParameters, impact: Impact, substeps: int = 20) -> dict[str, Array]:
    """One second without motor from nominal speed, the obstacle 20 mm ahead."""
    samples = 1000
    start = np.array([0.0, 0.2, 0.0, 0.2, 0.0, 0.2, 0.0])
    still = np.zeros(samples)
    truth, first_contact = integrate_gate(parameters, start, still, still, (1.0, 0.0, 0.02), impact, substeps)
    assert first_contact == pytest.approx(0.1, abs=0.01)
    return truth


def energy(parameters: GateParameters, truth: dict[str, Array]) -> Array:
    """Kinetic energy and that of every spring [J], written down independently of the kernel's forces."""
    p = parameters
    kinetic = 0.5 * (
        p.motor_mass * truth["motor_speed"] ** 2
        + p.leaf_main_mass * truth["leaf_speed"] ** 2
        + p.post_mass * truth["post_speed"] ** 2
    )
    wind_up = truth["motor_position"] - truth["leaf_position"]
    soft = np.clip(wind_up, 0.0, p.take_up_travel)
    beyond = np.clip(wind_up - p.take_up_travel, 0.0, None)
    back = np.clip(-p.backlash - wind_up, 0.0, None)
    drive = 0.5 * p.take_up_stiffness * soft**2 + p.take_up_stiffness * p.take_up_travel * beyond
    drive += 0.5 * p.drive_stiffness * (beyond**2 + back**2)
    post = 0.5 * p.post_stiffness * (truth["leaf_position"] - truth["post_position"]) ** 2
    compression = truth["bumper_compression"]
    cell_travel = np.clip(truth["post_position"] - 0.02, 0.0, None) - compression
    cell = 0.5 * p.load_cell_stiffness * cell_travel**2
    grid = np.linspace(0.0, 0.1, 200_001)
    slopes = np.select(
        [grid < p.bumper_buckling_travel, grid < p.bumper_bottom_travel],
        [p.bumper_stiffness, p.bumper_buckled_stiffness],
        p.bumper_bottom_stiffness,
    )
    spacing = grid[1]
    force = np.cumsum(slopes) * spacing
    bumper = np.interp(compression, grid, np.cumsum(force) * spacing)
    return np.asarray(kinetic + drive + post + cell + bumper)


@pytest.mark.parametrize("impact", ["stiff", "soft"])
def test_a_lossless_gate_keeps_its_energy_through_the_impact(impact: Impact) -> None:
    truth = coast(LOSSLESS, impact)
    balance = energy(LOSSLESS, truth)
    assert truth["contact_force"].max() > 1000.0
    assert truth["leaf_speed"].min() < -0.05  # it bounced
    np.testing.assert_allclose(balance, balance[0], rtol=2e-4)


def test_the_drive_transmits_nothing_inside_its_backlash() -> None:
    loose = replace(LOSSLESS, drive_damping=GATE.drive_damping)
    start = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0])
    still = np.zeros(4)
    truth, _ = integrate_gate(loose, start, still, still, (1.0, 0.0, 9.0), "none", 100)
    lead = truth["leaf_position"] - truth["motor_position"]
    assert lead[1] < loose.backlash < lead[2]
    assert truth["motor_speed"][1] == 0.0
    assert truth["motor_speed"][2] > 1e-3


def test_a_rigid_gate_without_motor_meets_the_closed_form_of_a_spring_impact() -> None:
    # v sqrt(K m): with the drive slack behind the obstacle's push the leaf alone hits first, so free the motor.
    alone = replace(LOSSLESS, motor_inertia=1e-12, take_up_stiffness=1e-3, backlash=1.0, post_stiffness=1e9)
    alone = replace(alone, drive_stiffness=1e-3)
    truth = coast(alone, "stiff", substeps=100)
    mass, stiffness, speed = GATE.leaf_mass, GATE.load_cell_stiffness, 0.2
    rate = np.sqrt(stiffness / mass)
    force = truth["contact_force"]
    pressed = np.flatnonzero(force > 0.0)
    assert force.max() == pytest.approx(speed * np.sqrt(stiffness * mass), rel=2e-3)
    assert (pressed[-1] - pressed[0]) * 1e-3 == pytest.approx(np.pi / rate, abs=2e-3)
    assert truth["leaf_position"].max() - 0.02 == pytest.approx(speed / rate, rel=3e-3)
    assert force[pressed[0] + 20] == pytest.approx(speed * np.sqrt(stiffness * mass) * np.sin(rate * 0.0205), rel=0.03)


def test_the_bumper_and_the_load_cell_in_series_carry_the_same_force() -> None:
    truth = coast(replace(PASSIVE, bumper_bottom_travel=15e-3), "soft")
    compression = truth["bumper_compression"]
    assert compression.max() > 15e-3  # all three branches are visited
    p = PASSIVE
    buckling = p.bumper_stiffness * p.bumper_buckling_travel
    bottom = buckling + p.bumper_buckled_stiffness * (15e-3 - p.bumper_buckling_travel)
    branch = np.select(
        [compression < p.bumper_buckling_travel, compression < 15e-3],
        [
            p.bumper_stiffness * compression,
            buckling + p.bumper_buckled_stiffness * (compression - p.bumper_buckling_travel),
        ],
        bottom + p.bumper_bottom_stiffness * (compression - 15e-3),
    )
    np.testing.assert_allclose(
        truth["contact_force"], branch * (1.0 + p.bumper_damping * truth["post_speed"]), atol=1e-6
    )


def test_the_integration_is_of_fourth_order_where_the_laws_are_smooth() -> None:
    # One stiffness, no sign limit in reach, no friction: what is left is linear, with the current loop inside.
    smooth = replace(
        LOSSLESS,
        speed_gain=GATE.speed_gain,
        take_up_travel=1.0,
        take_up_stiffness=1.2e6,
        force_slew_limit=1e9,
        force_limit=1e9,
    )
    load = 600.0
    start = np.array([load / 1.2e6, 0.2, 0.0, 0.2, 0.0, 0.2, load])
    reference = 0.2 + load / GATE.speed_gain + 0.005 * np.sin(np.linspace(0.0, 6.0, 300))
    ends = []
    for substeps in (2, 4, 8):
        truth, _ = integrate_gate(smooth, start, reference, np.full(300, -load), (1.0, 0.0, 9.0), "none", substeps)
        assert (truth["motor_position"] - truth["leaf_position"]).min() > 0.0
        ends.append(truth["motor_force"])
    order = np.log2(np.abs(ends[0] - ends[1]).max() / np.abs(ends[1] - ends[2]).max())
    assert order == pytest.approx(4.0, abs=0.3)


@pytest.mark.parametrize("impact", ["stiff", "soft"])
def test_a_run_equals_the_free_run_of_its_seed_until_the_contact(impact: Impact) -> None:
    free, run = run_of("none", 3), run_of(impact, 3)
    assert run.contact_start is not None
    before = int(run.contact_start / GATE.sample_period)
    assert before > 5000
    for name in ("motor_torque", "motor_speed", "acceleration", "load_cell", "reference_torque"):
        np.testing.assert_array_equal(getattr(run, name)[:before], getattr(free, name)[:before])
        assert not np.array_equal(getattr(run, name)[before:], getattr(free, name)[before : run.time.size])


def test_coloured_noise_and_resonance_have_the_stated_deviation_and_colour() -> None:
    white = np.random.default_rng(0).standard_normal(400_000)
    coloured = sensors.coloured_noise(white, 15.0, 60.0, 1e-3)
    assert np.std(coloured) == pytest.approx(15.0, rel=0.02)
    assert np.corrcoef(coloured[:-10], coloured[10:])[0, 1] == pytest.approx(np.exp(-0.6), abs=0.02)
    mode = sensors.resonance(white, 0.16, 18.0, 0.06, 1e-3)
    assert np.std(mode) == pytest.approx(0.16, rel=0.05)
    crossings = np.count_nonzero(np.diff(np.sign(mode))) / 2.0 / 400.0
    assert crossings == pytest.approx(18.0, rel=0.05)


def test_no_sensor_looks_ahead() -> None:
    values = np.random.default_rng(0).standard_normal(200)
    changed = values.copy()
    changed[120:] += 1.0
    models: dict[str, Callable[[Array], Array]] = {
        "coloured": lambda x: sensors.coloured_noise(x, 1.0, 60.0, 1e-3),
        "resonance": lambda x: sensors.resonance(x, 1.0, 18.0, 0.06, 1e-3),
    }
    for name, model in models.items():
        first, second = model(values), model(changed)
        np.testing.assert_array_equal(first[:120], second[:120], err_msg=name)
        assert first[120] != second[120], name
