"""Assign recordings to the measuring points of a protocol, and measure the force of each repetition.

A point names its recordings by `logs`, as files on a disk are usually named after the point, or by a `group` of the
benchmark file. A contact is a repetition; a recording with several contacts holds several.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from cdtool.errors import ConfigurationError, nearest
from cdtool.evaluation.force.limits import ForceProfile
from cdtool.evaluation.protocol.assessment import PointAssessment, Repetition, Unmeasured, assess_point, judge
from cdtool.evaluation.protocol.plan import MeasuringPoint
from cdtool.evaluation.protocol.protocol import ExcludedRecording, FileDigest, Protocol
from cdtool.evaluation.results import Results, Skipped
from cdtool.recording import Recording
from cdtool.version import __version__
from cdtool.workflows.benchmark.benchmark import Benchmark, benchmark
from cdtool.workflows.benchmark.benchmark_file import BenchmarkFile, read_benchmark_file
from cdtool.workflows.benchmark.scoring import LogToScore, logs_to_score
from cdtool.workflows.contacts.matched_log import force_curves
from cdtool.workflows.protocol.protocol_file import ProtocolFile, digest_of_file, read_protocol_file
from cdtool.workflows.runs import find_logs, resolve_all, shown_path


@dataclass(frozen=True)
class PointLogs:
    """The recordings of a point, each with its group in the benchmark file."""

    point: MeasuringPoint
    logs: tuple[tuple[str, Path], ...]


@dataclass(frozen=True)
class Assignment:
    """Which recordings belong to which point, and which are excluded with their reasons."""

    points: tuple[PointLogs, ...]
    excluded: Mapping[Path, str]


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
        The recordings of each point in order. A pattern without a file, as before the test, is left out.

    Raises
    ------
    ConfigurationError
        A group is unknown; a recording is in no group of impacts, or belongs to two points.

    Examples
    --------
    >>> from cdtool.workflows.protocol.protocol_file import read_protocol_file
    >>> setup = read_benchmark_file("sample_logs/gate/benchmark.toml")
    >>> assignment = assign(read_protocol_file("sample_logs/gate/protocol.toml"), setup)
    >>> [len(item.logs) for item in assignment.points]
    [4, 4]
    """
    scored = [(name, log) for name, group in setup.impacts.items() if not group.is_impact_free for log in group.logs]
    groups = dict(zip(resolve_all(log for _, log in scored), scored, strict=True))
    excluded: dict[Path, str] = {}
    for number, item in enumerate(file.plan.exclusions, 1):
        for log in _found(item.logs, file, f"exclusion[{number}]"):
            excluded[_scored_log(log, groups, file, f"exclusion[{number}]")[1]] = item.reason
    owner: dict[Path, int] = {}
    points = []
    for number, point in enumerate(file.plan.points, 1):
        key = f"point[{number}]"
        if point.group:
            logs = _of_group(point, setup, f"{file.path}: protocol.{key}.group")
        else:
            logs = [_scored_log(log, groups, file, key) for log in _found(point.logs, file, key)]
        for _, log in logs:
            if owner.setdefault(log, number) != number:
                raise ConfigurationError(
                    f"{file.path}: protocol.{key}: {log} is also of the point {owner[log]}",
                    "a recording belongs to one point",
                )
        points.append(PointLogs(point, tuple((group, log) for group, log in logs if log not in excluded)))
    return Assignment(tuple(points), excluded)


def protocol(file: str | Path, *, detectors: Sequence[str] = (), jobs: int = 1) -> Protocol:
    """Run the benchmark of a protocol file and return its protocol.

    Parameters
    ----------
    file : str or Path
        The protocol file, or a benchmark file with a table [protocol].
    detectors : sequence of str, optional
        Detectors in place of the benchmark's.
    jobs : int, optional
        Number of logs processed at a time.

    Returns
    -------
    Protocol
        Points, repetitions, verdict and provenance.

    Raises
    ------
    ConfigurationError
        A file is wrong; the message names file and key.
    CdtoolError
        The benchmark cannot be run, see `cdtool.benchmark`.

    Examples
    --------
    >>> import cdtool
    >>> made = cdtool.protocol("sample_logs/gate/protocol.toml", detectors=["momentum"])
    >>> made.verdict.outcome, [point.outcome for point in made.points]
    ('fail', ['fail', 'fail'])
    """
    read = read_protocol_file(file)
    if read.benchmark is None:
        raise ConfigurationError(f"{read.path}: protocol.benchmark: is missing", "name the benchmark file")
    return make_protocol(read, benchmark(read.benchmark, detectors=detectors, jobs=jobs), f"cdtool.protocol({file})")


def make_protocol(file: ProtocolFile, done: Benchmark, command: str = "") -> Protocol:
    """Return the protocol of a finished benchmark: its recordings are read again for the whole force-time curves.

    Parameters
    ----------
    file : ProtocolFile
        The protocol file.
    done : Benchmark
        The finished benchmark, for the latencies and the digests.
    command : str, optional
        The command that makes it, for its provenance.

    Returns
    -------
    Protocol
        Points, repetitions, verdict and provenance.

    Raises
    ------
    ConfigurationError
        The recordings cannot be assigned to the points, see `assign`; or the file names another benchmark.

    Examples
    --------
    `protocol` runs the benchmark of a protocol file and returns its protocol.
    """
    setup = read_benchmark_file(done.inputs[0], detectors=done.results.detectors)
    if file.benchmark and file.benchmark.resolve() != setup.path.resolve():
        raise ConfigurationError(
            f"{file.path}: protocol.benchmark: is {file.benchmark}, the command has {setup.path}", "use the same file"
        )
    assignment = assign(file, setup)
    late = _latencies(done.results)
    points = tuple(_assessed(item, file, setup, late) for item in assignment.points)
    excluded = tuple(
        ExcludedRecording(shown_path(log, setup.path.parent), reason) for log, reason in assignment.excluded.items()
    )
    verdict = judge(file.plan, points, file.path.name)
    files = _digests(file, setup, done.results, points, {item.recording for item in excluded})
    return Protocol(file.plan, points, verdict, files, excluded, done.results.detectors, __version__, command)


