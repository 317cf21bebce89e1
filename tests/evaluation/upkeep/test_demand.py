"""What a run demands at each place: the largest of all places is its critical factor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.detection import Status
from cdtool.evaluation.sweep import critical_factor
from cdtool.evaluation.upkeep.demand import Places, demand_of
from cdtool.pipeline import judge
from tests.evaluation.upkeep.seasons import ACTIVATION, learned, season

FREE = season(20, seed=100)


def bump(_: int, travel: np.ndarray) -> np.ndarray:
    return 4.0 * (np.abs(travel - 0.41) < 0.03)


def found(signature, change=None, seed: int = 5, lost: slice | None = None):
    ((operation, signal),) = season(1, change, seed)
    if lost is not None:
        status = signal.status.copy()
        status[lost] = Status.GAP
        signal = replace(signal, status=status)
    detection = judge(operation, "", signal, (signature,), ACTIVATION)
    return demand_of(signature, detection, ACTIVATION), critical_factor(detection, ACTIVATION)


@pytest.mark.parametrize("settings", [{}, {"alignment": "time"}, {"alignment": "position"}, {"adaptive_level": 6.0}])
def test_the_largest_demand_is_the_critical_factor(settings):
    signature = learned(FREE, **settings)
    for seed in (5, 6):
        demand, critical = found(signature, bump, seed)
        assert demand.critical_factor == critical
        assert demand.held.shape == (1, len(Places.of(signature).at), 1)


def test_a_gap_is_no_reset_of_the_debounce():
    signature = learned(FREE)
    demand, critical = found(signature, bump, lost=slice(2000, 2003))
    assert demand.critical_factor == critical


def test_the_place_of_a_bump_demands_most():
    signature = learned(FREE)
    demand, _ = found(signature, bump)
    places = Places.of(signature)
    for place in (int(np.argmax(demand.held[0, :, 0])), int(np.nanargmax(demand.mean[:, 0]))):
        assert places.axis(place) == "travel" and places.at[place] == pytest.approx(0.41, abs=0.04)


def test_places_are_by_time_while_the_axis_accelerates():
    signature = learned(FREE)
    demand, _ = found(signature)
    places = Places.of(signature)
    reached = np.isfinite(demand.held[0, :, 0])
    assert reached[0] and places.axis(0) == "time" and places.axis(len(places.at) - 1) == "travel"
    # The axis runs before it has come far: the first places along travel are not used, nor the later ones by time.
    assert not reached[places.by_time] and not reached[places.by_time - 1]
    assert Places.of(learned(FREE, alignment="position")).by_time == 0
    by_time = Places.of(learned(FREE, alignment="time"))
    assert by_time.by_time == len(by_time.at)


def test_a_shift_is_added_above_and_subtracted_below():
    signature = learned(FREE, sides="two")
    spread = float(np.nanmedian(signature.by_position.band(True)[1]))
    still, critical = found(signature)
    moved, _ = found(signature, lambda _, travel: np.full(len(travel), 2.0))
    # What changes the side within the debounce lasts on neither.
    assert still.sides == (1, -1) and 0.5 * critical < still.critical_factor <= critical
    reached = np.isfinite(still.held[0, :, 0]) & np.isfinite(moved.held[0, :, 0])
    above, below = np.median(moved.held[:, reached] - still.held[:, reached], axis=(1, 2))
    assert above == pytest.approx(2.0 / spread, rel=0.05) and below == pytest.approx(-2.0 / spread, rel=0.05)


def test_the_shift_is_from_what_was_learned_also_where_the_band_follows():
    def up(_: int, travel: np.ndarray) -> np.ndarray:
        return np.full(len(travel), 3.0)

    still, follows = learned(FREE), learned(FREE, adaptive_level=6.0)
    spread = float(np.nanmedian(still.by_position.band(True)[1]))
    one, other = found(still, up)[0], found(follows, up)[0]
    assert one.shift[0] == other.shift[0] == pytest.approx(3.0 / spread, rel=0.15)
    assert np.nanmedian(one.mean) == pytest.approx(one.shift[0], rel=0.05)
    assert abs(np.nanmedian(other.mean)) < 0.3 * one.shift[0]


def test_a_run_that_is_nowhere_assessable_demands_nothing():
    demand, critical = found(learned(FREE), lost=slice(None))
    assert demand.critical_factor == critical == -np.inf and np.isnan(demand.mean).all()
