"""The report as JUnit XML, for CI.

Conventions: `time` is 0, because a latency is not a running time. Text from files is plain, so that every XML 1.0
parser reads it.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar
from xml.etree import ElementTree

from cdtool.base.files.foreign import Kind
from cdtool.base.files.writing import write_text
from cdtool.base.plain_text import plain
from cdtool.report.cases import Case, Suite, suites_of
from cdtool.report.writers.base import Report, Writer

_COUNTED = {"failures": "failure", "errors": "error", "skipped": "skipped"}


class Junit(Writer[Report]):
    """JUnit XML: a test case per limit, force profile, and recording with each detector."""

    name: ClassVar[str] = "junit"
    suffixes: ClassVar[tuple[str, ...]] = (".xml",)
    in_folder: ClassVar[str] = "junit.xml"
    kinds: ClassVar[dict[str, Kind]] = {".xml": Kind(b'<testsuites name="cdtool"', "JUnit report of cdtool")}

    def write(self, report: Report, target: Path) -> None:
        """Write it; raises CdtoolError."""
        write_text(target, to_junit(report))


def to_junit(report: Report) -> str:
    """Return JUnit XML that Jenkins and GitLab read; the same text for the same results."""
    # Jenkins' schema has no "skipped" for all suites together.
    counts = dict.fromkeys(("tests", "failures", "errors"), 0)
    texts = []
    for suite in map(_suite, suites_of(report.evaluated)):
        for key in counts:
            counts[key] += int(suite.get(key, "0"))
        ElementTree.indent(suite, " ", level=1)
        texts.append(ElementTree.tostring(suite, encoding="unicode"))  # an element takes many times as much memory
    attributes = {"name": "cdtool", **{key: str(count) for key, count in counts.items()}, "time": "0"}
    root = ElementTree.tostring(ElementTree.Element("testsuites", attributes), encoding="unicode").removesuffix(" />")
    body = "\n".join((f"{root}>", *(f" {text}" for text in texts), "</testsuites>"))
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{body}\n'


def _suite(suite: Suite) -> ElementTree.Element:
    cases: Sequence[ElementTree.Element] = [_case(suite.name, case) for case in suite.cases]
    counts = {key: str(sum(case.find(kind) is not None for case in cases)) for key, kind in _COUNTED.items()}
    attributes = {"name": plain(suite.name), "tests": str(len(cases)), **counts, "time": "0"}
    element = ElementTree.Element("testsuite", attributes)
    element.extend(cases)
    return element


def _case(suite: str, case: Case) -> ElementTree.Element:
    element = ElementTree.Element("testcase", {"classname": plain(suite), "name": plain(case.name), "time": "0"})
    if case.kind:
        # Jenkins shows the message, GitLab the text.
        outcome = ElementTree.SubElement(element, case.kind, {"type": case.kind, "message": plain(case.message)})
        outcome.text = _text(case.message)
    if case.lines:
        ElementTree.SubElement(element, "system-out").text = "\n".join(map(_text, case.lines))
    return element


def _text(line: str) -> str:
    """Return a line without [[ATTACHMENT|file]], which Jenkins and GitLab would make a link to a file of theirs."""
    return re.sub(r"\[(?=\[)", "[ ", plain(line))
