"""Explain every alarm and every missed contact of one detector in one log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from cdtool.alarms.pipeline import Detection
from cdtool.base.plain_text import counted
from cdtool.commands.detecting.detection import Detected, detect_log
from cdtool.commands.detecting.detection_options import DetectionOptions
from cdtool.commands.scoring.detector_inputs import inputs_of
from cdtool.formats.machine_file import MachineFile
from cdtool.recordings.log_section import LogSection
from cdtool.results.explanation.explanation import Explanation, explain_operation
from cdtool.results.results import RecordingFinding, Skipped

if TYPE_CHECKING:
    from cdtool.alarms.activation import ActivationSettings
    from cdtool.commands.detecting.prepared_detector import PreparedBenchmark
    from cdtool.commands.judging.scoring_rules import ScoringRules
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


def explain(  # noqa: PLR0913  # the public function: a keyword for each setting
    log: str | Path,
    machine: str | Path | MachineFile | None = None,
    *,
    benchmark: str | Path | PreparedBenchmark | None = None,
    signature: str | Path | LearnedSignature | SignatureFile | None = None,
    detector: str | Detector | None = None,
    limit: Sequence[float] = (),
    warm_up: float | None = None,
    joints: Sequence[str] = (),
    section: LogSection = LogSection(),
    operations: str = "whole",
    activation: ActivationSettings | None = None,
    rules: ScoringRules | None = None,
) -> Explained:
    """Explain why a detector raised each alarm in a log, and why each contact was missed.

    Parameters
    ----------
    log : str or Path
        The log, or LOG#ID for some of its runs. A log that is not cut into runs is one.
    machine, benchmark, signature, detector, limit, warm_up, joints, section, operations, activation, rules : optional
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
    >>> explained = cdtool.explain(log, machine, detector="momentum", limit=[400.0])
    >>> [explanation.role for _, explanation in explained.events]
    ['detection']
    """
    options = DetectionOptions(
        machine,
        benchmark=benchmark,
        signature=signature,
        detector=detector,
        limit=limit,
        warm_up=warm_up,
        joints=joints,
        section=section,
        operations=operations,
        activation=activation,
        rules=rules,
    )
    return explain_log(log, options)


def explain_log(log: str | Path, options: DetectionOptions) -> Explained:
    """Return the same as `explain`, which has the errors, of options that the command line has read."""
    if benchmark := options.prepared():
        options, machine_file = DetectionOptions(benchmark=benchmark), benchmark.setup.machine_file
    else:
        machine_file = options.machine_file()
        options = replace(options, machine=machine_file)
    detected = detect_log(log, options)
    runs = tuple(_explained(found, machine_file) for found in detected.runs)
    return Explained(runs, detected.skipped, detected.findings)


def _explained(found: Detected, machine_file: MachineFile) -> ExplainedRun:
    explanations = tuple(
        explain_operation(
            detection, matching, found.activation, inputs_of(detection.detector, machine_file), found.normals
        )
        for detection, matching in zip(found.detections, found.matchings, strict=True)
    )
    return ExplainedRun(found, explanations)
