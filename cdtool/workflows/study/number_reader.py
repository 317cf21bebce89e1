"""Reads the numbers of a study file, and keeps what was assumed because nobody gave it."""

from __future__ import annotations

from cdtool.tables import Table


class StudyReader:
    """Tables by their names; `assumed` has a line for every default that was taken."""

    def __init__(self, root: Table) -> None:
        self._tables = {"": root}
        self.assumed: list[str] = []

    def table(self, name: str) -> Table:
        """A table such as sensors.encoder, always the same one."""
        if name not in self._tables:
            above, _, last = name.rpartition(".")
            self._tables[name] = self.table(above).table(last)
        return self._tables[name]

    def number(self, table: str, key: str, default: float, unit: str, why: str = "", **bounds: float) -> float:
        """A number of a table; the default is told with its reason."""
        part = self.table(table)
        if key not in part:
            self.assumed.append(f"{table}.{key} = {default:.4g} {unit}".rstrip() + (f": {why}" if why else ""))
        return part.number(key, default, **bounds)

    def optional(self, table: str, key: str, none: str) -> float | None:
        """A positive number that may be absent; then it is told what its absence means."""
        part = self.table(table)
        if key in part:
            return part.number(key, above=0.0)
        self.assumed.append(f"{table}.{key} = none: {none}")
        return None

    def finish(self) -> None:
        """Raise ConfigurationError if a key of any table is left that nobody asked for."""
        for table in self._tables.values():
            table.finish()
