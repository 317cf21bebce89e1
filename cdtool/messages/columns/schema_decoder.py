"""Messages with a schema: fields are resolved against it once, then located and read batch by batch."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import Protocol

import numpy as np
import numpy.typing as npt

from cdtool.messages.batch import Batch
from cdtool.messages.columns.decoded_batch import ABSENT, PRESENT, ByteArray, DecodedBatch, FieldValues, IntArray
from cdtool.messages.columns.field_values import WHOLE, FieldPlan, absent_field, find_named_elements, read_field
from cdtool.messages.columns.member_locations import MemberLocations, MemberPath
from cdtool.messages.fast_path import RowLayout
from cdtool.messages.fields import LONGEST_ARRAY, STAMPS, Field, FieldMissingError, is_element_number
from cdtool.messages.layouts.layout import Layout, Member, Message, Number, Schema, Text
from cdtool.recording import FloatArray

# Decodes one field of the messages with these row numbers.
DecodeRows = Callable[[IntArray, Field], DecodedBatch]
_MOST_FIELDS = 4096
_LATEST = 9_223_372_035  # s: the largest time stamp in ns that fits an int64
# The paths to seconds and nanoseconds of the header's stamp; empty if the stamp is not wanted.
StampPaths = tuple[MemberPath, ...]
_NO_MEMBERS = Layout("", ())  # of a number or string


@dataclass(frozen=True)
class NamedElementPlan:
    """A field whose step number `step` selects an element by name; `array` is the plan of that step only.

    An example is `pose[robot].position.x` in Gazebo's ModelStates. The element may differ from message to message;
    messages in which it is the same are decoded together, as if the field stated its number.
    """

    array: FieldPlan
    step: int

    @property
    def paths(self) -> tuple[MemberPath, ...]:
        """The paths to all members needed to find the element's number."""
        return self.array.paths

    @property
    def names(self) -> MemberPath | None:
        """The path to the strings that name the elements."""
        return self.array.names


AnyPlan = FieldPlan | NamedElementPlan


@dataclass(frozen=True)
class _SameElement:
    """The messages `rows` in which the name belongs to the same element, and the `field` with its number."""

    rows: IntArray
    field: Field
    decoded: DecodedBatch

    @property
    def field_values(self) -> FieldValues:
        return self.decoded.fields[0]


def with_element(field: Field, step: int, element: int) -> Field:
    """Return the field with an element's number in place of the name in one of its steps."""
    name, _ = field.steps[step]
    return Field(field.text, (*field.steps[:step], (name, str(element)), *field.steps[step + 1 :]))


def decode_by_name(plan: NamedElementPlan, locations: MemberLocations, decode: DecodeRows) -> DecodedBatch:
    """Return a field with a named element of all messages; `locations` are those of the plan's paths.

    As for an array of numbers, the value is NaN if the array has fewer elements than names, and the state is
    OTHER_JOINTS if no element has the name.
    """
    named = find_named_elements(plan.array, locations)
    parts = []
    for element in np.unique(named.element[named.element >= 0]).tolist():
        rows, field = np.flatnonzero(named.element == element), with_element(plan.array.field, plan.step, element)
        parts.append(_SameElement(rows, field, decode(rows, field)))
    if len(parts) == 1 and len(parts[0].rows) == len(locations.status):
        return parts[0].decoded
    state, status, fault = named.state, locations.status.copy(), named.fault
    reasons = {int(np.flatnonzero(status)[0]): locations.reason} if status.any() else {}
    for part in parts:
        state[part.rows], status[part.rows] = part.field_values.state, part.decoded.status
        absent = part.rows[part.field_values.state == ABSENT]
        if part.field_values.fault is not None and len(absent) and (fault is None or int(absent[0]) < fault[0]):
            fault = int(absent[0]), part.field_values.fault
        if part.decoded.status.any():
            reasons[int(part.rows[np.flatnonzero(part.decoded.status)[0]])] = part.decoded.reason
    if plan.array.field.whole:
        count = np.where((state == PRESENT) & (status == 0), np.int64(0), np.int64(-1))
        values = _read_arrays(parts, count, decode)
    else:
        count, values = None, np.full(len(state), math.nan)
        for part in parts:
            values[part.rows] = part.field_values.values
    field_values = FieldValues(values, count, state, fault[1] if fault else None)
    return DecodedBatch((field_values,), status, reasons[min(reasons)] if reasons else "")


