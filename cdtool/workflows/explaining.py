"""Explaining what one detector said of one log: every alarm, and every contact without one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cdtool.activation import ActivationSettings
from cdtool.errors import UsageError
from cdtool.evaluation.explanation.explanation import Explanation, explain_operation
from cdtool.machine_file import MachineFile, read_machine_file
from cdtool.pipeline import Detection
from cdtool.workflows.benchmark.prepared_detector import PreparedBenchmark, prepare_benchmark
from cdtool.workflows.contacts.scoring_rules import ScoringRules
from cdtool.workflows.detection import Detected, detect
from cdtool.workflows.detector_inputs import inputs_of


@dataclass(frozen=True)
class Explained:
    """What the detector said of a log, and for each of its `detections` the explanations in order of time."""

    found: Detected
    explanations: tuple[tuple[Explanation, ...], ...]

    @property
    def events(self) -> list[tuple[Detection, Explanation]]:
        """Every explanation with its detection."""
        pairs = zip(self.found.detections, self.explanations, strict=True)
        return [(detection, item) for detection, items in pairs for item in items]


def explain(  # noqa: PLR0913  keyword options of the Python API
    log: str | Path,
    machine: str | Path | MachineFile | None = None,
    *,
    benchmark: str | Path | PreparedBenchmark | None = None,
    signature: str | Path | None = None,
    detector: str | None = None,
    limit: Sequence[float] = (),
    joints: Sequence[str] = (),
    operations: str = "whole",
    activation: ActivationSettings | None = None,
    rules: ScoringRules | None = None,
) -> Explained:
    """Why each alarm of one detector in one log came, and why each contact was missed.

    Arguments and errors are those of `cdtool.workflows.detection.detect`.
    """
    if benchmark is not None and not isinstance(benchmark, PreparedBenchmark):
        benchmark = prepare_benchmark(benchmark, detector=detector, signature=signature)
    if benchmark is not None:
        machine_file = benchmark.setup.machine_file
    elif machine is None:
        raise UsageError("no machine file is given", "give --machine FILE or --benchmark FILE")
    else:
        machine_file = machine = machine if isinstance(machine, MachineFile) else read_machine_file(machine)
    found = detect(
        log,
        machine,
        benchmark=benchmark,
        signature=signature,
        detector=detector,
        limit=limit,
        joints=joints,
        operations=operations,
        activation=activation,
        rules=rules,
    )
    explanations = tuple(
        explain_operation(
            detection, matching, found.activation, inputs_of(detection.detector, machine_file), found.normals
        )
        for detection, matching in zip(found.detections, found.matchings, strict=True)
    )
    return Explained(found, explanations)
