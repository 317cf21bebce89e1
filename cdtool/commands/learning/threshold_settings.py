"""A threshold rule and its settings, from the tables [threshold] and [signature] or from the command line."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import Field, fields
from typing import Any

from cdtool.base.errors import UsageError, nearest
from cdtool.base.files.bounded_loading import ContentError, parse_toml
from cdtool.base.tables import Table
from cdtool.base.value_words import value_in_words
from cdtool.recordings.motion.progress import ALIGNMENTS
from cdtool.thresholds import THRESHOLDS
from cdtool.thresholds.base import Threshold
from cdtool.thresholds.fitted_signature import RULES, SIDES
from cdtool.thresholds.settings import with_context
from cdtool.thresholds.signature import Signature

_DEFAULT = "signature"
_OPTIONS = {"alignment": "align"}  # of the command line, where their names differ from those of the settings


def read_signature(table: Table, default_sides: str) -> Signature:
    """Return the signature rule that the table [signature] describes."""
    if "debounce" in table:
        raise table.fault("debounce", "belongs in another table", "move it to [activation]")
    settings: dict[str, Any] = {
        "rule": table.choice("rule", RULES, "pooled"),
        "sides": table.choice("sides", SIDES, default_sides),
        "alignment": table.choice("alignment", ALIGNMENTS, "time_then_position"),
        "position_step": table.number("position_step", Signature.position_step, above=0.0),
        "position_window": table.number("position_window", Signature.position_window, above=0.0),
        "force": table.flag("force", False),
        "adaptive_level": table.number("adaptive_level", Signature.adaptive_level, minimum=0.0),
        "speed_range": table.flag("speed_range", Signature.speed_range),
    }
    if settings["speed_range"] and settings["alignment"] == "time":
        raise table.fault(
            "speed_range",
            "cannot be combined with an alignment by time: at another speed a time is another location",
            "align by time_then_position or position",
        )
    if "safety_factor" in table:
        settings["safety_factor"] = table.number("safety_factor", above=0.0)
    table.finish()
    return Signature(**settings)


def read_threshold(root: Table, signature: Signature) -> tuple[str, Threshold]:
    """Return the threshold's name and rule; raises ConfigurationError for an unknown name or key, or a wrong value.

    `threshold = "NAME"` selects NAME with default settings; a table [threshold] has `name` and NAME's own fields. The
    settings of the signature, also if another rule learns one, are in [signature]; so is the safety factor of any rule
    if [threshold] does not set it.
    """
    given = root.raw("threshold")
    if not isinstance(given, dict):
        names = THRESHOLDS.names_for(_DEFAULT if given is None else given)
        name, table = root.choice("threshold", names, _DEFAULT), Table({}, root.where, "threshold.")
    else:
        table = root.table("threshold")
        name = table.choice("name", THRESHOLDS.names_for(given.get("name", _DEFAULT)), _DEFAULT)
    if name == _DEFAULT:
        for key in table.values:
            if key != "name":
                raise table.fault(key, "is not a key of this table", "the signature's settings are in [signature]")
        return name, signature
    if signature.adaptive_level > 0.0:
        raise root.fault(
            "threshold",
            f"'{name}' does not follow a run: adaptive_level of [signature] is for the threshold 'signature'",
            "remove adaptive_level, or choose that threshold",
        )
    if signature.speed_range:
        raise root.fault(
            "threshold",
            f"'{name}' has no limits between speeds: speed_range of [signature] is for the threshold 'signature'",
            "remove speed_range, or choose that threshold",
        )
    rule = THRESHOLDS.load(name)
    own = [item for item in fields(rule) if item.name != "signature"]
    settings = {item.name: _value(table, item) for item in own if item.name in table}
    table.finish()
    if "limits" in settings and ("safety_factor" in settings or signature.safety_factor is not None):
        raise table.fault("safety_factor", "cannot be combined with limits set by hand", "remove one of the two")
    if "safety_factor" not in settings and signature.safety_factor is not None:
        settings["safety_factor"] = signature.safety_factor
    try:
        return name, with_context(rule(**settings), signature.sides, signature)
    except UsageError as fault:
        raise table.fault("name", f"'{name}': {fault.message}", fault.hint) from fault


def rule_of(name: str, given: Sequence[str], signature: Mapping[str, Any], default_sides: str) -> Threshold:
    """Return the rule of that name for a command line: `given` are KEY=VALUE settings, `signature` the signature's.

    Raises UsageError for an unknown name, ConfigurationError for an unknown key or a wrong value.
    """
    known = THRESHOLDS.names_for(name)
    if name not in known:
        raise UsageError(f"unknown threshold '{name}'", nearest(name, known))
    settings = dict(_setting(text) for text in given)
    if name == _DEFAULT:
        return read_signature(_Options({**signature, **settings}, settings), default_sides)
    learned = read_signature(_Options(signature, ()), default_sides)
    return read_threshold(Table({"threshold": {"name": name, **settings}}, "--set"), learned)[1]


class _Options(Table):
    """The settings of a command line: those in `by_set` were given by --set KEY=VALUE, the others by own options."""

    def __init__(self, values: Mapping[str, Any], by_set: Collection[str]) -> None:
        super().__init__(values, "")
        self._by_set = by_set

    def key(self, name: str) -> str:
        """Return the option that the user gave."""
        return f"--set: {name}" if name in self._by_set else f"--{_OPTIONS.get(name, name.replace('_', '-'))}"


def _setting(text: str) -> tuple[str, Any]:
    """Parse KEY=VALUE with a TOML value; a bare word is a text."""
    name, equals, value = (part.strip() for part in text.partition("="))
    if not (name and equals and value):
        raise UsageError(f"--set is '{text}'", "give KEY=VALUE, as drift=0.5; the keys are in docs/thresholds.md")
    try:
        return name, parse_toml(f"value = {value}")["value"]
    except ContentError:
        return name, value


def set_by_hand(rule: Threshold) -> bool:
    """Whether the rule's limits or its safety factor differ from the default."""
    return bool(getattr(rule, "limits", ())) or rule.safety_factor != type(rule)().safety_factor


def _value(table: Table, item: Field[Any]) -> Any:
    """Return a key's value, checked against the type of the field."""
    kind = item.type
    if kind == "bool":
        return table.flag(item.name, False)
    if kind in ("int", "int | None"):
        return table.whole(item.name, 0, minimum=0)
    if kind in ("float", "float | None"):
        return table.number(item.name)
    if kind == "tuple[int, ...]":
        return _numbers(table, item.name, int, "give a list of whole numbers")
    if kind == "tuple[float, ...]":
        return _numbers(table, item.name, (int, float), "give a list of numbers")
    return table.texts(item.name) if kind == "tuple[str, ...]" else table.text(item.name)


def _numbers(table: Table, name: str, kind: type | tuple[type, ...], wanted: str) -> tuple[Any, ...]:
    """Return a list of numbers; a single number is a list of one."""
    values = table.raw(name)
    values = values if isinstance(values, list) else [values]
    if not values or any(isinstance(x, bool) or not isinstance(x, kind) for x in values):
        raise table.fault(name, f"is {value_in_words(table.raw(name))}", wanted)
    return tuple(values)
