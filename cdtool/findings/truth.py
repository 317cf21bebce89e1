"""Facts about a load cell as the truth of a log's contacts."""

from __future__ import annotations

from cdtool.findings.finding import Fact, TemplateFact
from cdtool.frozen import frozen
from cdtool.plain_text import counted, digits


def _rounded(value: float, significant: int) -> str:
    return digits(float(f"{value:.{significant}g}"))


@frozen
class FollowsTorque(Fact):
    """The force follows the torque without lag, with the correlation `r`; `joint` is empty where there is but one."""

    joint: str
    r: float

    def sentence(self) -> str:
        """Return joint and correlation."""
        of = f" of {self.joint}" if self.joint else ""
        return f"follows the torque{of} without lag (r = {self.r:.3f}): not an independent truth, if it is made from it"


@frozen
class NotTared(Fact):
    """The load cell rests off zero [N] before its first contact at `onset` [s]."""

    rest: float
    onset: float

    def sentence(self) -> str:
        """Return the rest level."""
        return (
            f"the cell rests at {_rounded(self.rest, 3)} N before the contact at {self.onset:.3f} s: not tared, or "
            "pressed already; forces count from there"
        )


@frozen
class ForceBeginsLate(Fact):
    """The load cell's record begins [s] shortly before its first contact at `onset` [s]."""

    begin: float
    onset: float

    def sentence(self) -> str:
        """Return both times."""
        return (
            f"begins at {self.begin:.3f} s, {1e3 * (self.onset - self.begin):.0f} ms before the contact at "
            f"{self.onset:.3f} s: if that is the rebound of an earlier one, its latency is longer"
        )


@frozen
class ForceLeft(Fact):
    """A small force [N] is left at the end of the contact that began at `onset` [s]."""

    force: float
    onset: float

    def sentence(self) -> str:
        """Return the force."""
        return (
            f"{_rounded(self.force, 2)} N are left at the end of the contact that began at {self.onset:.3f} s: it "
            "still presses, or the reading at rest has shifted and hides later contacts"
        )


@frozen
class RestLevelShifted(Fact):
    """The reading at rest shifted [N] before the contact at `onset` [s], at last by `drift` [N/s]."""

    shift: float
    onset: float
    drift: float

    def sentence(self) -> str:
        """Return shift and drift."""
        rate = f", {_rounded(self.drift, 2)} N/s just before it" if self.drift else ""
        return (
            f"the reading at rest shifted by {_rounded(self.shift, 3)} N before the contact at {self.onset:.3f} s"
            f"{rate}: the onset counts from where it was then"
        )


@frozen
class InProgress(TemplateFact):
    """A contact is in progress when the log begins, until `end` [s]."""

    end: float

    words = "a contact is in progress when it begins, until {end:.3f} s: its onset is not recorded"


@frozen
class ForceMagnitudeUsed(Fact):
    """A force vector is reduced to its magnitude; `rest` [N] is the level of each axis when the log begins."""

    rest: tuple[float, ...]

    def sentence(self) -> str:
        """Return the rest level of each axis."""
        levels = ", ".join(_rounded(level, 3) for level in self.rest)
        return (
            f"magnitude of {len(self.rest)} axes, the rest level of each removed (at first {levels} N): "
            "it cannot tell pushing from pulling; direction in [channels] selects a component"
        )


@frozen
class LabelsWithoutZone(TemplateFact):
    """The dates of a label file have no zone."""

    words = (
        "the dates have no zone: read as UTC, like dates without a zone in a log. If the logs state a zone, set "
        "labels_zone, e.g. '+02:00'"
    )


@frozen
class RowsNotScored(TemplateFact):
    """Rows of a label or trigger file about logs that the benchmark file does not score."""

    names: str
    scored: str

    words = "rows about logs that are not scored are not used: {names}; a scored log is named as {scored}"


@frozen
class KindsExcluded(Fact):
    """Labels that are no contacts, because of their `kinds`."""

    count: int
    kinds: tuple[str, ...]

    def sentence(self) -> str:
        """Return how many, and what follows."""
        kinds = ", ".join(self.kinds)
        verb = "is not a contact" if self.count == 1 else "are not contacts"
        return f"{counted(self.count, 'label')} of kind {kinds} {verb}: an alarm there is a false alarm"
