"""The logs named in a benchmark file: in groups, campaigns and test points, and in its label file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cdtool.errors import ConfigurationError
from cdtool.evaluation.truth.labels import Labels, read_labels
from cdtool.evaluation.truth.named_rows import by_recording
from cdtool.ingest.run_reading import split_run
from cdtool.tables import Table
from cdtool.workflows.runs import find_logs, shown_path


def logs_of(table: Table, base: Path, runs: bool = False) -> tuple[Path, ...]:
    """Return the files that `logs` names below `base`, with `runs` also LOG#ID for some runs of a file.

    Raises ConfigurationError for no match and for unknown keys.
    """
    logs = tuple(find_logs(table.texts("logs"), base, table.key("logs"), runs=runs))
    table.finish()
    return logs


def named_logs(table: Table, base: Path, scored: Sequence[Path], runs: bool = False) -> dict[Path, str]:
    """Return the campaign or test point of each of the `scored` logs, independent of how its path is written.

    With `runs`, LOG#ID is named as it is in its group.

    Raises ConfigurationError for a log that is not scored, or that belongs to two of them.
    """
    known = {path.resolve(): path for path in scored}
    found: dict[Path, str] = {}
    for name in table.values:
        if not name.strip():
            raise table.fault(name, "has no name", "give it a name")
        for log in logs_of(table.table(name), base, runs):
            path = known.get(log.resolve())
            if path is None:
                raise table.fault(name, f"names {log}, which is not in a group of [impacts]", "name only scored logs")
            if found.get(path, name) != name:
                raise table.fault(name, f"names {log}, which is also in '{found[path]}'", "list each log once")
            found[path] = name
    return found


def labels_of(onset: Table, base: Path, scored: Sequence[Path], runs: bool = False) -> Labels | None:
    """Return the label file, whose rows must all be about one of the `scored` logs; None without a file.

    With `runs`, each row is about a run of a log, LOG#ID. Raises ConfigurationError for a row that matches no log, or
    for a file name that matches several.
    """
    if "labels" not in onset:
        return None
    path = base / onset.text("labels")
    labels = read_labels(path)
    recordings = [shown_path(split_run(log)[0] if runs else log, base) for log in scored]
    for name, recording in by_recording(path, labels.contacts, set(recordings), runs=runs).items():
        if runs and recording in recordings:
            raise ConfigurationError(
                f"{labels.lines[name][0]}: '{name}' is cut into runs", f"name the run, as {recording}#1"
            )
        if recording is None:
            raise ConfigurationError(
                f"{labels.lines[name][0]}: '{name}' is not a scored recording",
                f"give a path relative to the benchmark file, such as {recordings[0]}, or remove the row",
            )
    return labels
