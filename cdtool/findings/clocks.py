"""Facts about clocks: stamps, steps, gaps, units of time."""

from __future__ import annotations

from abc import abstractmethod
from typing import Literal

from cdtool.findings.finding import Fact, TemplateFact
from cdtool.frozen import frozen
from cdtool.plain_text import counted, first_of

# Of a table's columns, what to do follows from the finding that no clock, or which one, is used.
_OTHER_STAMPS = "; choose other stamps in a machine file: [channels.mcap] time = { clock = ... }"
_OWN_CLOCKS = 'time = { column = "time", unit = "s" }'


@frozen
class TwoReadings:
    """A first stamp read as `years` in the stated unit, and as a `day` in the unit that is meant, since 1970."""

    stamp: float
    stated: str
    years: float
    meant: str
    day: str

    def __str__(self) -> str:
        return (
            f"its first stamp {self.stamp:.15g} is {self.years:,.0f} years in {self.stated}, "
            f"and {self.day} in {self.meant} since 1970"
        )


@frozen
class ClockDifference:
    """In what two clocks differ in the same rows: their steps, their start, or how far they drift apart."""

    what: Literal["steps", "start", "drift"]
    first: float
    other: float

    def __str__(self) -> str:
        if self.what == "steps":
            return f"their steps are {self.other:.4g} and {self.first:.4g}"
        if self.what == "start":
            return f"it starts at {self.other:.6g}, not {self.first:.6g}"
        return f"they drift apart by {self.other:.3g}"


@frozen
class DroppedStamps(Fact):
    """So many of `rows` stamps were dropped; `first` are the first of them, by number of `row_name` in the file."""

    count: int
    rows: int
    first: tuple[int, ...]
    row_name: str

    @property
    @abstractmethod
    def verb(self) -> str:
        """What the stamps do, in the plural."""

    @property
    def cause(self) -> str:
        """Why they do so and what to do, where that is known."""
        return ""

    def sentence(self) -> str:
        """Return how many, where, and which share of the rows."""
        share = self.count / self.rows
        percent = f"{100.0 * share:.2g}" if share < 0.1 else f"{100.0 * share:.0f}"
        shown = ", ".join(map(str, self.first)) + (", ..." if self.count > len(self.first) else "")
        stamps = counted(self.count, "time stamp", self.verb)
        cause = f"; {self.cause}" if self.cause else ""
        return f"{stamps} ({self.row_name} {shown}), dropped ({percent} % of the rows){cause}"


@frozen
class RepeatedStamps(DroppedStamps):
    """Stamps equal to the one before."""

    verb = "repeat"


@frozen
class UnknownStamps(DroppedStamps):
    """Stamps that are no number."""

    verb = "are no number"


@frozen
class StrayStamps(DroppedStamps):
    """Stamps far off those around them."""

    verb = "lie far off those around them"


@frozen
class StuckStamps(DroppedStamps):
    """Stamps of a coarse clock that stand still for longer than its step."""

    verb = "stand still beyond a coarse clock's step"
    cause = "the clock was stuck"


@frozen
class ClockRestart:
    """Why stamps run backward: a counter of so many bits wraps, or (0) the clock starts again."""

    wrapped_bits: int = 0

    def __str__(self) -> str:
        if not self.wrapped_bits:
            return (
                "the clock starts again there, or has jumped ahead before: cut the log there (operations "
                '= "clock-reset" in the benchmark file, or detect --operations clock-reset), or correct its stamps'
            )
        return (
            f"the counter of {self.wrapped_bits} bits wraps there: log a wider one, "
            f"or add {2**self.wrapped_bits} to the stamps from each wrap on"
        )


@frozen
class BackwardStamps(DroppedStamps):
    """Stamps below one before them; without a `restart` a few stray ones."""

    restart: ClockRestart | None = None

    verb = "run backward"

    @property
    def cause(self) -> str:
        """The wrap or the restart."""
        return str(self.restart or "")


@frozen
class CoarseClock(Fact):
    """So large a share of the stamps repeats that a straight line through them replaces them."""

    share: float
    step_ms: float

    def sentence(self) -> str:
        """Return share and step."""
        return (
            f"{100.0 * self.share:.0f} % of the time stamps repeat: a coarse clock of steps of {self.step_ms:.3g} ms, "
            "replaced by a causal straight line"
        )


@frozen
class Gap:
    """A gap begins behind the sample at `time` [s] and is `length` [s] long."""

    time: float
    length: float

    def __str__(self) -> str:
        return f"{self.time:.3f} s ({self.length * 1e3:.0f} ms)"


