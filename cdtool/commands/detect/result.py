"""The result of a detector on logs for Python: alarms and contacts as DataFrames, the signal, the figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from cdtool.alarms.pipeline import Detection
from cdtool.base.errors import CdtoolError, OutputError, RecordingError, SignatureError, UsageError
from cdtool.base.plain_text import counted
from cdtool.base.remote.remote_path import location
from cdtool.commands.detect.rows import AlarmRow, OperationRow, alarm_row, operation_row
from cdtool.commands.detecting.detection import Detected, DetectedRuns
from cdtool.commands.detecting.prepared import prepared
from cdtool.commands.judging.runs import several_logs
from cdtool.detectors.detection import Status
from cdtool.recordings.recording import Recording
from cdtool.report.notebook import notebook_table
from cdtool.report.plots.figures import described
from cdtool.results.frames import FIRST_OF_CONTACT, OUTCOMES, rows_as_frame
from cdtool.results.results import ContactResult, RecordingFinding, Skipped

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from cdtool.commands.learning.learning import LearnedSignature
    from cdtool.detectors.base import Detector
    from cdtool.formats.machine_file import MachineFile
    from cdtool.formats.signature_file import SignatureFile


VERDICTS = ("alarm", "no alarm", "not_assessable")
_SHOWN = ["operation", "verdict", "alarms", "first_alarm_s", "contacts", "latency_ms"]


class _Frames:
    """Alarms, contacts and verdicts of one log, or of several, as DataFrames."""

    runs: Sequence[DetectionResult]

    @property
    def _detector(self) -> str:
        return next((item.detector for run in self.runs for item in run.detections), "no operation")

    @cached_property
    def alarms(self) -> pd.DataFrame:
        """A row per alarm: joint, time, side, statistic, limit, and the onset of its contact (NaN: none is known)."""
        rows = [
            alarm_row(run.detected, detection, alarm)
            for run in self.runs
            for detection in run.detections
            for alarm in detection.verdict.alarms
        ]
        return rows_as_frame(AlarmRow, rows, {"side": ("above", "below")})

    @cached_property
    def contacts(self) -> pd.DataFrame:
        """A row per contact, with the columns of a benchmark's `contacts`; `detected.contact_rows` has all."""
        rows = [row for run in self.runs for of_operation in run.detected.contact_rows for row in of_operation]
        return rows_as_frame(ContactResult, rows, {"outcome": OUTCOMES})[FIRST_OF_CONTACT]

    def summary(self) -> pd.DataFrame:
        """Return a row per operation with its verdict."""
        rows = [
            operation_row(run.detected, *pair)
            for run in self.runs
            for pair in zip(run.detections, run.detected.matchings, strict=True)
        ]
        return rows_as_frame(OperationRow, rows, {"verdict": VERDICTS})


