"""Explain every alarm and every missed contact of one detector in one log."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from cdtool.alarms.pipeline import Detection
from cdtool.base.errors import UsageError
from cdtool.base.notebook.keyword_options import by_keywords
from cdtool.base.notebook.same_values import equal_by_values
from cdtool.base.notebook.short_repr import short_repr
from cdtool.commands.detecting.detection import Detected, detect_log_runs
from cdtool.commands.detecting.detection_options import DetectionOptions
from cdtool.commands.scoring.detector_inputs import inputs_of
from cdtool.formats.machine_file import MachineFile
from cdtool.results.explanation.explanation import Explanation, explain_operation
from cdtool.results.results import RecordingFinding, Skipped


@dataclass(frozen=True)
class Explained:
    """The detector's results for a log, and for each of its `detections` the explanations in order of time."""

    found: Detected
    explanations: tuple[tuple[Explanation, ...], ...]

    __repr__ = short_repr
    __eq__ = equal_by_values

    @property
    def events(self) -> list[tuple[Detection, Explanation]]:
        """Return every explanation with its detection."""
        pairs = zip(self.found.detections, self.explanations, strict=True)
        return [(detection, item) for detection, items in pairs for item in items]


def explain_log(log: str | Path, options: DetectionOptions) -> Explained:
    """Explain why a detector raised each alarm in a log, and why each contact was missed.

    Parameters
    ----------
    log : str or Path
        The log.
    options : DetectionOptions
        The machine, the detector and its threshold.

    Returns
    -------
    Explained
        The detections, and one explanation per alarm and per contact without one.

    Raises
    ------
    UsageError
        No threshold is given, or two are.
    SignatureError
        The signature belongs to another machine or to other gains.
    RecordingError
        The log cannot be read, or has no channel that the detector needs.

    Examples
    --------
    >>> import cdtool
    >>> log, machine = "sample_logs/gate/stiff/03.csv", "sample_logs/gate/machine.toml"
    >>> explained = cdtool.explain(log, machine, detector="momentum", limit=[400.0])
    >>> [type(explanation).__name__ for _, explanation in explained.events]
    ['AlarmExplanation']
    """
    found = explain_log_runs(log, options).runs
    if len(found) > 1:
        raise UsageError(f"{log}: has {len(found)} runs", "name one, as LOG#ID, or call explain_runs")
    return found[0]


explain = by_keywords(DetectionOptions, explain_log)


@dataclass(frozen=True)
class ExplainedRuns:
    """The explanations for the runs of a log, in its order; `skipped` are runs left out, `findings` concern the log."""

    runs: tuple[Explained, ...]
    skipped: tuple[Skipped, ...] = ()
    findings: tuple[RecordingFinding, ...] = ()

    __repr__ = short_repr


def explain_log_runs(log: str | Path, options: DetectionOptions) -> ExplainedRuns:
    """Explain the alarms and missed contacts in each run of a log; a log that is not cut into runs is one.

    Parameters
    ----------
    log : str or Path
        The log, or LOG#ID for some of its runs.
    options : DetectionOptions
        The machine, the detector and its threshold.

    Returns
    -------
    ExplainedRuns
        The same as `explain` for each run, and what was left out.

    Raises
    ------
    UsageError
        No threshold is given, or two are.
    SignatureError
        The signature belongs to another machine or to other gains.
    RecordingError
        The log cannot be read, or has no channel that the detector needs.

    Examples
    --------
    >>> import cdtool
    >>> machine = "sample_logs/gate/machine.toml"
    >>> found = cdtool.explain_runs("sample_logs/gate/stiff/03.csv", machine, detector="momentum", limit=[400.0])
    >>> [len(run.events) for run in found.runs]
    [1]
    """
    if benchmark := options.prepared():
        options, machine_file = DetectionOptions(benchmark=benchmark), benchmark.setup.machine_file
    else:
        machine_file = options.machine_file()
        options = replace(options, machine=machine_file)
    detected = detect_log_runs(log, options)
    runs = tuple(_explained(found, machine_file) for found in detected.runs)
    return ExplainedRuns(runs, detected.skipped, detected.findings)


explain_runs = by_keywords(DetectionOptions, explain_log_runs)


def _explained(found: Detected, machine_file: MachineFile) -> Explained:
    explanations = tuple(
        explain_operation(
            detection, matching, found.activation, inputs_of(detection.detector, machine_file), found.normals
        )
        for detection, matching in zip(found.detections, found.matchings, strict=True)
    )
    return Explained(found, explanations)
