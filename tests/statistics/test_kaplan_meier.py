"""Quantiles of latencies with missed contacts, compared with R 4.2.2 with survival 3.5-3.

R: s <- survfit(Surv(time, event) ~ 1, conf.type = "log-log"); quantile(s, p); s$surv, s$lower, s$upper. If R returns NA
for a limit that is never crossed, the interval is open (infinite).
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.statistics.interval import Interval
from cdtool.statistics.kaplan_meier import latency_quantile, survival

INF = math.inf

# Remission of leukaemia in weeks under 6-mercaptopurine and placebo (Freireich and others 1963; table in Gehan 1965).
TREATED = np.array([6, 6, 6, 7, 10, 13, 16, 22, 23, 6, 9, 10, 11, 17, 19, 20, 25, 32, 32, 34, 35], dtype=float)
TREATED_CENSORED = np.arange(21) >= 9
PLACEBO = np.array([1, 1, 2, 2, 3, 4, 4, 5, 5, 8, 8, 8, 8, 11, 11, 12, 12, 15, 17, 22, 23], dtype=float)
# Ties of detections and misses; 1 - S is 0.2 and 0.3 on whole steps, up to rounding.
TIED = np.array([20, 20, 30, 30, 40, 40, 40, 60, 60, 80], dtype=float)
TIED_CENSORED = np.array([0, 0, 0, 1, 0, 0, 1, 0, 1, 0], dtype=bool)
# Half of them missed: S ends on exactly one half.
HALF = np.array([10, 20, 30, 40, 50, 60, *[1000] * 6], dtype=float)
TWO_MISSED = np.array([21, 24, 24, 27, 30, 33, 35, 41, 46, 58, 1000, 1000], dtype=float)

LATENCIES = st.lists(st.tuples(st.integers(0, 40).map(float), st.booleans()), min_size=1, max_size=40)


def none_missed(latency: np.ndarray) -> np.ndarray:
    return np.zeros(len(latency), dtype=bool)


def bounds(interval: Interval) -> tuple[float, float, float]:
    return interval.value, interval.low, interval.high


def columns(pairs: list[tuple[float, bool]]) -> tuple[np.ndarray, np.ndarray]:
    return np.array([time for time, _ in pairs]), np.array([missed for _, missed in pairs])


def test_the_curve_of_freireichs_patients_is_rs_with_its_log_log_band():
    curve = survival(TREATED, TREATED_CENSORED)
    expected = {
        6: (0.857142857142857, 0.619717955265984, 0.951551747646997),
        7: (0.806722689075630, 0.563146564622233, 0.922809019202880),
        10: (0.752941176470588, 0.503199510799957, 0.889361835169265),
        13: (0.690196078431372, 0.431610222486184, 0.849065963349451),
        16: (0.627450980392157, 0.367510855987502, 0.804912189471841),
        22: (0.537815126050420, 0.267778936767135, 0.746790717635394),
        23: (0.448179271708683, 0.188052005959232, 0.680142628495241),
        35: (0.448179271708683, 0.188052005959232, 0.680142628495241),
    }
    for time, (share, low, high) in expected.items():
        row = int(np.flatnonzero(curve.times == time)[0])
        assert (curve.share[row], curve.low[row], curve.high[row]) == pytest.approx((share, low, high), abs=1e-12)


@pytest.mark.parametrize(
    ("latency", "missed", "share", "level", "expected"),
    [
        (TREATED, TREATED_CENSORED, 0.25, 0.95, (13, 6, 22)),
        (TREATED, TREATED_CENSORED, 0.5, 0.95, (23, 13, INF)),
        (TREATED, TREATED_CENSORED, 0.75, 0.95, (INF, 23, INF)),
        (PLACEBO, none_missed(PLACEBO), 0.25, 0.95, (4, 1, 5)),
        (PLACEBO, none_missed(PLACEBO), 0.5, 0.95, (8, 4, 11)),
        (PLACEBO, none_missed(PLACEBO), 0.75, 0.95, (12, 8, 22)),
        (PLACEBO, none_missed(PLACEBO), 0.9, 0.95, (17, 12, INF)),
        (PLACEBO, none_missed(PLACEBO), 0.95, 0.95, (22, 15, INF)),
        (TIED, TIED_CENSORED, 0.2, 0.95, (25, 20, 40)),
        (TIED, TIED_CENSORED, 0.3, 0.95, (35, 20, 60)),
        (TIED, TIED_CENSORED, 0.5, 0.95, (40, 20, INF)),
        (HALF, HALF == 1000, 0.25, 0.95, (35, 10, 60)),
        (HALF, HALF == 1000, 0.5, 0.95, (530, 20, INF)),
        (HALF, HALF == 1000, 0.75, 0.95, (INF, 60, INF)),
        (TWO_MISSED, TWO_MISSED == 1000, 0.5, 0.95, (34, 24, 58)),
        (TWO_MISSED, TWO_MISSED == 1000, 0.5, 0.9, (34, 24, 46)),
        (TWO_MISSED, TWO_MISSED == 1000, 0.95, 0.95, (INF, 58, INF)),
    ],
)
def test_quantiles_and_their_limits_are_rs(latency, missed, share, level, expected):
    assert bounds(latency_quantile(latency, missed, share, level)) == pytest.approx(expected)


def test_where_r_has_no_lower_limit_since_all_are_detected_it_is_the_last_detection():
    # R: quantile 80, lower and upper NA, S being 0 from there on.
    assert bounds(latency_quantile(TIED, TIED_CENSORED, 0.95)) == (80, 80, INF)


def test_without_observation_nothing_is_known():
    quantile = latency_quantile([], [], 0.5)
    assert not quantile.known and math.isnan(quantile.low) and math.isnan(quantile.high)
    assert survival([], []).share.tolist() == [1.0]


def test_one_missed_contact_proves_nothing_and_six_prove_that_the_median_is_not_reached():
    # P(6 of 6 later than the median) = 1 / 64 < 0.025 < 1 / 32.
    assert bounds(latency_quantile([1000.0], [True], 0.5)) == (INF, 0.0, INF)
    assert bounds(latency_quantile([1000.0] * 5, [True] * 5, 0.5)) == (INF, 0.0, INF)
    assert bounds(latency_quantile([1000.0] * 6, [True] * 6, 0.5)) == (INF, INF, INF)


@pytest.mark.parametrize("last", [3, 6, 9])
def test_contacts_detected_at_the_same_last_time_leave_the_median_an_upper_limit(last):
    times = [8.0, *[9.0] * (10 - last), *[10.0] * last]
    assert latency_quantile(times, [False] * 11, 0.5).high == 10.0
    assert latency_quantile(times, [False] * 11, 0.95).high == math.inf  # 11 of 11 say little about the slowest 5 %


@pytest.mark.parametrize(("share", "first"), [(0.5, 7), (0.9, 46), (0.95, 98)])
def test_an_upper_limit_needs_as_many_detections_as_the_docs_say(share, first):
    few, enough = np.arange(1.0, first), np.arange(1.0, first + 1)
    assert latency_quantile(few, none_missed(few), share).high == INF
    assert latency_quantile(enough, none_missed(enough), share).high <= first


def test_the_band_of_a_step_plot_has_no_holes():
    curve = survival(PLACEBO, none_missed(PLACEBO))
    assert (curve.times[0], curve.share[0], curve.high[0]) == (0.0, 1.0, 1.0)
    # R: 1 - binom.test(0, 21)$conf.int[2], and the limits at S = 0.
    assert curve.low[0] == pytest.approx(0.83890238478092)
    assert (curve.share[-1], curve.low[-1], curve.high[-1]) == (0.0, 0.0, curve.high[-2])
    assert np.all((curve.low <= curve.share) & (curve.share <= curve.high))


@given(LATENCIES, st.integers(0, 39))
def test_a_detection_that_becomes_a_miss_makes_no_quantile_earlier(pairs, which):
    latency, missed = columns(pairs)
    window = np.where(missed, 50.0, latency)
    one_more, later = missed.copy(), window.copy()
    one_more[which % len(pairs)], later[which % len(pairs)] = True, 50.0
    for share in (0.25, 0.5, 0.9):
        assert latency_quantile(window, missed, share).value <= latency_quantile(later, one_more, share).value
