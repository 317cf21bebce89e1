"""Options of the commands that run one detector over logs: set individually or taken from a benchmark file."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

from cdtool.base.errors import UsageError
from cdtool.commands.console.options import (
    BenchmarkOption,
    DebounceOption,
    DetectorOption,
    FromOption,
    HysteresisOption,
    JointsOption,
    LabelsClockOption,
    LabelsOption,
    LatchOption,
    LimitOption,
    MachineUnlessBenchmarkOption,
    MassBeforeCellOption,
    OnsetAboveOption,
    OnsetBackToOption,
    OnsetHoldOption,
    OnsetSeparationOption,
    OnsetSigmasOption,
    OperationsOption,
    RearmOption,
    SignatureOption,
    SynchronisationOption,
    ToOption,
    WarmUpOption,
    WindowOption,
    limits_of,
    listed,
    section_of,
)

if TYPE_CHECKING:
    from cdtool.commands.detecting.detection_options import DetectionOptions
    from cdtool.commands.judging.scoring_rules import ScoringRules

# Allowed together with a benchmark file: which of its detectors, and another threshold.
_WITH_BENCHMARK = ("benchmark", "detector", "signature")


@dataclass(frozen=True, kw_only=True)
class LogOptions:
    """The options given on the command line; None or empty if not given."""

    machine: MachineUnlessBenchmarkOption = None
    benchmark: BenchmarkOption = None
    signature: SignatureOption = None
    limit: LimitOption = ""
    warm_up: WarmUpOption = None
    from_: FromOption = None
    to: ToOption = None
    detector: DetectorOption = None
    joints: JointsOption = ""
    operations: OperationsOption = ""
    debounce: DebounceOption = None
    rearm: RearmOption = None
    hysteresis: HysteresisOption = None
    latch: LatchOption = None
    onset_above: OnsetAboveOption = None
    onset_back_to: OnsetBackToOption = None
    onset_hold: OnsetHoldOption = None
    onset_sigmas: OnsetSigmasOption = None
    onset_separation: OnsetSeparationOption = None
    labels: LabelsOption = None
    labels_clock: LabelsClockOption = None
    synchronisation: SynchronisationOption = None
    window: WindowOption = None
    mass_before_cell: MassBeforeCellOption = None

    def settings(self) -> DetectionOptions:
        """Return the detection settings, with the machine or benchmark file read.

        Raises UsageError for a value outside its range, if neither a machine nor a benchmark file is given, and for a
        setting given together with the benchmark file that contains it. Raises what reading these files raises.
        """
        from cdtool.commands.detecting.detection_options import DetectionOptions
        from cdtool.formats.machine_file import read_machine_file

        limits = limits_of(self.limit)
        if self.benchmark is not None:
            from cdtool.commands.detecting.prepared_detector import prepare_benchmark

            self._refuse_beside(self.benchmark)
            prepared = prepare_benchmark(self.benchmark, detector=self.detector, signature=self.signature)
            return DetectionOptions(benchmark=prepared)
        if self.machine is None:
            raise UsageError("no machine file is given", "give --machine FILE or --benchmark FILE")
        return DetectionOptions(
            read_machine_file(self.machine),
            signature=self.signature,
            detector=self.detector,
            limit=limits,
            warm_up=self.warm_up,
            joints=listed(self.joints),
            section=section_of(self.from_, self.to),
            operations=self.operations or "whole",
            activation={
                "debounce": self.debounce,
                "rearm": self.rearm,
                "hysteresis": self.hysteresis,
                "latch": self.latch,
            },
            rules=self._rules(),
        )

    def _refuse_beside(self, benchmark: Path) -> None:
        for item in fields(self):
            if item.name not in _WITH_BENCHMARK and getattr(self, item.name) not in (None, ""):
                option = f"--{item.name.strip('_').replace('_', '-')}"
                raise UsageError(
                    f"{option} cannot be combined with --benchmark", f"set it in {benchmark}, or omit one of the two"
                )

    def _rules(self) -> ScoringRules:
        from cdtool.commands.judging.scoring_rules import ScoringRules
        from cdtool.formats.labels.labels import read_labels
        from cdtool.truth.onset import OnsetRule

        if self.labels_clock and not self.labels:
            raise UsageError("--labels-clock is only for a label file", "give --labels FILE")
        onset = {name: getattr(self, f"onset_{name}") for name in ("above", "back_to", "hold", "sigmas", "separation")}
        rules = {name: getattr(self, name) for name in ("window", "synchronisation", "mass_before_cell")}
        return ScoringRules(
            onset=OnsetRule(**{name: value for name, value in onset.items() if value is not None}),
            labels=read_labels(self.labels, clock=self.labels_clock or "recording") if self.labels else None,
            **{name: value for name, value in rules.items() if value is not None},
        )