def _read_arrays(parts: list[_SameElement], count: IntArray, decode: DecodeRows) -> FloatArray:
    """Return the rows of a whole array, as wide as the first that is not empty; write all widths to `count`."""
    for part in parts:
        if part.field_values.count is not None:
            count[part.rows] = part.field_values.count
    wide = np.flatnonzero(count > 0)
    table = np.full((len(count), int(count[wide[0]]) if len(wide) else 1), math.nan)
    for part in parts:
        rows = part.rows[count[part.rows] == table.shape[1]]
        if len(rows):  # decoded again, as the first array of the part may have another width
            table[rows] = decode(rows, part.field).fields[0].values
    return table


class Locator(Protocol):
    """Locates members in the messages of one encoding."""

    def locate(self, batch: Batch, paths: tuple[MemberPath, ...]) -> MemberLocations:
        """Return the members at `paths`, which are all different."""
        ...

    def row_layout(
        self, paths: tuple[MemberPath, ...], plans: Sequence[FieldPlan], joints: Sequence[str], stamp: StampPaths
    ) -> RowLayout | None:
        """Return the row layout of further messages, in which `paths` were located; None if they have no common one."""
        ...


@dataclass
class SchemaDecoder:
    """A Decoder (decoded_batch.py) for messages whose schema defines every field."""

    schema: Schema
    locator: Locator
    _plans: dict[Field, AnyPlan | FieldMissingError] = field(default_factory=dict)

    def fields(self, batch: Batch) -> list[str]:  # noqa: ARG002  (the schema defines them, not the messages)
        """Return every numeric field except the header's stamp, in schema order; arrays only if they may be short."""
        return list(islice(_numeric_names(self.schema, self.schema.root, "", ()), _MOST_FIELDS))

    def decode(
        self, batch: Batch, wanted: Sequence[Field], joints: Sequence[str] = (), stamps: bool = False
    ) -> DecodedBatch:
        """Decode the wanted fields of all messages; one that the schema does not have is absent in all."""
        plans = [self.plan(each) for each in wanted]
        stamp = self.stamp_paths() if stamps else ()
        locations = self.locator.locate(batch, _all_paths(plans, stamp))
        parts = [self._decode_field(plan, locations, batch, joints) for plan in plans]
        field_values = tuple(part.fields[0] for part in parts)
        status, reason = _damage(locations, parts)
        if not stamps:
            return DecodedBatch(field_values, status, reason)
        times, has_stamp = header_times(locations, stamp)
        return DecodedBatch(field_values, status, reason, times, has_stamp)

    def row_layout(self, wanted: Sequence[Field], joints: Sequence[str] = (), stamps: bool = False) -> RowLayout | None:
        """Return the row layout of further messages like the last ones; None if they must be decoded in full."""
        plans = [plan for plan in (self.plan(each) for each in wanted) if isinstance(plan, FieldPlan)]
        stamp = self.stamp_paths() if stamps else ()
        if len(plans) < len(wanted) or (stamps and not stamp):
            return None
        return self.locator.row_layout(_all_paths(plans, stamp), plans, joints, stamp)

    def _decode_field(
        self, plan: AnyPlan | FieldMissingError, locations: MemberLocations, batch: Batch, joints: Sequence[str]
    ) -> DecodedBatch:
        """Return one field of all messages, with the damage that only this field reveals."""
        if isinstance(plan, FieldMissingError):
            return DecodedBatch((absent_field(len(batch), plan),), locations.status, locations.reason)
        if isinstance(plan, FieldPlan):
            return DecodedBatch((read_field(plan, locations, joints),), locations.status, locations.reason)

        def decode(rows: IntArray, field: Field) -> DecodedBatch:
            return self.decode(_select(batch, rows), [field], joints)

        return decode_by_name(plan, locations, decode)

    def names(self, batch: Batch, field: Field) -> list[str]:
        """Return the element names of the field's array in the first ten messages, sorted."""
        plan = self.plan(field)
        path = None if isinstance(plan, FieldMissingError) else plan.names
        if path is None:
            return []
        locations = self.locator.locate(batch, (path,))
        rows = np.flatnonzero(locations.status == 0)[:10]
        return sorted({name for row in rows for name in locations.names[path].of(row)})

    def element_names(self, batch: Batch) -> tuple[str, ...]:
        """Return the string array `name` of the first message, in its order; empty if it has no such array."""
        path = names_path(self.schema.root, ())
        if path is None:
            return ()
        locations = self.locator.locate(batch.first(1), (path,))
        return locations.names[path].of(0) if len(locations.rows) else ()

    def plan(self, field: Field) -> AnyPlan | FieldMissingError:
        """Return the plan of a field, or the reason why the schema does not have it."""
        if field not in self._plans:
            try:
                self._plans[field] = resolve_field(field, self.schema)
            except FieldMissingError as fault:
                self._plans[field] = fault
        return self._plans[field]

    def stamp_paths(self) -> tuple[MemberPath, ...]:
        """Return the paths to seconds and nanoseconds of the header's stamp; empty if the schema has no such stamp."""
        header = self.schema.root.member("header")
        stamp = self._inner(header, "stamp")
        for names in STAMPS:
            parts = [self._inner(stamp, name) for name in names]
            if all(part is not None and isinstance(part.kind, Number) and part.array is None for part in parts):
                return tuple(("header", "stamp", name) for name in names)
        return ()

    def _inner(self, member: Member | None, name: str) -> Member | None:
        if member is None or member.array is not None or not isinstance(member.kind, Message):
            return None
        return self.schema.nested(member.kind).member(name)


