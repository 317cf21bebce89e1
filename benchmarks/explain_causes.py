"""Alarms with known causes: does `cdtool explain` name the cause, and the channel that left its normal band first?

    python benchmarks/explain_causes.py                   # 100 alarms of seed 911, and 100 of seed 912
    python benchmarks/explain_causes.py --seeds 11 12 --alarms 60

Six causes in turn on five simulated machines (see `BENCHES`): a contact (stiff or soft), a step of friction, a glitch
of the speed, a spike of the motor current, a knock on the accelerometer, lost samples. Positions, speeds, heights and
lengths are random; a disturbance is increased until the detector alarms because of it. (Lost samples need not cause an
alarm: the safety factor is lowered until they do, while the same run with every sample does not.) The alarms come from
the pipeline of `cdtool explain`: detector, signature, activation. 14 impact-free runs of each machine are learned from.
Load cell, labels and the simulator's truth are not in the explained recordings.

First mover: for a faulty sensor it is that sensor's channel; with lost samples no channel has moved. For a contact or a
step of friction the same run is simulated a second time without it, with the same noise. A channel departs clearly if
the two differ by six standard deviations of the impact-free runs, slightly if by three (`departures`). Any channel is
right that departs, at least slightly, not later than the first that does so clearly; within `TIE_SECONDS` is a tie.
References are not sensors and do not count.

Exits with 1 if, in any seed, fewer than 95 % of the causes or of the first movers are right.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any, ClassVar

import numpy as np
from accuracy import written_setup
from timing import environment, table

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import Detection, judge, run_detector
from cdtool.base.errors import CdtoolError
from cdtool.commands.learning.fitting import fit_operations
from cdtool.commands.simulate import arm_recordings, gate_recordings
from cdtool.commands.simulate.arm_model import simulate_arm_run
from cdtool.commands.simulate.arm_parameters import ArmParameters
from cdtool.commands.simulate.gate_model import GateParameters, simulate_gate_run
from cdtool.detectors.detection import Signal
from cdtool.formats.machine_file import MachineFile
from cdtool.machines.axis_model.sensor_filters import first_order_low_pass
from cdtool.recordings.motion import motion_class
from cdtool.recordings.operations import Operation
from cdtool.recordings.recording import MEASURED, Recording, Series
from cdtool.results.explanation.explanation import AlarmExplanation, explain_alarm
from cdtool.thresholds.base import FittedThreshold
from cdtool.thresholds.normal_choice import NormalMotions
from cdtool.thresholds.normal_motion import NormalMotion, learn_normal_motion, levels

SEEDS = (911, 912)
ALARMS = 100
WANTED = 0.95
CAUSES = ("contact", "friction change", "speed glitch", "torque spike", "accelerometer knock", "lost samples")
RUNS = 14
# A channel that departs this much later than the first counts as first too [s].
TIE_SECONDS = 0.010
# Normal spreads by which a channel has departed from the run without the disturbance: clearly, so that it must not be
# named after another, and slightly, so that it may be named.
CLEARLY, SLIGHTLY = 6.0, 3.0
# An alarm belongs to a disturbance if it is raised within this time of its beginning [s].
BECAUSE = {"contact": 0.8, "friction change": 0.8}
SHORTLY = 0.15
GROWTH, TRIES = 1.35, 14

Array = np.ndarray
Change = Callable[[Recording, float], Recording]


@dataclass(frozen=True)
class Bench:
    """A simulated machine as it is logged: `simulate(seed, impact, added friction)`, and how its channels are logged.

    `friction` [N or N m]: the step tried first. `start` [s]: start of the steady motion.
    """

    name: str
    setup: Any
    simulate: Callable[..., Recording]
    watched: tuple[str, ...]
    friction: float
    steady: float
    detectors: tuple[str, ...]
    activation: Activation
    references: bool
    own_clocks: bool

    def detector(self, name: str) -> Any:
        """A detector with the gains of the machine file."""
        return CountedSpeed() if name == CountedSpeed.name else self.machine_file.detector(name)

    @property
    def machine_file(self) -> MachineFile:
        return self.setup.machine_file

    def logged(self, recording: Recording) -> Recording:
        """Return the recording as logged: on the load side, with or without references, on one or more clocks."""
        recording = self.machine_file.machine.referred_to_load(recording).without_ground_truth()
        if not self.references:
            kept = {name: series for name, series in recording.channels.items() if name in MEASURED}
            recording = replace(recording, channels=kept)
        return on_own_clocks(recording) if self.own_clocks else recording


@dataclass(frozen=True)
class Case:
    """One alarm with its known cause; `first`: the channels that may be named as the first mover."""

    bench: Bench
    detector: str
    cause: str
    detection: Detection
    normal: NormalMotion
    begin: float
    first: frozenset[tuple[str, str]]
    strength: float


@dataclass(frozen=True)
class Told:
    """The explanation of a case."""

    case: Case
    explanation: AlarmExplanation

    @property
    def cause(self) -> str:
        return str(self.explanation.cause.kind)

    @property
    def first(self) -> tuple[str, str] | None:
        """Return the measured channel and its joint named first before the alarm; references are not sensors."""
        moved = [item for item in self.explanation.moved if item.time <= self.explanation.alarm.time]
        moved = [item for item in moved if item.channel in MEASURED]
        return (moved[0].channel, moved[0].joint) if moved else None

    @property
    def first_right(self) -> bool:
        return self.first in self.case.first if self.case.first else self.first is None


def gate_bench(name: str, gate: GateParameters, **kept: Any) -> Bench:
    """The simulated gate with other parameters."""

    def simulate(seed: Sequence[int], impact: str, friction: Any = None, place: float = 1.0) -> Recording:
        one = replace(gate, obstacle_position=place, impact_duration=place / gate.nominal_speed + 2.2)
        run = simulate_gate_run(one, np.random.default_rng(seed), impact, added_friction=friction)
        return gate_recordings.as_recording(run, f"{name}/{seed[-1]}", one)

    setup = written_setup(partial(gate_recordings.simulate_gate, seed=0, parameters=gate))
    detectors = ("momentum", "inertial_momentum", "friction_ekf", "pure_inertia", "pure_torque", "kalman_momentum")
    steady = gate.start_time + gate.nominal_speed / gate.ramp_acceleration + 0.5
    return Bench(name, setup, simulate, (), 90.0, steady, detectors, **kept)


def arm_bench(name: str, trial: Any, arm: ArmParameters, **kept: Any) -> Bench:
    """The simulated arm with other parameters; the obstacle is where the arm is after 0.6 to 1 of its travel."""

    def simulate(seed: Sequence[int], impact: str, friction: Any = None, place: float = 0.0) -> Recording:
        one = replace(arm, obstacle_angle=(place, place)) if place else arm
        run = simulate_arm_run(one, np.random.default_rng(seed), trial, impact, added_friction=friction)
        return arm_recordings.as_recording(run, f"{name}/{seed[-1]}")

    setup = written_setup(partial(arm_recordings.simulate_arm, seed=0, trial=trial, parameters=arm))
    detectors = ("momentum", "inertial_momentum", "friction_ekf", "kalman_momentum", "direct")
    steady = arm.start_time + arm.nominal_speed / arm.ramp_acceleration + 0.25
    return Bench(name, setup, simulate, ("arm",) if trial == 1 else (), 1.0, steady, detectors, **kept)


@dataclass(frozen=True)
class CountedSpeed:
    """A user's own detector that assumes one clock period per sample, as careless firmware does.

    Speed from the difference of two positions over that period, through a low-pass: a lost sample doubles it.
    """

    cutoff: float = 100.0  # [rad/s]

    name: ClassVar[str] = "counted_speed"
    short_name: ClassVar[str] = "counted"
    title: ClassVar[str] = "Speed by counting samples"
    needs: ClassVar[tuple[str, ...]] = ("position",)
    signed: ClassVar[bool] = True

    def unit(self, machine: Any) -> str:
        return f"{machine.length_unit}/s" if hasattr(machine, "length_unit") else "1/s"

    def signal(self, recording: Recording, machine: Any) -> Signal:
        position = recording["position"]
        held = position.values.copy()
        for k in range(1, len(held)):
            held[k] = np.where(np.isfinite(held[k]), held[k], held[k - 1])
        speed = np.diff(held, axis=0, prepend=held[:1]) / position.period
        columns = [first_order_low_pass(speed[:, j], 1.0 / self.cutoff, position.period) for j in range(speed.shape[1])]
        values = np.column_stack(columns)
        return Signal(position.time, values, np.zeros(values.shape, dtype=np.uint8), self.unit(machine), self.signed)


@cache
def benches() -> tuple[Bench, ...]:
    """Two gates and three arms: speeds, friction, debounce, references and clocks differ."""
    slow = GateParameters(nominal_speed=0.15, coulomb_friction=180.0, static_friction=220.0, free_duration=9.5)
    fast = GateParameters(nominal_speed=0.25, ramp_acceleration=0.3, free_duration=7.0)
    arm = ArmParameters(free_duration=(2.4, 3.2), impact_duration=(2.4, 3.2))
    slower = replace(arm, nominal_speed=np.radians(12.0), coulomb_friction=(3.0, 1.9), static_friction=(3.5, 2.0))
    return (
        gate_bench("gate", fast, activation=Activation(9), references=True, own_clocks=False),
        gate_bench("slow gate, four channels", slow, activation=Activation(3), references=False, own_clocks=True),
        arm_bench("arm, four channels", 1, arm, activation=Activation(7), references=False, own_clocks=False),
        arm_bench("slow arm, own clocks", 1, slower, activation=Activation(2), references=True, own_clocks=True),
        arm_bench("forearm", 2, arm, activation=Activation(5), references=True, own_clocks=False),
    )


@cache
def learned_of(name: str) -> tuple[list[Operation], NormalMotion]:
    """The impact-free runs of a machine, and what its channels normally look like in them."""
    bench = next(item for item in benches() if item.name == name)
    logs = [bench.logged(bench.simulate((77, k), "none")) for k in range(RUNS)]
    operations = [Operation(log, motion_class(log)) for log in logs]
    normal = learn_normal_motion(logs, operations[0].motion)
    assert normal is not None
    return operations, normal


@cache
def threshold_of(name: str, detector: str) -> tuple[FittedThreshold, ...]:
    """The signature of a detector, whatever class a run is given: which one serves is not asked here."""
    bench = next(item for item in benches() if item.name == name)
    machine, instance = bench.machine_file.machine, bench.detector(detector)
    fitted = fit_operations(learned_of(name)[0], machine, instance, bench.setup.signature, watched=bench.watched)
    return fitted.thresholds


def on_own_clocks(recording: Recording) -> Recording:
    """Each channel at another rate and phase: every 2nd, 3rd, ... sample."""
    steps = {"torque": (1, 0), "speed": (2, 1), "position": (4, 1), "acceleration": (1, 0)}
    channels = {}
    for name, series in recording.channels.items():
        every, first = steps.get(name, (5, 2))
        shift = 3e-4 if name == "acceleration" else 0.0
        channels[name] = Series(series.time[first::every] + shift, series.values[first::every], series.unit)
    return replace(recording, channels=channels)


def pulse(time: Array, begin: float, length: float, smooth: float) -> Array:
    """1 from `begin` for `length` [s], through a low-pass of time constant `smooth` [s] where that is above 0."""
    shape = ((time >= begin) & (time < begin + length)).astype(float)
    if not shape.any():
        shape[min(int(np.searchsorted(time, begin)), len(time) - 1)] = 1.0
    return first_order_low_pass(shape, smooth, float(np.median(np.diff(time)))) if smooth else shape


def with_added(recording: Recording, channel: str, joint: int, added: Callable[[Array], Array]) -> Recording:
    """One channel of one joint with something added, of its own clock."""
    series = recording[channel]
    values = series.values.copy()
    values[:, joint] += added(series.time)
    return replace(recording, channels={**recording.channels, channel: replace(series, values=values)})


def without_rows(recording: Recording, begin: float, length: float, channels: Sequence[str], as_nan: bool) -> Recording:
    """Lose samples of some channels from `begin` for `length` [s]: rows missing, or NaN in their place."""
    changed = dict(recording.channels)
    for name in channels:
        series = changed[name]
        gone = (series.time >= begin) & (series.time < begin + length)
        if as_nan:
            changed[name] = replace(series, values=np.where(gone[:, np.newaxis], np.nan, series.values))
        else:
            changed[name] = replace(series, time=series.time[~gone], values=series.values[~gone])
    return replace(recording, channels=changed)


def make_case(seed: int, number: int) -> Case:
    """Return alarm `number` of a seed: its cause in turn, all else random; drawn again if no alarm results."""
    cause = CAUSES[number % len(CAUSES)]
    for attempt in range(40):
        case = _tried_case(np.random.default_rng([seed, number, attempt]), (seed, number, attempt), cause)
        if case is not None:
            return case
    raise RuntimeError(f"no alarm of {cause} for seed {seed}, number {number}")


def _tried_case(rng: np.random.Generator, run: tuple[int, ...], cause: str) -> Case | None:
    bench = benches()[int(rng.integers(len(benches())))]
    name = str(rng.choice(_able(bench, cause)))
    try:
        threshold_of(bench.name, name)
    except CdtoolError:
        return None  # this motion is not assessable for the detector
    joint = bench.machine_file.machine.joints.index(bench.watched[0]) if bench.watched else 0
    if cause == "contact":
        return _contact(bench, name, rng, run)
    clean = bench.logged(bench.simulate(run, "none"))
    begin = float(rng.uniform(bench.steady, clean.end - 0.7))
    scale = {channel: float(np.nanmedian(np.abs(clean[channel].values[:, joint]))) for channel in ("torque", "speed")}
    sign = float(rng.choice((-1.0, 1.0)))
    if cause == "friction change":
        rise = float(rng.uniform(0.01, 0.08))

        def strength(height: float) -> Recording:
            def friction(time: Array) -> Array:
                return height * np.clip((time - begin) / rise, 0.0, 1.0)

            return bench.logged(bench.simulate(run, "none", friction))

        return _stronger(bench, name, cause, clean, begin, strength, bench.friction * float(rng.uniform(0.5, 1.0)))
    if cause == "lost samples":
        return _lost(bench, name, clean, begin, rng)
    length = float(rng.uniform(0.002, 0.012))
    if cause == "speed glitch":
        length = max(length, 2.0 * clean["speed"].period)
        change = partial(_glitch, clean, "speed", joint, sign, begin, length, 0.0)
        return _stronger(bench, name, cause, clean, begin, change, 0.04 * scale["speed"])
    if cause == "torque spike":
        smooth = float(rng.choice((0.0, 0.004)))
        change = partial(_glitch, clean, "torque", joint, sign, begin, length, smooth)
        return _stronger(bench, name, cause, clean, begin, change, 0.5 * scale["torque"])
    frequency, decay = float(rng.uniform(25.0, 90.0)), float(rng.uniform(0.01, 0.03))
    change = partial(_knock, clean, joint, sign, begin, frequency, decay)
    return _stronger(bench, name, cause, clean, begin, change, 1.0)


def _able(bench: Bench, cause: str) -> list[str]:
    """Return the detectors of a bench that read the disturbed channel."""
    reads = {name: bench.detector(name).needs for name in bench.detectors}
    channel = {"speed glitch": "speed", "torque spike": "torque", "accelerometer knock": "acceleration"}.get(cause)
    if cause == "lost samples":
        return [*bench.detectors, *[CountedSpeed.name] * len(bench.detectors)]
    if cause == "friction change":
        return [name for name in bench.detectors if name not in ("pure_inertia",)]
    return [name for name, needs in reads.items() if channel is None or channel in needs]


def _glitch(
    clean: Recording, channel: str, joint: int, sign: float, begin: float, length: float, smooth: float, height: float
) -> Recording:
    return with_added(clean, channel, joint, lambda time: sign * height * pulse(time, begin, length, smooth))


def _knock(
    clean: Recording, joint: int, sign: float, begin: float, frequency: float, decay: float, height: float
) -> Recording:
    def ringing(time: Array) -> Array:
        since = np.maximum(time - begin, 0.0)
        return sign * height * np.exp(-since / decay) * np.sin(2.0 * np.pi * frequency * since)

    return with_added(clean, "acceleration", joint, ringing)


def _contact(bench: Bench, name: str, rng: np.random.Generator, run: tuple[int, ...]) -> Case | None:
    impact = str(rng.choice(("stiff", "soft")))
    if "gate" in bench.name:
        place = float(rng.uniform(0.3, 1.2))
        hit = bench.simulate(run, impact, place=place)
    else:
        place = float(rng.uniform(np.radians(54.0), np.radians(64.0)))
        hit = bench.simulate(run, impact, place=place)
    free = bench.simulate(run, "none", place=place)
    # Up to the contact both runs are the same to the last bit.
    n = min(len(hit["torque"]), len(free["torque"]))
    unlike = np.flatnonzero((hit["force"].values[:n] != free["force"].values[:n]).any(axis=1))
    if not len(unlike):
        return None
    begin = float(hit["force"].time[unlike[0]])
    free = bench.logged(free)
    logged = bench.logged(hit)
    detection = _detect(bench, name, logged)
    return _case(bench, name, "contact", detection, free, begin, 0.0)


def _stronger(
    bench: Bench,
    name: str,
    cause: str,
    clean: Recording,
    begin: float,
    change: Callable[[float], Recording],
    height: float,
) -> Case | None:
    for _ in range(TRIES):
        detection = _detect(bench, name, change(height))
        case = _case(bench, name, cause, detection, clean, begin, height)
        if case is not None:
            return case
        height *= GROWTH
    return None


def _lost(bench: Bench, name: str, clean: Recording, begin: float, rng: np.random.Generator) -> Case | None:
    reads = [*bench.detector(name).needs]
    kinds: tuple[tuple[tuple[str, ...], bool], ...] = (
        (tuple(clean.channels), False),
        ((str(rng.choice(reads)),), True),
        (tuple(reads), True),
    )
    channels, as_nan = kinds[int(rng.integers(len(kinds)))]
    length = float(rng.uniform(0.008, 0.06))
    lost = without_rows(clean, begin, length, channels, as_nan)
    (threshold, *_), factor = threshold_of(bench.name, name), 5.5
    while factor > 1.5:
        detection = _detect(bench, name, lost, threshold.with_safety_factor(factor))
        case = _case(bench, name, "lost samples", detection, clean, begin + length, factor, before=length)
        if case is not None:
            at = case.detection.verdict.alarms[0].time
            whole = _detect(bench, name, clean, threshold.with_safety_factor(factor)).verdict.alarms
            # Without the loss there is no such alarm: only the loss caused it.
            return case if not any(abs(alarm.time - at) < SHORTLY + length for alarm in whole) else None
        factor *= 0.96
    return None


def _detect(bench: Bench, name: str, recording: Recording, threshold: FittedThreshold | None = None) -> Detection:
    machine, detector = bench.machine_file.machine, bench.detector(name)
    thresholds = (threshold,) if threshold else threshold_of(bench.name, name)
    operation = Operation(recording, thresholds[0].motion)  # type: ignore[attr-defined]
    signal = run_detector(operation, machine, detector, bench.watched)
    return judge(operation, name, signal, thresholds, bench.activation)


def _case(
    bench: Bench,
    name: str,
    cause: str,
    detection: Detection,
    clean: Recording,
    begin: float,
    strength: float,
    before: float = 0.0,
) -> Case | None:
    """Return the case if the first alarm was caused by the disturbance."""
    if not detection.verdict.alarms:
        return None
    late = detection.verdict.alarms[0].time - begin
    if not -before <= late <= BECAUSE.get(cause, SHORTLY):
        return None
    normal = learned_of(bench.name)[1]
    faulty = {"lost samples": None, "speed glitch": "speed", "torque spike": "torque"}
    faulty["accelerometer knock"] = "acceleration"
    if cause in faulty:
        channel, joints = faulty[cause], clean.joints
        joint = bench.watched[0] if bench.watched else joints[0]
        first = frozenset({(channel, joint)} if channel else ())
    else:
        first = first_movers(detection, clean, normal)
    return Case(bench, name, cause, detection, normal, begin, first, strength)


def departures(hit: Recording, clean: Recording, normal: NormalMotion, by: float) -> dict[tuple[str, str], float]:
    """Return when each departing channel begins to differ from the run without the disturbance [s].

    A channel departs if 3 consecutive samples differ by this many normal spreads, or its level by as many of its own;
    it begins where it last was within one spread.
    """
    found = {}
    for channel in MEASURED:
        compared = normal.compare(clean, channel)
        series = hit[channel]
        n = min(len(series), len(clean[channel]))
        unlike = series.values[:n] - clean[channel].values[:n]
        level = levels(series.time[:n], unlike)
        for j, joint in enumerate(hit.joints):
            spread, level_spread = (np.nanmedian(part[:, j]) for part in (compared.spread, compared.level_spread))
            out = (np.abs(unlike[:, j]) > by * spread) | (np.abs(level[:, j]) > by * level_spread)
            run = np.flatnonzero(np.lib.stride_tricks.sliding_window_view(out, 3).all(axis=1))
            if len(run):
                within = np.flatnonzero(np.abs(unlike[: run[0] + 1, j]) <= spread)
                found[channel, joint] = float(series.time[within[-1] + 1 if len(within) else run[0]])
    return found


def first_movers(detection: Detection, clean: Recording, normal: NormalMotion) -> frozenset[tuple[str, str]]:
    """Return the channels that may be named first: they depart, not later than the first that departs clearly."""
    hit = detection.operation.recording
    clearly = departures(hit, clean, normal, CLEARLY)
    slightly = departures(hit, clean, normal, SLIGHTLY)
    earliest = min((clearly or slightly).values(), default=0.0)
    return frozenset(key for key, time in slightly.items() if time <= earliest + TIE_SECONDS)


def tell(case: Case) -> Told:
    """Explain a case's alarm."""
    detector = case.bench.detector(case.detector)
    explained = explain_alarm(
        case.detection,
        case.detection.verdict.alarms[0],
        case.bench.activation,
        inputs=detector.needs,
        normals=NormalMotions((case.normal,)),
    )
    return Told(case, explained)


