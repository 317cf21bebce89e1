"""Messages with a schema: fields resolved against it once, then found and picked batch by batch."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import numpy.typing as npt

from cdtool.messages.batch import Batch
from cdtool.messages.columns.decoded_batch import ABSENT, THERE, ByteArray, Gathered, IntArray, Picked
from cdtool.messages.columns.field_values import WHOLE, Plan, elements_called, nowhere, pick
from cdtool.messages.columns.member_locations import Found, Place
from cdtool.messages.columns.uniform_layout import Pattern, recipe_of
from cdtool.messages.fast_path import Recipe
from cdtool.messages.fields import LONGEST_ARRAY, STAMPS, Field, FieldMissingError, is_element_number
from cdtool.messages.layouts.layout import Layout, Member, Message, Number, Schema, Text
from cdtool.recording import FloatArray

# One field of some of the messages, by their rows.
Gather = Callable[[IntArray, Field], Gathered]
_MOST_FIELDS = 4096
_LATEST = 9_223_372_035  # s: an int64 of ns holds no more
_NO_MEMBERS = Layout("", ())  # of a number or text


@dataclass(frozen=True)
class NamedPlan:
    """A field whose step number `step` takes an element by its name; `array` is the plan of that step alone.

    An example is `pose[robot].position.x` in Gazebo's ModelStates. The element may differ from message to message;
    messages in which it is the same are read together, as if the field gave its number.
    """

    array: Plan
    step: int

    @property
    def places(self) -> tuple[Place, ...]:
        """All that it needs to know before the element's number is known."""
        return self.array.places

    @property
    def names(self) -> Place | None:
        """The place of the texts that name the elements."""
        return self.array.names


@dataclass(frozen=True)
class _Part:
    """The messages `rows`, in all of which the name is that of the same element, and their `field` by its number."""

    rows: IntArray
    field: Field
    gathered: Gathered

    @property
    def picked(self) -> Picked:
        return self.gathered.picked[0]


def numbered(field: Field, step: int, element: int) -> Field:
    """A field with an element's number in one of its steps."""
    name, _ = field.steps[step]
    return Field(field.text, (*field.steps[:step], (name, str(element)), *field.steps[step + 1 :]))


def gather_by_name(plan: NamedPlan, found: Found, gather: Gather) -> Gathered:
    """The field of all messages; `found` are the plan's places, `gather` reads what the element's number leads to.

    As for an array of numbers: NaN where the array is shorter than its names, OTHER_JOINTS where no name is that one.
    """
    called = elements_called(plan.array, found)
    parts = []
    for element in np.unique(called.element[called.element >= 0]).tolist():
        rows, field = np.flatnonzero(called.element == element), numbered(plan.array.field, plan.step, element)
        parts.append(_Part(rows, field, gather(rows, field)))
    if len(parts) == 1 and len(parts[0].rows) == len(found.status):
        return parts[0].gathered
    state, status, fault = called.state, found.status.copy(), called.fault
    reasons = {int(np.flatnonzero(status)[0]): found.reason} if status.any() else {}
    for part in parts:
        state[part.rows], status[part.rows] = part.picked.state, part.gathered.status
        absent = part.rows[part.picked.state == ABSENT]
        if part.picked.fault is not None and len(absent) and (fault is None or int(absent[0]) < fault[0]):
            fault = int(absent[0]), part.picked.fault
        if part.gathered.status.any():
            reasons[int(part.rows[np.flatnonzero(part.gathered.status)[0]])] = part.gathered.reason
    if plan.array.field.whole:
        count = np.where((state == THERE) & (status == 0), np.int64(0), np.int64(-1))
        values = _table(parts, count, gather)
    else:
        count, values = None, np.full(len(state), math.nan)
        for part in parts:
            values[part.rows] = part.picked.values
    picked = Picked(values, count, state, fault[1] if fault else None)
    return Gathered((picked,), status, reasons[min(reasons)] if reasons else "")


def _table(parts: list[_Part], count: IntArray, gather: Gather) -> FloatArray:
    """A whole array's rows, as wide as the first that is not empty; the widths of all go into `count`."""
    for part in parts:
        if part.picked.count is not None:
            count[part.rows] = part.picked.count
    wide = np.flatnonzero(count > 0)
    table = np.full((len(count), int(count[wide[0]]) if len(wide) else 1), math.nan)
    for part in parts:
        rows = part.rows[count[part.rows] == table.shape[1]]
        if len(rows):  # the part's first one may be of another width
            table[rows] = gather(rows, part.field).picked[0].values
    return table


class Finder(Protocol):
    """One encoding: where the places of a batch's messages are."""

    def find(self, batch: Batch, places: tuple[Place, ...]) -> Found:
        """The places, each asked for once."""
        ...

    def pattern(self, places: tuple[Place, ...]) -> Pattern | None:
        """What the last messages had in common; None where they had nothing."""
        ...


