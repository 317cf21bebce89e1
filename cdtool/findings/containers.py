"""Facts about binary containers: what they do not hold, what is lost, what their checksums and indexes say."""

from __future__ import annotations

from typing import Literal

from cdtool.findings.finding import Fact, TemplateFact
from cdtool.frozen import frozen
from cdtool.plain_text import counted, first_of


@frozen
class ColumnLeftOut(TemplateFact):
    """A column without numbers; `what` it is instead."""

    column: str
    what: str

    subject_field = "column"
    variant_field = "what"
    words = "column '{column}' is {what}: left out"


@frozen
class SegmentCutOff(TemplateFact):
    """A segment of rows has fewer of them than its head states."""

    line: int
    stated: int
    rows: int

    words = "the segment from line {line} on has {rows} of the {stated} rows that its head states"


@frozen
class VariableLeftOut(Fact):
    """A MATLAB variable without real numbers; `what` it is instead, and what to write in MATLAB (empty: nothing)."""

    variable: str
    what: str
    advice: str = ""

    subject_field = "variable"
    variant_field = "what"

    def sentence(self) -> str:
        """Return variable, kind and advice."""
        return f"variable '{self.variable}' is {self.what}: left out{f'; {self.advice}' if self.advice else ''}"


@frozen
class WithoutClock(Fact):
    """A field of a struct of which `rows` values have no clock: the clocks of its struct have other lengths."""

    variable: str
    rows: int

    subject_field = "variable"

    def sentence(self) -> str:
        """Return variable and length."""
        values = counted(self.rows, "value")
        return f"variable '{self.variable}' has {values}, and no clock of its struct is as long: left out"


@frozen
class RunsOfStructs(TemplateFact):
    """The elements of an array of structs have clocks of their own: they are runs, one after the other."""

    array: str
    runs: int
    rows: int

    subject_field = "array"
    words = (
        "'{array}' is an array of structs with clocks of their own: {runs} runs one after the other, {rows} rows; "
        "column '{array}(:)' is the number of the run, '{array}(2).NAME' a field of one run"
    )


@frozen
class RunsWithoutRows(Fact):
    """Elements of an array of structs whose clock is empty."""

    array: str
    runs: tuple[int, ...]

    subject_field = "array"

    def sentence(self) -> str:
        """Return the elements."""
        return f"{first_of([f'{self.array}({run})' for run in self.runs])} of '{self.array}': no rows, left out"


@frozen
class SheetLeftOut(TemplateFact):
    """A sheet of a workbook without a table; `reason` is why."""

    sheet: str
    reason: str

    subject_field = "sheet"
    variant_field = "reason"
    words = "sheet '{sheet}' is left out: {reason}"


@frozen
class ErrorCells(Fact):
    """Cells of a workbook that contain an error; `error` is the first of them, in row `row`."""

    count: int
    error: str
    row: int

    def sentence(self) -> str:
        """Return how many, and the first one."""
        return f"{counted(self.count, 'cell')} with an error (first {self.error} in row {self.row}): taken as missing"


@frozen
class NumbersAmongTexts(Fact):
    """A column of a workbook has numbers as texts with a comma, the first in row `row`, and large integers.

    A program whose decimal mark is the point reads the text 1,234 as 1234 and keeps 1,5 as a text.
    """

    count: int
    text: str
    row: int
    integers: int

    def sentence(self) -> str:
        """Return how many, and what may have happened."""
        return (
            f"{counted(self.count, 'number')} as text with a comma ('{self.text}' in row {self.row}) and "
            f"{self.integers} of 1000 and more without decimals: was 1,234 read as 1234 when a table was opened?"
        )


@frozen
class FormulasWithoutValue(Fact):
    """Formulas of a workbook that was never calculated; `row` is that of the first."""

    count: int
    row: int

    def sentence(self) -> str:
        """Return how many, and what to do."""
        formulas = counted(self.count, "formula")
        return f"{formulas} without a value (first in row {self.row}): taken as missing; open and save it in Excel"


@frozen
class RowsAsColumns(TemplateFact):
    """A matrix with more columns than rows is read across."""

    thing: Literal["dataset", "variable"]
    name: str
    rows: int
    columns: int

    subject_field = "name"
    words = "{thing} '{name}' is {rows} x {columns}: its rows are taken as columns"


