"""From file names to operations: resolve globs, read and cut recordings, and report what was left out."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import partial
from glob import escape
from os import PathLike
from pathlib import Path

from cdtool.base.errors import CdtoolError, RecordingError, UsageError, is_lasting
from cdtool.base.findings import Finding
from cdtool.base.remote.remote_path import is_remote, joined, location
from cdtool.commands.judging.impact_free import contacts_shown, unchecked, without_contacts
from cdtool.commands.judging.log_findings import before_contact, log_warnings
from cdtool.execution.workers import Workers, in_order
from cdtool.formats.channels.channel_assembly import LoggedRecording
from cdtool.formats.channels.reading import is_bag_folder, read_as_logged, read_recording
from cdtool.formats.channels.run_reading import LogRuns, read_runs, split_run
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.machines.dynamics import Machine
from cdtool.machines.plausibility import check_channels
from cdtool.recordings.operations import Operation, RunCut, operations_of
from cdtool.recordings.plausible import LearnedRanges, PlausibleRanges
from cdtool.recordings.recording import SHOWS_CONTACTS, Contact, Recording
from cdtool.results.results import RecordingFinding, Skipped
from cdtool.truth.force_vector import with_scalar_force
from cdtool.truth.onset import OnsetRule

# Folders of which every worker of a cluster must see a log, before it reads others.
_FOLDERS = 50
# Without these nothing is learned from a run: its motion and its load.
_LEARNED_FROM = ("torque", "speed", "position")


@dataclass(frozen=True)
class Runs:
    """The operations of some logs, what was left out, findings to report, and the plausible ranges of channels.

    `ranges` are those of what is learned from: of a part of a log, that part. `lasts`: the same logs would give the
    same again, none was left out for a reason such as a network.
    """

    operations: tuple[Operation, ...]
    skipped: tuple[Skipped, ...]
    findings: tuple[RecordingFinding, ...]
    ranges: LearnedRanges
    lasts: bool = True


def find_logs(patterns: Iterable[str], base: Path, *, runs: bool = False) -> list[Path]:
    """Return the logs that the patterns name below `base`, each once, in order; UsageError for none.

    A log is a file, or a folder that rosbag2 wrote.

    With `runs`, a pattern may name runs of a log, as cycles.csv#7 or cycles.csv#free*.
    """
    found: dict[Path, None] = {}
    for pattern in patterns:
        matches = matching_logs(base, pattern)
        of_runs = [] if matches else _runs_matching(pattern, base)
        if not matches and not (runs and of_runs):
            hint = 'to name runs of a file, set operations = "column:NAME"' if of_runs else "check the path"
            raise UsageError(f"no file matches '{pattern}' in {base}", hint)
        found.update(dict.fromkeys(matches or of_runs))
    if not found:
        raise UsageError("is empty", "name at least one log")
    return list(found)


def matching_logs(base: Path, pattern: str) -> list[Path]:
    """Return the log of that name below `base`, or those that match the pattern; the name of `base` is no pattern."""
    path = joined(base, pattern)
    if path.is_file() or is_bag_folder(path):
        return [path]
    return sorted(_glob(path if is_remote(path) else joined(Path(escape(str(base))), pattern)))


def _runs_matching(pattern: str, base: Path) -> list[Path]:
    """Return FILE#IDS for each file that the part before a # names; a file name may contain the mark, too."""
    for place in (i for i, character in enumerate(pattern) if character == "#"):
        if files := matching_logs(base, pattern[:place]):
            return [location(f"{file}{pattern[place:]}") for file in files]
    return []


def read(
    log: str | Path, machine: str | Path | MachineFile | None = None, ranges: PlausibleRanges | None = None
) -> Recording:
    """Read a log through a machine file.

    Parameters
    ----------
    log : str or Path
        The log, in any format of `cdtool list formats`, or a folder with its parts.
    machine : str, Path or MachineFile
        The machine file, or what `cdtool.read_machine_file` returned. It is needed: it states which column is which
        channel, and in which unit.
    ranges : PlausibleRanges, optional
        Plausible ranges of the channels, in SI units: values outside are masked and reported as a loss.

    Returns
    -------
    Recording
        Every mapped channel on the load side in SI units, at its own times; a missing sample is NaN. A force with
        several columns has one column per axis.

    Raises
    ------
    UsageError
        No machine file is given.
    CdtoolError
        The log or the machine file cannot be read, or no channel is mapped; the message names the file.

    Examples
    --------
    >>> import cdtool
    >>> recording = cdtool.read("sample_logs/gate/stiff/03.csv", "sample_logs/gate/machine.toml")
    >>> recording["speed"].values.shape, recording["speed"].unit
    ((7200, 1), 'm/s')
    """
    if machine is None:
        name = location(log).name
        raise UsageError(
            f"cdtool.read('{name}') needs a machine file: it states which column is which channel, and the units",
            f"cdtool.read('{name}', 'machine.toml'); cdtool.init('{name}', 'machine.toml') drafts one",
        )
    machine_file = machine if isinstance(machine, MachineFile) else read_machine_file(machine)
    return _with_channels(location(log), read_recording(location(log), machine_file, ranges))


