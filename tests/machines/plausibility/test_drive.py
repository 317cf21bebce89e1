"""Right maps of machines that look wrong: weight, springs and loads that help, delays, sines, angles within a turn."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.base.arrays import FloatArray
from cdtool.formats.machine_file import read_machine_file
from cdtool.machines.plausibility import check_channels
from cdtool.recordings.recording import Recording, Series

RATE = 500.0
TIME = np.arange(0.0, 24.0, 1.0 / RATE)


@pytest.fixture(scope="module")
def axes(tmp_path_factory):
    """Return a linear and a rotary axis without a known inertia, by the unit of their position."""
    found = {}
    for unit, kind, key in (("m", "linear_axis", "load_mass"), ("rad", "rotary_axis", "load_inertia")):
        path = tmp_path_factory.mktemp(unit) / "machine.toml"
        path.write_text(f'[machine]\ntype = "{kind}"\ncoordinates = "load"\n{key} = 0.0\n', encoding="utf-8")
        found[unit] = read_machine_file(path).machine
    return found


def strokes(*directions: float) -> FloatArray:
    """Return the speed of strokes of 3 s with ramps of 0.5 s and rests of 1 s: 0.3 m/s times each direction."""
    one = np.interp(np.arange(0.0, 4.0, 1.0 / RATE), [0.5, 1.0, 3.0, 3.5], [0.0, 0.3, 0.3, 0.0])
    return np.concatenate([direction * one for direction in directions])


def machine(speed: FloatArray, weight: float = 0.0, spring: float = 0.0, friction: float = 30.0) -> list[FloatArray]:
    """Return position, speed and force of 100 kg with dry friction, weight and a spring."""
    position = np.cumsum(speed) / RATE
    return [
        position,
        speed,
        100.0 * np.gradient(speed, 1.0 / RATE) + friction * np.tanh(speed / 1e-3) + weight - spring * position,
    ]


def delayed(values: FloatArray, seconds: float) -> FloatArray:
    return np.concatenate((np.full(round(seconds * RATE), values[0]), values[: len(values) - round(seconds * RATE)]))


def lift() -> list[FloatArray]:
    position, speed, force = machine(strokes(1, -1, 1, -1, 1, -1), 981.0)
    return [position, speed, force + 200.0 * (speed < 0.0)]


def sine(delay: float) -> list[FloatArray]:
    position, speed, force = machine(0.4 * np.sin(4.0 * TIME), friction=1.0)
    return [delayed(position, delay), delayed(speed, delay), force]


def turning() -> list[FloatArray]:
    position, speed, force = machine(60.0 * strokes(1, 1, 1, 1, 1, 1))
    return [np.mod(position, 2.0 * np.pi), speed, force]


CASES = {
    "lift that lowers loaded and raises empty": (lift, "m"),
    "door that closes by its weight": (lambda: machine(strokes(1, 0, 1, 0, 1, 0), -60.0), "m"),
    "door that a spring closes": (lambda: machine(strokes(1, 0, 0, 0, 0, 0), -90.0, -60.0), "m"),
    "vertical axis down only": (lambda: machine(strokes(-1, -1, -1, -1, -1, -1), 500.0), "m"),
    "sine on a direct drive": (lambda: sine(0.0), "m"),
    "sine with a late speed": (lambda: sine(0.03), "m"),
    "angle within one turn": (turning, "rad"),
}


def recording(values: list[FloatArray], unit: str, sign: float = 1.0) -> Recording:
    rng, time = np.random.default_rng(1), np.arange(len(values[0])) / RATE
    position, speed, force = values
    noisy = sign * force + 0.01 * np.std(force) * rng.standard_normal(len(force))
    channels = {
        "position": Series(time, position, unit),
        "speed": Series(time, speed + 1e-3 * np.max(speed) * rng.standard_normal(len(speed)), f"{unit}/s"),
        "torque": Series(time, noisy, "N" if unit == "m" else "N m"),
    }
    return Recording("log", "log", ("axis",), channels)


@pytest.mark.parametrize("case", CASES)
def test_a_right_map_contradicts_nothing(axes, case):
    make, unit = CASES[case]
    found = check_channels([recording(make(), unit)], axes[unit])
    assert not [str(item) for item in found if item.severity == "loss"]


@pytest.mark.parametrize("directions", [(1, -1, 1, -1, 1, -1), (1, 1, 1, 1, 1, 1)], ids=["both ways", "one way"])
def test_a_reversed_force_is_found_where_starts_show_its_sign(axes, directions):
    values = machine(strokes(*directions))
    for sign, answer in ((1.0, "agrees"), (-1.0, "contradicts")):
        found = check_channels([recording(values, "m", sign)], axes["m"])
        (friction,) = [item for item in found if item.numbers["check"] == "friction"]
        assert (friction.numbers["answer"], friction.numbers["found"]) == (answer, "friction")