@frozen
class PackedValues(TemplateFact):
    """Values are packed by the CF conventions."""

    scale: float
    offset: float

    words = "packed (CF): times {scale:g}, plus {offset:g}"


@frozen
class RoundedIntegers(Fact):
    """Integers of more digits than float64 has."""

    count: int

    def sentence(self) -> str:
        """Return how many."""
        return (
            f"{counted(self.count, 'value')} beyond 2^53: of integers that large the last digits are rounded to float64"
        )


@frozen
class RoundedColumn(TemplateFact):
    """A column of integers of which some have more digits than float64."""

    words = "integers beyond 2^53 are rounded to float64"


@frozen
class ValuesCutOff(TemplateFact):
    """A column ends before its declared length: `count` values are missing from number `first` on."""

    count: int
    first: int

    words = "{count} values from number {first} on are missing"


@frozen
class NeverFinalised(TemplateFact):
    """The recorder did not close the file."""

    words = "the recording was never finalised: its end may be missing"


@frozen
class LastSegmentIncomplete(TemplateFact):
    """The file ends within a segment."""

    words = "the last segment is not complete: the rest of it is lost"


@frozen
class CutBehindRow(TemplateFact):
    """The file is cut off or damaged behind a row."""

    row: int

    words = "the file is cut off or damaged behind row {row}: what came after is lost"


@frozen
class LibraryMessage(TemplateFact):
    """A line that a library wrote about the file."""

    library: str
    text: str

    variant_field = "text"
    words = "{library} says: {text}"


@frozen
class CutWithinMessage(Fact):
    """The last bytes of a file are an incomplete message."""

    size: int

    def sentence(self) -> str:
        """Return how many bytes."""
        return f"the last {counted(self.size, 'byte')} are not a complete message: cut off or damaged, and lost"


@frozen
class MessagesDamaged(TemplateFact):
    """Messages of a file are damaged, and its library skipped them without a count."""

    words = "the file is damaged: messages that cannot be read are lost"


@frozen
class LoggerDropouts(Fact):
    """The logger could not write for a while: `count` times, `total` [s] in all, the longest [s]."""

    count: int
    total: float
    longest: float

    def sentence(self) -> str:
        """Return how often and for how long."""
        dropouts = counted(self.count, "dropout")
        return f"{dropouts} of the logger, {self.total:.3g} s in all, at most {self.longest:.3g} s: messages are lost"


@frozen
class BagDamaged(TemplateFact):
    """A ROS bag is damaged where the count of its messages does not show it; `reason` is its library's."""

    reason: str

    words = "the bag is damaged: {reason}"


@frozen
class BagNotClosed(TemplateFact):
    """A database has a journal beside it: the bag was not closed, or is still being written."""

    journal: str

    words = "the bag was not closed: read from a temporary copy, with its journal {journal}"


@frozen
class DamagedRows(Fact):
    """Rows of a bag that are no messages: without a time, a topic or a payload, or damaged as they were compressed."""

    count: int

    def sentence(self) -> str:
        """Return how many."""
        return f"{counted(self.count, 'row', 'are')} left out: no time, topic or payload that can be read"


@frozen
class StandardDefinitions(Fact):
    """A bag without definitions of its messages, of which these types are standard ones."""

    types: tuple[str, ...]

    def sentence(self) -> str:
        """Return the types."""
        return f"does not contain message definitions: read as the standard ones of {first_of(self.types)}"


@frozen
class MessagesUnreadable(Fact):
    """Of the messages of a topic so many cannot be read; `reason` is empty where the bag does not say why."""

    count: int
    messages: int
    reason: str = ""

    def sentence(self) -> str:
        """Return how many."""
        why = f": {self.reason}" if self.reason else ""
        return f"{self.count} of {counted(self.messages, 'message')} cannot be read{why}"


@frozen
class LostBytes:
    """What is lost at a damaged place: bytes, perhaps a chunk, its messages and its time [s], where these are known."""

    size: int
    is_chunk: bool = False
    messages: int | None = None
    time: tuple[float, float] | None = None

    def __str__(self) -> str:
        parts = [f"{'a chunk of ' if self.is_chunk else ''}{self.size} bytes lost"]
        if self.messages is not None:
            parts.append(f"{self.messages} messages")
        if self.time is not None:
            start, end = self.time
            parts.append(f"{end - start:.3f} s from {start:.3f} s on")
        return ", ".join(parts)