def read_named(
    path: Path,
    machine_file: MachineFile,
    base: Path | None = None,
    ranges: PlausibleRanges | None = None,
    onset: OnsetRule | None = None,
) -> Recording:
    """Return one log's recording, named by its path below `base`; CdtoolError names the file.

    A force with several axes is a magnitude, their rest levels removed by the `onset` rule. Channels that
    contradict the mechanics of the machine have no values: in what `ranges` were learned from, else in this log.
    """
    recording = replace(read(path, machine_file, ranges), name=shown_path(path, base))
    recording = with_scalar_force(recording, onset or OnsetRule())
    return recording if ranges else without_contradicted(recording, machine_file.machine, onset)


def named_on_load_side(
    logged: LoggedRecording,
    path: Path,
    machine_file: MachineFile,
    base: Path | None,
    ranges: PlausibleRanges | None,
    onset: OnsetRule,
    to_learn: tuple[float, float] | None = None,
) -> Recording:
    """Return what `read_named` returns, of a log or run that has been read; `to_learn`: see PlausibleRanges.masked."""
    whole = logged.on_load_side(machine_file.machine, ranges, to_learn=to_learn)
    recording = replace(whole, name=shown_path(path, base))
    recording = with_scalar_force(recording, onset)
    return recording if ranges else without_contradicted(recording, machine_file.machine, onset)


def without_contradicted(recording: Recording, machine: Machine, onset: OnsetRule | None) -> Recording:
    """Return the recording without values of channels that the part before its first contact contradicts."""
    free = before_contact(recording, contacts_shown(recording, onset or OnsetRule()))
    return PlausibleRanges({}).contradicted_by(check_channels([free], machine)).without_contradicted(recording)


def runs_of(path: Path, machine_file: MachineFile, cut: RunCut | None) -> LogRuns:
    """Return the runs of a log as logged; without a cut the whole log is one. Raises CdtoolError naming the file."""
    if cut is not None:
        return read_runs(path, machine_file, cut)
    logged = read_as_logged(path, machine_file)
    _with_channels(path, logged.recording)
    return LogRuns((logged,))


def reported(runs: LogRuns, path: Path, base: Path | None = None) -> tuple[list[Skipped], list[RecordingFinding]]:
    """Return the runs of a log that were left out, and the losses and warnings about the log itself."""
    name = shown_path(split_run(path)[0], base)
    skipped = [Skipped(shown_path(run, base), reason) for run, reason in runs.left_out]
    return skipped, [RecordingFinding.of(name, item) for item in runs.findings if item.severity != "note"]


@dataclass(frozen=True)
class _NotRead:
    """A log that cannot be read, and whether that lasts: an error loses its cause on the way between processes."""

    fault: CdtoolError
    lasts: bool


@dataclass(frozen=True)
class _AsLogged:
    """Reads the runs of a log through a machine file."""

    machine_file: MachineFile
    cut: RunCut | None

    def __call__(self, path: Path) -> LogRuns | _NotRead:
        try:
            return runs_of(path, self.machine_file, self.cut)
        except CdtoolError as fault:
            return _NotRead(fault, is_lasting(fault))


def _lost_run(path: Path, reason: str) -> _NotRead:
    """Return the error of a log that ended its workers."""
    return _NotRead(RecordingError(f"{path}: {reason}"), lasts=False)


def _with_channels(path: Path, recording: Recording) -> Recording:
    if not recording.channels:
        for item in absent_truth(recording):
            raise RecordingError(f"{path}: {item}")
        raise RecordingError(f"{path}: no channel is mapped", "add [channels] to the machine file")
    return recording


# Returns the part of a log or run that is learned from, and the contacts in it, given the log's path as it is listed
# and the recording. Raises RecordingError if no part of it is usable.
PartOfLog = Callable[[Path, Recording], tuple[Recording, Sequence[Contact]]]


