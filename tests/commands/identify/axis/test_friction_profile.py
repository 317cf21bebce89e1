"""The friction along the travel: from settled motion, and random profiles like it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.commands.identify.axis.friction_profile import (
    FrictionProfile,
    friction_profile,
    friction_shares,
    random_phases,
)
from cdtool.commands.identify.axis.start_ensemble import start_ensembles
from cdtool.machines.axis_model.axis_run import axis_run
from tests.synthetic.gate_runs import GATE, free_runs
from tests.synthetic.plain_gate import WAVES, drawn_gate, strokes

SHARES = friction_shares(GATE.leaf_mass, GATE.take_up_stiffness, GATE.viscous_friction)


def test_the_gates_track_is_found() -> None:
    runs = free_runs(GATE, 11, 10)
    profile = replace(friction_profile(runs, start_ensembles(runs)[0], GATE.motor_mass), shares=SHARES)
    position = profile.begins + profile.spacing * np.arange(len(profile.force))
    true = sum(
        weight * np.sin(2.0 * np.pi * position / length + phase) for length, phase, weight in GATE.friction_waves
    )
    true *= GATE.coulomb_friction * GATE.friction_waviness
    assert np.corrcoef(true, profile.force)[0, 1] > 0.8
    assert np.std(profile.force) == pytest.approx(np.std(true), rel=0.35)
    assert profile.level_deviation == pytest.approx(0.03 * 150.0 / np.sqrt(10.0), rel=0.6)


def test_waves_near_the_resonance_have_their_own_size() -> None:
    gate = drawn_gate(4)
    runs = [axis_run(recording) for recording in strokes(gate, 4, range(6)).recordings]
    profile = friction_profile(runs, start_ensembles(runs)[0], gate.motor_mass)
    profile = replace(profile, shares=friction_shares(gate.leaf_mass, gate.stiffness, gate.viscous))
    position = profile.begins + profile.spacing * np.arange(len(profile.force))
    phases = np.random.default_rng(4).uniform(0.0, 2.0 * np.pi, len(WAVES))
    true = gate.friction * gate.waviness * np.sin(2.0 * np.pi * position[:, np.newaxis] / WAVES + phases).sum(axis=1)
    assert np.std(profile.force - true) < 0.5 * np.std(true)  # a rigid drive: 1.1


def test_without_settled_motion_there_is_no_profile() -> None:
    runs = free_runs(GATE, 12, 3)
    ensemble = start_ensembles(runs)[0]
    short = [type(run)(run.name, 0.0, run.period, run.torque[:1500], run.speed[:1500]) for run in runs]
    profile = friction_profile(short, ensemble, GATE.motor_mass)
    assert len(profile.force) == 0
    np.testing.assert_array_equal(profile.at(np.linspace(0.0, 1.0, 5)), np.zeros((4, 5)))
    positions, covariance = profile.knots()
    assert positions.shape == (0,)
    assert covariance.shape == (0, 0)


def test_random_phases_keep_the_spectrum() -> None:
    rng = np.random.default_rng(0)
    profile = np.convolve(rng.standard_normal(400), np.ones(20) / 20, mode="valid")
    other = random_phases(profile, rng)
    np.testing.assert_allclose(np.abs(np.fft.rfft(other))[1:-1], np.abs(np.fft.rfft(profile))[1:-1], rtol=1e-9)
    assert abs(np.corrcoef(other, profile)[0, 1]) < 0.5


def test_surrogates_are_the_level_alone_where_the_profile_is_known() -> None:
    force = 5.0 * np.sin(np.arange(200) / 7.0)
    profile = FrictionProfile(0.2, 0.01, force[np.newaxis], 2.0, np.ones(1))
    travelled = np.linspace(0.0, 2.0, 400)
    drawn = profile.surrogates(travelled, 300, np.random.default_rng(0))
    known = travelled >= 0.2
    assert np.ptp(drawn[:, known], axis=1).max() < 1e-9
    assert np.std(drawn[:, known][:, 0]) == pytest.approx(2.0, rel=0.15)
    unknown = (travelled > 0.05) & ~known
    assert np.std(drawn[:, unknown]) == pytest.approx(np.hypot(2.0, np.std(force)), rel=0.15)


def test_the_covariance_at_the_knots_is_that_of_the_profile() -> None:
    force = 5.0 * np.sin(np.arange(400) / 7.0)
    positions, covariance = FrictionProfile(0.2, 0.01, force[np.newaxis], 2.0, np.ones(1)).knots()
    assert positions[0] == 0.0
    assert positions[-1] == 0.2
    assert np.all(np.linalg.eigvalsh(covariance) > 0.0)
    assert covariance[0, 0] == pytest.approx(1.05 * np.var(force), rel=0.1)
