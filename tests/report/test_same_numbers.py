"""The same number everywhere: each contact of the sample in every report, on the terminal, in figures and notebooks."""

from __future__ import annotations

import json
import math
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

import cdtool
from tests.command import cdtool as run
from tests.report.html.test_html import parsed

GATE = Path(__file__).parents[2] / "sample_logs/gate"


def whole(value: float) -> str:
    """The nearest integer; what arithmetic left below a tie is one."""
    return str(math.floor(value + 0.5 + 1e-9))


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> tuple[Path, str]:
    """A folder with all reports and protocol.html, and what the terminal shows."""
    folder = tmp_path_factory.mktemp("all")
    protocol = folder / "protocol.html"
    done = run(
        "benchmark", GATE / "benchmark.toml", "-p", GATE / "protocol.toml", "-o", folder / "all/", "-o", protocol
    )
    assert done.status == 1, done.err
    return folder / "all", done.out


@pytest.fixture(scope="module")
def contacts(written) -> dict[tuple[str, str], tuple[str, str]]:
    """The latency [ms] and peak force [N] of each recording and detector; the logs have 1 kHz and one contact each."""
    rows = json.loads((written[0] / "results.json").read_text(encoding="utf-8"))["contacts"]
    assert len(rows) == 40 and all(1.0 < row["resolution_ms"] < 10.0 for row in rows)
    return {(row["recording"], row["detector"]): (whole(row["latency_ms"]), whole(row["peak_force_n"])) for row in rows}


@pytest.fixture(scope="module")
def medians(written) -> dict[tuple[str, str], str]:
    rows = cdtool.read_results(written[0] / "results.json").summary()["median_ms"].dropna()
    assert len(rows) == 10
    return {key: whole(value) for key, value in rows.items()}


def texts(figure) -> Iterator[str]:
    for axes in figure.axes:
        yield from (text.get_text() for text in axes.texts)
    yield from (text.get_text() for text in figure.texts)


def test_each_contact_has_the_same_latency_and_peak_in_every_report(written, contacts):
    page = parsed((written[0] / "report.html").read_text(encoding="utf-8"))
    heading, *rows = page.tables["recordings-table"]
    shown = {
        (row[0], name.removesuffix(" [ms]")): (cell, row[heading.index("peak [N]")])
        for row in rows
        for name, cell in zip(heading, row, strict=True)
        if name.endswith("[ms]") and row[1] != "hold-out"
    }
    assert shown == contacts
    cases = ElementTree.parse(written[0] / "junit.xml").iter("testcase")
    words = {(case.get("name"), case.get("classname")): case.findtext("system-out") or "" for case in cases}
    found = {}
    for (name, suite), text in words.items():
        if match := re.search(r"detected after (\S+) ms at \S+ N, peak (\S+) N", text):
            found[name, suite.split(".")[-2]] = match.groups()
    assert found == contacts


def test_the_protocol_shows_the_same_latencies(written, contacts):
    text = re.sub(r"(<[^>]*>|\s)+", "|", (written[0].parent / "protocol.html").read_text(encoding="utf-8"))
    logs = {"closing|edge": "stiff", "closing|edge|with|bumper": "soft"}
    order = ("03.csv", "04.csv", "01.mcap", "02.mcap")
    detectors = list(dict.fromkeys(detector for _, detector in contacts))
    for point, group in logs.items():
        for number, name in enumerate(order, 1):
            row = "|".join(contacts[f"{group}/{name}", detector][0] for detector in detectors)
            assert f"|{point}|{number}|{row}|" in text


def test_the_terminal_shows_the_same_latencies(contacts):
    logs = [GATE / group / name for group in ("stiff", "soft") for name in ("03.csv", "04.csv", "01.mcap", "02.mcap")]
    for detector in dict.fromkeys(detector for _, detector in contacts):
        done = run("detect", *logs, "-b", GATE / "benchmark.toml", "-d", detector)
        rows = [line.split() for line in done.out.splitlines() if " alarm " in line]
        shown = {(row[0], row[6]) for row in rows if row[6] != "-"}
        assert shown == {(log, late) for (log, name), (late, _) in contacts.items() if name == detector}


def test_the_figures_show_the_same_latencies(written, contacts):
    result = cdtool.read_results(written[0] / "results.json")
    for log in dict.fromkeys(log for log, _ in contacts):
        shown = {text for text in texts(result.plot.triggers(log)) if re.fullmatch(r"\S+ ms", text)}
        assert shown == {f"{late} ms" for (name, _), (late, _) in contacts.items() if name == log}


def test_each_median_is_the_same_on_every_surface(written, medians):
    folder, terminal = written
    result = cdtool.read_results(folder / "results.json")
    surfaces = {
        "terminal": re.sub(r"[ \t]+", "|", terminal),
        "Markdown": re.sub(
            r"[ \t|*]+", "|", (folder / "report.md").read_text(encoding="utf-8").partition("## Results")[2]
        ),
        "notebook": re.sub(r"(<[^>]*>|\s)+", "|", result._repr_html_()),
    }
    for name, text in surfaces.items():
        for (_, detector), median in medians.items():  # first all of stiff, then all of soft
            _, found, text = text.partition(f"|{detector}|{median}|")
            assert found, (name, detector, median)
    drawn = list(texts(result.plot.latency()))
    assert [value for value, after in pairwise(drawn) if after == "4 of 4"] == list(medians.values())
