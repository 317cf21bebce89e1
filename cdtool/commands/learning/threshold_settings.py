"""A threshold rule and its settings, from the tables [threshold] and [signature]."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from cdtool.base.errors import UsageError, nearest
from cdtool.base.settings import Place, keys_of, read
from cdtool.thresholds import THRESHOLDS
from cdtool.thresholds.base import Threshold
from cdtool.thresholds.fitted_signature import Sides
from cdtool.thresholds.settings import with_context
from cdtool.thresholds.signature import Signature

_DEFAULT = "signature"


def threshold_of(
    given: str | Mapping[str, Any], signature: Signature, default_sides: Sides, place: Place
) -> tuple[str, Threshold, Signature]:
    """Return the threshold's name, its rule, and the signature, with the mistakes of single keys in `place`.

    Raises ConfigurationError for an unknown threshold, and for settings that do not fit together.

    A text selects a threshold with its default settings; a table has `name` and that threshold's own fields. `limits`
    without a name are those of the threshold `limit`. The
    settings of the signature, also if another rule learns one, are in [signature]; so is the safety factor of any rule
    if [threshold] does not set it.
    """
    signature = signature if signature.sides else replace(signature, sides=default_sides)
    table: dict[str, Any] = (
        {"name": given} if isinstance(given, str) else {"name": "limit" if "limits" in given else _DEFAULT, **given}
    )
    name = table.pop("name")
    below = place if isinstance(given, str) else place.below("threshold")
    key = "threshold" if isinstance(given, str) else "name"
    known = THRESHOLDS.names_for(name)
    if name not in known:
        raise below.fault(key, f"is {name!r}", nearest(str(name), known))
    if name == _DEFAULT:
        for other in table:
            hint = "name its threshold with threshold.name; the signature's settings are in [signature]"
            below.note(other, "is not a key of the threshold signature", hint)
        return name, signature, signature
    for own, problem in (("adaptive_level", "does not follow a run"), ("speed_range", "has no limits between speeds")):
        if getattr(signature, own):
            what = f"'{name}' {problem}: {own} of [signature] is for the threshold 'signature'"
            raise place.fault("threshold", what, f"remove {own}, or choose that threshold")
    kind = THRESHOLDS.load(name)
    if "safety_factor" in keys_of(kind) and "safety_factor" not in table and signature.safety_factor is not None:
        table["safety_factor"] = signature.safety_factor
    if "limits" in table and "safety_factor" in table:
        raise below.fault("safety_factor", "cannot be combined with limits set by hand", "remove one of the two")
    if (rule := read(kind, table, below)) is None:
        return name, signature, signature
    try:
        return name, with_context(rule, signature.sides, signature), signature
    except UsageError as fault:
        raise below.whole(fault) from fault


def set_by_hand(rule: Threshold) -> bool:
    """Whether the rule's limits or its safety factor differ from the default."""
    return bool(getattr(rule, "limits", ())) or rule.safety_factor != type(rule)().safety_factor
