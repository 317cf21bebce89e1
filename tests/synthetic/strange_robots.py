"""Robots of four kinds with random parameters and their logs: dynamics of its own, nothing of cdtool and no simulator.

Newton-Euler along the chain for prescribed motion: fast strokes, creeping and rests of each joint by itself. What the
model of an identification has not: friction that rises towards rest (Stribeck), a ripple along the turn, friction that
differs by `DAY` from log to log, links that are `WRONG_LINKS` heavier or lighter than in the URDF. What is logged:
jittering clocks, quantised encoders, noise of speed and torque.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

KINDS = ("planar", "scara", "spatial", "six")
GRAVITY = 9.81
LOGS, SECONDS = 5, 20.0
#: Relative spread of friction from log to log, of the links' masses, and of friction along the turn.
DAY, WRONG_LINKS, RIPPLE = 0.03, 0.02, 0.03
#: Standard deviation of the logged speed and smallest step of the position: as large as in logs of a UR10e [rad, m].
SPEED_NOISE, STEP = {"R": 7e-3, "P": 1e-3}, {"R": 5e-5, "P": 1e-5}


@dataclass(frozen=True, eq=False)
class Link:
    """A joint and the body behind it: kind R or P, axis and origin in the parent's frame; friction at the joint."""

    kind: str
    axis: tuple[float, float, float]
    origin: tuple[float, float, float]
    mass: float
    centre: Array
    inertia: Array
    viscous: float
    coulomb: float
    offset: float
    drive: float
    stribeck: float
    stribeck_speed: float

    def with_payload(self, mass: float, centre: Array, inertia: Array) -> Link:
        """Return the link with a body fixed to it."""
        total = self.mass + mass
        middle = (self.mass * self.centre + mass * centre) / total
        parts = ((self.mass, self.centre, self.inertia), (mass, centre, inertia))
        return replace(self, mass=total, centre=middle, inertia=sum(i + _steiner(m, c - middle) for m, c, i in parts))


def _steiner(mass: float, shift: Array) -> Array:
    return np.asarray(mass * (shift @ shift * np.eye(3) - np.outer(shift, shift)))


#: kind, axis, origin, mass [kg], half length of the body along each direction [m], Coulomb and viscous friction.
_CHAINS: Mapping[str, Sequence[tuple[str, str, tuple[float, ...], float, tuple[float, ...], float, float]]] = {
    "planar": [
        ("R", "-y", (0, 0, 0), 4.0, (0.2, 0, 0), 3.0, 2.0),
        ("R", "-y", (0.4, 0, 0), 2.5, (0.15, 0, 0), 1.5, 0.8),
    ],
    "scara": [
        ("R", "z", (0, 0, 0.3), 6.0, (0.17, 0, 0), 5.0, 4.0),
        ("R", "z", (0.35, 0, 0), 4.0, (0.12, 0, 0), 3.0, 2.0),
        ("P", "z", (0.25, 0, 0), 1.5, (0, 0, 0.05), 8.0, 30.0),
        ("R", "z", (0, 0, -0.1), 0.8, (0.03, 0, 0), 0.4, 0.15),
    ],
    "spatial": [
        ("R", "z", (0, 0, 0.2), 6.0, (0, 0.03, 0.1), 6.0, 6.0),
        ("R", "y", (0, 0, 0.2), 8.0, (0.2, 0.05, 0), 6.0, 5.0),
        ("R", "y", (0.4, 0, 0), 4.0, (0.18, -0.03, 0), 3.0, 2.0),
    ],
    "six": [
        ("R", "z", (0, 0, 0.18), 7.4, (0, 0.02, -0.02), 9.0, 14.0),
        ("R", "y", (0, 0.18, 0), 13.0, (0, 0.05, 0.28), 10.0, 14.0),
        ("R", "y", (0, -0.14, 0.61), 4.0, (0, 0.02, 0.25), 5.0, 8.0),
        ("R", "y", (0, 0, 0.57), 2.0, (0, 0.06, 0.01), 2.0, 3.0),
        ("R", "z", (0, 0.12, 0), 2.0, (0, 0.0, 0.06), 2.0, 2.5),
        ("R", "y", (0, 0, 0.12), 0.6, (0.01, 0.02, -0.02), 1.8, 2.5),
    ],
}
_AXES = {"z": (0.0, 0.0, 1.0), "y": (0.0, 1.0, 0.0), "-y": (0.0, -1.0, 0.0)}


