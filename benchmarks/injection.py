"""Injected against true latencies on simulated gates: the same strokes with the same noise, hit and not hit.

Every free stroke has a true twin: the same seed, simulated with the obstacle. The contact is injected into the free
stroke with a model of the axis, and both are judged by the same detectors with the same signatures. On the package's
own gate the parameters are the simulator's ("true"), or identified from 14 impact-free runs ("identified": the
accelerometer's bandwidth and the stiffness of the front are given, as a data sheet and a drawing give them). The plain
gates are of another simulator (tests/synthetic/plain_gate.py) whose drive and friction are not those of the model: ten
machines drawn at random, each identified by `cdtool identify` from 14 strokes.

python benchmarks/injection.py                # 5 seeds, with and without references, 8 pairs each: 8 min
python benchmarks/injection.py --seeds 1 --pairs 4
python benchmarks/injection.py --plain 10     # only: plain gates, six pairs per obstacle: 8 min
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from timing import main

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

import cdtool  # noqa: E402
from cdtool.alarms.activation import Activation  # noqa: E402
from cdtool.alarms.pipeline import detect_operation, run_detector  # noqa: E402
from cdtool.commands.identify.axis.speed_controller import identify_controller  # noqa: E402
from cdtool.commands.identify.axis.two_mass import TwoMassSettings, identify_two_mass  # noqa: E402
from cdtool.commands.identify.identifying import IdentifiedMachine  # noqa: E402
from cdtool.commands.inject.assumption import ControllerReaction, assumptions_of  # noqa: E402
from cdtool.commands.inject.axis_contact import axis_contact  # noqa: E402
from cdtool.commands.inject.injected_logs import injected_recording  # noqa: E402
from cdtool.commands.inject.with_injected import refusal  # noqa: E402
from cdtool.commands.simulate.gate_model import Impact, simulate_gate_run  # noqa: E402
from cdtool.detectors import DETECTORS  # noqa: E402
from cdtool.formats.machine_file import read_machine_file  # noqa: E402
from cdtool.machines.axis import Axis  # noqa: E402
from cdtool.machines.axis_model.axis_run import axis_run  # noqa: E402
from cdtool.machines.axis_model.model_table import axis_model  # noqa: E402
from cdtool.machines.axis_model.obstacle import Obstacle  # noqa: E402
from cdtool.machines.axis_model.parameters import AxisModel, ElasticDrive, Sensors  # noqa: E402
from cdtool.machines.linear_axis import LinearAxis  # noqa: E402
from cdtool.recordings.operations import operations_of  # noqa: E402
from cdtool.recordings.recording import Recording  # noqa: E402
from cdtool.results.agreement import with_model_error  # noqa: E402
from cdtool.thresholds.signature import Signature  # noqa: E402
from tests.machines.axis_model.gate_as_model import gate_as_model, soft_obstacle, stiff_obstacle  # noqa: E402
from tests.synthetic import plain_gate  # noqa: E402
from tests.synthetic.gate_as_recording import as_recording  # noqa: E402
from tests.synthetic.gate_runs import GATE, ON_LOAD_SIDE, free_recording, without_references  # noqa: E402

SEEDS, PAIRS, LEARNED = 5, 8, 14
FIRST_SEED = 7000
KINDS: tuple[Impact, ...] = ("stiff", "soft")
# Of the mean paired difference: share of the true latency, and [ms].
LIMITS = {"true": (0.05, 2.0), "identified": (0.12, 4.0)}
WITH_REFERENCES = ("desired_dynamics", "torque_deviation")
LEFT_OUT = ("torque_deviation",)  # the gate's torque follows its reference closely, hit or not: it misses both
PLAIN_DETECTORS = ("inertial_momentum", "friction_ekf", "momentum", "pure_torque")
PLAIN_STIFFNESSES = (5e3, 20e3, 100e3, 500e3)  # N/m
PLAIN_PAIRS, FIRST_PAIR = 6, 100
RATIO = 1e-3  # m/rad, of the plain gates' drive
# What the motor of a plain gate logs, and the factor from the load side.
MOTOR_SIDE = {
    "torque": ("N m", RATIO),
    "speed": ("rad/s", 1.0 / RATIO),
    "position": ("rad", 1.0 / RATIO),
    "reference_speed": ("rad/s", 1.0 / RATIO),
}


@dataclass(frozen=True)
class Latencies:
    """Injected (assumptions, pairs) and true (pairs,) latencies [ms] of one detector; NaN where the contact is missed.

    A parameter that is not known has two bounds, each an assumption: the injected latency is a range.
    """

    injected: np.ndarray
    true: np.ndarray

    @property
    def differences(self) -> np.ndarray:
        """Mean paired difference of each assumption."""
        return np.nanmean(self.injected - self.true, axis=1)

    @property
    def difference(self) -> float:
        """How far the true mean is outside the range: 0 within it, else the difference of the nearer bound."""
        if np.min(self.differences) <= 0.0 <= np.max(self.differences):
            return 0.0
        return float(self.differences[np.argmin(np.abs(self.differences))])

    @property
    def is_in_stated_range(self) -> bool:
        """Whether the true mean is within the range that the benchmark prints for the injected contacts."""
        injected = np.nanmean(self.injected, axis=1)
        low, high = with_model_error(float(np.min(injected)), float(np.max(injected)))
        return low <= float(np.nanmean(self.true)) <= high

    @property
    def standard_error(self) -> float:
        difference = self.injected[0] - self.true
        known = difference[np.isfinite(difference)]
        return float(np.std(known, ddof=1) / math.sqrt(len(known))) if len(known) > 1 else 0.0

    @property
    def same_misses(self) -> bool:
        """Whether every true miss is one under some assumption, and every miss under all assumptions is true."""
        missed = np.isnan(self.injected)
        return bool(
            np.all(missed.all(axis=0) <= np.isnan(self.true)) and np.all(np.isnan(self.true) <= missed.any(axis=0))
        )


def joined(items: list[Latencies]) -> Latencies:
    """The pairs of several seeds; a seed without a bracket has its one latency for both bounds."""
    most = max(len(item.injected) for item in items)
    injected = [
        np.broadcast_to(item.injected, (most, len(item.true))) if len(item.injected) == 1 else item.injected
        for item in items
    ]
    return Latencies(np.concatenate(injected, axis=1), np.concatenate([item.true for item in items]))


def loaded(recording: Recording, references: bool) -> Recording:
    return ON_LOAD_SIDE.referred_to_load(recording if references else without_references(recording))


def identified_model(seed: int, references: bool) -> AxisModel:
    """The gate's model from its impact-free runs, with what a data sheet states."""
    recordings = [free_recording(GATE, seed, number, references=references) for number in range(LEARNED)]
    runs = [axis_run(ON_LOAD_SIDE.referred_to_load(recording)) for recording in recordings]
    sensors = Sensors(
        torque_filter_time=GATE.torque_filter_time,
        accelerometer_hz=GATE.accelerometer_frequency,
        accelerometer_damping=GATE.accelerometer_damping,
    )
    fit = identify_two_mass(runs, TwoMassSettings(motor_mass=GATE.motor_mass, sensors=sensors))
    model = fit.model
    drive = ElasticDrive(
        motor_mass=model.drive.motor_mass,
        load_mass=model.drive.load_mass,
        stiffness=model.drive.stiffness,
        front_stiffness=GATE.post_stiffness,
        observed_wind_up=fit.largest_wind_up,
    )
    of_controller = identify_controller(runs) if references else None
    controller = of_controller.controller if of_controller else None
    if of_controller is not None and controller is not None:
        slope = {item.key: item.numbers for item in of_controller.identified.not_identifiable}.get("slew_limit", {})
        controller = replace(controller, observed_slope=slope.get("largest_n_per_s", 0.0))
    return replace(model, drive=drive, controller=controller)


