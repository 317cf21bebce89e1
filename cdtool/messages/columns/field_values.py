"""Fields of the field language -> the places they need, and places -> numbers.

The rules, for every encoding: an empty array is NaN, an element beyond the end of an array that is not empty is a
fault, `position[joint]` and whole arrays go by the names beside the array, message by message where these change.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.messages.columns.decoded_batch import ABSENT, OTHER_JOINTS, THERE, ByteArray, IntArray, Picked
from cdtool.messages.columns.member_locations import Found, Place
from cdtool.messages.fields import Field, FieldMissingError, is_element_number, order_of
from cdtool.recording import FloatArray

WHOLE = ":"
_THERE = np.uint8(THERE)


@dataclass(frozen=True)
class Plan:
    """A field resolved against a schema: `place` of its number or array, `index` within that (None: a number).

    `arrays` are the arrays of messages that it steps through, with the element taken; `names` is the place of the texts
    that name the array's elements, None where there are none.
    """

    field: Field
    place: Place
    index: str | None
    arrays: tuple[tuple[Place, int], ...] = ()
    names: Place | None = None

    @property
    def places(self) -> tuple[Place, ...]:
        """All that it needs to know."""
        return (self.place, *(array for array, _ in self.arrays), *(() if self.names is None else (self.names,)))


@dataclass(frozen=True)
class Called:
    """Which element bears a name in each message: `element` (n,), -1: none; `state` (n,); the first fault's row."""

    element: IntArray
    state: ByteArray
    fault: tuple[int, FieldMissingError] | None


def nowhere(n: int, fault: FieldMissingError) -> Picked:
    """A field that none of n messages can have."""
    return Picked(np.full(n, math.nan), None, np.full(n, ABSENT, dtype=np.uint8), fault)


def pick(plan: Plan, found: Found, joints: Sequence[str]) -> Picked:
    """One field of all messages."""
    return _picked_at_once(plan, found, joints) or _Picking(plan, found, joints).picked()


def elements_called(plan: Plan, found: Found) -> Called:
    """Which element of the plan's array its names call `plan.index`."""
    picking = _Picking(plan, found, ())
    element = picking.element(plan.index or "")
    return Called(element, picking.state, picking.fault)


def elements_of(
    plan: Plan, count: int, names: tuple[str, ...], joints: Sequence[str]
) -> int | list[int] | slice | None:
    """Which of `count` elements, called `names`, the plan takes: one, some in this order, all, or None: it depends."""
    index = plan.index
    if index is None:
        return 0
    if index != WHOLE:
        element = int(index) if is_element_number(index) else names.index(index) if index in names else count
        return element if element < count else None
    if not joints or plan.names is None:
        return slice(None)
    try:
        order = order_of(count, names, joints)
    except FieldMissingError:
        return None
    return slice(None) if order is None or order == list(range(count)) else order


def _picked_at_once(plan: Plan, found: Found, joints: Sequence[str]) -> Picked | None:
    """The field where all messages have as many elements with the same names; None where that is not known."""
    slot = found.slots[plan.place]
    count = slot.uniform
    if not found.whole or not count or plan.arrays:
        return None
    names: tuple[str, ...] = ()
    if plan.names is not None and (joints or plan.index != WHOLE):
        if not found.names[plan.names].alike(found.rows):
            return None
        names = found.names[plan.names].of(0)
    elements = elements_of(plan, count, names, joints)
    if elements is None:
        return None
    n = len(found.status)
    state = np.broadcast_to(_THERE, n)
    if isinstance(elements, int):
        return Picked(slot.numbers(None, elements, 1)[:, 0], None, state, alike=True)
    values = slot.numbers(None, 0, count)[:, elements]
    return Picked(values, np.broadcast_to(np.int64(values.shape[1]), n), state, alike=True)


