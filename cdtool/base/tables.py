"""Read a TOML table so that every error names the file, the key and what is allowed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from cdtool.base.errors import ConfigurationError, nearest
from cdtool.base.files.bounded_loading import MOST_TOML, ContentError, parse_toml, read_text
from cdtool.base.files.kinds import kind_of
from cdtool.base.value_words import value_in_words

_SWAPPED = ("a signature file", "a machine file")  # given, needed: commands take both
#: No quantity of a machine in SI is larger, or smaller than its inverse unless 0: squares and products stay finite.
_LARGEST = 1e12


class Table:
    """A table of a TOML file; a key that was not read before `finish()` is an unknown key."""

    def __init__(self, values: Mapping[str, Any], where: str, prefix: str = "") -> None:
        self.values = values
        self.where = where
        self.prefix = prefix
        self._asked: list[str] = []

    def key(self, name: str) -> str:
        """Return file and full key, for an error message."""
        return f"{self.where}: {self.prefix}{name}"

    def fault(self, name: str, problem: str, hint: str = "") -> ConfigurationError:
        """Return an error about one key."""
        return ConfigurationError(f"{self.key(name)}: {problem}", hint)

    def __contains__(self, name: str) -> bool:
        self._note(name)
        return name in self.values

    def raw(self, name: str, default: Any = None) -> Any:
        """Return the value as read from TOML."""
        self._note(name)
        return self.values.get(name, default)

    def number(
        self, name: str, default: float | None = None, *, minimum: float = -math.inf, above: float = -math.inf
    ) -> float:
        """Return a finite number, at least `minimum` and more than `above`; required without a default."""
        value = self.raw(name)
        if value is None:
            if default is None:
                raise self.fault(name, "is missing", f"give a number{_range_text(minimum, above)}")
            return default
        return self._checked(name, value, minimum, above)

    def numbers(
        self,
        name: str,
        count: int,
        default: float | None = None,
        *,
        minimum: float = -math.inf,
        above: float = -math.inf,
    ) -> tuple[float, ...]:
        """Return one number for all joints, or a list with one per joint."""
        value = self.raw(name)
        if not isinstance(value, list):
            return (self.number(name, default, minimum=minimum, above=above),) * count
        if len(value) != count:
            raise self.fault(name, f"has {len(value)} values", f"give one number, or {count}: one per joint")
        return tuple(self._checked(f"{name}[{i}]", item, minimum, above) for i, item in enumerate(value))

    def whole(self, name: str, default: int, *, minimum: int) -> int:
        """Return an integer of at least `minimum`."""
        value = self.raw(name, default)
        if isinstance(value, bool) or not isinstance(value, int) or value < minimum:
            raise self.fault(name, f"is {value_in_words(value)}", f"give a whole number of at least {minimum}")
        return value

    def flag(self, name: str, default: bool) -> bool:
        """Return true or false."""
        value = self.raw(name, default)
        if not isinstance(value, bool):
            raise self.fault(name, f"is {value_in_words(value)}", "give true or false, without quotes")
        return value

    def text(self, name: str, default: str | None = None) -> str:
        """Return a string; required without a default."""
        value = self.raw(name)
        if value is None:
            if default is None:
                raise self.fault(name, "is missing", "give a text")
            return default
        if not isinstance(value, str):
            raise self.fault(name, f"is {value_in_words(value)}", "give a text in quotes")
        return value

    def choice(self, name: str, allowed: Sequence[str], default: str | None = None) -> str:
        """Return one of the allowed words."""
        value = self.text(name, default)
        if value not in allowed:
            raise self.fault(name, f"is '{value}'", nearest(value, allowed))
        return value

    def texts(self, name: str, default: Sequence[str] | None = None) -> tuple[str, ...]:
        """Return a list of strings; a single string becomes a list of one."""
        value = self.raw(name)
        if value is None and default is not None:
            return tuple(default)
        if isinstance(value, str):
            return (value,)
        if not isinstance(value, list) or not value or not all(isinstance(item, str) for item in value):
            raise self.fault(
                name, "is missing" if value is None else f"is {value_in_words(value)}", "give a list of texts"
            )
        return tuple(value)

    def table(self, name: str, required: bool = False) -> Table:
        """Return a table below this one; an empty one if it is missing and not required."""
        value = self.raw(name)
        if value is None and not required:
            value = {}
        if not isinstance(value, dict):
            problem = "is missing" if value is None else f"is {value_in_words(value)}"
            raise self.fault(name, problem, f"add a table [{self.prefix}{name}]")
        return Table(value, self.where, f"{self.prefix}{name}.")

    def finish(self) -> None:
        """Raise ConfigurationError if a key is left that was not read."""
        for name in self.values:
            if name not in self._asked:
                raise self.fault(name, "unknown key", nearest(name, self._asked))

    def _note(self, name: str) -> None:
        if name not in self._asked:
            self._asked.append(name)

    def _checked(self, name: str, value: Any, minimum: float, above: float) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise self.fault(name, f"is {value_in_words(value)}", f"give a number{_range_text(minimum, above)}")
        if value < minimum or value <= above:
            raise self.fault(name, f"is {value_in_words(value)}", f"give a number{_range_text(minimum, above)}")
        if value and not 1.0 / _LARGEST <= abs(value) <= _LARGEST:
            hint = f"no quantity is above {_LARGEST:g} or, unless 0, below {1.0 / _LARGEST:g}: check the unit"
            raise self.fault(name, f"is {value_in_words(value)}", hint)
        return float(value)


def read_toml(path: Path, what: str) -> dict[str, Any]:
    """Return the tables of a TOML file; raises ConfigurationError with the file and the line.

    `what` the file should be, such as "a machine file", is stated if it is something else.
    """
    text = read_text(path, ConfigurationError, most=MOST_TOML)
    try:
        return parse_toml(text)
    except ContentError as fault:
        kind = kind_of(text.encode())
        if not kind or kind.endswith(("machine file", "benchmark file")):
            raise ConfigurationError(
                f"{path}: not valid TOML: {fault}", "write texts in quotes, decimals with a point"
            ) from fault
        swapped = "; it may be swapped with the signature" if (kind, what) == _SWAPPED else ""
        raise ConfigurationError(f"{path}: is {kind}, not {what}", f"give {what}{swapped}") from fault


def _range_text(minimum: float, above: float) -> str:
    if above > -math.inf:
        return f" above {above:g}"
    return f" of at least {minimum:g}" if minimum > -math.inf else ""
