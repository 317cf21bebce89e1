"""A season of gate runs: friction that changes, an obstruction that grows, and nothing else."""

from __future__ import annotations

from dataclasses import fields, replace
from datetime import date

import numpy as np
import pytest

import cdtool
from cdtool.errors import UsageError
from cdtool.evaluation.upkeep.ambient import read_ambient
from cdtool.simulation.gate_model import GateParameters, GateRun, integrate_gate
from cdtool.simulation.season import Season, write_gate_season

NEW = GateParameters()


def cruising_force(run: GateRun, place: float, half: float = 0.3) -> float:
    """Mean motor force [N] about a place at nominal speed."""
    part = np.abs(run.leaf_position - place) < half
    return float(np.mean(run.motor_force[part]))


def test_friction_grows_linearly_by_the_stated_share():
    season = Season(11, friction_change=0.4)
    assert season.gate(1, NEW).coulomb_friction == NEW.coulomb_friction
    assert season.gate(6, NEW).static_friction == pytest.approx(1.2 * NEW.static_friction)
    assert season.gate(11, NEW).viscous_friction == pytest.approx(1.4 * NEW.viscous_friction)
    assert Season(1, friction_change=0.4).gate(1, NEW).coulomb_friction == NEW.coulomb_friction
    first, last = (cruising_force(season.run(number, 5, NEW), 1.0) for number in (1, 11))
    sliding = NEW.coulomb_friction + NEW.viscous_friction * NEW.nominal_speed
    assert last - first == pytest.approx(0.4 * sliding, abs=15.0)  # 3 % from run to run


def test_the_obstruction_resists_at_its_place_alone_with_what_it_has_grown_to():
    season = Season(41, obstruction_growth=2.0, obstruction_at=0.8)
    clean = Season(41).run(41, 5, NEW)
    obstructed = season.run(41, 5, NEW)
    difference = obstructed.motor_force - clean.motor_force
    before = clean.leaf_position < 0.749
    np.testing.assert_array_equal(difference[before], 0.0)
    # Over its 0.1 m a bump of cos^2 does the work of half its height.
    work = np.sum(difference[1:] * np.diff(clean.leaf_position))
    assert work == pytest.approx(0.5 * 80.0 * 0.1, rel=0.15)
    assert season.gate(1, NEW).obstruction_force == 0.0


@pytest.mark.parametrize("place", [0.74, 0.76, 0.78, 0.8, 0.81, 0.849, 0.86])
def test_the_obstruction_is_a_bump_of_cosine_squared(place: float) -> None:
    start, still = np.array([place, 0.2, place, 0.2, place, 0.2, 0.0]), np.zeros(1)
    slopes = []
    for force in (0.0, 50.0):
        gate = replace(NEW, obstruction_force=force, obstruction_position=0.8)
        truth, _ = integrate_gate(gate, start, still, still, (1.0, 0.0, 9.0), "none", 5)
        slopes.append(truth["leaf_acceleration"][0])
    inside = abs(place - 0.8) < 0.05
    expected = 50.0 * np.cos(np.pi * (place - 0.8) / 0.1) ** 2 * inside
    assert (slopes[0] - slopes[1]) * NEW.leaf_main_mass == pytest.approx(expected, abs=1e-9)


def test_a_run_without_change_does_not_depend_on_how_long_the_season_is():
    one, other = Season(5).run(3, 8, NEW), Season(50).run(3, 8, NEW)
    for field in fields(GateRun):
        np.testing.assert_array_equal(getattr(one, field.name), getattr(other, field.name))
    assert not np.array_equal(one.motor_torque, Season(5).run(4, 8, NEW).motor_torque)


def test_a_season_is_a_folder_of_impact_free_logs_in_their_order(tmp_path):
    calls = []
    written = write_gate_season(tmp_path / "season", Season(2, 0.2), 1, progress=lambda *at: calls.append(at))
    names = sorted(path.name for path in (tmp_path / "season" / "free").iterdir())
    assert written == 2 and names == ["01.csv", "02.csv"] and calls[-1] == (2, 2)
    recording = cdtool.read(tmp_path / "season" / "free" / "02.csv", tmp_path / "season" / "machine.toml")
    run = Season(2, 0.2).run(2, 1, NEW)
    torque = recording["torque"].values[:, 0]
    assert np.abs(torque - run.motor_torque / NEW.transmission_ratio).max() < 1.0


def test_friction_changes_by_its_share_with_each_kelvin():
    season = Season(3, friction_per_kelvin=-0.01)
    assert season.gate(1, NEW).coulomb_friction == NEW.coulomb_friction
    assert season.gate(1, NEW, warmer=10.0).viscous_friction == pytest.approx(0.99**10 * NEW.viscous_friction)
    assert season.gate(1, NEW, warmer=-10.0).static_friction == pytest.approx(0.99**-10 * NEW.static_friction)


def test_a_run_has_the_friction_of_its_temperature():
    runs = Season(120, friction_per_kelvin=-0.02, runs_per_day=1)
    warm, cold = runs.run(10, 5, NEW), runs.run(120, 5, NEW)
    warmth = 0.98 ** (runs.temperature(120, 5) - runs.temperature(10, 5))
    assert warmth > 1.1
    assert cruising_force(cold, 1.0) / cruising_force(warm, 1.0) == pytest.approx(warmth, rel=0.12)


def test_runs_are_spread_over_the_hours_of_their_day():
    season = Season(5, runs_per_day=2, start=date(2025, 12, 31))
    found = [season.time(number).isoformat("T", "minutes") for number in range(1, 6)]
    assert found == ["2025-12-31T10:00", "2025-12-31T18:00", "2026-01-01T10:00", "2026-01-01T18:00", "2026-01-02T10:00"]


def test_a_season_has_a_table_with_date_and_temperature_of_each_run(tmp_path):
    season = Season(3, friction_per_kelvin=-0.01)
    write_gate_season(tmp_path / "season", season, 1)
    found = read_ambient(tmp_path / "season" / "ambient.csv", [f"free/0{number}.csv" for number in (1, 2, 3)])
    assert [item.when for item in found.values()] == [season.time(number) for number in (1, 2, 3)]
    temperatures = [item.temperature for item in found.values()]
    np.testing.assert_allclose(temperatures, [season.temperature(number, 1) for number in (1, 2, 3)], atol=0.051)


def test_the_same_seed_gives_the_same_bytes_and_another_seed_others(tmp_path):
    for name, seed in (("one", 1), ("same", 1), ("other", 2)):
        write_gate_season(tmp_path / name, Season(1), seed)
    one, same, other = ((tmp_path / name / "free" / "01.csv").read_bytes() for name in ("one", "same", "other"))
    assert one == same != other


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"runs": 0}, "season of 0 runs"),
        ({"friction_change": -1.0}, "friction change is -1"),
        ({"friction_change": float("nan")}, "friction change is nan"),
        ({"obstruction_growth": -0.5}, "obstruction growth is -0.5"),
        ({"obstruction_at": float("inf")}, "obstruction at inf"),
        ({"friction_per_kelvin": 1.0}, "friction per kelvin is 1"),
        ({"runs_per_day": 0}, "0 runs per day"),
        ({"runs": 100_000, "runs_per_day": 1, "start": date(9999, 1, 1)}, "ends after the year 9999"),
    ],
)
def test_a_season_that_makes_no_sense_is_refused(wrong, said):
    with pytest.raises(UsageError, match=said):
        Season(**{"runs": 5, **wrong})