def robot(kind: str, rng: np.random.Generator) -> list[Link]:
    """Return a robot of a kind with random masses and friction."""
    links = []
    for joint, axis, origin, mass, reach, coulomb, viscous in _CHAINS[kind]:
        m = mass * float(rng.uniform(0.7, 1.4))
        centre = np.array(reach) * rng.uniform(0.7, 1.2, 3)
        size = np.abs(reach) + 0.04
        inertia = m / 3.0 * np.diag(size @ size - size**2)
        c, v = coulomb * float(rng.uniform(0.6, 1.5)), viscous * float(rng.uniform(0.6, 1.5))
        # As large beside the friction as in a UR10e; a planar arm in load coordinates has no key for it.
        drive = 0.0 if kind == "planar" else c * float(rng.uniform(0.05, 0.3))
        links.append(
            Link(
                *(joint, _AXES[axis], tuple(map(float, origin)), m, centre, inertia),
                *(v, c, rng.uniform(-0.1, 0.1) * c, drive),
                *(rng.uniform(0.05, 0.3) * c, rng.uniform(3e-3, 15e-3) * (1.0 if joint == "R" else 0.15)),
            )
        )
    return links


def carrying(links: Sequence[Link], kind: str, rng: np.random.Generator) -> tuple[list[Link], float, Array]:
    """Return the robot with a payload on its last link, its mass and its centre in the link's frame."""
    mass = float(rng.uniform(0.6, 1.2)) * {"planar": 2.0, "scara": 2.0, "spatial": 3.0, "six": 6.0}[kind]
    centre = rng.uniform(0.03, 0.1, 3) * (1.0, 0.0, 0.0) if kind == "planar" else rng.uniform(-0.1, 0.1, 3)
    size = float(rng.uniform(0.02, 0.06))
    return [*links[:-1], links[-1].with_payload(mass, centre, 0.4 * mass * size**2 * np.eye(3))], mass, centre


def _rotate(link: Link, turn: Array) -> Array:
    """Return R (n, 3, 3) from the link's frame to its parent's."""
    x, y, z = link.axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle = (turn if link.kind == "R" else np.zeros_like(turn))[:, None, None]
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross)


def rigid_torque(links: Sequence[Link], q: Array, v: Array, a: Array) -> Array:
    """Return the torques (n, J) of inertia and gravity, without drives: Newton-Euler (Luh, Walker, Paul, 1980)."""
    n = len(q)
    w, dw, acc = np.zeros((n, 3)), np.zeros((n, 3)), np.tile([0.0, 0.0, GRAVITY], (n, 1))
    turns, states = [], []
    for j, link in enumerate(links):
        axis, turn = np.array(link.axis), _rotate(link, q[:, j])
        at = np.array(link.origin) + (q[:, j : j + 1] * axis if link.kind == "P" else 0.0)
        acc = acc + np.cross(dw, at) + np.cross(w, np.cross(w, at))
        if link.kind == "P":
            acc = acc + 2.0 * np.cross(w, v[:, j : j + 1] * axis) + a[:, j : j + 1] * axis
        w, dw, acc = (np.einsum("nji,nj->ni", turn, item) for item in (w, dw, acc))
        if link.kind == "R":
            dw = dw + a[:, j : j + 1] * axis + np.cross(w, v[:, j : j + 1] * axis)
            w = w + v[:, j : j + 1] * axis
        turns.append((turn, at))
        states.append((w, dw, acc))
    torque, force, moment = np.empty_like(q), np.zeros((n, 3)), np.zeros((n, 3))
    for j in reversed(range(len(links))):
        link, (w, dw, acc) = links[j], states[j]
        push = link.mass * (acc + np.cross(dw, link.centre) + np.cross(w, np.cross(w, link.centre)))
        moment = moment + np.cross(link.centre, push) + dw @ link.inertia + np.cross(w, w @ link.inertia)
        force = force + push
        torque[:, j] = (moment if link.kind == "R" else force) @ np.array(link.axis)
        turn, at = turns[j]
        force = np.einsum("nij,nj->ni", turn, force)
        moment = np.einsum("nij,nj->ni", turn, moment) + np.cross(at, force)
    return torque


