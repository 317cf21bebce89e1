"""Fifteen layouts by somebody who had not seen the guesser: what `cdtool init` is measured on.

The rules of the truth are those of `layout`. A torque without any unit in the file can be N m, mN m or %: its unit is
"". Where several columns have the same channel and the same joint (two encoders, two motors, two clocks), one suffices.
Columns without a name in the header are not in `truth`; with a header of several lines (names, descriptions, units) the
key is the name; `0` is the first column of a table without a header.
"""

from __future__ import annotations

import datetime
from pathlib import Path

import numpy as np

from tests.commands.init.layouts.layout import Layout, Truth
from tests.commands.init.layouts.simulators import (
    Array,
    Rng,
    alternate,
    arm_torque,
    axis,
    crossing,
    follow,
    low_pass,
    plan,
    poses,
    quantised,
    save,
    speed_of,
    text,
)


def _names(*parts: tuple[str, Truth]) -> dict[str, Truth]:
    return dict(parts)


_UHING = (
    "Temps (s)",
    "Consigne (tr/min)",
    "Vitesse du moteur (tr/min)",
    "Vitesse lineaire (mm/s)",
    "Courant (A)",
    "Angle (deg)",
    "Vitesse lineaire calculee (mm/s)",
    "Vitesse de glissement (mm/s)",
    "Deplacement (mm)",
    "Pas (mm)",
)


def write_uhing(path: Path, rng: Rng) -> None:
    """A rolling-ring drive: the shaft turns one way, the rings' tilt (Angle) sets pitch and direction."""
    dt, n = 0.001, 20000
    ref = np.zeros(n)
    at = 600
    for speed, run in zip(rng.permutation([600.0, 800.0, 1000.0, 1250.0]), (4.2, 3.6, 4.4, 3.4), strict=True):
        ref[at : at + int(run * 1000)] = speed
        at += int(run * 1000) + 800
    z, w = 0.52, 55.0
    speed = rate = 0.0
    tilt, aim = 5.55, 5.726
    x = v = 0.0
    rows = np.empty((n, 5))
    for i in range(n):
        if x > 150.0:
            aim = -5.726
        elif x < 4.0 and v < 0.0:
            aim = 5.726
        tilt += np.clip((aim - tilt) * 40.0, -260.0, 260.0) * dt
        change = w * w * (ref[i] - speed) - 2.0 * z * w * rate
        rate += change * dt
        speed += rate * dt
        pitch = np.pi * 15.0 * np.tan(np.radians(tilt))
        ideal = speed * pitch / 60.0
        v += (ideal * 0.985 - v) * (1.0 - np.exp(-dt / 0.006))
        x += v * dt
        rows[i] = speed, rate, tilt, v, x
    speed, rate, tilt, v, x = rows.T
    spin = speed * np.pi / 30.0
    drag = 0.35 + 0.00045 * np.abs(spin) + 0.02 * np.abs(v) / 60.0
    current = (0.0013 * rate * np.pi / 30.0 + drag * np.tanh(spin / 1.5)) / 0.32
    current = np.clip(current + rng.normal(0.0, 0.12, n), -15.0, 15.0)
    angle = quantised(tilt + rng.normal(0.0, 0.02, n), 0.176)
    pitch = np.pi * 15.0 * np.tan(np.radians(angle))
    shaft = np.abs(speed + rng.normal(0.0, 2.0, n)) * (ref + np.abs(speed) > 1.0)
    linear = v + rng.normal(0.0, 0.25, n)
    computed = shaft * pitch / 60.0
    t = np.arange(n) * dt
    meta = [
        "Date Essai;14/11/2021",
        "Heure Essai;10:21",
        "Frequence (Hz);1000.0",
        "Fonctionnement;Uhing",
        "Type Pilotage;Creneau",
        "Nb cycles;4",
        "Duree de marche (s);4.00",
        "Duree d'arret (s);0.80",
        "Vitesse (tr/min);1000.0",
        " ",
        "Nb points de consigne;6667",
        "dt consigne;0.003",
    ]
    padded = [line + ";" * (9 - line.count(";")) for line in meta]
    three = "%.3f"
    save(
        path,
        [
            text(t, "%.4f"),
            text(ref, three),
            text(shaft, three),
            text(linear, three),
            text(current, three),
            text(angle, three),
            text(computed, three),
            text(computed - linear, three),
            text(x + rng.normal(0, 0.002, n), three),
            text(pitch, three),
        ],
        header=[*padded, ";".join(_UHING)],
        separator=";",
    )


UHING = Layout(
    name="uhing-fr",
    source="CSV 'uhing_info.csv' of a French CPGE exercise, printed line by line in a public script: all 12 "
    "lines before the header, names, units, 1 kHz, first values, pitch = pi 15 mm tan(angle), second- "
    "order speed (zeta 0.52, 55 rad/s) are public; longer run simulated",
    suffix=".csv",
    machine="linear axis",
    write=write_uhing,
    truth=_names(
        ("Temps (s)", Truth("time", "", "s")),
        ("Consigne (tr/min)", Truth("", "", "rpm")),
        ("Vitesse du moteur (tr/min)", Truth("", "", "rpm")),
        ("Vitesse lineaire (mm/s)", Truth("speed", "", "mm/s")),
        ("Courant (A)", Truth("torque", "", "A")),
        ("Angle (deg)", Truth("", "", "deg")),
        ("Vitesse lineaire calculee (mm/s)", Truth("", "", "mm/s")),
        ("Vitesse de glissement (mm/s)", Truth("", "", "mm/s")),
        ("Deplacement (mm)", Truth("position", "", "mm")),
        ("Pas (mm)", Truth("", "", "mm")),
    ),
    accept={
        "Consigne (tr/min)": ("reference_speed",),
        "Vitesse du moteur (tr/min)": ("speed",),
        "Vitesse lineaire calculee (mm/s)": ("speed",),
    },
    # Hard in it: angle is the tilt of the rings, not a position; pitch and slip beside position and speed; reference
    # and motor speed without sign; 12 lines of key;value before the header.
)


_KR3 = ["Sample_time"]
for _i in range(1, 7):
    _KR3 += [f"Position_Command_A{_i}", f"Position_A{_i}", f"Torque_A{_i}", f"Current_A{_i}", f"Temperature_A{_i}"]
_KR3 += [f"A{_i}" for _i in range(1, 7)] + ["Queue_Read", "Queue_Write", "Load", "Faulty", "Speed", "Read_time"]


def write_kr3(path: Path, rng: Rng) -> None:
    """Each axis moves alone, to both sides of the home pose: the other five rest."""
    dt = 0.004
    home = np.array([0.0, -90.0, 90.0, 0.0, 0.0, 0.0])
    span = np.array([120.0, 45.0, 55.0, 140.0, 95.0, 250.0]) * rng.uniform(0.85, 1.0, 6)
    moving, ref, at = [], [], home.copy()
    for j in range(6):
        rate = rng.uniform(0.28, 0.42) * span[j] * 2.0
        line = plan(
            [
                (home[j] + span[j], rate, rate * 3, 0.8),
                (home[j] - span[j], rate * 1.4, rate * 4, 0.3),
                (home[j], rate * 0.7, rate * 2, 0.3),
            ],
            home[j],
            dt,
            0.12,
        )
        block = np.tile(at, (len(line), 1))
        block[:, j] = line
        ref.append(block)
        moving.append(np.full(len(line), j))
    ref_deg, who = np.concatenate(ref), np.concatenate(moving)
    q, v, a = follow(np.radians(ref_deg), dt, 38.0)
    tau = arm_torque(
        q,
        v,
        a,
        inertia=[1.1, 1.3, 0.6, 0.09, 0.07, 0.02],
        coulomb=[4.2, 5.0, 3.4, 1.2, 1.1, 0.6],
        viscous=[2.5, 3.0, 1.8, 0.5, 0.4, 0.15],
        lift=1,
        elbow=2,
        moments=(-24.0, -9.0),
        coupling=0.25,
        wrist=(4, -0.9),
        upright=-np.pi / 2,
    )
    pick = np.arange(0, len(ref_deg), 9)  # 36 ms
    n = len(pick)
    stamp = np.cumsum(rng.choice([36.0, 36.0, 36.0, 48.0, 24.0], n, p=[0.3, 0.3, 0.34, 0.03, 0.03]))
    stamp -= stamp[0]
    source = np.clip(stamp / 4.0, 0, len(ref_deg) - 1).astype(int)
    top = np.array([60.0, 70.0, 45.0, 12.0, 12.0, 8.0])
    columns = [text(stamp, "%.1f")]
    warm = 306.0 + np.arange(6) * 1.7
    for j in range(6):
        torque = tau[source, j] + rng.normal(0.0, 0.012 * top[j], n)
        heat = np.cumsum(np.abs(tau[source, j])) / top[j] * 0.002
        columns += [
            text(ref_deg[source, j], "%.5f"),
            text(np.degrees(q[source, j]) + rng.normal(0, 0.0005, n), "%.5f"),
            text(torque, "%.4f"),
            text(torque / top[j] * 100.0 + rng.normal(0, 0.4, n), "%.4f"),
            text(quantised(warm[j] + heat, 1.0), "%.1f"),
        ]
    columns += [text((who[source] == j).astype(float), "%.0f") for j in range(6)]
    count = np.arange(1, n + 1).astype(float)
    columns += [
        text(count, "%.1f"),
        text(count + rng.integers(1, 4, n), "%.1f"),
        text(np.zeros(n), "%.0f"),
        text(np.ones(n), "%.0f"),
        ["60%"] * n,
        text(rng.gamma(6.0, 6.0, n), "%.6f"),
    ]
    save(path, columns, header=[",".join(_KR3)])


