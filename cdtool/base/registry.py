"""Classes by name, loaded on first use.

Each folder of the method (formats, machines, detectors, thresholds, report writers) has one literal table
`name -> "module:Class"`. Plug-ins are entry points of the group `cdtool.<kind>s`; they are searched only for an unknown
name or a full list, and checked against the contract when they are loaded.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import MISSING, dataclass, field, fields, is_dataclass
from difflib import get_close_matches
from importlib import import_module
from typing import TYPE_CHECKING, Any

from cdtool.base.errors import CdtoolError, UsageError, nearest

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint


@dataclass(frozen=True)
class Registry:
    """The table of one kind of class, with its short names, and the requirements on a plug-in of that kind.

    `contract`: attributes of the class. `optional`: optional attributes with their types. `settings`: the metadata that
    each field of a frozen dataclass needs in addition to its default; None if the class need not be one.
    """

    kind: str
    table: dict[str, str]
    short_names: dict[str, str] = field(default_factory=dict)
    contract: tuple[str, ...] = ()
    optional: Mapping[str, type] = field(default_factory=dict)
    settings: tuple[str, ...] | None = None

    def names(self, plugins: bool = False) -> list[str]:
        """Return the names in the table's order; with `plugins`, followed by those of plug-ins."""
        found = list(self.table)
        if plugins:
            found += sorted(set(self._plugins()) - set(found))
        return found

    def names_for(self, name: object) -> list[str]:
        """Return the names to look `name` up in: with plug-ins only if the table does not have it."""
        return self.names(plugins=name not in self.names())

    def usable_names(self) -> list[str]:
        """Return the names in the table's order, then the usable plug-ins."""
        broken = self.broken_plugins()
        return [name for name in self.names(plugins=True) if name in self.table or name not in broken]

    def canonical(self, name: str) -> str:
        """Return the full name for a full or short name; raises UsageError with the nearest known ones."""
        full = self.short_names.get(name.lower(), name)
        if full in self.table:
            return full
        plugins = self._plugins()
        return full if full in plugins else self._by_short_name(name, sorted(plugins))

    def load(self, name: str) -> Any:
        """Return the class of that name; for an unusable plug-in raises CdtoolError, naming its package."""
        full = self.canonical(name)
        if full in self.table:
            module, _, attribute = self.table[full].partition(":")
            return getattr(import_module(module), attribute)
        return self._load_plugin(full)

    def checked(self, made: Any) -> Any:
        """Return an instance of a class of this table or of one's own; raises UsageError if that has a fault."""
        name = str(getattr(made, "name", type(made).__name__))
        if name in self.table and type(made) is self.load(name):
            return made
        problem = f"has the name of a {self.kind} of cdtool itself" if name in self.table else ""
        if problem := problem or self._breach(type(made), name):
            raise UsageError(f"{self.kind} {type(made).__name__} {problem}", f"see docs/recipes.md#add-a-{self.kind}")
        return made

    def broken_plugins(self) -> dict[str, CdtoolError]:
        """Return the installed plug-ins that cannot be used, and why."""
        found = {}
        for name in sorted(self._plugins()):
            try:
                self._load_plugin(name)
            except CdtoolError as fault:
                found[name] = fault
        return found

    def _plugins(self) -> dict[str, list[EntryPoint]]:
        found: dict[str, list[EntryPoint]] = {}
        for point in entry_points(group=f"cdtool.{self.kind}s"):
            found.setdefault(point.name, []).append(point)
        return found

    def _load_plugin(self, name: str) -> Any:
        points = self._plugins()[name]
        point = points[0]
        if len(points) > 1:
            packages = " and ".join(sorted(_package(item) for item in points))
            raise CdtoolError(f"the packages {packages} both provide a {self.kind} '{name}'", "uninstall one of them")
        if name in self.table:
            raise self._fault(point, f"has the name of a {self.kind} of cdtool itself")
        try:
            loaded = point.load()
        except Exception as fault:
            raise self._fault(point, f"cannot be loaded: {fault!r}") from fault
        if problem := self._breach(loaded, name):
            raise self._fault(point, problem)
        return loaded

    def _breach(self, loaded: Any, name: str) -> str:
        """Return how a plug-in's class violates the contract; empty if it does not."""
        for attribute in self.contract:
            if not hasattr(loaded, attribute):
                return f"has no attribute '{attribute}'"
        for attribute, kind in self.optional.items():
            if not isinstance(getattr(loaded, attribute, None), kind | None):
                return f"has an attribute '{attribute}' that is not of type {kind.__name__}"
        if "name" in self.contract and loaded.name != name:
            return f"is named '{loaded.name}' in its class: both names must be the same"
        short = getattr(loaded, "short_name", "")
        if short in self.short_names or short in self.table:
            return f"has the short name '{short}', which belongs to {self.short_names.get(short, short)}"
        return "" if self.settings is None else self._breach_of_settings(loaded, self.settings)

    @staticmethod
    def _breach_of_settings(loaded: Any, settings: tuple[str, ...]) -> str:
        """Return how the dataclass of a plug-in violates the contract; every field needs a default and metadata."""
        if not (is_dataclass(loaded) and getattr(loaded, "__dataclass_params__").frozen):  # noqa: B009 - untyped
            return "is not a frozen dataclass"
        for item in fields(loaded):
            if item.default is MISSING:
                return f"has no default for '{item.name}'"
            if absent := [key for key in settings if key not in item.metadata]:
                return f"has no {' and no '.join(absent)} for '{item.name}': define it with cdtool.detectors.base.gain"
        return ""

    def _fault(self, point: EntryPoint, problem: str) -> CdtoolError:
        package = _package(point)
        return CdtoolError(
            f"{self.kind} plug-in '{point.name}' of package '{package}' {problem}", f"repair or uninstall '{package}'"
        )

    def _by_short_name(self, name: str, plugins: list[str]) -> str:
        broken = self.broken_plugins()
        short = {full: getattr(self._load_plugin(full), "short_name", "") for full in plugins if full not in broken}
        found = [full for full, known in short.items() if known.lower() == name.lower()]
        if len(found) == 1:
            return found[0]
        if found:
            raise UsageError(f"the short name '{name}' belongs to {' and '.join(found)}", "give the full name")
        hint = self._hint(name, [*self.names(plugins=True), *self.short_names, *filter(None, short.values())])
        # Failures come before the hint: the list of known names is cut at the end of the line.
        told = "; ".join([f"unknown {self.kind} '{name}'", *(item.message for item in broken.values())])
        raise UsageError(told, hint)

    def _hint(self, name: str, known: list[str]) -> str:
        """Return the nearest known names, or all of them if they are few; then where the list is."""
        if len(known) <= 10:  # as a hint has room for
            return nearest(name, known)
        close = get_close_matches(name, sorted(known), n=2, cutoff=0.5)
        listed = f"cdtool list {self.kind}s shows all"
        return f"did you mean {' or '.join(close)}? {listed}" if close else listed


def entry_points(*, group: str) -> Iterable[EntryPoint]:
    """Return the entry points of a group; their reader is imported here, since most commands need none."""
    from importlib import metadata

    return metadata.entry_points(group=group)


def plugin_packages() -> dict[str, str]:
    """Return the installed packages that provide plug-ins, with their versions, for reports."""
    from importlib import metadata

    # Each call reads all installed packages: one for all kinds.
    points = metadata.entry_points()
    found = {
        point.dist.name: point.dist.version
        for kind in ("detectors", "thresholds", "machines", "formats", "writers")
        for point in points.select(group=f"cdtool.{kind}")
        if point.dist is not None
    }
    return dict(sorted(found.items()))


def _package(point: EntryPoint) -> str:
    return point.dist.name if point.dist is not None else point.value
