"""Field plans -> numbers, from the located members of a batch.

The same rules apply to every encoding. An empty array is NaN. An element beyond the end of an array that is not empty
is a fault. `position[joint]` and whole arrays use the names next to the array, message by message if these change.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.messages.columns.decoded_batch import ABSENT, OTHER_JOINTS, PRESENT, ByteArray, FieldValues, IntArray
from cdtool.messages.columns.member_locations import MemberLocations, MemberPath
from cdtool.messages.fields import Field, FieldMissingError, is_element_number, joint_order
from cdtool.recording import FloatArray

WHOLE = ":"
_PRESENT = np.uint8(PRESENT)


@dataclass(frozen=True)
class FieldPlan:
    """A field resolved against a schema: the `path` to its number or array, and the `index` into it (None: a number).

    `arrays` are the arrays of messages along the path, with the selected element. `names` is the path to the strings
    that name the array's elements; None if it has no such names.
    """

    field: Field
    path: MemberPath
    index: str | None
    arrays: tuple[tuple[MemberPath, int], ...] = ()
    names: MemberPath | None = None

    @property
    def paths(self) -> tuple[MemberPath, ...]:
        """The paths to all members that the plan needs."""
        return (self.path, *(array for array, _ in self.arrays), *(() if self.names is None else (self.names,)))


@dataclass(frozen=True)
class NamedElements:
    """The element that has a given name in each message: `element` (n,), -1: none; `state` (n,).

    `fault` is the row and reason of the first fault.
    """

    element: IntArray
    state: ByteArray
    fault: tuple[int, FieldMissingError] | None


def absent_field(n: int, fault: FieldMissingError) -> FieldValues:
    """Return the values of a field that is absent in all of n messages."""
    return FieldValues(np.full(n, math.nan), None, np.full(n, ABSENT, dtype=np.uint8), fault)


def read_field(plan: FieldPlan, locations: MemberLocations, joints: Sequence[str]) -> FieldValues:
    """Return one field of all messages."""
    return _read_uniform_field(plan, locations, joints) or _FieldReader(plan, locations, joints).read()


def find_named_elements(plan: FieldPlan, locations: MemberLocations) -> NamedElements:
    """Return which element of the plan's array is named `plan.index`."""
    reader = _FieldReader(plan, locations, ())
    element = reader.find_element(plan.index or "")
    return NamedElements(element, reader.state, reader.fault)


def select_elements(
    plan: FieldPlan, count: int, names: tuple[str, ...], joints: Sequence[str]
) -> int | list[int] | slice | None:
    """Return which of `count` elements with `names` the plan selects: one, several in this order, or all.

    None means that the selection differs between messages, or that the element is absent.
    """
    index = plan.index
    if index is None:
        return 0
    if index != WHOLE:
        element = int(index) if is_element_number(index) else names.index(index) if index in names else count
        return element if element < count else None
    if not joints or plan.names is None:
        return slice(None)
    try:
        order = joint_order(count, names, joints)
    except FieldMissingError:
        return None
    return slice(None) if order is None or order == list(range(count)) else order


def _read_uniform_field(plan: FieldPlan, locations: MemberLocations, joints: Sequence[str]) -> FieldValues | None:
    """Return the field if all messages have the same number of elements with the same names; None if not known."""
    slot = locations.slots[plan.path]
    count = slot.uniform
    if not locations.intact or not count or plan.arrays:
        return None
    names: tuple[str, ...] = ()
    if plan.names is not None and (joints or plan.index != WHOLE):
        if not locations.names[plan.names].are_equal(locations.rows):
            return None
        names = locations.names[plan.names].of(0)
    elements = select_elements(plan, count, names, joints)
    if elements is None:
        return None
    n = len(locations.status)
    state = np.broadcast_to(_PRESENT, n)
    if isinstance(elements, int):
        return FieldValues(slot.numbers(None, elements, 1)[:, 0], None, state, uniform=True)
    values = slot.numbers(None, 0, count)[:, elements]
    return FieldValues(values, np.broadcast_to(np.int64(values.shape[1]), n), state, uniform=True)


