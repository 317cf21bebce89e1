"""`cdtool protocol check`: what is missing or contradictory in a protocol file, before anything is measured."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from cdtool.base.errors import CdtoolError
from cdtool.commands.protocol.assessment.assessment import check_point, judge
from cdtool.commands.protocol.assessment.reasons import ProtocolVerdict, Reason
from cdtool.commands.protocol.measuring import Assignment, assign, profiles_of
from cdtool.commands.protocol.protocol_file import ProtocolFile, read_protocol_file
from cdtool.commands.scoring.benchmark_file import BenchmarkFile, read_benchmark_file
from cdtool.recordings.recording import CONTACT_PRESSURE


@dataclass(frozen=True)
class CheckedProtocol:
    """A protocol file with what is incomplete; `recordings` is the number of each point by name.

    `has_detectors`: the benchmark file names detectors, or could not be read.
    """

    file: ProtocolFile
    verdict: ProtocolVerdict
    recordings: dict[str, int]
    has_detectors: bool = True


def check_protocol(path: str | Path) -> CheckedProtocol:
    """Check a protocol file without reading a recording.

    Parameters
    ----------
    path : str or Path
        The protocol file, or a benchmark file with a table [protocol].

    Returns
    -------
    CheckedProtocol
        Everything that would make the protocol incomplete: empty values, calibrations, sample rate, obstacles, missing
        recordings. What the recordings themselves show is known only after the test.

    Raises
    ------
    ConfigurationError
        The file is wrong, or its recordings cannot be assigned to points; the message names the key. A benchmark file
        that cannot be read yet, because nothing was recorded, is only reported.

    Examples
    --------
    >>> checked = check_protocol("sample_logs/gate/protocol.toml")
    >>> checked.verdict.outcome, checked.recordings
    ('pass', {'closing edge': 4, 'closing edge with bumper': 4})
    """
    file = read_protocol_file(path)
    more: list[Reason] = []
    setup: BenchmarkFile | None = None
    if file.benchmark is None:
        more.append(Reason("no_value", {"key": "protocol.benchmark", "file": file.path.name}))
    else:
        try:
            setup = read_benchmark_file(file.benchmark, learning=False, detectors=["all"])
            if setup.detectors:  # the next command scores them
                read_benchmark_file(file.benchmark)
        except CdtoolError as fault:
            more.append(Reason("benchmark_unreadable", {"message": str(fault)}, due="test_day"))
    assignment = assign(file, setup) if setup else Assignment((), {})
    if setup is None:
        points = [check_point(point, file.profile_of(point), 0) for point in file.plan.points]
    else:
        if not setup.machine_file.maps("force"):
            values = {"key": "channels.force", "file": setup.machine_file.path.name}
            more.append(Reason("no_value", values))
        logs_pressure = setup.machine_file.maps(CONTACT_PRESSURE)
        points = [
            check_point(item.point, profiles_of(item, file, setup), len(item.logs), logs_pressure=logs_pressure)
            for item in assignment.points
        ]
    verdict = judge(file.plan, points, file.path.name, [*more, *assignment.absent])
    recordings = {item.point.name: len(item.logs) for item in assignment.points}
    return CheckedProtocol(file, verdict, recordings, setup is None or bool(setup.detectors))
