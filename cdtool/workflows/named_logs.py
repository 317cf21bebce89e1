"""The logs that a benchmark file names: of groups, of campaigns and test points, and in its label file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from cdtool.errors import ConfigurationError
from cdtool.evaluation.truth.labels import Labels, read_labels
from cdtool.evaluation.truth.named_rows import by_recording
from cdtool.tables import Table
from cdtool.workflows.runs import find_logs, shown_path


def logs_of(table: Table, base: Path) -> tuple[Path, ...]:
    """The files that `logs` names below `base`; raises ConfigurationError for no match and for other keys."""
    logs = tuple(find_logs(table.texts("logs"), base, table.key("logs")))
    table.finish()
    return logs


def named_logs(table: Table, base: Path, scored: Sequence[Path]) -> dict[Path, str]:
    """Which campaign or test point each of the `scored` logs belongs to, however its path is written.

    Raises ConfigurationError for a log that is not scored, or that belongs to two.
    """
    known = {path.resolve(): path for path in scored}
    found: dict[Path, str] = {}
    for name in table.values:
        if not name.strip():
            raise table.fault(name, "has no name", "a name is needed")
        for log in logs_of(table.table(name), base):
            path = known.get(log.resolve())
            if path is None:
                raise table.fault(name, f"names {log}, which no group of [impacts] scores", "name logs that are scored")
            if found.get(path, name) != name:
                raise table.fault(name, f"names {log}, which '{found[path]}' does too", "a log belongs to one")
            found[path] = name
    return found


def labels_of(onset: Table, base: Path, scored: Sequence[Path]) -> Labels | None:
    """The label file, each row of which has to be about one of the `scored` logs; None where none is named.

    Raises ConfigurationError with the row that fits none, or with the file's name that fits several.
    """
    if "labels" not in onset:
        return None
    path = base / onset.text("labels")
    labels = read_labels(path)
    recordings = [shown_path(log, base) for log in scored]
    for name, recording in by_recording(path, labels.contacts, set(recordings)).items():
        if recording is None:
            raise ConfigurationError(
                f"{labels.lines[name][0]}: '{name}' is none of the recordings that are scored",
                f"write a path below the benchmark file, such as {recordings[0]}, or take the row out",
            )
    return labels
