"""From file names to operations: resolve globs, read and cut recordings, and report what was left out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import KW_ONLY, dataclass, replace
from pathlib import Path

from cdtool.dynamics import Machine
from cdtool.errors import CdtoolError, ConfigurationError, RecordingError, UsageError, nearest
from cdtool.evaluation.results import RecordingFinding, Skipped
from cdtool.evaluation.truth.force_vector import with_scalar_force
from cdtool.evaluation.truth.onset import OnsetRule
from cdtool.findings import Finding
from cdtool.findings.channels import AbsentTruth
from cdtool.ingest.reading import read_as_logged, read_recording
from cdtool.logged_recording import LoggedRecording
from cdtool.machine_file import MachineFile, read_machine_file
from cdtool.operations import Operation, operations_of
from cdtool.plausible import PlausibleRanges
from cdtool.recording import Contact, Recording
from cdtool.workflows.contacts.impact_free import contacts_shown, unchecked, without_contacts
from cdtool.workflows.log_checks.log_findings import log_warnings
from cdtool.workflows.workers import Progress, in_order


@dataclass(frozen=True)
class Runs:
    """The operations of some logs, what was left out, findings to report, and the plausible ranges of channels."""

    operations: tuple[Operation, ...]
    skipped: tuple[Skipped, ...]
    findings: tuple[RecordingFinding, ...]
    ranges: PlausibleRanges


def find_logs(patterns: Iterable[str], base: Path, key: str) -> list[Path]:
    """Return the files that the patterns name below `base`, each once, in order; ConfigurationError for no match."""
    found: dict[Path, None] = {}
    for pattern in patterns:
        path = base / pattern
        matches = [path] if path.is_file() else sorted(_glob(path))
        if not matches:
            raise ConfigurationError(f"{key}: no file matches '{pattern}' in {base}", "check the path")
        found.update(dict.fromkeys(matches))
    return list(found)


def read_log(log: str | Path, machine: str | Path | MachineFile, ranges: PlausibleRanges | None = None) -> Recording:
    """Read a log through a machine file.

    Parameters
    ----------
    log : str or Path
        The log, in any format of `cdtool list formats`, or a folder with its parts.
    machine : str, Path or MachineFile
        The machine file, or what `cdtool.machine_file.read_machine_file` returned.
    ranges : PlausibleRanges, optional
        Plausible ranges of the channels, in SI units: values outside are masked and reported as a loss.

    Returns
    -------
    Recording
        Every mapped channel on the load side in SI units, at its own times; a missing sample is NaN. A force with
        several columns has one column per axis.

    Raises
    ------
    CdtoolError
        The log or the machine file cannot be read, or no channel is mapped; the message names the file.

    Examples
    --------
    >>> import cdtool
    >>> recording = cdtool.read("sample_logs/gate/stiff/03.csv", "sample_logs/gate/machine.toml")
    >>> recording["speed"].values.shape, recording["speed"].unit
    ((7200, 1), 'm/s')
    """
    machine_file = machine if isinstance(machine, MachineFile) else read_machine_file(machine)
    return _with_channels(Path(log), read_recording(Path(log), machine_file, ranges))


def load_operations(
    path: Path,
    machine_file: MachineFile,
    how: str,
    base: Path | None = None,
    ranges: PlausibleRanges | None = None,
    onset: OnsetRule | None = None,
) -> tuple[Recording, list[Operation]]:
    """Return one log's recording, named by its path below `base`, and its operations; CdtoolError names the file.

    A force with several axes is a magnitude, their rest levels removed by the `onset` rule.
    """
    recording = read_named(path, machine_file, base, ranges, onset)
    return recording, operations_of(recording, how)


def read_named(
    path: Path,
    machine_file: MachineFile,
    base: Path | None = None,
    ranges: PlausibleRanges | None = None,
    onset: OnsetRule | None = None,
) -> Recording:
    """Return one log's recording, named by its path below `base`; CdtoolError names the file.

    A force with several axes is a magnitude, their rest levels removed by the `onset` rule.
    """
    recording = replace(read_log(path, machine_file, ranges), name=shown_path(path, base))
    return with_scalar_force(recording, onset or OnsetRule())


@dataclass(frozen=True)
class _AsLogged:
    """Reads a log through a machine file; one that cannot be read gives the error."""

    machine_file: MachineFile

    def __call__(self, path: Path) -> LoggedRecording | CdtoolError:
        try:
            logged = read_as_logged(path, self.machine_file)
            _with_channels(path, logged.recording)
        except CdtoolError as fault:
            return fault
        return logged


def _with_channels(path: Path, recording: Recording) -> Recording:
    if not recording.channels:
        raise RecordingError(f"{path}: no channel is mapped", "add [channels] to the machine file")
    return recording


# Returns the part of a log, given by its path and recording, that is learned from, and the contacts in it. Raises
# RecordingError if no part of it is usable.
PartOfLog = Callable[[Path, Recording], tuple[Recording, Sequence[Contact]]]


@dataclass(frozen=True)
class RunReading:
    """How impact-free logs are read: cut by `operations`, contacts refused by the `onset` rule, named below `base`.

    `part` returns the part of a log that is learned from and the contacts in it; None: the whole log. `jobs` logs are
    read in parallel; `progress` is called after each.
    """

    operations: str
    _: KW_ONLY
    onset: OnsetRule | None = None
    base: Path | None = None
    part: PartOfLog | None = None
    jobs: int = 1
    progress: Progress | None = None


def load_runs(
    paths: Sequence[Path], machine_file: MachineFile, reading: RunReading, ranges: PlausibleRanges | None = None
) -> Runs:
    """Return the operations of many impact-free logs; a log that cannot be read is left out and reported.

    Also left out: a log that is given twice or has the content of another one, and an operation in which the load cell
    shows a contact. Values that no sensor can measure are masked: those outside the plausible `ranges`, which are
    learned from all these logs if none are given.
    """
    rule, base, jobs = reading.onset or OnsetRule(), reading.base, reading.jobs
    paths, repeated = _each_once(paths)
    operations: list[Operation] = []
    skipped = [Skipped(shown_path(path, base), "given more than once, used once") for path in repeated]
    findings: list[RecordingFinding] = []
    by_bytes: dict[str, str] = {}
    without: list[tuple[str, Finding]] = []

    logged = list(in_order(_AsLogged(machine_file), paths, len(paths), jobs, reading.progress))
    known = ranges or PlausibleRanges.learned([item.recording for item in logged if isinstance(item, LoggedRecording)])
    for path, item in zip(paths, logged, strict=True):
        try:
            if isinstance(item, CdtoolError):
                raise item
            recording = item.on_load_side(machine_file.machine, known, to_learn=True)
            recording = with_scalar_force(replace(recording, name=shown_path(path, base)), rule)
            contacts: Sequence[Contact] | None = None
            if reading.part:
                recording, contacts = reading.part(path, recording)
            parts = operations_of(recording, reading.operations)
        except CdtoolError as fault:
            skipped.append(unread(path, base, fault))
            continue
        first = by_bytes.setdefault(recording.digest, recording.name) if recording.digest else recording.name
        if first != recording.name:
            skipped.append(Skipped(recording.name, f"has the same content as {first}: used once"))
            continue
        contacts = contacts_shown(recording, rule) if contacts is None else contacts
        free, touched = without_contacts(parts, contacts)
        operations.extend(free)
        skipped.extend(touched)
        findings.extend(lost(recording))
        findings.extend(log_warnings(recording, contacts, rule))
        without.extend((recording.name, item) for item in absent_truth(recording))
    return Runs(tuple(operations), tuple(skipped), (*findings, *unchecked(without)), known)


def _each_once(paths: Sequence[Path]) -> tuple[list[Path], list[Path]]:
    """Return the paths without repetitions, and the repetitions."""
    once: dict[Path, Path] = {}
    repeated: list[Path] = []
    for path in paths:
        if once.setdefault(path.resolve(), path) is not path:
            repeated.append(path)
    return list(once.values()), repeated


def unread(path: Path, base: Path | None, fault: CdtoolError) -> Skipped:
    """Return the entry of a log that could not be used; its reason does not repeat the name."""
    return Skipped(shown_path(path, base), str(fault).removeprefix(f"{path}: "))


def shown_path(path: Path, base: Path | None = None) -> str:
    """Return the name of a log in results: its path below `base`, else as given; with forward slashes everywhere."""
    if base is not None and path.is_relative_to(base):
        return path.relative_to(base).as_posix()
    return path.as_posix()


def check_joints(joints: Sequence[str], machine: Machine) -> None:
    """Raise UsageError for a joint that the machine does not have, before any log is read."""
    for joint in joints:
        if joint not in machine.joints:
            raise UsageError(f"unknown joint '{joint}'", nearest(joint, machine.joints))


def lost(recording: Recording) -> list[RecordingFinding]:
    """Return the losses in a recording that is used nevertheless."""
    return [RecordingFinding.of(recording.name, item) for item in recording.findings if item.severity == "loss"]


def absent_truth(recording: Recording) -> list[Finding]:
    """Return the notes about ground truth that the machine file maps but the log does not contain."""
    return [item for item in recording.findings if isinstance(item.fact, AbsentTruth) and item.channel not in recording]


def _glob(path: Path) -> Iterator[Path]:
    root = Path(path.anchor) if path.is_absolute() else Path()
    pattern = str(path.relative_to(root)) if path.is_absolute() else str(path)
    # As in a shell, a name that begins with a dot must be matched explicitly. Incomplete files have such names.
    written_out = set(path.parts)
    return (
        match
        for match in root.glob(pattern)
        if all(part in written_out for part in match.parts if part.startswith(".")) and match.is_file()
    )
