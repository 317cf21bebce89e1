"""The logs named in a benchmark file: in groups, campaigns and test points, and in its label file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cdtool.errors import ConfigurationError, UsageError
from cdtool.evaluation.truth.labels import CLOCKS, Labels, read_labels
from cdtool.evaluation.truth.named_rows import by_recording
from cdtool.log_section import MARK_HINT, LogSection, Mark
from cdtool.machine_file import MachineFile
from cdtool.tables import Table
from cdtool.value_words import value_in_words
from cdtool.workflows.runs import find_logs, shown_path


def logs_of(table: Table, base: Path, machine_file: MachineFile) -> tuple[Path, ...]:
    """Return the files that `logs` names below `base`; raises ConfigurationError for no match and for unknown keys.

    A file that belongs to another one of them, as that of its load cell, is not a log.
    """
    logs = find_logs(table.texts("logs"), base, table.key("logs"))
    table.finish()
    return _without_files_beside(logs, machine_file)


def _without_files_beside(logs: Sequence[Path], machine_file: MachineFile) -> tuple[Path, ...]:
    beside = {path.resolve(): log for log in logs for path in machine_file.files_beside(log)}
    return tuple(log for log in logs if not beside or beside.get(log.resolve(), log) == log)


def sectioned_logs(table: Table, base: Path, machine_file: MachineFile) -> dict[Path, LogSection]:
    """Return the files that `logs` names below `base`, with the part of each that is used.

    `from` and `to` of the table are for all of them; an entry `{ path = "...", from = "...", to = "..." }` has its own.
    A file that belongs to another one of them, as that of its load cell, is not a log. Raises ConfigurationError for no
    match, for unknown keys, and for a log with two different parts.
    """
    common = _section(table)
    entries = table.raw("logs")
    found: dict[Path, LogSection] = {}
    for number, entry in enumerate(entries if isinstance(entries, list) else [entries]):
        section, pattern = common, entry
        if isinstance(entry, dict):
            own = Table(entry, table.where, f"{table.prefix}logs[{number}].")
            pattern, section = own.text("path"), _section(own).within(common)
            own.finish()
        paths = find_logs(Table({"logs": pattern}, table.where, table.prefix).texts("logs"), base, table.key("logs"))
        for path in paths:
            if found.setdefault(path, section) != section:
                raise table.fault("logs", f"names {path} with two different parts", "name each log once")
    table.finish()
    logs = _without_files_beside(list(found), machine_file)
    return {path: found[path] for path in logs}


def _section(table: Table) -> LogSection:
    """Return `from` and `to` of a table."""
    begin, end = (_mark(table, name) for name in ("from", "to"))
    try:
        return LogSection(begin, end)
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


def named_logs(table: Table, base: Path, scored: Sequence[Path], machine_file: MachineFile) -> dict[Path, str]:
    """Return the campaign or test point of each of the `scored` logs, independent of how its path is written.

    Raises ConfigurationError for a log that is not scored, or that belongs to two of them.
    """
    known = {path.resolve(): path for path in scored}
    found: dict[Path, str] = {}
    for name in table.values:
        if not name.strip():
            raise table.fault(name, "has no name", "give it a name")
        for log in logs_of(table.table(name), base, machine_file):
            path = known.get(log.resolve())
            if path is None:
                raise table.fault(name, f"names {log}, which is not in a group of [impacts]", "name only scored logs")
            if found.get(path, name) != name:
                raise table.fault(name, f"names {log}, which is also in '{found[path]}'", "list each log once")
            found[path] = name
    return found


def labels_of(onset: Table, base: Path, scored: Sequence[Path]) -> Labels | None:
    """Return the label file, whose rows must all be about one of the `scored` logs; None without a file.

    Raises ConfigurationError for a row that matches no log, or for a file name that matches several.
    """
    settings = {"clock": onset.choice("labels_clock", CLOCKS, "recording"), "zone": onset.text("labels_zone", "")}
    not_contacts = onset.texts("not_contacts", ())
    if "labels" not in onset:
        for key in ("labels_clock", "labels_zone", "not_contacts"):
            if key in onset:
                raise onset.fault(key, "is only for a label file", "name one: labels")
        return None
    path = base / onset.text("labels")
    labels = read_labels(path, not_contacts=not_contacts, **settings)  # type: ignore[arg-type]  # a checked choice
    recordings = [shown_path(log, base) for log in scored]
    for name, recording in by_recording(path, labels.contacts, set(recordings)).items():
        if recording is None:
            raise ConfigurationError(
                f"{labels.lines[name][0]}: '{name}' is not a scored recording",
                f"give a path relative to the benchmark file, such as {recordings[0]}, or remove the row",
            )
    return labels
