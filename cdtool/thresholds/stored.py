"""Rules and fitted thresholds as JSON values, and back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from cdtool.errors import SignatureError
from cdtool.thresholds.base import Threshold


def rule_to_dict(rule: Threshold) -> dict[str, Any]:
    """A rule's name and settings."""
    return {"rule": rule.name, "settings": asdict(rule)}


def rule_from_dict(values: Mapping[str, Any]) -> Any:
    """The rule that `rule_to_dict` has written; JSON's lists become tuples again, a table the signature's settings."""
    from cdtool.thresholds import THRESHOLDS
    from cdtool.thresholds.signature import Signature

    def value(item: Any) -> Any:
        if isinstance(item, dict):
            return Signature(**item)
        return tuple(item) if isinstance(item, list) else item

    settings = {name: value(item) for name, item in values["settings"].items()}
    return THRESHOLDS.load(values["rule"])(**settings)


def fitted_to_dict(rule: Threshold, fitted: Any) -> dict[str, Any]:
    """A fitted threshold with the name of its class, which must be among those that its rule names in `fitted`."""
    if type(fitted) not in rule.fitted:
        raise SignatureError(
            f"threshold {rule.name} makes {type(fitted).__name__}, which its `fitted` does not name",
            "a fault of the threshold: see docs/own-detector.md",
        )
    try:
        return {"fitted": type(fitted).__name__, **fitted.to_dict()}
    except Exception as fault:
        raise SignatureError(
            f"threshold {rule.name} cannot be stored: {fault!r}", "a fault of the threshold: see docs/own-detector.md"
        ) from fault


def fitted_from_dict(rule: Threshold, values: Mapping[str, Any]) -> Any:
    """The inverse of `fitted_to_dict`; raises KeyError for a class that the rule does not make."""
    known: dict[str, Any] = {item.__name__: item for item in rule.fitted}
    return known[values["fitted"]].from_dict(values)
