"""M qd, C^T qd and g of a 7-joint arm: cdtool's sweep against pinocchio, sample by sample, from Python and in C++.

pinocchio (extra cdtool[urdf]) is needed. The C++ loop also needs g++ and Eigen's headers (libeigen3-dev, or pip install
cmeel-eigen); building it takes a minute or two.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from timing import Spread, interleaved, main, ratio, table, verdict

from cdtool.machines.kinematic_tree import KinematicTree
from cdtool.machines.urdf_reader import read_urdf

Array = npt.NDArray[np.float64]
Terms = Callable[[], tuple[Array, Array, Array]]

JOINTS = 7
SAMPLES = {"cdtool": 1_000_000, "Python loop": 20_000, "C++ loop": 100_000}
TARGETS = {"Python loop": 20.0, "C++ loop": 8.0}
ROUNDS = 15
TOLERANCE = 1e-10
# As pinocchio's own build sets them: boost has to know of more types of joints than it does by default.
_DEFINITIONS = (
    "BOOST_MPL_LIMIT_LIST_SIZE=30",
    "BOOST_MPL_LIMIT_VECTOR_SIZE=30",
    "BOOST_MPL_CFG_NO_PREPROCESSED_HEADERS",
)


def measure() -> bool:
    try:
        import pinocchio
    except ImportError:
        print("skipped: pinocchio is not installed (pip install 'cdtool[urdf]')")
        return True
    rng = np.random.default_rng(1)
    position, speed = rng.uniform(-3.0, 3.0, (2, SAMPLES["cdtool"], JOINTS)) * np.array([1.0, 0.7])[:, None, None]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "arm.urdf"
        path.write_text(_arm(rng), encoding="utf-8")
        tree = read_urdf(path, [f"joint{k}" for k in range(JOINTS)], {})
        model = pinocchio.buildModelFromUrdf(str(path))
        parts = {name: (position[:count], speed[:count]) for name, count in SAMPLES.items()}
        tasks: dict[str, Terms] = {
            "cdtool": lambda: tree.momentum_terms(*parts["cdtool"]),
            "Python loop": _python_loop(pinocchio, model, *parts["Python loop"]),
        }
        library = _library(Path(folder))
        if library is not None:
            tasks["C++ loop"] = _cpp_loop(library, tree, *parts["C++ loop"])
        _compare(tasks)
        seconds = interleaved(tasks, ROUNDS)
    each = {name: [second / SAMPLES[name] for second in seconds[name]] for name in tasks}
    times = {name: ratio(each[name], each["cdtool"]) for name in tasks if name != "cdtool"}
    held = [verdict(f"cdtool / {name} over pinocchio, samples/s", times[name], TARGETS[name]) for name in times]
    print()
    rows = [(name, SAMPLES[name], f"{1e-6 / Spread.of(each[name]).median:.3g}", times.get(name, "")) for name in tasks]
    table(("task", "samples", "M samples/s", "cdtool / this (low-high)"), rows)
    print(f"pinocchio {pinocchio.__version__}, {JOINTS} joints, one thread each. The terms of every sample agree to")
    print(f"{TOLERANCE:g} of their largest. cdtool also looks for values that are not finite.")
    return all(held)


def _arm(rng: np.random.Generator) -> str:
    """A URDF: links of 0.3 m and 5 kg down to 1 kg, each turned and placed a little askew on the one before."""
    parts = ['<link name="link0"/>']
    for k in range(JOINTS):
        turn = rng.choice([-1.5708, 0.0, 1.5708], 3) + rng.uniform(-0.1, 0.1, 3)
        place, centre = rng.uniform(-0.05, 0.05, (2, 3)) + np.array([[0.0, 0.0, 0.3], [0.0, 0.0, 0.12]])
        mass = 5.0 - 4.0 * k / (JOINTS - 1)
        ixx, iyy, izz = mass * np.array([0.012, 0.011, 0.004])
        parts.append(
            f'<link name="link{k + 1}"><inertial><mass value="{mass}"/><origin xyz="{_text(centre)}"/>'
            f'<inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="{0.05 * izz}" ixz="{-0.03 * izz}" iyz="{0.02 * izz}"/>'
            "</inertial></link>"
            f'<joint name="joint{k}" type="revolute"><parent link="link{k}"/><child link="link{k + 1}"/>'
            f'<origin xyz="{_text(place)}" rpy="{_text(turn)}"/><axis xyz="0 0 1"/>'
            '<limit lower="-6" upper="6" effort="100" velocity="3"/></joint>'
        )
    return f'<robot name="arm">{"".join(parts)}</robot>'


def _text(values: Array) -> str:
    return " ".join(f"{value:.17g}" for value in values)


def _python_loop(pinocchio: Any, model: Any, position: Array, speed: Array) -> Terms:
    data = model.createData()

    def terms() -> tuple[Array, Array, Array]:
        momentum, force, gravity = (np.empty_like(position) for _ in range(3))
        for k in range(len(position)):
            q, v = position[k], speed[k]
            momentum[k] = pinocchio.crba(model, data, q) @ v
            force[k] = pinocchio.computeCoriolisMatrix(model, data, q, v).T @ v
            gravity[k] = pinocchio.computeGeneralizedGravity(model, data, q)
        return momentum, force, gravity

    return terms


def _library(folder: Path) -> ctypes.CDLL | None:
    """robot_dynamics.cpp, compiled against the headers that the wheel of pinocchio brings."""
    compiler = shutil.which("g++")
    headers = _folder("cmeel.prefix/include", "pinocchio")
    eigen = _folder("cmeel.prefix/include/eigen3", "Eigen") or _folder("include/eigen3", "Eigen")
    absent = [
        name for name, found in (("g++", compiler), ("pinocchio's headers", headers), ("Eigen", eigen)) if not found
    ]
    if absent:
        print(f"skipped: the C++ loop; not found: {', '.join(absent)}")
        return None
    built, source = folder / "robot_dynamics.so", Path(__file__).with_suffix(".cpp")
    flags = [
        "-O3",
        "-march=native",
        "-DNDEBUG",
        "-std=c++17",
        "-shared",
        "-fPIC",
        *(f"-D{item}" for item in _DEFINITIONS),
    ]
    places = ["-isystem", str(headers), "-isystem", str(eigen)]
    done = subprocess.run(
        [str(compiler), *flags, *places, str(source), "-o", str(built)], check=False, stderr=-1, text=True
    )
    if done.returncode:
        print(f"skipped: the C++ loop; g++ does not build it: {done.stderr.strip().splitlines()[-1]}")
        return None
    return ctypes.CDLL(str(built))


def _folder(place: str, content: str) -> Path | None:
    candidates = [Path(root) / place for root in (*sys.path, sys.prefix, "/usr", "/usr/local")]
    return next((item for item in candidates if (item / content).is_dir()), None)


def _cpp_loop(library: ctypes.CDLL, tree: KinematicTree, position: Array, speed: Array) -> Terms:
    numbers = []
    for joint in tree.joints:
        upper, centre = np.zeros((3, 3)), np.array(joint.first_moment) / joint.mass
        upper[np.triu_indices(3)] = joint.inertia
        shifted = joint.mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        inertia = upper + np.triu(upper, 1).T - shifted
        numbers.append([*joint.rotation, *joint.translation, joint.mass, *centre, *inertia.ravel()])
    library.build_chain.restype = ctypes.c_void_p
    constants = np.array(numbers)
    model = ctypes.c_void_p(library.build_chain(ctypes.c_int64(JOINTS), _at(constants)))

    def terms() -> tuple[Array, Array, Array]:
        momentum, force, gravity = (np.empty_like(position) for _ in range(3))
        out = (_at(momentum), _at(force), _at(gravity))
        library.momentum_terms(model, ctypes.c_int64(len(position)), _at(position), _at(speed), *out)
        return momentum, force, gravity

    return terms


def _at(array: Array) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)


def _compare(tasks: dict[str, Terms]) -> None:
    ours = tasks["cdtool"]()
    for name, task in tasks.items():
        for found, expected in zip(ours, task(), strict=True):
            size = np.max(np.abs(expected), axis=1)
            worst = float(np.max(np.max(np.abs(found[: len(expected)] - expected), axis=1) / size))
            if not worst <= TOLERANCE:
                sys.exit(
                    f"error: {name} differs from cdtool by {worst:.2g} of a sample's largest, allowed {TOLERANCE:g}"
                )


if __name__ == "__main__":
    main("robot dynamics against pinocchio", measure)
