"""From file names to operations: globs, reading many recordings, cutting them, naming what was left out."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import KW_ONLY, dataclass, replace
from pathlib import Path
from typing import TypeVar

from cdtool.dynamics import Machine
from cdtool.errors import CdtoolError, ConfigurationError, RecordingError, UsageError, nearest
from cdtool.evaluation.results import RecordingFinding, Skipped
from cdtool.evaluation.truth.onset import OnsetRule
from cdtool.findings import Finding
from cdtool.findings.channels import AbsentTruth
from cdtool.ingest.reading import read_as_logged, read_recording
from cdtool.logged_recording import LoggedRecording
from cdtool.machine_file import MachineFile, read_machine_file
from cdtool.operations import Operation, operations_of
from cdtool.plausible import PlausibleRanges
from cdtool.recording import Recording
from cdtool.workflows.contacts.impact_free import contacts_shown, unchecked, without_contacts
from cdtool.workflows.log_checks.log_findings import log_warnings

Item = TypeVar("Item")
Made = TypeVar("Made")
# Called after each piece of work with what is done and how much there is.
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Runs:
    """The operations of some logs, what was left out, findings worth telling, and the plausible ranges of channels."""

    operations: tuple[Operation, ...]
    skipped: tuple[Skipped, ...]
    findings: tuple[RecordingFinding, ...]
    ranges: PlausibleRanges


def find_logs(patterns: Iterable[str], base: Path, key: str) -> list[Path]:
    """Files that the patterns name below `base`, each once and in order; raises ConfigurationError for no match."""
    found: dict[Path, None] = {}
    for pattern in patterns:
        path = base / pattern
        matches = [path] if path.is_file() else sorted(_glob(path))
        if not matches:
            raise ConfigurationError(f"{key}: nothing matches '{pattern}' in {base}", "check the path")
        found.update(dict.fromkeys(matches))
    return list(found)


def in_order(
    work: Callable[[Item], Made], items: Sequence[Item], jobs: int, progress: Progress | None
) -> Iterator[Made]:
    """`work` of each item, in order whatever `jobs` is; kernels and parsers run without the interpreter lock."""
    if jobs <= 1:
        for i, item in enumerate(items, 1):
            yield work(item)
            if progress:
                progress(i, len(items))
        return
    with ThreadPoolExecutor(jobs) as pool, _cancelling(pool):
        # No more than that many are on their way: what was made waits for whoever takes it, and needs memory.
        ahead = deque(pool.submit(work, item) for item in items[: 2 * jobs])
        for i in range(1, len(items) + 1):
            made = ahead.popleft().result()
            if i + 2 * jobs <= len(items):
                ahead.append(pool.submit(work, items[i + 2 * jobs - 1]))
            yield made
            if progress:
                progress(i, len(items))


@contextmanager
def _cancelling(pool: ThreadPoolExecutor) -> Iterator[None]:
    """Where the block ends early, work that was not begun is not waited for."""
    try:
        yield
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        raise


def read_log(log: str | Path, machine: str | Path | MachineFile, ranges: PlausibleRanges | None = None) -> Recording:
    """A recording on the load side, through a machine file; raises CdtoolError, naming the file.

    Values outside of the plausible `ranges` are masked, and a loss.
    """
    machine_file = machine if isinstance(machine, MachineFile) else read_machine_file(machine)
    return _with_channels(Path(log), read_recording(Path(log), machine_file, ranges))


def load_operations(
    path: Path,
    machine_file: MachineFile,
    how: str,
    base: Path | None = None,
    ranges: PlausibleRanges | None = None,
) -> tuple[Recording, list[Operation]]:
    """One log's recording, named by its path below `base`, and its operations; raises CdtoolError, naming the file."""
    recording = replace(read_log(path, machine_file, ranges), name=shown_path(path, base))
    return recording, operations_of(recording, how)


def _as_logged(path: Path, machine_file: MachineFile) -> LoggedRecording:
    logged = read_as_logged(path, machine_file)
    _with_channels(path, logged.recording)
    return logged


def _with_channels(path: Path, recording: Recording) -> Recording:
    if not recording.channels:
        raise RecordingError(f"{path}: no channel is mapped", "write [channels] in the machine file")
    return recording


@dataclass(frozen=True)
class RunReading:
    """How impact-free logs are read: cut by `operations`, without contacts by the `onset` rule, named below `base`.

    `jobs` logs are read at once; `progress` is called after each.
    """

    operations: str
    _: KW_ONLY
    onset: OnsetRule | None = None
    base: Path | None = None
    jobs: int = 1
    progress: Progress | None = None


