"""`cdtool init LOG... -o DIR`: draft a benchmark file from logs, with the groups that their ground truth shows."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cdtool.alarms.pipeline import run_detector
from cdtool.base.errors import CdtoolError, RecordingError
from cdtool.base.log_names import log_stem, log_suffix
from cdtool.base.plain_text import counted, digits
from cdtool.base.remote.remote_path import relative_name
from cdtool.base.toml_text import comment_lines, commented
from cdtool.commands.init.draft_text import toml
from cdtool.commands.judging.runs import read_named
from cdtool.commands.judging.scoring_rules import ScoringRules
from cdtool.commands.judging.true_contacts import any_contacts
from cdtool.detectors import DETECTORS
from cdtool.formats.machine_file import MachineFile
from cdtool.recordings.operations import operations_of
from cdtool.recordings.recording import SHOWS_CONTACTS, Recording
from cdtool.results.results import Skipped
from cdtool.statistics.spread import MAD_TO_STD
from cdtool.thresholds.signature import ENOUGH_RUNS, MOST_PLACES, Signature
from cdtool.truth.onset_rule import OnsetRule

# Every fourth impact-free log is left for the hold-out, if the others are enough to learn from.
_HOLDOUT = 4
_FORCE_ONLY = "the logs have no channels of a machine: a protocol of the forces needs no detector"
# Words, between anything but letters, in the names of logs without an impact.
_FREE = re.compile(
    r"(?<![^\W\d_])(free|frei|ohne|(no|without)[ _-]?(contact|impact|collision)s?)(?![^\W\d_])",
    re.IGNORECASE,
)
_NUMBER = re.compile(r"[\W_]*\d+.*$")
# Other keys of a TOML file are quoted.
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")


@dataclass(frozen=True)
class _Log:
    """One log: the number of its contacts, None without ground truth, and its load cell's noise [N], NaN if unknown."""

    path: Path
    contacts: int | None
    noise: float


@dataclass(frozen=True)
class BenchmarkDraft:
    """The text of a benchmark file, the files it needs beside it by name, and the logs that cannot be used.

    `has_detectors`: a detector runs on the logs; those of a force rig may have only a force.
    """

    text: str
    beside: Mapping[str, str]
    skipped: tuple[Skipped, ...]
    has_detectors: bool


def draft_benchmark(
    logs: Sequence[Path], machine_file: MachineFile, folder: Path, impact_free: Collection[Path] = ()
) -> BenchmarkDraft:
    """Draft a benchmark file in a folder for logs that a machine file can read.

    Parameters
    ----------
    logs : sequence of Path
        The logs.
    machine_file : MachineFile
        Their machine file, in the same folder.
    folder : Path
        Where the benchmark file will be: its paths are relative to it.
    impact_free : collection of Path, optional
        The resolved paths of the logs that are known to be impact-free; one that shows a contact is left out.

    Returns
    -------
    BenchmarkDraft
        The text, in which CHECK marks what is uncertain, a label file to fill in if no log has ground truth, and the
        logs left out.

    Raises
    ------
    RecordingError
        No log can be read.

    Examples
    --------
    >>> from cdtool.formats.machine_file import read_machine_file
    >>> machine_file = read_machine_file("sample_logs/gate/machine.toml")
    >>> logs = sorted(Path("sample_logs/gate/stiff").iterdir())
    >>> draft = draft_benchmark(logs, machine_file, Path("sample_logs/gate"))
    >>> "[impacts.stiff]" in draft.text, draft.skipped
    (True, ())
    """
    known: list[_Log] = []
    named_free: list[Path] = []
    skipped: list[Skipped] = []
    first: Recording | None = None
    for path in logs:
        try:
            recording = read_named(path, machine_file)
        except CdtoolError as fault:
            skipped.append(Skipped(str(path), str(fault).removeprefix(f"{path}: ")))
            continue
        first = first or recording
        shows = any(channel in recording for channel in SHOWS_CONTACTS)
        contacts = len(any_contacts(recording, ScoringRules())) if shows else None
        if path.resolve() in impact_free:
            if contacts:
                reason = f"given as impact-free, but shows {counted(contacts, 'contact')}"
                skipped.append(Skipped(str(path), reason))
                continue
            contacts = 0
        if contacts is None and any(_FREE.search(name) for name in (log_stem(path), path.resolve().parent.name)):
            named_free.append(path)  # without ground truth, its name is what shows that a log has no impact
        known.append(_Log(path, 0 if path in named_free else contacts, _noise(recording)))
    if first is None:
        raise RecordingError(f"none of {counted(len(logs), 'log')} can be read; first reason: {skipped[0].reason}")
    impacts = [log.path for log in known if log.contacts]
    free = [log.path for log in known if log.contacts == 0]
    usable, others = _detectors(first, machine_file)
    unknown = [log.path for log in known if log.contacts is None]
    beside: dict[str, str] = {}
    if not impacts and unknown:
        impacts, unknown = unknown, []
        beside["labels.csv"] = _label_file([*impacts, *named_free], folder)
    lines = [
        f"# Draft by cdtool init from {counted(len(known), 'log')}: check each line marked CHECK.",
        f"machine = {toml(relative_name(machine_file.path, folder))}",
        *commented(f"detectors = {_listed(usable)}", "" if usable or others else _FORCE_ONLY),
        *(comment_lines(f"With inertia and friction in the machine file also: {', '.join(others)}") if others else []),
        *(_learning(impacts, free, folder, _is_plausible_travel(first)) if usable or others else []),
        *_groups(impacts, folder),
        *_onset(known, beside),
        *_comments(unknown, folder),
        *(["", f"# CHECK: {counted(len(named_free), 'log')} impact-free by their names"] if named_free else []),
    ]
    return BenchmarkDraft("\n".join(lines) + "\n", beside, tuple(skipped), bool(usable))


