"""Explaining what one detector said of one log: every alarm, and every contact without one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cdtool.activation import ActivationSettings
from cdtool.evaluation.explanation.explanation import Explanation, explain_operation
from cdtool.evaluation.truth.onset import OnsetRule
from cdtool.machine_file import MachineFile, read_machine_file
from cdtool.pipeline import Detection
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


def explain(
    log: str | Path,
    machine: str | Path | MachineFile,
    *,
    signature: str | Path | None = None,
    detector: str | None = None,
    limit: Sequence[float] = (),
    joints: Sequence[str] = (),
    operations: str = "whole",
    activation: ActivationSettings | None = None,
    onset: OnsetRule | None = None,
    window: float = 1.0,
) -> Explained:
    """Why each alarm of one detector in one log came, and why each contact was missed.

    Arguments and errors are those of `cdtool.workflows.detection.detect`.
    """
    machine_file = machine if isinstance(machine, MachineFile) else read_machine_file(machine)
    found = detect(
        log,
        machine_file,
        signature=signature,
        detector=detector,
        limit=limit,
        joints=joints,
        operations=operations,
        activation=activation,
        onset=onset,
        window=window,
    )
    explanations = tuple(
        explain_operation(
            detection, matching, found.activation, inputs_of(detection.detector, machine_file), found.normals
        )
        for detection, matching in zip(found.detections, found.matchings, strict=True)
    )
    return Explained(found, explanations)
