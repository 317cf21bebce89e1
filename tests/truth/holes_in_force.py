"""Load cells with one contact, and copies of them in which samples are missing at random.

Contacts of the simulated gate, and random ones: half sines of 8 to 250 ms with rebounds and a continuing push, on cells
of 60 Hz to 1 kHz with and without clock jitter, noise, drift and both signs. Each is read whole and with faults: one to
three holes of 1 ms to 1.5 s at random positions about the contact, as NaN or as missing samples, or single samples lost
at random (2 %), never two consecutive ones.

An error is an onset farther from that of the whole log than the contact states (its uncertainty before it, its
resolution around it), unless the contact is not assessable; and a pass of a force verdict that the whole log does not
pass. The limits are random about the peak.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.commands.simulate.gate_model import GateParameters, simulate_gate_run
from cdtool.commands.simulate.gate_recordings import IMPACT_OF
from cdtool.recordings.recording import Contact, Recording, Series
from cdtool.truth.force.curve import force_time_curve
from cdtool.truth.force.limits import ForceProfile, ForceStep
from cdtool.truth.force.verdict import assess_force
from cdtool.truth.onset import OnsetRule, find_contacts

WINDOW = 1.0
KINDS = ("NaN", "no rows", "single samples")


@dataclass(frozen=True)
class Cell:
    """One load cell's whole log, the rule for its contacts, and the limits that its force is compared with."""

    name: str
    series: Series
    rule: OnsetRule
    profile: ForceProfile


@dataclass
class Count:
    """The outcomes of the faults of one kind."""

    marked: int = 0
    passes: int = 0


def cell(rng: np.random.Generator, number: int) -> Cell:
    """A load cell with one contact, now and then with more."""
    if number % 4 == 0:
        group = ("stiff", "soft")[number // 4 % 2]
        run = simulate_gate_run(GateParameters(), rng, IMPACT_OF[group])
        name, time, force = f"gate, {group}", run.time, run.load_cell
    else:
        name, time, force = _drawn(rng)
    rule = OnsetRule(20.0, 8.0) if rng.random() < 0.7 else OnsetRule()
    peak = float(np.abs(force).max())
    steps = (
        ForceStep(0.0, peak * rng.uniform(0.5, 1.6), "dynamic"),
        ForceStep(0.5, peak * rng.uniform(0.05, 1.2), "static"),
    )
    return Cell(name, Series(time, force, "N"), rule, ForceProfile("p", "p", "drawn", True, steps))


def _drawn(rng: np.random.Generator) -> tuple[str, FloatArray, FloatArray]:
    rate = float(rng.choice([60.0, 100.0, 250.0, 1000.0, 1000.0]))
    jitter = float(rng.choice([0.0, 0.2, 0.45]))
    time = np.arange(0.0, 9.0, 1.0 / rate)
    time = time + rng.uniform(-jitter, jitter, len(time)) / rate
    lasts = float(np.exp(rng.uniform(np.log(max(0.008, 4.0 / rate)), np.log(0.25))))
    peak = float(np.exp(rng.uniform(np.log(150.0), np.log(4000.0))))
    onset = 5.0 + rng.uniform(0.0, 0.02)
    force = np.zeros(len(time))
    begin = onset
    for _ in range(int(rng.integers(1, 4))):
        inside = (time >= begin) & (time <= begin + lasts)
        force += np.where(inside, peak * np.sin(np.pi * (time - begin) / lasts), 0.0)
        begin, peak = begin + lasts + rng.uniform(0.02, 0.6), peak * rng.uniform(0.2, 0.8)
    if rng.random() < 0.4:
        force += np.where(time >= onset, 0.2 * peak * (1.0 - np.exp(-(time - onset) / lasts)), 0.0)
    drift = 30.0 / 7.0 * time if rng.random() < 0.3 else 0.0
    sign = float(rng.choice([-1.0, 1.0]))
    return f"drawn, {rate:.0f} Hz", time, sign * (force + drift) + rng.normal(0.0, 1.0, len(time))


def damaged(rng: np.random.Generator, series: Series, about: Contact, kind: str) -> Series:
    """The log with holes of that kind, or single samples lost."""
    time = series.time
    lost = np.zeros(len(time), dtype=bool)
    if kind == "single samples":
        lost = rng.random(len(time)) < 0.02
        lost[1:] &= ~lost[:-1]
    else:
        for _ in range(int(rng.integers(1, 4))):
            length = float(np.exp(rng.uniform(np.log(1e-3), np.log(1.5))))
            begin = rng.uniform(about.start - 1.2 * length - 0.3, about.start + 0.4)
            lost |= (time >= begin) & (time < begin + length)
    if kind == "no rows":
        return Series(time[~lost], series.values[~lost], series.unit)
    values = series.values.copy()
    values[lost] = np.nan
    return Series(time, values, series.unit)


def recording(series: Series, clock: FloatArray) -> Recording:
    """A recording of the load cell beside a channel that has every sample."""
    return Recording("a", "a.csv", ("x",), {"force": series, "speed": Series(clock, np.zeros(len(clock)), "m/s")})


def is_wrong(found: Contact, true: Contact) -> bool:
    """Whether an onset is farther from the true one than it states."""
    slack = found.resolution + true.resolution
    return not found.start - found.uncertainty - slack <= true.start <= found.start + slack


def score(seed: int, contacts: int, faults: int) -> tuple[dict[str, Count], list[str]]:
    """The counts by kind of fault, and a line on everything that is wrong."""
    counts = {kind: Count() for kind in KINDS}
    wrong: list[str] = []
    for number in range(contacts):
        rng = np.random.default_rng([seed, number])
        item = cell(rng, number)
        clock = item.series.time
        whole = recording(item.series, clock)
        known = [contact for contact in find_contacts(whole, item.rule) if not contact.in_progress]
        if not known:
            continue
        true = known[0]
        verdict = _verdict(whole, known, 0, item.profile)
        for k in range(faults):
            kind = KINDS[k % len(KINDS)]
            count = counts[kind]
            part = recording(damaged(rng, item.series, true, kind), clock)
            _compare(count, wrong, item, part, true, verdict, f"seed {seed}, contact {number}, fault {k}, {item.name}")
    return counts, wrong


def _compare(
    count: Count, wrong: list[str], item: Cell, part: Recording, true: Contact, verdict: str, where: str
) -> None:
    contacts = [contact for contact in find_contacts(part, item.rule) if not contact.in_progress]
    near = [i for i, contact in enumerate(contacts) if contact.start <= true.end + 1e-9 and contact.end >= true.start]
    if not near:
        return
    found = contacts[near[0]]
    count.marked += found.hole > 0.0
    unknown = found.hole > 0.0 and found.uncertainty >= WINDOW
    if not unknown and is_wrong(found, true):
        wrong.append(f"{where}: onset {found.start:.4f} -{found.uncertainty:.4f}, right is {true.start:.4f}")
    told = _verdict(part, contacts, near[0], item.profile)
    count.passes += told == "pass"
    if told == "pass" and verdict != "pass":
        wrong.append(f"{where}: pass, of the whole log {verdict}")


def _verdict(part: Recording, contacts: Sequence[Contact], number: int, profile: ForceProfile) -> str:
    until = contacts[number + 1].start if number + 1 < len(contacts) else float("inf")
    return assess_force(force_time_curve(part, contacts[number], 0.0, until), profile).outcome