def _noise(recording: Recording) -> float:
    """Return the standard deviation of the load cell's noise [N]: robust, from the steps between samples."""
    if "force" not in recording:
        return math.nan
    steps = np.diff(recording["force"].values[:, 0])
    steps = steps[np.isfinite(steps)]
    return MAD_TO_STD * float(np.median(np.abs(steps))) / math.sqrt(2.0) if len(steps) else math.nan


def _detectors(recording: Recording, machine_file: MachineFile) -> tuple[list[str], list[str]]:
    """Return the detectors that run on a log, and those that have their channels but not the machine's parameters."""
    usable, others = [], []
    (operation,) = operations_of(recording, "whole")
    for name in DETECTORS.names():
        detector = machine_file.detector(name)
        if not set(detector.needs) <= set(recording.channels):
            continue
        try:
            run_detector(operation, machine_file.machine, detector)
        except CdtoolError:
            others.append(detector.short_name)
        else:
            usable.append(detector.short_name)
    return usable, others


def _is_plausible_travel(recording: Recording) -> bool:
    """Return whether a signature by location can be learned: not from motor angles that the draft takes for metres."""
    values = recording["position"].values if "position" in recording else np.empty(0)
    known = values[np.isfinite(values)]
    return len(known) > 0 and float(np.ptp(known)) < MOST_PLACES * Signature.position_step


def _learning(impacts: Sequence[Path], free: Sequence[Path], folder: Path, by_position: bool) -> list[str]:
    """Return how limits are learned: from impact-free logs, from what is before the contacts, or run by run."""
    if len(free) >= ENOUGH_RUNS:
        enough = len(free) - len(free) // _HOLDOUT >= ENOUGH_RUNS
        held = free[_HOLDOUT - 1 :: _HOLDOUT] if enough else []
        learned = [log for log in free if log not in held]
        lines = [] if by_position else ['threshold = "limit"  # without a plausible position']
        lines += ["", "[learn]", f"logs = {_listed(patterns(learned, folder))}"]
        return [*lines, "", "[holdout]", f"logs = {_listed(patterns(held, folder))}"] if held else lines
    why = f"{counted(len(free), 'impact-free log')}: a signature needs {ENOUGH_RUNS}."
    both = [*free, *impacts]
    if len(both) >= 3:  # with fewer logs of impacts, a threshold learned from the others is not worth it
        return [
            *comment_lines(
                f"{why} Limits are learned from what is before the contacts, and each log is scored with what was "
                "learned from the others."
            ),
            'threshold = "limit"',
            '# Or, without learning: threshold = "baseline"',
            '# operations = "motion"  # alarms while the machine rests do not count',
            "",
            "[learn]",
            'until = "onset"',
            *commented('# from = "0.5s"', "without the beginning of each log, here and in each group of impacts"),
            f"logs = {_listed(patterns(both, folder))}",
        ]
    why = f"{why} Limits are those of each run's own first seconds in motion."
    return [*comment_lines(why), 'threshold = "baseline"']


