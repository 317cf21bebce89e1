"""The scale of the torque channel: press and release on a load cell in closed form, and what is refused."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from cdtool.base.arrays import FloatArray
from cdtool.commands.identify.axis.torque_constant import identify_torque_scale
from cdtool.commands.identify.estimate import IdentificationError
from cdtool.recordings.recording import Contact, Recording, Series

MASS = 1000.0
STIFFNESS = 2e4
SCALE = 0.8  # the channel has 1 / 0.8 of the true torque


def triangle(time: FloatArray) -> FloatArray:
    """Up to 900 N within 4 s, back within 4 s."""
    return np.interp(time, [1.0, 5.0, 9.0], [0.0, 900.0, 0.0])


def pressed(
    course: Callable[[FloatArray], FloatArray] = triangle,
    *,
    sign: float = 1.0,
    noise: float = 10.0,
    friction: tuple[float, float, float] = (120.0, 0.1, 30.0),
    seed: int = 0,
) -> tuple[Recording, Contact]:
    """A contact whose friction is constant + share * force, with a constant force; the load cell on its own clock."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 10.5, 2e-3)
    force = course(time)
    constant, share, offset = friction
    direction = np.sign(np.gradient(force, time))
    torque = (force + direction * (constant + share * force) + offset) / SCALE
    torque = sign * torque + noise * rng.standard_normal(len(time))
    speed = sign * np.gradient(force, time) / STIFFNESS
    cell = np.arange(0.0003, 10.5, 1.3e-3)
    channels = {
        "torque": Series(time, torque, "N"),
        "speed": Series(time, speed, "m/s"),
        "force": Series(cell, course(cell) + 50.0 + rng.standard_normal(len(cell)), "N"),
    }
    above = np.flatnonzero(course(time) > 1.0)
    return Recording("press", "press", ("axis",), channels), Contact(time[above[0]], time[above[-1]], 1e-3)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_friction_cancels_between_press_and_release(sign: float) -> None:
    found = identify_torque_scale([pressed(sign=sign)], MASS)
    assert found.factor == pytest.approx(SCALE, rel=0.01)
    assert abs(found.factor - SCALE) < 3.0 * found.standard_error
    # Mean friction at the mean force of 450 N, not near 0 N, of the part that is used.
    assert found.friction == pytest.approx(120.0 + 0.1 * 495.0, rel=0.1)


def test_standard_errors_cover() -> None:
    found = [identify_torque_scale([pressed(noise=200.0, seed=seed)], MASS) for seed in range(30)]
    inside = [abs(item.factor - SCALE) < 2.0 * item.standard_error for item in found]
    assert np.mean(inside) >= 0.85
    assert np.median([item.standard_error for item in found]) < 0.02


def test_a_lever_arm_makes_a_torque_of_the_force() -> None:
    assert identify_torque_scale([pressed()], MASS, lever_arm=0.5).factor == pytest.approx(0.5 * SCALE, rel=0.02)


def press_only(time: FloatArray) -> FloatArray:
    return np.interp(time, [1.0, 8.9, 9.0], [0.0, 900.0, 0.0])


def hit(time: FloatArray) -> FloatArray:
    return 900.0 * np.sin(np.clip((time - 1.0) / 0.7, 0.0, 1.0) * np.pi)


def short_hit(time: FloatArray) -> FloatArray:
    return 900.0 * np.sin(np.clip((time - 1.0) / 0.1, 0.0, 1.0) * np.pi)


@pytest.mark.parametrize(
    ("course", "mass", "message"),
    [
        (press_only, 0.0, "the release lasts"),
        (hit, 1e4, "the contact is a hit"),
        (short_hit, MASS, "the contact lasts 0.10 s"),
    ],
)
def test_anything_but_press_and_release_is_refused(
    course: Callable[[FloatArray], FloatArray], mass: float, message: str
) -> None:
    with pytest.raises(IdentificationError, match=message):
        identify_torque_scale([pressed(course)], mass)


def test_a_torque_that_does_not_follow_the_force_is_refused() -> None:
    recording, contact = pressed()
    noise = Series(
        recording["torque"].time, np.random.default_rng(1).normal(500.0, 400.0, len(recording["torque"])), "N"
    )
    channels = {**recording.channels, "torque": noise}
    with pytest.raises(IdentificationError, match="relative standard error"):
        identify_torque_scale([(Recording("noise", "noise", ("axis",), channels), contact)], MASS)


def test_without_a_contact_the_reason_is_stated() -> None:
    with pytest.raises(IdentificationError, match="no contact with a load cell"):
        identify_torque_scale([], MASS)


def test_a_missing_load_cell_is_named() -> None:
    recording, contact = pressed()
    channels = {name: series for name, series in recording.channels.items() if name != "force"}
    with pytest.raises(IdentificationError, match="no load cell"):
        identify_torque_scale([(Recording("press", "press", ("axis",), channels), contact)], MASS)


def test_samples_that_are_missing_in_the_contact_are_refused() -> None:
    recording, contact = pressed()
    torque = recording["torque"].values.copy()
    torque[2000:2100] = np.nan
    channels = {**recording.channels, "torque": recording["torque"].with_values(torque, "N")}
    with pytest.raises(IdentificationError, match="samples are missing"):
        identify_torque_scale([(Recording("press", "press", ("axis",), channels), contact)], MASS)
