"""Controllers identified from simulated gates, from the EMPS axis, and from a plain Python controller of this file."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

import cdtool
from cdtool.base.arrays import FloatArray
from cdtool.commands.identify.axis.speed_controller import (
    ControllerFit,
    ControllerKind,
    identify_controller,
    observed_slope,
)
from cdtool.commands.identify.estimate import Estimate, IdentificationError, Missing, NotIdentifiable
from cdtool.commands.simulate.gate_model import GateParameters, simulate_gate_run
from cdtool.formats.machine_file import read_machine_file
from cdtool.machines.axis_model.axis_run import AxisRun, axis_run
from cdtool.machines.axis_model.sensor_filters import first_order_low_pass
from cdtool.recordings.recording import Recording
from tests.data_folder import DATA, needs_data
from tests.synthetic.gate_as_recording import as_recording

GATE = GateParameters()
TRUE = {
    "speed_gain": GATE.speed_gain,
    "integral_gain": GATE.integral_gain,
    "anti_windup_rate": GATE.anti_windup_rate,
    "slew_limit": GATE.force_slew_limit,
}
EXAMPLES = Path(__file__).parents[4] / "docs" / "examples"


@pytest.fixture(scope="module")
def gate() -> list[Recording]:
    runs = [simulate_gate_run(GATE, np.random.default_rng([1, number]), "none") for number in range(14)]
    return [as_recording(run, f"run {number}", GATE) for number, run in enumerate(runs)]


@pytest.fixture(scope="module")
def runs(gate: list[Recording]) -> list[AxisRun]:
    return [axis_run(recording) for recording in gate]


@dataclass(frozen=True, kw_only=True)
class Loop:
    """A sampled controller in plain Python; its speeds and references are random, no machine is simulated."""

    speed_gain: float = 500.0
    integral_gain: float = 3000.0
    position_gain: float = 0.0
    anti_windup_rate: float = 8.0
    slew_limit: float = math.inf
    force_limit: float = math.inf
    feed_forward: float = 0.0
    delay: int = 0
    period: float = 1e-3

    def run(self, seed: int, count: int = 3000) -> AxisRun:
        rng = np.random.default_rng(seed)
        reference = smooth(rng, count, 200.0, 0.3)
        speed = reference + smooth(rng, count, 30.0, 0.01) + 0.02 * np.linspace(-1.0, 1.0, count)
        position = np.cumsum(speed) * self.period
        target = np.cumsum(reference) * self.period + smooth(rng, count, 100.0, 1e-3)
        error = reference + self.position_gain * (target - position) - speed
        command = self.command(error) + self.feed_forward * np.gradient(reference, self.period)
        return AxisRun(
            f"seed {seed}",
            0.0,
            self.period,
            command.copy(),
            speed=speed,
            position=position,
            reference_position=target if self.position_gain else None,
            reference_speed=reference,
            reference_torque=np.concatenate((np.full(self.delay, command[0]), command[: count - self.delay])),
        )

    def command(self, error: FloatArray) -> FloatArray:
        integral, command, commands = 0.0, None, []
        for value in error.tolist():
            wanted = self.speed_gain * value + integral
            change = self.slew_limit * self.period
            command = wanted if command is None else command + min(max(wanted - command, -change), change)
            command = min(max(command, -self.force_limit), self.force_limit)
            integral += (self.integral_gain * value + self.anti_windup_rate * (command - wanted)) * self.period
            commands.append(command)
        return np.array(commands)


def smooth(rng: np.random.Generator, count: int, samples: float, deviation: float) -> FloatArray:
    """Return a random signal whose correlation ends after about so many samples."""
    noise = np.convolve(rng.standard_normal(count + 1000), np.exp(-np.arange(1000) / samples), "same")
    noise = np.convolve(noise, np.exp(-np.arange(1000) / samples), "same")[500 : 500 + count]
    return np.asarray(deviation * noise / np.std(noise))


def coloured(rng: np.random.Generator, count: int, deviation: float, samples: float) -> FloatArray:
    """Return first-order coloured noise."""
    keep, values, value = math.exp(-1.0 / samples), np.empty(count), 0.0
    for index, white in enumerate(rng.standard_normal(count).tolist()):
        value = keep * value + math.sqrt(1.0 - keep**2) * deviation * white
        values[index] = value
    return values


def measured_only(run: AxisRun) -> AxisRun:
    return replace(run, reference_torque=None)


def missing(fit: ControllerFit, key: str) -> NotIdentifiable:
    (found,) = (item for item in fit.identified.not_identifiable if item.key == key)
    return found


def deviation(estimate: Estimate, true: float) -> float:
    """Return how many standard errors an estimate is off."""
    return abs(estimate.value - true) / estimate.standard_error


def test_a_logged_command_shows_every_parameter_of_the_gate(runs: list[AxisRun]) -> None:
    fit = identify_controller(runs)
    assert fit.kind is ControllerKind.PI and fit.comparison is not None and fit.comparison.is_command
    for key, value in TRUE.items():
        assert fit.identified[key].value == pytest.approx(value, rel=1e-6)
    assert fit.identified["speed_filter_hz"].value == pytest.approx(60.0, rel=1e-3)
    assert fit.controller is not None and fit.controller.speed_filter_order == 2
    assert fit.controller.force_limit == math.inf and fit.controller.delay == 0.0
    assert missing(fit, "force_limit").missing == (Missing.SATURATION,)
    assert missing(fit, "force_limit").numbers["largest_n"] < GATE.force_limit


def test_measured_torque_shows_the_gains_of_the_gate_within_their_standard_errors(runs: list[AxisRun]) -> None:
    fit = identify_controller([measured_only(run) for run in runs])
    assert fit.kind is ControllerKind.PI and fit.comparison is not None and not fit.comparison.is_command
    for key in ("speed_gain", "integral_gain"):
        assert fit.identified[key].value == pytest.approx(TRUE[key], rel=0.03)
        assert fit.identified[key].relative_error < 0.02
    for key, value in TRUE.items():
        assert deviation(fit.identified[key], value) < 3.0
    assert fit.lag == pytest.approx(GATE.current_lag + GATE.torque_filter_time, rel=0.3)


# Logs that are not the controller's own channels: wrong by no more than what they state


def with_noisy_speed(run: AxisRun) -> AxisRun:
    assert run.speed is not None
    return replace(run, speed=run.speed + 1e-3 * np.random.default_rng(5).standard_normal(len(run)))


def test_noise_that_the_controller_never_saw_is_in_the_standard_errors(runs: list[AxisRun]) -> None:
    noisy = [replace(with_noisy_speed(run), position=None, reference_torque=None) for run in runs[:3]]
    fit = identify_controller(noisy)
    assert abs(fit.identified["speed_gain"].value - GATE.speed_gain) > 100.0
    for key in ("speed_gain", "integral_gain"):
        assert deviation(fit.identified[key], TRUE[key]) < 3.0


def test_a_torque_feed_forward_is_not_counted_as_a_gain() -> None:
    fit = identify_controller([Loop(feed_forward=100.0).run(seed) for seed in range(3)])
    for key, value in (("speed_gain", 500.0), ("integral_gain", 3000.0)):
        assert key not in fit.identified or deviation(fit.identified[key], value) < 3.0


@pytest.mark.parametrize(
    ("loop", "kind"),
    [
        (Loop(integral_gain=0.0), ControllerKind.P),
        (Loop(), ControllerKind.PI),
        (Loop(integral_gain=0.0, position_gain=20.0), ControllerKind.CASCADE_P),
        (Loop(position_gain=20.0), ControllerKind.CASCADE_PI),
    ],
)
def test_the_data_choose_the_structure(loop: Loop, kind: ControllerKind) -> None:
    fit = identify_controller([loop.run(seed) for seed in range(3)])
    assert fit.kind is kind
    for key in ("speed_gain", "integral_gain", "position_gain"):
        value = getattr(loop, key)
        if value:
            assert fit.identified[key].value == pytest.approx(value, rel=1e-6)
        else:
            assert key not in fit.identified
            assert key not in [item.key for item in fit.identified.not_identifiable]
    assert fit.controller is not None
    assert fit.controller.position_gain == pytest.approx(loop.position_gain, rel=1e-6)


def test_a_force_limit_that_is_reached_is_identified_with_the_anti_windup() -> None:
    loop = Loop(force_limit=8.0, speed_gain=800.0)
    fit = identify_controller([loop.run(seed) for seed in range(3)])
    assert fit.identified["force_limit"].value == pytest.approx(8.0, rel=1e-6)
    assert fit.identified["anti_windup_rate"].value == pytest.approx(8.0, rel=1e-4)
    assert missing(fit, "slew_limit").missing == (Missing.SATURATION,)


def test_the_standard_errors_cover_coloured_noise_of_the_torque() -> None:
    """Over 12 sets of runs the mean square of (value - true) / standard error is near 1: within 0.2 and 2.2."""
    loop, squares = Loop(), []
    for group in range(12):
        rng = np.random.default_rng([7, group])
        noisy = []
        for number in range(2):
            run = measured_only(loop.run(100 * group + number, 2000))
            noisy.append(replace(run, torque=run.torque + coloured(rng, len(run), 2.0, 10.0)))
        fit = identify_controller(noisy)
        squares.append(
            [deviation(fit.identified[key], getattr(loop, key)) ** 2 for key in ("speed_gain", "integral_gain")]
        )
    mean = np.mean(squares, axis=0)
    assert np.all(mean > 0.2) and np.all(mean < 2.2)


@needs_data("emps/DATA_EMPS.mat")
def test_the_emps_cascade_has_its_published_gains() -> None:
    """Published: kp = 160.18 1/s, kv = 243.45 V s/m; 35.15 N/V."""
    assert DATA is not None
    recording = cdtool.read(DATA / "emps" / "DATA_EMPS.mat", read_machine_file(EXAMPLES / "emps.toml"))
    fit = identify_controller([axis_run(recording)])
    assert fit.kind is ControllerKind.CASCADE_P
    assert fit.identified["position_gain"].value == pytest.approx(160.18, rel=0.002)
    assert fit.identified["speed_gain"].value == pytest.approx(243.45 * 35.15, rel=0.01)
    assert "speed_filter_hz" in fit.identified


@needs_data("emps/DATA_EMPS_PULSES.mat")
def test_pulses_added_to_the_emps_command_are_not_counted_as_a_gain() -> None:
    assert DATA is not None
    recording = cdtool.read(DATA / "emps" / "DATA_EMPS_PULSES.mat", read_machine_file(EXAMPLES / "emps.toml"))
    run = axis_run(recording)
    # The first ten seconds, with ten of the pulses.
    part = replace(run, **{name: getattr(run, name)[:10_000] for name in ("torque", "position", "reference_position")})
    fit = identify_controller([replace(part, speed=None)])
    assert "speed_gain" not in fit.identified or deviation(fit.identified["speed_gain"], 243.45 * 35.15) < 3.0


def test_a_log_without_references_is_refused(runs: list[AxisRun]) -> None:
    """At constant speed gains came out up to 7 standard errors wrong: what the reference did there is not known."""
    for channels in ({"reference_speed": None}, {"speed": None, "reference_speed": None}):
        with pytest.raises(IdentificationError, match="a reference"):
            identify_controller([replace(run, **channels) for run in runs[:2]])


def test_a_wrong_sign_is_an_error_that_says_where_to_look() -> None:
    run = Loop().run(1)
    assert run.reference_torque is not None
    with pytest.raises(IdentificationError, match=r"seed 1: .*falls where .*rises.*signs") as error:
        identify_controller([replace(run, reference_torque=-run.reference_torque)])
    assert "\n" not in str(error.value)


def test_references_of_another_motion_explain_nothing() -> None:
    runs = [Loop().run(seed) for seed in range(3)]
    turned = runs[1:] + runs[:1]
    swapped = [replace(run, reference_speed=other.reference_speed) for run, other in zip(runs, turned, strict=True)]
    fit = identify_controller(swapped)
    assert fit.controller is None
    assert missing(fit, "speed_gain").missing == (Missing.OTHER_CONTROLLER,)


SLOPE, LAG = 800.0, 0.01


def run(seed: int = 1, noise: float = 0.0, slope: float = SLOPE, gap: bool = False) -> AxisRun:
    """A command that rises for 0.4 s, is steady, and falls at half the slope; the torque follows with a lag."""
    time = np.arange(8000) * 1e-3
    command = slope * (np.clip(time - 1.0, 0.0, 0.4) - 0.5 * np.clip(time - 6.0, 0.0, 0.8))
    torque = command + noise * np.random.default_rng(seed).standard_normal(len(time))
    torque = first_order_low_pass(torque, LAG, 1e-3)
    if gap:
        torque[1200:1210] = np.nan
    return AxisRun("run", 0.0, 1e-3, torque, reference_torque=command)


def test_of_a_logged_command_it_is_the_largest_step() -> None:
    assert observed_slope([run(), run(slope=0.5 * SLOPE)], True) == pytest.approx(SLOPE)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("gap", [False, True])
def test_of_a_noisy_torque_it_is_a_bound_from_below(seed: int, gap: bool) -> None:
    found = observed_slope([run(seed, 60.0, gap=gap)], False, LAG)
    assert (0.4 if gap else 0.5) * SLOPE < found < SLOPE
