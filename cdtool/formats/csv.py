"""CSV and its kin: text tables, one row a sample, with or without a header line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from cdtool.channels import ChannelMap
from cdtool.errors import RecordingError, UsageError
from cdtool.formats.csv_dialect import SAMPLE_BYTES, Dialect, find_dialect, is_number, looks_like_text
from cdtool.formats.csv_rows import Rows, check_rows
from cdtool.formats.source import Column, Source, split_unit, wanted_keys
from cdtool.recording import Finding, FloatArray

if TYPE_CHECKING:
    import pandas as pd

_MISSING = ["", "nan", "NaN", "NAN"]


@dataclass(frozen=True)
class Csv:
    """Tables of text: separator, header, decimal mark and encoding are found from the first lines."""

    name: ClassVar[str] = "csv"
    suffixes: ClassVar[tuple[str, ...]] = (".csv", ".txt", ".tsv", ".dat")

    def sniff(self, path: Path) -> bool:
        """True if the file starts as text that is no markup."""
        sample = _sample(path)
        return bool(sample.strip()) and looks_like_text(sample)

    def columns(self, path: Path, wanted: ChannelMap | None = None) -> Source:
        """The columns that `wanted` names, or all numeric ones; raises RecordingError with the line number."""
        sample = _sample(path)
        if not sample.strip():
            raise RecordingError(f"{path}: is empty", "was the recording stopped at once, or the copy cut off?")
        dialect = find_dialect(path, sample)
        rows = check_rows(path, dialect)
        names = dialect.header or tuple(str(i) for i in range(dialect.width))
        keys = list(names) if wanted is None else wanted_keys(path, wanted, names)
        findings: list[Finding] = []
        if dialect.encoding == "latin-1":
            findings.append(Finding("not valid UTF-8, read as Latin-1", severity="note"))
        table = _Table(path, dialect, rows, names)
        if wanted is None:
            keys, left_out = table.numeric(keys)
            findings += left_out
        arrays, cut = table.read(keys)
        if cut:
            findings.append(
                Finding(
                    f"the last line ({rows.line(table.rows.count - (not rows.cut))}) is cut off: dropped",
                    severity="loss",
                )
            )
        columns = {key: Column(key, values, unit=split_unit(key)[1]) for key, values in arrays.items()}
        return Source(
            path=path,
            format=self.name,
            columns=columns,
            findings=tuple(findings),
            details=dialect.details,
            names=names,
            first_row=0 if rows.blank else dialect.first_line,
        )


def write_csv(path: Path, columns: Mapping[str, FloatArray], formats: Mapping[str, str]) -> None:
    """Write columns of equal length, each by its printf format (default %.17g, which reads back to the bit)."""
    lengths = {len(values) for values in columns.values()}
    if len(lengths) != 1:
        raise UsageError(f"{path}: columns of lengths {sorted(lengths)}", "all columns of a table are equally long")
    row = ",".join(formats.get(name, "%.17g") for name in columns) + "\n"
    values = np.column_stack(list(columns.values()))
    body = (row * len(values)) % tuple(values.ravel().tolist())
    path.write_text(",".join(columns) + "\n" + body, encoding="utf-8", newline="\n")


@dataclass
class _Table:
    path: Path
    dialect: Dialect
    rows: Rows
    names: Sequence[str]

    def read(self, keys: list[str]) -> tuple[dict[str, FloatArray], bool]:
        """The columns as float64, and whether a half-written last line was dropped."""
        count, cut = self.rows.count, self.rows.cut
        try:
            try:
                frame = self._frame(keys, count, dtype=np.float64)
            except ValueError as fault:
                bad = self._first_bad_cell(keys)
                if bad is None:
                    raise
                if not self._may_be_cut(bad[0]):
                    raise self._not_a_number(*bad) from fault
                count, cut = count - 1, True
                frame = self._frame(keys, count, dtype=np.float64)
        except ValueError as fault:
            raise RecordingError(f"{self.path}: cannot be read as a table: {_one_line(fault)}") from fault
        if keys and len(frame) != count:
            raise RecordingError(
                f"{self.path}: {count} lines of numbers gave {len(frame)} rows",
                "line ends or quotes are mixed: save the file anew with one kind of line end",
            )
        return {key: np.ascontiguousarray(frame[key].to_numpy(dtype=np.float64)) for key in keys}, cut

    def numeric(self, keys: list[str]) -> tuple[list[str], list[Finding]]:
        """The columns that hold numbers only, and a finding for each other one."""
        try:
            self._frame(keys, self.rows.count, dtype=np.float64)
        except ValueError:
            pass
        else:
            return keys, []
        kept, findings = [], []
        for key in keys:
            bad = self._first_bad_cell([key])
            if bad is None or self._may_be_cut(bad[0]):
                kept.append(key)
                continue
            row, _, text = bad
            where = f"line {self.rows.line(row)} holds {text[:40]!r}"
            findings.append(Finding(f"column '{key}' is not numeric ({where}): left out", severity="note"))
        if not kept:
            raise RecordingError(f"{self.path}: no column holds numbers only", str(findings[0]) if findings else "")
        return kept, findings

    def _may_be_cut(self, row: int) -> bool:
        """True for the last row, if the file ends within it."""
        return row > 0 and row == self.rows.count - 1 and not self.rows.ended

    def _frame(self, keys: list[str], count: int, **options: Any) -> pd.DataFrame:
        import pandas as pd

        # From 3.1 on pandas parses to the last bit by default and warns where it is asked to.
        if tuple(int(part) for part in pd.__version__.split(".")[:2]) < (3, 1):
            options["float_precision"] = "round_trip"
        with self.path.open("rb") as file:
            file.seek(self.dialect.offset)
            try:
                frame: pd.DataFrame = pd.read_csv(
                    file,
                    sep=r"\s+" if self.dialect.separator == " " else self.dialect.separator,
                    header=None,
                    names=list(self.names),
                    usecols=keys,
                    nrows=count,
                    index_col=False,
                    decimal=self.dialect.decimal,
                    encoding="latin-1",  # the numbers are ASCII; names were read before
                    skipinitialspace=True,
                    keep_default_na=False,
                    na_values=_MISSING,
                    engine="c",
                    **options,
                )
            except pd.errors.ParserError as fault:
                raise RecordingError(
                    f"{self.path}: cannot be read as a table: {_one_line(fault)}", "are the quotes in pairs?"
                ) from fault
        return frame

    def _first_bad_cell(self, keys: list[str]) -> tuple[int, str, str] | None:
        """Row, column and text of the first cell that is no number."""
        texts = self._frame(keys, self.rows.count, dtype=str)
        found: tuple[int, str, str] | None = None
        for key in keys:
            for row, text in enumerate(texts[key]):
                if found is not None and row >= found[0]:
                    break
                if isinstance(text, str) and not is_number(text.strip(" \t"), self.dialect.decimal):
                    found = (row, key, text)
                    break
        return found

    def _not_a_number(self, row: int, key: str, text: str) -> RecordingError:
        shown = text.encode("latin-1").decode(self.dialect.encoding, errors="replace")[:60]
        return RecordingError(
            f"{self.path}: line {self.rows.line(row)}, column '{key}': {shown!r} is not a number",
            f"decimal mark: {self.dialect.details['decimal mark']}; empty and nan are missing values",
        )


def _sample(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(SAMPLE_BYTES)
    except OSError as fault:
        raise RecordingError(
            f"{path}: cannot be read: {fault.strerror}", "check the path and its permissions"
        ) from fault


def _one_line(fault: Exception) -> str:
    return " ".join(str(fault).split())
