"""benchmark.toml: which logs to learn from, which to score, with which detectors. Paths are relative to the file."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cdtool.detectors import DETECTORS
from cdtool.errors import ConfigurationError, UsageError, nearest
from cdtool.evaluation.onset import OnsetRule
from cdtool.machine_file import MachineFile, read_machine_file
from cdtool.operations import HOW_TO_CUT
from cdtool.tables import Table, read_toml
from cdtool.thresholds import THRESHOLDS
from cdtool.thresholds.alignment import ALIGNMENTS
from cdtool.thresholds.signature import RULES, SIDES, Signature
from cdtool.workflows.runs import find_logs

HOLDOUT = "holdout"


@dataclass(frozen=True)
class BenchmarkFile:
    """A validated benchmark file with its globs resolved."""

    path: Path
    machine_file: MachineFile
    detectors: tuple[str, ...]
    watched: tuple[str, ...]
    operations: str
    window: float
    threshold: str
    signature: Signature
    debounce: int | None
    onset: OnsetRule
    learn: tuple[Path, ...]
    holdout: tuple[Path, ...]
    impacts: Mapping[str, tuple[Path, ...]]
    digest: str

    @property
    def groups(self) -> tuple[str, ...]:
        """The impact groups, then the hold-out."""
        return (*self.impacts, HOLDOUT) if self.holdout else tuple(self.impacts)


def read_benchmark_file(path: str | Path) -> BenchmarkFile:
    """Read and check a benchmark file; raises ConfigurationError naming the key."""
    file = Path(path)
    root = Table(read_toml(file), str(file))
    base = file.parent
    machine_file = read_machine_file(base / root.text("machine"))
    names = tuple(machine_file.detector(name).name for name in root.texts("detectors"))
    if len(set(names)) < len(names):
        raise root.fault("detectors", "names a detector twice", "name each once")
    signature, debounce = _signature(root.table("signature"), machine_file.machine.default_sides)
    learn = _logs(root.table("learn", required=True), base)
    holdout = _logs(root.table(HOLDOUT), base) if HOLDOUT in root else ()
    groups = root.table("impacts")
    if HOLDOUT in groups.values:
        raise groups.fault(HOLDOUT, "is the name of the impact-free group", "choose another name for the impacts")
    impacts = {name: _logs(groups.table(name), base) for name in groups.values}
    if not impacts and not holdout:
        raise root.fault("impacts", "is missing", "name groups of impact logs: [impacts.stiff] logs = [...]")
    benchmark = BenchmarkFile(
        path=file,
        machine_file=machine_file,
        detectors=names,
        watched=_watched(root, machine_file.machine.joints),
        operations=root.choice("operations", HOW_TO_CUT, "whole"),
        window=root.number("window_s", 1.0, above=0.0),
        threshold=root.choice("threshold", THRESHOLDS.names(), "signature"),
        signature=signature,
        debounce=debounce,
        onset=_onset(root.table("onset")),
        learn=learn,
        holdout=holdout,
        impacts=impacts,
        digest=hashlib.sha256(file.read_bytes()).hexdigest(),
    )
    root.finish()
    _refuse_overlap(benchmark)
    return benchmark


def with_detectors(setup: BenchmarkFile, names: Sequence[str]) -> BenchmarkFile:
    """The same with other detectors, each named once, or with all that are registered where `all` is named.

    Raises ConfigurationError for an unknown name, UsageError for one that is named twice.
    """
    known = DETECTORS.names(plugins=True) if list(names) == ["all"] else names
    chosen = tuple(setup.machine_file.detector(name).name for name in known)
    if len(set(chosen)) < len(chosen):
        raise UsageError(f"detectors {', '.join(names)} name one twice", "name each once")
    return replace(setup, detectors=chosen)


def _logs(table: Table, base: Path) -> tuple[Path, ...]:
    logs = tuple(find_logs(table.texts("logs"), base, table.key("logs")))
    table.finish()
    return logs


def _watched(table: Table, joints: Sequence[str]) -> tuple[str, ...]:
    watched = table.texts("joints", ())
    for joint in watched:
        if joint not in joints:
            raise table.fault("joints", f"names '{joint}', which the machine file does not", nearest(joint, joints))
    return watched


def _signature(table: Table, default_sides: str) -> tuple[Signature, int | None]:
    settings: dict[str, Any] = {
        "rule": table.choice("rule", RULES, "pooled"),
        "sides": table.choice("sides", SIDES, default_sides),
        "alignment": table.choice("alignment", ALIGNMENTS, "time_then_position"),
        "position_step": table.number("position_step", Signature.position_step, above=0.0),
        "position_window": table.number("position_window", Signature.position_window, above=0.0),
        "force": table.flag("force", False),
    }
    if "safety_factor" in table:
        settings["safety_factor"] = table.number("safety_factor", above=0.0)
    debounce = None
    if "debounce" in table:
        debounce = table.whole("debounce", 1, minimum=1)
    table.finish()
    return Signature(**settings), debounce


def _onset(table: Table) -> OnsetRule:
    above = table.number("above_n", above=0.0) if "above_n" in table else None
    back_to = table.number("back_to_n", above=0.0) if "back_to_n" in table else None
    if above is not None and back_to is not None and back_to > above:
        raise table.fault("back_to_n", f"is {back_to:g}, more than above_n", "at most above_n")
    rule = OnsetRule(
        above=above,
        back_to=back_to,
        samples=table.whole("samples", OnsetRule.samples, minimum=1),
        sigmas=table.number("sigmas", OnsetRule.sigmas, above=0.0),
        separation=table.number("separation_s", OnsetRule.separation, above=0.0),
    )
    table.finish()
    return rule


def _refuse_overlap(benchmark: BenchmarkFile) -> None:
    learned = {path.resolve() for path in benchmark.learn}
    scored: Sequence[Path] = [*benchmark.holdout, *(path for group in benchmark.impacts.values() for path in group)]
    for path in scored:
        if path.resolve() in learned:
            raise ConfigurationError(
                f"{benchmark.path}: {path} is learned from and scored",
                "a recording may be in [learn] or scored, not both",
            )
