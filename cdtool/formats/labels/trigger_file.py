"""A trigger file: when a controller, or any other program, raised its alarms.

Conventions: a CSV with the columns recording and time_s and, where needed, detector and blind_until_s. A row is one
alarm. A row without a time: watched, no alarm. A row with blind_until_s: from time_s until then it could not judge.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from cdtool.base.errors import ConfigurationError
from cdtool.base.files.bounded_loading import read_bytes
from cdtool.formats.labels.named_rows import NamedRow, by_recording, read_named_rows


@dataclass
class Triggered:
    """One detector's result for one recording: alarms [s], and intervals [s] that it could not assess."""

    alarms: list[float] = field(default_factory=list)
    blind: list[tuple[float, float]] = field(default_factory=list)


@dataclass(frozen=True)
class TriggerFile:
    """The rows of a trigger file by detector and recording, with the names of the file."""

    path: Path
    rows: Mapping[str, Mapping[str, Triggered]]
    digest: str

    def assigned(
        self, recordings: Collection[str], runs: bool = False
    ) -> tuple[dict[str, dict[str, Triggered]], list[str]]:
        """Return each detector's rows for each of the recordings, and the names that belong to none of them.

        With `runs`, the rows are about runs of the recordings, named RECORDING#ID. Raises ConfigurationError if a file
        name fits several.
        """
        named = {name for by_name in self.rows.values() for name in by_name}
        meant = by_recording(self.path, named, recordings, runs=runs)
        said: dict[str, dict[str, Triggered]] = {}
        for detector, by_name in self.rows.items():
            of_detector = said.setdefault(detector, {})
            for name, item in by_name.items():
                recording = meant[name]
                if recording is not None:
                    both = of_detector.setdefault(recording, Triggered())
                    both.alarms += item.alarms
                    both.blind += item.blind
        return said, sorted(name for name, recording in meant.items() if recording is None)


def read_triggers(path: Path) -> TriggerFile:
    """Read and check a trigger file.

    Parameters
    ----------
    path : Path
        A CSV with the columns recording, time_s and, optionally, detector and blind_until_s.

    Returns
    -------
    TriggerFile
        The rows by detector and recording.

    Raises
    ------
    ConfigurationError
        The file is wrong; the message names the line.

    Examples
    --------
    >>> triggers = read_triggers(Path("docs/examples/triggers.csv"))
    >>> triggers.rows["plc"]["stiff/01.mcap"].alarms
    [6.001]
    """
    rows: dict[str, dict[str, Triggered]] = {}
    for row in read_named_rows(path, ("recording", "time_s"), ("detector", "blind_until_s"), "trigger"):
        by_name = rows.setdefault(row.text("detector") or path.stem, {})
        _take(row, by_name.setdefault(row.recording, Triggered()))
    return TriggerFile(path, rows, hashlib.sha256(read_bytes(path, ConfigurationError)).hexdigest())


def _take(row: NamedRow, said: Triggered) -> None:
    time, until = row.seconds("time_s"), row.seconds("blind_until_s")
    if until is not None:
        if time is None:
            raise row.fault(
                f"blind_until_s is {until:g}, time_s is missing",
                "give time_s, the beginning of the time that is not assessable",
            )
        if until < time:
            raise row.fault(f"blind from {time:g} until {until:g}", "time_s must be before blind_until_s")
        said.blind.append((time, until))
    elif time is not None:
        said.alarms.append(time)