@dataclass(frozen=True)
class Pair:
    """A free stroke as logged, the same stroke with a contact, and when that begins [s]."""

    free: Recording
    hit: Recording
    contact: float


def compare(
    machine: Axis,
    learned: Sequence[Recording],
    pairs: Sequence[Pair],
    model: AxisModel,
    obstacle: Obstacle,
    names: Sequence[str],
) -> dict[str, Latencies]:
    """The latencies of detectors by name on injected and on true contacts."""
    judges = {}
    for name in names:
        detector = DETECTORS.load(name)()
        runs = [operations_of(machine.referred_to_load(recording))[0] for recording in learned]
        pairs_to_fit = [(run.recording, run_detector(run, machine, detector)) for run in runs]
        judges[name] = (detector, Signature().fit(pairs_to_fit))
    found: dict[str, list[list[float]]] = {name: [] for name in names}
    for pair in pairs:
        run = axis_run(machine.referred_to_load(pair.free))
        recordings = []
        for assumption in assumptions_of(model):
            contact = axis_contact(run, model, obstacle, pair.contact, 1.1, assumption)
            recordings.append(injected_recording(pair.free, machine, contact.changes, contact.force, (0,)))
        operations = [operations_of(machine.referred_to_load(item))[0] for item in (*recordings, pair.hit)]
        for name, (detector, fitted) in judges.items():
            latencies = []
            for operation in operations:
                verdict = detect_operation(operation, machine, detector, (fitted,), Activation()).verdict
                after = [alarm.time for alarm in verdict.alarms if alarm.time > pair.contact]
                latencies.append(1e3 * (after[0] - pair.contact) if after else math.nan)
            found[name].append(latencies)
    return {name: Latencies(np.array(items).T[:-1], np.array(items).T[-1]) for name, items in found.items()}


