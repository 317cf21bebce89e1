"""What is printed of an axis of another simulator contains the truth, or is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

import cdtool
from tests.synthetic.foreign_axes import drawn, errors_of, write_logs


@pytest.mark.parametrize(
    ("number", "refused"),
    [
        pytest.param(1, {"model.drive.stiffness"}, id="take-up"),
        pytest.param(2, set(), id="stiffening"),
        pytest.param(6, set(), id="one stiffness"),
    ],
)
def test_the_printed_95_percent_contain_the_truth_or_the_value_is_refused(
    tmp_path: Path, number: int, refused: set[str]
) -> None:
    axis = drawn(number)
    errors = errors_of(axis, cdtool.identify(*write_logs(axis, tmp_path)))
    assert {key for key, error in errors.items() if abs(error) > 1.96} == set()
    assert {key for key, error in errors.items() if error != error} == refused