@dataclass(frozen=True, repr=False)
class DetectionResult(_Frames):
    """What a detector says about one log: alarms and contacts as DataFrames, its signal, its figure.

    Parameters
    ----------
    detected : Detected
        The same as plain values: matches, findings, the normal motion.

    Examples
    --------
    >>> import cdtool
    >>> log, machine = "sample_logs/gate/stiff/03.csv", "sample_logs/gate/machine.toml"
    >>> limit = {"threshold.name": "limit", "threshold.limits": 400.0}
    >>> found = cdtool.detect(log, machine, detector="momentum", settings=limit)
    >>> found
    DetectionResult(1 alarm, 1 contact; momentum on 03.csv)
    >>> found.alarms[["joint", "side"]].values.tolist(), found.contacts.outcome.tolist()
    ([['gate', 'above']], ['detected'])
    """

    detected: Detected

    @property
    def recording(self) -> Recording:
        """The log on the load side."""
        return self.detected.recording

    @property
    def detections(self) -> tuple[Detection, ...]:
        """The detector's statistic, band and verdict of each operation."""
        return self.detected.detections

    @property
    def outcome(self) -> str:
        """The verdict on the log: "alarm" if any operation has one, "not_assessable" if none is assessable."""
        outcomes = {item.verdict.outcome for item in self.detections}
        return next((outcome for outcome in VERDICTS if outcome in outcomes), "not_assessable")

    @property
    def runs(self) -> Sequence[DetectionResult]:  # type: ignore[override]  # read only here
        """This result alone."""
        return (self,)

    def to_frame(self) -> pd.DataFrame:
        """Return the signal of all operations with its limits as a DataFrame.

        Returns
        -------
        DataFrame
            Index `time_s`; for each joint the columns `JOINT statistic`, `JOINT lower`, `JOINT upper` in the unit of
            the signal, and `JOINT status`: VALID, or why a sample is not assessable.
        """
        import pandas as pd

        parts = [item.statistic for item in self.detections]
        time = np.concatenate([np.empty(0), *(part.time for part in parts)])
        names = pd.Index([item.name for item in Status])
        columns: dict[str, object] = {}
        for column, joint in enumerate(self.detected.joints):
            curves = {
                "statistic": [part.values[:, column] for part in parts],
                "lower": [item.band.lower[:, column] for item in self.detections],
                "upper": [item.band.upper[:, column] for item in self.detections],
            }
            columns |= {f"{joint} {name}": np.concatenate([np.empty(0), *curve]) for name, curve in curves.items()}
            status = np.concatenate([np.empty(0, np.uint8), *(part.status[:, column] for part in parts)])
            columns[f"{joint} status"] = pd.Categorical.from_codes(status.astype(np.int64), names)
        return pd.DataFrame(columns, index=pd.Index(time, name="time_s"))

    def plot(self) -> Figure:
        """Return signal, limits, trigger and load cell over time, as `cdtool detect --plot` draws them; no pyplot."""
        from cdtool.commands.detect.plot import detection_figure

        return described(
            detection_figure(self.detected), f"{self.recording.name}: signal, limits, trigger and load cell"
        )

    def __repr__(self) -> str:
        return f"DetectionResult({', '.join(self._words())}; {self._detector} on {PurePath(self.recording.name).name})"

    def _words(self) -> list[str]:
        alarms = sum(len(item.verdict.alarms) for item in self.detections)
        words = counted(alarms, "alarm") if alarms else self.outcome.replace("_", " ")
        return [words, *([counted(len(self.detected.contacts), "contact")] if self.detected.contacts else [])]

    def _repr_html_(self) -> str:
        """Return the verdict on each operation as a table, which a notebook shows."""
        about = f"{self._detector} on {self.recording.name}: {self.detected.threshold}"
        return notebook_table(", ".join(self._words()), self.summary()[_SHOWN], about)


class DetectionResults(_Frames, Sequence[DetectionResult]):
    """What a detector says about several logs: a sequence of `DetectionResult`, with the same frames over all of them.

    Parameters
    ----------
    runs : sequence of DetectionResult
        The logs, or the runs of a log, in their order.
    skipped : sequence of Skipped
        Logs and runs that were left out, with the reason.
    findings : sequence of RecordingFinding
        Findings about the logs.

    Examples
    --------
    >>> import cdtool
    >>> logs = ["sample_logs/gate/stiff/03.csv", "sample_logs/gate/holdout/03.csv"]
    >>> limit = {"threshold.name": "limit", "threshold.limits": 400.0}
    >>> found = cdtool.detect(logs, "sample_logs/gate/machine.toml", detector="momentum", settings=limit)
    >>> found
    DetectionResults(1 alarm in 2 logs; momentum)
    >>> [log.outcome for log in found]
    ['alarm', 'no alarm']
    """

    def __init__(
        self,
        runs: Sequence[DetectionResult],
        skipped: Sequence[Skipped] = (),
        findings: Sequence[RecordingFinding] = (),
    ) -> None:
        self.runs, self.findings = tuple(runs), tuple(findings)
        self._skipped = tuple(skipped)

    @cached_property
    def skipped(self) -> pd.DataFrame:
        """A row per log or run that was left out, with the reason."""
        return rows_as_frame(Skipped, self._skipped)

    def __len__(self) -> int:
        return len(self.runs)

    @overload
    def __getitem__(self, number: int) -> DetectionResult: ...

    @overload
    def __getitem__(self, number: slice) -> DetectionResults: ...

    def __getitem__(self, number: int | slice) -> DetectionResult | DetectionResults:
        """Return the result of a log by its number; of a slice, several."""
        return DetectionResults(self.runs[number]) if isinstance(number, slice) else self.runs[number]

    def __repr__(self) -> str:
        return f"DetectionResults({self._verdict}; {self._detector})"

    @property
    def _verdict(self) -> str:
        alarms = sum(len(item.verdict.alarms) for run in self for item in run.detections)
        left_out = [f"{len(self._skipped)} left out"] if self._skipped else []
        return ", ".join((f"{counted(alarms, 'alarm')} in {counted(len(self), 'log')}", *left_out))

    def _repr_html_(self) -> str:
        """Return the verdict on each operation as a table, which a notebook shows."""
        return notebook_table(self._verdict, self.summary()[_SHOWN], self._detector)