@dataclass
class TypedDecoder:
    """A Decoder (decoded_batch.py) for messages whose schema tells every field."""

    schema: Schema
    finder: Finder
    _plans: dict[Field, Plan | NamedPlan | FieldMissingError] = field(default_factory=dict)

    def fields(self, batch: Batch) -> list[str]:  # noqa: ARG002  (the schema tells them, whatever the messages are)
        """Every numeric field but the header's stamp, in the order of the schema; of arrays those that may be short."""
        found = []
        for name in _numeric_names(self.schema, self.schema.root, "", ()):
            found.append(name)
            if len(found) >= _MOST_FIELDS:
                break
        return found

    def gather(
        self, batch: Batch, wanted: Sequence[Field], joints: Sequence[str] = (), stamps: bool = False
    ) -> Gathered:
        """The wanted fields of all messages; one that the schema does not have is absent in all, with its fault."""
        plans = [self.plan(each) for each in wanted]
        stamp = self.stamp_places() if stamps else ()
        found = self.finder.find(batch, _places(plans, stamp))
        parts = [self._gathered(plan, found, batch, joints) for plan in plans]
        picked = tuple(part.picked[0] for part in parts)
        status, reason = _damaged(found, parts)
        if not stamps:
            return Gathered(picked, status, reason)
        times, there = stamp_times(found, stamp)
        return Gathered(picked, status, reason, times, there)

    def recipe(self, wanted: Sequence[Field], joints: Sequence[str] = (), stamps: bool = False) -> Recipe | None:
        """How more messages like the last ones become the same fields; None where they do not at once."""
        plans = [plan for plan in (self.plan(each) for each in wanted) if isinstance(plan, Plan)]
        stamp = self.stamp_places() if stamps else ()
        if len(plans) < len(wanted) or (stamps and not stamp):
            return None
        pattern = self.finder.pattern(_places(plans, stamp))
        return None if pattern is None else recipe_of(pattern, plans, joints, stamp)

    def _gathered(
        self, plan: Plan | NamedPlan | FieldMissingError, found: Found, batch: Batch, joints: Sequence[str]
    ) -> Gathered:
        """One field of all messages, and those that are damaged where only this field shows it."""
        if isinstance(plan, FieldMissingError):
            return Gathered((nowhere(len(batch), plan),), found.status, found.reason)
        if isinstance(plan, Plan):
            return Gathered((pick(plan, found, joints),), found.status, found.reason)

        def gather(rows: IntArray, field: Field) -> Gathered:
            return self.gather(_some(batch, rows), [field], joints)

        return gather_by_name(plan, found, gather)

    def names(self, batch: Batch, field: Field) -> list[str]:
        """What the first ten messages call the elements of the field's array, sorted."""
        plan = self.plan(field)
        place = None if isinstance(plan, FieldMissingError) else plan.names
        if place is None:
            return []
        found = self.finder.find(batch, (place,))
        return sorted({name for row in np.flatnonzero(found.status == 0)[:10] for name in found.names[place].of(row)})

    def element_names(self, batch: Batch) -> tuple[str, ...]:
        """The array of texts `name` of the first message, in its order; empty where there is none."""
        place = names_place(self.schema.root, ())
        if place is None:
            return ()
        found = self.finder.find(batch.first(1), (place,))
        return found.names[place].of(0) if len(found.rows) else ()

    def plan(self, field: Field) -> Plan | NamedPlan | FieldMissingError:
        """The field's place, or why the schema has none."""
        if field not in self._plans:
            try:
                self._plans[field] = resolve(field, self.schema)
            except FieldMissingError as fault:
                self._plans[field] = fault
        return self._plans[field]

    def stamp_places(self) -> tuple[Place, ...]:
        """Seconds and nanoseconds of the header's stamp; empty where the schema has none."""
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


def _places(plans: Sequence[Plan | NamedPlan | FieldMissingError], stamp: tuple[Place, ...]) -> tuple[Place, ...]:
    """All that plans and stamp need, each once."""
    needed = (place for plan in plans if not isinstance(plan, FieldMissingError) for place in plan.places)
    return tuple(dict.fromkeys((*needed, *stamp)))


def _some(batch: Batch, rows: IntArray) -> Batch:
    """The messages `rows` of a batch."""
    if len(rows) == len(batch):
        return batch
    return Batch(batch.data, batch.start[rows], batch.length[rows], batch.log_time[rows])