@frozen
class SampleGaps(Fact):
    """So many gaps between samples, with the first of them."""

    count: int
    first: tuple[Gap, ...]

    def sentence(self) -> str:
        """Return how many, and the first ones."""
        rest = self.count - len(self.first)
        more = f" and {rest} more" if rest > 0 else ""
        return f"{counted(self.count, 'gap')} after {', '.join(map(str, self.first))}{more}"


@frozen
class Jitter(Fact):
    """The standard deviation of the steps as a share of the `period` [s]."""

    share: float
    period: float

    def sentence(self) -> str:
        """Return share and period."""
        return f"the sample period varies by {100 * self.share:.0f} % (std) about {self.period * 1e3:.3g} ms"


@frozen
class OutOfOrder(Fact):
    """So many of `messages` are out of order, by up to `back` [s]; they are sorted.

    The clock was `set_back` where that is more than a recorder's threads explain; `worst` is the message furthest back.
    """

    count: int
    messages: int
    back: float
    set_back: bool = False
    worst: int = 0

    def sentence(self) -> str:
        """Return how many and by how much."""
        late = f"{self.count} of {counted(self.messages, 'message')} out of order, by up to {self.back * 1e3:.4g} ms"
        if not self.set_back:
            return f"{late}: sorted by time"
        where = f"message {self.worst} is stamped {self.back:.4g} s before one ahead of it"
        return f"{where}; {late}: sorted by time. Was the clock set or restarted?"


@frozen
class FileUnitImplausible(Fact):
    """The unit that a container states for its clock cannot be right."""

    readings: TwoReadings

    def sentence(self) -> str:
        """Return both readings, and which one counts."""
        return (
            f"the file says {self.readings.stated}, but {self.readings}: taken to be {self.readings.meant}; "
            "if that is wrong, name another clock in [channels] time"
        )


@frozen
class HeaderUnitImplausible(Fact):
    """The unit that a table's header states for its clock cannot be right."""

    readings: TwoReadings

    def sentence(self) -> str:
        """Return both readings, and which one counts."""
        return (
            f"the header says {self.readings.stated}, but {self.readings}: taken to be {self.readings.meant}; "
            "a machine file says it for sure"
        )


@frozen
class AssumedClock(Fact):
    """The column is taken to be the clock, in a unit that follows from its header, `start` or steps."""

    unit: str
    evidence: Literal["header", "name", "epoch", "excel", "steps"]
    start: float
    step: float

    def sentence(self) -> str:
        """Return unit and evidence."""
        why = {
            "header": "its header says so",
            "name": "its name says so",
            "epoch": f"from its start, {self.start:.0f} after 1970",
            "excel": f"as Excel counts them, from its start {self.start:.9g} and its steps of {self.step:.3g}",
            "steps": f"from its steps of {self.step:.4g}",
        }[self.evidence]
        return f"taken to be the clock, in {self.unit} ({why}); a machine file says it for sure"


@frozen
class StepsImplausible(Fact):
    """Steps [s] that no log has in the `stated` unit; in the `likely` one they are `rate` [Hz]."""

    step: float
    stated: str
    header: str
    likely: str
    rate: float

    def sentence(self) -> str:
        """Return the steps in both units."""
        header = f", as its header says '{self.header}'" if self.header else ""
        return (
            f"steps of {self.step:.3g} s in {self.stated}{header}; in {self.likely} they are {self.rate:.4g} Hz: "
            f'write unit = "{self.likely}" if that is the rate'
        )


@frozen
class ClockUnitContradicted(Fact):
    """The clock's header states another unit, by the factor `ratio` (0: not a time), than the machine file does.

    The machine file states a unit, or that samples are counted at `rate` [Hz] (0: it does not).
    """

    header: str
    header_unit: str
    stated: str
    rate: float = 0.0
    ratio: float = 0.0

    def sentence(self) -> str:
        """Return both units."""
        stated = f"counts samples at {self.rate:g} Hz" if self.rate else self.stated
        ratio = f" (a factor of {self.ratio:.4g})" if self.ratio else ""
        advice = f'write unit = "{self.header_unit}" if the header is right' if self.ratio else "is it another column?"
        return f"the header says '{self.header}', the machine file {stated}{ratio}: {advice}"


@frozen
class NoClock(TemplateFact):
    """No column of a table looks like its clock."""

    words = (
        "no column looks like a clock: rates, gaps and times are unknown; name it, or the sample rate, in [channels] "
        "time of a machine file"
    )


