"""The text of TOML files: drafts in lines that fit a terminal, and changes to what a person wrote."""

from __future__ import annotations

from textwrap import wrap
from typing import Any

#: Width of a terminal [characters].
_WIDEST = 80


def commented(line: str, comment: str) -> list[str]:
    """Return a line with its comment after it, or before it if both are too long for one line."""
    joined = f"{line}  # {comment}"
    return [line] if not comment else [joined] if len(joined) <= _WIDEST else [*comment_lines(comment), line]


def comment_lines(text: str, indent: str = "", more: str = "") -> list[str]:
    """Return a comment in lines that fit a terminal; `more` indents those after the first further.

    >>> comment_lines("CHECK: " + "word " * 16)[1]
    '# word word'
    """
    made = wrap(text, _WIDEST - len(indent) - 2, subsequent_indent=more, break_long_words=False, break_on_hyphens=False)
    return [f"# {indent}{line}" for line in made]


def opened_table(document: Any, *names: str) -> Any:
    """Return the section under these names; one on a single line in braces is spread first: it cannot hold comments."""
    import tomlkit
    from tomlkit.items import InlineTable

    table = document
    for name in names:
        if name not in table:
            table[name] = tomlkit.table(is_super_table=name in ("model", "detectors"))
        elif isinstance(table[name], InlineTable):
            content, comment = table[name].unwrap(), table[name].trivia.comment.strip("# ")
            table.remove(name)
            table.append(name, tomlkit.item(content))  # last: keys below it would become its own
            if comment:
                table[name].comment(comment)
        table = table[name]
    return table
