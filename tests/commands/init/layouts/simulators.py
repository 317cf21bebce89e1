"""Simulated axes and arms for look-alikes of logs, and how their columns are written."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

Array = np.ndarray
Rng = np.random.Generator


def _stroke_speed(distance: float, speed: float, acceleration: float, dt: float) -> Array:
    """Return the trapezoidal speed of a move of `distance`, sampled at dt; its sum * dt is the distance."""
    length = abs(distance)
    top = min(speed, np.sqrt(length * acceleration))
    ramp = top / acceleration
    total = ramp + length / top
    t = (np.arange(max(round(total / dt), 2)) + 0.5) * dt
    v = np.clip(np.minimum(acceleration * t, acceleration * (total - t)), 0.0, top)
    return v * (distance / (v.sum() * dt))


def plan(moves: Iterable[tuple[float, float, float, float]], start: float, dt: float, smooth: float) -> Array:
    """Return the reference position of moves (target, speed, acceleration, rest before it [s]) as S-curves."""
    speeds = []
    at = start
    for target, speed, acceleration, rest in moves:
        speeds.append(np.zeros(round(rest / dt)))
        if target != at:
            speeds.append(_stroke_speed(target - at, speed, acceleration, dt))
        at = target
    v = np.concatenate([*speeds, np.zeros(round(0.8 / dt))])
    width = max(round(smooth / dt), 1)
    v = np.convolve(v, np.ones(width) / width)
    return start + np.cumsum(v) * dt


def alternate(
    rng: Rng,
    low: float,
    high: float,
    speeds: Sequence[float],
    acceleration: float,
    duration: float,
    rest: tuple[float, float] = (0.4, 1.2),
    first: float = 1.0,
) -> list[tuple[float, float, float, float]]:
    """Return strokes between the ends of travel (some only part of it) at changing speeds, for `duration` seconds."""
    moves = []
    at, spent, k = low, 0.0, 0
    order = list(speeds)
    while True:
        up = k % 2 == 0
        part = 1.0 if k % 5 != 3 else rng.uniform(0.55, 0.8)
        target = (low + (high - low) * part) if up else (high - (high - low) * part if k % 5 == 3 else low)
        if abs(target - at) < 0.05 * (high - low):
            target = high if up else low
        speed = order[k % len(order)] * rng.uniform(0.95, 1.05)
        wait = first if k == 0 else rng.uniform(*rest)
        needed = wait + abs(target - at) / speed + speed / acceleration
        if spent + needed > duration and k >= 2:
            return moves
        moves.append((target, speed, acceleration, wait))
        spent += needed
        at, k = target, k + 1


def speed_of(x: Array, dt: float) -> Array:
    """Return the derivative."""
    return np.gradient(x, dt, axis=0)


@dataclass(frozen=True)
class Axis:
    """A simulated axis: time, reference, position, speed, acceleration, drive effort and contact force (SI)."""

    t: Array
    xr: Array
    vr: Array
    x: Array
    v: Array
    a: Array
    drive: Array
    contact: Array

    def at(self, times: Array) -> Axis:
        """Return it at other times."""
        return Axis(
            times,
            *(
                np.interp(times, self.t, s)
                for s in (self.xr, self.vr, self.x, self.v, self.a, self.drive, self.contact)
            ),
        )


def axis(
    xr: Array,
    dt: float,
    *,
    inertia: float,
    coulomb: float,
    viscous: float,
    gravity: float = 0.0,
    bandwidth: float = 45.0,
    lead: float = 0.75,
    limit: float = np.inf,
    stiction: float = 0.002,
    obstacles: Sequence[tuple] = (),
    yields: bool = False,
) -> Axis:
    """Simulate a servo axis that follows the plan `xr`.

    Obstacles: (position, direction, stiffness, damping, time of the plan of its appearance, duration from the first
    touch [s]). `yields`: the drive stops its reference while it meets an obstacle, and goes on 0.3 s later.
    """
    n = len(xr)
    # Loops over samples are over Python's numbers: NumPy's single numbers are several times slower, and the same.
    plan_x, plan_v, plan_a = (item.tolist() for item in (xr, speed_of(xr, dt), speed_of(speed_of(xr, dt), dt)))
    x, v = float(xr[0]), 0.0
    kp, kd = inertia * bandwidth**2, 2.0 * inertia * bandwidth
    out = []
    touched = [np.inf] * len(obstacles)
    integral, at, pace, blocked_until = 0.0, 0.0, 1.0, -1.0
    for i in range(n):
        now = i * dt
        k = min(int(at), n - 1)
        ref, ref_v, ref_a = plan_x[k] + plan_v[k] * (at - k) * dt, plan_v[k] * pace, plan_a[k] * pace
        contact = 0.0
        for o, (where, direction, stiffness, damping, begin, hold) in enumerate(obstacles):
            deep = direction * (x - where)
            if k * dt >= begin and now < touched[o] + hold and deep > 0.0:
                touched[o] = min(touched[o], now)
                contact += direction * max(stiffness * deep + damping * direction * v, 0.0)
        if yields and abs(contact) > 0.25 * limit:
            blocked_until = now + 0.3
        pace += min(max((0.0 if now < blocked_until else 1.0) - pace, -dt / 0.12), dt / 0.4)
        error = ref - x
        wanted = kp * error + kd * (lead * ref_v - v) + integral + gravity + 0.5 * inertia * ref_a
        drive = min(max(wanted, -limit), limit)
        if drive == wanted and contact == 0.0:
            integral += 0.25 * kp * bandwidth * (error - (1.0 - lead) * 2.0 / bandwidth * ref_v) * dt
        a = (drive - gravity - coulomb * float(np.tanh(v / stiction)) - viscous * v - contact) / inertia
        v_next = v + a * dt
        # friction is stiff near rest: hold instead of chattering
        if abs(v) < stiction and abs(drive - gravity - contact) < coulomb and abs(ref_v) < 1e-9:
            v_next, a = v * 0.6, (v * 0.6 - v) / dt
        out.append((ref, ref_v, x, v, a, drive, contact))
        v = v_next
        x += v * dt
        at += pace
    return Axis(np.arange(n) * dt, *np.array(out).T)


def crossing(xr: Array, dt: float, where: float, direction: int, skip: int = 0) -> float:
    """Return the time at which the reference passes a position in a direction, the skip-th time."""
    inside = (xr - where) * direction > 0
    starts = np.flatnonzero(inside[1:] & ~inside[:-1]) + 1
    return float(starts[min(skip, len(starts) - 1)] * dt)


def low_pass(x: Array, dt: float, corner: float) -> Array:
    """Return x through a first-order low-pass of `corner` Hz."""
    k = float(1.0 - np.exp(-2.0 * np.pi * corner * dt))
    y = np.empty(x.shape)
    for column, passed in zip(x.reshape(len(x), -1).T.tolist(), y.reshape(len(x), -1).T, strict=True):
        s, kept = float(column[0]), []
        for value in column:
            s = s + k * (value - s)
            kept.append(s)
        passed[:] = kept
    return y


def quantised(x: Array, step: float) -> Array:
    """Return x rounded to steps."""
    return np.round(x / step) * step


def follow(ref: Array, dt: float, bandwidth: float) -> tuple[Array, Array, Array]:
    """Return position, speed and acceleration of joints that follow (n, J) references with a second-order lag."""
    out = np.empty((3, *ref.shape))
    for joint, (wanted, wanted_speed) in enumerate(zip(ref.T.tolist(), speed_of(ref, dt).T.tolist(), strict=True)):
        q, v, passed = float(wanted[0]), 0.0, []
        for x, xv in zip(wanted, wanted_speed, strict=True):
            a = bandwidth**2 * (x - q) + 2.0 * bandwidth * (0.6 * xv - v)
            passed.append((q, v, a))
            v = v + a * dt
            q = q + v * dt
        out[:, :, joint] = np.array(passed).T
    return out[0], out[1], out[2]


def poses(
    points: Sequence[Sequence[float]],
    rates: Sequence[float],
    rests: Sequence[float],
    dt: float,
    ramp: float,
    smooth: float,
) -> Array:
    """Return the synchronous point-to-point reference (n, J) of all joints through the points."""
    parts, at = [], np.asarray(points[0], float)
    for point, rate, rest in zip(points[1:], rates, rests, strict=True):
        goal = np.asarray(point, float)
        far = float(np.max(np.abs(goal - at)))
        s = plan([(1.0, rate / far, ramp / far, rest)], 0.0, dt, smooth)
        parts.append(at + (goal - at) * s[:, None])
        at = goal
    return np.concatenate(parts)


def arm_torque(
    q: Array,
    v: Array,
    a: Array,
    *,
    inertia: Sequence[float],
    coulomb: Sequence[float],
    viscous: Sequence[float],
    lift: int,
    elbow: int,
    moments: tuple[float, float],
    coupling: float,
    wrist: tuple[int, float] | None = None,
    upright: float = 0.0,
) -> Array:
    """Return the joint torques of an arm with a lifting joint and an elbow (indices), with gravity moments [N m]."""
    tau = a * np.asarray(inertia) + np.asarray(coulomb) * np.tanh(v / 0.02) + v * np.asarray(viscous)
    q2, q3 = q[:, lift] - upright, q[:, elbow]
    upper, fore = moments
    bend = coupling * np.cos(q3)
    tau[:, lift] += upper * np.sin(q2) + fore * np.sin(q2 + q3) + 2.0 * bend * a[:, lift] + bend * a[:, elbow]
    tau[:, lift] -= coupling * np.sin(q3) * (2.0 * v[:, lift] + v[:, elbow]) * v[:, elbow]
    tau[:, elbow] += fore * np.sin(q2 + q3) + bend * a[:, lift] + coupling * np.sin(q3) * v[:, lift] ** 2
    if wrist is not None:
        tau[:, wrist[0]] += wrist[1] * np.sin(q2 + q3 + q[:, wrist[0]])
    return tau


def text(
    values: Array | Sequence[str], form: str = "%.6f", missing: str = "", rng: Rng | None = None, lost: float = 0.0
) -> list[str]:
    """Return the cells of a column; NaN and a share of `lost` cells are missing."""
    if isinstance(values, np.ndarray):
        cells = [missing if value != value else form % value for value in values.tolist()]
    else:
        cells = list(values)
    if rng is not None and lost > 0.0:
        for i in np.flatnonzero(rng.random(len(cells)) < lost):
            cells[i] = missing
    return cells


def save(
    path: Path,
    columns: Sequence[list[str]],
    *,
    header: Sequence[str] = (),
    separator: str = ",",
    end: str = "",
    encoding: str = "utf-8",
    newline: str = "\n",
) -> None:
    """Write the lines of the header and the columns."""
    lines = [*header, *(separator.join(row) + end for row in zip(*columns, strict=True))]
    path.write_bytes((newline.join(lines) + newline).encode(encoding))
