"""Merge identical findings about many logs or channels into one, with a count."""

from __future__ import annotations

import re
from collections.abc import Sequence

from cdtool.evaluation.results import Skipped

# Up to this many are listed each; of more, only the first with this many names of the others.
_EACH, _NAMED = 3, 3
_NUMBERS = re.compile(r"[-+]?\d[\d.e+-]*")
_LISTED = re.compile(r"(#[^,;]*)(?:, \1)+(?: and # more|, \.\.\.)?")
_AS_PLURAL = {"is": "are", "has": "have"}


def grouped(items: Sequence[tuple[str, str]]) -> list[tuple[str, str]]:
    """Return names with texts in order of occurrence; texts that differ only in numbers are merged, with a count.

    >>> grouped([("a", "3 gaps"), ("b", "1 gap"), ("c", "9 gaps"), ("a", "stuck"), ("d", "2 gaps")])
    [('a', '3 gaps; 3 more like it (b, c, d)'), ('a', 'stuck')]
    """
    groups: dict[str, list[tuple[str, str]]] = {}
    for name, text in items:
        groups.setdefault(_words(text), []).append((name, text))
    found: list[tuple[str, str]] = []
    for (name, text), *others in groups.values():
        if len(others) < _EACH:
            found += [(name, text), *others]
            continue
        names = list(dict.fromkeys(other for other, _ in others if other not in ("", name)))
        listed = ", ".join(names[:_NAMED]) + (", ..." if len(names) > _NAMED else "")
        found.append((name, f"{text}; {len(others)} more like it{f' ({listed})' if listed else ''}"))
    return found


def _words(text: str) -> str:
    """The words of a text without its numbers, the length of its lists, and singular or plural."""
    bare = _LISTED.sub(r"\1", _NUMBERS.sub("#", text))
    return " ".join(_AS_PLURAL.get(word, word.rstrip("s")) for word in bare.split(" "))


def alike(items: Sequence[Skipped]) -> list[Skipped]:
    """Reasons, those that are alike once."""
    return [Skipped(name, reason) for name, reason in grouped([(item.recording, item.reason) for item in items])]
