"""The contract of report writers, and what they write."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import ClassVar, Generic, Literal, TypeVar, get_args

from cdtool.base.errors import ConfigurationError
from cdtool.base.files.foreign import Kind
from cdtool.report.model import Model, report_model
from cdtool.results.evaluated import Evaluated
from cdtool.results.traces.trace import Trace

Subject = Literal["benchmark", "comparison", "protocol"]
Content = TypeVar("Content")


@dataclass(frozen=True)
class Image:
    """A figure in the report's folder: its file name, caption, and group (None: of all groups)."""

    name: str
    caption: str
    group: str | None = None


@dataclass(frozen=True)
class Report:
    """What the reports of a benchmark show: results with their statistics, traces, and the figures in its folder."""

    evaluated: Evaluated
    traces: tuple[Trace, ...] = ()
    images: tuple[Image, ...] = ()

    @cached_property
    def model(self) -> Model:
        """The tables and texts that all renderers show."""
        return report_model(self.evaluated, dict.fromkeys((trace.group, trace.log) for trace in self.traces))


class Writer(Generic[Content]):
    """The base class of writers, of a `Report`, of a `BuildComparison` or of a protocol's `Document`.

    `name` is the name it is registered under. `subject`: what it writes, the reports of a benchmark, the comparison of
    two builds or a test protocol. `needs`: the library of an extra without which it cannot write. `suffixes`: of the
    names that it writes for `--output`; none if it writes only into a report folder, as `in_folder`. `kinds`: by
    suffix, what marks a file that it wrote; any other file of that name is replaced only with `--force`.
    `writes_folder`: what it writes under a name of its suffix is a folder, which it checks itself.
    """

    name: ClassVar[str]
    subject: ClassVar[Subject] = "benchmark"
    suffixes: ClassVar[tuple[str, ...]] = ()
    in_folder: ClassVar[str] = ""
    kinds: ClassVar[Mapping[str, Kind]] = {}
    writes_folder: ClassVar[bool] = False
    needs: ClassVar[str] = ""

    def __init_subclass__(cls) -> None:
        """Raise ConfigurationError for an unknown subject, or a suffix that a name cannot have or without a kind."""
        if cls.subject not in get_args(Subject):
            raise ConfigurationError(
                f"the writer {cls.__name__} has the subject '{cls.subject}'", f"use {' or '.join(get_args(Subject))}"
            )
        for suffix in (*cls.suffixes, *([Path(cls.in_folder).suffix] if cls.in_folder else [])):
            if not suffix.startswith(".") or suffix != suffix.lower() or suffix not in cls.kinds:
                raise ConfigurationError(
                    f"the writer {cls.__name__} has the suffix '{suffix}'", "write it as .xyz, with a Kind in `kinds`"
                )

    def files(self, target: Path) -> tuple[Path, ...]:
        """Return all files that are written for a target, the target first."""
        return (target,)

    def check(self, target: Path) -> None:
        """Raise UsageError if a target cannot be written, beyond what is checked of every file."""

    def has_content(self, report: Content) -> bool:  # noqa: ARG002 - most writers always have
        """Return whether there is anything to write into a folder."""
        return True

    def write(self, report: Content, target: Path) -> None:
        """Write the report by `cdtool.base.files.writing`; raises CdtoolError.

        The same report produces the same bytes.
        """
        raise NotImplementedError
