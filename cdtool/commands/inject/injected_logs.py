"""Put the contacts of [inject] into impact-free logs, and write them as logs with their exact contacts.

Put a contact into a recording: the change of each channel on that channel's own clock and in its own unit.
"""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import CdtoolError, ConfigurationError, RecordingError
from cdtool.base.files.bounded_loading import parse_json, read_bytes
from cdtool.base.findings import Finding
from cdtool.base.log_names import log_stem
from cdtool.base.plain_text import digits
from cdtool.base.version import __version__
from cdtool.commands.inject.assumption import Assumption, DriveBeyond, SlewBeyond, assumptions_of
from cdtool.commands.inject.channel_change import ChannelChange
from cdtool.commands.inject.inject_section import InjectSection, NamedObstacle
from cdtool.commands.inject.injected_contact import Doubt, InjectedContact
from cdtool.commands.inject.robot_contact import RobotLog
from cdtool.commands.inject.struck_machine import StruckAxis, StruckRobot, struck_machine
from cdtool.commands.judging.impact_free import contacts_shown
from cdtool.commands.judging.runs import shown_path, unread
from cdtool.execution.workers import Workers, in_order
from cdtool.formats.channels.channel_assembly import LoggedRecording
from cdtool.formats.channels.reading import read_as_logged
from cdtool.formats.columns import Column
from cdtool.formats.groups import Group, Part
from cdtool.formats.labels.labels import Labels
from cdtool.formats.machine_file import MachineFile
from cdtool.formats.written_files import machine_text, writer_of
from cdtool.machines.axis_model.axis_run import AxisRun
from cdtool.machines.axis_model.parameters import AxisModel
from cdtool.machines.dynamics import Machine
from cdtool.recordings.log_section import Mark
from cdtool.recordings.recording import Contact, Recording, Series
from cdtool.results.results import Skipped
from cdtool.truth.onset_rule import OnsetRule

# The channels that a contact changes where they are logged; the references do not react.
_CHANGED = ("torque", "speed", "position", "acceleration", "reference_torque")


def injected_recording(
    logged: Recording,
    machine: Machine,
    changes: Mapping[str, ChannelChange],
    force: ChannelChange,
    joints: tuple[int, ...],
) -> Recording:
    """Return a recording as logged, with a contact in every channel; it ends with what was simulated.

    `changes` (n, len(joints)) are on the load side, `force` (n, 1) is added to the load cell, or is a load cell without
    noise if the log has none. A channel whose change is not known is left out. Samples that are missing stay missing.
    Raises RecordingError if no channel of the log changes.
    """
    end = float(force.time[-1])
    channels: dict[str, Series] = {}
    changed = False
    for name, series in logged.channels.items():
        part = series.between(-np.inf, end)
        if not len(part):
            continue
        if name == "force":
            added = np.zeros(part.values.shape)
            added[:, :1] = force.at(part.time)
            channels[name] = part.with_values(part.values + added, part.unit)
        elif name not in _CHANGED:
            channels[name] = part
        elif name in changes:
            factor = machine.load_factor(name, series.unit)
            added = np.zeros(part.values.shape)
            added[:, list(joints)] = changes[name].at(part.time) / factor[list(joints)]
            changed |= bool(np.any(np.nan_to_num(added)))
            channels[name] = part.with_values(part.values + added, part.unit)
    if not changed:
        raise RecordingError(
            f"{logged.name}: the contact at {force.start:.3f} s changes no channel of the log",
            "log torque, speed or acceleration",
        )
    if "force" not in channels:
        clock = _clock(channels)
        channels["force"] = Series(clock, force.at(clock), machine.accepted_units("force")[0])
    fact = {"start": force.start, "peak": float(np.max(force.values))}
    return replace(
        logged,
        channels=channels,
        findings=(*logged.findings, Finding("injected_contact_fact", "force", fact)),
        digest="",
    )


def _clock(channels: Mapping[str, Series]) -> FloatArray:
    """Return the clock of the channel with the most samples."""
    return max(channels.values(), key=len).time


MANIFEST, MACHINE, CONTACTS = "injected.json", "machine.toml", "contacts.csv"


@dataclass(frozen=True)
class InjectedCase:
    """One injected contact: its file below the folder, where it comes from, and what is true of it; SI units."""

    file: str
    group: str
    log: str
    obstacle: str
    stiffness: float
    position: str
    position_value: float
    start: float
    end: float
    speed: float
    peak_force: float
    reliable_until: float
    separation: float | None
    wind_up: float
    free_wind_up: float
    assumption: str
    doubts: tuple[str, ...]


