"""Facts about a recording into which a contact was put."""

from __future__ import annotations

from cdtool.findings.finding import TemplateFact
from cdtool.frozen import frozen


@frozen
class InjectedContactFact(TemplateFact):
    """A simulated contact at `start` [s] with the peak force `peak` [N] was added to an impact-free recording."""

    start: float
    peak: float

    words = "injected: a simulated contact at {start:.4f} s, peak {peak:.0f} N, was added to an impact-free recording"
