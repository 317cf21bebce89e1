"""What is printed of an axis of another simulator contains the truth, or is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

import cdtool
from cdtool.formats.machine_file import read_machine_file
from cdtool.machines.axis_model.model_table import axis_model
from cdtool.machines.linear_axis import LinearAxis
from tests.synthetic.foreign_axes import drawn, errors_of, write_logs


@pytest.mark.parametrize(
    ("number", "refused"),
    [
        pytest.param(1, {"model.drive.stiffness"}, id="take-up"),
        pytest.param(2, set(), id="stiffening"),
        pytest.param(6, set(), id="one stiffness"),
        pytest.param(
            22,
            {
                "model.drive.stiffness",
                "machine.load_mass",
                "machine.coulomb_friction",
                "model.friction.coulomb_forward",
                "model.friction.static",
            },
            id="viscous friction that starts do not show",
        ),
    ],
)
def test_the_printed_95_percent_contain_the_truth_or_the_value_is_refused(
    tmp_path: Path, number: int, refused: set[str]
) -> None:
    axis = drawn(number)
    logs, machine = write_logs(axis, tmp_path)
    done = cdtool.identify(logs, machine, machine)
    errors = errors_of(axis, done)
    assert {key for key, error in errors.items() if abs(error) > 1.96} == set()
    assert {key for key, error in errors.items() if error != error} == refused
    assert not {(item.section, item.key) for item in done.joints[0].not_identifiable} & {
        (item.section, item.key) for item in done.changes
    }
    written = read_machine_file(machine)
    assert isinstance(written.machine, LinearAxis)
    expected = 1.0 if "machine.load_mass" in refused else pytest.approx(axis.leaf_mass, rel=0.3)  # as the file had it
    assert axis_model(written.machine, written.model).drive.load_mass == expected
