"""Names -> classes, loaded only when asked for.

A folder of the method (formats, machines, detectors, thresholds) has one literal table `name -> "module:Class"`.
Plug-ins come by entry points of the group `cdtool.<kind>`; they are looked at only when an unknown name is asked for or
everything is listed.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from cdtool.errors import CdtoolError, UsageError, nearest


@dataclass(frozen=True)
class Registry:
    """The table of one kind of class, with its short names."""

    kind: str
    table: dict[str, str]
    short_names: dict[str, str] = field(default_factory=dict)

    def names(self, plugins: bool = False) -> list[str]:
        """Names in the table's order; plug-ins behind them if asked for."""
        found = list(self.table)
        if plugins:
            found += sorted(set(self._plugins()) - set(found))
        return found

    def canonical(self, name: str) -> str:
        """The full name behind a full or short name; raises UsageError with the nearest known ones."""
        full = self.short_names.get(name.lower(), name)
        if full in self.table or full in self._plugins():
            return full
        known = [*self.names(plugins=True), *self.short_names]
        raise UsageError(f"unknown {self.kind} '{name}'", nearest(name, known))

    def load(self, name: str) -> Any:
        """The class of that name."""
        full = self.canonical(name)
        if full in self.table:
            module, _, attribute = self.table[full].partition(":")
            return getattr(import_module(module), attribute)
        return load_plugin(self._plugins()[full], self.kind)

    def _plugins(self) -> dict[str, EntryPoint]:
        return {point.name: point for point in entry_points(group=f"cdtool.{self.kind}s")}


def plugin_packages() -> dict[str, str]:
    """The installed packages that bring plug-ins, with their versions: what a report has to name."""
    return {
        point.dist.name: point.dist.version
        for kind in ("detectors", "thresholds", "machines", "formats")
        for point in entry_points(group=f"cdtool.{kind}")
        if point.dist is not None
    }


def load_plugin(point: EntryPoint, kind: str) -> Any:
    """The class of an entry point; a failing one is an error that names its package."""
    try:
        return point.load()
    except Exception as fault:
        package = point.dist.name if point.dist is not None else point.value
        raise CdtoolError(
            f"{kind} plug-in '{point.name}' of package '{package}' does not load: {fault!r}",
            f"repair or uninstall '{package}'",
        ) from fault
