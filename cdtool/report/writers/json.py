"""results.json: every row of a benchmark, and the traces in a second file."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from cdtool.evaluation.results_file import to_json
from cdtool.evaluation.traces.file import encode_traces, traces_path
from cdtool.files import replaced, write_text
from cdtool.foreign_files import Kind
from cdtool.report.writers.base import Report, Writer


class Json(Writer[Report]):
    """JSON results, which `cdtool report` and `cdtool compare` read; the traces are in a second file."""

    name: ClassVar[str] = "json"
    suffixes: ClassVar[tuple[str, ...]] = (".json",)
    in_folder: ClassVar[str] = "results.json"
    kinds: ClassVar[dict[str, Kind]] = {
        ".json": Kind(b'"tool": "cdtool"', "results of cdtool benchmark"),
        ".gz": Kind(b'"results_sha256":', "traces of cdtool benchmark"),
    }

    def files(self, target: Path) -> tuple[Path, ...]:
        """Return the results and their traces."""
        return (target, traces_path(target))

    def write(self, report: Report, target: Path) -> None:
        """Write results and traces: both or neither. Raises CdtoolError."""
        text = to_json(report.evaluated.results)
        if target.exists() and not target.is_file():
            write_text(target, text)  # a device or pipe has no second file
            return
        with replaced(*self.files(target)) as (results, traces):
            results.write_bytes(text.encode("utf-8", "replace"))
            traces.write_bytes(encode_traces(report.traces, text))
