"""Identified parameters of the simulated gate against the true ones, set by set, and how often the errors cover.

Every set is a gate on another track (the friction's waves with other phases) with 14 impact-free runs of its own.
The robots are four kinds with random parameters, by dynamics that share nothing with cdtool (tests/synthetic).

python benchmarks/identification.py [SETS]              # 50 sets with references and 50 without: 4 min
python benchmarks/identification.py robots [OF A KIND]  # 5 robots of each of four kinds: 10 min
"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from timing import main

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from cdtool.axis_model.parameters import Sensors  # noqa: E402
from cdtool.identification.two_mass import TwoMassFit, TwoMassSettings, identify_two_mass  # noqa: E402
from tests.identification.robot_coverage import (  # noqa: E402
    Value,
    friction_values,
    gain_values,
    gain_values_with_centre,
    table_of,
)
from tests.synthetic.gate_runs import GATE, free_runs, on_any_track  # noqa: E402
from tests.synthetic.strange_robots import KINDS  # noqa: E402

SETS, RUNS, FIRST_SEED = 50, 14, 1000
SENSORS = Sensors(accelerometer_hz=GATE.accelerometer_frequency, accelerometer_damping=GATE.accelerometer_damping)
COULOMB = GATE.coulomb_friction + GATE.motor_friction
TRUTH = {
    "load_mass": GATE.leaf_mass,
    "stiffness": GATE.take_up_stiffness,
    "coulomb_forward": COULOMB,
    "static": GATE.static_friction + GATE.motor_friction,
    "viscous": GATE.viscous_friction,
    "nominal": COULOMB + GATE.viscous_friction * GATE.nominal_speed,
}
# Largest error of every set, and share of the sets whose error is within two standard errors.
LARGEST = {"load_mass": 0.15, "stiffness": 0.05, "nominal": 0.10}
COVERED = {"load_mass": 0.85, "stiffness": 0.85, "coulomb_forward": 0.85, "nominal": 0.85, "static": 0.70}


def values_of(fit: TwoMassFit) -> dict[str, tuple[float, float]]:
    """Every parameter with its standard error, those that are not identifiable included."""
    found = {item.key: (item.value, item.standard_error) for item in fit.identified.estimates}
    for item in fit.identified.not_identifiable:
        value = item.numbers["value"]
        found[item.key] = (value, value * item.numbers["relative_standard_error"])
    return found | {"nominal": fit.nominal_friction}


def two_mass(sets: int) -> bool:
    met = True
    for references in (True, False):
        errors: dict[str, list[tuple[float, float]]] = {name: [] for name in TRUTH}
        for number in range(sets):
            runs = free_runs(on_any_track(GATE, number), FIRST_SEED + number, RUNS, references=references)
            fit = identify_two_mass(runs, TwoMassSettings(motor_mass=GATE.motor_mass, sensors=SENSORS))
            for name, (value, error) in values_of(fit).items():
                errors[name].append(((value - TRUTH[name]) / TRUTH[name], error / TRUTH[name]))
        print(f"\n{sets} tracks, {RUNS} runs each, {'with' if references else 'without'} references")
        for name, rows in errors.items():
            error, stated = np.array(rows).T
            inside = [float(np.mean(np.abs(error) <= many * stated)) for many in (1.0, 2.0)]
            largest = float(np.max(np.abs(error)))
            good = largest <= LARGEST.get(name, np.inf) and inside[1] >= COVERED.get(name, 0.0)
            met &= good
            print(
                f"{'ok   ' if good else 'WORSE'} {name:16s} mean error {100 * np.mean(error):+6.1f} %, largest "
                f"{100 * largest:5.1f} %, stated {100 * np.median(stated):5.1f} %, "
                f"within one {100 * inside[0]:3.0f} %, within two {100 * inside[1]:3.0f} %"
            )
    return met


def robots(of_a_kind: int) -> bool:
    """Whether each parameter that is printed with an error is within 1.96 errors for nine robots of ten."""
    values: list[Value] = []
    for kind in KINDS:
        for seed in range(of_a_kind):
            for values_of_robot in (friction_values, gain_values, gain_values_with_centre):
                with TemporaryDirectory() as folder:
                    values += values_of_robot(kind, seed, Path(folder))
    met = True
    for key, count, refused, covered, largest in table_of(values):
        met &= not covered < 0.9
        print(
            f"{key:18s} {count:4d} values, refused {100 * refused:3.0f} %, of the others within 1.96 errors "
            f"{100 * covered:3.0f} %, at most {largest:.1f} errors off"
        )
    return met


if __name__ == "__main__":
    if sys.argv[1:2] == ["robots"]:
        main("robots", lambda: robots(int(sys.argv[2]) if len(sys.argv) > 2 else 5))
    count = int(sys.argv[1]) if len(sys.argv) > 1 else SETS
    main("identified and true parameters", lambda: two_mass(count))