@overload
def detect(  # type: ignore[overload-overlap]  # a str is one log, not a sequence of them
    logs: str | Path,
    machine: str | Path | MachineFile | None = ...,
    *,
    benchmark: str | Path | None = ...,
    signature: str | Path | LearnedSignature | SignatureFile | None = ...,
    detector: str | Detector | None = ...,
    settings: Mapping[str, Any] | None = ...,
) -> DetectionResult: ...


@overload
def detect(
    logs: Sequence[str | Path],
    machine: str | Path | MachineFile | None = ...,
    *,
    benchmark: str | Path | None = ...,
    signature: str | Path | LearnedSignature | SignatureFile | None = ...,
    detector: str | Detector | None = ...,
    settings: Mapping[str, Any] | None = ...,
) -> DetectionResults: ...


def detect(
    logs: str | Path | Sequence[str | Path],
    machine: str | Path | MachineFile | None = None,
    *,
    benchmark: str | Path | None = None,
    signature: str | Path | LearnedSignature | SignatureFile | None = None,
    detector: str | Detector | None = None,
    settings: Mapping[str, Any] | None = None,
) -> DetectionResult | DetectionResults:
    """Run one detector over one log or many: by a signature, by limits set by hand, or by those of the first seconds.

    Parameters
    ----------
    logs : str, Path or sequence of them
        A log, or several.
    machine : str, Path or MachineFile, optional
        The machine file; not with `benchmark`.
    benchmark : str or Path, optional
        A benchmark file: all other settings come from it, except `detector`, which selects one of its detectors,
        `signature`, which replaces its threshold, and `settings`.
    signature : str, Path, LearnedSignature or SignatureFile, optional
        A signature file or what was learned, which contains detector, threshold, joints and activation.
    detector : str or Detector, optional
        Name or short name of the detector, or a detector of your own; needed without a signature.
    settings : mapping, optional
        Values in place of keys of the benchmark file, or of their defaults, as `--set` has them:
        {"threshold.name": "limit", "threshold.limits": 400.0, "activation.debounce": 9, "from": "1.5s"}.

    Returns
    -------
    DetectionResult or DetectionResults
        Of one log: its alarms and contacts as DataFrames, the signal with its limits, and the figure. Of a sequence, a
        sequence of them, with a result for each run of a log that is cut into runs; a log that cannot be read is
        left out and listed in `skipped`.

    Raises
    ------
    UsageError
        No threshold is given, or more than one; the list of logs is empty; a single log is cut into several runs.
    SignatureError
        The signature belongs to another machine or to other gains.
    RecordingError
        A single log cannot be read, or has no channel that the detector needs; or none of several can be used.

    Examples
    --------
    >>> import cdtool
    >>> log, machine = "sample_logs/gate/stiff/03.csv", "sample_logs/gate/machine.toml"
    >>> limit = {"threshold.name": "limit", "threshold.limits": 400.0}
    >>> found = cdtool.detect(log, machine, detector="momentum", settings=limit)
    >>> found.outcome, found.alarms.joint[0], found.detections[0].statistic.unit
    ('alarm', 'gate', 'N')
    >>> found.contacts.latency_ms.between(0.0, 200.0).all().item()
    True
    """
    ready = prepared(machine, benchmark=benchmark, signature=signature, detector=detector, settings=settings)
    if isinstance(logs, str | PathLike):
        runs = ready.detect(location(logs)).runs
        if len(runs) > 1:
            ids = f"{runs[0].recording.source} to {runs[-1].recording.source}"
            raise UsageError(f"{logs}: has {len(runs)} runs, {ids}", "name one, as LOG#ID, or give a list of logs")
        return DetectionResult(runs[0])
    logs = several_logs(logs)
    found: list[DetectedRuns] = []
    skipped: list[Skipped] = []
    for log in logs:
        try:
            found.append(ready.detect(location(log)))
        except (UsageError, SignatureError, OutputError):  # an error in the settings affects every log
            raise
        except CdtoolError as fault:
            skipped.append(Skipped(str(log), str(fault)))
    if skipped and not found:
        raise RecordingError(f"none of {counted(len(skipped), 'log')} can be used, the first: {skipped[0].reason}")
    skipped += [item for log in found for item in log.skipped]
    findings = [item for log in found for item in log.findings]
    return DetectionResults([DetectionResult(run) for log in found for run in log.runs], skipped, findings)