def _groups(impacts: Sequence[Path], folder: Path) -> list[str]:
    """Return the groups of impacts: by folder, or in a single folder by the names of the files."""
    folders = {log.parent for log in impacts}
    by_folder = 1 < len(folders) < len(impacts)
    groups: dict[str, list[Path]] = {}
    for log in impacts:
        parent = log.resolve().parent
        if len(folders) == len(impacts) > 1:  # a folder for each log: their names, or else the folder around them
            name = _NUMBER.sub("", parent.name) or parent.parent.name
        else:
            name = parent.name if by_folder else _NUMBER.sub("", log_stem(log)) or parent.name
        groups.setdefault(re.sub(r"\W+", "_", name).strip("_") or "impacts", []).append(log)
    lines = []
    for name, members in groups.items():
        name = "holdout_impacts" if name == "holdout" else name
        key = name if _BARE_KEY.fullmatch(name) else toml(name)
        lines += [
            "",
            f"[impacts.{key}]  # CHECK: one obstacle and one speed per group",
            f"logs = {_listed(patterns(members, folder))}",
        ]
    return lines


def _onset(known: Sequence[_Log], beside: Mapping[str, str]) -> list[str]:
    if beside:
        return ["", "[onset]  # CHECK: fill in when each contact begins and ends", 'labels = "labels.csv"']
    noises = [log.noise for log in known if log.noise > 0.0]
    if not noises:
        return []
    sigmas = OnsetRule.sigmas
    level = sigmas * max(noises)
    step = 10.0 ** (math.floor(math.log10(level)) - 1)
    rounded = digits(math.ceil(level / step) * step)
    why = f"{sigmas:g} standard deviations of the load cell's noise, {digits(float(f'{max(noises):.2g}'))} N at most"
    check = f"{why}; CHECK: below the force that counts as a contact"
    return ["", "[onset]", *commented(f"above_n = {rounded}", check)]


def _comments(unknown: Sequence[Path], folder: Path) -> list[str]:
    if not unknown:
        return []
    why = "Not used: without load cell, label or event it is unknown whether they contain an impact:"
    return ["", *comment_lines(why), *(f"#   {relative_name(log, folder)}" for log in unknown)]


def _label_file(logs: Sequence[Path], folder: Path) -> str:
    rows = [f"{relative_name(log, folder)},,," for log in logs]
    return "\n".join(["recording,start_s,end_s,uncertainty_s", *rows]) + "\n"


def patterns(logs: Sequence[Path], folder: Path) -> list[str]:
    """Return patterns that match exactly these logs, or their paths, relative to a folder.

    Parameters
    ----------
    logs : sequence of Path
        The logs.
    folder : Path
        What the patterns are relative to.

    Returns
    -------
    list of str
        A pattern for all logs of a folder and suffix where one fits, else their paths.

    Examples
    --------
    >>> patterns(sorted(Path("sample_logs/gate/soft").iterdir()), Path("sample_logs"))
    ['gate/soft/*.mcap', 'gate/soft/*.csv']
    """
    found: list[str] = []
    by_place: dict[tuple[Path, str], list[Path]] = {}
    for log in logs:
        by_place.setdefault((log.parent, log_suffix(log)), []).append(log)
    for (parent, suffix), members in by_place.items():
        stems = {_NUMBER.sub("", log_stem(path)) for path in members}
        stem = stems.pop() if len(stems) == 1 else None
        candidates = [f"*{suffix}", *([f"{stem}*{suffix}"] if stem else [])]
        wanted = {path.resolve() for path in members}
        fitting = [each for each in candidates if {path.resolve() for path in parent.glob(each)} == wanted]
        names = fitting[:1] if fitting and len(members) > 1 else [path.name for path in members]
        found += [relative_name(parent / name, folder) for name in names]
    return found


def _listed(texts: Sequence[str]) -> str:
    """Return a TOML array; one entry per line if it is long."""
    line = toml(list(texts))
    return line if len(line) < 100 else "[\n" + "".join(f"    {toml(text)},\n" for text in texts) + "]"