@dataclass(frozen=True)
class InjectedLogs:
    """The recordings of a folder: every case, what was left out, and the machine file that reads them."""

    folder: Path
    cases: tuple[InjectedCase, ...]
    skipped: tuple[Skipped, ...]

    @property
    def machine_path(self) -> Path:
        """Return the path of the machine file."""
        return self.folder / MACHINE

    def labels(self, base: Path) -> Labels:
        """Return the exact contacts, by the names that the recordings have below `base`."""
        contacts, lines = {}, {}
        for case in self.cases:
            name = shown_path(self.folder / case.file, base)
            contacts[name] = (
                Contact(case.start, case.end, 0.0, case.peak_force, found_by="injection", resolution=0.0),
            )
            lines[name] = (f"{MANIFEST} {case.file}",)
        return Labels(str(self.folder / MANIFEST), contacts, lines)


@dataclass(frozen=True)
class _Work:
    """What is needed to inject into any log."""

    section: InjectSection
    machine_file: MachineFile
    struck: StruckAxis | StruckRobot
    assumptions: tuple[Assumption, ...]
    onset: OnsetRule
    base: Path
    folder: Path

    def __call__(self, item: tuple[int, Path]) -> _OfLog:
        number, log = item
        try:
            return self._written(number, log)
        except CdtoolError as fault:
            return _OfLog((), (unread(log, self.base, fault),))

    def _written(self, number: int, log: Path) -> _OfLog:
        machine = self.machine_file.machine
        logged: LoggedRecording = read_as_logged(log, self.machine_file, unread="loss")
        recording = replace(logged.on_load_side(machine), name=shown_path(log, self.base))
        contacts = contacts_shown(recording, self.onset)
        if contacts:
            raise RecordingError(
                f"{log}: a contact at {contacts[0].start:.3f} s", "contacts are put into impact-free logs only"
            )
        run = self.struck.read(recording, logged)
        cases: list[InjectedCase] = []
        skipped, machine_toml = [], ""
        groups = self.section.groups(self.assumptions).items()
        rng = np.random.default_rng([self.section.seed, number])
        at: Any = self.struck  # its run is of its own kind
        for mark in self.section.positions:
            # The contact is anywhere between two samples, not always on one.
            share = float(rng.random())
            reasons: dict[tuple[str, str], None] = {}
            try:
                time = self._time(run, recording, mark, share)
            except RecordingError as fault:
                skipped.append(Skipped(recording.name, f"{mark}: {fault}"))
                continue
            for group, (obstacle, assumption) in groups:
                try:
                    contact = at.contact(run, obstacle.obstacle, time, self.section.duration, assumption)
                    file = f"{group}/{number + 1:03d}_{log_stem(log)}_{digits(mark.value)}{mark.unit}"
                    case, machine_toml = self._write(file, log, logged.recording, group, obstacle, mark, contact)
                    cases.append(case)
                except RecordingError as fault:
                    # The brackets of an obstacle fail for one reason.
                    reasons[obstacle.name, str(fault)] = None
            skipped += [Skipped(recording.name, f"{name} at {mark}: {reason}") for name, reason in reasons]
        return _OfLog(tuple(cases), tuple(skipped), machine_toml)

    def _time(self, run: AxisRun | RobotLog, recording: Recording, mark: Mark, share: float) -> float:
        """Return when the axis or the robot is at a mark [s], up to a period earlier."""
        if isinstance(self.struck, StruckAxis):
            recording = _of_joint(recording, self.struck.joint)  # not that of the joint that moves most
        time = mark.time_in(recording)
        if not math.isfinite(time):
            raise RecordingError(f"the log never reaches {mark}", "choose a position within the travel")
        if time < run.start:
            raise RecordingError(f"{mark} is before the log begins, at {run.start:.3f} s", "choose a later position")
        time = max(time - share * run.period, run.start)
        left = recording.end - time
        if left < self.section.duration - run.period:
            # A detector that has not alarmed by then would count as one that missed.
            raise RecordingError(
                f"the log ends {left:.2f} s after {mark}",
                f"choose an earlier position, or a duration_s below {self.section.duration:g}",
            )
        return time

    def _write(
        self,
        file: str,
        log: Path,
        logged: Recording,
        group: str,
        obstacle: NamedObstacle,
        mark: Mark,
        contact: InjectedContact,
    ) -> tuple[InjectedCase, str]:
        recording = injected_recording(
            logged, self.machine_file.machine, contact.changes, contact.force, self.struck.joints
        )
        name = f"{file}.{self.section.file_format}"
        case = InjectedCase(
            file=name,
            group=group,
            log=shown_path(log, self.base),
            obstacle=obstacle.name,
            stiffness=obstacle.stiffness,
            position=str(mark),
            position_value=mark.value,
            start=contact.start,
            end=float(contact.force.time[-1]),
            speed=contact.speed,
            peak_force=contact.peak_force,
            reliable_until=contact.reliable_until,
            separation=contact.separation if math.isfinite(contact.separation) else None,
            wind_up=contact.wind_up,
            free_wind_up=contact.free_wind_up,
            assumption=contact.assumption.suffix.strip("_"),
            doubts=tuple(doubt.name.lower() for doubt in contact.doubts),
        )
        target = self.folder / name
        provenance = {
            "source": log.name,
            "version": __version__,
            "origin_s": repr(recording.origin),
            "injected": json.dumps(asdict(case), sort_keys=True),
        }
        return case, write_recording(target, recording, provenance, self.machine_file)


