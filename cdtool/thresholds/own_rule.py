"""The rule of a detector that has its own, the only one that can assess its signal."""

from __future__ import annotations

from typing import Any

from cdtool.thresholds.base import Threshold
from cdtool.thresholds.settings import with_context
from cdtool.thresholds.signature import Signature


def rule_for(detector: Any, rule: Threshold) -> Threshold:
    """Return the rule that a detector's signal is judged by: its own if it names one, otherwise `rule`.

    Parameters
    ----------
    detector : Detector or type
        A detector or its class; its optional `own_threshold` is the name of a threshold.
    rule : Threshold
        The rule of the detectors that have none. Its sides, and its settings of a signature, also apply to the own one.

    Returns
    -------
    Threshold
        `rule` itself, also if it is the detector's own.

    Raises
    ------
    UsageError
        The name of the own threshold is unknown.

    Examples
    --------
    >>> from cdtool.detectors.fused import Fused
    >>> from cdtool.detectors.momentum import Momentum
    >>> from cdtool.thresholds.glr import Glr
    >>> rule_for(Momentum, Glr(sides="one")).name, rule_for(Fused, Glr(sides="one")).name
    ('glr', 'matched_banks')
    >>> rule_for(Fused, Glr(sides="one")).sides
    'one'
    """
    own = getattr(detector, "own_threshold", "")
    if not own or own == rule.name:
        return rule
    from cdtool.thresholds import THRESHOLDS

    signature = rule if isinstance(rule, Signature) else getattr(rule, "signature", None)
    made: Threshold = with_context(THRESHOLDS.load(own)(), getattr(rule, "sides", None), signature)
    return made