def friction(link: Link, q: Array, v: Array, rng: np.random.Generator) -> Array:
    """Return the friction (n,) of a joint; at rest a constant share of the static one."""
    level = link.coulomb * (1.0 + RIPPLE * np.sin(17.0 * q + rng.uniform(0.0, 6.0)))
    level = level + link.stribeck * np.exp(-((v / link.stribeck_speed) ** 2))
    starts = np.cumsum(np.diff(v == 0.0, prepend=False))
    held = rng.uniform(-1.0, 1.0, int(starts.max()) + 1)[starts]
    return np.asarray(level * np.where(v == 0.0, held, np.sign(v)) + link.viscous * v + link.offset)


def motion(kinds: str, time: Array, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Return position, speed and acceleration (n, J): strokes with a smooth start and end, creeping, rests."""
    q, v, a = (np.zeros((len(time), len(kinds))) for _ in range(3))
    for j, kind in enumerate(kinds):
        reach, top = (1.3, rng.uniform(0.6, 1.6)) if kind == "R" else (0.12, rng.uniform(0.08, 0.2))
        at, here = 0.0, rng.uniform(-reach, reach)
        while at <= time[-1]:
            what = rng.choice(["stroke", "creep", "rest"], p=[0.7, 0.15, 0.15])
            if what == "rest":
                length, to = rng.uniform(0.3, 1.2), here
            elif what == "creep":
                length = rng.uniform(1.0, 2.5)
                to = here + rng.choice([-1.0, 1.0]) * length * rng.uniform(2e-3, 8e-3) * (1.0 if kind == "R" else 0.2)
            else:
                to = rng.uniform(-reach, reach)
                length = max(0.4, 1.875 * abs(to - here) / (top * rng.uniform(0.3, 1.0)))
            own = (time >= at) & (time < at + length)
            s = (time[own] - at) / length
            d = to - here
            q[own, j] = here + d * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
            v[own, j] = d / length * 30.0 * s**2 * (1.0 - s) ** 2
            a[own, j] = d / length**2 * 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)
            at, here = at + length, to
    return q, v, a


def write_log(
    path: Path, links: Sequence[Link], kind: str, rng: np.random.Generator, gains: Array | float = 1.0
) -> Path:
    """Write one log of a day: time, torques t, positions q, speeds v; torques divided by `gains` are currents."""
    rate = rng.choice([100.0, 125.0, 500.0])
    count = round(SECONDS * rate)
    time = (np.arange(count) + rng.uniform(-0.1, 0.1, count)) / rate
    kinds = "".join(link.kind for link in links)
    q, v, a = motion(kinds, time, rng)
    if kind == "planar":
        # Absolute angles, driven from the base: the second torque turns only the second link.
        torque = rigid_torque(links, *(np.diff(item, axis=1, prepend=0.0) for item in (q, v, a)))
        torque[:, 0] -= torque[:, 1]
    else:
        torque = rigid_torque(links, q, v, a)
    for j, link in enumerate(links):
        coulomb, viscous = (value * (1.0 + DAY * rng.normal()) for value in (link.coulomb, link.viscous))
        today = replace(link, coulomb=coulomb, viscous=viscous)
        torque[:, j] += link.drive * a[:, j] + friction(today, q[:, j], v[:, j], rng)
    size = np.array([link.coulomb for link in links])
    slow = np.apply_along_axis(np.convolve, 0, rng.normal(size=torque.shape), np.ones(5) / 5**0.5, "same")
    torque += size * (0.05 * rng.normal(size=torque.shape) + 0.05 * slow)
    torque = np.round(torque / (0.01 * size)) * 0.01 * size / gains
    step, noise = (np.array([table[item] for item in kinds]) for table in (STEP, SPEED_NOISE))
    columns = (np.round(time, 5), torque, np.round(q / step) * step, v + noise * rng.normal(size=v.shape))
    names = ",".join(["t", *(f"{name}{j}" for name in "tqv" for j in range(len(links)))])
    np.savetxt(path, np.column_stack(columns), fmt="%.9g", delimiter=",", header=names, comments="")
    return path


def write_machine(
    folder: Path, links: Sequence[Link], kind: str, rng: np.random.Generator, scale: Sequence[float] | None = None
) -> Path:
    """Write the machine file, without friction, and its URDF, whose links are wrong by `WRONG_LINKS`.

    Every other robot has drives of which the file knows nothing. `scale`: logs have currents.
    """
    factors = (1.0 + WRONG_LINKS * rng.normal(size=len(links))).tolist()
    known = [replace(a, mass=a.mass * b, inertia=a.inertia * b) for a, b in zip(links, factors, strict=True)]
    if kind == "planar":  # its masses are weighed, and never identified
        known = [replace(a, centre=a.centre * b, inertia=a.inertia * b) for a, b in zip(links, factors, strict=True)]
    count = len(links)
    unit = "SI" if any(link.kind == "P" for link in links) else ""
    if kind == "planar":
        head = f"""type = "planar_arm"
link_mass = {[link.mass for link in known]}
link_length = {links[1].origin[0]}
centre_of_mass = {[float(link.centre[0]) for link in known]}
link_inertia = {[float(link.inertia[1, 1]) for link in known]}
coordinates = "load"
"""
        drives = False
    else:
        (folder / "robot.urdf").write_text(_urdf(known), encoding="utf-8")
        head = f"""type = "urdf_robot"
urdf = "robot.urdf"
joints = {[f"j{j}" for j in range(count)]}
"""
        drives = rng.random() < 0.5
    if drives:
        head += f"drive_inertia = {[link.drive for link in links]}\n"
    torque = f'unit = "A", scale = {list(scale)}' if scale is not None else f'unit = "{unit or "N m"}"'
    channels = f"""
[channels]
time = {{ column = "t", unit = "s" }}
torque = {{ columns = {[f"t{j}" for j in range(count)]}, {torque} }}
position = {{ columns = {[f"q{j}" for j in range(count)]}, unit = "{unit or "rad"}" }}
speed = {{ columns = {[f"v{j}" for j in range(count)]}, unit = "{unit or "rad/s"}" }}
"""
    path = folder / "machine.toml"
    path.write_text("[machine]\n" + head + channels, encoding="utf-8")
    return path


def _urdf(links: Sequence[Link]) -> str:
    parts = ['<robot name="strange"><link name="base"/>']
    for j, link in enumerate(links):
        values = [float(link.inertia[place]) for place in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))]
        numbers = " ".join(f'i{n}="{v!r}"' for n, v in zip(("xx", "xy", "xz", "yy", "yz", "zz"), values, strict=True))
        parts.append(f"""<link name="l{j}"><inertial><origin xyz="{_xyz(link.centre)}"/><mass value="{link.mass!r}"/>
<inertia {numbers}/></inertial></link>
<joint name="j{j}" type="{"continuous" if link.kind == "R" else "prismatic"}"><origin xyz="{_xyz(link.origin)}"/>
<axis xyz="{_xyz(link.axis)}"/><parent link="{f"l{j - 1}" if j else "base"}"/><child link="l{j}"/>
<limit lower="-9" upper="9" effort="999" velocity="9"/></joint>""")
    return "".join((*parts, "</robot>"))


def _xyz(values: Sequence[float] | Array) -> str:
    return " ".join(repr(float(item)) for item in values)
