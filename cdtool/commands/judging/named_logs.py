"""The logs named in a benchmark file: in groups, campaigns and test points, and in its label file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from cdtool.base.errors import ConfigurationError, UsageError
from cdtool.base.findings import Finding
from cdtool.base.plain_text import first_of
from cdtool.base.remote.remote_path import joined
from cdtool.base.tables import Table
from cdtool.base.value_words import value_in_words
from cdtool.commands.judging.runs import find_logs, resolve_all, shown_path
from cdtool.formats.channels.run_reading import split_run
from cdtool.formats.labels.labels import CLOCKS, Labels, read_labels
from cdtool.formats.labels.named_rows import by_recording
from cdtool.formats.machine_file import MachineFile
from cdtool.recordings.log_section import MARK_HINT, LogSection, Mark


@dataclass(frozen=True)
class LogsOf:
    """Finds the logs that the tables of a benchmark file name below `base`; with `runs` also LOG#ID for some runs.

    A file that belongs to another one of them, as that of its load cell, is not a log.
    """

    base: Path
    machine_file: MachineFile
    runs: bool = False

    def of(self, table: Table) -> tuple[Path, ...]:
        """Return the files that `logs` names; raises ConfigurationError for no match and for unknown keys."""
        logs = find_logs(table.texts("logs"), self.base, table.key("logs"), runs=self.runs)
        table.finish()
        return self._without_files_beside(logs)

    def sections(self, table: Table) -> dict[Path, LogSection]:
        """Return the files that `logs` names, with the part of each that is used.

        `from` and `to` of the table are for all of them; an entry `{ path = "...", from = "...", to = "..." }` has its
        own. Raises ConfigurationError for no match, for unknown keys, and for a log with two different parts.
        """
        common = _section(table)
        entries = table.raw("logs")
        found: dict[Path, LogSection] = {}
        for number, entry in enumerate(entries if isinstance(entries, list) else [entries]):
            section, pattern = common, entry
            if isinstance(entry, dict):
                own = Table(entry, table.where, f"{table.prefix}logs[{number}].")
                pattern, section = own.text("path"), _section(own, common)
                own.finish()
            texts = Table({"logs": pattern}, table.where, table.prefix).texts("logs")
            for path in find_logs(texts, self.base, table.key("logs"), runs=self.runs):
                if found.setdefault(path, section) != section:
                    raise table.fault("logs", f"names {path} with two different parts", "name each log once")
        if not found:
            raise table.fault("logs", "is empty", "name at least one log")
        table.finish()
        return {path: found[path] for path in self._without_files_beside(list(found))}

    def _without_files_beside(self, logs: Sequence[Path]) -> tuple[Path, ...]:
        beside = {path.resolve(): log for log in logs for path in self.machine_file.files_beside(self._file(log))}
        return tuple(log for log in logs if not beside or beside.get(self._file(log).resolve(), log) == log)

    def _file(self, log: Path) -> Path:
        return split_run(log)[0] if self.runs else log


def _section(table: Table, common: LogSection = LogSection()) -> LogSection:
    """Return `from` and `to` of a table; those of `common` where it has none."""
    begin, end = (_mark(table, name) for name in ("from", "to"))
    try:
        return LogSection(begin, end).within(common)
    except UsageError as fault:
        raise table.fault("to", fault.message, fault.hint) from fault


def _mark(table: Table, name: str) -> Mark | None:
    text = table.raw(name)
    if text is not None and not isinstance(text, str):
        raise table.fault(name, f"is {value_in_words(text)}", f"{MARK_HINT}, in quotes")
    try:
        return None if text is None else Mark.parse(text)
    except UsageError as fault:
        raise table.fault(name, fault.message, fault.hint) from fault


def named_logs(table: Table, found_logs: LogsOf, scored: Sequence[Path]) -> dict[Path, str]:
    """Return the campaign or test point of each of the `scored` logs, independent of how its path is written.

    A run, LOG#ID, is named as it is in its group.

    Raises ConfigurationError for a log that is not scored, or that belongs to two of them.
    """
    known = dict(zip(resolve_all(scored), scored, strict=True)) if table.values else {}
    found: dict[Path, str] = {}
    for name in table.values:
        if not name.strip():
            raise table.fault(name, "has no name", "give it a name")
        for log in found_logs.of(table.table(name)):
            path = known.get(log.resolve())
            if path is None:
                raise table.fault(name, f"names {log}, which is not in a group of [impacts]", "name only scored logs")
            if found.get(path, name) != name:
                raise table.fault(name, f"names {log}, which is also in '{found[path]}'", "list each log once")
            found[path] = name
    return found


def labels_of(onset: Table, logs: LogsOf, scored: Sequence[Path], learned: Sequence[Path] = ()) -> Labels | None:
    """Return the label file, whose rows are about the `scored` logs; None without a file.

    Rows about other logs are a note.

    Rows about a log `learned` from have its whole path: a file's name alone is that of a scored log.

    If logs are cut into runs, each row is about a run of a log, LOG#ID. Raises ConfigurationError for a file
    name that matches several.
    """
    settings = {"clock": onset.choice("labels_clock", CLOCKS, "recording"), "zone": onset.text("labels_zone", "")}
    not_contacts = onset.texts("not_contacts", ())
    if "labels" not in onset:
        for key in ("labels_clock", "labels_zone", "not_contacts"):
            if key in onset:
                raise onset.fault(key, "is only for a label file", "name one: labels")
        return None
    base = logs.base
    path = joined(base, onset.text("labels"))
    labels = read_labels(path, not_contacts=not_contacts, **settings)  # type: ignore[arg-type]  # a checked choice
    runs = logs.runs
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
