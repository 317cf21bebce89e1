"""Channels of a lower rate in a table: their cells are empty in the rows that only faster channels have.

An empty cell among others with values is a missing sample. Where a channel has no value in the row after most of its
values, it was not sampled there: the rows with values are its own clock, and a longer pause in them is still a gap.
"""

from __future__ import annotations

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray


def sampled_rows(values: FloatArray) -> BoolArray | None:
    """Return the rows of a table in which a channel of a lower rate has a sample; None if its rate is that of the rows.

    Parameters
    ----------
    values
        The cells of the channel (n,) or (n, J), NaN where they are empty.

    Returns
    -------
    ndarray or None
        True (n,) for rows with a value of any joint, if most values are followed by a row without one.

    Examples
    --------
    >>> sampled_rows(np.array([1.0, np.nan, 2.0, np.nan, 3.0])).tolist()
    [True, False, True, False, True]
    >>> sampled_rows(np.array([1.0, 2.0, np.nan, 3.0, 4.0])) is None
    True
    """
    missing = np.isnan(values)
    rows: BoolArray = np.logical_not(missing if missing.ndim == 1 else missing.all(axis=1))
    steps = np.diff(np.flatnonzero(rows))
    if len(steps) + 1 < 3 or np.median(steps) < 2.0:  # with two values a rate is not evident
        return None
    return rows
