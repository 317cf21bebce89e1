"""How detectors are tuned: the section [tune] of a benchmark file, and what else `cdtool tune` is given."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from cdtool.base.errors import FieldsError, nearest
from cdtool.base.settings import CountFromZero, NotNegative, setting
from cdtool.commands.scoring.benchmark_file import BenchmarkFile
from cdtool.commands.tune.search.grid import SHORTEST_DEBOUNCE
from cdtool.commands.tune.search.objective import WORSE_AT_MOST, Goal
from cdtool.execution.workers import Workers
from cdtool.results.curves.false_alarm_budget import Budget
from cdtool.thresholds import THRESHOLDS


@dataclass(frozen=True, kw_only=True)
class TuneTable:
    """[tune]: what is minimised, and what is tried."""

    objective: Annotated[
        Goal, setting("what is minimised: mean latency, its 95th percentile, or the mean force at the alarm")
    ] = Goal.LATENCY
    thresholds: Annotated[tuple[str, ...], setting("the thresholds to try; default: all")] = ()
    impacts: Annotated[
        Literal["real", "injected", "both"] | None,
        setting("the contacts to tune on; required if the file has real and injected ones"),
    ] = None
    worse_at_most: Annotated[
        NotNegative, setting("share by which a group of contacts may get worse than by default")
    ] = WORSE_AT_MOST
    shortest_debounce_ms: Annotated[NotNegative, setting("the shortest debounce to try", unit="ms")] = (
        1e3 * SHORTEST_DEBOUNCE
    )
    seed: Annotated[CountFromZero, setting("decides which recordings assess which others")] = 0

    def __post_init__(self) -> None:
        known = THRESHOLDS.usable_names() if self.thresholds else []
        for name in self.thresholds:
            if name not in known:
                hint = 'give a list, as ["signature", "glr"]' if "," in name else nearest(name, known)
                raise FieldsError(("thresholds",), f"contains '{name}'", hint)


@dataclass(frozen=True)
class TuningOptions(TuneTable):
    """How detectors are tuned: what `cdtool.tune` describes. Raises UsageError for a budget that is not one."""

    false_alarm_budget: str
    detectors: Sequence[str] = ()
    workers: Workers | None = None

    table: ClassVar[type[TuneTable]] = TuneTable

    def __post_init__(self) -> None:
        super().__post_init__()
        Budget.parse(self.false_alarm_budget)

    @classmethod
    def of(cls, setup: BenchmarkFile, false_alarm_budget: str, **more: Any) -> TuningOptions:
        """Return the options with the values of [tune]."""
        return cls(false_alarm_budget, **vars(setup.tune or TuneTable()), **more)

    @property
    def budget(self) -> Budget:
        """Return the false-alarm budget."""
        return Budget.parse(self.false_alarm_budget)
