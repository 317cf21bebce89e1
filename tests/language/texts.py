"""The texts of a file that people read: strings, comments and names of Python; Markdown without its code."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator

# Strings and comments of Python. A test compares them with those of tokenize, which takes ten times as long.
_TOKEN = re.compile(
    r"""(?P<prefix>\b[rbuf]{1,2})?(?P<quote>'''|\"""|'|")
        (?P<body>(?:(?<=''')[^'\\]*(?:(?:\\.|'(?!''))[^'\\]*)*
                   |(?<=\"\"")[^"\\]*(?:(?:\\.|"(?!""))[^"\\]*)*
                   |(?<!'')(?<=')[^'\\\n]*(?:\\.[^'\\\n]*)*
                   |(?<!"")(?<=")[^"\\\n]*(?:\\.[^"\\\n]*)*))(?P=quote)
        |\#(?P<comment>[^\n]*)""",
    re.IGNORECASE | re.DOTALL | re.VERBOSE,
)
_DEFINED = re.compile(
    r"(?:\b(?:def|class|for|as) |^[ \t]*(?=\w+(?::| = ))|[(,]\s*\**(?=\w+: ))([A-Za-z_]\w*)", re.MULTILINE
)
_FIELD = re.compile(r"\{\{|\}\}|\{((?:[^{}]|\{[^{}]*\})*)\}")
_BETWEEN_WORDS = re.compile(r"(?<=[a-z0-9])(?=[A-Z])|_+")
_FENCE = re.compile(r"^(```+|~~~+)[^\n]*\n.*?^\1[^\n]*$", re.MULTILINE | re.DOTALL)
_NOT_PROSE = re.compile(r"`[^`\n]+`|(?<=\]\()[^)\s]+|<!--.*?-->|https?://\S+", re.DOTALL)


class Prose:
    """Texts joined into one, each begun by a NUL, in which every character knows where in the file it is from."""

    def __init__(self) -> None:
        self._parts: list[str] = []
        self._starts: list[int] = []
        self._sources: list[int] = []
        self._length = 0

    def add(self, text: str, source: int, *, begins: bool = True) -> None:
        """Append `text`, found at character `source` of the file; `begins`: as a text of its own."""
        self._starts.append(self._length)
        self._sources.append(source - 2 * begins)
        self._parts.append("\n\0" + text if begins else text)
        self._length += len(self._parts[-1])

    def joined(self) -> str:
        """Return all texts."""
        return "".join(self._parts)

    def source(self, index: int) -> int:
        """Return which character of the file became character `index` of the joined text."""
        part = bisect_right(self._starts, index) - 1
        return self._sources[part] + index - self._starts[part]


def strings_and_comments(source: str) -> Iterator[re.Match[str]]:
    """Yield the strings and comments of Python source in their order, with `prefix`, `quote`, `body` or `comment`."""
    return _TOKEN.finditer(source)


def python_prose(source: str) -> Prose:
    """Return strings, comments and defined names of Python source, adjacent strings and comment lines joined."""
    prose = Prose()
    end, last = 0, ""
    for token in strings_and_comments(source):
        _add_names(prose, source, end, token.start())
        kind = "comment" if token["quote"] is None else "body"
        text = token[kind]
        if "f" in (token["prefix"] or "").lower():
            text = _FIELD.sub(_hide_field, text)
        own_line = kind == "body" or not source[source.rfind("\n", 0, token.start()) + 1 : token.start()].strip()
        joins = kind == last and own_line and not source[end : token.start()].strip()
        prose.add(text, token.start(kind), begins=not joins)
        end, last = token.end(), kind
    _add_names(prose, source, end, len(source))
    return prose


def _add_names(prose: Prose, source: str, begin: int, end: int) -> None:
    for defined in _DEFINED.finditer(source, begin, end):
        words = _BETWEEN_WORDS.sub(" ", defined[1].strip("_"))
        if " " in words:
            prose.add(words, defined.start(1))


def _hide_field(found: re.Match[str]) -> str:
    return found[0] if found[1] is None else "{" + "§" * len(found[1]) + "}"


def markdown_prose(source: str) -> Prose:
    """Return the text of Markdown: code, addresses and HTML comments are replaced by a sign of the same length."""
    prose = Prose()
    text = _FENCE.sub(_blank, source)
    prose.add(_NOT_PROSE.sub(_blank, text), 0)
    return prose


def _blank(found: re.Match[str]) -> str:
    return re.sub(r"[^\n]", "¤", found[0])
