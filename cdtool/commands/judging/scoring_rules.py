"""Settings that determine the results of a log, identical in every command that scores one."""

from __future__ import annotations

from dataclasses import dataclass, field

from cdtool.base.errors import UsageError
from cdtool.formats.labels.labels import Labels
from cdtool.results.results import RecordingFinding
from cdtool.truth.onset import OnsetRule


@dataclass(frozen=True)
class ScoringRules:
    """When a contact begins and for how long an alarm belongs to it: the onset rule, labels, `window` [s].

    `synchronisation` [s]: largest offset of the load cell's clock. `mass_before_cell` [kg]: mass that moves with the
    machine between load cell and contact. Raises UsageError for a setting outside its range.
    """

    onset: OnsetRule = field(default_factory=OnsetRule)
    window: float = 1.0
    labels: Labels | None = None
    synchronisation: float = 0.0
    mass_before_cell: float = 0.0

    def __post_init__(self) -> None:
        if not self.window > 0.0:
            raise UsageError(f"window is {self.window:g} s", "give more than 0 s")
        for name, unit in (("synchronisation", "s"), ("mass_before_cell", "kg")):
            if not getattr(self, name) >= 0.0:
                raise UsageError(f"{name} is {getattr(self, name):g} {unit}", f"give 0 {unit} or more")

    @property
    def findings(self) -> tuple[RecordingFinding, ...]:
        """Return what is to be reported about the label file."""
        labels = self.labels
        return tuple(RecordingFinding.of(labels.source, item) for item in labels.findings) if labels else ()
