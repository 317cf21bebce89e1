"""`cdtool init` on logs with impossible values, few rows, odd names, and units that contradict each other."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from cdtool.commands.init.drafting import init
from tests.commands.init.drafts import drafted_columns, stroke


@pytest.mark.parametrize("value", [np.inf, -np.inf, np.nan, 1e300])
def test_impossible_values_neither_warn_nor_disturb_the_guess(tmp_path, value):
    run = stroke(5e-3)
    broken = np.where((run.time > 1.0) & (run.time < 1.2), value, run.travel)
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        columns = {"t [s]": run.time, "pos [m]": broken, "vel [m/s]": run.speed}
        (tmp_path / "log.csv").write_text(
            ",".join(columns)
            + "\n"
            + "\n".join(",".join(map(repr, row)) for row in zip(*(c.tolist() for c in columns.values()), strict=True))
        )
        drafted = init(tmp_path / "log.csv", tmp_path / "machine.toml")
    assert {"position", "speed"} <= set(drafted.channels)


@pytest.mark.parametrize("rows", [2, 3, 5])
def test_few_rows_are_drafted_or_listed(tmp_path, rows):
    log = tmp_path / "log.csv"
    log.write_text("t,pos,vel\n" + "".join(f"{k},{k * k},{2 * k}\n" for k in range(rows)))
    drafted = init(log, tmp_path / "machine.toml")
    assert len(drafted.channels) + len(drafted.unmapped) >= 2


def test_joints_have_the_names_in_the_columns(tmp_path):
    run = stroke()
    columns = {"t [s]": run.time}
    for k, name in enumerate(("pan", "tilt", "roll_axis")):
        columns |= {f"{name}/position": (k + 1.0) * run.travel, f"{name}/velocity": (k + 1.0) * run.speed}
    draft = drafted_columns(tmp_path, columns)
    assert draft.machine["joints"] == ["pan", "tilt", "roll_axis"]
    assert draft.channels["position"]["columns"] == [f"{name}/position" for name in draft.machine["joints"]]


def test_a_log_of_which_the_machine_accepts_no_channel_is_drafted_as_comments(tmp_path, monkeypatch):
    """The units of a channel contradict the kind of machine; the draft is written nevertheless."""
    from cdtool.base.errors import ConfigurationError
    from cdtool.commands.init import drafting

    def refuse(log, machine):
        fault = ConfigurationError("no", "no")
        fault.channel = next(iter(machine.columns.sources)).channel
        raise fault

    monkeypatch.setattr(drafting, "info", refuse)
    run = stroke()
    log = tmp_path / "log.csv"
    np.savetxt(log, np.column_stack((run.time, run.travel)), delimiter=",", header="t [s],pos [m]", comments="")
    drafted = init(log, tmp_path / "machine.toml")
    assert drafted.channels == () and drafted.left_out == ("position",)
    assert '# position = { column = "pos [m]"' in drafted.text
