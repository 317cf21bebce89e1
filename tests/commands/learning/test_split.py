"""Runs of one day or machine never assess one another if [learn] split says so."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.base.errors import UsageError
from cdtool.commands.judging.log_groups import Split, split_names
from cdtool.commands.learning.calibration import folds_of
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.operations import Operation
from cdtool.recordings.recording import Recording, Series

MOTION = MotionClass(1, 0.2, 0)


def run(source: str, began: float = 0.0) -> Operation:
    speed = Series(np.array([0.0, 0.1]), np.array([[0.2], [0.2]]), "m/s")
    recording = Recording(source.rsplit("/", 1)[-1], source, ("axis",), {"speed": speed}, origin=began)
    return Operation(recording, MOTION, 1)


def pairs(operations):
    return [(operation, None) for operation in operations]


def test_runs_of_one_day_are_in_one_fold():
    runs = [run(f"door/2026-11-{day:02d}/run{number}.csv") for number in range(4) for day in (3, 4, 5)]
    folds = folds_of(pairs(runs), Split.DAY, 10)
    assert folds == [0, 1, 2] * 4


def test_the_day_of_the_clock_is_used_where_the_path_has_no_date():
    runs = [
        run("a.csv", began=86400.0 * 20000 + 5.0),
        run("b.csv", began=86400.0 * 20001),
        run("c.csv", began=86400.0 * 20001 + 60.0),
    ]
    assert split_names(Split.DAY, runs) == ["2024-10-04", "2024-10-05", "2024-10-05"]


def test_machines_are_distinguished_by_their_folders():
    runs = [run("fleet/door1/1.csv"), run("fleet/door2/1.csv"), run("fleet/door1/2.csv")]
    assert split_names(Split.MACHINE, runs) == ["door1", "door2", "door1"]


def test_recordings_are_dealt_to_the_folds_in_turn():
    assert folds_of(pairs([run(f"{number}.csv") for number in range(7)]), Split.RECORDING, 5) == [0, 1, 2, 3, 4, 0, 1]


@pytest.mark.parametrize(
    ("split", "names", "words"),
    [
        (Split.DAY, ["2026-11-03/a.csv", "2026-11-03/b.csv"], "all impact-free logs are of one day"),
        (Split.MACHINE, ["door/a.csv", "door/b.csv"], "all impact-free logs are of one machine"),
        (Split.DAY, ["2026-11-03/a.csv", "b.csv"], "neither the path nor the clock of b.csv contains a date"),
    ],
)
def test_a_split_that_is_not_possible_is_refused(split, names, words):
    with pytest.raises(UsageError, match=words):
        split_names(split, [run(name) for name in names])
