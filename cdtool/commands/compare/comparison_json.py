"""The comparison of two builds as JSON."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import ClassVar

from cdtool.base.files.foreign import Kind
from cdtool.base.files.strict_json import strict_json
from cdtool.base.files.writing import write_text
from cdtool.commands.compare.comparison import BuildComparison
from cdtool.report.writers.base import Subject, Writer


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