def _all_paths(plans: Sequence[AnyPlan | FieldMissingError], stamp: tuple[MemberPath, ...]) -> tuple[MemberPath, ...]:
    """Return the paths that plans and stamp need, without repetition."""
    needed = (path for plan in plans if not isinstance(plan, FieldMissingError) for path in plan.paths)
    return tuple(dict.fromkeys((*needed, *stamp)))


def _select(batch: Batch, rows: IntArray) -> Batch:
    """Return the messages `rows` of a batch."""
    if len(rows) == len(batch):
        return batch
    return Batch(batch.data, batch.start[rows], batch.length[rows], batch.log_time[rows])


def _damage(locations: MemberLocations, parts: Sequence[DecodedBatch]) -> tuple[ByteArray, str]:
    """Return which messages are damaged, including damage that only one field reveals, and the first one's reason."""
    status, reason = locations.status, locations.reason
    for part in parts:
        more = (part.status != 0) & (status == 0)
        if more.any():
            first = not status.any() or np.argmax(more) < np.argmax(status != 0)
            status, reason = np.maximum(status, part.status), part.reason if first else reason
    return status, reason


def _numeric_names(schema: Schema, layout: Layout, prefix: str, above: tuple[str, ...]) -> Iterator[str]:
    if layout.name in above:  # protobuf messages may contain themselves
        return
    for member in layout.members:
        full = f"{prefix}{member.name}"
        if full == "header.stamp":
            continue
        if isinstance(member.kind, Number):
            if member.array is None:
                yield full
            elif (member.array.length or 0) <= LONGEST_ARRAY:
                yield f"{full}[:]"
        elif isinstance(member.kind, Message) and member.array is None:
            yield from _numeric_names(schema, schema.nested(member.kind), f"{full}.", (*above, layout.name))