@dataclass(frozen=True)
class RunReading:
    """How impact-free logs are read: cut by `operations`, contacts refused by the `onset` rule, named below `base`.

    `part` returns the part of a log that is learned from and the contacts in it; None: the whole log. `scored` are the
    logs and runs that are also scored, each by what is learned from the others. `workers` read the logs.
    """

    operations: str
    _: KW_ONLY
    onset: OnsetRule | None = None
    base: Path | None = None
    part: PartOfLog | None = None
    scored: Callable[[Path], bool] | None = None
    workers: Workers = field(default_factory=Workers)


def several_logs(logs: Sequence[str | Path]) -> list[str | Path]:
    """Return the logs as a list; raises UsageError for a single path, and for no log at all.

    A text is a sequence of letters, and a pattern with a typing error matches nothing: neither is a list of logs.
    """
    if isinstance(logs, str | PathLike):
        raise UsageError(f"{logs}: a single path, not a list of logs", "give a list, as sorted(Path(...).glob(...))")
    if not (found := list(logs)):
        raise UsageError("no log is given", "check the folder and the pattern that the list is made from")
    return found


def load_runs(
    paths: Sequence[Path], machine_file: MachineFile, reading: RunReading, ranges: PlausibleRanges | None = None
) -> Runs:
    """Return the operations of many impact-free logs; a log that cannot be read is left out and reported.

    Also left out: a log that is given twice or has the content of another one, a log whose header contradicts the unit
    of its motion or torque, and an operation in which the load cell shows a contact. Values that no sensor can measure
    are masked: those outside the plausible `ranges`, which are learned from all these logs if none are given. Channels
    that contradict the mechanics of the machine are learned from, and judged nowhere.
    """
    rule, base = reading.onset or OnsetRule(), reading.base
    paths, repeated = _each_once(paths)
    operations: list[Operation] = []
    skipped = [Skipped(shown_path(path, base), "given more than once, used once") for path in repeated]
    findings: list[RecordingFinding] = []
    by_bytes: dict[str, str] = {}
    free_ones: list[Recording] = []
    without: list[tuple[str, Finding]] = []

    cut = RunCut.of(reading.operations)
    as_logged = _AsLogged(machine_file, cut)
    with reading.workers.ready(to_be_seen(paths)):
        logs = list(in_order(as_logged, paths, len(paths), reading.workers, of_lost=_lost_run))
    logged: list[tuple[Path, Path, LoggedRecording | CdtoolError]] = []  # as listed, the log or its run
    for path, log in zip(paths, logs, strict=True):
        if isinstance(log, _NotRead):
            logged.append((path, path, log.fault))
        elif cut is None:
            logged += [(path, path, item) for item in log.runs]
        else:
            logged += [(path, location(item.recording.source), item) for item in log.runs]
            of_log, about_log = reported(log, path, base)
            skipped += of_log
            findings += about_log
    lasts = all(log.lasts for log in logs if isinstance(log, _NotRead))
    known = LearnedRanges(ranges) if ranges else _ranges_of(logged, machine_file.machine, reading, rule)
    for listed, path, item in logged:
        try:
            if isinstance(item, CdtoolError):
                raise item
            _refuse_doubted(path, item.recording)
            load = partial(named_on_load_side, item, path, machine_file, base, known.all, rule)
            recording, contacts = _to_learn_from(load, listed, reading.part)
            parts = operations_of(recording, reading.operations)
        except CdtoolError as fault:
            skipped.append(unread(path, base, fault))
            continue
        first = by_bytes.get(recording.digest)
        if first is not None:
            again = first == recording.name  # a run that two patterns name
            why = "given more than once, used once" if again else f"has the same content as {first}: used once"
            skipped.append(Skipped(recording.name, why))
            continue
        if recording.digest:
            by_bytes[recording.digest] = recording.name
        contacts = contacts_shown(recording, rule) if contacts is None else contacts
        free, touched = without_contacts(parts, contacts)
        free_ones += [recording] if free else []
        operations.extend(free)
        skipped.extend(touched)
        findings.extend(lost(recording))
        warned = log_warnings(recording, contacts, rule)
        findings.extend(item for item in warned if item.kind != "channel_check" or not free)
        without.extend((recording.name, item) for item in absent_truth(recording))
    checks = check_channels(free_ones, machine_file.machine)
    findings += [RecordingFinding.of(machine_file.path.name, item) for item in checks if item.severity == "loss"]
    by_name = {name: item.contradicted_by(checks) for name, item in known.by_name.items()}
    known = LearnedRanges(known.all.contradicted_by(checks), by_name)
    return Runs(tuple(operations), tuple(skipped), (*findings, *unchecked(without)), known, lasts)


def _to_learn_from(
    load: Callable[[tuple[float, float] | None], Recording],
    listed: Path,
    part: PartOfLog | None,
) -> tuple[Recording, Sequence[Contact] | None]:
    """Return what is learned from, and its contacts if known: beyond it, what looks like a spike may be one."""
    if part is None:
        return load((-math.inf, math.inf)), None
    section, _ = part(listed, load(None))
    return part(listed, load((section.start, section.end)))


