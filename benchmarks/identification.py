"""How often the 95 % that `cdtool identify` prints contain the truth, on axes and robots of other simulators.

Mass, drive, friction, controller and sensors of each axis are drawn (tests/synthetic/foreign_axes.py). Half of them
move at three speeds in both directions, half at one speed in one direction; two of three have a drive that is not one
spring. Per parameter: on how many axes it was printed, in how many of these 1.96 standard errors contain the truth, the
largest error in standard errors, and the share that was refused.

The robots are of four kinds with random parameters (tests/synthetic/strange_robots.py).

python benchmarks/identification.py [AXES] [--jobs N]      # 40 axes: 20 s each
python benchmarks/identification.py 20 --plain             # 20 gates with another law of friction: 4 min
python benchmarks/identification.py 5 --robots             # 5 robots of each kind: 10 min
python benchmarks/identification.py --presses              # the torque's scale from 20 presses of the gate: 20 s
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
from injection import LEARNED, identify_plain
from timing import main, table

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

import cdtool  # noqa: E402
from cdtool.commands.identify.axis.torque_constant import identify_torque_scale  # noqa: E402
from cdtool.commands.simulate import sensors  # noqa: E402
from cdtool.commands.simulate.gate_model import integrate_gate  # noqa: E402
from cdtool.recordings.recording import Recording, Series  # noqa: E402
from cdtool.truth.onset import find_contacts  # noqa: E402
from cdtool.truth.onset_rule import OnsetRule  # noqa: E402
from tests.commands.identify.robot_coverage import (  # noqa: E402
    Value,
    friction_values,
    gain_values,
    gain_values_with_centre,
    table_of,
)
from tests.synthetic.foreign_axes import MOTIONS, drawn, errors_by_key, errors_of, write_logs  # noqa: E402
from tests.synthetic.gate_runs import GATE  # noqa: E402
from tests.synthetic.plain_gate import drawn_gate, strokes  # noqa: E402
from tests.synthetic.strange_robots import KINDS  # noqa: E402

AXES, LEAST_CONTAINED, MOST_REFUSED = 40, 0.9, 0.3
PLAIN = "plain gates, 1 speed, one way"
TORQUE_SCALE, FIRST_PRESS = 0.9, 3000
PRESSES = ((0.02, 6.0), (0.01, 12.0))  # speed reference [m/s] and duration [s]


def errors_of_axis(number: int) -> tuple[str, dict[str, float]]:
    axis = drawn(number)
    with tempfile.TemporaryDirectory() as folder:
        logs, machine = write_logs(axis, Path(folder))
        return axis.motion, errors_of(axis, cdtool.identify(logs, machine))


def errors_of_plain_gate(number: int) -> tuple[str, dict[str, float]]:
    gate = drawn_gate(number)
    truth = {"machine.load_mass": gate.leaf_mass, "model.friction.static": gate.static}
    if not gate.stiffening:
        truth["model.drive.stiffness"] = gate.stiffness
    with tempfile.TemporaryDirectory() as folder:
        done = identify_plain(gate, strokes(gate, number, range(LEARNED)).recordings, Path(folder))
    return PLAIN, errors_by_key(truth, done)


def coverage(axes: int, jobs: int, is_plain: bool) -> bool:
    with ProcessPoolExecutor(jobs) as pool:
        done = list(pool.map(errors_of_plain_gate if is_plain else errors_of_axis, range(axes)))
    met = True
    for motion in [PLAIN] if is_plain else MOTIONS:
        errors: dict[str, list[float]] = {}
        for one in (item for moved, item in done if moved == motion):
            for key, error in one.items():
                errors.setdefault(key, []).append(abs(error))
        rows = []
        for key, values in errors.items():
            printed = [item for item in values if not math.isnan(item)]
            contained = sum(item <= 1.96 for item in printed) / max(len(printed), 1)
            refused = 1.0 - len(printed) / len(values)
            largest = f"{max(printed):.1f}" if printed else "-"
            rows.append((key, len(values), len(printed), f"{contained:.0%}", largest, f"{refused:.0%}"))
            met &= not printed or contained >= LEAST_CONTAINED
            met &= motion != MOTIONS[0] or key == "model.drive.stiffness" or refused < MOST_REFUSED
        print(f"\n{motion}")
        table(["parameter", "axes", "printed", "contained", "largest error", "refused"], rows)
    return met


def robots(of_a_kind: int) -> bool:
    """Whether each parameter that is printed with an error is within 1.96 errors for nine robots of ten."""
    values: list[Value] = []
    for kind in KINDS:
        for seed in range(of_a_kind):
            for values_of_robot in (friction_values, gain_values, gain_values_with_centre):
                with tempfile.TemporaryDirectory() as folder:
                    values += values_of_robot(kind, seed, Path(folder))
    met = True
    for key, count, refused, covered, largest in table_of(values):
        met &= not covered < 0.9
        print(
            f"{key:18s} {count:4d} values, refused {100 * refused:3.0f} %, of the others within 1.96 errors "
            f"{100 * covered:3.0f} %, at most {largest:.1f} errors off"
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
    """Whether the factor of the torque's scale is within 5 %, and two standard errors contain it in 85 %."""
    rows = []
    for speed, duration in PRESSES:
        for seed in range(FIRST_PRESS, FIRST_PRESS + 10):
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
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("axes", type=int, nargs="?", default=AXES)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--plain", action="store_true")
    parser.add_argument("--robots", action="store_true")
    parser.add_argument("--presses", action="store_true")
    asked = parser.parse_args()
    if asked.presses:
        main("identified and true scale of the torque", torque_scales)
    elif asked.robots:
        main("printed errors of identified robots", partial(robots, asked.axes))
    main("printed errors of an identified axis", partial(coverage, asked.axes, asked.jobs, asked.plain))
