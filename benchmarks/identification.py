"""How often the 95 % that `cdtool identify` prints contain the truth, on axes and robots of other simulators.

Mass, drive, friction, controller and sensors of each axis are drawn (tests/synthetic/foreign_axes.py). Half of them
move at three speeds in both directions, half at one speed in one direction; two of three have a drive that is not one
spring. Per parameter: on how many axes it was printed, in how many of these 1.96 standard errors contain the truth, the
largest error in standard errors, and the share that was refused.

The robots are of four kinds with random parameters (tests/synthetic/strange_robots.py).

python benchmarks/identification.py [AXES] [--jobs N]      # 40 axes: 20 s each
python benchmarks/identification.py 20 --plain             # 20 gates with another law of friction: 4 min
python benchmarks/identification.py 5 --robots             # 5 robots of each kind: 10 min
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

from injection import LEARNED, identify_plain
from timing import main, table

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

import cdtool  # noqa: E402
from tests.commands.identify.robot_coverage import (  # noqa: E402
    Value,
    friction_values,
    gain_values,
    gain_values_with_centre,
    table_of,
)
from tests.synthetic.foreign_axes import MOTIONS, drawn, errors_by_key, errors_of, write_logs  # noqa: E402
from tests.synthetic.plain_gate import drawn_gate, strokes  # noqa: E402
from tests.synthetic.strange_robots import KINDS  # noqa: E402

AXES, LEAST_CONTAINED, MOST_REFUSED = 40, 0.9, 0.3
PLAIN = "plain gates, 1 speed, one way"


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


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("axes", type=int, nargs="?", default=AXES)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--plain", action="store_true")
    parser.add_argument("--robots", action="store_true")
    asked = parser.parse_args()
    if asked.robots:
        main("printed errors of identified robots", partial(robots, asked.axes))
    main("printed errors of an identified axis", partial(coverage, asked.axes, asked.jobs, asked.plain))
