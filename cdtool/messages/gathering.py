"""The wanted fields of one topic, gathered batch by batch into columns."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from cdtool.columns import Column
from cdtool.errors import RecordingError
from cdtool.findings import Finding
from cdtool.findings.messages import EmptyArrays, OtherJointsOnly
from cdtool.large_integers import rounded_integers
from cdtool.messages.batch import Batch
from cdtool.messages.columns import Picked
from cdtool.messages.columns.gathered import ABSENT, OTHER_JOINTS
from cdtool.messages.decoders import Decoders
from cdtool.messages.fields import Field, FieldMissingError, missing
from cdtool.messages.rows import Rows
from cdtool.messages.stamp_order import StampOrders, Stamps
from cdtool.messages.stream import Stream
from cdtool.messages.taken import Bound, Destination, Numbers, Part
from cdtool.recording import FloatArray


class _Field:
    """One field's values of all decoded messages; `elsewhere` marks those that name other joints only."""

    def __init__(self, field: Field, expected: int) -> None:
        self.field = field
        self.rows = Rows(expected)
        self.elsewhere: Rows | None = None
        self.widths: Counter[int] = Counter()
        self.names: list[str] = []
        self.exact = False  # its numbers' type is one that float64 holds

    def add(self, picked: Picked, whole: npt.NDArray[np.bool_], all_whole: bool) -> None:
        if picked.alike and all_whole and self.elsewhere is None:
            if picked.count is not None:
                self._count(Counter({picked.values.shape[1]: len(picked.values)}))
            self.rows.append(picked.values)
            return
        values, count, state = picked.values, picked.count, picked.state
        if not all_whole:
            values, count, state = values[whole], None if count is None else count[whole], state[whole]
        other = state == OTHER_JOINTS
        if self.elsewhere is None and other.any():
            self.elsewhere = Rows(0, np.bool_)
            self.elsewhere.append(np.zeros(self.rows.count, np.bool_))
        if self.elsewhere is not None:
            self.elsewhere.append(other)
            count = None if count is None else count[~other]
        if count is not None:
            self._count(tally(count))
        self.rows.append(values)

    def share(self, numbers: Numbers) -> FloatArray | None:
        """The column, for more messages that all have these numbers; None where others came before."""
        table = self.rows.share(() if numbers.single else (len(numbers.at),))
        self.exact = numbers.dtype not in ("i8", "u8")
        return None if self.elsewhere is not None else table

    def confirm(self, table: FloatArray, rows: slice) -> None:
        """More messages, which stand in these rows of a column that was shared."""
        count = rows.stop - rows.start
        if self.elsewhere is not None:
            self.elsewhere.append(np.zeros(count, np.bool_))
        if table.ndim > 1:
            self._count(Counter({table.shape[1]: count}))
        self.rows.confirm(table, rows)

    def _count(self, found: Counter[int]) -> None:
        if not self.widths.keys() - {0} and (widths := found.keys() - {0}):
            self.rows.widen(next(width for width in found if width in widths))
        self.widths.update(found)


