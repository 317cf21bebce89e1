"""Tests of one detector in one group of two builds: latency, force, misses, not assessable, false alarms.

Conventions: a change is new minus old, and more is worse in every quantity. A test that no outcome could have decided,
such as misses where nothing was missed, has no p (NaN) and does not count as asked. All p are two-sided. A
detectable change is infinite if no change could have been shown.

A test leaves open the largest change for the worse that the recordings do not rule out, as a share: of the
old mean; of the contacts; or false alarms per operation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, replace
from typing import Literal

import numpy as np

from cdtool.results.results import ContactResult
from cdtool.statistics.interval import Interval
from cdtool.statistics.paired import RESAMPLES, fisher_p, mcnemar_p, paired_difference, unpaired_difference
from cdtool.statistics.rates import (
    binomial_at_most,
    binomial_increase_at_most,
    poisson_difference_p,
    poisson_increase_at_most,
)
from cdtool.statistics.sample_size import detectable_difference
from cdtool.statistics.small_sample import FEWEST
from cdtool.statistics.spread import Spread, spread_of

Figure = Literal["latency_ms", "force_at_alarm_n", "missed", "not_assessable", "false_alarms"]
Pairs = Sequence[tuple[ContactResult, ContactResult]]
Ranges = tuple[tuple[float, float], tuple[float, float]]
Labels = Mapping[str, str]
"""What each recording of a build is resampled with."""

# Usual in planning a test (Cohen 1988): four of five differences are shown.
POWER = 0.8
# Clocks and interpolation leave traces far below a microsecond or a millinewton: they are no change [ms, N].
LEAST_CHANGE = 5e-4


@dataclass(frozen=True)
class Watched:
    """What a detector watched in a group: false alarms in so many hours and in so many operations that it judged."""

    false_alarms: int
    hours: float
    operations: int


@dataclass(frozen=True)
class Compared:
    """One quantity of one detector in one group in both builds.

    `old` and `new`: means over `old_of` and `new_of` contacts (medians of forces, and of latencies where `ranges` has
    the shortest and the longest of either build: fewer than ten contacts), or counts in that many contacts, operations
    or hours. `change` is new minus old, for counts a share or a rate without an interval. `p` of no change is NaN if
    there was nothing to test; `reason` states why. `same`: every pair has the same value, which needs no test.
    `complete_change_p`: the exact probability of a change so complete that it needs no test; NaN where it is not.
    """

    figure: Figure
    old: float
    old_of: float
    new: float
    new_of: float
    change: Interval
    p: float
    _: KW_ONLY
    reason: str = ""
    same: bool = False
    complete_change_p: float = math.nan
    ranges: Ranges | None = None


@dataclass(frozen=True, kw_only=True)
class Asked(Compared):
    """What is compared, and what depends on the p at which a change counts as shown.

    `detectable(alpha)` is the least change that would have been shown: for a mean with 80 % power, else the smallest
    count of the new build for which the test shows it. Infinite: the sample is too small for any change.
    `left_open(alpha)` is the change that is not ruled out, of counts with 95 %; NaN: there is nothing to ask.
    """

    detectable: Callable[[float], float]
    left_open: Callable[[float], float] = lambda _: math.nan


def ask_mean(
    figure: Literal["latency_ms", "force_at_alarm_n"],
    old: Sequence[ContactResult],
    new: Sequence[ContactResult],
    labels: tuple[Labels, Labels],
    paired: bool,
    level: float,
) -> Asked:
    """Mean of `figure` over the contacts that have it: in both where `old` and `new` are `paired` one by one."""
    if paired:
        both = [pair for pair in zip(old, new, strict=True) if all(getattr(item, figure) is not None for item in pair)]
        old, new = [pair[0] for pair in both], [pair[1] for pair in both]
    before, after = _valued(figure, old, labels[0]), _valued(figure, new, labels[1])
    if not before[0] or not after[0]:
        # Which contacts have it is what misses and not assessable are about: they decide.
        reason = f"no contact has {'it in both' if paired else 'it in one of them'}"
        return _without(figure, (math.nan, len(before[0])), (math.nan, len(after[0])), reason)
    means = (spread_of(*before), spread_of(*after))
    differences: list[float] = []
    if paired:
        differences = [round(b - a, 3) for a, b in zip(before[0], after[0], strict=True)]
        found = paired_difference(differences, before[1], level)
        detectable = _paired_detectable(spread_of(differences, before[1]))
    else:
        found = unpaired_difference(after[0], before[0], after[1], before[1], level)
        detectable = _unpaired_detectable(*means)
    reason = "" if not math.isnan(found.p) else "fewer than two recordings or campaigns"

    def left_open(alpha: float) -> float:
        return math.inf if reason else detectable(alpha) / abs(means[0].mean) if means[0].mean else math.inf

    # A force at the alarm is a median wherever it stands, a latency of few contacts as in a benchmark; their change is
    # the mean one of what is tested.
    old_value, new_value = means[0].mean, means[1].mean
    few = figure == "latency_ms" and min(len(before[0]), len(after[0])) < FEWEST
    ranges = (_ends(before[0]), _ends(after[0])) if few else None
    if few or figure == "force_at_alarm_n":
        old_value, new_value = float(np.median(before[0])), float(np.median(after[0]))
    return Asked(
        figure,
        old_value,
        means[0].n,
        new_value,
        means[1].n,
        found.mean,
        found.p,
        detectable=detectable,
        reason=reason,
        same=paired and not any(differences),
        left_open=left_open,
        ranges=ranges,
    )


def _ends(values: Sequence[float]) -> tuple[float, float]:
    return min(values), max(values)


def ask_missed(old: Sequence[ContactResult], new: Sequence[ContactResult], paired: bool) -> Asked:
    """Missed contacts among the assessable ones: exact McNemar where paired, else Fisher."""
    if paired:
        both = [pair for pair in zip(old, new, strict=True) if all(_assessable(item) for item in pair)]
        flags = ([a.outcome == "missed" for a, _ in both], [b.outcome == "missed" for _, b in both])
    else:
        flags = (
            [item.outcome == "missed" for item in old if _assessable(item)],
            [item.outcome == "missed" for item in new if _assessable(item)],
        )
    return _ask_flags("missed", *flags, paired)


def ask_not_assessable(old: Sequence[ContactResult], new: Sequence[ContactResult], paired: bool) -> Asked:
    """Contacts that could not be assessed, of all: exact McNemar where paired, else Fisher."""
    flags = ([not _assessable(item) for item in old], [not _assessable(item) for item in new])
    return _ask_flags("not_assessable", *flags, paired)


def ask_not_assessable_operations(old: tuple[int, int], new: tuple[int, int], paired: bool) -> Asked:
    """Compare operations that were nowhere assessable, in a group without contacts: (count, of) each; Fisher."""
    asked = _ask_counts("not_assessable", old, new)
    return replace(asked, same=paired and old == new and old[0] < old[1])


def ask_false_alarms(old: Watched, new: Watched, paired: bool) -> Asked:
    """False alarms in the hours watched: the exact test of two rates, in paired data too.

    The same recordings in both make it err on the side of no change.
    """
    count, hours, count_new, hours_new = old.false_alarms, old.hours, new.false_alarms, new.hours
    if not (hours > 0.0 and hours_new > 0.0):
        reason = "nothing was monitored in one of them"
        return _without("false_alarms", (count, hours), (count_new, hours_new), reason, math.inf)

    def p_of(number: int) -> float:
        return poisson_difference_p(number, hours_new, count, hours)

    p = p_of(count_new) if count + count_new else math.nan
    change = Interval(count_new / hours_new - count / hours, math.nan, math.nan)
    # Nobody counts more false alarms.
    least = _least_count(p_of, math.floor(count * hours_new / hours), 10_000)
    same = paired and (count, hours) == (count_new, hours_new)
    open_rate = poisson_increase_at_most(count_new, new.operations, count, old.operations)
    return Asked(
        "false_alarms",
        count,
        hours,
        count_new,
        hours_new,
        change,
        p,
        detectable=least,
        same=same,
        left_open=lambda _: open_rate,
    )


def _ask_flags(
    figure: Literal["missed", "not_assessable"], old: Sequence[bool], new: Sequence[bool], paired: bool
) -> Asked:
    before, after = sum(old), sum(new)
    if not paired:
        return _ask_counts(figure, (before, len(old)), (after, len(new)))
    if not old:
        return _without(figure, (0, 0), (0, 0), "no contact assessable in both", math.inf)
    only_old = sum(a and not b for a, b in zip(old, new, strict=True))
    only_new = sum(b and not a for a, b in zip(old, new, strict=True))

    def p_of(number: int) -> float:
        return mcnemar_p(only_old, max(number - (before - only_old), 0))

    p = mcnemar_p(only_old, only_new) if only_old + only_new else math.nan
    change = Interval((after - before) / len(old), math.nan, math.nan)
    least = _least_count(p_of, before, len(old) - only_old)
    n = len(old)
    worse, better = after == n and 2 * only_new >= n, before == n and after == 0
    # If either build could as well have missed each of them, all on one side: 1/2 for each.
    complete_p = 0.5 ** (only_new if worse else only_old) if (worse and only_new) or better else math.nan
    # What is newly missed bounds the increase from above.
    open_share = binomial_at_most(only_new, n)
    return Asked(
        figure,
        before,
        n,
        after,
        n,
        change,
        p,
        detectable=least,
        same=not only_old + only_new,
        left_open=lambda _: open_share,
        complete_change_p=complete_p,
    )


def _ask_counts(figure: Literal["missed", "not_assessable"], old: tuple[int, int], new: tuple[int, int]) -> Asked:
    (before, of), (after, of_new) = old, new
    if not of or not of_new:
        return _without(figure, old, new, "nothing to assess in one of them", math.inf)

    def p_of(number: int) -> float:
        return fisher_p(number, of_new, before, of)

    p = p_of(after) if before + after else math.nan
    change = Interval(after / of_new - before / of, math.nan, math.nan)
    open_share = binomial_increase_at_most(after, of_new, before, of)
    return Asked(
        figure,
        before,
        of,
        after,
        of_new,
        change,
        p,
        detectable=_least_count(p_of, before * of_new // of, of_new),
        left_open=lambda _: open_share,
        complete_change_p=_complete_by_counts(before, of, after, of_new),
    )


def _complete_by_counts(before: int, of: int, after: int, of_new: int) -> float:
    """Of a change from at most half of the old ones to all of the new ones, or from all to none, on other contacts.

    Hypergeometric: the chance that all of the good ones, drawn from both builds together, fall on one side. Above 1 in
    20 it is no such change: other contacts differ, too.
    """
    if after == of_new and 2 * before <= of:
        good, side = of - before, of
    elif before == of and after == 0:
        good, side = of_new, of_new
    else:
        return math.nan
    p = math.comb(side, good) / math.comb(of + of_new, good)
    return p if p <= 0.05 else math.nan


def _without(
    figure: Figure, old: tuple[float, float], new: tuple[float, float], reason: str, left_open: float = math.nan
) -> Asked:
    change = Interval(math.nan, math.nan, math.nan)
    return Asked(
        figure,
        *old,
        *new,
        change,
        math.nan,
        detectable=lambda _: math.nan,
        reason=reason,
        left_open=lambda _: left_open,
    )


def _assessable(contact: ContactResult) -> bool:
    return contact.outcome != "not_assessable"


def _valued(figure: str, contacts: Sequence[ContactResult], labels: Labels) -> tuple[list[float], list[str]]:
    known = [item for item in contacts if getattr(item, figure) is not None]
    return [getattr(item, figure) for item in known], [labels.get(item.recording, item.recording) for item in known]


def _paired_detectable(spread: Spread) -> Callable[[float], float]:
    """Return the least mean difference of pairs with this spread that the sign-flip test shows at a given p."""
    k = spread.clusters
    patterns = 2**k if k <= 13 else math.inf

    def least(alpha: float) -> float:
        return _detectable(k, spread.std, alpha, patterns)

    return least


def _unpaired_detectable(old: Spread, new: Spread) -> Callable[[float], float]:
    """Return the least difference of two means that the permutation test shows at a given p.

    A t-test with k_a + k_b - 2 degrees of freedom is one of k_a + k_b - 1 differences: only the error differs.
    """
    k = old.clusters + new.clusters - 1
    std = math.hypot(old.error, new.error) * math.sqrt(k)
    divisions = math.comb(old.clusters + new.clusters, old.clusters)

    def least(alpha: float) -> float:
        return _detectable(k, std, alpha, divisions)

    return least


def _detectable(n: int, std: float, alpha: float, patterns: float) -> float:
    """What a test with so many equally likely patterns shows at `alpha`; their number bounds its p from below."""
    lowest_p = 2.0 / patterns if patterns <= RESAMPLES else 2.0 / (RESAMPLES + 1)
    if lowest_p >= alpha or math.isnan(std):
        return math.inf
    return detectable_difference(n, std, POWER, 1.0 - alpha) if std > 0.0 else 0.0


def _least_count(p_of: Callable[[int], float], start: int, most: int) -> Callable[[float], float]:
    """The least count above `start`, where p is largest, whose p is below alpha; infinite above `most`."""

    def least(alpha: float) -> float:
        below, above = start, start + 1
        while above <= most and p_of(above) >= alpha:
            below, above = above, (min(2 * above, most) if above < most else most + 1)
        if above > most:
            return math.inf
        while above - below > 1:
            middle = (above + below) // 2
            below, above = (middle, above) if p_of(middle) >= alpha else (below, middle)
        return above

    return least
