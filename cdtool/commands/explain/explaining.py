"""Explain every alarm and every missed contact of one detector in one log."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cdtool.alarms.pipeline import Detection
from cdtool.base.plain_text import counted
from cdtool.base.remote.remote_path import location
from cdtool.commands.detecting.detection import Detected
from cdtool.commands.detecting.prepared import PreparedDetector, prepared
from cdtool.commands.scoring.detector_inputs import inputs_of
from cdtool.formats.machine_file import MachineFile
from cdtool.results.explanation.explanation import Explanation, explain_operation
from cdtool.results.results import RecordingFinding, Skipped

if TYPE_CHECKING:
    from cdtool.commands.learning.learning import LearnedSignature
    from cdtool.detectors.base import Detector
    from cdtool.formats.signature_file import SignatureFile


@dataclass(frozen=True)
class ExplainedRun:
    """The detector's results for a run, and for each of its `detections` the explanations in order of time."""

    found: Detected
    explanations: tuple[tuple[Explanation, ...], ...]

    @property
    def events(self) -> list[tuple[Detection, Explanation]]:
        """Return every explanation with its detection."""
        pairs = zip(self.found.detections, self.explanations, strict=True)
        return [(detection, item) for detection, items in pairs for item in items]


@dataclass(frozen=True, repr=False)
class Explained:
    """The explanations for the runs of a log, in its order; `skipped` are runs left out, `findings` concern the log."""

    runs: tuple[ExplainedRun, ...]
    skipped: tuple[Skipped, ...] = ()
    findings: tuple[RecordingFinding, ...] = ()

    def __repr__(self) -> str:
        return f"Explained({counted(len(self.runs), 'run')}, {counted(len(self.events), 'event')})"

    @property
    def events(self) -> list[tuple[Detection, Explanation]]:
        """Return every explanation of all runs with its detection."""
        return [event for run in self.runs for event in run.events]


def explain(
    log: str | Path,
    machine: str | Path | MachineFile | None = None,
    *,
    benchmark: str | Path | None = None,
    signature: str | Path | LearnedSignature | SignatureFile | None = None,
    detector: str | Detector | None = None,
    settings: Mapping[str, Any] | None = None,
) -> Explained:
    """Explain why a detector raised each alarm in a log, and why each contact was missed.

    Parameters
    ----------
    log : str or Path
        The log, or LOG#ID for some of its runs. A log that is not cut into runs is one.
    machine, benchmark, signature, detector, settings : optional
        As for `cdtool.detect`.

    Returns
    -------
    Explained
        For each run the detections, and one explanation per alarm and per contact without one; what was left out.

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
    >>> limit = {"threshold.name": "limit", "threshold.limits": 400.0}
    >>> explained = cdtool.explain(log, machine, detector="momentum", settings=limit)
    >>> [explanation.role for _, explanation in explained.events]
    ['detection']
    """
    ready = prepared(machine, benchmark=benchmark, signature=signature, detector=detector, settings=settings)
    return explain_log(log, ready)


def explain_log(log: str | Path, ready: PreparedDetector) -> Explained:
    """Return the same as `explain`, which has the errors, with a detector that is ready."""
    detected = ready.detect(location(log))
    runs = tuple(_explained(found, ready.machine_file) for found in detected.runs)
    return Explained(runs, detected.skipped, detected.findings)


def _explained(found: Detected, machine_file: MachineFile) -> ExplainedRun:
    explanations = tuple(
        explain_operation(
            detection, matching, found.activation, inputs_of(detection.detector, machine_file), found.normals
        )
        for detection, matching in zip(found.detections, found.matchings, strict=True)
    )
    return ExplainedRun(found, explanations)
