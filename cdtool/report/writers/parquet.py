"""results.parquet: every row of a benchmark as Parquet tables in a folder, with the traces."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import ClassVar

from cdtool.base.errors import UsageError
from cdtool.base.files.foreign import Kind
from cdtool.base.files.writing import replaced_folder
from cdtool.base.plain_text import plain
from cdtool.report.writers.base import Report, Writer
from cdtool.results.files.results_folder import KIND, PROVENANCE, holds_only_tables, require_pyarrow, write_tables
from cdtool.results.traces.file import TRACES_IN_FOLDER, encode_traces


class ParquetFolder(Writer[Report]):
    """Parquet: a folder with a table for each kind of rows, for DuckDB, pandas and `cdtool report`."""

    name: ClassVar[str] = "parquet"
    suffixes: ClassVar[tuple[str, ...]] = (".parquet",)
    kinds: ClassVar[dict[str, Kind]] = {".parquet": Kind(KIND.encode(), "results of cdtool benchmark")}
    writes_folder: ClassVar[bool] = True

    def check(self, target: Path) -> None:
        """Raise UsageError if the folder cannot be written: no pyarrow, a file, or anything else in the folder."""
        require_pyarrow(target)
        _may_replace(target)

    def write(self, report: Report, target: Path) -> None:
        """Write the folder; raises CdtoolError."""
        with replaced_folder(target, _may_replace) as folder:
            content = write_tables(report.evaluated.results, folder).encode("utf-8", "replace")
            (folder / PROVENANCE).write_bytes(content)
            digest = hashlib.sha256(content).hexdigest()
            (folder / TRACES_IN_FOLDER).write_bytes(encode_traces(report.traces, digest))


def _may_replace(target: Path) -> bool:
    """Return that all of an existing folder may be replaced; raises UsageError for a file, or another folder."""
    if target.exists() and not target.is_dir():
        raise UsageError(f"{plain(target)}: already exists and is not a folder", "choose another name, or remove it")
    if target.is_dir() and not holds_only_tables(target, (TRACES_IN_FOLDER,)):
        raise UsageError(
            f"{plain(target)}: already exists and contains no {ParquetFolder.kinds['.parquet'].words}, "
            "or other files too",
            "choose another name, or remove it",
        )
    return True
