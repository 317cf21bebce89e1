"""Settings that determine the results of a log, identical in every command that scores one."""

from __future__ import annotations

from dataclasses import dataclass, field

from cdtool.formats.labels.labels import Labels
from cdtool.results.results import RecordingFinding
from cdtool.truth.onset import OnsetRule


@dataclass(frozen=True)
class ScoringRules:
    """When a contact begins and for how long an alarm belongs to it: the onset rule, labels, `window` [s].

    `synchronisation` [s]: largest offset of the load cell's clock. `mass_before_cell` [kg]: mass that moves with the
    machine between load cell and contact.
    """

    onset: OnsetRule = field(default_factory=OnsetRule)
    window: float = 1.0
    labels: Labels | None = None
    synchronisation: float = 0.0
    mass_before_cell: float = 0.0

    @property
    def findings(self) -> tuple[RecordingFinding, ...]:
        """Return what is to be reported about the label file."""
        labels = self.labels
        return tuple(RecordingFinding.of(labels.source, item) for item in labels.findings) if labels else ()
