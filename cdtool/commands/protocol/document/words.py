"""The texts of a protocol in one language: sentences from a table, numbers and dates as usual there."""

from __future__ import annotations

import datetime as dt
import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from cdtool.base.plain_text import digits_beside
from cdtool.commands.protocol.assessment.reasons import ProtocolVerdict, Reason

LANGUAGES = ("en", "de")
_FOLDER = Path(__file__).with_name("texts")
# Significant digits of a measured value.
_DIGITS = 4
# Of a limit, which is shown as it was written.
_ALL_DIGITS = 12
# Which value of a sentence is compared with which.
_BESIDE = (
    ("force", "limit"),
    ("peak", "limit"),
    ("most", "limit"),
    ("largest", "limit"),
    ("rate", "needed"),
    ("end", "needed"),
    ("end", "begin"),
    ("end", "until"),
    ("reading", "range"),
    ("pressure", "limit"),
)


@dataclass(frozen=True)
class Words:
    """The texts of one language, by table and key."""

    language: str
    texts: Mapping[str, Any]

    def __call__(self, key: str, **values: object) -> str:
        """Return the text of `TABLE.KEY` with its placeholders filled in; KeyError for an unknown key."""
        table, _, name = key.partition(".")
        text = str(self.texts[table][name])
        shown = {item: self.value(value) for item, value in values.items()}
        for value_name, limit_name in _BESIDE:
            value, limit = values.get(value_name), values.get(limit_name)
            if isinstance(value, float) and isinstance(limit, float):
                shown[value_name], shown[limit_name] = self.beside(value, limit), self.limit(limit)
        return text.format(**shown)

    def name(self, table: str, name: str) -> str:
        """Return a name of the files in this language, as that of a step; one that the table does not have as it is."""
        return str(self.texts[table].get(name, name))

    def force_of(self, step: str) -> str:
        """Return the heading of the largest forces in a step: its symbol, or else its name, with the unit."""
        return str(self.texts["force_column"].get(step) or self("column.force_in", step=self.name("step", step)))

    def value(self, value: object) -> str:
        """Return a value as text: a number with the language's decimal sign, a date, a text as it is."""
        if value is None:
            return self("document.nothing")
        if isinstance(value, dt.date):
            return self._date(value)
        if isinstance(value, float):
            return self.number(value)
        return str(value)

    def number(self, value: float | None, digits: int = _DIGITS) -> str:
        """Return a number with so many significant digits; a dash without a finite value."""
        if value is None or not math.isfinite(value):
            return self("document.nothing")
        text = f"{value:.{digits}g}"
        text = f"{value:.0f}" if "e+" in text else text
        return text.replace("-", "−", 1).replace(".", str(self.texts["decimal"]))

    def beside(self, value: float | None, limit: float) -> str:
        """Return a number with the digits that show on which side of a limit it is."""
        return self.number(value) if value is None else self.number(value, digits_beside(value, limit, _DIGITS))

    def limit(self, value: float) -> str:
        """Return a limit with all its digits."""
        return self.number(value, _ALL_DIGITS)

    def reason(self, reason: Reason) -> str:
        """Return a reason as a sentence."""
        values: dict[str, object] = dict(reason.values)
        if reason.cause is not None:
            table = "pressure_cause" if reason.kind == "pressure_not_assessable" else "cause"
            values["cause"] = self(f"{table}.{reason.cause.kind}", **reason.cause.numbers)
        if "step" in values:
            values["step"] = self.name("step", str(values["step"]))
        if "averaged" in values:
            values["averaged"] = self(f"averaged.{values['averaged']}")
        if reason.kind == "pressure_exceeds":
            values["area"] = self.name("area", str(values["area"]))
        if reason.kind == "no_value":
            values["keys"] = values.pop("key")
        return self(f"reason.{reason.kind}", **values)

    def reasons(self, verdict: ProtocolVerdict, outcome: str) -> list[str]:
        """Return the reasons for an outcome as sentences; values that are not filled in are listed in one."""
        found = [reason for reason in verdict.reasons if reason.outcome == outcome]
        empty = [reason for reason in found if reason.kind == "no_value"]
        sentences = [self.reason(reason) for reason in found if reason.kind != "no_value"]
        for file in dict.fromkeys(str(reason.values["file"]) for reason in empty):
            keys = ", ".join(str(reason.values["key"]) for reason in empty if reason.values["file"] == file)
            sentences.append(self("reason.no_value", file=file, keys=keys))
        return sentences

    def _date(self, day: dt.date) -> str:
        return str(self.texts["date"]).format(
            day=day.day,
            month=self.texts["months"][day.month - 1],
            year=day.year,
            day_number=f"{day.day:02}",
            month_number=f"{day.month:02}",
        )


@cache
def words_of(language: str) -> Words:
    """Return the texts of a language of `LANGUAGES`."""
    return Words(language, tomllib.loads((_FOLDER / f"{language}.toml").read_text(encoding="utf-8")))
