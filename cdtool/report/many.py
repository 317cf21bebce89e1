"""When results are too many for each recording to be in a report: the worst and the failed ones are then."""

from __future__ import annotations

import math

from cdtool.results.evaluated import Evaluated
from cdtool.results.results import Results
from cdtool.results.summary import Summary

# A page with every recording of five detectors then has less than 15 MB.
MOST_RECORDINGS, MOST_CONTACTS = 5000, 30_000
# Of many results, a table of single contacts or recordings has the first ones; a comment in a pull request has fewer.
_MOST_ROWS = 1000
# Groups whose plots a page has: a browser takes seconds to draw hundreds.
MOST_GROUPS = 24


def is_many(results: Results) -> bool:
    """Return whether a report shows only the worst and the failed cases of these results.

    Parameters
    ----------
    results : Results
        The results of a benchmark.

    Returns
    -------
    bool
        True for more than 5,000 recordings, or 30,000 contacts with a detector each.

    Examples
    --------
    >>> is_many(Results({}, (), (), (), (), ()))
    False
    """
    return len(results.recordings) > MOST_RECORDINGS or len(results.contacts) > MOST_CONTACTS


def most_rows(results: Results) -> int | None:
    """Return the most rows of a table of single contacts or recordings; None: all of them.

    Parameters
    ----------
    results : Results
        The results of a benchmark.

    Returns
    -------
    int or None
        The number.

    Examples
    --------
    >>> most_rows(Results({}, (), (), (), (), ()))
    """
    return _MOST_ROWS if is_many(results) else None


def plotted_groups(evaluated: Evaluated) -> tuple[str, ...]:
    """Return the groups that have plots where results are many: of many groups, those that miss the most contacts.

    Parameters
    ----------
    evaluated : Evaluated
        The results of a benchmark with their statistics.

    Returns
    -------
    tuple of str
        In the order of the benchmark file; of groups that miss an equal share, the slower ones.

    Examples
    --------
    `cdtool.benchmark` returns evaluated results.
    """
    worst: dict[str, tuple[float, float]] = {}
    for item in evaluated.summaries:
        if item.contacts:
            worst[item.group] = max(worst.get(item.group, (-1.0, -1.0)), _badness(item))
    kept = sorted(worst, key=lambda group: worst[group], reverse=True)[:MOST_GROUPS]
    return tuple(group for group in worst if group in kept)


def _badness(item: Summary) -> tuple[float, float]:
    """Return the share of missed contacts, then the median latency [ms]; a figure that is not known is 0."""
    share, median = item.missed_share.value, item.median.value
    return (0.0 if math.isnan(share) else share), (0.0 if math.isnan(median) else median)
