"""benchmarks/same_report.py: words may change between two report folders, numbers may not."""

from __future__ import annotations

import sys
from types import ModuleType

import pytest

from tests.project.pages import benchmark_script

OLD = {
    "report.html": (
        "<table><tr><th>largest figure</th></tr><tr><td>quick</td><td>33.5 <small>(–)</small></td></tr>"
        "<tr><td>slow</td><td>60.0</td></tr></table>"
        '<script type="application/json">{"latency": [33.5, null], "tables": [{"rows": 9}]}</script>'
    ),
    "report.md": "# all 2 limits are met\n\n| detector | median |\n| --- | ---: |\n| quick | 33.5 (–) |\n",
    "junit.xml": '<testsuites tests="2"><testcase name="a"><system-out>p95 is 90</system-out></testcase></testsuites>',
    "contacts.csv": "recording,latency_ms\na.csv,33.5\n",
}


@pytest.fixture(scope="module")
def script() -> ModuleType:
    return benchmark_script("same_report")


@pytest.fixture
def status(script, tmp_path, monkeypatch, capsys):
    """Return the exit status and output for the old folder and one in which a text of a file is replaced."""

    def compared(name: str, old: str, new: str) -> tuple[int, str]:
        for folder, text in (("old", None), ("new", new)):
            (tmp_path / folder).mkdir(exist_ok=True)
            for file, content in OLD.items():
                assert file != name or old in content
                changed = content.replace(old, text) if text is not None and file == name else content
                (tmp_path / folder / file).write_text(changed, encoding="utf-8")
        monkeypatch.setattr(sys, "argv", ["same_report.py", str(tmp_path / "old"), str(tmp_path / "new")])
        return script.main(), capsys.readouterr().out

    return compared


@pytest.mark.parametrize(
    ("name", "old", "new", "shown"),
    [
        ("report.html", "figure", "value", "1 x figure -> value"),
        ("report.md", "limits are met", "limits hold", "1 x are met -> hold"),
        ("junit.xml", "is 90", "is 90, of 120", "1 added"),
        ("report.md", "33.5 (–)", "33.5 (–) of 4", "1 added"),
        ("report.html", '"rows": 9', '"rows": 10', "the same words"),
    ],
)
def test_words_that_are_replaced_and_numbers_that_are_added_are_printed(status, name, old, new, shown):
    code, out = status(name, old, new)
    assert code == 0 and shown in out and "GONE" not in out


@pytest.mark.parametrize(
    ("name", "old", "new", "gone"),
    [
        ("report.html", "60.0", "61.0", "slow 60.0"),
        ("report.html", "(–)", "", "quick 33.5 –"),
        ("report.html", "[33.5,", "[33.6,", "plots.latency.0 33.5"),
        ("report.md", "all 2", "both", "# all 2 limits are met"),
        ("junit.xml", "is 90", "is high", "p95 is 90"),
        ("contacts.csv", "33.5", "33.50", "its content"),
    ],
)
def test_a_number_that_is_gone_is_named_and_exits_with_1(status, name, old, new, gone):
    code, out = status(name, old, new)
    assert code == 1 and f"GONE {gone}" in out


def test_a_row_is_not_the_match_of_two_rows(script):
    assert script.compare([["a", "1"], ["b", "1"]], [["a", "1"]]).gone == ["b 1"]