@dataclass(frozen=True)
class _OfLog:
    cases: tuple[InjectedCase, ...]
    skipped: tuple[Skipped, ...]
    machine_toml: str = ""


def write_recording(
    target: Path, recording: Recording, provenance: Mapping[str, str], machine_file: MachineFile
) -> str:
    """Write a recording as logged, and return the text of the machine file that reads it from the folder above.

    A table has one clock: a recording with several needs a container of messages, such as .mcap.
    """
    clocks = {series.time.tobytes() for series in recording.channels.values()}
    if len(clocks) > 1 and target.suffix == ".csv":
        raise ConfigurationError(f"{target}: the channels have {len(clocks)} clocks", 'set [inject] format = "mcap"')
    one = len(clocks) == 1
    groups = [_group("clock_1", recording, tuple(recording.channels))] if one else []
    if not one:
        groups = [_group(name, recording, (name,)) for name in recording.channels]
    target.parent.mkdir(parents=True, exist_ok=True)

    def parts() -> Iterator[list[Part | None]]:
        yield [
            Part(
                recording[group.columns[0].name].time,
                tuple(_values(recording, column.name) for column in group.columns),
            )
            for group in groups
        ]

    written = writer_of(target)(target, groups, parts(), provenance)
    return machine_text(machine_file, target, groups, written, target.parent.parent / MACHINE)


def _group(name: str, recording: Recording, channels: Sequence[str]) -> Group:
    columns = []
    for channel in channels:
        series = recording[channel]
        shape = (0, series.joint_count) if series.joint_count > 1 else (0,)
        columns.append(Column(channel, np.empty(shape), None, None if series.unit == "1" else series.unit))
    first = recording[channels[0]]
    return Group(name, tuple(columns), len(first), True, float(first.time[0]), recording.joints)


def _values(recording: Recording, channel: str) -> Any:
    series = recording[channel]
    return series.values if series.joint_count > 1 else series.values[:, 0]


def model_of(section: InjectSection, machine_file: MachineFile) -> AxisModel:
    """Return the model that decides which detectors are tested: of the axis, or of the least known joint of a robot.

    Raises ConfigurationError where it is incomplete.
    """
    return struck_machine(section, machine_file).deciding_model


def write_injected(
    section: InjectSection,
    machine_file: MachineFile,
    onset: OnsetRule,
    folder: Path,
    base: Path,
    workers: Workers | None = None,
) -> InjectedLogs:
    """Write every injected recording below `folder`, which exists and is empty, with contacts.csv and the manifest.

    A log that cannot be used, and a contact that cannot be made, are left out with the reason. Raises RecordingError if
    no contact can be made, ConfigurationError where the model is incomplete.
    """
    struck = struck_machine(section, machine_file)
    work = _Work(section, machine_file, struck, assumptions_of(struck.deciding_model), onset, base, folder)
    items = list(enumerate(section.logs))
    done: list[_OfLog] = list(in_order(work, items, len(items), workers, of_lost=_Lost(base)))
    cases = _without_needless(work, [case for item in done for case in item.cases])
    skipped = tuple(left for item in done for left in item.skipped)
    if not cases:
        reason = skipped[0].reason if skipped else "no log is given"
        raise RecordingError(f"no contact can be injected: {reason}", "choose other logs or positions")
    injected = InjectedLogs(folder, cases, skipped)
    machine_toml = next(item.machine_toml for item in done if item.machine_toml)
    injected.machine_path.write_text(machine_toml, encoding="utf-8", newline="\n")
    _write_manifest(injected)
    return injected