class _FieldReader:
    """Reads one field of messages that may differ in the number, names and presence of elements."""

    def __init__(self, plan: FieldPlan, locations: MemberLocations, joints: Sequence[str]) -> None:
        self.plan = plan
        self.locations = locations
        self.joints = joints
        self.slot = locations.slots[plan.path]
        self.state = np.zeros(len(locations.status), dtype=np.uint8)
        self.fault: tuple[int, FieldMissingError] | None = None
        self.rows = locations.rows
        for array, element in plan.arrays:
            self.rows = self.rows_with(element, str(array[-1]), locations.slots[array].count)

    def read(self) -> FieldValues:
        index = self.plan.index
        if index == WHOLE:
            return self.read_array()
        if index is None:
            values = self.read_element(self.rows[self.slot.count[self.rows] > 0], 0)
        elif is_element_number(index):
            self.rows = self.rows_with(int(index), str(self.plan.path[-1]), self.slot.count)
            values = self.read_element(self.rows, int(index))
        else:
            values = self.read_named_element(index)
        return FieldValues(values, None, self.state, self.fault[1] if self.fault else None)

    def rows_with(self, element: int, name: str, count: IntArray) -> IntArray:
        """Return the rows whose array `name` has this element; a shorter array that is not empty is a fault."""
        counts = count[self.rows]
        short = (counts > 0) & (counts <= element)
        if short.any():
            self.mark_absent(self.rows[short], lambda row: _short_array(name, int(count[row])))
        return self.rows[counts > element]

    def mark_absent(self, rows: IntArray, fault: Callable[[int], FieldMissingError]) -> None:
        self.state[rows] = ABSENT
        first = int(rows[0])
        if self.fault is None or first < self.fault[0]:
            self.fault = first, fault(first)

    def read_element(self, rows: IntArray, element: int) -> FloatArray:
        n = len(self.state)
        if len(rows) == n:
            return self.slot.numbers(None, element, 1)[:, 0]
        values = np.full(n, math.nan)
        values[rows] = self.slot.numbers(rows, element, 1)[:, 0]
        return values

    def read_named_element(self, name: str) -> FloatArray:
        """Return the element named `name` (n,); NaN if the array has fewer elements than names."""
        values = np.full(len(self.state), math.nan)
        elements = self.find_element(name)
        for element in np.unique(elements[elements >= 0]).tolist():
            rows = np.flatnonzero(elements == element)
            values[rows] = self.slot.numbers(rows, element, 1)[:, 0]
        return values

    def find_element(self, name: str) -> IntArray:
        """Return the number of the element named `name` (n,); -1 if it is beyond the array's end or not named."""
        elements = np.full(len(self.state), -1)
        for names, rows in self.locations.groups(self.plan.names or (), self.rows):
            if name not in names:
                self.state[rows] = OTHER_JOINTS
                continue
            element = names.index(name)
            elements[rows[self.slot.count[rows] > element]] = element
        return elements

    def read_array(self) -> FieldValues:
        """Return the whole array, in the order of the joints if the messages name its elements."""
        width = self.slot.count.copy()
        width[self.locations.status != 0] = -1
        orders: list[tuple[IntArray, list[int] | None]] = [(self.rows, None)]
        if self.joints and self.plan.names is not None:
            orders = []
            for names, rows in self.locations.groups(self.plan.names, self.rows):
                orders += self.orders_of(names, rows, width)
        return FieldValues(self.read_table(width, orders), width, self.state, self.fault[1] if self.fault else None)

    def orders_of(
        self, names: tuple[str, ...], rows: IntArray, width: IntArray
    ) -> list[tuple[IntArray, list[int] | None]]:
        """Return the element order of rows with these names, by array length; update `width` to the ordered width."""
        orders = []
        counts = self.slot.count[rows]
        first = int(counts[0])
        for count in (first,) if (counts == first).all() else np.unique(counts).tolist():
            same = rows[counts == count]
            try:
                order = joint_order(max(count, 0), names, self.joints)
            except FieldMissingError as fault:
                self.mark_absent(same, {int(same[0]): fault}.__getitem__)
                width[same] = -1
                continue
            if order is not None:
                width[same] = len(order)
            orders.append((same, order))
        return orders

    def read_table(self, width: IntArray, orders: list[tuple[IntArray, list[int] | None]]) -> FloatArray:
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