_KR3_TRUTH = {name: Truth() for name in _KR3}
_KR3_TRUTH["Sample_time"] = Truth("time", "", "ms")
_KR3_ACCEPT = {}
for _i in range(1, 7):
    _KR3_TRUTH[f"Position_A{_i}"] = Truth("position", str(_i), "deg")
    _KR3_TRUTH[f"Position_Command_A{_i}"] = Truth("", str(_i), "deg")
    _KR3_TRUTH[f"Torque_A{_i}"] = Truth("torque", str(_i), "")
    _KR3_TRUTH[f"Current_A{_i}"] = Truth("", str(_i), "")
    _KR3_ACCEPT[f"Position_Command_A{_i}"] = ("reference_position",)
    _KR3_ACCEPT[f"Current_A{_i}"] = ("torque",)

KR3 = Layout(
    name="kuka-kr3",
    source="github.com/antcsny/Data-collection-app-V2, kuka/reader.py (_columns; names and order exact) and "
    "AdvDataPlot.py (units: Sample_time ms, torque N m, current %, temperature K), README (36 ms, one "
    "axis after the other); values simulated",
    suffix=".csv",
    machine="robot",
    write=write_kr3,
    truth=_KR3_TRUTH,
    accept=_KR3_ACCEPT,
    # Hard in it: commands before the measured positions; columns A1..A6 are 0/1 flags; Speed is the override as text
    # '60%'; queue counters; read latency; temperatures in K; constants; five of six joints rest at any time; no
    # speed, no unit.
)


_LBR = [
    "index",
    "time",
    "record_time_nsec",
    "tsec",
    "tnsec",
    *(f"{p}{_i}" for p in ("mp", "ip", "mt", "et") for _i in range(1, 8)),
    "dt",
]