def score(seed: int, alarms: int) -> list[Told]:
    """Every alarm of a seed, explained."""
    return [tell(make_case(seed, number)) for number in range(alarms)]


def right(told: Sequence[Told]) -> tuple[int, int]:
    """Return how many causes, and how many first movers, are right."""
    causes = sum(item.cause == item.case.cause for item in told)
    return causes, sum(item.first_right for item in told)


def report(seed: int, told: Sequence[Told]) -> bool:
    """Print the confusion matrix, the errors, and the score of a seed; return whether it is sufficient."""
    counts = Counter((item.case.cause, item.cause) for item in told)
    columns = [*CAUSES, *sorted({cause for _, cause in counts} - set(CAUSES))]
    print(f"== seed {seed}: true cause (rows) and named cause (columns)", flush=True)
    table(
        ("", *columns, "first mover right"),
        [
            (
                cause,
                *(counts[cause, column] or "." for column in columns),
                f"{sum(x.first_right for x in told if x.case.cause == cause)}"
                f" of {sum(x.case.cause == cause for x in told)}",
            )
            for cause in CAUSES
        ],
    )
    for item in told:
        if item.cause != item.case.cause or not item.first_right:
            wanted = " or ".join(sorted(" of ".join(each) for each in item.case.first)) or "none"
            found = " of ".join(item.first) if item.first else "none"
            print(f"  {item.case.bench.name}, {item.case.detector}, {item.case.cause}: {item.cause};", end=" ")
            print(f"first mover {found}, right is {wanted}")
    causes, first = right(told)
    print(f"right: {causes} of {len(told)} causes, {first} of {len(told)} first movers\n", flush=True)
    return min(causes, first) >= WANTED * len(told)


def main(seeds: Sequence[int], alarms: int) -> int:
    """Print every seed's score; return 0 if all are sufficient."""
    print(f"{environment()}\n", flush=True)
    enough = [report(seed, score(seed, alarms)) for seed in seeds]
    print(f"at least {100 * WANTED:.0f} % in every seed: {'held' if all(enough) else 'NOT HELD'}")
    return 0 if all(enough) else 1


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(SEEDS))
    parser.add_argument("--alarms", type=int, default=ALARMS, help="alarms per seed")
    given = parser.parse_args()
    sys.exit(main(given.seeds, given.alarms))
