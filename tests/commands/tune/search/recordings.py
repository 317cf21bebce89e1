"""Recordings to tune on without any log: their folds, groups and windows, and measurements of invented candidates."""

from __future__ import annotations

import numpy as np

from cdtool.commands.tune.search.candidate import Measured
from cdtool.commands.tune.search.recordings import FreeRun, StruckLog, TuningRecordings
from cdtool.recordings.motion import MotionClass
from cdtool.recordings.operations import Operation
from cdtool.recordings.recording import Contact, Recording, Series

MOTION = MotionClass(1, 0.2, 0)


def operation(name: str) -> Operation:
    speed = Series(np.array([0.0, 0.1]), np.array([[0.2], [0.2]]), "m/s")
    return Operation(Recording(name, name, ("axis",), {"speed": speed}, digest=name), MOTION, 1)


def tuning_recordings(contacts: int = 10, window: float = 1.0, *, is_nested: bool = True) -> TuningRecordings:
    """Return ten free runs and two groups of contacts in five folds."""
    free = tuple(FreeRun(operation(f"free{number}"), number % 5) for number in range(10))
    struck = tuple(
        StruckLog((operation(f"{group}{i}"),), ((Contact(1.0, 1.2, 0.0),),), ((None,),), group, window, i % 5)
        for group in ("stiff", "soft")
        for i in range(contacts)
    )
    return TuningRecordings(free, struck, 5, is_nested)


def measured(recordings: TuningRecordings, latency: np.ndarray) -> Measured:
    """Return what a candidate gives with these latencies (c,) [s], the same for one debounce and every subset."""
    subsets, count = recordings.subsets, len(recordings.fold_of)
    every = np.broadcast_to(latency, (1, subsets, count)).copy()
    force = 1000.0 * every
    return Measured(np.ones((1, subsets)), every, force, np.ones(count, bool), np.zeros((1, subsets), dtype=np.int64))
