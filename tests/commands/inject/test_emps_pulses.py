"""Injected force pulses against the recorded ones of the EMPS axis."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from cdtool.commands.inject.assumption import ControllerReaction
from cdtool.commands.inject.axis_contact import axis_contact
from cdtool.commands.inject.injected_logs import injected_recording
from cdtool.commands.inject.with_injected import refusal
from cdtool.detectors.momentum import Momentum
from cdtool.formats.machine_file import MachineFile
from cdtool.machines.axis_model.axis_run import axis_run
from cdtool.machines.axis_model.obstacle import Obstacle
from cdtool.machines.axis_model.parameters import AxisModel
from tests.commands.inject import emps_pulses
from tests.data_folder import data, needs_data

RECORDINGS = ("emps/DATA_EMPS.mat", "emps/DATA_EMPS_PULSES.mat")


@pytest.fixture(scope="module")
def identified() -> tuple[MachineFile, AxisModel]:
    machine_file: MachineFile = emps_pulses.identified(data("emps"))
    return machine_file, emps_pulses.model_of(machine_file)[1]


@pytest.fixture(scope="module")
def axes(identified: tuple[MachineFile, AxisModel]) -> Any:
    return emps_pulses.compared(data("emps"), *identified)


@needs_data(*RECORDINGS)
def test_the_residual_crosses_every_threshold_when_the_recorded_one_does(axes: Any) -> None:
    times = emps_pulses.crossing_times(axes)
    assert [item.threshold for item in times] == [15.0, 40.0, 80.0, 120.0, 160.0]
    for item in times:
        assert len(item.difference) == 25
        # Near its plateau the residual rises slowly.
        assert np.max(np.abs(item.difference)) <= (1.5 if item.threshold < 160.0 else 2.0)
        assert abs(np.mean(item.difference)) <= 0.75
    # An observer that did not follow the force would cross all thresholds at once, or none.
    recorded = [float(np.mean(item.recorded)) for item in times]
    assert np.all(np.diff(recorded) > 1.5)


@needs_data(*RECORDINGS)
def test_the_displacement_is_within_six_percent_of_the_recorded_one(axes: Any) -> None:
    displaced = list(emps_pulses.displacements(axes))
    assert len(displaced) == 25
    assert all(140e-6 < item.recorded < 180e-6 for item in displaced)
    assert max(item.error for item in displaced) <= 0.06
    assert max(item.root_mean_square for item in displaced) <= 0.04


@needs_data(*RECORDINGS)
@pytest.mark.parametrize("wrong", ["soft controller", "heavy load"])
def test_a_wrong_model_does_not_meet_the_limits(identified: tuple[MachineFile, AxisModel], wrong: str) -> None:
    machine_file, model = identified
    if wrong == "soft controller":
        assert model.controller is not None
        model = replace(model, controller=replace(model.controller, speed_gain=0.8 * model.controller.speed_gain))
    else:
        model = replace(model, drive=replace(model.drive, load_mass=1.5 * model.drive.load_mass))
    axes = emps_pulses.compared(data("emps"), machine_file, model)
    times, displaced = emps_pulses.crossing_times(axes), list(emps_pulses.displacements(axes))
    assert max(item.error for item in displaced) > emps_pulses.LARGEST_DISPLACEMENT
    assert wrong == "soft controller" or not all(item.is_met for item in times)


@needs_data(*RECORDINGS)
@pytest.mark.parametrize("at", [5.0, 7.5])  # s, in either direction
def test_an_obstacle_can_be_put_before_the_real_axis(
    identified: tuple[MachineFile, AxisModel], axes: Any, at: float
) -> None:
    _, model = identified
    assert refusal(Momentum.needs, model, ControllerReaction.KNOWN) is None
    observer = Momentum(bandwidth=100.0)
    delays = []
    for stiffness in (5e3, 500e3):
        contact = axis_contact(axis_run(axes.free), model, Obstacle.spring(stiffness), at, 0.3)
        recording = injected_recording(axes.free, axes.machine, contact.changes, contact.force, (0,))
        signal = observer.signal(axes.machine.referred_to_load(recording), axes.machine)
        opposed = np.sign(contact.speed) * signal.values[:, 0]
        assert np.max(opposed[(signal.time > at - 0.5) & (signal.time <= at)]) < 25.0
        delays.append(1e3 * (signal.time[np.argmax((signal.time > at) & (opposed > 40.0))] - at))
    assert 3.0 < delays[1] < 12.0 < delays[0] < 100.0
