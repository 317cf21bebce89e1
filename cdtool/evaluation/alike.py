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
    """Merge texts that differ only in numbers, with a count.

    Parameters
    ----------
    items : sequence of (str, str)
        Names with texts.

    Returns
    -------
    list of (str, str)
        In order of occurrence; four or more similar texts become one.

    Examples
    --------
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
    """Return the words of a text without its numbers, the length of its lists, and singular or plural."""
    bare = _LISTED.sub(r"\1", _NUMBERS.sub("#", text))
    return " ".join(_AS_PLURAL.get(word, word.rstrip("s")) for word in bare.split(" "))


def alike(items: Sequence[Skipped]) -> list[Skipped]:
    """Merge reasons that differ only in numbers.

    Parameters
    ----------
    items : sequence of Skipped
        Recordings with reasons.

    Returns
    -------
    list of Skipped
        As `grouped` merges them.

    Examples
    --------
    >>> [str(item.reason) for item in alike([Skipped(name, f"{n} gaps") for n, name in enumerate("abcd", 1)])]
    ['1 gaps; 3 more like it (b, c, d)']
    """
    return [Skipped(name, reason) for name, reason in grouped([(item.recording, item.reason) for item in items])]
