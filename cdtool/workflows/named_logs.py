"""The logs named in a benchmark file: in groups, campaigns and test points, and in its label file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cdtool.errors import ConfigurationError
from cdtool.evaluation.truth.labels import CLOCKS, Labels, read_labels
from cdtool.evaluation.truth.named_rows import by_recording
from cdtool.machine_file import MachineFile
from cdtool.tables import Table
from cdtool.workflows.runs import find_logs, shown_path


def logs_of(table: Table, base: Path, machine_file: MachineFile) -> tuple[Path, ...]:
    """Return the files that `logs` names below `base`; raises ConfigurationError for no match and for unknown keys.

    A file that belongs to another one of them, as that of its load cell, is not a log.
    """
    logs = find_logs(table.texts("logs"), base, table.key("logs"))
    table.finish()
    beside = {path.resolve(): log for log in logs for path in machine_file.files_beside(log)}
    return tuple(log for log in logs if not beside or beside.get(log.resolve(), log) == log)


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
