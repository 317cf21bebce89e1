"""Latency against false alarms: rates with their exposure, the factor in use, and quantities not reached."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from cdtool.results.curves.amoc import amoc_curves
from cdtool.results.results import Results
from tests.results.sweeps import CONTACTS, FACTOR, swept


def alarms(multiple: float) -> int:
    return 8 if multiple < 0.5 else 0


def of(*rows, **provenance) -> Results:
    return Results(provenance, ("momentum", "direct"), ("stiff",), (), (), (), sweep=tuple(rows))


def test_rates_are_false_alarms_per_monitored_hour():
    (curve,) = amoc_curves(of(*swept("momentum", "stiff", lambda m: 60.0 * m, alarms, hours=2.0)))
    assert curve.per == "hour"
    assert curve.rate(curve.points[0]) == pytest.approx(4.0)
    assert curve.rate(curve.points[-1]) == 0.0
    assert curve.at_most == pytest.approx(-math.log(0.05) / 2.0)


def test_rates_are_per_operation_if_less_than_an_hour_was_recorded():
    (curve,) = amoc_curves(of(*swept("momentum", "stiff", lambda m: 60.0 * m, alarms, operations=20, hours=0.9)))
    assert (curve.per, curve.rate(curve.points[0])) == ("operation", pytest.approx(0.4))


def test_the_point_in_use_has_the_factor_that_is_set():
    (curve,) = amoc_curves(of(*swept("momentum", "stiff", lambda m: 60.0 * m, alarms)))
    assert curve.set_point.safety_factor == pytest.approx(FACTOR)
    assert curve.set_point.median == pytest.approx(60.0)


def test_an_unreached_median_is_infinite_and_one_without_contacts_is_missing():
    rows = swept("momentum", "stiff", lambda _: None, alarms, missed=lambda _: CONTACTS)
    assert {point.median for point in amoc_curves(of(*rows))[0].points} == {math.inf}
    blind = [replace(row, missed=0, not_assessable=CONTACTS) for row in rows]
    (curve,) = amoc_curves(of(*blind))
    assert all(math.isnan(point.median) for point in curve.points)
    assert curve.not_assessable == CONTACTS
