"""What has to be the same in two results that are compared, and what is under test and may differ."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cdtool.activation import DEBOUNCE_TIME
from cdtool.errors import ConfigurationError
from cdtool.evaluation.truth.labels import LABEL_FILE
from cdtool.plain_text import counted, shorten

# Provenance keys of settings that define the results, and where the benchmark file sets them.
_RULES = {
    "onset": "[onset]",
    "separation_s": "[onset] separation_s",
    "label_file": "[onset] labels",
    "synchronisation_s": "[onset] synchronisation_s",
    "window_s": "window_s",
    "operations": "operations",
    "watched_joints": "joints",
    "mass_before_cell_kg": "[force] mass_before_cell_kg",
    "force_profiles": "[force] limits or profile",
}
_BY_GROUP = ("window_s", "force_profiles")
_UNDER_TEST = (
    "tool_version",
    "machine",
    "machine_sha256",
    "gains",
    "threshold",
    "threshold_rule",
    "safety_factor_set",
    "signature_rule",
    "debounce_samples",
    "rearm_s",
    "hysteresis",
    "latch",
    "false_alarm_budget",
    "signature_sha256",
    "plugins",
)
_BY_DETECTOR = ("gains", "signature_sha256")
_LONGEST = 80
_DEFAULT_DEBOUNCE = f"default ({1e3 * DEBOUNCE_TIME:g} ms)"
_HASH = re.compile(r"[0-9a-f]{64}")

Leaf = tuple[str, Any, Any]


@dataclass(frozen=True)
class Changed:
    """A setting that differs between the builds; "none" where a file does not hold it."""

    key: str
    old: str
    new: str


def refuse_other_rules(old: Mapping[str, Any], new: Mapping[str, Any], groups: Sequence[str]) -> None:
    """Raise ConfigurationError if a rule that defines the results of these groups differs."""
    for key, where in _RULES.items():
        before, after = old.get(key), new.get(key)
        if key in _BY_GROUP:
            before, after = _only(before, groups), _only(after, groups)
        if key == "label_file":
            # Other recordings have other labels; the same ones with other onsets are refused where they are paired.
            before, after = before is not None, after is not None
        if key == "onset":
            before, after = (_without_label_file(rule) for rule in (before, after))
        for name, one, other in _leaves(key, before, after):
            if key == "onset" and _in_samples(one) != _in_samples(other):
                which = "old" if _in_samples(one) else "new"
                raise ConfigurationError(
                    f"{which} is of an earlier version, whose onsets are counted in samples, not in ms",
                    f"run the benchmark of {which} again with this version: such figures cannot be compared",
                )
            raise ConfigurationError(
                f"{name} differs: {_shown(one)} in old, {_shown(other)} in new",
                f"such figures cannot be compared: set {where} of the benchmark file alike and run one of them again",
            )


def _in_samples(rule: Any) -> bool:
    return isinstance(rule, str) and bool(re.search(r"\bfor \d+ samples?\b", rule))


def _without_label_file(rule: Any) -> Any:
    return rule.partition(LABEL_FILE)[0] if isinstance(rule, str) else rule


def changed_settings(old: Mapping[str, Any], new: Mapping[str, Any], detectors: Sequence[str]) -> list[Changed]:
    """What is under test and differs, of the detectors that both hold."""
    found = []
    for key in _UNDER_TEST:
        before, after = old.get(key), new.get(key)
        if key in _BY_DETECTOR:
            before, after = _only(before, detectors), _only(after, detectors)
        if key == "debounce_samples":
            before, after = (
                _DEFAULT_DEBOUNCE if key in side and side[key] is None else side.get(key) for side in (old, new)
            )
        found += [Changed(name, _shown(one), _shown(other)) for name, one, other in _leaves(key, before, after)]
    return found + _other_runs(old, new)


def _other_runs(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[Changed]:
    """Runs learned from, told apart by their bytes."""
    before, after = (_only(side.get("learned_sha256"), None) for side in (old, new))
    if sorted(map(str, before.values())) == sorted(map(str, after.values())):
        return []
    both = len({str(value) for value in before.values()} & {str(value) for value in after.values()})
    return [
        Changed("learned_runs", counted(len(before), "run"), f"{counted(len(after), 'run')}, {both} of them the same")
    ]


def _only(values: Any, names: Sequence[str] | None) -> dict[str, Any]:
    if not isinstance(values, Mapping):
        return {}
    return {name: value for name, value in values.items() if names is None or name in names}


def _leaves(key: str, old: Any, new: Any) -> Iterator[Leaf]:
    """What differs, as far down as tables and lists of one length go."""
    if isinstance(old, Mapping) and isinstance(new, Mapping):
        for name in [*old, *(name for name in new if name not in old)]:
            yield from _leaves(f"{key}.{name}", old.get(name), new.get(name))
    elif isinstance(old, list | tuple) and isinstance(new, list | tuple) and len(old) == len(new):
        for i, (one, other) in enumerate(zip(old, new, strict=True)):
            yield from _leaves(f"{key}[{i}]", one, other)
    elif old != new:
        yield key, old, new


def _shown(value: Any) -> str:
    if value is None:
        return "none"
    text = value if isinstance(value, str) else json.dumps(value, ensure_ascii=False, default=str)
    # The beginning of a hash tells it apart as well.
    return text[:12] if _HASH.fullmatch(text) else shorten(text, _LONGEST)