def _without_needless(work: _Work, cases: Sequence[InjectedCase]) -> tuple[InjectedCase, ...]:
    """Return the cases without the brackets that make no difference, and remove the recordings of these.

    A bracket of the drive is needed where a contact of the same obstacle winds it up further than is known, one of the
    slew limit where the command of one rises faster.
    """
    doubts: dict[str, set[str]] = {}
    for case in cases:
        doubts.setdefault(case.group, set()).update(case.doubts)
    groups = work.section.groups(work.assumptions)
    names = {(obstacle.name, assumption): name for name, (obstacle, assumption) in groups.items()}
    needless = {
        name
        for name, (obstacle, assumption) in groups.items()
        if any(
            doubt.name.lower() not in doubts.get(names[obstacle.name, usual], ()) for usual, doubt in _usual(assumption)
        )
    }
    for case in cases:
        if case.group in needless:
            (work.folder / case.file).unlink()
    for name in needless:
        if (work.folder / name).is_dir():
            (work.folder / name).rmdir()
    return tuple(case for case in cases if case.group not in needless)


def _usual(assumption: Assumption) -> list[tuple[Assumption, Doubt]]:
    """Return the assumptions without one bracket, and the doubt about them that makes the bracket necessary."""
    found = []
    if assumption.drive is not DriveBeyond.AS_BEFORE:
        usual = replace(assumption, drive=DriveBeyond.AS_BEFORE)
        found.append((usual, Doubt.WIND_UP_BEYOND_FREE_RUNS))
    if assumption.slew is not SlewBeyond.NO_LIMIT:
        found.append((replace(assumption, slew=SlewBeyond.NO_LIMIT), Doubt.SLOPE_BEYOND_FREE_RUNS))
    return found


@dataclass(frozen=True)
class _Lost:
    base: Path

    def __call__(self, item: tuple[int, Path], reason: str) -> _OfLog:
        return _OfLog((), (Skipped(shown_path(item[1], self.base), reason),))


def _of_joint(recording: Recording, joint: int) -> Recording:
    """Return the motion of one joint."""
    channels = {
        name: recording[name].with_values(recording[name].values[:, [joint]], recording[name].unit)
        for name in ("position", "speed")
        if name in recording
    }
    return replace(recording, channels=channels, joints=(recording.joints[joint],))


def _write_manifest(injected: InjectedLogs) -> None:
    rows = io.StringIO()
    table = csv.writer(rows, lineterminator="\n")
    table.writerow(("recording", "start_s", "end_s", "kind", "uncertainty_s"))
    table.writerows((case.file, repr(case.start), repr(case.end), case.obstacle, 0) for case in injected.cases)
    (injected.folder / CONTACTS).write_text(rows.getvalue(), encoding="utf-8", newline="\n")
    manifest = {
        "tool": "cdtool",
        "tool_version": __version__,
        "injected": True,
        "cases": [asdict(case) for case in injected.cases],
        "skipped": [asdict(item) for item in injected.skipped],
    }
    text = json.dumps(manifest, indent=1, allow_nan=False) + "\n"
    (injected.folder / MANIFEST).write_text(text, encoding="utf-8", newline="\n")


def read_injected(folder: Path) -> InjectedLogs:
    """Return the recordings of a folder from its manifest; raises ConfigurationError for a wrong one."""
    path = folder / MANIFEST
    try:
        values = parse_json(read_bytes(path, ConfigurationError, hint="delete the folder"))
        cases = tuple(InjectedCase(**{**item, "doubts": tuple(item["doubts"])}) for item in values["cases"])
        skipped = tuple(Skipped(**item) for item in values["skipped"])
    except (ValueError, KeyError, TypeError) as fault:
        raise ConfigurationError(f"{path}: is no manifest of injected recordings", "delete the folder") from fault
    return InjectedLogs(folder, cases, skipped)