def compare_gate(seed: int, model: AxisModel, kind: Impact, references: bool, pairs: int) -> dict[str, Latencies]:
    """The latencies of every detector on injected and true contacts of the package's gate, of one seed."""
    logged: Callable[[Recording], Recording] = (lambda item: item) if references else without_references
    twins = []
    for number in range(pairs):
        rng = (seed, 1000 + number)
        hit = simulate_gate_run(GATE, np.random.default_rng(rng), kind)
        clean = as_recording(simulate_gate_run(GATE, np.random.default_rng(rng), "none"), "free", GATE)
        assert hit.contact_start is not None
        twins.append(Pair(logged(clean), logged(as_recording(hit, "hit", GATE)), hit.contact_start))
    names = [name for name in DETECTORS.usable_names() if name not in LEFT_OUT]
    names = [name for name in names if references or name not in WITH_REFERENCES]
    if model.controller is None:
        # Pure inertia sees the soft impact after 390 ms, when neither bound of the controller's reaction holds.
        unseen = {"pure_torque"} | ({"pure_inertia"} if kind == "soft" else set())
        names = [name for name in names if name not in unseen]
    learned = [logged(free_recording(GATE, seed, number)) for number in range(LEARNED)]
    obstacle: Obstacle = {"stiff": stiff_obstacle(GATE), "soft": soft_obstacle(GATE)}[kind]
    return compare(ON_LOAD_SIDE, learned, twins, model, obstacle, names)


def plain_columns(gate: plain_gate.PlainGate) -> dict[str, tuple[str, float]]:
    """Unit and factor of each column: a rigid gate logs its load, an elastic one its motor."""
    of_load = {name: (unit, 1.0) for name, unit in plain_gate.CHANNELS.items()}
    return of_load if gate.is_rigid else of_load | MOTOR_SIDE


def plain_machine(gate: plain_gate.PlainGate) -> str:
    """The machine file that the maker of a plain gate would write, with masses that are 8 % too low."""
    lines = ['[machine]\ntype = "linear_axis"\nname = "gate"']
    if gate.is_rigid:
        lines += ['coordinates = "load"', f"load_mass = {0.92 * (gate.motor_mass + gate.leaf_mass)}"]
    else:
        lines += [f"motor_inertia = {gate.motor_mass * RATIO**2}", f"load_mass = {0.92 * gate.leaf_mass}"]
        lines += [f"transmission_ratio = {RATIO}"]
    lines += ['[channels]\ntime = { column = "time", unit = "s" }']
    lines += [f'{name} = {{ column = "{name}", unit = "{unit}" }}' for name, (unit, _) in plain_columns(gate).items()]
    lines += ["[model.sensors]", f"torque_filter_time = {gate.torque_filter}"]
    return "\n".join((*lines, f"accelerometer_hz = {gate.accelerometer_hz}\n"))


def identify_plain(gate: plain_gate.PlainGate, learned: Sequence[Recording], folder: Path) -> IdentifiedMachine:
    """The result of `cdtool identify` for the logs of a plain gate; it writes `identified.toml`."""
    of_gate = plain_columns(gate)
    logs = [folder / f"{number}.csv" for number in range(len(learned))]
    for log, recording in zip(logs, learned, strict=True):
        columns = [factor * recording[name].values[:, 0] for name, (_, factor) in of_gate.items()]
        rows = np.column_stack((recording["torque"].time, *columns))
        np.savetxt(log, rows, "%.9g", ",", header=f"time,{','.join(of_gate)}", comments="")
    (folder / "machine.toml").write_text(plain_machine(gate), encoding="utf-8")
    return cdtool.identify(logs, folder / "machine.toml", folder / "identified.toml")


def identified_plain(gate: plain_gate.PlainGate, learned: Sequence[Recording]) -> AxisModel:
    """The model that `cdtool identify` writes from the logs of a plain gate."""
    with tempfile.TemporaryDirectory() as folder:
        identify_plain(gate, learned, Path(folder))
        machine_file = read_machine_file(Path(folder) / "identified.toml")
        assert isinstance(machine_file.machine, LinearAxis)
        return axis_model(machine_file.machine, machine_file.model)


