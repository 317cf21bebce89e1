"""The map of latency over position and stiffness: means, ranges, misses, and what a test would tell most."""

from __future__ import annotations

import base64
import hashlib
import html
import json
import math
import re
from typing import Any

import pytest

from cdtool.base.plain_text import plain
from cdtool.commands.inject.coverage.coverage_map import (
    CellKey,
    CoverageMap,
    MappedContact,
    SpeedClass,
    TellingReason,
    coverage_map,
    speed_classes,
)
from cdtool.commands.inject.coverage.page import coverage_html
from cdtool.results.limits import LimitRule
from cdtool.results.results import ContactResult
from tests.report.hostile import HOSTILE
from tests.report.html.coverage_case import coverage_case

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


def made(
    rows: list[ContactResult], cells: dict[str, tuple[CellKey, str]], limits: tuple[LimitRule, ...] = ()
) -> CoverageMap:
    contacts = {name: MappedContact(key, reaction, 1.2) for name, (key, reaction) in cells.items()}
    return coverage_map(rows, contacts, ["gm", "pt"], ("m", "m/s"), limits)


def test_a_cell_has_mean_standard_error_and_median_force() -> None:
    names = dict.fromkeys("abc", (NEAR, "known controller"))
    cell = made([row("a", 50.0), row("b", 60.0), row("c", 70.0)], names).cells["gm"][NEAR]
    assert cell.latency_ms == pytest.approx(60.0)
    assert cell.standard_error_ms == pytest.approx(10.0 / math.sqrt(3.0))
    assert cell.range_ms == (60.0, 60.0)
    assert cell.force_n == 600.0
    assert (cell.contacts, cell.missed, cell.unreliable) == (3, 0, 0)


def test_a_cell_misses_most_if_more_than_half_of_its_assessable_contacts_are_missed() -> None:
    names = dict.fromkeys("abcd", (NEAR, "known"))
    rows = [row("a", None, "missed"), row("b", None, "missed"), row("c", 50.0), row("d", None, "not_assessable")]
    cell = made(rows, names).cells["gm"][NEAR]
    assert cell.misses_most
    assert (cell.missed, cell.not_assessable) == (2, 1)
    only = made([row("a", None, "not_assessable")], names).cells["gm"][NEAR]
    assert not only.misses_most
    assert math.isnan(only.latency_ms)


@pytest.mark.parametrize(
    ("limit", "reason"),
    [(75.0, TellingReason.NEAR_LIMIT), (80.0, TellingReason.SCATTER), (40.0, TellingReason.SCATTER)],
)
def test_a_limit_within_two_errors_and_that_of_the_model_tells_much(limit: float, reason: TellingReason) -> None:
    names = dict.fromkeys("abc", (NEAR, "k"))
    rows = [row("a", 55.0), row("b", 60.0), row("c", 65.0)]  # 60 +- 5.8 ms, the model's error is 9 ms
    assert math.isclose(2.0 * 5.0 / math.sqrt(3.0), 5.77, abs_tol=0.01)
    rules = (LimitRule("gm.injected_x.p95_ms", "gm", "injected_x", "p95_ms", largest=limit - 0.5),)
    cell = made(rows, names, rules).cells["gm"][NEAR]
    assert cell.limit_ms == limit - 0.5
    assert cell.telling is reason


def test_speeds_that_differ_by_more_than_a_fifth_are_classes() -> None:
    assert speed_classes({"a": [0.2], "b": [0.24], "c": [-0.3, -0.32]}) == {"a": 0.22, "b": 0.22, "c": 0.31}


def test_cells_of_a_map_are_split_by_speed() -> None:
    slow, fast = CellKey(0.5, 1e4, 0.1), CellKey(0.5, 1e4, 0.3)
    speeds = {"a": (slow, 0.1), "b": (fast, -0.31), "c": (fast, 0.29)}
    contacts = {name: MappedContact(key, "k", 1.2, speed) for name, (key, speed) in speeds.items()}
    found = coverage_map([row("a", 90.0), row("b", 50.0), row("c", 52.0)], contacts, ["gm"], ("m", "m/s"))
    assert found.speeds == (SpeedClass(0.1, 0.1, 0.1), SpeedClass(0.3, 0.29, 0.31))
    assert found.cells["gm"][slow].latency_ms == 90.0
    assert found.cells["gm"][fast].latency_ms == 51.0


def test_brackets_further_apart_than_the_scatter_are_the_reason() -> None:
    names = {"a": (NEAR, "frozen"), "b": (NEAR, "frozen"), "c": (NEAR, "stiff"), "d": (NEAR, "stiff")}
    found = made([row("a", 50.0), row("b", 52.0), row("c", 90.0), row("d", 92.0)], names)
    assert [item.reason for item in found.most_telling()] == [TellingReason.ASSUMPTIONS]


def traces_of(text: str) -> list[dict[str, Any]]:
    return [json.loads(item) for item in re.findall(r'json" class="trace">(.*?)</script>', text, re.DOTALL)]


def test_the_list_of_tests_has_commands_that_exist() -> None:
    text = coverage_html(coverage_case())
    table = text[text.index('id="telling-table"') : text.index('id="contacts"')]
    lines = re.findall(r"<tr>(.*?)</tr>", table, re.DOTALL)
    rows = [re.findall(r"<t[dh][^>]*>(.*?)</t[dh]>", line) for line in lines[1:]]
    assert rows[0][:2] == ["slow", "0.500"] and rows[0][-1] == "cdtool plan --missed-at-most 5%"
    assert rows[-1][-1].startswith("cdtool plan --difference-ms ")
    from tests.command import cdtool as command

    for row in (rows[0], rows[-1]):
        assert command(*row[-1].split()[1:]).status == 0


@pytest.mark.parametrize("kind", HOSTILE)
def test_names_from_files_are_text(kind: str) -> None:
    case = coverage_case(lambda name: f"{HOSTILE[kind]}{name}")
    text = coverage_html(case)
    assert "<script>alert" not in text
    assert all(letter.isprintable() or letter == "\n" for letter in text)
    assert plain(f"{HOSTILE[kind]}lost.csv") in html.unescape(text)
    assert len(traces_of(text)) == len(case.traces)


def test_the_policy_allows_only_this_script_and_this_style() -> None:
    text = coverage_html(coverage_case())
    policy = html.unescape(re.search(r'Policy" content="(.*?)">', text)[1])  # type: ignore[index]
    scripts = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
    styles = re.findall(r"<style>(.*?)</style>", text, re.DOTALL)
    assert len(scripts) == len(styles) == 1
    for kind, content in (("script", scripts[0]), ("style", styles[0])):
        digest = base64.b64encode(hashlib.sha256(content.encode()).digest()).decode()
        assert f"{kind}-src 'sha256-{digest}'" in policy
    assert not re.search(r'\b(src|href)="(?!#)', text)
    assert 'style="' not in text
