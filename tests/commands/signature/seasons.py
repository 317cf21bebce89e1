"""Made-up runs shared by the tests of upkeep: white noise about a mean on clean strokes, with changes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from cdtool.alarms.activation import Activation
from cdtool.detectors.detection import Signal
from cdtool.recordings.motion import motion_class
from cdtool.recordings.operations import Operation
from cdtool.thresholds.fitted_signature import FittedSignature
from cdtool.thresholds.signature import Signature
from tests.thresholds.strokes import N, signal, stroke

ACTIVATION = Activation(9)
Change = Callable[[int, np.ndarray], np.ndarray]


def season(count: int, change: Change | None = None, seed: int = 0, direction: int = 1, together: float = 0.3):
    """`count` operations with their signals: noise of 1 N about 100 N, `together` N of it shared by a whole run.

    `change(number, travel)` in N is added, number from 0.
    """
    rng = np.random.default_rng(seed)
    recording = stroke(direction)
    travel = np.abs(recording["position"].values[:, 0])
    pairs = []
    for number in range(count):
        values = 100.0 + rng.normal(size=N) + together * rng.normal()
        if change is not None:
            values = values + change(number, travel)
        named = replace(recording, name=f"run{number}")
        pairs.append((Operation(named, motion_class(named)), signal(values)))
    return pairs


def learned(pairs: list[tuple[Operation, Signal]], **settings: object) -> FittedSignature:
    """Return a signature of these runs; one-sided unless `sides` is given."""
    rule = Signature(**{"sides": "one", **settings})
    return rule.fit([(item.recording, found) for item, found in pairs])
