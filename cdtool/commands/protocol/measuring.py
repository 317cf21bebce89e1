"""Assign recordings to the measuring points of a protocol, and measure the force of each repetition.

A point names its recordings by `logs`, as files on a disk are usually named after the point, or by a `group` of the
benchmark file. A contact is a repetition; a recording with several contacts holds several.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cdtool.base.errors import UsageError, nearest
from cdtool.base.settings import Place
from cdtool.commands.judging.matched_log import CutLog, force_curves
from cdtool.commands.judging.runs import absent_truth, find_logs, resolve_all
from cdtool.commands.protocol.assessment.assessment import PointAssessment, Repetition, Unmeasured, assess_point
from cdtool.commands.protocol.assessment.plan import MeasuringPoint
from cdtool.commands.protocol.assessment.pressure import EARLY, FIRST, pressure_record
from cdtool.commands.protocol.assessment.reasons import Reason
from cdtool.commands.protocol.assessment.speed import speed_before
from cdtool.commands.protocol.protocol_file import ProtocolFile
from cdtool.commands.scoring.benchmark_file import BenchmarkFile
from cdtool.commands.scoring.scoring import logs_to_score
from cdtool.recordings.recording import RIG_UNITS, Contact, Recording
from cdtool.results.results import Skipped
from cdtool.truth.force.curve import ForceTimeCurve
from cdtool.truth.force.limits import ForceProfile
from cdtool.truth.missing_samples import cell_samples

# A contact that is slower than this from zero to the level at rest [s] is no contact, but a drift of the cell.
_SLOWEST = 10.0
# A difference of three standard errors is no noise.
_BEYOND_DOUBT = 3.0
# The end of a record over which it shows where the reading returned to [s].
_LAST = 0.2
# Times of samples are equal within this [s].
_EXACT = 1e-9


@dataclass(frozen=True)
class PointLogs:
    """The recordings of a point, each with its group in the benchmark file."""

    point: MeasuringPoint
    logs: tuple[tuple[str, Path], ...]


@dataclass(frozen=True)
class Assignment:
    """Which recordings belong to which point, and which are excluded with their reasons.

    `absent`: patterns without a file, of an exclusion or of a point that has other recordings.
    """

    points: tuple[PointLogs, ...]
    excluded: Mapping[Path, str]
    absent: tuple[Reason, ...] = ()


def assign(file: ProtocolFile, setup: BenchmarkFile) -> Assignment:
    """Return the recordings of each point, without the excluded ones.

    Parameters
    ----------
    file : ProtocolFile
        The protocol file.
    setup : BenchmarkFile
        Its benchmark file, which scores all of these recordings.

    Returns
    -------
    Assignment
        The recordings of each point in order. A point without any, as before the test, has none.

    Raises
    ------
    ConfigurationError
        A group is unknown; a recording is in no group of impacts, or belongs to two points.

    Examples
    --------
    >>> from cdtool.commands.scoring.benchmark_file import read_benchmark_file
    >>> from cdtool.commands.protocol.protocol_file import read_protocol_file
    >>> setup = read_benchmark_file("sample_logs/gate/benchmark.toml")
    >>> assignment = assign(read_protocol_file("sample_logs/gate/protocol.toml"), setup)
    >>> [len(item.logs) for item in assignment.points]
    [4, 4]
    """
    scored = [(name, log) for name, group in setup.impacts.items() if not group.is_impact_free for log in group.logs]
    groups = dict(zip(resolve_all(log for _, log in scored), scored, strict=True))
    excluded: dict[Path, str] = {}
    absent: list[Reason] = []
    protocol = Place(str(file.path), "protocol.")
    for number, item in enumerate(file.plan.exclusions, 1):
        place = protocol.below(f"exclusion[{number}]")
        found, missing = _found(item.logs, file, place)
        absent += missing
        excluded |= {path: item.reason for _, path in _scored_logs(found, groups, place)}
    owner: dict[Path, int] = {}
    points = []
    for number, point in enumerate(file.plan.points, 1):
        place = protocol.below(f"point[{number}]")
        if point.group:
            logs = _of_group(point, setup, place)
        else:
            found, missing = _found(point.logs, file, place)
            absent += missing if found else []
            # Two patterns may name one file: it is one recording.
            logs = list(dict.fromkeys(_scored_logs(found, groups, place)))
        for _, log in logs:
            if owner.setdefault(log, number) != number:
                problem = f"{log} is also of the point {owner[log]}"
                protocol.note(f"point[{number}]", problem, "a recording belongs to one point")
        points.append(PointLogs(point, tuple((group, log) for group, log in logs if log not in excluded)))
    protocol.finish()
    return Assignment(tuple(points), excluded, tuple(absent))


def profiles_of(item: PointLogs, file: ProtocolFile, setup: BenchmarkFile) -> ForceProfile | None:
    """Return the force profile of a point: its own, else that of the group of its first recording or of its name."""
    names = [group for group, _ in item.logs] or ([item.point.group] if item.point.group in setup.impacts else [])
    return file.profile_of(item.point, setup.impacts[names[0]].force if names else None)


def _found(patterns: Sequence[str], file: ProtocolFile, place: Place) -> tuple[list[Path], list[Reason]]:
    """Return the files that patterns name, and the patterns without one; before the test there may be none."""
    found: list[Path] = []
    missing: list[Reason] = []
    for pattern in patterns:
        try:
            found += find_logs([pattern], file.path.parent, runs=True)
        except UsageError:
            values = {"entry": f"{place.prefix}logs", "pattern": pattern}
            missing.append(Reason("no_file", values, due="test_day"))
    return found, missing


def _scored_logs(logs: Sequence[Path], groups: Mapping[Path, tuple[str, Path]], place: Place) -> list[tuple[str, Path]]:
    """Return the group and the path of each log in the benchmark file."""
    for log in logs:
        if log.resolve() not in groups:
            problem = f"{log} is not in a group of [impacts] of the benchmark file"
            place.note("logs", problem, "add it to a group there")
    return [groups[log.resolve()] for log in logs if log.resolve() in groups]


def _of_group(point: MeasuringPoint, setup: BenchmarkFile, place: Place) -> list[tuple[str, Path]]:
    names = [name for name, group in setup.impacts.items() if not group.is_impact_free]
    if point.group not in names:
        place.note("group", f"no group '{point.group}' in {setup.path}", nearest(point.group, names))
        return []
    return [(point.group, log) for log in setup.impacts[point.group].logs]


def measured_point(
    item: PointLogs,
    file: ProtocolFile,
    setup: BenchmarkFile,
    late: Mapping[tuple[str, str, int], Mapping[str, tuple[float | None, float | None]]],
) -> PointAssessment:
    """Return a point with its repetitions; `late` are the latencies [ms] by group, recording and contact."""
    profile = profiles_of(item, file, setup)
    repetitions: list[Repetition] = []
    unmeasured: list[Unmeasured] = []
    contacts = 0
    for group, log in item.logs:
        for read in logs_to_score(setup, group, log):
            if isinstance(read, Skipped):
                unmeasured.append(Unmeasured(read.recording, "unreadable", read.reason))
                continue
            contacts += len(read.contacts)
            if profile is not None:
                mass = setup.rules_of(group).mass_before_cell
                of_log, others = _measured(read, profile, mass)
                repetitions += [
                    replace(one, latencies_ms=late.get((group, one.recording, one.contact), {})) for one in of_log
                ]
                unmeasured += others
    of_force, of_pressure = file.plan.force_instrument, file.plan.pressure_instrument
    return assess_point(item.point, profile, repetitions, unmeasured, of_force, of_pressure, contacts)


def _measured(read: CutLog, profile: ForceProfile, mass: float) -> tuple[list[Repetition], list[Unmeasured]]:
    """Return the contacts of a recording, and those that do not count."""
    recording: Recording = read.recording
    curves, problems = force_curves(recording, read.contacts, mass)
    # A loss of the machine's own channels concerns neither force nor pressure.
    others = set(recording.channels) - set(RIG_UNITS)
    losses = tuple(str(item) for item in recording.findings if item.severity == "loss" and item.channel not in others)
    repetitions = []
    for number, curve in curves.items():
        contact = read.contacts[number - 1]
        of_file = (recording.name, recording.digest)
        measured = Repetition.of(of_file, number, curve, profile, (contact.rest, contact.drift))
        since, until = _neighbours(read.contacts, number)
        repetitions.append(
            replace(
                measured,
                rest_error=_rest_error(recording, contact, curve),
                losses=losses,
                pressure=pressure_record(recording, contact, until, since),
                speed=speed_before(recording, contact),
            )
        )
    unmeasured = [Unmeasured(recording.name, "in_progress") for contact in read.contacts if contact.in_progress]
    unmeasured += [Unmeasured(recording.name, "no_force", str(problem)) for problem in problems]
    if "force" not in recording:
        why = next(map(str, absent_truth(recording)), "no load cell")
        unmeasured.append(Unmeasured(recording.name, "no_force", why))
    return repetitions, unmeasured


def _neighbours(contacts: Sequence[Contact], number: int) -> tuple[float, float]:
    """Return the end of the contact before the one of a number, and the start of the next one [s]."""
    since = contacts[number - 2].end if number > 1 else -np.inf
    return since, contacts[number].start if number < len(contacts) else np.inf


def _rest_error(recording: Recording, contact: Contact, curve: ForceTimeCurve) -> float:
    """Return by how much the rest before a contact may be wrong [N], because the record begins during a slow rise.

    Of a record that begins shortly before the contact that is the difference to the first readings; of one that ends
    below the level at rest, to the last ones. Where the reading rises from the beginning on, fast enough to have begun
    at zero a few seconds ago, all of it may be a force.
    """
    rest = contact.rest
    if not np.isfinite(rest):
        return 0.0
    samples = cell_samples(recording["force"])
    begin = float(samples.time[0])
    first = samples.force[samples.time <= begin + FIRST]
    moved, length = rest - float(np.mean(first)), contact.start - begin
    is_early = length <= EARLY
    is_moving = is_early and abs(moved) > _BEYOND_DOUBT * float(np.std(first)) / np.sqrt(len(first))
    slope = moved / length if is_moving and length > 0.0 else contact.drift
    at_peak = samples.force[np.searchsorted(samples.time, contact.start + curve.time[np.argmax(curve.force)] - _EXACT)]
    rises_with_contact = slope * rest > 0.0 and (at_peak - rest) * rest > 0.0
    if rises_with_contact and rest / slope <= _SLOWEST:
        return abs(rest)
    return max(abs(moved) if is_early else 0.0, _below_rest(curve))


def _below_rest(curve: ForceTimeCurve) -> float:
    """Return how far the reading is below the level at rest in the end [N]: nothing pulls, so that was a force."""
    last = curve.force[curve.time >= curve.time[-1] - _LAST]
    below = -float(np.median(last))
    return below if below > _BEYOND_DOUBT * float(np.std(last)) else 0.0