class Gathering:
    """The fields that are wanted of a topic; `where` begins its errors, `joints` order whole arrays by their names.

    `expected` messages are foretold.
    """

    def __init__(
        self, where: str, topic: str, fields: Sequence[Field], clock: str, joints: Sequence[str], expected: int = 0
    ) -> None:
        self.where, self.topic = where, topic
        self.clock, self.joints = clock, joints
        self.decoders = Decoders()
        self._fields = [_Field(field, expected) for field in fields]
        self._wanted = list(fields)
        # A header's stamp may lie before 1970.
        self._stamps = Rows(expected, np.int64 if clock == "header" else np.uint64)
        self.orders = StampOrders(topic)
        self._clock: tuple[FloatArray, npt.NDArray[np.intp] | None] | None = None

    @property
    def first_stamp(self) -> int | None:
        """Time [ns] of the first message, by the chosen clock."""
        return int(self._stamps.values[0]) if self._stamps.count else None

    def add(self, stream: Stream, batch: Batch) -> None:
        """Take a batch; raises RecordingError where a field or the header's stamp is not there."""
        found = self.decoders.gather(self.where, stream, batch, self._wanted, self.joints, self.clock)
        if found is None:
            return
        decoder, gathered, stamps = found
        whole = self.decoders.keep(gathered)
        all_whole = bool(whole.all())
        stamps = stamps if all_whole else stamps[whole]
        self._stamps.append(stamps)
        self.orders.add(stream.channel.id, stamps)
        for field, picked in zip(self._fields, gathered.picked, strict=True):
            if picked.fault is not None and bool(np.any(whole & (picked.state == ABSENT))):
                raise missing(self.where, field.field.text, picked.fault)
            field.add(picked, whole, all_whole)
            if field.elsewhere is not None and not field.names:
                field.names = decoder.names(batch, field.field)

    def bound(self, channel: int) -> Bound:
        """How more messages of the topic's channel (its id) become rows of these columns; None where they do not."""
        recipe = self.decoders.recipe(channel, self._wanted, self.joints, self.clock == "header")
        if recipe is None:
            return None
        stamps = self._stamps.share(())
        tables = [field.share(numbers) for field, numbers in zip(self._fields, recipe.fields, strict=True)]
        there = tuple(table for table in tables if table is not None)
        if stamps is None or len(there) < len(tables):
            return None
        return recipe, Destination(there, stamps, self._stamps.count)

    def confirm(self, stream: Stream, parts: Sequence[Part]) -> None:
        """Take messages that were put into rows by `bound`."""
        for part in _joined(parts):
            self.decoders.decoded += part.count
            self._stamps.confirm(part.destination.stamps, part.rows)
            self.orders.add(stream.channel.id, part.destination.stamps[part.rows], part.ascending)
            for field, table in zip(self._fields, part.destination.tables, strict=True):
                field.confirm(table, part.rows)

    def column(self, index: int, origin: int) -> tuple[Column, list[Finding]]:
        """The field of that number as a column, sorted by the chosen clock; raises RecordingError."""
        field = self._fields[index]
        text, values, time = field.field.text, field.rows.values, self._stamps.values
        name = f"{self.topic} {text}"
        findings = []
        there = ~field.elsewhere.values if field.elsewhere is not None else None
        if there is not None:
            if not there.any():
                raise missing(self.where, text, FieldMissingError("no message names this joint", field.names))
            left_out = len(there) - int(np.count_nonzero(there))
            findings.append(Finding(OtherJointsOnly(left_out), name, "note"))
        empty = field.widths.pop(0, 0)
        if len(field.widths) > 1:
            found = ", ".join(f"{width} in {count}" for width, count in field.widths.most_common())
            raise RecordingError(
                f"{self.where}: the length of field '{text}' varies: {found} messages",
                "name one element, e.g. position[0]",
            )
        if empty:
            findings.append(Finding(EmptyArrays(empty), name))
            if not field.widths:
                values = np.full((len(values), 1), np.nan)
        if there is not None:
            return column_of(name, values[there], *in_order(time[there], origin)), findings
        if self._clock is None:
            self._clock = in_order(time, origin)
        return column_of(name, values, *self._clock), findings

    def rounded(self, index: int) -> int:
        """How many values of the field of that number may be integers that float64 has rounded."""
        field = self._fields[index]
        return 0 if field.exact else rounded_integers(field.rows.values)


def _joined(parts: Sequence[Part]) -> list[Part]:
    """The same, those one behind the other as one."""
    joined: list[Part] = []
    for part in parts:
        together = joined[-1].before(part) if joined else None
        if together is None:
            joined.append(part)
        else:
            joined[-1] = together
    return joined


def tally(counts: npt.NDArray[np.int64]) -> Counter[int]:
    """How often each count occurs, in the order of their first ones."""
    if len(counts) and (counts == counts[0]).all():
        return Counter({int(counts[0]): len(counts)})
    return Counter(counts.tolist())


def in_order(stamps: Stamps, origin: int) -> tuple[FloatArray, npt.NDArray[np.intp] | None]:
    """Times [s] after `origin` [ns] in ascending order, and the order; None where they are in order as they stand."""
    # The difference is taken between integers: an epoch in ns has more digits than a float64. It may need all 64 bits.
    later: npt.NDArray[np.uint64] = stamps.view(np.uint64) - np.uint64(origin % 2**64)
    time = later / 1e9
    if len(stamps) and (before := stamps < origin).any():
        time[before] = -((~later[before] + np.uint64(1)) / 1e9)
    if np.all(time[1:] >= time[:-1]):
        return time, None
    order = np.argsort(time, kind="stable")
    return time[order], order


def column_of(name: str, values: FloatArray, time: FloatArray, order: npt.NDArray[np.intp] | None) -> Column:
    """A column in the order of its times."""
    return Column(name, values if order is None else values[order], time)
