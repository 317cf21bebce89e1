"""Settings to run one detector over a log, used by `cdtool.detect` and `cdtool.explain`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass, field
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from cdtool.alarms.activation import ActivationSettings
from cdtool.base.errors import UsageError
from cdtool.commands.judging.scoring_rules import ScoringRules
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.recordings.log_section import LogSection
from cdtool.recordings.operations import RunCut

if TYPE_CHECKING:
    from cdtool.commands.detecting.prepared_detector import PreparedBenchmark
    from cdtool.commands.learning.learning import LearnedSignature
    from cdtool.detectors.base import Detector
    from cdtool.formats.signature_file import SignatureFile


@dataclass(frozen=True)
class DetectionOptions:
    """The machine and the threshold, or a benchmark file that contains them: the parameters of `cdtool.detect`."""

    machine: str | Path | MachineFile | None = None
    _: KW_ONLY
    benchmark: str | Path | PreparedBenchmark | None = None
    signature: str | Path | LearnedSignature | SignatureFile | None = None
    detector: str | Detector | None = None
    limit: Sequence[float] = ()
    warm_up: float | None = None
    joints: Sequence[str] = ()
    section: LogSection = field(default_factory=LogSection)
    operations: str = "whole"
    activation: ActivationSettings | None = None
    rules: ScoringRules | None = None

    def __post_init__(self) -> None:
        """Refuse a limit that is a number and not a list."""
        if isinstance(self.limit, int | float):
            raise UsageError(f"limit is {self.limit}, not a list", f"give limit=[{self.limit}], or one per joint")

    def prepared(self) -> PreparedBenchmark | None:
        """Return the benchmark, read and learned, or None; raises UsageError for settings combined with it."""
        if self.benchmark is None:
            return None
        own_threshold = self.limit or self.warm_up is not None
        cut = self.section or self.operations != "whole"
        by_hand = own_threshold or cut or self.joints or self.activation or self.rules
        if self.machine is not None or by_hand:
            raise UsageError("settings cannot be combined with a benchmark file", "set them in the benchmark file")
        if not isinstance(self.benchmark, str | PathLike):
            return self.benchmark
        from cdtool.commands.detecting.prepared_detector import prepare_benchmark

        if not isinstance(self.detector, str | None):
            raise UsageError("a benchmark file names its detectors", "give the name of one of them")
        return prepare_benchmark(self.benchmark, detector=self.detector, signature=self.signature)

    @property
    def has_runs(self) -> bool:
        """Whether the log is cut into runs; a benchmark file must have been read."""
        benchmark = self.benchmark
        if benchmark is not None and not isinstance(benchmark, str | PathLike):
            return benchmark.setup.has_runs
        return RunCut.of(self.operations) is not None

    def machine_file(self) -> MachineFile:
        """Return the machine file, read; raises UsageError if none is given."""
        if self.benchmark is not None and not isinstance(self.benchmark, str | PathLike):
            return self.benchmark.setup.machine_file
        if self.machine is None:
            raise UsageError("no machine file is given", "give --machine FILE or --benchmark FILE")
        return self.machine if isinstance(self.machine, MachineFile) else read_machine_file(self.machine)
