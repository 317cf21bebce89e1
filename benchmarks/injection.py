"""Injected against true latencies on the simulated gate: the same runs with the same noise, hit and not hit.

Every free run has a true twin: the same seed, simulated with the obstacle. The contact is injected into the free run
with a model of the axis, and both are judged by the same detectors with the same signatures. Parameters are the
simulator's own ("true"), or identified from 14 impact-free runs ("identified": the accelerometer's bandwidth and the
stiffness of the front are given, as a data sheet and a drawing give them).

python benchmarks/injection.py                # 5 seeds, with and without references, 8 pairs each: 8 min
python benchmarks/injection.py --seeds 1 --pairs 4
python benchmarks/injection.py --contacts 3   # only: identified, and three stiff contacts with a load cell added
"""

from __future__ import annotations

import argparse
import math
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from timing import main

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from cdtool.activation import Activation  # noqa: E402
from cdtool.axis_model.obstacle import Obstacle  # noqa: E402
from cdtool.axis_model.parameters import AxisModel, Drive, Sensors  # noqa: E402
from cdtool.detectors import DETECTORS  # noqa: E402
from cdtool.evaluation.truth.onset import find_contacts  # noqa: E402
from cdtool.evaluation.truth.onset_rule import OnsetRule  # noqa: E402
from cdtool.identification.axis_run import axis_run  # noqa: E402
from cdtool.identification.contact_fit import ContactSettings, identify_contacts, with_contacts  # noqa: E402
from cdtool.identification.load_cell_contact import load_cell_contact  # noqa: E402
from cdtool.identification.speed_controller import identify_controller  # noqa: E402
from cdtool.identification.two_mass import TwoMassSettings, identify_two_mass  # noqa: E402
from cdtool.injection.assumption import assumptions_of  # noqa: E402
from cdtool.injection.axis_contact import axis_contact  # noqa: E402
from cdtool.injection.injected_recording import injected_recording  # noqa: E402
from cdtool.operations import operations_of  # noqa: E402
from cdtool.pipeline import detect_operation, run_detector  # noqa: E402
from cdtool.recording import Recording  # noqa: E402
from cdtool.simulation.gate_model import Impact, simulate_gate_run  # noqa: E402
from cdtool.simulation.gate_recordings import as_recording  # noqa: E402
from cdtool.thresholds.signature import Signature  # noqa: E402
from tests.axis_model.gate_as_model import gate_as_model, soft_obstacle, stiff_obstacle  # noqa: E402
from tests.synthetic.gate_runs import GATE, ON_LOAD_SIDE, free_recording, without_references  # noqa: E402

SEEDS, PAIRS, LEARNED = 5, 8, 14
FIRST_SEED = 7000
KINDS: tuple[Impact, ...] = ("stiff", "soft")
# Of the mean paired difference: share of the true latency, and [ms].
LIMITS = {"true": (0.05, 2.0), "identified": (0.12, 4.0), "contacts": (0.10, 3.0)}
WITH_REFERENCES = ("desired_dynamics", "torque_deviation")
LEFT_OUT = ("torque_deviation",)  # the gate's torque follows its reference closely, hit or not: it misses both


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


def identified_model(seed: int, references: bool, contacts: int = 0) -> AxisModel:
    """The gate's model from its impact-free runs and from real contacts, with what a data sheet states."""
    recordings = [free_recording(GATE, seed, number, references=references) for number in range(LEARNED)]
    runs = [axis_run(ON_LOAD_SIDE.referred_to_load(recording)) for recording in recordings]
    sensors = Sensors(
        torque_filter_time=GATE.torque_filter_time,
        accelerometer_hz=GATE.accelerometer_frequency,
        accelerometer_damping=GATE.accelerometer_damping,
    )
    fit = identify_two_mass(runs, TwoMassSettings(motor_mass=GATE.motor_mass, sensors=sensors))
    model = fit.model
    drive = Drive(
        motor_mass=model.drive.motor_mass,
        load_mass=model.drive.load_mass,
        stiffness=model.drive.stiffness,
        front_stiffness=GATE.post_stiffness,
        observed_wind_up=fit.largest_wind_up,
    )
    of_controller = identify_controller(runs)
    slope = {item.key: item.numbers for item in of_controller.identified.not_identifiable}.get("slew_limit", {})
    controller = of_controller.controller
    if controller is not None:
        controller = replace(controller, observed_slope=slope.get("largest_n_per_s", 0.0))
    model = replace(model, drive=drive, controller=controller)
    if not contacts:
        return model
    struck = []
    for number in range(contacts):
        hit = simulate_gate_run(GATE, np.random.default_rng([seed, 2000 + number]), "stiff")
        recording = loaded(as_recording(hit, f"contact {number}", GATE), references)
        struck.append(load_cell_contact(recording, find_contacts(recording, OnsetRule())[0], model))
    stiffness_error = fit.identified["stiffness"].relative_error
    settings = ContactSettings(largest_wind_up=fit.largest_wind_up, stiffness_error=stiffness_error)
    return with_contacts(model, identify_contacts(struck, model, settings))


