"""Fields of the field language -> their places in the messages of a schema."""

from __future__ import annotations

from cdtool.messages.columns.by_name import NamedPlan, numbered
from cdtool.messages.columns.picking import WHOLE, Plan
from cdtool.messages.columns.slots import Place
from cdtool.messages.fields import Field, FieldMissingError, is_element_number
from cdtool.messages.layouts.layout import Layout, Member, Message, Schema, Text

_NO_MEMBERS = Layout("", ())  # of a number or text


def resolve(field: Field, schema: Schema) -> Plan | NamedPlan:  # noqa: C901  one check for each kind of schema member
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
            if index == WHOLE:
                names = names_place(layout, parent)
            else:
                names = None if is_element_number(index or "") else _named_place(layout, parent)
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
                resolve(numbered(field, i, 0), schema)  # whichever element it is, what stands behind it must be there
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


def _named_place(layout: Layout, parent: Place) -> Place:
    """The place of the texts that must be there; raises FieldMissingError."""
    place = names_place(layout, parent)
    if place is None:
        problem = "'name' is not an array" if layout.member("name") else "there is no 'name'"
        raise FieldMissingError(problem, layout.names)
    return place


def names_place(layout: Layout, parent: Place) -> Place | None:
    """The place of the texts `name` beside an array; None where there are none."""
    member = layout.member("name")
    if member is None or member.array is None or not isinstance(member.kind, Text):
        return None
    return (*parent, "name")
