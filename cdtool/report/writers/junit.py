"""Limits and force profiles as JUnit test cases, for CI."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from cdtool.files import write_text
from cdtool.foreign_files import Kind
from cdtool.report.writers.base import Report, Writer


class Junit(Writer):
    """JUnit XML: a test case per limit and force profile."""

    name: ClassVar[str] = "junit"
    suffixes: ClassVar[tuple[str, ...]] = (".xml",)
    in_folder: ClassVar[str] = "junit.xml"
    kinds: ClassVar[dict[str, Kind]] = {".xml": Kind(b'<testsuites name="cdtool"', "JUnit report of cdtool")}

    def write(self, report: Report, target: Path) -> None:
        """Write it; raises CdtoolError."""
        from cdtool.report.cases import to_junit

        write_text(target, to_junit(report.evaluated))
