"""[limits]: the smallest or largest allowed value of a metric, so that a pipeline can act on it.

Conventions: a key is detector.group.metric, or detector.metric for every group; `*` stands for all. A limit is met,
violated, or not assessable, which does not count as met: nothing passes because nothing was measured.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

from cdtool.base.errors import ConfigurationError, FieldsError, UsageError, nearest
from cdtool.base.findings import Finding
from cdtool.base.settings import Place, setting
from cdtool.results.results import LimitResult, RecordingFinding
from cdtool.results.summary import COUNTED_ALWAYS, FIGURES, Summary, kind_group

ALL = "*"
# The tables that name groups: in a benchmark file, a limit on a group whose table is wrong is not checked.
_GROUPS = ("", "impacts.", "conditions.")


@dataclass(frozen=True)
class LimitRule:
    """The metric `figure` of a detector in a group must lie within `least` and `largest`; `*`: of all of them."""

    key: str
    detector: str
    group: str
    figure: str
    least: float = -math.inf
    largest: float = math.inf


@dataclass(frozen=True, kw_only=True)
class Bounds:
    """What a metric may be; at least one of the two is given."""

    min: Annotated[float | None, setting("the smallest value that is allowed")] = None
    max: Annotated[float | None, setting("the largest value that is allowed")] = None

    def __post_init__(self) -> None:
        if self.min is None and self.max is None:
            raise UsageError("has no bound", "give { max = 50 }, { min = 1 } or both")
        if self.min is not None and self.max is not None and self.min > self.max:
            raise FieldsError(("min", "max"), f"is {self.min:g}, above max {self.max:g}", "exchange them")


def limit_rules(
    limits: Mapping[str, Bounds],
    place: Place,
    detectors: Sequence[tuple[str, str]],
    groups: Sequence[str],
    kinds: Sequence[str] = (),
    complete: bool = True,
) -> tuple[LimitRule, ...]:
    """Return the rules of [limits], with the mistakes in `place`.

    Parameters
    ----------
    limits : mapping of str to Bounds
        The table [limits] of a benchmark file.
    place : Place
        Where in the file it stands; gets a mistake for each key that names nothing.
    detectors : sequence of (str, str)
        Full and short names of the detectors.
    groups : sequence of str
        Names of the groups.
    kinds : sequence of str
        Names of the kinds of contacts in the groups, as GROUP/KIND; `*` does not stand for them.
    complete : bool
        Whether these are all groups and kinds; if not, because of another mistake, metrics and detectors are checked.

    Returns
    -------
    tuple of LimitRule
        The rules in the order of the file.

    Examples
    --------
    >>> limits, place = {"*.stiff.p95_ms": Bounds(max=50.0)}, Place("benchmark.toml", "limits.")
    >>> limit_rules(limits, place, [("momentum", "gm")], ["stiff"])
    (LimitRule(key='*.stiff.p95_ms', detector='*', group='stiff', figure='p95_ms', least=-inf, largest=50.0),)
    """
    full = {name: name for name, _ in detectors} | {short: name for name, short in detectors} | {ALL: ALL}
    rules = []
    for key, bounds in limits.items():
        detector, _, rest = key.partition(".")
        group, _, figure = rest.rpartition(".")  # the name of a group may contain dots
        group = group or ALL
        if not rest:
            place.note(key, "does not name a metric", 'give "detector.group.metric", e.g. "*.stiff.p95_ms"')
        elif figure not in FIGURES:
            place.note(key, f"unknown metric '{figure}'", nearest(figure, FIGURES))
        elif detector not in full:
            place.note(key, f"unknown detector '{detector}'", nearest(detector, full))
        elif not complete or place.has_mistake(*(f"{table}{group.partition('/')[0]}" for table in _GROUPS)):
            continue
        elif group != ALL and group not in (*groups, *kinds):
            place.note(key, f"unknown group '{group}'", nearest(group, [ALL, *groups, *kinds]))
        elif group in kinds and group not in groups and figure in COUNTED_ALWAYS:
            place.note(key, f"{figure} of one kind of contacts", "set this limit for the whole group")
        else:
            least = -math.inf if bounds.min is None else bounds.min
            largest = math.inf if bounds.max is None else bounds.max
            rules.append(LimitRule(key, full[detector], group, figure, least, largest))
    return tuple(rules)


def check_limits(
    rules: Sequence[LimitRule],
    summaries: Sequence[Summary],
    at_worst: Sequence[Summary] = (),
    named_only: Sequence[Summary] = (),
) -> tuple[LimitResult, ...]:
    """Check every rule against the metrics that it names; raises ConfigurationError if they do not exist.

    A rule is about `named_only`, summaries of one kind of contacts or of a changed condition, only if it names one.

    `at_worst` are the same summaries with the worst values that missing load-cell samples allow: a limit that is
    met only without them is not assessable.

    With `*` a group without contacts is left out if the metric needs contacts.
    """
    found: list[LimitResult] = []
    worst = {(item.detector, item.group): item for item in at_worst}
    for rule in rules:
        named = [
            item for item in summaries if rule.detector in (ALL, item.detector) and rule.group in (ALL, item.group)
        ] or [item for item in named_only if rule.detector in (ALL, item.detector) and rule.group == item.group]
        if not named and (unscored := _unscored_kind(rule, summaries)):
            found += unscored
            continue
        meant = [item for item in named if item.contacts or item.in_progress or rule.figure in COUNTED_ALWAYS]
        # A group of which no log could be scored has no figure either, but it should have had one.
        meant = meant or [item for item in named if not item.operations]
        if not meant:
            raise ConfigurationError(
                f"[limits] {rule.key}: not available in these results",
                "a metric of contacts requires a group with contacts and a detector that was run",
            )
        found += [_check(rule, item, worst.get((item.detector, item.group))) for item in meant]
    return tuple(found)


def _unscored_kind(rule: LimitRule, summaries: Sequence[Summary]) -> list[LimitResult]:
    """Return the outcomes of a limit on a kind of which no contact could be scored; empty for any other limit."""
    detectors = {
        item.detector: None
        for item in summaries
        if rule.detector in (ALL, item.detector) and rule.group.startswith(kind_group(item.group, " ")[:-1])
    }
    least = rule.least if math.isfinite(rule.least) else None
    largest = rule.largest if math.isfinite(rule.largest) else None
    reason = "no contact of this kind was scored"
    return [
        LimitResult(rule.key, name, rule.group, rule.figure, None, least, largest, "not_assessable", reason)
        for name in detectors
    ]


def unchecked(rules: Sequence[LimitRule], detectors: Sequence[str], file: str) -> list[RecordingFinding]:
    """Return the warning that limits of a file are set for detectors that were not run.

    Parameters
    ----------
    rules : sequence of LimitRule
        The limits of the file.
    detectors : sequence of str
        The detectors that were run.
    file : str
        The path of the file.

    Returns
    -------
    list of RecordingFinding
        One warning, or none.

    Examples
    --------
    >>> rules = [LimitRule("gm.*.missed", "gm", "*", "missed")]
    >>> unchecked(rules, ["feekf"], "benchmark.toml")[0].reason
    '1 of 1 limits not checked (gm not run)'
    """
    absent = [rule.detector for rule in rules if rule.detector not in (ALL, *detectors)]
    fact = {"count": len(absent), "limits": len(rules), "detectors": ", ".join(dict.fromkeys(absent))}
    return [RecordingFinding.of(file, Finding("limits_unchecked", "", fact))] if absent else []


def not_met(limits: Sequence[LimitResult]) -> list[LimitResult]:
    """Return the limits that are violated or not assessable.

    Parameters
    ----------
    limits : sequence of LimitResult
        Checked limits.

    Returns
    -------
    list of LimitResult
        All but those that are met.

    Examples
    --------
    `cdtool.benchmark` checks the limits of its file.
    """
    return [item for item in limits if item.outcome != "met"]


def _check(rule: LimitRule, summary: Summary, worst: Summary | None) -> LimitResult:
    value = FIGURES[rule.figure](summary)
    outcome: Literal["met", "violated", "not_assessable"] = "met"
    reason = None
    if math.isnan(value):
        outcome, reason = "not_assessable", summary.why_undefined(rule.figure)
    elif not rule.least <= value <= rule.largest:
        outcome = "violated"
        reason = f"{_text(value)} is {'more' if value > rule.largest else 'less'} than {_text(_crossed(rule, value))}"
    elif worst is not None and not rule.least <= (most := FIGURES[rule.figure](worst)) <= rule.largest:
        outcome = "not_assessable"
        holes = max(summary.onset_holes, summary.force_holes)
        most_words = f"{most:.6g}" if math.isfinite(most) else "of any size"
        reason = f"load-cell samples are missing in {holes} of {summary.contacts} contacts: it may be {most_words}"
    return LimitResult(
        limit=rule.key,
        detector=summary.detector,
        group=summary.group,
        figure=rule.figure,
        value=float(value) if math.isfinite(value) else None,
        least=rule.least if math.isfinite(rule.least) else None,
        largest=rule.largest if math.isfinite(rule.largest) else None,
        outcome=outcome,
        reason=reason,
    )


def _crossed(rule: LimitRule, value: float) -> float:
    return rule.largest if value > rule.largest else rule.least


def _text(value: float) -> str:
    return "not reached (too many missed)" if value == math.inf else f"{value:.6g}"
