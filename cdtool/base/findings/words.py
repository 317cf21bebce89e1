"""How a finding is written: the formats of the sentences in `kinds.toml`, and what is computed from several numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from string import Formatter
from typing import Any

from cdtool.base.findings.kinds import FindingKind
from cdtool.base.plain_text import counted, counted_lines, digits, first_of


class FindingWords:
    """The words of a kind with the numbers of a finding, and with what is computed from them."""

    def __init__(self, kind: FindingKind, numbers: Mapping[str, Any]) -> None:
        self.kind = kind
        self.numbers = _Numbers(numbers)

    def sentence(self) -> str:
        """Return the sentence."""
        return self._written(self.kind.sentence)

    def words_for(self, name: str) -> str:
        """Return the words for the value of a number; empty if it has none."""
        value, words = self._value(name), self.kind.words[name]
        return self._written(words.get(str(value)) or words.get("given" if _is_given(value) else "absent", ""))

    def _written(self, text: str) -> str:
        """Return a text with what stands in braces; after a question mark a number's name stands for its words."""
        written = []
        for before, name, spec, _ in _FORMATTER.parse(text):
            written.append(before)
            if name is not None:
                of_words = name.startswith("?")
                written.append(self.words_for(name[1:]) if of_words else _formatted(self._value(name), spec or ""))
        return "".join(written)

    def _value(self, name: str) -> Any:
        return _FORMATTER.get_field(name, (), self.numbers)[0]


class _Numbers(dict[str, Any]):
    def __missing__(self, name: str) -> Any:
        return _COMPUTED[name](self)


_FORMATTER = Formatter()


def _formatted(value: Any, spec: str) -> str:
    name, _, rest = spec.partition(" ")
    if name in _FORMATS:
        return _FORMATS[name](value, rest)
    if "|" in spec:
        one, _, many = spec.partition("|")
        return one if value == 1 else many
    return format(value, spec)


def _is_given(value: Any) -> bool:
    return bool(value) and value == value  # NaN is not itself


def _counted(value: float | Sequence[Any], words: str) -> str:
    noun, _, verb = words.partition("/")
    return counted(len(value) if isinstance(value, Sequence) else value, noun, verb)


def _rounded(value: float | Sequence[float], significant: str) -> str:
    if isinstance(value, Sequence):
        return ", ".join(_rounded(item, significant) for item in value)
    return digits(float(f"{value:.{significant}g}"))


_FORMATS: Mapping[str, Callable[[Any, str], str]] = {
    "#": _counted,
    "ms": lambda value, spec: format(1e3 * value, spec),
    "%": lambda value, spec: format(100.0 * value, spec),
    "digits": _rounded,
    "first": lambda names, _: first_of(names),
    "list": lambda names, _: ", ".join(names),
    "quoted": lambda names, _: ", ".join(f"'{name}'" for name in names),
    "and": lambda values, _: " and ".join(map(str, values)),
    "cell": lambda text, _: repr(text[:40]),
}


def _percent(numbers: Mapping[str, Any]) -> str:
    share = numbers["count"] / numbers["rows"]
    return f"{100.0 * share:.2g}" if share < 0.1 else f"{100.0 * share:.0f}"


def _first_rows(numbers: Mapping[str, Any]) -> str:
    first = numbers["first"]
    return ", ".join(map(str, first)) + (", ..." if numbers["count"] > len(first) else "")


def _first_gaps(numbers: Mapping[str, Any]) -> str:
    gaps, more = numbers["first"], numbers["count"] - len(numbers["first"])
    shown = ", ".join(f"{gap['time']:.3f} s ({gap['length'] * 1e3:.0f} ms)" for gap in gaps)
    return f"{shown} and {more} more" if more > 0 else shown


def _new_zeros(numbers: Mapping[str, Any]) -> list[float]:
    return [leap["new_zero"] for leap in numbers["leaps"] if math.isfinite(leap["new_zero"])]


def _lateness(numbers: Mapping[str, Any]) -> str:
    offset = numbers["offset"]
    side, sign = ("late", 1.0) if offset >= 0.0 else ("early", -1.0)
    low, high = sorted(1e3 * sign * numbers[name] for name in ("low", "high"))
    places = 1 if high - low >= 1.0 else 2
    return "{} by {} ms ({} to {})".format(side, *_places((1e3 * abs(offset), low, high), places))


def _drift_ppm(numbers: Mapping[str, Any]) -> str:
    _, low, high = drift = numbers["drift"]
    places = 0 if high - low >= 2e-6 else 1
    return "{} ppm ({} to {})".format(*_places([1e6 * value for value in drift], places))


def _places(values: Sequence[float], places: int) -> list[str]:
    return [f"{round(value, places) + 0.0:.{places}f}" for value in values]  # + 0.0: no minus before a zero


def _kinds_of_contact(numbers: Mapping[str, Any]) -> str:
    if numbers["rests_on"] == "derivative":
        return ""
    return "one kind" if numbers["stiff"] is None or numbers["soft"] is None else "two kinds"


_COMPUTED: Mapping[str, Callable[[Mapping[str, Any]], Any]] = {
    "lines": lambda numbers: counted_lines(numbers["count"], numbers["first"], numbers["last"]),
    "percent": _percent,
    "first_rows": _first_rows,
    "first_gaps": _first_gaps,
    "wrap": lambda numbers: 2 ** numbers["restart"]["wrapped_bits"],
    "assumed_rate": lambda numbers: 1.0 / numbers["step"] if numbers["step"] > 0.0 else 0.0,
    "new_zeros": _new_zeros,
    "more_zeros": lambda numbers: len(_new_zeros(numbers)) - 1,
    "lost_span": lambda numbers: numbers["lost"]["time"][1] - numbers["lost"]["time"][0],
    "seen": lambda numbers: f"{numbers['answer']} {numbers['found']}",
    "unassessable": lambda numbers: len(numbers["not_assessable"]),
    "ahead": lambda numbers: numbers["onset"] - numbers["begin"],
    "axes": lambda numbers: len(numbers["rest"]),
    "is_cell": lambda numbers: numbers["rests_on"] != "derivative",
    "lateness": _lateness,
    "all_examined": lambda numbers: numbers["events"] >= numbers["examined"],
    "drift_ppm": _drift_ppm,
    "contacts": _kinds_of_contact,
}
