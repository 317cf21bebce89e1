"""The table of a benchmark on screen: median and range below ten contacts, else the mean with its interval."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import pytest

from cdtool.commands.console.summary_table import show_table
from cdtool.results.evaluated import evaluate
from cdtool.results.results import ContactResult, ExposureResult, Results


def shown(capsys: pytest.CaptureFixture[str], latencies: Mapping[str, Sequence[float | None]]) -> list[str]:
    base = ContactResult("", "stiff", "", "gate", 5.0, 0.001, 5.0, None, "missed", None, None, watched_ms=1000.0)
    rows = [
        replace(
            base, recording=f"{i}.csv", detector=name, latency_ms=late, outcome="missed" if late is None else "detected"
        )
        for name, values in latencies.items()
        for i, late in enumerate(values)
    ]
    exposure = tuple(ExposureResult("stiff", name, 4, 4, 0.5) for name in latencies)
    show_table(evaluate(Results({"onset": "x"}, tuple(latencies), ("stiff",), tuple(rows), (), exposure)))
    return [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]


def test_four_contacts_show_median_and_range_and_no_mean(capsys):
    lines = shown(capsys, {"momentum": [25.0, 27.0, 28.0, 28.5]})
    assert "stiff momentum 27.5 25 to 28.5 4 0 0 0 4" in lines
    assert not any("mean ms" in line or "P95 ms" in line for line in lines[:2])
    assert any(line.startswith("Fewer than 10 contacts detected: median and range") for line in lines)


def test_six_contacts_show_the_interval_of_the_median_that_holds(capsys):
    lines = shown(capsys, {"momentum": [25.0, 26.0, 27.0, 28.0, 29.0, 60.0]})
    assert "stiff momentum 27.5 (25 to 60) 25 to 60 6 0 0 0 4" in lines


def test_a_missed_contact_counts_as_later_than_the_range(capsys):
    lines = shown(capsys, {"momentum": [25.0, 27.0, 28.0, None], "direct": [None, None]})
    assert "stiff momentum 27.5 25 to not reached 3 1 0 0 4" in lines
    assert "stiff direct not reached not reached 0 2 0 0 4" in lines


def test_ten_contacts_show_the_mean_with_its_interval_next_to_a_small_group(capsys):
    lines = shown(capsys, {"momentum": [25.0 + i for i in range(10)], "direct": [25.0, 27.0]})
    many = next(line for line in lines if line.startswith("stiff momentum"))
    assert many.startswith("stiff momentum 29.5 (") and "25 to 34" in many
    assert "stiff direct - - 26 25 to 27 - 2 0 0 0 4" in lines
    alone = shown(capsys, {"momentum": [25.0 + i for i in range(10)]})
    assert not any("range" in line and "ms" in line for line in alone[:2])
    assert not any(line.startswith("Fewer than 10") for line in alone)


def test_contacts_that_are_not_assessable_have_their_reason_below_the_table(capsys):
    base = ContactResult("", "stiff", "momentum", "gate", 5.0, 0.001, 5.0, None, "detected", 25.0, None, watched_ms=1e3)
    blind = replace(base, outcome="not_assessable", latency_ms=None, reason="start-up 100 %")
    rows = [replace(base, recording="1.csv"), replace(blind, recording="2.csv"), replace(blind, recording="3.csv")]
    rows.append(replace(blind, recording="4.csv", reason="missing samples 60 %"))
    exposure = (ExposureResult("stiff", "momentum", 4, 4, 0.5),)
    show_table(evaluate(Results({"onset": "x"}, ("momentum",), ("stiff",), tuple(rows), (), exposure)))
    words = " ".join(capsys.readouterr().out.split())
    assert "momentum, stiff: 3 of 4 contacts not assessable: start-up 100 %; missing samples 60 %" in words
