"""docs/robustness.md: made by its script from robustness.csv, whose cells are what the script computes."""

from __future__ import annotations

from typing import Any

import pytest

from cdtool.commands.simulate.changed_machine import ChangedMachine
from cdtool.detectors import DETECTORS
from cdtool.thresholds import THRESHOLDS
from tests.project.pages import DOCS, docs_script

script = docs_script("make_robustness")


def cell(alarming: int = 0, stiff: float = 20.0, **more: Any):
    """Return a cell of 40 runs and 20 contacts."""
    counts = {"assessable": 40, "runs": 40, "contacts": 20, "seeds": 2, **more}
    detected = 10 - more.get("missed", 0)
    return script.Cell(
        alarming,
        **counts,
        detected={"stiff": detected, "soft": 10},
        latency_sum={"stiff": detected * stiff, "soft": 800.0},
    )


FINE = dict.fromkeys(script.STATES, cell())


def test_the_page_is_that_of_its_results():
    machines = script.read_results(DOCS / script.RESULTS)
    made = script.page_text(machines)
    assert (DOCS / script.PAGE).read_text(encoding="utf-8") == made, "run python docs/make_robustness.py --page"
    assert set(machines) == set(script.SIMULATORS)
    for cells in (simulated.cells for simulated in machines.values()):
        assert set(cells) <= set(DETECTORS.names())
        for rules in cells.values():
            assert set(rules) <= {*script.OPTIONS, *THRESHOLDS.names()}
            assert all(set(states) == set(script.STATES) for states in rules.values())


def test_one_cell_is_computed():
    changes = {"friction +20 %": ChangedMachine(friction=1.2)}
    cells = script.simulated_cells("gate", 1, (1, 1), changes=changes, detectors=["momentum"], thresholds=["signature"])
    assert list(cells) == ["momentum"] and list(cells["momentum"]) == ["signature"]
    learned, changed = cells["momentum"]["signature"].values()
    assert (learned.alarming, changed.alarming) == (0, 1)
    assert all(item.runs == item.assessable == 1 and item.contacts == 2 for item in (learned, changed))
    assert 40.0 < learned.mean("stiff") < 80.0 < learned.mean("soft") < 200.0


@pytest.mark.parametrize(
    ("changed", "tolerated"),
    [
        (cell(2), True),
        (cell(3), False),
        (cell(missed=1), False),
        (cell(assessable=36), True),
        (cell(assessable=35), False),
        (cell(not_assessable=3), False),
        (cell(unassessed=0.2), True),
        (cell(unassessed=0.22), False),
    ],
)
def test_what_is_tolerated(changed, tolerated):
    assert script.tolerates({**FINE, "mass +10 %": changed}, "mass +10 %") is tolerated