def compare(seed: int, model: AxisModel, kind: Impact, references: bool, pairs: int) -> dict[str, Latencies]:
    """The latencies of every detector on injected and true contacts of one seed."""
    obstacle: Obstacle = {"stiff": stiff_obstacle(GATE), "soft": soft_obstacle(GATE)}[kind]
    free = [loaded(free_recording(GATE, seed, number), references) for number in range(LEARNED)]
    names = [name for name in DETECTORS.usable_names() if name not in LEFT_OUT]
    names = [name for name in names if references or name not in WITH_REFERENCES]
    if model.controller is None:
        names = [name for name in names if name != "pure_torque"]
    judges = {}
    for name in names:
        detector = DETECTORS.load(name)()
        runs = [operations_of(recording)[0] for recording in free]
        pairs_to_fit = [(run.recording, run_detector(run, ON_LOAD_SIDE, detector)) for run in runs]
        judges[name] = (detector, Signature().fit(pairs_to_fit))
    found: dict[str, list[list[float]]] = {name: [] for name in names}
    for number in range(pairs):
        rng = (seed, 1000 + number)
        hit = simulate_gate_run(GATE, np.random.default_rng(rng), kind)
        clean = as_recording(simulate_gate_run(GATE, np.random.default_rng(rng), "none"), "free", GATE)
        clean = clean if references else without_references(clean)
        assert hit.contact_start is not None
        run = axis_run(ON_LOAD_SIDE.referred_to_load(clean))
        recordings = []
        for assumption in assumptions_of(model):
            contact = axis_contact(run, model, obstacle, hit.contact_start, 1.1, assumption)
            injected = injected_recording(clean, ON_LOAD_SIDE, contact.changes, contact.force, (0,))
            recordings.append(ON_LOAD_SIDE.referred_to_load(injected))
        recordings.append(loaded(as_recording(hit, "hit", GATE), references))
        for name, (detector, fitted) in judges.items():
            latencies = []
            for recording in recordings:
                operation = operations_of(recording)[0]
                verdict = detect_operation(operation, ON_LOAD_SIDE, detector, (fitted,), Activation()).verdict
                after = [alarm.time for alarm in verdict.alarms if alarm.time > hit.contact_start]
                latencies.append(1e3 * (after[0] - hit.contact_start) if after else math.nan)
            found[name].append(latencies)
    return {name: Latencies(np.array(items).T[:-1], np.array(items).T[-1]) for name, items in found.items()}


def measure(seeds: int, pairs: int, contacts: int) -> bool:
    met = True
    for parameters, (share, least) in LIMITS.items():
        if (parameters == "contacts") != (contacts > 0):
            continue
        for references in (True, False):
            for kind in KINDS:
                merged: dict[str, list[Latencies]] = {}
                for seed in range(FIRST_SEED, FIRST_SEED + seeds):
                    is_true = parameters == "true"
                    model = gate_as_model(GATE) if is_true else identified_model(seed, references, contacts)
                    for name, item in compare(seed, model, kind, references, pairs).items():
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
    parser.add_argument("--contacts", type=int, default=0, help="real contacts with a load cell to identify from")
    chosen = parser.parse_args()
    main("injected and true latencies", lambda: measure(chosen.seeds, chosen.pairs, chosen.contacts))
