"""The protocol as a page: its text in both languages, and that it is one harmless file."""

from __future__ import annotations

import html
import re
from dataclasses import replace
from pathlib import Path

import pytest

from cdtool.commands.protocol.assessment.assessment import Repetition, assess_point, judge
from cdtool.commands.protocol.assessment.plan import MachineParticulars
from cdtool.commands.protocol.assessment.protocol import Protocol
from cdtool.commands.protocol.document.document import protocol_document
from cdtool.commands.protocol.document.html import to_html
from cdtool.commands.protocol.document.words import words_of
from cdtool.truth.force.limits import ForceProfile, ForceStep
from tests.report.hostile import HOSTILE
from tests.report.table_headings import unnamed

GOLDEN = Path(__file__).with_name("golden")


def text_of(page: str) -> str:
    """Return the text of a page, a line for each part, with hashes and the version as words."""
    body = page[page.index("<body>") :].replace("<wbr>", "")
    body = re.sub(r'<img [^>]*alt="([^"]*)">', r"\1", body)
    lines = [html.unescape(re.sub("<[^>]*>", "|", line)).strip("| ") for line in body.splitlines()]
    text = "\n".join(line for line in lines if line) + "\n"
    return re.sub(r"cdtool \d[\w.+]*", "cdtool VERSION", re.sub(r"\b[0-9a-f]{64}\b", "HASH", text))


@pytest.mark.parametrize("name", ["pass", "fail", "incomplete", "pressure_en", "pressure_de"])
def test_the_text_of_a_protocol_is_as_approved(name, documents):
    """To approve a new text, read it and write it to the file that the message names."""
    path = GOLDEN / f"{name}.txt"
    assert text_of(to_html(documents[name])) == path.read_text(encoding="utf-8"), path


def test_it_loads_nothing_runs_nothing_and_shows_hostile_names_as_text(protocols):
    hostile = "".join(HOSTILE.values())
    plan = replace(protocols["pass"].plan, machine=MachineParticulars(*[f"<script>alert(1)</script>{hostile}"] * 5))
    page = to_html(protocol_document(replace(protocols["pass"], plan=plan)))
    assert "<script" not in page and "&lt;script" in page.replace("<wbr>", "")
    assert not re.search(r'(src|href)="(?!data:)', page)
    assert "default-src 'none'; style-src 'sha256-" in html.unescape(page)


def with_profile(protocol: Protocol, profile: ForceProfile) -> Protocol:
    """Return a protocol of the same recordings, assessed by another profile."""
    (point,) = protocol.points
    repetitions = [
        Repetition.of((item.recording, item.sha256), item.contact, item.curve, profile) for item in point.repetitions
    ]
    points = (assess_point(point.point, profile, repetitions),)
    return replace(protocol, points=points, verdict=judge(protocol.plan, points, "protocol.toml"))


def test_a_mean_just_above_its_limit_is_above_it_in_table_and_reason(protocols):
    point = protocols["pass"].points[0]
    mean = point.verdict.steps[0].force
    profile = replace(
        point.profile, steps=(ForceStep(0.0, round(mean, 4) - 0.0003, "dynamic"), *point.profile.steps[1:])
    )
    page = text_of(to_html(protocol_document(with_profile(protocols["pass"], profile))))
    limit = words_of("en").limit(profile.steps[0].at_most_n)
    lines = page.splitlines()
    (reason,) = (line for line in lines if "limit " in line and "mean of" in line)
    said = float(re.search(r"peaks ([\d.]+) N, limit ([\d.]+) N", reason)[1])
    assert said > float(limit) and limit in reason
    assert float(lines[lines.index("mean") + 1]) > float(limit)


def test_every_table_is_named_by_the_heading_above_it_and_every_row_by_its_first_cell(documents):
    page = to_html(documents["fail"])
    assert unnamed(page) == []
    ids = re.findall(r' id="([^"]*)"', page)
    assert len(set(ids)) == len(ids) and set(re.findall(r'aria-labelledby="([^"]*)"', page)) <= set(ids)