def load_runs(
    paths: Sequence[Path], machine_file: MachineFile, reading: RunReading, ranges: PlausibleRanges | None = None
) -> Runs:
    """Return the operations of many impact-free logs; one that cannot be read is left out and named, the others go on.

    So is a log that is given twice or holds the bytes of another one, and an operation in which the load cell shows
    a contact. Values that no sensor gives are masked: those outside of the plausible `ranges`,
    which are learned from all these logs where none are given.
    """
    rule, base, jobs = reading.onset or OnsetRule(), reading.base, reading.jobs
    paths, repeated = _each_once(paths)
    operations: list[Operation] = []
    skipped = [Skipped(shown_path(path, base), "given more than once: counts once") for path in repeated]
    findings: list[RecordingFinding] = []
    by_bytes: dict[str, str] = {}
    without: list[tuple[str, Finding]] = []

    def read(path: Path) -> LoggedRecording | CdtoolError:
        try:
            return _as_logged(path, machine_file)
        except CdtoolError as fault:
            return fault

    def cut(item: tuple[Path, LoggedRecording | CdtoolError]) -> tuple[Recording, list[Operation]] | CdtoolError:
        path, logged = item
        if isinstance(logged, CdtoolError):
            return logged
        try:
            recording = logged.on_load_side(machine_file.machine, known, to_learn=True)
            recording = replace(recording, name=shown_path(path, base))
            return recording, operations_of(recording, reading.operations)
        except CdtoolError as fault:
            return fault

    logged = list(zip(paths, in_order(read, paths, jobs, reading.progress), strict=True))
    known = ranges or PlausibleRanges.learned([it.recording for _, it in logged if isinstance(it, LoggedRecording)])
    for path, loaded in zip(paths, in_order(cut, logged, jobs, None), strict=True):
        if isinstance(loaded, CdtoolError):
            skipped.append(unread(path, base, loaded))
            continue
        recording, parts = loaded
        first = by_bytes.setdefault(recording.digest, recording.name) if recording.digest else recording.name
        if first != recording.name:
            skipped.append(Skipped(recording.name, f"holds the same bytes as {first}: counts once"))
            continue
        contacts = contacts_shown(recording, rule)
        free, touched = without_contacts(parts, contacts)
        operations.extend(free)
        skipped.extend(touched)
        findings.extend(lost(recording))
        findings.extend(log_warnings(recording, contacts, rule))
        without.extend((recording.name, item) for item in absent_truth(recording))
    return Runs(tuple(operations), tuple(skipped), (*findings, *unchecked(without)), known)


def _each_once(paths: Sequence[Path]) -> tuple[list[Path], list[Path]]:
    """Return the paths without those that name a file again, and these."""
    once: dict[Path, Path] = {}
    repeated: list[Path] = []
    for path in paths:
        if once.setdefault(path.resolve(), path) is not path:
            repeated.append(path)
    return list(once.values()), repeated


def unread(path: Path, base: Path | None, fault: CdtoolError) -> Skipped:
    """A log that could not be used, named as results name it; its reason does not name it again."""
    return Skipped(shown_path(path, base), str(fault).removeprefix(f"{path}: "))


def shown_path(path: Path, base: Path | None = None) -> str:
    """How results name a log: its path below `base`, else as given; with forward slashes on every system."""
    if base is not None and path.is_relative_to(base):
        return path.relative_to(base).as_posix()
    return path.as_posix()


def check_joints(joints: Sequence[str], machine: Machine) -> None:
    """Raise UsageError, before anything is read, where one of the joints to watch is not the machine's."""
    for joint in joints:
        if joint not in machine.joints:
            raise UsageError(f"unknown joint '{joint}'", nearest(joint, machine.joints))


def lost(recording: Recording) -> list[RecordingFinding]:
    """What could not be read of a recording that is used nevertheless."""
    return [RecordingFinding.of(recording.name, item) for item in recording.findings if item.severity == "loss"]


def absent_truth(recording: Recording) -> list[Finding]:
    """The notes about ground truth that the machine file maps and the log does not hold."""
    return [item for item in recording.findings if isinstance(item.fact, AbsentTruth) and item.channel not in recording]


def _glob(path: Path) -> Iterator[Path]:
    root = Path(path.anchor) if path.is_absolute() else Path()
    pattern = str(path.relative_to(root)) if path.is_absolute() else str(path)
    # As in a shell: a name that begins with a dot is matched only where it is written out. Files that are not whole
    # yet have such names.
    written_out = set(path.parts)
    return (
        match
        for match in root.glob(pattern)
        if all(part in written_out for part in match.parts if part.startswith(".")) and match.is_file()
    )
