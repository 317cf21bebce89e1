"""Numbers as text."""

from __future__ import annotations

import math

import pytest

from cdtool.report.number_text import missed, number, percent, rate, with_interval
from cdtool.report.tables.forces import contacts_table
from cdtool.results.results import ForceResult, ForceStepResult, Results
from cdtool.statistics.interval import Interval

NAN, INF = math.nan, math.inf


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "–"),
        (NAN, "–"),
        (INF, "not reached"),
        (0.0, "0"),
        (0.02537, "0.0254"),
        (38.04, "38.0"),
        (12345.6, "12346"),
    ],
)
def test_a_number_has_three_digits_and_no_exponent(value, text):
    assert number(value) == text


@pytest.mark.parametrize(
    ("interval", "text"),
    [
        (Interval(38.0, 36.21, 41.46), "38.0 (36.2 to 41.5)"),
        (Interval(148.75, 133.7, 163.5), "149 (134 to 164)"),
        (Interval(33.5, 31.0, INF), "33.5 (31.0 to not reached)"),
        (Interval(INF, 70.0, INF), "not reached (70.0 to not reached)"),
        (Interval(INF, INF, INF), "not reached"),
        (Interval(34.0, NAN, NAN), "34.0"),
        (Interval(NAN, NAN, NAN), "–"),
        (Interval(0.0, 0.0, 0.31), "0.000 (0.000 to 0.310)"),
        (Interval(-5.1, -6.2, -3.9), "-5.10 (-6.20 to -3.90)"),
        (Interval(-9.9e-14, -4.2222222, 6.3333333), "0.00 (-4.22 to 6.33)"),
        (Interval(-9.9e-14, NAN, NAN), "0"),
        (Interval(1.5, -1e-14, 3.0), "1.50 (0.00 to 3.00)"),
        (Interval(300.0, -0.2, 600.0), "300 (0 to 600)"),
        (Interval(0.002, NAN, NAN), "0.00200"),
    ],
)
def test_an_interval_has_the_digits_of_its_value(interval, text):
    assert with_interval(interval) == text


def test_equal_latencies_are_no_finer_than_their_error():
    assert with_interval(Interval(40.0, 40.0, 40.0), 40.0) == "40 (40 to 40)"


@pytest.mark.parametrize(
    "value, error, text",
    [
        (27.5, 2.05, "28"),
        (26.499999999999996, 2.0, "27"),
        (25.000000000000355, 2.0, "25"),
        (2.44, 0.2, "2.4"),
        (27.5, 0.2, "27.5"),
        (0.031, 20.0, "0"),
        (27.5, 0.0, "27.5"),
        (-26.5, 2.0, "-27"),
    ],
)
def test_no_digit_is_finer_than_the_error(value, error, text):
    assert number(value, error=error) == text
    assert with_interval(Interval(value, NAN, NAN), error) == f"{text}"


def test_an_interval_is_no_finer_than_the_values_behind_it():
    assert with_interval(Interval(33.333, 32.93, 33.73), 2.05) == "33 (33 to 34)"
    assert with_interval(Interval(33.333, 32.93, 33.73), 0.2) == "33.3 (32.9 to 33.7)"


def test_no_missed_contact_is_a_bound_and_not_zero():
    assert "".join(missed(0, 30, 1 - 0.05 ** (1 / 30))) == "0 of 30: at most 9.5 %"
    assert missed(0, 0, NAN) == ("–",)
    assert percent(NAN) == "–"


def test_a_rate_without_an_alarm_is_only_its_bound():
    assert "".join(rate(0, Interval(0.0, 0.0, 37.0), 29.957)) == "0: at most 30.0"
    assert "".join(rate(1, Interval(10.0, 0.25, 55.7), 47.44)) == "10.0 (0.3 to 55.7): at most 47.4"
    assert "".join(rate(0, Interval(NAN, 0.0, INF), NAN)) == "–"


def test_a_force_above_its_limit_is_not_shown_as_equal():
    step = ForceStepResult("dynamic", 0.0, 400.0, 400.04, 49.0, "fail")
    force = ForceResult("a.csv", "stiff", 1, "gate", "fail", 400.04, (step,))
    results = Results({}, (), ("stiff",), (), (), (), (), forces=(force,))
    (cell,) = contacts_table(results).cells("steps")
    assert cell.text == "dynamic 400.04 of 400 N: fail"
