"""Make a test protocol: of a finished benchmark with the latencies of its detectors, or of the recordings alone."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from cdtool.base.errors import ConfigurationError
from cdtool.base.files.bounded_loading import read_toml
from cdtool.base.remote.remote_path import joined, location, relative_name
from cdtool.base.version import __version__
from cdtool.commands.judging.runs import shown_path
from cdtool.commands.protocol.assessment.assessment import PointAssessment, judge
from cdtool.commands.protocol.assessment.protocol import ExcludedRecording, FileDigest, Protocol, Role
from cdtool.commands.protocol.measuring import Assignment, assign, measured_point
from cdtool.commands.protocol.protocol_file import ProtocolFile, digest_of_file, read_protocol_file
from cdtool.commands.scoring.benchmark_file import BenchmarkFile, read_benchmark_file
from cdtool.commands.scoring.benchmark_result import BenchmarkResult
from cdtool.formats.channels.run_reading import split_run
from cdtool.results.results import Results


def protocol(file: str | Path, *, command: str = "") -> Protocol:
    """Measure the recordings of a protocol file and return their protocol, without running a detector.

    Parameters
    ----------
    file : str or Path
        The protocol file, or a benchmark file with a table [protocol].
    command : str, optional
        The command that makes it, for its provenance.

    Returns
    -------
    Protocol
        Points, repetitions, verdict and provenance; without latencies.

    Raises
    ------
    ConfigurationError
        A file is wrong; the message names file and key.

    Examples
    --------
    >>> import cdtool
    >>> made = cdtool.protocol("sample_logs/gate/protocol.toml")
    >>> made.verdict.outcome, [point.outcome for point in made.points]
    ('fail', ['fail', 'fail'])
    """
    read = read_protocol_file(file)
    if read.benchmark is None:
        raise ConfigurationError(f"{read.path}: protocol.benchmark: is missing", "name the benchmark file")
    setup = read_benchmark_file(read.benchmark, learning=False, detectors=["all"])
    return _made(read, setup, None, command or f"cdtool.protocol({str(file)!r})")


def make_protocol(file: ProtocolFile, done: BenchmarkResult, command: str = "") -> Protocol:
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
    `cdtool benchmark -p` writes it.
    """
    setup = read_benchmark_file(
        done.inputs[0], detectors=done.results.detectors, settings=done.results.provenance.get("settings")
    )
    if file.benchmark and file.benchmark.resolve() != setup.path.resolve():
        raise ConfigurationError(
            f"{file.path}: protocol.benchmark: is {file.benchmark}, the command has {setup.path}", "use the same file"
        )
    return _made(file, setup, done.results, command)


def _made(file: ProtocolFile, setup: BenchmarkFile, results: Results | None, command: str) -> Protocol:
    """Measure and judge the points; without results there are no latencies."""
    assignment = assign(file, setup)
    late = _latencies(results) if results else {}
    points = tuple(measured_point(item, file, setup, late) for item in assignment.points)
    base = setup.path.parent
    excluded = tuple(ExcludedRecording(shown_path(log, base), reason) for log, reason in assignment.excluded.items())
    verdict = judge(file.plan, points, file.path.name, assignment.absent)
    files = (*_files(file, setup), *_recordings(assignment, points, setup, results))
    detectors = results.detectors if results else ()
    shown = command.replace(f"{base.absolute()}/", "")  # as the names of the files, relative to the benchmark file
    return Protocol(file.plan, points, verdict, files, excluded, detectors, __version__, shown)


def _latencies(results: Results) -> dict[tuple[str, str, int], dict[str, tuple[float | None, float | None]]]:
    """Return the latency of each detector, and how fine it is [ms], by group, recording and contact."""
    found: dict[tuple[str, str, int], dict[str, tuple[float | None, float | None]]] = {}
    for row in results.contacts:
        found.setdefault((row.group, row.recording, row.contact), {})[row.detector] = row.latency_ms, row.resolution_ms
    return found


def _files(file: ProtocolFile, setup: BenchmarkFile) -> list[FileDigest]:
    """Return the files that a person wrote, with their SHA-256; names are relative to the benchmark file."""
    paths: list[tuple[Path | None, Role]] = [
        (file.path, "protocol"),
        (setup.path, "benchmark"),
        (setup.machine_file.path, "machine"),
        (_robot_model(setup.machine_file.path), "robot"),
        (file.limits, "limits"),
        (setup.force_limits, "limits"),
        (location(setup.labels.source) if setup.labels else None, "labels"),
    ]
    # A table [protocol] of the benchmark file is in no file of its own, and both tables may name one file of limits.
    roles = {path.resolve(): (path, role) for path, role in paths if path is not None}
    base = setup.path.parent
    return [FileDigest(relative_name(path, base), digest_of_file(path), role) for path, role in roles.values()]


def _robot_model(machine_file: Path) -> Path | None:
    """Return the URDF that a machine file names, or None."""
    name = read_toml(machine_file, "a machine file")["machine"].get("urdf")
    return joined(machine_file.parent, name) if isinstance(name, str) else None


def _recordings(
    assignment: Assignment, points: Sequence[PointAssessment], setup: BenchmarkFile, results: Results | None
) -> list[FileDigest]:
    """Return every recording with its SHA-256: those of the points, the excluded ones, then those of the benchmark."""
    known = {item.recording: item.sha256 for point in points for item in point.repetitions}
    found: dict[str, FileDigest] = {name: FileDigest(name, digest, "measured") for name, digest in known.items()}
    for log in [log for item in assignment.points for _, log in item.logs]:
        _add_unread(found, log, setup, "measured")
    for log in assignment.excluded:
        _add_unread(found, log, setup, "excluded")
    for row in results.recordings if results else ():
        found.setdefault(row.recording, FileDigest(row.recording, row.sha256, "scored"))
    provenance: Mapping[str, Mapping[str, str]] = results.provenance if results else {}
    others: tuple[tuple[str, Role], ...] = (("load_cell_sha256", "measured"), ("learned_sha256", "learned"))
    for key, role in others:
        for name, digest in provenance.get(key, {}).items():
            found.setdefault(name, FileDigest(name, digest, role))
    return list(found.values())


def _add_unread(found: dict[str, FileDigest], log: Path, setup: BenchmarkFile, role: Role) -> None:
    """Add a log of which no contact was measured, unless it is known, and the files that belong to a log.

    A file that cannot be opened has no digest.
    """
    file = split_run(log)[0]
    for path in (file, *setup.machine_file.files_beside(file)):
        name = shown_path(path, setup.path.parent)
        if any(known.partition("#")[0] == name for known in found):
            continue
        with suppress(OSError), path.open("rb") as opened:
            found[name] = FileDigest(name, hashlib.file_digest(opened, "sha256").hexdigest(), role)
