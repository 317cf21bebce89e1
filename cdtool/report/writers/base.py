"""What every report writer is, and what it is given."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from cdtool.errors import ConfigurationError
from cdtool.evaluation.evaluated import Evaluated
from cdtool.evaluation.traces.trace import Trace
from cdtool.foreign_files import Kind


@dataclass(frozen=True)
class Image:
    """A figure beside the report: its file name, caption, and group (None: of all groups)."""

    name: str
    caption: str
    group: str | None = None


@dataclass(frozen=True)
class Report:
    """What a report shows: results with their statistics, the traces that were kept, and the figures in its folder."""

    evaluated: Evaluated
    traces: tuple[Trace, ...]
    images: tuple[Image, ...] = ()


class Writer:
    """The contract; a writer is derived from it.

    `name` is the one it is registered under. `suffixes`: those of the names that it writes for `--output`; none where
    it only writes into a folder of everything, as `in_folder`. `kinds`: by suffix, what marks a file that it wrote; any
    other file of that name is replaced with `--force` only.
    """

    name: ClassVar[str]
    suffixes: ClassVar[tuple[str, ...]] = ()
    in_folder: ClassVar[str] = ""
    kinds: ClassVar[Mapping[str, Kind]] = {}

    def __init_subclass__(cls) -> None:
        """Raise ConfigurationError for a suffix that no name can have, or that no kind belongs to."""
        for suffix in (*cls.suffixes, *([Path(cls.in_folder).suffix] if cls.in_folder else [])):
            if not suffix.startswith(".") or suffix != suffix.lower() or suffix not in cls.kinds:
                raise ConfigurationError(
                    f"the writer {cls.__name__} has the suffix '{suffix}'", "write it as .xyz, with a Kind in `kinds`"
                )

    def files(self, target: Path) -> tuple[Path, ...]:
        """Return all files that are written for a target, itself first."""
        return (target,)

    def has_content(self, report: Report) -> bool:  # noqa: ARG002 - most writers always have
        """Return whether there is anything to write into a folder."""
        return True

    def write(self, report: Report, target: Path) -> None:
        """Write the report by `cdtool.files`; raises CdtoolError. The same report gives the same bytes."""
        raise NotImplementedError
