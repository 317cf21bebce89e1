"""Make text from files or users safe for terminals, figures and reports."""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Sequence
from decimal import Decimal

# Control, format (direction marks), surrogate and private characters, line and paragraph separators.
_ACTIVE = frozenset(("Cc", "Cf", "Cs", "Co", "Zl", "Zp"))
# Length of one printed error, warning or note, including text from files [characters].
LINE_LENGTH = 300
#: Items of a list within a sentence: more make it too long to read.
NAMED = 3
#: Lines of a list on the screen or a page; one more counts the others.
LISTED = 10
_SINGULAR = {"are": "is", "were": "was", "have": "has"}
_NONCHARACTERS = frozenset("\ufffe\uffff")


def plain(text: object) -> str:
    """Return text with "?" instead of control characters or direction marks that a terminal or page would interpret."""
    given = str(text)
    if given.isprintable():  # the common case, and much faster
        return given
    return "".join("?" if _is_active(character) else character for character in given)


def one_line(text: object) -> str:
    """Return plain text on one line of at most 300 characters; an ellipsis marks omitted text."""
    return shorten_paths(plain(text), LINE_LENGTH)


def reason_line(word: str, name: str, reason: str) -> str:
    """Return why something was left out or noted, on one line: the name is shortened, not the reason."""
    room = LINE_LENGTH - len(f"{word}: : {plain(reason)}")
    return one_line(f"{word}: {shorten(plain(name), max(room, LINE_LENGTH // 10))}: {reason}")


def shorten(text: str, length: int) -> str:
    """Return the text, or its beginning and end with an ellipsis between them if it is longer than `length`."""
    if len(text) <= length:
        return text
    tail = (length - 1) // 2
    return f"{text[: length - 1 - tail]}…{text[len(text) - tail :]}"


def shorten_paths(text: str, length: int) -> str:
    """Shorten like `shorten`, but the paths in the text first, the longest ones to 30 characters, then the reason.

    >>> shorten_paths("/home/somebody/measurements/2026/gate/a.csv: no clock", 44)
    '/home/somebody/…026/gate/a.csv: no clock'
    """
    for word in sorted(text.split(), key=len, reverse=True):
        if len(text) > length and ("/" in word or "\\" in word):
            path = word.strip("():,;'")
            text = text.replace(path, shorten(path, 30))
    return shorten(text, length)


def shorten_names(text: str, length: int) -> str:
    """Shorten like `shorten`, but keep whole names of a list after "known: ", with the number of omitted names.

    >>> shorten_names("did you mean two? known: one, two, three, four", 42)
    'did you mean two? known: one and 3 more'
    """
    head, known, listed = text.partition("known: ")
    names = listed.split(", ")
    for count in range(len(names) - 1, 0, -1) if known and len(text) > length else ():
        shown = f"{head}{known}{', '.join(names[:count])} and {len(names) - count} more"
        if len(shown) <= length:
            return shown
    return shorten(text, length)


def digits(value: float, least: int = 6) -> str:
    """Return a number with `least` significant digits, an integer with all digits; never an exponent."""
    if not math.isfinite(value) or value == 0.0:
        return f"{value:g}"
    before_point = math.floor(math.log10(abs(value))) + 1
    return f"{Decimal(f'{value:.{max(least, before_point)}g}'):f}"


def digits_beside(value: float, limit: float, least: int = 4) -> int:
    """Return how many significant digits, at least `least`, show on which side of a limit a value is.

    >>> digits_beside(412.345, 400.0), digits_beside(400.04, 400.0), digits_beside(400.0, 400.0)
    (4, 5, 4)
    """

    def side(number: float) -> int:
        return (number > limit) - (number < limit)

    rounded = {count: float(f"{value:.{count}g}") for count in range(least, 18)}
    shown = (count for count in rounded if count <= least + 6 and side(rounded[count]) == side(value))
    above = (count for count in rounded if (rounded[count] > limit) == (value > limit))
    return next(shown, next(above, 17))


def counted(count: float, thing: str, verb: str = "") -> str:
    """Return a number with its noun and, if given in the plural, its verb.

    >>> counted(1, "hour"), counted(2.5, "hour"), counted(2, "entry")
    ('1 hour', '2.5 hours', '2 entries')
    >>> counted(1, "value", "are"), counted(2, "value", "are"), counted(1, "stamp", "repeat")
    ('1 value is', '2 values are', '1 stamp repeats')
    """
    if count != 1:
        return " ".join([digits(count), plural(thing), *verb.split()])
    first, *rest = verb.split() or [""]
    return " ".join([digits(count), thing, *([_SINGULAR.get(first, f"{first}s"), *rest] if first else [])])


def ordinal(number: int) -> str:
    """Return "2nd", "3rd", "11th" or "21st".

    >>> [ordinal(number) for number in (1, 2, 3, 4, 11, 12, 22)]
    ['1st', '2nd', '3rd', '4th', '11th', '12th', '22nd']
    """
    ending = "th" if 10 <= number % 100 <= 20 else {1: "st", 2: "nd", 3: "rd"}.get(number % 10, "th")
    return f"{number}{ending}"


def first_of(names: Sequence[str]) -> str:
    """Return the first three names of a list, and how many more there are.

    >>> first_of(["a", "b"]), first_of(["a", "b", "c", "d", "e"])
    ('a, b', 'a, b, c and 2 more')
    """
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return f"{', '.join(names[:NAMED])}{more}"


def shown_lines(numbers: Sequence[int]) -> str:
    """Return the numbers of lines of a file in words.

    >>> shown_lines([3]), shown_lines([1, 2, 3]), shown_lines([3, 9, 12, 20])
    ('line 3', 'lines 1 to 3', '4 lines (3, 9, 12, ...)')
    """
    return counted_lines(len(numbers), numbers[:NAMED], numbers[-1])


def counted_lines(count: int, first: Sequence[int], last: int) -> str:
    """Return the same of so many lines, of which the `first` three and the `last` one are known."""
    if count == 1:
        return f"line {last}"
    if last - first[0] == count - 1:
        return f"lines {first[0]} to {last}"
    listed = ", ".join(map(str, first))
    return f"{counted(count, 'line')} ({listed}{', ...' if count > len(first) else ''})"


def plural(thing: str) -> str:
    """Return the plural of a noun: "hours", "entries", "losses"."""
    if thing.endswith("y") and thing[-2:-1] not in "aeiou":
        return f"{thing[:-1]}ies"
    return f"{thing}es" if thing.endswith(("s", "x", "ch", "sh")) else f"{thing}s"


def _is_active(character: str) -> bool:
    return character in _NONCHARACTERS or unicodedata.category(character) in _ACTIVE