def _named(doubt: str, is_named: bool) -> str:
    return f"named as a clock, but {doubt}" if is_named else doubt


@frozen
class StandingClock(Fact):
    """All stamps of a clock, or of a column that is `named` as one, are the same."""

    stamps: int
    named: bool

    def sentence(self) -> str:
        """Return how many stamps."""
        remedy = (
            "; name another one, or the sample rate, in [channels] time of a machine file" if not self.named else ""
        )
        return _named(f"all of its {self.stamps} stamps are the same: the clock stands still{remedy}", self.named)


@frozen
class CoarseStamps(Fact):
    """A share of the stamps of a clock, or of a column that is `named` as one, repeats."""

    share: float
    named: bool

    def sentence(self) -> str:
        """Return the share."""
        remedy = "" if self.named else _OTHER_STAMPS
        return _named(f"{100.0 * self.share:.3g} % of its stamps repeat: a coarse clock{remedy}", self.named)


@frozen
class EmptyClock(Fact):
    """A column that is named as a clock contains no time stamp."""

    def sentence(self) -> str:
        """Return that it is empty."""
        return _named("it contains no time stamp", True)


@frozen
class BackwardClock(Fact):
    """A column that is named as a clock runs backward at so many steps."""

    steps: int

    def sentence(self) -> str:
        """Return at how many steps."""
        return _named(f"it runs backward at {self.steps} of its steps", True)


@frozen
class OtherClock(Fact):
    """A second clock in a table, next to these columns, whose times are not those of the `first` one."""

    first: str
    difference: ClockDifference
    columns: tuple[str, ...]

    def sentence(self) -> str:
        """Return the difference, and how to use both clocks."""
        return (
            f"another clock than '{self.first}' ({self.difference}), next to {first_of(self.columns)}; "
            f"{_OWN_CLOCKS} in a machine file gives each channel the clock beside it"
        )


@frozen
class OwnClocks(Fact):
    """Each channel of a table is on the clock beside it."""

    clocks: tuple[str, ...]

    def sentence(self) -> str:
        """Return the clocks."""
        clocks = ", ".join(f"'{name}'" for name in self.clocks)
        return f"each channel is on the clock beside it: {clocks}"


@frozen
class LowerRate(Fact):
    """A channel of a table has a value in a `share` of the rows only, at a rate [Hz] of its own."""

    rate: float
    share: float

    def sentence(self) -> str:
        """Return the rate, and what its empty cells are."""
        return (
            f"has a value in {100.0 * self.share:.3g} % of the rows: a rate of its own, {self.rate:.6g} Hz, "
            "and its empty cells are no samples"
        )


@frozen
class ClockUnitAssumed(Fact):
    """Clocks of a table without a unit in the header, which are read in s; the first of them has this step."""

    clocks: tuple[str, ...]
    step: float

    def sentence(self) -> str:
        """Return the clocks, the rate that follows, and what to write."""
        rate = f", at {1.0 / self.step:.6g} Hz" if self.step > 0.0 else ""
        return (
            f"no unit in the header of {first_of(self.clocks)}: read in s{rate}; "
            f"write the unit in the header if that is wrong, e.g. '{self.clocks[0]} [ms]'"
        )


@frozen
class ValuesWithoutTime(Fact):
    """Values in rows in which their clock is empty."""

    count: int

    def sentence(self) -> str:
        """Return how many."""
        return f"{counted(self.count, 'value')} in rows in which its clock is empty: left out"


@frozen
class RepeatedRows(Fact):
    """Rows that repeat the one before, with which a program filled a channel of a lower rate."""

    count: int

    def sentence(self) -> str:
        """Return how many."""
        return (
            f"{counted(self.count, 'row')} with the time and the values of the one before: "
            "filled with the previous value, left out"
        )


@frozen
class StatedPeriodDiffers(Fact):
    """The steps of a clock are not the period [s] that the head of the file states."""

    stated: float
    step: float

    def sentence(self) -> str:
        """Return both."""
        return (
            f"its clock has steps of {1e3 * self.step:.6g} ms, but the file states a sample time of "
            f"{1e3 * self.stated:.6g} ms: is the clock right?"
        )


@frozen
class WrittenTimes(Fact):
    """How dates and times are written, what their seconds count from, and how often the clock wrapped.

    `days_column` contains the days of times without a date.
    """

    pattern: str
    since: str
    days_column: str = ""
    wraps: str = ""
    wrapped: int = 0

    def sentence(self) -> str:
        """Return layout and start."""
        first = ""
        if self.days_column:
            first = f"joined with the days of column '{self.days_column}'; "
        elif self.wrapped:
            first = f"passes {self.wraps} {self.wrapped} times; "
        return f"{first}written as {self.pattern}; in s since {self.since}"