def profiles_of(item: PointLogs, file: ProtocolFile, setup: BenchmarkFile) -> ForceProfile | None:
    """Return the force profile of a point: its own, else that of the group of its first recording or of its name."""
    names = [group for group, _ in item.logs] or ([item.point.group] if item.point.group in setup.impacts else [])
    return file.profile_of(item.point, setup.impacts[names[0]].force if names else None)


def _found(patterns: Sequence[str], file: ProtocolFile, key: str) -> Iterator[Path]:
    """Yield the files that patterns name; before the test there may be none."""
    for pattern in patterns:
        try:
            yield from find_logs([pattern], file.path.parent, f"{file.path}: protocol.{key}.logs", runs=True)
        except ConfigurationError:
            continue


def _scored_log(log: Path, groups: Mapping[Path, tuple[str, Path]], file: ProtocolFile, key: str) -> tuple[str, Path]:
    """Return the group and the path of a log in the benchmark file."""
    known = groups.get(log.resolve())
    if known is None:
        raise ConfigurationError(
            f"{file.path}: protocol.{key}.logs: {log} is not in a group of [impacts] of the benchmark file",
            "add it to a group there",
        )
    return known


def _of_group(point: MeasuringPoint, setup: BenchmarkFile, key: str) -> list[tuple[str, Path]]:
    names = [name for name, group in setup.impacts.items() if not group.is_impact_free]
    if point.group not in names:
        raise ConfigurationError(f"{key}: no group '{point.group}' in {setup.path}", nearest(point.group, names))
    return [(point.group, log) for log in setup.impacts[point.group].logs]


def _assessed(
    item: PointLogs,
    file: ProtocolFile,
    setup: BenchmarkFile,
    late: Mapping[tuple[str, str, int], Mapping[str, float | None]],
) -> PointAssessment:
    profile = profiles_of(item, file, setup)
    repetitions: list[Repetition] = []
    unmeasured: list[Unmeasured] = []
    for group, log in item.logs:
        for read in logs_to_score(setup, group, log):
            if isinstance(read, Skipped):
                unmeasured.append(Unmeasured(read.recording, "unreadable", read.reason))
            elif profile is not None:
                mass = setup.rules_of(group).mass_before_cell
                of_log, others = _measured(read, profile, mass)
                repetitions += [
                    replace(one, latencies_ms=late.get((group, one.recording, one.contact), {})) for one in of_log
                ]
                unmeasured += others
    return assess_point(item.point, profile, repetitions, unmeasured, file.plan.force_instrument)


def _measured(read: LogToScore, profile: ForceProfile, mass: float) -> tuple[list[Repetition], list[Unmeasured]]:
    """Return the contacts of a recording, and those that do not count."""
    recording: Recording = read.recording
    curves, problems = force_curves(recording, read.contacts, mass)
    repetitions = [
        Repetition.of(
            (recording.name, recording.digest),
            number,
            curve,
            profile,
            (read.contacts[number - 1].rest, read.contacts[number - 1].drift),
        )
        for number, curve in curves.items()
    ]
    unmeasured = [Unmeasured(recording.name, "in_progress") for contact in read.contacts if contact.in_progress]
    unmeasured += [Unmeasured(recording.name, "no_force", str(problem)) for problem in problems]
    if "force" not in recording:
        unmeasured.append(Unmeasured(recording.name, "no_force", "no load cell"))
    return repetitions, unmeasured


def _latencies(results: Results) -> dict[tuple[str, str, int], dict[str, float | None]]:
    """Return the latency of each detector [ms] by group, recording and contact."""
    found: dict[tuple[str, str, int], dict[str, float | None]] = {}
    for row in results.contacts:
        found.setdefault((row.group, row.recording, row.contact), {})[row.detector] = row.latency_ms
    return found


def _digests(
    file: ProtocolFile,
    setup: BenchmarkFile,
    results: Results,
    points: Sequence[PointAssessment],
    excluded: set[str],
) -> tuple[FileDigest, ...]:
    """Return every file of which the protocol was made, and every recording, with its SHA-256; names are relative."""
    base = setup.path.parent
    files = (
        []
        if file.path.resolve() == setup.path.resolve()
        else [FileDigest(shown_path(file.path, base), digest_of_file(file.path), "protocol")]
    )
    files.append(FileDigest(shown_path(setup.path, base), setup.digest, "benchmark"))
    machine = setup.machine_file.path
    files.append(FileDigest(shown_path(machine, base), digest_of_file(machine), "machine"))
    if file.limits is not None:
        files.append(FileDigest(shown_path(file.limits, base), digest_of_file(file.limits), "limits"))
    measured = {item.recording for point in points for item in point.repetitions}
    for row in results.recordings:
        role = "excluded" if row.recording in excluded else "measured" if row.recording in measured else "scored"
        files.append(FileDigest(row.recording, row.sha256, role))  # type: ignore[arg-type]  # one of the roles
    learned = results.provenance.get("learned_sha256", {})
    files += [FileDigest(name, digest, "learned") for name, digest in learned.items()]
    return tuple(files)
