"""Settings to run one detector over a log, used by `cdtool.detect` and `cdtool.explain`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path

from cdtool.activation import ActivationSettings
from cdtool.errors import UsageError
from cdtool.machine_file import MachineFile, read_machine_file
from cdtool.workflows.benchmark.prepared_detector import PreparedBenchmark, prepare_benchmark
from cdtool.workflows.contacts.scoring_rules import ScoringRules


@dataclass(frozen=True)
class DetectionOptions:
    """The machine and the threshold, or a benchmark file with these and all other settings.

    `signature` or `limit` (one number, or one per joint) is the threshold; a limit requires `detector`. With a limit,
    `joints` are the joints to monitor (default: all); a signature monitors the joints it was learned for.
    `operations`: whole, motion or trigger. `activation`: settings that differ from the signature's or the default.
    `rules`: when contacts begin, and for how long an alarm belongs to a contact.

    With `benchmark`, all of these come from the benchmark file; `detector` then selects one of its detectors, and a
    signature file replaces the threshold.
    """

    machine: str | Path | MachineFile | None = None
    _: KW_ONLY
    benchmark: str | Path | PreparedBenchmark | None = None
    signature: str | Path | None = None
    detector: str | None = None
    limit: Sequence[float] = ()
    joints: Sequence[str] = ()
    operations: str = "whole"
    activation: ActivationSettings | None = None
    rules: ScoringRules | None = None

    def prepared(self) -> PreparedBenchmark | None:
        """Return the benchmark, read and learned, or None; raises UsageError for settings combined with it."""
        if self.benchmark is None:
            return None
        by_hand = self.limit or self.joints or self.operations != "whole" or self.activation or self.rules
        if self.machine is not None or by_hand:
            raise UsageError("settings cannot be combined with a benchmark file", "set them in the benchmark file")
        if isinstance(self.benchmark, PreparedBenchmark):
            return self.benchmark
        return prepare_benchmark(self.benchmark, detector=self.detector, signature=self.signature)

    def machine_file(self) -> MachineFile:
        """Return the machine file, read; raises UsageError if none is given."""
        if isinstance(self.benchmark, PreparedBenchmark):
            return self.benchmark.setup.machine_file
        if self.machine is None:
            raise UsageError("no machine file is given", "give --machine FILE or --benchmark FILE")
        return self.machine if isinstance(self.machine, MachineFile) else read_machine_file(self.machine)
