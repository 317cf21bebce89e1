"""`threshold` of a benchmark file: a rule's name, or a table [threshold] with its name and its own settings."""

from __future__ import annotations

from dataclasses import Field, fields
from typing import Any

from cdtool.errors import UsageError
from cdtool.tables import Table
from cdtool.thresholds import THRESHOLDS
from cdtool.thresholds.settings import with_context
from cdtool.thresholds.signature import Signature

_DEFAULT = "signature"


def read_threshold(root: Table, signature: Signature) -> tuple[str, Any]:
    """The threshold's name and its rule; raises ConfigurationError for an unknown name or key, or a wrong value.

    `threshold = "NAME"` takes NAME's default settings, a table [threshold] has `name` and NAME's own fields. The
    settings of the signature, also where another rule learns one, are in [signature]; so is the safety factor of any
    rule for which [threshold] gives none.
    """
    names = THRESHOLDS.names(plugins=True)
    if not isinstance(root.raw("threshold"), dict):
        name, table = root.choice("threshold", names, _DEFAULT), Table({}, root.where, "threshold.")
    else:
        table = root.table("threshold")
        name = table.choice("name", names, _DEFAULT)
    if name == _DEFAULT:
        for key in table.values:
            if key != "name":
                raise table.fault(key, "is no key of this table", "the signature's settings are in [signature]")
        return name, signature
    rule = THRESHOLDS.load(name)
    own = [item for item in fields(rule) if item.name != "signature"]
    settings = {item.name: _value(table, item) for item in own if item.name in table}
    table.finish()
    if "safety_factor" not in settings and signature.safety_factor is not None:
        settings["safety_factor"] = signature.safety_factor
    try:
        return name, with_context(rule(**settings), signature.sides, signature)
    except UsageError as fault:
        raise table.fault("name", f"'{name}': {fault.message}", fault.hint) from fault


def _value(table: Table, item: Field[Any]) -> Any:
    """A key's value, checked against the type of the field's default."""
    default = item.default
    if isinstance(default, bool):
        return table.flag(item.name, default)
    if isinstance(default, int):
        return table.whole(item.name, default, minimum=0)
    if isinstance(default, float):
        return table.number(item.name, default)
    if isinstance(default, tuple) and all(isinstance(entry, int) for entry in default):
        return _whole_numbers(table, item.name)
    return table.texts(item.name) if isinstance(default, tuple) else table.text(item.name)


def _whole_numbers(table: Table, name: str) -> tuple[int, ...]:
    values = table.raw(name)
    if not isinstance(values, list) or any(isinstance(x, bool) or not isinstance(x, int) for x in values):
        raise table.fault(name, f"is {values!r}", "a list of whole numbers is needed")
    return tuple(values)
