"""`cdtool init`: the pressure of a contact is a channel of its own; that of oil or air is none."""

from __future__ import annotations

import numpy as np
import pytest

from tests.commands.init.drafts import drafted_columns, stroke


def draft_of(tmp_path, name: str, factor: float):
    run = stroke()
    noise = np.random.default_rng(3).normal(0.0, 0.002, (2, len(run.time)))
    force = np.where((run.time > 1.0) & (run.time < 1.3), 200.0 * np.sin(np.pi * (run.time - 1.0) / 0.3), 0.0)
    columns = {"t [s]": run.time, "n [rad/s]": run.speed, "i [A]": run.torque + noise[0], "load_cell [N]": force}
    return drafted_columns(tmp_path, {**columns, name: factor * (0.5 * force + noise[1])})


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("contact pressure [N/cm²]", "N/cm²"),
        ("Spitzendruck [MPa]", "MPa"),
        ("Flächenpressung (kPa)", "kPa"),
        ("film 1 [N/cm2]", "N/cm2"),
        ("p_film_N_cm2", "N/cm2"),
    ],
)
def test_a_contact_pressure_is_drafted_with_its_unit_and_a_question(tmp_path, name, unit):
    draft = draft_of(tmp_path, name, 1.0)
    assert draft.channels["contact_pressure"] == {"column": name, "unit": unit}
    assert draft.channels["force"]["column"] == "load_cell [N]"


@pytest.mark.parametrize(
    "name", ["hydraulic pressure [bar]", "Druck [bar]", "oil [kPa]", "contact pressure", "level [N]"]
)
def test_another_pressure_or_one_without_a_unit_is_not(tmp_path, name):
    draft = draft_of(tmp_path, name, 0.5)
    assert "contact_pressure" not in draft.channels
    assert draft.channels["force"]["column"] == "load_cell [N]"