def to_be_seen(paths: Iterable[Path]) -> list[Path]:
    """Return one log of each folder, of the first folders: who sees these is likely to see all."""
    by_folder: dict[Path, Path] = {}
    for path in paths:
        by_folder.setdefault(path.parent, path)
    return list(by_folder.values())[:_FOLDERS]


def _ranges_of(
    logged: Sequence[tuple[Path, Path, LoggedRecording | CdtoolError]],
    machine: Machine,
    reading: RunReading,
    rule: OnsetRule,
) -> LearnedRanges:
    """Return the plausible ranges of what is learned from: nothing else of a log may affect them."""
    parts: dict[str, Recording] = {}
    scored: list[str] = []
    for listed, path, item in logged:
        if isinstance(item, CdtoolError):
            continue
        name, part = shown_path(path, reading.base), item.recording
        if reading.part:
            try:
                whole = with_scalar_force(replace(item.on_load_side(machine), name=name), rule)
                learned, _ = reading.part(listed, whole)
            except CdtoolError:
                continue
            part = part.between(learned.start, learned.end)
        parts[name] = part
        if reading.scored and reading.scored(path):
            scored.append(name)
    return LearnedRanges.of(parts, scored)


def resolve_all(paths: Iterable[Path]) -> list[Path]:
    """Return the real paths of many logs; the folders of logs are few, and each is resolved once."""
    folders: dict[Path, Path] = {}
    found = []
    for path in paths:
        if path.is_symlink() or path.name in ("", ".."):
            found.append(path.resolve())
            continue
        folder = path.parent
        if folder not in folders:
            folders[folder] = folder.resolve()
        found.append(folders[folder] / path.name)
    return found


def _each_once(paths: Sequence[Path]) -> tuple[list[Path], list[Path]]:
    """Return the paths without repetitions, and the repetitions."""
    once: dict[Path, Path] = {}
    repeated: list[Path] = []
    for path, true in zip(paths, resolve_all(paths), strict=True):
        if once.setdefault(true, path) is not path:
            repeated.append(path)
    return list(once.values()), repeated


def unread(path: Path, base: Path | None, fault: CdtoolError) -> Skipped:
    """Return the entry of a log that could not be used; its reason does not repeat the name."""
    return Skipped(shown_path(path, base), str(fault).removeprefix(f"{path}: "))


def shown_path(path: Path, base: Path | None = None) -> str:
    """Return the name of a log in results: its path below `base`, else as given; with forward slashes everywhere."""
    parts, above = path.parts, base.parts if base is not None else ()
    if base is None or not above:
        return path.as_posix()
    # Of many logs, in a third of the time of `relative_to`.
    if parts[: len(above)] == above:
        return "/".join(parts[len(above) :]) or "."
    is_below = not is_remote(path) and not is_remote(base) and path.is_relative_to(base)
    return path.relative_to(base).as_posix() if is_below else path.as_posix()


def lost(recording: Recording) -> list[RecordingFinding]:
    """Return the losses in a recording that is used nevertheless."""
    return [RecordingFinding.of(recording.name, item) for item in recording.findings if item.severity == "loss"]


def absent_truth(recording: Recording) -> list[Finding]:
    """Return the findings about ground truth of contacts that is mapped, but not in the log or in a doubtful unit."""
    return [
        item
        for item in recording.findings
        if item.kind in ("absent_truth", "absent_file", "unit_contradicted")
        and item.channel in SHOWS_CONTACTS
        and item.channel not in recording
    ]


def _refuse_doubted(path: Path, recording: Recording) -> None:
    for item in recording.findings:
        if item.kind == "unit_contradicted" and item.severity == "loss" and item.channel in _LEARNED_FROM:
            raise RecordingError(f"{path}: {item}")


def _glob(path: Path) -> Iterator[Path]:
    root = location(path.anchor) if path.is_absolute() else Path()
    pattern = path.relative_to(root).as_posix() if path.is_absolute() else str(path)
    if pattern == ".":  # the root or the working folder itself, which is not a log
        return iter(())
    if path.name == "**":  # folders only: from Python 3.13 on it would match files as well
        pattern += "/"
    # As in a shell, a name that begins with a dot must be matched explicitly. Incomplete files have such names.
    written_out = set(path.parts)
    return (
        match
        for match in root.glob(pattern)
        if all(part in written_out for part in match.parts if part.startswith("."))
        and (match.is_file() or is_bag_folder(match))
    )
