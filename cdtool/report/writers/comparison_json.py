"""The comparison of two builds as JSON."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import ClassVar

from cdtool.evaluation.builds.comparison import BuildComparison
from cdtool.files import write_text
from cdtool.foreign_files import Kind
from cdtool.report.writers.base import Subject, Writer
from cdtool.strict_json import strict_json


class ComparisonJson(Writer[BuildComparison]):
    """Comparison of two builds: JSON with all numbers, for programs."""

    name: ClassVar[str] = "comparison_json"
    subject: ClassVar[Subject] = "comparison"
    suffixes: ClassVar[tuple[str, ...]] = (".json",)
    kinds: ClassVar[dict[str, Kind]] = {".json": Kind(b'{\n "verdict": "', "comparison of cdtool")}

    def write(self, report: BuildComparison, target: Path) -> None:
        """Write it; raises CdtoolError."""
        write_text(target, to_json(report))


def to_json(comparison: BuildComparison) -> str:
    """Return strict JSON: null for a number that is missing or not finite."""
    return strict_json(asdict(comparison)) + "\n"
