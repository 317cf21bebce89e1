"""What is wrong with a log itself is reported alike by every command, once, as what it is."""

from __future__ import annotations

import pytest

from tests.cli.damaged_copies import damaged
from tests.command import cdtool


@pytest.mark.parametrize(("value", "what"), [("1e306", "none that a sensor gives"), ("inf", "infinite")])
def test_a_masked_value_is_counted_once_as_what_it_is(gate_folder, tmp_path, value, what):
    cells = {("i_motor", 700): value, ("i_motor", 701): "nan"}
    log = damaged(gate_folder / "stiff" / "01.csv", tmp_path / "damaged.csv", cells)
    done = cdtool("info", log, "-m", gate_folder / "machine.toml")
    assert f"torque: 1 value is {what}: masked" in done.out
    assert "torque: 1 of 7200 values is missing (NaN)" in done.out
    done = cdtool(
        "info", damaged(log, tmp_path / "one.csv", {("i_motor", 701): "0.5"}), "-m", gate_folder / "machine.toml"
    )
    assert f"torque: 1 value is {what}: masked" in done.out and "missing (NaN)" not in done.out
