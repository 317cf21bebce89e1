"""Elements of arrays of messages that are found by a name: `pose[robot].position.x`, as in Gazebo's ModelStates.

Which element bears the name may differ from message to message. Those where it is the same one are read together, as if
the field gave its number.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cdtool.messages.columns.gathered import ABSENT, THERE, Gathered, IntArray, Picked
from cdtool.messages.columns.picking import Plan, elements_called
from cdtool.messages.columns.slots import Found, Place
from cdtool.messages.fields import Field
from cdtool.recording import FloatArray

# One field of some of the messages, by their rows.
Gather = Callable[[IntArray, Field], Gathered]


@dataclass(frozen=True)
class NamedPlan:
    """A field whose step number `step` takes an element by its name; `array` is the plan of that step alone."""

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
