"""The suffix of a log's name, and its name without it: `run.csv.gz` is the log `run`, as `run.csv` is."""

from __future__ import annotations

from pathlib import Path

_PACKED = ".gz"
_TEXT = (".csv", ".txt", ".tsv", ".dat")


def log_suffix(path: Path) -> str:
    """Return the suffix of a log's name as it is written; of a compressed table with that of the table.

    Examples
    --------
    >>> log_suffix(Path("stiff/01.mcap")), log_suffix(Path("run.7.csv.gz")), log_suffix(Path("run.7.gz"))
    ('.mcap', '.csv.gz', '.gz')
    """
    inner = Path(path.stem).suffix
    return inner + path.suffix if path.suffix.lower() == _PACKED and inner.lower() in _TEXT else path.suffix


def log_stem(path: Path) -> str:
    """Return the name of a log without its suffix.

    Examples
    --------
    >>> log_stem(Path("stiff/01.mcap")), log_stem(Path("run.7.csv.gz")), log_stem(Path("run.7.gz"))
    ('01', 'run.7', 'run.7')
    """
    return path.name.removesuffix(log_suffix(path)) if path.suffix else path.stem
