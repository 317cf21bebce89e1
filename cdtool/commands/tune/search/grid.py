"""The threshold rules and settings that are tried: the first part of a search."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from cdtool.base.errors import CdtoolError
from cdtool.thresholds.base import Threshold

# Consecutive samples that raise an alarm.
DEBOUNCES = (1, 3, 5, 9)
# The shortest time that they take [s] unless another one is asked for: a spike of two samples at 1 kHz is no alarm.
SHORTEST_DEBOUNCE = 3e-3


def rules_to_try(rules: Sequence[Threshold], channels: Iterable[str]) -> list[Threshold]:
    """Return each rule with every combination of the settings that it names to be searched.

    Parameters
    ----------
    rules : sequence of Threshold
        The rules with their other settings.
    channels : iterable of str
        The channels of the recordings; a rule that needs another one is left out.

    Returns
    -------
    list of Threshold
        The rules, each as it is and with the values of its `searched`: a class attribute, optional, with the values to
        be tried by the name of the setting.

    Examples
    --------
    >>> from cdtool.thresholds.glr import Glr
    >>> [rule.order for rule in rules_to_try([Glr()], ["speed", "position"])]
    [4, 12]
    """
    known = set(channels)
    found: dict[Threshold, None] = {}
    for rule in rules:
        if not known.issuperset(rule.needs):
            continue
        searched: Mapping[str, Sequence[Any]] = getattr(rule, "searched", {})
        found.setdefault(rule)
        for values in itertools.product(*searched.values()):
            try:
                found.setdefault(replace(rule, **dict(zip(searched, values, strict=True))))
            except CdtoolError:
                continue  # settings that exclude each other
    return list(found)


def debounces_to_try(period: float, shortest: float = SHORTEST_DEBOUNCE) -> tuple[int, ...]:
    """Return the numbers of samples to try: those of a grid that last at least `shortest` [s] at a sample period [s].

    Examples
    --------
    >>> debounces_to_try(1e-3), debounces_to_try(5e-3), debounces_to_try(1e-4)
    ((3, 5, 9), (1, 3, 5, 9), (30,))
    """
    long_enough = tuple(count for count in DEBOUNCES if count * period >= shortest - 1e-9)
    return long_enough or (max(1, round(shortest / period)),)
