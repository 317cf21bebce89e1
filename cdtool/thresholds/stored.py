"""Rules and fitted thresholds as JSON values, and back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from cdtool.base.errors import SignatureError
from cdtool.thresholds.base import Threshold


def rule_to_dict(rule: Threshold) -> dict[str, Any]:
    """Return the name and the settings of a rule as JSON values.

    Parameters
    ----------
    rule : Threshold
        Any threshold.

    Returns
    -------
    dict
        The keys "rule" and "settings".

    Examples
    --------
    >>> from cdtool.thresholds.trend import Trend
    >>> rule_to_dict(Trend(safety_factor=6.0))["settings"]["safety_factor"]
    6.0
    """
    return {"rule": rule.name, "settings": asdict(rule)}


def rule_from_dict(values: Mapping[str, Any]) -> Any:
    """Return the rule that `rule_to_dict` has written.

    Parameters
    ----------
    values : mapping
        The keys "rule" and "settings"; lists become tuples again, a table the settings of a signature.

    Returns
    -------
    Threshold
        The rule.

    Raises
    ------
    UsageError
        The name of the rule is unknown.

    Examples
    --------
    >>> from cdtool.thresholds.glr import Glr
    >>> rule_from_dict(rule_to_dict(Glr(windows=(4, 16)))) == Glr(windows=(4, 16))
    True
    """
    from cdtool.thresholds import THRESHOLDS
    from cdtool.thresholds.signature import Signature

    def value(item: Any) -> Any:
        if isinstance(item, dict):
            return Signature(**item)
        return tuple(item) if isinstance(item, list) else item

    settings = {name: value(item) for name, item in values["settings"].items()}
    return THRESHOLDS.load(values["rule"])(**settings)


def fitted_to_dict(rule: Threshold, fitted: Any) -> dict[str, Any]:
    """Return a fitted threshold as JSON values, with the name of its class.

    Parameters
    ----------
    rule : Threshold
        The rule that it was fitted by.
    fitted : FittedThreshold
        What `rule.fit` returned.

    Returns
    -------
    dict
        The key "fitted", and those of `fitted.to_dict`.

    Raises
    ------
    SignatureError
        Its class is not among those that `rule.fitted` names, or it fails.

    Examples
    --------
    >>> from cdtool.thresholds.limit import Limit
    >>> values = fitted_to_dict(Limit(), Limit.given([400.0]))
    >>> values["fitted"], values["spread_above"]
    ('FittedLimit', [400.0])
    """
    if type(fitted) not in rule.fitted:
        raise SignatureError(
            f"threshold {rule.name} returns {type(fitted).__name__}, which its `fitted` does not name",
            "an error in the threshold: see docs/own-detector.md",
        )
    try:
        return {"fitted": type(fitted).__name__, **fitted.to_dict()}
    except Exception as fault:
        raise SignatureError(
            f"threshold {rule.name} cannot be stored: {fault!r}", "an error in the threshold: see docs/own-detector.md"
        ) from fault


def fitted_from_dict(rule: Threshold, values: Mapping[str, Any]) -> Any:
    """Return the fitted threshold that `fitted_to_dict` has written.

    Parameters
    ----------
    rule : Threshold
        The rule that it was fitted by.
    values : mapping
        What `fitted_to_dict` returned.

    Returns
    -------
    FittedThreshold
        The fitted threshold.

    Raises
    ------
    KeyError
        Its class is not among those that `rule.fitted` names.

    Examples
    --------
    >>> from cdtool.thresholds.limit import Limit
    >>> fitted_from_dict(Limit(), fitted_to_dict(Limit(), Limit.given([400.0]))).upper
    (400.0,)
    """
    known: dict[str, Any] = {item.__name__: item for item in rule.fitted}
    return known[values["fitted"]].from_dict(values)
