"""Drive and load of the simulated gate from contacts with a load cell, set by set, and how often the errors cover.

Every set has 14 impact-free runs, from which stiffness and friction are identified, and three stiff contacts. Every
third set is the default track, the others have the friction's waves with other phases. The stiffness of the front is
given, as a drawing gives it. Then the scale of the torque channel, from slow presses on the load cell and releases.

python benchmarks/identification_contacts.py [SETS]      # 30 sets and 20 presses: 3 min
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from timing import main

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from cdtool.commands.identify.axis.torque_constant import identify_torque_scale  # noqa: E402
from cdtool.commands.identify.axis.two_mass import TwoMassSettings, identify_two_mass  # noqa: E402
from cdtool.commands.identify.contact.contact_fit import ContactFit, ContactSettings, identify_contacts  # noqa: E402
from cdtool.commands.identify.contact.load_cell_contact import load_cell_contact  # noqa: E402
from cdtool.commands.simulate import sensors  # noqa: E402
from cdtool.commands.simulate.gate_model import GateParameters, integrate_gate, simulate_gate_run  # noqa: E402
from cdtool.commands.simulate.gate_recordings import as_recording  # noqa: E402
from cdtool.machines.axis_model.parameters import Sensors  # noqa: E402
from cdtool.recordings.recording import Recording, Series  # noqa: E402
from cdtool.truth.onset import find_contacts  # noqa: E402
from cdtool.truth.onset_rule import OnsetRule  # noqa: E402
from tests.synthetic.gate_runs import GATE, ON_LOAD_SIDE, free_runs, on_any_track  # noqa: E402

SETS, RUNS, CONTACTS, FIRST_SEED = 30, 14, 3, 3000
TORQUE_SCALE = 0.9
PRESSES = ((0.02, 6.0), (0.01, 12.0))  # speed reference [m/s] and duration [s]
SENSORS = Sensors(
    torque_filter_time=GATE.torque_filter_time,
    accelerometer_hz=GATE.accelerometer_frequency,
    accelerometer_damping=GATE.accelerometer_damping,
)
TRUTH = {
    "load_mass": GATE.leaf_mass,
    "take_up_travel": GATE.take_up_travel,
    "end_stiffness": GATE.drive_stiffness,
    "stiffness": GATE.take_up_stiffness,
    "end_damping": GATE.drive_damping,
    "front_mass": GATE.post_mass,
    "motor_friction": GATE.motor_friction,
}
# Largest error of every set, and share of the sets whose error is within two standard errors.
LARGEST = {"load_mass": 0.05, "take_up_travel": 0.15, "end_stiffness": 0.10}
COVERED = {"load_mass": 0.85, "take_up_travel": 0.85, "end_stiffness": 0.85}


def contact_fit(gate: GateParameters, seed: int) -> ContactFit:
    """What three contacts show, after the impact-free runs of the same gate."""
    runs = free_runs(gate, seed, RUNS)
    free = identify_two_mass(runs, TwoMassSettings(motor_mass=gate.motor_mass, sensors=SENSORS))
    model = replace(free.model, drive=replace(free.model.drive, front_stiffness=gate.post_stiffness))
    contacts = []
    for number in range(CONTACTS):
        run = simulate_gate_run(gate, np.random.default_rng([seed, 2000 + number]), "stiff")
        recording = ON_LOAD_SIDE.referred_to_load(as_recording(run, f"contact {number}", gate))
        first = find_contacts(recording, OnsetRule())[0]
        contacts.append(load_cell_contact(recording, first, model))
    stiffness = free.identified["stiffness"]
    settings = ContactSettings(largest_wind_up=free.largest_wind_up, stiffness_error=stiffness.relative_error)
    return identify_contacts(contacts, model, settings)


def measure(sets: int) -> bool:
    errors: dict[str, list[tuple[float, float]]] = {name: [] for name in TRUTH}
    for number in range(sets):
        gate = GATE if number % 3 == 0 else on_any_track(GATE, number)
        fit = contact_fit(gate, FIRST_SEED + number)
        for estimate in (*fit.identified.estimates, *fit.together):
            if estimate.key in TRUTH:
                true = TRUTH[estimate.key]
                errors[estimate.key].append(((estimate.value - true) / true, estimate.standard_error / true))
    print(f"\n{sets} sets, {RUNS} impact-free runs and {CONTACTS} contacts each")
    met = True
    for name, rows in errors.items():
        error, stated = np.array(rows).T
        inside = [float(np.mean(np.abs(error) <= many * stated)) for many in (1.0, 2.0)]
        largest = float(np.max(np.abs(error)))
        good = len(error) == sets and largest <= LARGEST.get(name, np.inf) and inside[1] >= COVERED.get(name, 0.0)
        met &= good
        print(
            f"{'ok   ' if good else 'WORSE'} {name:16s} known {len(error)}, mean error {100 * np.mean(error):+5.1f} %, "
            f"RMS {100 * np.sqrt(np.mean(error**2)):5.1f} %, largest {100 * largest:5.1f} %, stated "
            f"{100 * np.median(stated):4.1f} %, within one {100 * inside[0]:3.0f} %, two {100 * inside[1]:3.0f} %"
        )
    return met


def press(seed: int, speed: float, duration: float) -> Recording:
    """A press on the load cell with the speed reference [m/s] and the release of it, `duration` [s] each.

    The torque channel has 1 / TORQUE_SCALE of the true torque.
    """
    rng = np.random.default_rng([seed, 5000])
    period = GATE.sample_period
    time = period * np.arange(round((3.5 + 2.0 * duration) / period))
    turn = 1.0 + duration
    corners = [0.3, 0.4, turn, turn + 0.1, turn + 0.6, turn + 0.7, turn + 1.2 + duration, turn + 1.3 + duration]
    reference = speed * np.interp(time, corners, [0.0, 1.0, 1.0, 0.0, 0.0, -1.0, -1.0, 0.0])
    white = rng.standard_normal((3, len(time)))
    disturbance = sensors.coloured_noise(white[0], GATE.disturbance_force, GATE.disturbance_rate, period)
    run = (1.0 + GATE.friction_scatter * rng.standard_normal(), rng.uniform(0.0, 2.0 * np.pi), 5e-3)
    truth, _ = integrate_gate(GATE, np.zeros(7), reference, disturbance, run, "stiff", 5)
    torque = sensors.measured_torque(truth["motor_force"], white[1], GATE.torque_noise, GATE.torque_filter_time, period)
    channels = {
        "torque": Series(time, torque / TORQUE_SCALE, "N"),
        "speed": Series(time, truth["measured_speed"], "m/s"),
        "position": Series(time, truth["measured_position"], "m"),
        "force": Series(time, truth["contact_force"] + GATE.load_cell_noise * white[2], "N"),
    }
    return Recording(f"press {seed}", f"press {seed}", ("gate",), channels)


def torque_scales() -> bool:
    rows = []
    for speed, duration in PRESSES:
        for seed in range(FIRST_SEED, FIRST_SEED + 10):
            recording = press(seed, speed, duration)
            contact = find_contacts(recording, OnsetRule())[0]
            found = identify_torque_scale([(recording, contact)], GATE.leaf_mass + GATE.motor_mass)
            rows.append((found.factor / TORQUE_SCALE - 1.0, found.standard_error / TORQUE_SCALE))
    error, stated = np.array(rows).T
    covered = float(np.mean(np.abs(error) <= 2.0 * stated))
    largest = float(np.max(np.abs(error)))
    good = largest <= 0.05 and covered >= 0.85
    print(
        f"{'ok   ' if good else 'WORSE'} torque scale     known {len(rows)}, mean error {100 * np.mean(error):+5.1f} %,"
        f" RMS {100 * np.sqrt(np.mean(error**2)):5.1f} %, largest {100 * largest:5.1f} %, stated "
        f"{100 * np.median(stated):4.1f} %, within two {100 * covered:3.0f} %"
    )
    return good


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else SETS
    main("identified and true parameters of contacts", lambda: measure(count) & torque_scales())
