"""The map of latency over position and stiffness: means, ranges, misses, and what a test would tell most."""

from __future__ import annotations

import math

import pytest

from cdtool.evaluation.coverage_map import CellKey, CoverageMap, MappedContact, coverage_map
from cdtool.evaluation.results import ContactResult

NEAR, FAR = CellKey(0.5, 1e4), CellKey(1.0, 1e4)


def row(recording: str, latency: float | None, outcome: str = "detected", detector: str = "gm") -> ContactResult:
    return ContactResult(
        recording=recording,
        group="injected_x",
        detector=detector,
        joint="axis",
        onset_s=1.0,
        onset_uncertainty_s=0.0,
        alarm_s=None if latency is None else 1.0 + 1e-3 * latency,
        latency_ms=latency,
        outcome=outcome,
        force_at_alarm_n=None if latency is None else 10.0 * latency,
        peak_force_n=1000.0,
    )


def made(rows: list[ContactResult], cells: dict[str, tuple[CellKey, str]]) -> CoverageMap:
    contacts = {name: MappedContact(key, reaction, 1.2) for name, (key, reaction) in cells.items()}
    return coverage_map(rows, contacts, ["gm", "pt"], "m")


def test_a_cell_has_mean_standard_error_and_median_force() -> None:
    names = dict.fromkeys("abc", (NEAR, "known controller"))
    cell = made([row("a", 50.0), row("b", 60.0), row("c", 70.0)], names).cells["gm"][NEAR]
    assert cell.latency_ms == pytest.approx(60.0)
    assert cell.standard_error_ms == pytest.approx(10.0 / math.sqrt(3.0))
    assert cell.range_ms == (60.0, 60.0)
    assert cell.force_n == 600.0
    assert (cell.contacts, cell.missed, cell.unreliable) == (3, 0, 0)


def test_brackets_are_a_range_and_their_difference_is_no_scatter() -> None:
    names = {"a": (NEAR, "frozen"), "b": (NEAR, "frozen"), "c": (NEAR, "stiff"), "d": (NEAR, "stiff")}
    cell = made([row("a", 50.0), row("b", 52.0), row("c", 90.0), row("d", 92.0)], names).cells["gm"][NEAR]
    assert cell.range_ms == (51.0, 91.0)
    assert cell.standard_error_ms == pytest.approx(math.sqrt(2.0) / 2.0)
    assert cell.uncertainty_ms == pytest.approx(20.0 + math.sqrt(2.0))


def test_a_cell_misses_most_if_more_than_half_of_its_assessable_contacts_are_missed() -> None:
    names = dict.fromkeys("abcd", (NEAR, "known"))
    rows = [row("a", None, "missed"), row("b", None, "missed"), row("c", 50.0), row("d", None, "not_assessable")]
    cell = made(rows, names).cells["gm"][NEAR]
    assert cell.misses_most
    assert (cell.missed, cell.not_assessable) == (2, 1)
    only = made([row("a", None, "not_assessable")], names).cells["gm"][NEAR]
    assert not only.misses_most
    assert math.isnan(only.latency_ms)


def test_late_alarms_are_counted_as_unreliable() -> None:
    cell = made([row("a", 150.0), row("b", 250.0)], {"a": (NEAR, "k"), "b": (NEAR, "k")}).cells["gm"][NEAR]
    assert cell.unreliable == 1


def test_partly_missed_cells_tell_most_then_the_least_certain() -> None:
    names = {"a": (NEAR, "k"), "b": (NEAR, "k"), "c": (FAR, "k"), "d": (FAR, "k")}
    rows = [row("a", 50.0), row("b", None, "missed"), row("c", 50.0), row("d", 150.0)]
    rows += [row(name, value, detector="pt") for name, value in zip("abcd", (50.0, 51.0, 60.0, 64.0), strict=True)]
    telling = made(rows, names).most_telling(3)
    assert [(name, key) for name, key, _ in telling] == [("gm", NEAR), ("gm", FAR), ("pt", FAR)]


def test_a_detector_without_rows_has_no_panel_and_other_recordings_do_not_count() -> None:
    found = made([row("a", 50.0), row("real", 20.0)], {"a": (NEAR, "k")})
    assert list(found.cells) == ["gm"]
    assert found.cells["gm"][NEAR].contacts == 1
    assert (found.positions, found.stiffnesses) == ((0.5,), (1e4,))
