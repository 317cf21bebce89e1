"""The logs named in a benchmark file: in groups, campaigns and test points, and in its label file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Literal

from cdtool.base.errors import ConfigurationError
from cdtool.base.findings import Finding
from cdtool.base.plain_text import first_of
from cdtool.base.remote.remote_path import is_remote, joined, location
from cdtool.base.settings import NotNegative, Place, setting
from cdtool.commands.judging.runs import find_logs, resolve_all, shown_path
from cdtool.formats.channels.run_reading import split_run
from cdtool.formats.labels.labels import Labels, read_labels
from cdtool.formats.labels.named_rows import by_recording
from cdtool.formats.machine_file import MachineFile
from cdtool.recordings.log_section import MARK_HINT, LogSection, Mark
from cdtool.truth.onset_rule import OnsetRule

_LOGS_HINT = "give a list of texts"


_PART = "of each log that is used: a time on its clock (3.2s) or a distance travelled (0.8m); default: the whole log"


@dataclass(frozen=True, kw_only=True)
class LogPart:
    """The part of a log that is used."""

    begin: Annotated[str | None, setting(f"begin of the part {_PART}", key="from", hint=f"{MARK_HINT}, in quotes")] = (
        None
    )
    end: Annotated[str | None, setting(f"end of the part {_PART}", key="to", hint=f"{MARK_HINT}, in quotes")] = None

    def section(self, place: Place, common: LogSection = LogSection()) -> LogSection:
        """Return the part, that of `common` where it is not given; raises ConfigurationError."""
        marks: list[Mark | None] = []
        for name, text in (("from", self.begin), ("to", self.end)):
            with place.at(name):
                marks.append(None if text is None else Mark.parse(text))
        with place.at("to"):
            return LogSection(*marks).completed_by(common)


@dataclass(frozen=True, kw_only=True)
class LogEntry(LogPart):
    """A log or pattern of a list with a part of its own."""

    path: Annotated[str, setting("a log or a pattern")]


@dataclass(frozen=True, kw_only=True)
class LogsTable(LogPart):
    """A table with logs, and the part of each that is used."""

    logs: Annotated[
        tuple[str | LogEntry, ...], setting("logs, relative to the file; * and ? are allowed", hint=_LOGS_HINT)
    ] = ()


@dataclass(frozen=True, kw_only=True)
class LogList:
    """A campaign or a test point."""

    logs: Annotated[tuple[str, ...], setting("scored logs that belong together", hint=_LOGS_HINT)]


@dataclass(frozen=True, kw_only=True)
class OnsetTable(OnsetRule):
    """[onset]: when a contact begins, by the load cell or by labels."""

    labels: Annotated[
        str | None, setting("a label file: its contacts replace those of the load cell in the recordings it names")
    ] = None
    labels_clock: Annotated[
        Literal["recording", "source"] | None,
        setting("clock of the labels' numbers: recording, as cdtool shows it (the default), or source, the log's own"),
    ] = None
    labels_zone: Annotated[str, setting('offset such as "+02:00" of dates without a zone; default: UTC')] = ""
    not_contacts: Annotated[tuple[str, ...], setting("kinds of labels that are not contacts")] = ()
    synchronisation_s: Annotated[
        NotNegative,
        setting(
            "how far the load cell's clock may be off, by cdtool info; part of each latency's resolution", unit="s"
        ),
    ] = 0.0

    @property
    def rule(self) -> OnsetRule:
        """Return the rule by which a contact begins on the load cell."""
        return OnsetRule(**{item.name: getattr(self, item.name) for item in fields(OnsetRule)})


@dataclass(frozen=True)
class LogsOf:
    """Finds the logs that the tables of a benchmark file name below `base`; with `runs` also LOG#ID for some runs.

    A file that belongs to another one of them, as that of its load cell, is not a log.
    """

    base: Path
    machine_file: MachineFile
    runs: bool = False

    def of(self, logs: Sequence[str], place: Place) -> tuple[Path, ...]:
        """Return the files that the patterns of the key `logs` name; raises ConfigurationError for no match."""
        with place.at("logs"):
            return self._without_files_beside(find_logs(logs, self.base, runs=self.runs))

    def sections(self, table: LogsTable, place: Place) -> dict[Path, LogSection]:
        """Return the files that a table names, with the part of each that is used.

        `from` and `to` of the table are for all of them; an entry of its own has its own. Raises ConfigurationError for
        no match, and for a log with two different parts.
        """
        common = table.section(place)
        found: dict[Path, LogSection] = {}
        for number, entry in enumerate(table.logs, 1):
            pattern, section = entry, common
            if isinstance(entry, LogEntry):
                pattern, section = entry.path, entry.section(place.below(f"logs[{number}]"), common)
            with place.at("logs"):
                matching = find_logs([str(pattern)], self.base, runs=self.runs)
            for path in matching:
                if found.setdefault(path, section) != section:
                    raise place.fault("logs", f"names {path} with two different parts", "name each log once")
        if not found and place.is_whole:
            raise place.fault("logs", "is empty", "name at least one log")
        return {path: found[path] for path in self._without_files_beside(list(found))}

    def _without_files_beside(self, logs: Sequence[Path]) -> tuple[Path, ...]:
        beside = {path.resolve(): log for log in logs for path in self.machine_file.files_beside(self._file(log))}
        return tuple(log for log in logs if not beside or beside.get(self._file(log).resolve(), log) == log)

    def _file(self, log: Path) -> Path:
        return split_run(log)[0] if self.runs else log


def named_logs(
    tables: Mapping[str, LogList], place: Place, found_logs: LogsOf, scored: Sequence[Path]
) -> dict[Path, str]:
    """Return the campaign or test point of each of the `scored` logs, independent of how its path is written.

    A run, LOG#ID, is named as it is in its group.

    Raises ConfigurationError for a log that is not scored, or that belongs to two of them.
    """
    known = dict(zip(resolve_all(scored), scored, strict=True)) if tables else {}
    found: dict[Path, str] = {}
    for name, table in tables.items():
        if not name.strip():
            raise place.fault(name, "has no name", "give it a name")
        for log in found_logs.of(table.logs, place.below(name)):
            path = known.get(log.resolve())
            if path is None:
                raise place.fault(name, f"names {log}, which is not in a group of [impacts]", "name only scored logs")
            if found.get(path, name) != name:
                raise place.fault(name, f"names {log}, which is also in '{found[path]}'", "list each log once")
            found[path] = name
    return found


def named_file(place: Place, key: str, path: Path) -> Path:
    """Return the file that a key names; raises ConfigurationError if it is not there. A URL is not looked up."""
    if not is_remote(path) and not path.exists():
        raise place.fault(key, f"{path}: no such file", "check the path")
    return path


def read_label_file(onset: OnsetTable, place: Place, base: Path) -> Labels | None:
    """Return the label file that [onset] names relative to `base`; None without one. Raises ConfigurationError."""
    if onset.labels is None:
        for key in ("labels_clock", "labels_zone", "not_contacts"):
            if getattr(onset, key):
                raise place.fault(key, "is only for a label file", "name one: labels")
        return None
    path = named_file(place, "labels", joined(base, onset.labels))
    clock = onset.labels_clock or "recording"
    return read_labels(path, clock=clock, zone=onset.labels_zone, not_contacts=onset.not_contacts)


def labels_of(
    labels: Labels | None, logs: LogsOf, scored: Sequence[Path], learned: Sequence[Path] = ()
) -> Labels | None:
    """Return the labels of a file, whose rows are about the `scored` logs; None without a file.

    Rows about other logs are a note.

    Rows about a log `learned` from have its whole path: a file's name alone is that of a scored log.

    If logs are cut into runs, each row is about a run of a log, LOG#ID. Raises ConfigurationError for a file
    name that matches several.
    """
    base, runs = logs.base, logs.runs
    if labels is None:
        return None
    path = location(labels.source)
    recordings, others = (
        [shown_path(split_run(log)[0] if runs else log, base) for log in some] for some in (scored, learned)
    )
    labelled = {name.partition("#")[0] if runs else name for name in labels.contacts}
    recordings += [name for name in others if name in labelled and name not in recordings]
    strangers: list[str] = []
    for name, recording in by_recording(path, labels.contacts, set(recordings), runs=runs).items():
        if runs and recording in recordings:
            raise ConfigurationError(
                f"{labels.lines[name][0]}: '{name}' is cut into runs", f"name the run, as {recording}#1"
            )
        strangers += [] if recording else [f"{name} (line {labels.lines[name][0].rpartition(' ')[2]})"]
    if not strangers:
        return labels
    if len(strangers) == len(labels.contacts):
        raise ConfigurationError(
            f"{path}: no row is about a scored recording: {first_of(strangers)}",
            f"give paths relative to the benchmark file, such as {recordings[0]}",
        )
    note = Finding("rows_not_scored", "", {"names": first_of(strangers), "scored": recordings[0]})
    return replace(labels, findings=(*labels.findings, note))
