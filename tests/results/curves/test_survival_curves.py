"""One survival curve per detector and group: missed contacts stay undetected, unassessable ones do not count."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.results.curves.survival_curves import survival_curves
from cdtool.results.results import ContactResult, Results
from cdtool.statistics.kaplan_meier import latency_quantile


def row(detector: str, late: float | None, outcome: str = "detected", watched: float = 1000.0) -> ContactResult:
    return ContactResult("a", "stiff", detector, None, 1.0, 0.0, None, late, outcome, None, None, watched_ms=watched)


def of(*contacts: ContactResult) -> Results:
    return Results({}, ("direct", "momentum"), ("stiff", "holdout"), contacts, (), ())


def test_a_missed_contact_keeps_the_curve_above_zero_until_its_censoring():
    contacts = [row("direct", 10.0), row("direct", 20.0), row("direct", None, "missed", 300.0)]
    (curve,) = survival_curves(of(*contacts))
    assert curve.curve.share[-1] == pytest.approx(1 / 3)
    assert curve.missed.tolist() == [300.0]
    assert (curve.end, curve.detected) == (300.0, 2)


def test_the_median_of_the_summary_is_where_the_curve_passes_a_half():
    late = np.array([12.0, 31.0, 45.0, 46.0, 80.0])
    (curve,) = survival_curves(of(*(row("momentum", float(x)) for x in late)))
    at = curve.curve.times[np.flatnonzero(curve.curve.share <= 0.5)[0]]
    assert at == latency_quantile(late, np.zeros(5, bool), 0.5).value
