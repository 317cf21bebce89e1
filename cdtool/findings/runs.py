"""Facts about a log that is cut into runs."""

from __future__ import annotations

from cdtool.findings.finding import Fact, TemplateFact
from cdtool.frozen import frozen
from cdtool.plain_text import counted, first_of


@frozen
class SamplesOutsideRuns(TemplateFact):
    """`count` of `total` samples belong to no run, as `column` has no value for them."""

    count: int
    total: int
    column: str

    subject_field = "column"
    words = "{count} of {total} samples belong to no run, as '{column}' has no value there: left out"


@frozen
class ReturningIds(Fact):
    """Ids that occur again after another one; `names` are those of the later runs."""

    names: tuple[str, ...]
    column: str

    subject_field = "column"

    def sentence(self) -> str:
        """Return the number of later runs, and the first names."""
        later = counted(len(self.names), "run", "have")
        return f"{later} an id in '{self.column}' that an earlier run has, too: named {first_of(self.names)}"
