"""Change the text of a TOML file that a person wrote: comments and order stay."""

from __future__ import annotations

from typing import Any


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
