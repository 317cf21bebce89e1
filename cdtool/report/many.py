"""When results are too many for each recording to be in a report: the worst and the failed ones are then."""

from __future__ import annotations

from cdtool.evaluation.results import Results

# A page with every recording of five detectors then has less than 15 MB.
MOST_RECORDINGS, MOST_CONTACTS = 5000, 30_000
# Of many results, a table of single contacts or recordings has the first ones; a comment in a pull request has fewer.
_MOST_ROWS = 1000


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
