"""The texts of a protocol in one language: sentences from a table, numbers and dates as usual there."""

from __future__ import annotations

import datetime as dt
import math
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import accumulate
from pathlib import Path
from typing import Any

from cdtool.base.plain_text import digits, digits_beside
from cdtool.commands.protocol.assessment.reasons import ProtocolVerdict, Reason
from cdtool.report.number_text import number

LANGUAGES = ("en", "de")
_FOLDER = Path(__file__).with_name("texts")
# Significant digits of a measured value; one that is compared has as many as show on which side of its limit it is.
_DIGITS = 3
# Of a limit, which is shown as it was written.
_ALL_DIGITS = 12
# A list of names has so many characters; others are counted.
_NAMED = 200
# With what a measured value of a sentence is compared.
_LIMITS = ("limit", "needed", "begin", "until", "range")
# Values of a sentence that a person, a profile or an instrument states.
_STATED = frozenset((*_LIMITS, "stated", "planned", "tolerance", "cell", "entered", "stiffness", "length", "record"))
# Values that say where a reason is.
_WHERE = ("point", "repetition", "recording", "other", "key", "profile")


@dataclass(frozen=True)
class Words:
    """The texts of one language, by table and key."""

    language: str
    texts: Mapping[str, Any]

    def __call__(self, key: str, /, **values: object) -> str:
        """Return the text of `TABLE.KEY` with its placeholders filled in; KeyError for an unknown key.

        A list of measured values is shown as their range.
        """
        table, _, name = key.partition(".")
        limit = next((values[name] for name in _LIMITS if isinstance(values.get(name), float)), None)
        shown = {
            item: self.value(value) if item in _STATED else self._measured(value, limit)
            for item, value in values.items()
        }
        return str(self.texts[table][name]).format(**shown)

    def name(self, table: str, name: str) -> str:
        """Return a name of the files in this language, as that of a step; one that the table does not have as it is."""
        return str(self.texts.get(table, {}).get(name, name))

    def symbol(self, step: str) -> str:
        """Return the symbol of the largest force in a step, or else the name of the step."""
        return self.name("symbol", step) if step in self.texts["symbol"] else self.name("step", step)

    def names(self, names: Sequence[str]) -> str:
        """Return names in a list, or the first ones that fit into a few lines and how many more there are."""
        count = max(1, sum(length <= _NAMED for length in accumulate(len(name) + 2 for name in names)))
        listed = ", ".join(names[:count])
        return listed if count >= len(names) else self("verdict.more_names", names=listed, count=len(names) - count)

    def value(self, value: object) -> str:
        """Return a value that was stated: a number with the language's decimal sign, a date, a text as it is."""
        if value is None:
            return self("document.nothing")
        if isinstance(value, dt.date):
            return self._date(value)
        return self.limit(value) if isinstance(value, float) else str(value)

    def number(self, value: float | None, digits: int = _DIGITS, error: float | None = None) -> str:
        """Return a measured number with so many significant digits, none finer than its error; a dash without one."""
        if value is None or not math.isfinite(value):
            return self("document.nothing")
        return self._spelt(number(value, digits, error))

    def beside(self, value: float | None, limit: float | None) -> str:
        """Return a number with the digits that show on which side of a limit it is."""
        if value is None or limit is None:
            return self.number(value)
        return self.number(value, digits_beside(value, limit, _DIGITS))

    def limit(self, value: float) -> str:
        """Return a limit with all its digits."""
        return self._spelt(digits(value, _ALL_DIGITS))

    def reason(self, *reasons: Reason) -> str:
        """Return reasons of one kind as a sentence: where, and what, with the range of the measured values."""
        first = reasons[0]
        values = _together([reason.values for reason in reasons])
        if first.cause is not None:
            table = "pressure_cause" if first.kind == "pressure_not_assessable" else "cause"
            causes = _together([reason.cause.numbers for reason in reasons if reason.cause])
            values["cause"] = self(f"{table}.{first.cause.kind}", **causes)
        if "step" in values:
            values |= {"symbol": self.symbol(str(values["step"])), "step": self.name("step", str(values["step"]))}
        if "averaged" in values:
            values["averaged"] = self(f"averaged.{values['averaged']}")
        if "area" in values:
            values["area"] = self.name("of_limits", str(values["area"]))
        values["keys"] = ", ".join(str(reason.values.get("key")) for reason in reasons)
        what, where = self(f"reason.{first.kind}", **values), self._where(reasons)
        return f"{where}: {what}" if where else what

    def reasons(self, verdict: ProtocolVerdict, outcome: str) -> list[str]:
        """Return the reasons for an outcome as sentences: one for all that differ in place and measured values only."""
        groups: dict[object, list[Reason]] = {}
        for reason in verdict.reasons:
            if reason.outcome == outcome:
                groups.setdefault(_shared(reason), []).append(reason)
        return [self.reason(*group) for group in groups.values()]

    def _where(self, reasons: Iterable[Reason]) -> str:
        """Return the measuring points of reasons, each with its repetitions or recordings."""
        points: dict[str, list[Mapping[str, object]]] = {}
        for reason in reasons:
            if "point" in reason.values:
                points.setdefault(str(reason.values["point"]), []).append(reason.values)
        places = []
        for point, items in points.items():
            recordings = [" = ".join(str(item[key]) for key in ("recording", "other") if key in item) for item in items]
            numbers = ", ".join(dict.fromkeys(str(item["repetition"]) for item in items if "repetition" in item))
            if numbers:
                key = "where.one" if len(set(recordings)) == 1 else "where.several"
                places.append(self(key, point=point, numbers=numbers, recording=recordings[0]))
            else:
                places.append(", ".join([point, *dict.fromkeys(filter(None, recordings))]))
        return "; ".join(places)

    def _measured(self, value: object, limit: object) -> str:
        """Return a measured value, or the range of several, beside its limit; other values as they are."""
        if not isinstance(value, float | list):
            return self.value(value)
        beside = limit if isinstance(limit, float) else None
        ends = (min(value), max(value)) if isinstance(value, list) else (value,)
        low, *high = dict.fromkeys(self.beside(end, beside) for end in ends)
        return self("document.range", low=low, high=high[0]) if high else low

    def _spelt(self, text: str) -> str:
        return text.replace("-", "−", 1).replace(".", str(self.texts["decimal"]))

    def _date(self, day: dt.date) -> str:
        return str(self.texts["date"]).format(day, month=self.texts["months"][day.month - 1])


def _is_measured(name: str, value: object) -> bool:
    return isinstance(value, float) and name not in _STATED


def _together(values: Sequence[Mapping[str, object]]) -> dict[str, object]:
    """Return the values of several reasons: a measured one as a list, others as in the first."""
    first = values[0]
    return {name: [one[name] for one in values] if _is_measured(name, first[name]) else first[name] for name in first}


def _shared(reason: Reason) -> object:
    """Return what reasons have in common that are one sentence; each reason for a fail is one of its own."""
    if reason.outcome == "fail":
        return id(reason)
    numbers = {**reason.values, **(reason.cause.numbers if reason.cause else {})}
    shared = {name: value for name, value in numbers.items() if name not in _WHERE and not _is_measured(name, value)}
    return reason.kind, reason.cause and reason.cause.kind, tuple(shared.items())


@cache
def words_of(language: str) -> Words:
    """Return the texts of a language of `LANGUAGES`."""
    return Words(language, tomllib.loads((_FOLDER / f"{language}.toml").read_text(encoding="utf-8")))