class _Picking:
    def __init__(self, plan: Plan, found: Found, joints: Sequence[str]) -> None:
        self.plan = plan
        self.found = found
        self.joints = joints
        self.slot = found.slots[plan.place]
        self.state = np.zeros(len(found.status), dtype=np.uint8)
        self.fault: tuple[int, FieldMissingError] | None = None
        self.rows = found.rows
        for array, element in plan.arrays:
            self.rows = self.beyond(str(array[-1]), found.slots[array].count, element)

    def picked(self) -> Picked:
        index = self.plan.index
        if index == WHOLE:
            return self.whole()
        if index is None:
            values = self.numbers(self.rows[self.slot.count[self.rows] > 0], 0)
        elif is_element_number(index):
            self.rows = self.beyond(str(self.plan.place[-1]), self.slot.count, int(index))
            values = self.numbers(self.rows, int(index))
        else:
            values = self.joint(index)
        return Picked(values, None, self.state, self.fault[1] if self.fault else None)

    def beyond(self, name: str, count: IntArray, element: int) -> IntArray:
        """The rows that have this element; those that have others only are faults."""
        counts = count[self.rows]
        short = (counts > 0) & (counts <= element)
        if short.any():
            self.absent(self.rows[short], lambda row: _short_array(name, int(count[row])))
        return self.rows[counts > element]

    def absent(self, rows: IntArray, fault: Callable[[int], FieldMissingError]) -> None:
        self.state[rows] = ABSENT
        first = int(rows[0])
        if self.fault is None or first < self.fault[0]:
            self.fault = first, fault(first)

    def numbers(self, rows: IntArray, first: int) -> FloatArray:
        n = len(self.state)
        if len(rows) == n:
            return self.slot.numbers(None, first, 1)[:, 0]
        values = np.full(n, math.nan)
        values[rows] = self.slot.numbers(rows, first, 1)[:, 0]
        return values

    def joint(self, name: str) -> FloatArray:
        """The element that the names call `name`; where the array is shorter than that, NaN."""
        values = np.full(len(self.state), math.nan)
        element = self.element(name)
        for place in np.unique(element[element >= 0]).tolist():
            there = np.flatnonzero(element == place)
            values[there] = self.slot.numbers(there, place, 1)[:, 0]
        return values

    def element(self, name: str) -> IntArray:
        """(n,): which element the names call `name`, -1 where the array is shorter or they name others only."""
        found = np.full(len(self.state), -1)
        for names, rows in self.found.groups(self.plan.names or (), self.rows):
            if name not in names:
                self.state[rows] = OTHER_JOINTS
                continue
            place = names.index(name)
            found[rows[self.slot.count[rows] > place]] = place
        return found

    def whole(self) -> Picked:
        """The array, in the order of the joints where the messages name its elements."""
        width = self.slot.count.copy()
        width[self.found.status != 0] = -1
        orders: list[tuple[IntArray, list[int] | None]] = [(self.rows, None)]
        if self.joints and self.plan.names is not None:
            orders = []
            for names, rows in self.found.groups(self.plan.names, self.rows):
                orders += self.ordered(names, rows, width)
        return Picked(self.table(width, orders), width, self.state, self.fault[1] if self.fault else None)

    def ordered(
        self, names: tuple[str, ...], rows: IntArray, width: IntArray
    ) -> list[tuple[IntArray, list[int] | None]]:
        found = []
        counts = self.slot.count[rows]
        first = int(counts[0])
        for count in (first,) if (counts == first).all() else np.unique(counts).tolist():
            same = rows[counts == count]
            try:
                order = order_of(max(count, 0), names, self.joints)
            except FieldMissingError as fault:
                self.absent(same, {int(same[0]): fault}.__getitem__)
                width[same] = -1
                continue
            if order is not None:
                width[same] = len(order)
            found.append((same, order))
        return found

    def table(self, width: IntArray, orders: list[tuple[IntArray, list[int] | None]]) -> FloatArray:
        wide = np.flatnonzero(width > 0)
        columns = int(width[wide[0]]) if len(wide) else 1
        table = np.full((len(width), columns), math.nan)
        for rows, order in orders:
            fitting = rows if len(rows) == len(width) and (width == columns).all() else rows[width[rows] == columns]
            if not len(fitting):
                continue
            elements = columns if order is None else max(order) + 1
            values = self.slot.numbers(None if len(fitting) == len(width) else fitting, 0, elements)
            if order is not None:
                values = values[:, order]
            if len(fitting) == len(width):
                return values
            table[fitting] = values
        return table


def _short_array(name: str, count: int) -> FieldMissingError:
    return FieldMissingError(f"'{name}' has {count} elements", [f"{name}[0] to {name}[{count - 1}]"])
