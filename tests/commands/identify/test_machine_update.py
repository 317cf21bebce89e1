"""The text of an updated machine file, however its tables are laid out."""

from __future__ import annotations

import math
import tomllib

import pytest

from cdtool.commands.identify.estimate import Method
from cdtool.commands.identify.machine_update import MachineChange, updated_text

CHANGES = [
    MachineChange("machine", "load_mass", (620.0,), (657.9,), (33.0,), "kg", Method.OUTPUT_ERROR),
    MachineChange("model.drive", "stiffness", (None,), (8.1e4,), (math.nan,), "N/m", Method.OUTPUT_ERROR),
]
LAYOUTS = {
    "tables": '[machine]\nname = "gate"\nload_mass = 620 # kg\n[model.drive]\nfront_stiffness = 1e6\n'
    "[channels]\nx = 1\n",
    "inline": 'machine = { name = "gate", load_mass = 620 }\nmodel = { drive = { front_stiffness = 1e6 } }\n'
    "channels = { x = 1 }\n",
    "inline within": '[machine]\nname = "gate"\nload_mass = 620\n[model]\ndrive = { front_stiffness = 1e6 }\n'
    "[channels]\nx = 1\n",
    "dotted": 'machine.name = "gate"\nmachine.load_mass = 620\nmodel.drive.front_stiffness = 1e6\nchannels.x = 1\n',
    "without a model": '[machine]\nname = "gate"\nload_mass = 620\n[channels]\nx = 1',
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_only_the_changed_keys_of_a_machine_file_change(layout: str) -> None:
    before = tomllib.loads(LAYOUTS[layout])
    after = tomllib.loads(updated_text(LAYOUTS[layout], CHANGES, "3 runs"))
    assert after["machine"].pop("load_mass") == 657.9
    assert after["model"]["drive"].pop("stiffness") == 8.1e4
    del before["machine"]["load_mass"]
    if layout == "without a model":
        before["model"] = {"drive": {}}
    assert after == before


def test_a_line_that_ends_without_a_line_break_keeps_its_comment() -> None:
    text = updated_text("[machine]\nload_mass = 620 # from the drawing", CHANGES, "3 runs")
    assert "was 620 (from the drawing)" in text
    assert tomllib.loads(text)["machine"]["load_mass"] == 657.9