@frozen
class StampsAsSeconds(TemplateFact):
    """Time stamps are taken as seconds from the first one, an ISO date."""

    start: str

    words = "time stamps: taken as seconds from {start}"


@frozen
class DaysOfMatlab(TemplateFact):
    """A column of days as MATLAB's datenum counts them, since `start`, an ISO date."""

    start: str

    words = "counts days, as MATLAB's datenum does: read in s since {start}"


@frozen
class UnusableClock(TemplateFact):
    """A dataset with a unit of time cannot be a clock."""

    reason: str

    words = "{reason}: it is not a clock"


@frozen
class ClocksWithoutUnit(Fact):
    """Datasets of several groups are named as clocks and have no unit of time."""

    datasets: tuple[str, ...]

    def sentence(self) -> str:
        """Return the datasets, and what they need."""
        return (
            f"{first_of(self.datasets)} look like the clocks of their groups, but have no unit of time: "
            "the attribute unit makes each the clock of its group"
        )


@frozen
class NoStartTime(Fact):
    """Waveforms without a start time beside others that have one."""

    channels: tuple[str, ...]

    def sentence(self) -> str:
        """Return the channels, and what is assumed."""
        return f"no start time (wf_start_time) in {first_of(self.channels)}: taken to begin with the first of them"


@frozen
class StartAssumed(Fact):
    """Channels without a date and time beside others that have them."""

    channels: tuple[str, ...]

    def sentence(self) -> str:
        """Return the channels, and what is assumed."""
        return f"no date and time of {first_of(self.channels)}: taken to begin with the first of the others"


@frozen
class DerivedTimes(Fact):
    """Channels that have other sample times than the one to which the column of times belongs."""

    channels: tuple[str, ...]

    def sentence(self) -> str:
        """Return the channels, and where their times come from."""
        return f"X_Value is not the time of {first_of(self.channels)}: taken from Delta_X, in each packet of samples"


@frozen
class HeaderDelay(TemplateFact):
    """How much later messages were logged than stamped [ms]: the median, and 5 and 95 %."""

    median: float
    low: float
    high: float

    words = "logged {median:.3f} ms (median; 5 to 95 %: {low:.3f} to {high:.3f} ms) after the header's stamp"


@frozen
class SteadyHeader(TemplateFact):
    """The times of the log vary, and those in the headers of the messages do not."""

    words = (
        'the header\'s stamps are regular: write time = {{ clock = "header" }} in [channels.mcap] of the machine file'
    )


@frozen
class HeaderUnset(TemplateFact):
    """The stamps in the messages' headers are all 0."""

    words = "the header's stamps are never set: use the log clock"


@frozen
class ClocksApart(TemplateFact):
    """The channel begins `distance` [s] after the channel `before` ends."""

    distance: float
    before: str

    words = (
        "begins {distance:.6g} s after {before} ends: their clocks have no time in common; choose another clock in "
        "the machine file, or a time_offset"
    )


@frozen
class FileAligned(Fact):
    """The clock of a channel's own file is shifted [s] to that of the log, known `within` [s]; `cut`: left out."""

    file_name: str
    shift: float
    how: Literal["offset", "epoch", "trigger"]
    within: float
    cut: int

    def sentence(self) -> str:
        """Return the shift, where it is from, and how far it is known."""
        by = {
            "offset": "as time_offset states",
            "epoch": "both count from 1970",
            "trigger": f"by the trigger in both, known to {1e3 * self.within:.3g} ms",
        }[self.how]
        cut = f"; {counted(self.cut, 'sample')} outside the log left out" if self.cut else ""
        return f"from {self.file_name}, its times shifted by {self.shift:.6g} s ({by}){cut}"


@frozen
class TriggersDiffer(TemplateFact):
    """The trigger rises `in_log` times in the log and `in_file` times in the file of the load cell."""

    in_log: int
    in_file: int

    words = "its trigger rises {in_file} times in its own file, {in_log} times in the log: aligned by the first of each"


@frozen
class TriggersDrift(TemplateFact):
    """The distances of the triggers differ by `spread` [ms] over `span` [s]: a drift of `ppm`."""

    spread: float
    span: float
    ppm: float

    words = (
        "its clock runs apart from the log's: the triggers' distances differ by {spread:.3g} ms over {span:.3g} s "
        "({ppm:.3g} ppm); aligned in the middle"
    )