def write_lbr(path: Path, rng: Rng) -> None:
    """Seven joints at 5 ms; joint 3 is held, two pushes by hand (et) on the way."""
    dt = 0.005
    home = np.array([0.3, 0.45, 0.0, -1.35, 0.1, 0.9, 0.2])
    points = [home]
    for _ in range(7):
        points.append(home + rng.uniform(-1.0, 1.0, 7) * np.array([0.9, 0.5, 0.0, 0.6, 0.8, 0.5, 1.1]))
    ref = poses(points, rng.uniform(0.35, 0.9, 7), [1.0, *rng.uniform(0.1, 0.5, 6)], dt, 1.6, 0.15)[:4000]
    q, v, a = follow(ref, dt, 30.0)
    n = len(ref)
    tau = arm_torque(
        q,
        v,
        a,
        inertia=[2.2, 2.5, 0.9, 1.1, 0.25, 0.2, 0.03],
        coulomb=[0.5] * 7,
        viscous=[0.4] * 7,
        lift=1,
        elbow=3,
        moments=(-38.0, -17.0),
        coupling=0.6,
        wrist=(5, -1.6),
    )
    push = np.zeros((n, 7))
    for begin in (int(n * 0.37), int(n * 0.71)):
        length = int(rng.integers(60, 130))
        shape = np.sin(np.linspace(0.0, np.pi, length)) ** 0.6
        push[begin : begin + length] += (
            shape[:, None] * np.array([-9.0, 14.0, 2.0, 8.0, -1.0, 3.0, 0.2]) * rng.uniform(0.7, 1.2)
        )
    q = q - push / np.array([4000.0, 4000, 3000, 2500, 1500, 1200, 800])
    measured = tau + push + rng.normal(0.0, 0.08, (n, 7))
    external = (
        low_pass(push, dt, 30.0) + rng.normal(0.0, 0.25, (n, 7)) + np.array([0.2, -0.6, 0.1, 0.4, 0.0, -0.1, 0.02])
    )
    index = np.arange(n)
    record = (
        1_689_245_123_456_789_012
        + (index * 5_000_000 + rng.normal(0, 90_000, n)).astype(np.int64)
        + rng.integers(0, 9, n)
    )
    record = np.maximum.accumulate(record)
    control = 1_689_245_119_250_000_000 + index.astype(np.int64) * 5_000_000
    columns = [
        [str(k) for k in index],
        [repr(round(float(k) * dt, 6)) for k in index],
        [str(k) for k in record],
        [str(k // 1_000_000_000) for k in control],
        [str(k % 1_000_000_000) for k in control],
    ]
    for values, digits in (
        (q + rng.normal(0, 2e-6, (n, 7)), "%.8f"),
        (ref, "%.8f"),
        (measured, "%.6f"),
        (external, "%.6f"),
    ):
        columns += [text(values[:, j], digits) for j in range(7)]
    columns.append(["0.005"] * n)
    save(path, columns, header=[",".join(_LBR)])


_LBR_TRUTH = {name: Truth() for name in _LBR}
_LBR_TRUTH["time"] = Truth("time", "", "s")
_LBR_TRUTH["record_time_nsec"] = Truth("time", "", "ns")
_LBR_ACCEPT = {}
for _i in range(1, 8):
    _LBR_TRUTH[f"mp{_i}"] = Truth("position", str(_i), "rad")
    _LBR_TRUTH[f"ip{_i}"] = Truth("", str(_i), "rad")
    _LBR_TRUTH[f"mt{_i}"] = Truth("torque", str(_i), "")
    _LBR_TRUTH[f"et{_i}"] = Truth("", str(_i), "")
    _LBR_ACCEPT[f"ip{_i}"] = ("reference_position",)

LBR = Layout(
    name="kuka-lbr-fri",
    source="github.com/lbr-stack/pyfri, doc/examples.rst 'Collecting data from the robot': names, order and "
    "meaning exact (mp measured, ip interpolated position, mt measured, et external torque, epoch ns, "
    "controller s and ns); FRI units rad and N m; 5 ms; values simulated",
    suffix=".csv",
    machine="robot",
    write=write_lbr,
    truth=_LBR_TRUTH,
    accept=_LBR_ACCEPT,
    # Hard in it: five clock-like columns (index, time, epoch ns, controller s and its ns part); two-letter names;
    # interpolated positions beside measured; external torque beside measured; constant dt; joint 3 at rest; no speed,
    # no unit.
)


_TRACE = [
    "id",
    "ins_id",
    "trace_id",
    "zeit",
    "prog_num",
    "point_name",
    "motion_type",
    "x_act",
    "y_act",
    "z_act",
    "a_act",
    "b_act",
    "c_act",
    "cart_vel_act",
]
_TRACE_AXIS = (
    "axis_pos_act{0}",
    "sollposition_{0}",
    "istposition_{0}",
    "positionsschleppfehler_{0}",
    "sollgeschwindigkeit_{0}",
    "istgeschwindigkeit_{0}",
    "geschwindigkeitsdifferenz_{0}",
    "sollmoment_{0}",
    "istmoment_{0}",
    "motortemperatur_{0}",
    "iststrom_{0}",
)
for _i in range(1, 7):
    _TRACE += [form.format(_i) for form in _TRACE_AXIS]
_TRACE += ["created_at"]


def write_trace(path: Path, rng: Rng) -> None:
    """A KUKA trace of 12 ms in the columns of a database, with texts and NULLs."""
    dt = 0.004
    home = np.array([10.0, -80.0, 95.0, 5.0, 40.0, -20.0])
    points = [home]
    for _ in range(8):
        points.append(home + rng.uniform(-1, 1, 6) * np.array([60.0, 30.0, 35.0, 70.0, 45.0, 120.0]))
    ref = poses(points, rng.uniform(45.0, 130.0, 8), [0.8, *rng.uniform(0.2, 0.7, 7)], dt, 260.0, 0.14)
    q, v, a = follow(np.radians(ref), dt, 32.0)
    vr = speed_of(ref, dt)
    tau = arm_torque(
        q,
        v,
        a,
        inertia=[14.0, 15.0, 6.0, 0.8, 0.7, 0.3],
        coulomb=[22.0, 30.0, 18.0, 5.0, 5.0, 3.0],
        viscous=[18.0, 20.0, 12.0, 3.0, 3.0, 1.5],
        lift=1,
        elbow=2,
        moments=(-210.0, -85.0),
        coupling=2.5,
        wrist=(4, -6.0),
        upright=-np.pi / 2,
    )
    wanted = arm_torque(
        np.radians(ref),
        np.radians(vr),
        np.radians(speed_of(vr, dt)),
        inertia=[14.0, 15.0, 6.0, 0.8, 0.7, 0.3],
        coulomb=[22.0, 30.0, 18.0, 5.0, 5.0, 3.0],
        viscous=[18.0, 20.0, 12.0, 3.0, 3.0, 1.5],
        lift=1,
        elbow=2,
        moments=(-210.0, -85.0),
        coupling=2.5,
        wrist=(4, -6.0),
        upright=-np.pi / 2,
    )
    pick = np.arange(0, min(len(ref), 7200), 3)
    n = len(pick)
    q, v, tau, ref, vr, wanted = q[pick], v[pick], tau[pick], ref[pick], vr[pick], wanted[pick]
    t = np.arange(n) * 0.012 + np.abs(rng.normal(0.0, 0.0003, n))
    reach = 500.0 * np.cos(q[:, 1]) + 560.0 * np.cos(q[:, 1] + q[:, 2])
    tcp = np.stack(
        [
            np.cos(q[:, 0]) * reach,
            -np.sin(q[:, 0]) * reach,
            675.0 - 500.0 * np.sin(q[:, 1]) - 560.0 * np.sin(q[:, 1] + q[:, 2]),
        ],
        1,
    )
    turn = np.degrees(np.stack([q[:, 0] + q[:, 5], q[:, 1] + q[:, 2] + q[:, 4], q[:, 3]], 1))
    path_speed = np.linalg.norm(speed_of(tcp, 0.012), axis=1)
    leg = np.cumsum((path_speed[1:] > 3.0) & (path_speed[:-1] <= 3.0))
    leg = np.concatenate([[0], leg])
    columns = [
        [str(k) for k in range(1, n + 1)],
        ["3"] * n,
        ["17"] * n,
        text(t, "%.4f"),
        ["200"] * n,
        [f"P{k:03d}" for k in leg],
        ["PTP" if k % 3 else "LIN" for k in leg],
    ]
    columns += (
        [text(tcp[:, k], "%.3f") for k in range(3)]
        + [text(turn[:, k], "%.3f") for k in range(3)]
        + [text(path_speed, "%.2f")]
    )
    constant = np.array([95.0, 95.0, 60.0, 30.0, 30.0, 22.0]) / 10.0
    for j in range(6):
        is_pos = np.degrees(q[:, j]) + rng.normal(0.0, 0.0008, n)
        is_speed = np.degrees(v[:, j]) + rng.normal(0.0, 0.25, n)
        is_moment = tau[:, j] + rng.normal(0.0, 0.01 * np.ptp(tau[:, j]), n)
        heat = 38.0 + 2 * j + np.cumsum(np.abs(tau[:, j])) / np.abs(tau[:, j]).max() * 0.002
        columns += [
            text(is_pos, "%.4f", rng=rng, lost=0.004),
            text(ref[:, j], "%.4f"),
            text(is_pos, "%.4f", rng=rng, lost=0.004),
            text(ref[:, j] - is_pos, "%.4f"),
            text(vr[:, j], "%.3f"),
            text(is_speed, "%.3f"),
            text(vr[:, j] - is_speed, "%.3f"),
            text(wanted[:, j], "%.3f"),
            text(is_moment, "%.3f", rng=rng, lost=0.004),
            text(heat, "%.1f"),
            text(is_moment / constant[j] + rng.normal(0.0, 0.06, n), "%.3f"),
        ]
    columns.append(["2024-05-17 10:57:31.220418"] * n)
    save(path, columns, header=[",".join(_TRACE)])


_TRACE_TRUTH = {name: Truth() for name in _TRACE}
_TRACE_TRUTH["zeit"] = Truth("time", "", "s")
_TRACE_ACCEPT = {}
for _i in range(1, 7):
    _j = str(_i)
    _TRACE_TRUTH[f"axis_pos_act{_i}"] = Truth("position", _j, "deg")
    _TRACE_TRUTH[f"istposition_{_i}"] = Truth("position", _j, "deg")
    _TRACE_TRUTH[f"istgeschwindigkeit_{_i}"] = Truth("speed", _j, "deg/s")
    _TRACE_TRUTH[f"istmoment_{_i}"] = Truth("torque", _j, "")
    _TRACE_TRUTH[f"iststrom_{_i}"] = Truth("", _j, "A")
    _TRACE_TRUTH[f"sollposition_{_i}"] = Truth("", _j, "deg")
    _TRACE_TRUTH[f"sollgeschwindigkeit_{_i}"] = Truth("", _j, "deg/s")
    _TRACE_TRUTH[f"sollmoment_{_i}"] = Truth("", _j, "")
    _TRACE_ACCEPT |= {
        f"iststrom_{_i}": ("torque",),
        f"sollposition_{_i}": ("reference_position",),
        f"sollgeschwindigkeit_{_i}": ("reference_speed",),
        f"sollmoment_{_i}": ("reference_torque",),
    }

TRACE = Layout(
    name="kuka-trace-de",
    source="database columns of KUKA traces in two public analysis scripts: names and order exact, its plots "
    "give s, deg, deg/s, Nm, A; 12 ms as in antcsny/Data-collection-app-V2; values simulated",
    suffix=".csv",
    machine="robot",
    write=write_trace,
    truth=_TRACE_TRUTH,
    accept=_TRACE_ACCEPT,
    # Hard in it: German compound names; soll before ist; following error and speed difference; Cartesian pose; texts
    # between numbers; ids; the position twice; no unit; missing cells.
)


def _rotations(angles: Array, about: str) -> Array:
    c, s, o, i = np.cos(angles), np.sin(angles), np.zeros_like(angles), np.ones_like(angles)
    rows = [[c, -s, o], [s, c, o], [o, o, i]] if about == "z" else [[c, o, s], [o, i, o], [-s, o, c]]
    return np.stack([np.stack(row, -1) for row in rows], -2)


def write_wam(path: Path, rng: Rng) -> None:
    """Time, 7 positions, 7 speeds, 7 torques, tool position, quaternion, 4 finger torques: no header."""
    dt = 0.002
    home = np.array([0.0, -1.2, 0.1, 2.1, 0.0, 0.2, -0.37])
    points = [home]
    for _ in range(6):
        points.append(home + rng.uniform(-1, 1, 7) * np.array([0.8, 0.5, 0.6, 0.6, 0.7, 0.4, 0.0]))
    ref = poses(points, rng.uniform(0.5, 1.2, 6), [0.7, *rng.uniform(0.05, 0.3, 5)], dt, 2.5, 0.12)[:6000]
    q, v, a = follow(ref, dt, 24.0)
    n = len(ref)
    tau = arm_torque(
        q,
        v,
        a,
        inertia=[0.9, 1.0, 0.4, 0.3, 0.02, 0.02, 0.005],
        coulomb=[2.4, 2.0, 1.5, 0.9, 0.18, 0.18, 0.08],
        viscous=[0.6, 0.6, 0.4, 0.3, 0.03, 0.03, 0.01],
        lift=1,
        elbow=3,
        moments=(22.0, 7.5),
        coupling=0.18,
        wrist=(5, 0.5),
    )
    q = quantised(q, 2e-5)
    speed = low_pass(np.gradient(q, dt, axis=0), dt, 60.0) + rng.normal(0, 0.002, (n, 7))
    torque = tau + rng.normal(0.0, 0.02, (n, 7)) * np.array([8.0, 8, 5, 4, 1, 1, 0.4])
    at, turn = np.zeros((n, 3)), np.tile(np.eye(3), (n, 1, 1))
    for j, (about, length) in enumerate(zip("zyzyzyz", (0.0, 0.0, 0.55, 0.0, 0.3, 0.0, 0.06), strict=True)):
        turn = turn @ _rotations(q[:, j], about)
        at = at + turn[:, :, 2] * length
    w = 0.5 * np.sqrt(np.maximum(1.0 + np.trace(turn, axis1=1, axis2=2), 1e-6))
    quaternion = np.stack(
        [
            w,
            (turn[:, 2, 1] - turn[:, 1, 2]) / (4 * w),
            (turn[:, 0, 2] - turn[:, 2, 0]) / (4 * w),
            (turn[:, 1, 0] - turn[:, 0, 1]) / (4 * w),
        ],
        1,
    )
    fingers = np.array([1903.0, 2048, 2177, 1988]) + rng.normal(0, 2.0, (n, 4)).round()
    t = (np.arange(n) + 1) * dt
    columns = [text(t, "%.3f")]
    for values, form in (
        (q, "%.5f"),
        (speed, "%.5f"),
        (torque, "%.4f"),
        (at, "%.5f"),
        (quaternion, "%.5f"),
        (fingers, "%.0f"),
    ):
        columns += [text(values[:, k], form) for k in range(values.shape[1])]
    save(path, columns)


_WAM_TRUTH = {"0": Truth("time", "", "s")}
for _i in range(1, 8):
    _WAM_TRUTH[f"{_i}"] = Truth("position", str(_i), "rad")
    _WAM_TRUTH[f"{_i + 7}"] = Truth("speed", str(_i), "rad/s")
    _WAM_TRUTH[f"{_i + 14}"] = Truth("torque", str(_i), "")
_WAM_TRUTH |= {f"{_k}": Truth() for _k in range(22, 33)}

WAM = Layout(
    name="barrett-wam",
    source="RTMemory logger of a Barrett WAM: exportCSV without header, order time, 7 jp, 7 jv, 7 jt, 3 cp, 4 "
    "quaternion, 4 finger torques (STREAM_SIZE 33), 500 Hz; libbarrett units s, rad, rad/s, N m, m; "
    "values simulated",
    suffix=".csv",
    machine="robot",
    write=write_wam,
    truth=_WAM_TRUTH,
    # Hard in it: no header: 33 columns; tool position and quaternion move like joints; constant-like finger torques;
    # joint 7 at rest.
)


_WAIST = (
    "Temperature Time [s]",
    "Temp [C]",
    "States Time [s]",
    "Position [rad]",
    "Velocity [rad/s]",
    "Effort [mA]",
    "Commands Time [s]",
    "Position Command [rad]",
    "",
    "Max Temp [C]",
    "Min Temp [C]",
    "Temp Range [C]",
    "Max Effort [mA]",
    "Min Effort [mA]",
    "Avg Pos Effort [mA]",
    "Avg Neg Effort [mA]",
)


def write_waist(path: Path, rng: Rng) -> None:
    """Temperature, state and command messages side by side, each with its own clock and length."""
    dt = 0.002
    xr = plan(alternate(rng, -2.4, 2.4, (1.1, 1.9, 2.6, 1.5), 4.0, 58.0, (0.3, 0.9)), -2.4, dt, 0.2)
    sim = axis(xr, dt, inertia=0.09, coulomb=0.42, viscous=0.16, bandwidth=20.0, stiction=0.02)
    span = sim.t[-1]
    times = np.arange(0.0, span, 0.09) + rng.normal(0.0, 0.0015, len(np.arange(0.0, span, 0.09)))
    times = times - times[0]
    state = sim.at(times)
    n = len(times)
    position = quantised(state.x, 2 * np.pi / 4096)
    speed = quantised(state.v, 0.229 * np.pi / 30.0)
    effort = quantised(state.drive / 0.00153 + rng.normal(0.0, 9.0, n), 2.69)
    command_times = np.arange(0.0, span - 0.6, 0.09) + rng.normal(0.0, 0.001, len(np.arange(0.0, span - 0.6, 0.09)))
    command_times -= command_times[0]
    command = np.interp(command_times + 0.05, sim.t, sim.xr)
    heat_times = np.arange(0.0, span, 0.2) + rng.normal(0.0, 0.001, len(np.arange(0.0, span, 0.2)))
    heat_times -= heat_times[0]
    heat = np.floor(35.0 + 4.0 * (1.0 - np.exp(-heat_times / 60.0)) + rng.random(len(heat_times)) * 0.3)

    def cell(values: Array, i: int) -> str:
        return repr(float(np.round(values[i], 9))) if i < len(values) else ""

    stats = (
        heat.max(),
        heat.min(),
        np.ptp(heat),
        effort.max(),
        effort.min(),
        effort[effort > 0].mean(),
        effort[effort < 0].mean(),
    )
    lines = [",".join(_WAIST)]
    for i in range(max(n, len(command))):
        row = [
            cell(heat_times, i),
            str(int(heat[i])) if i < len(heat) else "",
            cell(times, i),
            cell(position, i),
            cell(speed, i),
            cell(effort, i),
            cell(command_times, i),
            cell(command, i),
        ]
        if i == 0:
            row += ["", *(repr(float(np.round(value, 3))) for value in stats)]
        lines.append(",".join(row))
    path.write_bytes(("\r\n".join(lines) + "\r\n").encode())


WAIST = Layout(
    name="interbotix-waist",
    source="github.com/Interbotix/interbotix_ros_manipulators, "
    "interbotix_xsarm_diagnostic_tool/scripts/bag2csv.py (header, three blocks of different lengths, "
    "statistics in the first row, 1 of 9 messages) and data/waist_diagnostics.csv (values not seen); "
    "Dynamixel resolution 4096/rev, 0.229 rpm, 2.69 mA; values simulated",
    suffix=".csv",
    machine="rotary axis",
    write=write_waist,
    truth=_names(
        ("Temperature Time [s]", Truth("", "", "s")),
        ("Temp [C]", Truth()),
        ("States Time [s]", Truth("time", "", "s")),
        ("Position [rad]", Truth("position", "", "rad")),
        ("Velocity [rad/s]", Truth("speed", "", "rad/s")),
        ("Effort [mA]", Truth("torque", "", "mA")),
        ("Commands Time [s]", Truth("", "", "s")),
        ("Position Command [rad]", Truth("", "", "rad")),
        *((name, Truth()) for name in _WAIST[9:]),
    ),
    accept={"Position Command [rad]": ("reference_position",)},
    # Hard in it: three clocks, the first belongs to the temperature and ends early; rows of different length; a
    # column without a name; statistics in the first row only; effort is a current; 11 Hz and coarse steps.
)


_KIT_SIGNALS = (
    "LOAD",
    "ENC_POS",
    "CTRL_DIFF2",
    "TORQUE",
    "CURRENT",
    "DES_POS",
    "CTRL_DIFF",
    "CTRL_POS",
    "VEL_FFW",
    "CONT_DEV",
    "CMD_SPEED",
    "TORQUE_FFW",
    "ENC1_POS",
    "ENC2_POS",
    "POWER",
)
_KIT_AXES = ("1", "2", "3", "6")
_KIT = ["CYCLE", *(f"{signal}|{a}" for signal in _KIT_SIGNALS for a in _KIT_AXES)]


def write_kit(path: Path, rng: Rng) -> None:
    """500 Hz of a milling machine: rapid moves, a pocket of circles and lines, a spindle at speed."""
    dt, n = 0.002, 5000
    fine = 0.001
    lines = []
    for low, high, speeds, acceleration, rests in (
        (-60.0, 95.0, (180.0, 60.0, 110.0, 35.0), 900.0, (0.1, 0.5)),
        (-35.0, 60.0, (90.0, 150.0, 40.0), 900.0, (0.2, 0.7)),
        (-18.0, 22.0, (50.0, 20.0, 80.0), 700.0, (0.5, 1.1)),
    ):
        lines.append(
            plan(alternate(rng, low, high, speeds, acceleration, 9.0, rests, rng.uniform(0.4, 0.9)), low, fine, 0.06)
        )
    length = 2 * n
    ref = np.stack([np.concatenate([x, np.full(max(length - len(x), 0), x[-1])])[:length] for x in lines], 1)
    circle = np.arange(length) * fine
    bump = np.clip((circle - 3.0) / 0.6, 0, 1) * np.clip((8.8 - circle) / 0.6, 0, 1)
    bump = bump * bump * bump * (bump * (6.0 * bump - 15.0) + 10.0)
    ref[:, 0] += 6.0 * bump * np.sin(2 * np.pi * 0.9 * circle)
    ref[:, 1] += 6.0 * bump * (np.cos(2 * np.pi * 0.9 * circle) - 1.0)
    vr, ar = speed_of(ref, fine), speed_of(speed_of(ref, fine), fine)
    q, v, a = ref.copy(), np.zeros(3), None
    out = np.empty((3, length, 3))
    at = ref[0].copy()
    w = 160.0
    for i in range(length):
        a = w * w * (ref[i] - at) + 2.0 * w * (0.97 * vr[i] - v) + 0.9 * ar[i]
        out[:, i] = at, v, a
        v = v + a * fine
        at = at + v * fine
    q, v, a = (x[::2] for x in out)
    ref, vr, ar = ref[::2], vr[::2], ar[::2]
    lead, mass = 12.0, np.array([420.0, 310.0, 180.0])
    cut = (bump[::2] * (0.8 + 0.2 * np.sin(2 * np.pi * 51.0 * circle[::2])))[:, None] * np.array([140.0, 120.0, 60.0])
    force = (
        mass * a * 1e-3
        + np.array([260.0, 220.0, 180.0]) * np.tanh(v / 1.5)
        + np.array([1.1, 0.9, 0.8]) * v
        + cut * np.tanh(v / 5.0)
    )
    force[:, 2] += 350.0
    torque = force * lead * 1e-3 / (2 * np.pi) + 0.0009 * a * (2 * np.pi / lead) + rng.normal(0.0, 0.04, (n, 3))
    feed = (mass * ar * 1e-3) * lead * 1e-3 / (2 * np.pi)
    spin = np.clip((np.arange(n) * dt - 0.6) / 1.2, 0.0, 1.0) * 3050.0
    spin_torque = (
        0.014 * speed_of(spin * np.pi / 30.0, dt) + (spin > 0) * 1.1 + bump[::2] * 2.3 + rng.normal(0.0, 0.05, n)
    )
    turned = np.cumsum(spin * 6.0 * dt)
    values: dict[str, tuple[Array, str]] = {}
    encoder = quantised(q + rng.normal(0.0, 8e-6, (n, 3)), 1e-6)
    for k, name in enumerate(_KIT_AXES[:3]):
        kt = (1.1, 1.1, 0.9)[k]
        values[f"LOAD|{name}"] = np.abs(low_pass(torque[:, k], dt, 20.0)) / 18.0 * 100.0, "%.2f"
        values[f"ENC_POS|{name}"] = encoder[:, k], "%.6f"
        values[f"CTRL_DIFF2|{name}"] = (ref[:, k] - encoder[:, k]) * 0.98, "%.5f"
        values[f"TORQUE|{name}"] = torque[:, k], "%.4f"
        values[f"CURRENT|{name}"] = torque[:, k] / kt + rng.normal(0.0, 0.03, n), "%.4f"
        values[f"DES_POS|{name}"] = ref[:, k], "%.6f"
        values[f"CTRL_DIFF|{name}"] = ref[:, k] - encoder[:, k], "%.6f"
        values[f"CTRL_POS|{name}"] = np.concatenate([ref[:1, k], ref[:-1, k]]), "%.5f"
        values[f"VEL_FFW|{name}"] = vr[:, k] * 60.0, "%.2f"
        values[f"CONT_DEV|{name}"] = np.zeros(n), "%.0f"
        values[f"CMD_SPEED|{name}"] = vr[:, k] / lead * 60.0, "%.3f"
        values[f"TORQUE_FFW|{name}"] = feed[:, k], "%.4f"
        values[f"ENC1_POS|{name}"] = encoder[:, k] + torque[:, k] * 2.5e-4, "%.5f"
        values[f"ENC2_POS|{name}"] = encoder[:, k], "%.5f"
        values[f"POWER|{name}"] = torque[:, k] * v[:, k] / lead * 2 * np.pi, "%.1f"
    spindle = {
        "LOAD": (np.abs(spin_torque) / 40.0 * 100.0, "%.2f"),
        "ENC_POS": (np.mod(turned, 360.0), "%.3f"),
        "CTRL_DIFF2": (np.zeros(n), "%.0f"),
        "TORQUE": (spin_torque, "%.3f"),
        "CURRENT": (spin_torque * 0.96, "%.3f"),
        "DES_POS": (np.mod(turned, 360.0), "%.2f"),
        "CTRL_DIFF": (np.zeros(n), "%.0f"),
        "CTRL_POS": (np.mod(turned, 360.0), "%.2f"),
        "VEL_FFW": (spin, "%.1f"),
        "CONT_DEV": (np.zeros(n), "%.0f"),
        "CMD_SPEED": (spin, "%.1f"),
        "TORQUE_FFW": (np.zeros(n), "%.0f"),
        "ENC1_POS": (np.mod(turned, 360.0), "%.2f"),
        "ENC2_POS": (np.zeros(n), "%.0f"),
        "POWER": (spin_torque * spin * np.pi / 30.0, "%.1f"),
    }
    values |= {f"{signal}|6": value for signal, value in spindle.items()}
    columns = [[str(4814008 + k) for k in range(n)]] + [text(*values[name]) for name in _KIT[1:]]
    save(path, columns, header=[",".join(_KIT)])


_KIT_TRUTH = {name: Truth("", name.partition("|")[2], "") for name in _KIT}
_KIT_TRUTH["CYCLE"] = Truth("time", "", "")
_KIT_ACCEPT: dict[str, tuple[str, ...]] = {"CYCLE": ("",)}
for _a in _KIT_AXES:
    for _signal, _channel, _unit in (
        ("ENC_POS", "position", "mm"),
        ("ENC1_POS", "position", "mm"),
        ("ENC2_POS", "position", "mm"),
        ("TORQUE", "torque", ""),
    ):
        if _a == "6":
            if _signal != "ENC2_POS":
                _KIT_TRUTH[f"{_signal}|6"] = Truth("", "6", "deg" if _channel == "position" else "")
                _KIT_ACCEPT[f"{_signal}|6"] = (_channel,)
        else:
            _KIT_TRUTH[f"{_signal}|{_a}"] = Truth(_channel, _a, _unit)
    for _signal, _channel in (
        ("CURRENT", "torque"),
        ("DES_POS", "reference_position"),
        ("CTRL_POS", "reference_position"),
        ("VEL_FFW", "reference_speed"),
        ("CMD_SPEED", "reference_speed"),
        ("TORQUE_FFW", "reference_torque"),
    ):
        _KIT_ACCEPT[f"{_signal}|{_a}"] = (_channel,)

KIT = Layout(
    name="sinumerik-kit",
    source="hfdata.csv of the KIT milling data set (Sinumerik Edge, 500 Hz) as described in a public guide (61 "
    "columns SIGNAL|axis, axes 1 2 3 6, meanings and sample rows) and column lists of its users; names "
    "exact, order of the blocks assumed; values simulated",
    suffix=".csv",
    machine="linear axis",
    write=write_kit,
    truth=_KIT_TRUTH,
    accept=_KIT_ACCEPT,
    # Hard in it: no clock but a cycle counter (500 Hz, not in the file); three encoders, three references and a
    # following error per axis; spindle as fourth axis |6 (sawtooth angle); load without sign; zero columns; no speed,
    # no unit.
)


_CDPR = ["time", *(f"ODrive {_k} {what}" for what in ("Position", "Velocity", "Current") for _k in range(4))]


def write_cdpr(path: Path, rng: Rng) -> None:
    """Winch 2 lifts and lowers 5 kg at several speeds; the other three hold. Polled at uneven times."""
    dt = 0.001
    xr = plan(alternate(rng, 6.0, -9.0, (0.5, 1.0, 2.5, 4.0, 1.0), 6.0, 62.0, (0.8, 1.8), 3.0), 6.0, dt, 0.1)
    sim = axis(xr, dt, inertia=0.055, coulomb=1.3, viscous=0.45, gravity=-11.4, bandwidth=18.0, stiction=0.05)
    step = np.round(
        rng.choice([0.005, 0.016, 0.031, 0.047], 6000, p=[0.3, 0.25, 0.33, 0.12]) + rng.integers(0, 3, 6000) * 0.001, 3
    )
    times = np.cumsum(step) + 0.06
    times = times[times < sim.t[-1]]
    got = sim.at(times)
    n = len(times)
    cogging = 0.35 * np.sin(2 * np.pi * got.x * 12.0)
    position = np.stack([np.full(n, -4.66305), np.full(n, -2.3083), got.x, np.full(n, 1.704346)], 1) + rng.normal(
        0, 8e-6, (n, 4)
    )
    speed = np.stack([np.zeros(n), np.zeros(n), got.v, np.zeros(n)], 1) + rng.normal(0, 0.0042, (n, 4))
    current = np.stack(
        [
            np.full(n, 0.2079585),
            np.full(n, 0.2210594),
            got.drive + cogging + rng.normal(0, 0.16, n),
            np.full(n, 0.0178146),
        ],
        1,
    )
    for k, first in enumerate((6, 4, 2, 0)):  # the drives are found one after the other
        for values in (position, speed, current):
            values[:first, k] = np.nan
    columns = [text(times, "%.3f")]
    for values in (position, speed, current):
        columns += [
            text(np.float32(values[:, k]).astype(float), "%.12g", missing="NaN", rng=rng, lost=0.001) for k in range(4)
        ]
    save(path, columns, header=[",".join(_CDPR)])


_CDPR_TRUTH = {"time": Truth("time", "", "s")}
for _k in range(4):
    _CDPR_TRUTH[f"ODrive {_k} Position"] = Truth("position", str(_k + 1), "rev")
    _CDPR_TRUTH[f"ODrive {_k} Velocity"] = Truth("speed", str(_k + 1), "rev/s")
    _CDPR_TRUTH[f"ODrive {_k} Current"] = Truth("torque", str(_k + 1), "A")

CDPR = Layout(
    name="odrive-winches",
    source="github.com/eliasoa/TTK4900_CDPR, Lifting_tests/5kg/ODrive2/Up1.csv (read: header, uneven clock, NaN "
    "at the beginning, ranges, noise, constant currents) and Plot.m; ODrive units turns, turns/s, A; "
    "strokes in both directions simulated",
    suffix=".csv",
    machine="rotary axis",
    write=write_cdpr,
    truth=_CDPR_TRUTH,
    # Hard in it: three of four joints at rest, two with constant currents; current -11.4 A at rest (gravity); NaN;
    # uneven clock; names with spaces and numbers from 0; turns without any unit.
)


_VESC = [
    "ms_today",
    "input_voltage",
    "temp_mos_max",
    "temp_mos_1",
    "temp_mos_2",
    "temp_mos_3",
    "temp_motor",
    "current_motor",
    "current_in",
    "d_axis_current",
    "q_axis_current",
    "erpm",
    "duty_cycle",
    "amp_hours_used",
    "amp_hours_charged",
    "watt_hours_used",
    "watt_hours_charged",
    "tachometer",
    "tachometer_abs",
    "encoder_position",
    "fault_code",
    "vesc_id",
    "d_axis_voltage",
    "q_axis_voltage",
    "ms_today_setup",
    "amp_hours_setup",
    "amp_hours_charged_setup",
    "watt_hours_setup",
    "watt_hours_charged_setup",
    "battery_level",
    "battery_wh_tot",
    "current_in_setup",
    "current_motor_setup",
    "speed_meters_per_sec",
    "tacho_meters",
    "tacho_abs_meters",
    "num_vescs",
    "ms_today_imu",
    "roll",
    "pitch",
    "yaw",
    "accX",
    "accY",
    "accZ",
    "gyroX",
    "gyroY",
    "gyroZ",
    "gnss_posTime",
    "gnss_lat",
    "gnss_lon",
    "gnss_alt",
    "gnss_gVel",
    "gnss_vVel",
    "gnss_hAcc",
    "gnss_vAcc",
]


def write_vesc(path: Path, rng: Rng) -> None:
    """A sliding gate driven by a VESC: strokes of 2.6 m, one obstacle; the electronics stand on the ground."""
    dt = 0.001
    xr = plan(alternate(rng, 0.0, 2.6, (0.28, 0.2, 0.34, 0.24), 0.5, 60.0, (0.8, 1.5)), 0.0, dt, 0.3)
    hit = crossing(xr, dt, 1.5, 1, 1)
    sim = axis(
        xr,
        dt,
        inertia=260.0,
        coulomb=70.0,
        viscous=90.0,
        bandwidth=9.0,
        limit=520.0,
        stiction=0.004,
        obstacles=[(1.5, 1, 3500.0, 60.0, hit - 1.0, 0.8)],
        yields=True,
    )
    times = np.cumsum(rng.choice([0.049, 0.05, 0.051, 0.06, 0.098], 4000, p=[0.2, 0.56, 0.2, 0.03, 0.01]))
    times = times[times < sim.t[-1]]
    s = sim.at(times)
    n = len(times)
    counts = np.floor(s.x * 6631.6)
    counts_abs = np.floor(np.interp(times, sim.t, np.cumsum(np.abs(sim.v)) * dt) * 6631.6)
    erpm = s.v * 66315.8 + rng.normal(0, 40.0, n) * (np.abs(s.v) > 1e-3)
    iq = s.drive * 0.035 + rng.normal(0, 0.12, n)
    duty = s.v / 0.62 + iq * 0.004
    drive_current = np.sign(duty * iq) * np.abs(iq)
    battery = duty * iq + 0.12
    used = np.cumsum(np.maximum(battery, 0)) * 0.05 / 3600
    back = np.cumsum(np.maximum(-battery, 0)) * 0.05 / 3600
    voltage = 25.3 - 0.03 * battery + rng.normal(0, 0.03, n)
    warm = 31.0 + 2.5 * (1 - np.exp(-times / 80.0))
    ms = (52_233_817 + np.round(times * 1000)).astype(np.int64)
    zero = np.zeros(n)
    data = {
        "ms_today": [str(k) for k in ms],
        "input_voltage": text(quantised(voltage, 0.1), "%.2f"),
        "temp_mos_max": text(quantised(warm, 0.1), "%.2f"),
        "temp_mos_1": text(zero, "%.2f"),
        "temp_mos_2": text(zero, "%.2f"),
        "temp_mos_3": text(zero, "%.2f"),
        "temp_motor": text(quantised(warm + 4, 0.1), "%.2f"),
        "current_motor": text(drive_current, "%.2f"),
        "current_in": text(battery, "%.2f"),
        "d_axis_current": text(rng.normal(0, 0.1, n), "%.2f"),
        "q_axis_current": text(iq, "%.2f"),
        "erpm": text(erpm, "%.2f"),
        "duty_cycle": text(duty, "%.3f"),
        "amp_hours_used": text(used, "%.4f"),
        "amp_hours_charged": text(back, "%.4f"),
        "watt_hours_used": text(used * 25.3, "%.4f"),
        "watt_hours_charged": text(back * 25.3, "%.4f"),
        "tachometer": text(counts, "%.0f"),
        "tachometer_abs": text(counts_abs, "%.0f"),
        "encoder_position": text(np.mod(counts / 42.0 * 360.0, 360.0), "%.2f"),
        "fault_code": ["0"] * n,
        "vesc_id": ["24"] * n,
        "d_axis_voltage": text(rng.normal(-0.05, 0.05, n), "%.3f"),
        "q_axis_voltage": text(duty * 21.0, "%.3f"),
        "ms_today_setup": [str(k + 3) for k in ms],
        "amp_hours_setup": text(used, "%.4f"),
        "amp_hours_charged_setup": text(back, "%.4f"),
        "watt_hours_setup": text(used * 25.3, "%.4f"),
        "watt_hours_charged_setup": text(back * 25.3, "%.4f"),
        "battery_level": text(np.full(n, 0.874) - used / 20, "%.3f"),
        "battery_wh_tot": text(np.full(n, 505.2), "%.2f"),
        "current_in_setup": text(battery, "%.2f"),
        "current_motor_setup": text(drive_current, "%.2f"),
        "speed_meters_per_sec": text(erpm / 66315.8, "%.3f"),
        "tacho_meters": text(counts / 6631.6, "%.3f"),
        "tacho_abs_meters": text(counts_abs / 6631.6, "%.3f"),
        "num_vescs": ["1"] * n,
        "ms_today_imu": [str(k + 5) for k in ms],
        "roll": text(rng.normal(0.4, 0.05, n), "%.3f"),
        "pitch": text(rng.normal(-1.1, 0.05, n), "%.3f"),
        "yaw": text(12.0 + np.cumsum(rng.normal(0, 0.01, n)), "%.3f"),
        "accX": text(rng.normal(0.019, 0.004, n), "%.3f"),
        "accY": text(rng.normal(0.007, 0.004, n), "%.3f"),
        "accZ": text(rng.normal(0.998, 0.004, n), "%.3f"),
        "gyroX": text(rng.normal(0, 0.15, n), "%.2f"),
        "gyroY": text(rng.normal(0, 0.15, n), "%.2f"),
        "gyroZ": text(rng.normal(0, 0.15, n), "%.2f"),
        "gnss_posTime": ["-1"] * n,
        "gnss_lat": ["0.00000000"] * n,
        "gnss_lon": ["0.00000000"] * n,
        "gnss_alt": ["0.000"] * n,
        "gnss_gVel": ["0.000"] * n,
        "gnss_vVel": ["0.000"] * n,
        "gnss_hAcc": ["0.000"] * n,
        "gnss_vAcc": ["0.000"] * n,
    }
    save(path, [data[name] for name in _VESC], header=[";".join(_VESC) + ";"], separator=";", end=";")


_VESC_TRUTH = {name: Truth() for name in _VESC} | {
    "ms_today": Truth("time", "", "ms"),
    "ms_today_setup": Truth("", "", "ms"),
    "ms_today_imu": Truth("", "", "ms"),
    "q_axis_current": Truth("torque", "", "A"),
    "speed_meters_per_sec": Truth("speed", "", "m/s"),
    "tacho_meters": Truth("position", "", "m"),
    "tachometer": Truth("", "", "count"),
    "duty_cycle": Truth("", "", "1"),
    "current_motor": Truth("", "", "A"),
}

VESC = Layout(
    name="vesc-gate",
    source="header of the VESC Tool log as printed by three public loggers: 55 names, order, ';' also at the "
    "end; VESC sign conventions (current_motor > 0 drives, < 0 brakes; q_axis_current has the torque's "
    "sign); the gate itself is made up",
    suffix=".csv",
    machine="linear axis",
    write=write_vesc,
    truth=_VESC_TRUTH,
    accept={"ms_today_setup": ("time",), "ms_today_imu": ("time",), "tachometer": ("position",)},
    # Hard in it: seven currents, of which one has the torque's sign; erpm is pole pairs x rpm; tacho_abs only rises;
    # encoder_position wraps; IMU stands on the ground; GNSS without fix; charge counters; milliseconds of the day;
    # ';' at the end of the lines.
)


_TDMS = (
    "/'Forza [N]'/'Time'",
    "/'Forza [N]'/'D1.BW01 [N]'",
    "/'Spostamento [mm]'/'Time'",
    "/'Spostamento [mm]'/'D1.BG01 [mm]'",
    "/'Velocità [mm/s]'/'Time'",
    "/'Velocità [mm/s]'/'D1.BV01 [mm/s]'",
    "/'Corrente [mA]'/'Time'",
    "/'Corrente [mA]'/'T1.GS1.FBK.I [A]'",
    "/'Corrente [mA]'/'T1.GS2.FBK.I [A]'",
)


def write_tdms(path: Path, rng: Rng) -> None:
    """Free strokes, then two pushes against the load cell up to the stall force."""
    dt = 0.0005
    xr = plan(
        [
            (0.12, 0.05, 0.25, 1.0),
            (0.01, 0.08, 0.25, 0.5),
            (0.172, 0.03 * rng.uniform(0.9, 1.1), 0.2, 0.6),
            (0.02, 0.06, 0.25, 1.2),
            (0.175, 0.055 * rng.uniform(0.9, 1.1), 0.25, 0.6),
            (0.0, 0.09, 0.3, 0.9),
        ],
        0.0,
        dt,
        0.1,
    )
    sim = axis(
        xr,
        dt,
        inertia=320.0,
        coulomb=180.0,
        viscous=2200.0,
        bandwidth=28.0,
        limit=2600.0,
        stiction=0.0008,
        obstacles=[(0.15, 1, 1.6e5, 900.0, 0.0, np.inf)],
    )
    s = sim.at(np.arange(0.0, sim.t[-1], 0.002))
    n = len(s.t)
    force = s.contact + rng.normal(0, 4.0, n) + 6.0
    first = s.drive * 0.0013 + 0.04 + rng.normal(0, 0.03, n)
    second = s.drive * 0.00115 - 0.02 + rng.normal(0, 0.03, n)
    speed = low_pass(s.v * 1000.0 + rng.normal(0, 0.8, n), 0.002, 40.0)
    clock = text(s.t, "%.3f")
    late = [*clock[:-3], "", "", ""]
    columns = [
        [str(k) for k in range(n)],
        clock,
        text(force, "%.3f"),
        late,
        [*text(s.x * 1000 + rng.normal(0, 0.004, n), "%.4f")[:-3], "", "", ""],
        late,
        [*text(speed, "%.4f")[:-3], "", "", ""],
        clock,
        text(first, "%.4f"),
        text(second, "%.4f"),
    ]
    save(path, columns, header=["," + ",".join(_TDMS)])


TDMS = Layout(
    name="tdms-it",
    source="example in a public Italian library for NI TDMS files: group and channel names 'Forza [N]' D1.BW01 "
    "[N], 'Spostamento [mm]' D1.BG01, 'Velocità [mm/s]' D1.BV01 [mm/s], 'Corrente [mA]' T1.GS1.FBK.I [A] "
    "and GS2, a Time per group, shorter groups padded; as_dataframe().to_csv(); values simulated ('stall "
    "load')",
    suffix=".csv",
    machine="linear axis",
    write=write_tdms,
    truth=_names(
        ("/'Forza [N]'/'Time'", Truth("time", "", "s")),
        ("/'Forza [N]'/'D1.BW01 [N]'", Truth("force", "", "N")),
        ("/'Spostamento [mm]'/'Time'", Truth("time", "", "s")),
        ("/'Spostamento [mm]'/'D1.BG01 [mm]'", Truth("position", "", "mm")),
        ("/'Velocità [mm/s]'/'Time'", Truth("time", "", "s")),
        ("/'Velocità [mm/s]'/'D1.BV01 [mm/s]'", Truth("speed", "", "mm/s")),
        ("/'Corrente [mA]'/'Time'", Truth("time", "", "s")),
        ("/'Corrente [mA]'/'T1.GS1.FBK.I [A]'", Truth("torque", "", "A")),
        ("/'Corrente [mA]'/'T1.GS2.FBK.I [A]'", Truth("torque", "", "A")),
    ),
    # Hard in it: clocks inside groups named force, displacement, speed and current, with those units; the currents
    # are in A in a group [mA]; two motors on one axis; load cell beside motor currents; index without a name; the
    # last cells missing.
)


_JA = (
    "時間",
    "帰還パルス累積",
    "サーボモータ回転速度",
    "溜りパルス",
    "瞬時発生トルク",
    "実効負荷率",
    "母線電圧",
    "エンコーダ内部温度",
)


def write_servo(path: Path, rng: Rng) -> None:
    """A ball screw with a 22-bit encoder; names and units in two lines, Shift-JIS."""
    dt = 0.001
    turns = plan(alternate(rng, 0.0, 28.0, (12.0, 25.0, 33.0, 18.0), 160.0, 19.0, (0.3, 0.8), 0.7), 0.0, dt, 0.05)
    sim = axis(
        turns * 2 * np.pi, dt, inertia=0.00021, coulomb=0.11, viscous=0.0006, bandwidth=70.0, stiction=0.4, lead=0.6
    )
    s = sim.at(np.arange(0.0, sim.t[-1], 0.004))
    n = len(s.t)
    per_turn = 4194304 / (2 * np.pi)
    pulses = np.round(s.x * per_turn + rng.normal(0, 3, n))
    droop = np.round(s.xr * per_turn) - pulses
    torque = s.drive / 1.3 * 100.0 + rng.normal(0, 0.6, n)
    effective = low_pass(np.abs(torque), 0.004, 0.05)
    bus = 283.0 - 0.02 * torque * np.sign(s.v) + rng.normal(0, 0.7, n)
    columns = [
        text(s.t * 1000, "%.1f"),
        text(pulses, "%.0f"),
        text(np.round(s.v * 30 / np.pi + rng.normal(0, 0.6, n)), "%.0f"),
        text(droop, "%.0f"),
        text(torque, "%.1f"),
        text(np.round(effective), "%.0f"),
        text(np.round(bus), "%.0f"),
        text(np.full(n, 41.0) + (s.t > 11.0), "%.0f"),
    ]
    save(
        path,
        columns,
        header=[
            "グラフデータ,MR-J4-40A,軸1",
            "サンプリング周期,4.0,ms",
            "",
            ",".join(_JA),
            "[ms],[pulse],[r/min],[pulse],[%],[%],[V],[℃]",
        ],
        encoding="cp932",
        newline="\r\n",
    )


SERVO = Layout(
    name="melservo-ja",
    source="only described: quantities and units of the status display of Mitsubishi MR-J servo amplifiers "
    "(manual MR-JE_A, 12.4.1: cumulative feedback pulses, servo motor speed, droop pulses, instantaneous "
    "torque, effective load ratio, bus voltage, encoder temperature), Japanese names as on the Japanese "
    "display; file frame (names, units in the next line, Shift-JIS) made up",
    suffix=".csv",
    machine="linear axis",
    write=write_servo,
    truth=dict(
        zip(
            _JA,
            (
                Truth("time", "", "ms"),
                Truth("position", "", "count"),
                Truth("speed", "", "rpm"),
                Truth("", "", "count"),
                Truth("torque", "", "%"),
                Truth(),
                Truth(),
                Truth(),
            ),
            strict=True,
        )
    ),
    # Hard in it: Japanese names in Shift-JIS, units in a line of their own; droop pulses (an error) look like a
    # position; effective load ratio in % beside torque in %; pulses and % without a scale.
)


def write_lxm(path: Path, rng: Rng) -> None:
    """EtherCAT log at 1 kHz: ns clock, reference, position, difference, torque as integers."""
    dt = 0.001
    turns = plan(alternate(rng, 0.0, 9.0, (3.0, 6.0, 9.0, 1.5), 40.0, 15.0, (0.2, 0.7), 0.6), 0.0, dt, 0.04)
    sim = axis(
        turns * 2 * np.pi,
        dt,
        inertia=0.004,
        coulomb=0.22,
        viscous=0.006,
        bandwidth=55.0,
        stiction=0.3,
        lead=0.55,
        limit=4.0,
    )
    n = len(sim.t)
    stamp = 918_273_645_120_334 + np.arange(n, dtype=np.int64) * 1_000_000 + rng.normal(0, 14_000, n).astype(np.int64)
    ref = np.round(sim.xr * 131072 / (2 * np.pi)).astype(int) - 48211
    act = np.round(sim.x * 131072 / (2 * np.pi) + rng.normal(0, 0.8, n)).astype(int) - 48211
    torque = np.round(sim.drive / 3.4 * 1000.0 + rng.normal(0, 4.0, n)).astype(int)
    save(
        path,
        [
            [str(k) for k in stamp],
            [str(k) for k in ref],
            [str(k) for k in act],
            [str(k) for k in ref - act],
            [str(k) for k in torque],
        ],
        separator="\t",
    )


LXM = Layout(
    name="lxm32i",
    source="github.com/alessiomargan/ec_master_test (examples/ecat_states/LXM32i_plot.m: columns ts, pRef, pAct, "
    "pDiff, tqAct) and its struct LXM32iLogTypes (ts in ns, int32 positions, int16 torque, tabs, no "
    "header); 131072 counts per turn and 0.1 % torque as in the LXM32 manual; values simulated",
    suffix=".txt",
    machine="rotary axis",
    write=write_lxm,
    truth={
        "0": Truth("time", "", "ns"),
        "1": Truth("", "", "count"),
        "2": Truth("position", "", "count"),
        "3": Truth("", "", "count"),
        "4": Truth("torque", "", ""),
    },
    accept={"1": ("reference_position",)},
    # Hard in it: no header, only integers; the reference is left of the measured position and leads it; their
    # difference is a column too; clock in ns.
)


_ONEDOF_PARTS = (
    "fault",
    "Load",
    "fLoad",
    "deg",
    "abs_r",
    "fAbs",
    "enc",
    "T_des",
    "T_ff",
    "T_L_err",
    "T_p",
    "T_i",
    "T_d",
    "T_fb",
    "T_tot",
    "t_con",
    "t_g",
    "t_f",
    "t_st",
    "t_des",
)
_ONEDOF = ["Elapsed Time(ms)", *(f"R_Knee_{part}" for part in _ONEDOF_PARTS)]


def write_onedof(path: Path, rng: Rng) -> None:
    """One joint with a torque load cell, two encoders and all terms of its torque controller."""
    dt = 0.001
    xr = plan(alternate(rng, 0.12, 1.25, (0.9, 1.6, 2.4, 1.2), 9.0, 12.0, (0.1, 0.5), 0.5), 0.12, dt, 0.1)
    sim = axis(xr, dt, inertia=0.12, coulomb=0.35, viscous=0.12, bandwidth=26.0, stiction=0.03)
    n = len(sim.t)
    gravity = 4.6 * np.sin(sim.x)
    joint = (sim.drive + gravity) * 1000.0
    load = joint + rng.normal(0, 22.0, n)
    smooth = low_pass(load, dt, 25.0)
    g = gravity * 1000.0 * 0.96
    f = (0.3 * np.tanh(sim.vr / 0.05)) * 1000.0
    wanted = np.interp(sim.t + 0.012, sim.t, joint)
    con = wanted - g - f
    error = wanted - smooth
    p, i, d = 0.6 * error, np.cumsum(error) * dt * 1.5, low_pass(speed_of(error, dt), dt, 40.0) * 0.002
    back = p + i + d
    absolute = np.mod(1480 + np.degrees(sim.x) * 4096 / 360 + rng.normal(0, 0.4, n), 4096)
    parts = {
        "fault": (np.zeros(n), "%.0f"),
        "Load": (load, "%.6g"),
        "fLoad": (smooth, "%.6g"),
        "deg": (quantised(np.degrees(sim.x), 360 / 80000), "%.6g"),
        "abs_r": (np.round(absolute), "%.0f"),
        "fAbs": (low_pass(absolute, dt, 15.0), "%.6g"),
        "enc": (np.round(np.degrees(sim.x) * 80000 / 360), "%.0f"),
        "T_des": (wanted, "%.6g"),
        "T_ff": (wanted, "%.6g"),
        "T_L_err": (error, "%.6g"),
        "T_p": (p, "%.6g"),
        "T_i": (i, "%.6g"),
        "T_d": (d, "%.6g"),
        "T_fb": (back, "%.6g"),
        "T_tot": (back + wanted, "%.6g"),
        "t_con": (con, "%.6g"),
        "t_g": (g, "%.6g"),
        "t_f": (f, "%.6g"),
        "t_st": (np.zeros(n), "%.0f"),
        "t_des": (wanted, "%.6g"),
    }
    elapsed = sim.t * 1000 + np.abs(rng.normal(0.03, 0.02, n))
    save(
        path,
        [text(elapsed, "%.6g"), *(text(*parts[part]) for part in _ONEDOF_PARTS)],
        header=[",".join(_ONEDOF) + ","],
        end=",",
    )


_ONEDOF_TRUTH = {name: Truth() for name in _ONEDOF} | {
    "Elapsed Time(ms)": Truth("time", "", "ms"),
    "R_Knee_Load": Truth("torque", "", ""),
    "R_Knee_fLoad": Truth("torque", "", ""),
    "R_Knee_deg": Truth("position", "", "deg"),
    "R_Knee_enc": Truth("position", "", "count"),
    "R_Knee_abs_r": Truth("position", "", "count"),
    "R_Knee_fAbs": Truth("position", "", "count"),
}

ONEDOF = Layout(
    name="exo-knee",
    source="onedof_logger.cpp of an Esmacat exoskeleton joint: 21 names and order exact (joint label chosen), "
    "comma at the end of each line, C++ default digits; meanings from the struct members "
    "(loadcell_reading_mNm, encoder degrees, counts, mNm); values simulated",
    suffix=".csv",
    machine="rotary axis",
    write=write_onedof,
    truth=_ONEDOF_TRUTH,
    accept={
        "R_Knee_T_des": ("reference_torque",),
        "R_Knee_t_des": ("reference_torque",),
        "R_Knee_T_ff": ("reference_torque",),
        "R_Knee_T_tot": ("torque", "reference_torque"),
    },
    # Hard in it: names that differ only in upper and lower case (T_des, t_des); a load cell that measures the joint's
    # torque, not a contact; 12 controller terms of the size of the torque; four position columns; constant columns;
    # comma at the end.
)


_DYDAQ = (
    "Sequence number",
    "Time Code",
    "Local Date",
    "Local Time",
    "Milliseconds",
    "Data quality",
    "Kraft_SK",
    "Weg_Tuer",
    "v_Tuer",
    "a_Tuer",
    "I_Motor",
    "T_Motor",
    "DI_Lichtschranke",
)


def write_dydaq(path: Path, rng: Rng) -> None:
    """A sliding door that closes against a force gauge twice; three header lines, decimal comma, epoch milliseconds."""
    dt = 0.001
    xr = plan(alternate(rng, 0.0, 0.95, (0.45, 0.3, 0.6, 0.36), 0.9, 42.0, (1.0, 1.8)), 0.0, dt, 0.25)
    hits = [(0.62, crossing(xr, dt, 0.62, 1, 1)), (0.45, crossing(xr, dt, 0.45, 1, 3))]
    sim = axis(
        xr,
        dt,
        inertia=95.0,
        coulomb=24.0,
        viscous=32.0,
        bandwidth=12.0,
        limit=230.0,
        stiction=0.004,
        obstacles=[(where, 1, 9000.0, 120.0, when - 0.5, rng.uniform(0.5, 0.8)) for where, when in hits],
        yields=True,
    )
    s = sim.at(np.arange(0.0, sim.t[-1], 0.01))
    n = len(s.t)
    force = quantised(s.contact + rng.normal(0, 0.5, n), 0.1)
    code = (1_731_412_805_370 + np.round(s.t * 1000)).astype(np.int64)
    clock = [datetime.datetime.fromtimestamp(k / 1000.0, datetime.UTC) for k in code]
    gate = np.ones(n)
    for when in s.t[s.contact > 20.0]:
        gate[(s.t > when - 0.8) & (s.t < when + 0.9)] = 0.0

    def comma(cells: list[str]) -> list[str]:
        return [cell.replace(".", ",") for cell in cells]

    acceleration = low_pass(s.a, 0.01, 12.0) + rng.normal(0, 0.03, n)
    current = s.drive * 0.028 + rng.normal(0, 0.05, n)
    speed = low_pass(np.gradient(quantised(s.x, 0.0002), 0.01), 0.01, 8.0) * 1000.0
    columns = [
        [str(k) for k in range(40, 40 + n)],
        [str(k) for k in code],
        [k.strftime("%d.%m.%Y") for k in clock],
        [k.strftime("%H:%M:%S") for k in clock],
        [str(k.microsecond // 1000) for k in clock],
        ["0"] * n,
        comma(text(force, "%.1f", rng=rng, lost=0.002)),
        comma(text(quantised(s.x * 1000, 0.2), "%.1f", rng=rng, lost=0.002)),
        comma(text(speed, "%.2f")),
        comma(text(acceleration, "%.3f")),
        comma(text(current, "%.3f", rng=rng, lost=0.002)),
        comma(text(quantised(28.4 + 0.02 * s.t, 0.1), "%.1f")),
        text(gate, "%.0f"),
    ]
    header = [
        ";".join(_DYDAQ),
        "Datenblock;Zeit seit 01.01.1970 UTC;lokales Datum;lokale Zeit;Millisekunden;;"
        "Schließkraft Prüfkörper;Türweg Seilzug;"
        "Türgeschwindigkeit;Beschleunigung Türblatt;Motorstrom Antrieb;Motortemperatur;Lichtschranke frei",
        ";ms;;;ms;;N;mm;mm/s;m/s²;A;°C;",
    ]
    save(path, columns, header=header, separator=";", newline="\r\n")


DYDAQ = Layout(
    name="dydaqmeas-door-de",
    source="https://meas.dydaqlog.de/static/html_Dokumentation/MEAS_FORMAT.html (5.3.1: line 1 names, line 2 "
    "descriptions, line 3 units; the six default columns Sequence number ... Data quality, Time Code in "
    "ms since 1970); the door's channels, ';' and decimal comma made up",
    suffix=".csv",
    machine="linear axis",
    write=write_dydaq,
    truth=_names(
        ("Sequence number", Truth()),
        ("Time Code", Truth("time", "", "ms")),
        ("Local Date", Truth()),
        ("Local Time", Truth()),
        ("Milliseconds", Truth("", "", "ms")),
        ("Data quality", Truth()),
        ("Kraft_SK", Truth("force", "", "N")),
        ("Weg_Tuer", Truth("position", "", "mm")),
        ("v_Tuer", Truth("speed", "", "mm/s")),
        ("a_Tuer", Truth("acceleration", "", "m/s2")),
        ("I_Motor", Truth("torque", "", "A")),
        ("T_Motor", Truth()),
        ("DI_Lichtschranke", Truth()),
    ),
    # Hard in it: epoch milliseconds beside date, time and a sawtooth Milliseconds; T_Motor is a temperature; a line
    # of descriptions between names and units; decimal comma; light barrier 0/1; two contacts on the gauge.
)


_ZH = (
    "序号",
    "时间(s)",
    "门位置(mm)",
    "门速度(mm/s)",
    "速度给定(mm/s)",
    "电机电流(A)",
    "输出力矩(%)",
    "阻门力(N)",
    "母线电压(V)",
    "散热器温度(℃)",
    "门状态",
)


def write_lift(path: Path, rng: Rng) -> None:
    """A lift door operator; the clock is called s and counts milliseconds."""
    dt = 0.001
    xr = plan(alternate(rng, 0.0, 0.9, (0.5, 0.28, 0.6, 0.35), 1.1, 40.0, (0.9, 1.6)), 0.0, dt, 0.3)
    hit = crossing(xr, dt, 0.4, -1, 1)
    sim = axis(
        xr,
        dt,
        inertia=120.0,
        coulomb=18.0,
        viscous=28.0,
        bandwidth=11.0,
        limit=260.0,
        stiction=0.004,
        obstacles=[(0.4, -1, 6000.0, 100.0, hit - 0.6, 0.7)],
        yields=True,
    )
    s = sim.at(np.arange(0.0, sim.t[-1], 0.02))
    n = len(s.t)
    moving = np.abs(s.v) > 0.01
    state = np.where(moving, np.where(s.v > 0, 1, 3), np.where(s.x > 0.45, 2, 0)).astype(float)
    torque = s.drive / 2.6 + rng.normal(0, 0.8, n)
    # the current has no sign: magnetising and torque current of an asynchronous motor
    current = np.hypot(0.42, torque * 0.013) * (1.0 + rng.normal(0, 0.015, n))
    columns = [
        [str(k) for k in range(1, n + 1)],
        text(np.round(s.t * 1000), "%.0f"),
        text(quantised(s.x * 1000, 0.5), "%.1f"),
        text(np.round(s.v * 1000 + rng.normal(0, 1.5, n)), "%.0f"),
        text(np.round(s.vr * 1000), "%.0f"),
        text(current, "%.2f"),
        text(torque, "%.1f", rng=rng, lost=0.003),
        text(np.abs(s.contact) + np.abs(rng.normal(0, 0.6, n)), "%.1f"),
        text(311.0 - torque * 0.02 + rng.normal(0, 0.6, n), "%.1f"),
        text(36.0 + 0.03 * s.t, "%.1f"),
        text(state, "%.0f"),
    ]
    save(path, columns, header=[",".join(_ZH)], encoding="utf-8-sig", newline="\r\n")


LIFT = Layout(
    name="lift-door-zh",
    source="only described: quantities of Chinese lift door operators and of door-force tests (GB 7588: 阻门力, "
    "closing force); no public file was found, names composed in the style 量(单位) of public Chinese CSVs",
    suffix=".csv",
    machine="linear axis",
    write=write_lift,
    truth=dict(
        zip(
            _ZH,
            (
                Truth(),
                Truth("time", "", "ms"),
                Truth("position", "", "mm"),
                Truth("speed", "", "mm/s"),
                Truth("", "", "mm/s"),
                Truth("", "", "A"),
                Truth("torque", "", "%"),
                Truth("force", "", "N"),
                Truth(),
                Truth(),
                Truth(),
            ),
            strict=True,
        )
    ),
    accept={"速度给定(mm/s)": ("reference_speed",), "电机电流(A)": ("torque",)},
    # Hard in it: Chinese names with a BOM; the clock is named s but counts ms (only speed = d position/dt shows it);
    # row number; reference beside speed; current without sign beside torque; state; force gauge with one contact.
)


LAYOUTS: tuple[Layout, ...] = (
    UHING,
    KR3,
    LBR,
    TRACE,
    WAM,
    WAIST,
    KIT,
    CDPR,
    VESC,
    TDMS,
    SERVO,
    LXM,
    ONEDOF,
    DYDAQ,
    LIFT,
)
