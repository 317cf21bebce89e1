"""Facts about a log, or a detector, that a command found while it scored contacts and alarms."""

from __future__ import annotations

from cdtool.findings.finding import Fact, TemplateFact
from cdtool.frozen import frozen
from cdtool.plain_text import counted


@frozen
class OnsetUnseen(Fact):
    """Load-cell samples are missing for `hole` [s] where a contact may have begun that is first seen at `time` [s].

    Its latency may be up to `later` [s] longer; None: it is unknown.
    """

    contact: int
    hole: float
    time: float
    later: float | None

    def sentence(self) -> str:
        """Return hole and latency."""
        latency = "is unknown" if self.later is None else f"may be up to {1e3 * self.later:.0f} ms longer"
        return (
            f"load-cell samples are missing for {1e3 * self.hole:.0f} ms where contact {self.contact}, first seen at "
            f"{self.time:.3f} s, may have begun: its latency {latency}"
        )


@frozen
class PeakUnseen(Fact):
    """Load-cell samples are missing for `hole` [s] during a contact."""

    contact: int
    hole: float

    def sentence(self) -> str:
        """Return contact and hole."""
        return (
            f"load-cell samples are missing for {1e3 * self.hole:.0f} ms during contact {self.contact}: "
            "its peak may be larger than the one reported"
        )


@frozen
class NoForce(TemplateFact):
    """A contact's force cannot be computed."""

    contact: int
    reason: str

    words = "contact {contact}: no force: {reason}"


@frozen
class ForceUnassessable(TemplateFact):
    """A force profile cannot assess a contact, since load-cell samples are missing."""

    contact: int
    profile: str
    reason: str

    words = "contact {contact} is not assessable by {profile}: {reason}"


@frozen
class LogNotCut(Fact):
    """Of the strokes in one operation those with these numbers are not assessable."""

    strokes: int
    not_assessable: tuple[int, ...]

    def sentence(self) -> str:
        """Return the strokes, and the next step."""
        number = self.not_assessable
        which = f"stroke {number[0]} is" if len(number) == 1 else f"{len(number)} of them are"
        return (
            f"contains {counted(self.strokes, 'stroke')} in one operation, and {which} not assessable: cut it with "
            'operations = "motion" in the benchmark file, or detect --operations motion'
        )


@frozen
class AssumedImpactFree(TemplateFact):
    """Whether a log is free of impacts cannot be checked; `absent` is the ground truth that is missing from it."""

    absent: str

    words = "{absent}: assumed to be free of impacts"


@frozen
class LearnedFromIt(TemplateFact):
    """The signature was learned from the log."""

    words = "the signature was learned from this log: the absence of alarms is no evidence"


@frozen
class PlotsLeftOut(TemplateFact):
    """Operations with a miss or a false alarm for which no trigger plot is kept."""

    count: int

    words = "{count} more operations with a miss or a false alarm have no trigger plot"


@frozen
class ConditionsNotTunedOn(Fact):
    """Changed conditions of the machine whose recordings tuning does not use."""

    count: int

    def sentence(self) -> str:
        """Return how many, and where their results are."""
        return (
            f"{counted(self.count, 'changed condition')}: not used for tuning: the tuned benchmark files have them, "
            "and cdtool benchmark scores them"
        )


@frozen
class LimitsUnchecked(TemplateFact):
    """Limits that are set for detectors that were not run."""

    count: int
    limits: int
    detectors: str

    words = "{count} of {limits} limits not checked ({detectors} not run)"


@frozen
class DetectorLeftOut(TemplateFact):
    """A detector could not be run."""

    reason: str

    words = "left out: {reason}"


@frozen
class SingleSpeed(TemplateFact):
    """`speed_range` was asked for, but a motion was learned at one speed only."""

    motion: str

    subject_field = "motion"
    words = "speed_range has no effect: of this motion only one speed was learned, {motion}; add runs at another speed"


@frozen
class CreepNotLearned(Fact):
    """Strokes at creep speed were left out from learning; faster strokes of the same logs were learned."""

    strokes: int
    reason: str

    def sentence(self) -> str:
        """Return how many, and why."""
        return f"{counted(self.strokes, 'stroke')} at creep speed not learned, and not assessed: {self.reason}"


@frozen
class SpeedsPooled(TemplateFact):
    """A threshold that does not distinguish speeds was learned from runs at several speeds of one motion."""

    threshold: str
    slowest: str
    fastest: str

    words = (
        "the threshold {threshold} pools runs {slowest} and {fastest}: its limits are too wide for one of them; learn "
        'and score each speed in a benchmark file of its own, or set threshold = "signature", which has limits by speed'
    )


@frozen
class DetectorUnassessable(TemplateFact):
    """A detector can assess none of the runs to learn from."""

    reason: str

    words = "not assessable: {reason}"


@frozen
class NothingLearnedWithout(TemplateFact):
    """A log's own part is needed to learn a detector's threshold, so that the log cannot be scored with the others'."""

    detector: str
    reason: str

    words = "{detector} is not assessable: nothing can be learned from the other recordings: {reason}"


@frozen
class RecordingsWithoutRow(Fact):
    """Recordings without a row for a detector in a trigger file: they are `left_out`, or count as without an alarm."""

    detector: str
    missing: int
    recordings: int
    left_out: bool
    first: str

    def sentence(self) -> str:
        """Return how many, and what they count as."""
        share = f"{self.missing} of {counted(self.recordings, 'recording')}"
        counted_as = "left out" if self.left_out else "counted as monitored without an alarm"
        return f"{self.detector}: {share} without a row: {counted_as}; first {self.first}"