def header_times(locations: MemberLocations, paths: tuple[MemberPath, ...]) -> tuple[IntArray, npt.NDArray[np.bool_]]:
    """Return the times (n,) in ns of seconds and nanoseconds at `paths`, and which messages have both.

    The times are exact, as float64 represents all integers below 2^53.
    """
    n = len(locations.status)
    times = np.zeros(n, dtype=np.int64)
    if not paths:
        return times, np.zeros(n, dtype=np.bool_)
    seconds, nanoseconds = (locations.slots[path] for path in paths)
    if locations.intact and seconds.uniform == nanoseconds.uniform == 1:
        rows = None
    else:
        rows = np.flatnonzero((locations.status == 0) & (seconds.count == 1) & (nanoseconds.count == 1))
    whole, rest = (slot.numbers(rows, 0, 1)[:, 0] for slot in (seconds, nanoseconds))
    usable = (np.abs(whole) <= _LATEST) & (np.abs(rest) <= 2**53)
    if rows is None and usable.all():
        return whole.astype(np.int64) * 10**9 + rest.astype(np.int64), usable
    rows = (np.arange(n) if rows is None else rows)[usable]
    has_stamp = np.zeros(n, dtype=np.bool_)
    has_stamp[rows] = True
    times[rows] = whole[usable].astype(np.int64) * 10**9 + rest[usable].astype(np.int64)
    return times, has_stamp


def resolve_field(field: Field, schema: Schema) -> AnyPlan:
    """Return a field's plan for the messages of a schema; raises FieldMissingError with the members that exist."""
    layout = schema.root
    path: MemberPath = ()
    arrays: list[tuple[MemberPath, int]] = []
    last = len(field.steps) - 1
    for i, (name, index) in enumerate(field.steps):
        member = layout.member(name)
        if member is None:
            raise FieldMissingError(f"there is no '{name}'", layout.names)
        parent, path = path, (*path, name)
        if index is not None and member.array is None:
            raise FieldMissingError(f"'{name}' is not an array", [name])
        if index == WHOLE or (i == last and index is not None):
            names = _names_for_index(index or "", layout, parent)
            _require_number(field, member)
            return FieldPlan(field, path, index, tuple(arrays), names)
        if member.array is not None and index is None:
            raise FieldMissingError(
                f"'{field.text}' is an array" if i == last else f"there is no '{field.steps[i + 1][0]}'",
                [f"{field.text}[0]", f"{field.text}[:]"] if i == last else (),
            )
        if index is not None:
            if isinstance(member.kind, Message) and schema.nested(member.kind).entry:
                raise FieldMissingError(
                    f"'{name}' is a map, whose entries have no order", advice="log the value in a separate field"
                )
            if not is_element_number(index):
                names = _required_names_path(layout, parent)
                # Whichever element has the name, the rest of the path must exist.
                resolve_field(with_element(field, i, 0), schema)
                return NamedElementPlan(FieldPlan(field, path, index, tuple(arrays), names), i)
            arrays.append((path, int(index)))
            path = (*path, int(index))
        if i == last:
            _require_number(field, member)
            return FieldPlan(field, path, None, tuple(arrays))
        layout = schema.nested(member.kind) if isinstance(member.kind, Message) else _NO_MEMBERS
    raise FieldMissingError(f"'{field.text}' does not name a field")


def _require_number(field: Field, member: Member) -> None:
    if isinstance(member.kind, Text):
        raise FieldMissingError(f"'{field.text}' is a string, not a number")
    if isinstance(member.kind, Message):
        raise FieldMissingError(f"'{field.text}' is a {member.kind.name}, not a number")


def _names_for_index(index: str, layout: Layout, parent: MemberPath) -> MemberPath | None:
    """Return the path to the strings that name an array's elements; None if its index needs no names."""
    if index == WHOLE:
        return names_path(layout, parent)
    return None if is_element_number(index) else _required_names_path(layout, parent)


def _required_names_path(layout: Layout, parent: MemberPath) -> MemberPath:
    """Return the path to the strings that name an array's elements; raises FieldMissingError if it is missing."""
    path = names_path(layout, parent)
    if path is None:
        problem = "'name' is not an array" if layout.member("name") else "there is no 'name'"
        raise FieldMissingError(problem, layout.names)
    return path


def names_path(layout: Layout, parent: MemberPath) -> MemberPath | None:
    """Return the path to the string array `name` next to an array; None if it is missing."""
    member = layout.member("name")
    if member is None or member.array is None or not isinstance(member.kind, Text):
        return None
    return (*parent, "name")
