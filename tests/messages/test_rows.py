from __future__ import annotations

import numpy as np

from cdtool.messages.topic_columns import Rows


def test_more_rows_than_expected_are_appended_and_those_of_another_width_are_nan():
    rows = Rows(3)
    for first in (0.0, 2.0, 4.0):
        rows.append(np.array([[first, -first], [first + 1, -first - 1]]))
    rows.append(np.ones((1, 3)))
    assert rows.values[:6, 0].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]
    assert np.isnan(rows.values[6:]).all()