def _damaged(found: Found, parts: Sequence[Gathered]) -> tuple[ByteArray, str]:
    """Which messages are damaged, also where only one field shows it, and why the first of them is."""
    status, reason = found.status, found.reason
    for part in parts:
        more = (part.status != 0) & (status == 0)
        if more.any():
            first = not status.any() or np.argmax(more) < np.argmax(status != 0)
            status, reason = np.maximum(status, part.status), part.reason if first else reason
    return status, reason


def _numeric_names(schema: Schema, layout: Layout, prefix: str, above: tuple[str, ...]) -> Iterator[str]:
    if layout.name in above:  # protobuf's messages may hold themselves
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


def stamp_times(found: Found, places: tuple[Place, ...]) -> tuple[IntArray, npt.NDArray[np.bool_]]:
    """(n,) ns of seconds and nanoseconds at `places`, and where both are there; exact, as seconds below 2^53 are."""
    n = len(found.status)
    times = np.zeros(n, dtype=np.int64)
    if not places:
        return times, np.zeros(n, dtype=np.bool_)
    seconds, nanoseconds = (found.slots[place] for place in places)
    if found.whole and seconds.uniform == nanoseconds.uniform == 1:
        rows = None
    else:
        rows = np.flatnonzero((found.status == 0) & (seconds.count == 1) & (nanoseconds.count == 1))
    whole, rest = (slot.numbers(rows, 0, 1)[:, 0] for slot in (seconds, nanoseconds))
    usable = (np.abs(whole) <= _LATEST) & (np.abs(rest) <= 2**53)
    if rows is None and usable.all():
        return whole.astype(np.int64) * 10**9 + rest.astype(np.int64), usable
    rows = (np.arange(n) if rows is None else rows)[usable]
    there = np.zeros(n, dtype=np.bool_)
    there[rows] = True
    times[rows] = whole[usable].astype(np.int64) * 10**9 + rest[usable].astype(np.int64)
    return times, there


def resolve(field: Field, schema: Schema) -> Plan | NamedPlan:
    """A field's place in the messages of a schema; raises FieldMissingError with the members that there are."""
    layout = schema.root
    place: Place = ()
    arrays: list[tuple[Place, int]] = []
    last = len(field.steps) - 1
    for i, (name, index) in enumerate(field.steps):
        member = layout.member(name)
        if member is None:
            raise FieldMissingError(f"there is no '{name}'", layout.names)
        parent, place = place, (*place, name)
        if index is not None and member.array is None:
            raise FieldMissingError(f"'{name}' is not an array", [name])
        if index == WHOLE or (i == last and index is not None):
            names = _names_of(index or "", layout, parent)
            _require_number(field, member)
            return Plan(field, place, index, tuple(arrays), names)
        if member.array is not None and index is None:
            raise FieldMissingError(
                f"'{field.text}' is an array" if i == last else f"there is no '{field.steps[i + 1][0]}'",
                [f"{field.text}[0]", f"{field.text}[:]"] if i == last else (),
            )
        if index is not None:
            if isinstance(member.kind, Message) and schema.nested(member.kind).entry:
                raise FieldMissingError(
                    f"'{name}' is a map, whose entries have no order", advice="log the value in a field of its own"
                )
            if not is_element_number(index):
                plan = NamedPlan(Plan(field, place, index, tuple(arrays), _named_place(layout, parent)), i)
                resolve(numbered(field, i, 0), schema)  # whichever element it is, what follows it must be there
                return plan
            arrays.append((place, int(index)))
            place = (*place, int(index))
        if i == last:
            _require_number(field, member)
            return Plan(field, place, None, tuple(arrays))
        layout = schema.nested(member.kind) if isinstance(member.kind, Message) else _NO_MEMBERS
    raise FieldMissingError(f"'{field.text}' names nothing")


def _require_number(field: Field, member: Member) -> None:
    if isinstance(member.kind, Text):
        raise FieldMissingError(f"'{field.text}' holds a text, not a number")
    if isinstance(member.kind, Message):
        raise FieldMissingError(f"'{field.text}' holds a {member.kind.name}, not a number")


def _names_of(index: str, layout: Layout, parent: Place) -> Place | None:
    """Return the place of the texts that name an array's elements; None where its index needs none."""
    if index == WHOLE:
        return names_place(layout, parent)
    return None if is_element_number(index) else _named_place(layout, parent)


def _named_place(layout: Layout, parent: Place) -> Place:
    """The place of the texts that must be there; raises FieldMissingError."""
    place = names_place(layout, parent)
    if place is None:
        problem = "'name' is not an array" if layout.member("name") else "there is no 'name'"
        raise FieldMissingError(problem, layout.names)
    return place


def names_place(layout: Layout, parent: Place) -> Place | None:
    """The place of the texts `name` beside an array; None where it is missing."""
    member = layout.member("name")
    if member is None or member.array is None or not isinstance(member.kind, Text):
        return None
    return (*parent, "name")
