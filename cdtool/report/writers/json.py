"""results.json: every row of a benchmark, and the traces in a second file."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import ClassVar

from cdtool.base.files.foreign import Kind
from cdtool.base.files.writing import replaced, write_pieces
from cdtool.report.writers.base import Report, Writer
from cdtool.results.files.results_file import json_pieces
from cdtool.results.traces.file import encode_traces, traces_path


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
        if target.exists() and not target.is_file():
            write_pieces(target, json_pieces(report.evaluated.results))  # a device or pipe has no second file
            return
        digest = hashlib.sha256()
        with replaced(*self.files(target)) as (results, traces):
            with results.open("wb") as file:
                for piece in json_pieces(report.evaluated.results):
                    content = piece.encode("utf-8", "replace")
                    digest.update(content)
                    file.write(content)
            traces.write_bytes(encode_traces(report.traces, digest.hexdigest()))