def compare_plain(
    gate: plain_gate.PlainGate,
    seed: int,
    stiffnesses: Sequence[float] = PLAIN_STIFFNESSES,
    pairs: int = PLAIN_PAIRS,
    names: Sequence[str] = PLAIN_DETECTORS,
) -> Mapping[float, dict[str, Latencies]]:
    """The latencies on a plain gate by the stiffness of the obstacle, with the identified model.

    A detector is left out that `cdtool inject` refuses with this model.
    """
    numbers = range(FIRST_PAIR, FIRST_PAIR + pairs)
    free = plain_gate.strokes(gate, seed, [*range(LEARNED), *numbers]).recordings
    struck = plain_gate.strokes(gate, seed, [*numbers] * len(stiffnesses), np.repeat(stiffnesses, pairs))
    twins = [
        Pair(*item)
        for item in zip([*free[LEARNED:]] * len(stiffnesses), struck.recordings, struck.contacts, strict=True)
    ]
    model = identified_plain(gate, free[:LEARNED])
    reaction = ControllerReaction.KNOWN if model.controller else ControllerReaction.FROZEN
    names = [name for name in names if refusal(DETECTORS.load(name).needs, model, reaction) is None]
    table = {"name": "gate", "coordinates": "load", "load_mass": model.drive.total_mass}
    machine = LinearAxis.of(table)
    return {
        stiffness: compare(
            machine,
            free[:LEARNED],
            twins[pairs * index : pairs * (index + 1)],
            model,
            Obstacle.spring(stiffness, plain_gate.CONTACT_DAMPING),
            names,
        )
        for index, stiffness in enumerate(stiffnesses)
    }


def measure_plain(machines: int) -> bool:
    """Show how far the true means of plain gates are from the injected ones; at least 95 % within the stated range."""
    cells: dict[tuple[float, str], list[Latencies]] = {}
    outside = []
    for seed in range(machines):
        for stiffness, of_detector in compare_plain(plain_gate.drawn_gate(seed), seed).items():
            for name, item in of_detector.items():
                cells.setdefault((stiffness, name), []).append(item)
                outside += [] if item.is_in_stated_range else [seed]
    for (stiffness, name), items in cells.items():
        true = [float(np.nanmean(item.true)) for item in items]
        pairs = np.concatenate([(item.injected - item.true)[0] for item in items])
        shares = [100.0 * item.difference / mean for item, mean in zip(items, true, strict=True)]
        missed = sum(not item.same_misses for item in items)
        print(
            f"{stiffness / 1e3:4.0f} N/mm {name:18s} true {np.mean(true):6.1f} ms, mean of a machine "
            f"{min(shares):+4.0f} to {max(shares):+3.0f} %, one contact {np.nanmean(pairs):+5.1f} +- "
            f"{np.nanstd(pairs):4.1f} ms, other misses on {missed}, refused on {machines - len(items)} of {machines}"
        )
    means, whole = sum(map(len, cells.values())), machines - len(set(outside))
    print(f"within the stated range: {means - len(outside)} of {means} means, all of {whole} of {machines} machines")
    print(f"outside, by machine: {dict(Counter(outside))}")
    return len(outside) <= 0.05 * means


def measure(seeds: int, pairs: int) -> bool:
    met = True
    for parameters, (share, least) in LIMITS.items():
        for references in (True, False):
            for kind in KINDS:
                merged: dict[str, list[Latencies]] = {}
                for seed in range(FIRST_SEED, FIRST_SEED + seeds):
                    is_true = parameters == "true"
                    model = gate_as_model(GATE) if is_true else identified_model(seed, references)
                    for name, item in compare_gate(seed, model, kind, references, pairs).items():
                        merged.setdefault(name, []).append(item)
                print(f"\n{parameters} parameters, {'with' if references else 'without'} references, {kind}")
                for name, items in merged.items():
                    both = joined(items)
                    true = float(np.nanmean(both.true))
                    limit = max(share * true, least)
                    limit += 2.0 * both.standard_error if parameters == "identified" else 0.0
                    good = abs(both.difference) <= limit and both.same_misses
                    met &= good
                    words = "ok   " if good else "WORSE"
                    misses = [int(np.isnan(values).sum()) for values in (both.injected[0], both.true)]
                    missed = f"misses {misses[0]} and {misses[1]} of {len(both.true)}"
                    difference = f"{both.difference:+5.1f} +- {both.standard_error:.1f} of {limit:.1f}"
                    means = np.nanmean(both.injected, axis=1)
                    bounds = f"{np.min(means):6.1f}" + (f" to {np.max(means):.1f}" if np.ptp(means) > 0.05 else "")
                    latencies = f"injected {bounds} true {true:6.1f} ms"
                    print(f"{words} {name:18s} {latencies}, difference {difference}, {missed}")
    return met


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--pairs", type=int, default=PAIRS)
    parser.add_argument("--plain", type=int, default=0, help="machines of the other simulator")
    chosen = parser.parse_args()
    if chosen.plain:
        main("injected and true latencies of plain gates", lambda: measure_plain(chosen.plain))
    else:
        main("injected and true latencies", lambda: measure(chosen.seeds, chosen.pairs))