@frozen
class DamagedAt(Fact):
    """A damaged place of a file; `read_before`: nothing behind it, and so many messages before it, could be read."""

    byte: int
    reason: str
    lost: LostBytes
    read_before: int | None = None

    variant_field = "reason"

    def sentence(self) -> str:
        """Return place, reason and loss."""
        where = f"damaged at byte {self.byte} ({self.reason})"
        if self.read_before is None:
            return f"{where}: {self.lost}"
        behind = f"; {self.lost}" if self.lost.size else ""
        return f"{where}: only the part before it was read ({counted(self.read_before, 'message')}){behind}"


@frozen
class MoreDamage(Fact):
    """Damaged places that are not listed one by one."""

    places: int
    size: int
    chunks: int
    messages: int

    def sentence(self) -> str:
        """Return how many, and what is lost in them."""
        return (
            f"damaged at {counted(self.places, 'more place')}: {counted(self.size, 'byte')} and "
            f"{counted(self.chunks, 'chunk')} lost, {counted(self.messages, 'message')} named by indexes"
        )


@frozen
class MessagesLost(Fact):
    """Single messages that are lost for one reason."""

    reason: str
    count: int

    variant_field = "reason"

    def sentence(self) -> str:
        """Return reason and count."""
        return f"{self.reason}: {counted(self.count, 'message')} lost"


@frozen
class ChunksRefused(Fact):
    """Chunks that expand as only a bomb does, or images of a dark camera."""

    count: int

    def sentence(self) -> str:
        """Return how many, and the way out for an honest log."""
        return (
            f"{counted(self.count, 'chunk', 'are')} not damaged but refused: they would grow as only a bomb or images "
            "of nothing do. If the log is yours, `mcap decompress LOG -o PLAIN` (mcap.dev) makes one that is read whole"
        )


@frozen
class SummaryDamaged(Fact):
    """The file's summary is damaged, and so many messages were read without it."""

    reason: str
    messages: int

    def sentence(self) -> str:
        """Return the reason."""
        return f"the summary is damaged ({self.reason}): {counted(self.messages, 'message')} read without it"


@frozen
class MessageCountDiffers(TemplateFact):
    """The file's summary states another number of messages than were read."""

    stated: int
    read: int

    words = "the file's summary says {stated} messages, {read} were read"


@frozen
class Unverified(Fact):
    """Messages that no checksum covers."""

    count: int
    messages: int

    def sentence(self) -> str:
        """Return how many."""
        return f"{self.count} of {counted(self.messages, 'message')} without a checksum: unverified"


@frozen
class SeveralWriters(TemplateFact):
    """Several channels write to one topic."""

    channels: int

    words = "{channels} channels write to it: their messages are one column, sorted by time"


@frozen
class NoMessage(TemplateFact):
    """A log without a message."""

    words = "contains no message"


@frozen
class IndexDisagrees(Fact):
    """Chunks that the summary's index does not have, has alone, or describes otherwise."""

    count: int
    how: Literal["not indexed", "only indexed", "other values"]

    variant_field = "how"

    def sentence(self) -> str:
        """Return how many."""
        verb = {
            "not indexed": "are not in its index",
            "only indexed": "are in its index alone",
            "other values": "have other sizes or times than its index says",
        }[self.how]
        return f"the summary disagrees with the data: {counted(self.count, 'chunk', verb)}"


@frozen
class ChunkTimesDiffer(Fact):
    """Chunks whose headers state other times than those of their messages."""

    chunks: int

    def sentence(self) -> str:
        """Return how many."""
        return f"{counted(self.chunks, 'chunk', 'state')} other times than those of the messages"


@frozen
class ChannelCountsDiffer(TemplateFact):
    """The summary states other message counts by channel."""

    words = "the summary disagrees with the data: other message counts by channel"


@frozen
class DefinedOtherwise(TemplateFact):
    """The summary defines a topic's channel or schema otherwise than the data."""

    words = "the summary defines it otherwise than the data"
