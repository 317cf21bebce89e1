"""What a screen reader needs of a table: a name, headings of the columns, a heading in each row."""

from __future__ import annotations

import re


def unnamed(page: str) -> list[str]:
    """Return the tables and rows of a page without one of them; there is at least one table."""
    tables = re.findall(r"<table([^>]*)>(.*?)</table>", page, re.DOTALL)
    assert tables
    found = [
        attributes for attributes, content in tables if "<caption>" not in content and "labelledby" not in attributes
    ]
    for _, content in tables:
        head, _, body = content.rpartition("</thead>")
        if head.count('<th scope="col"') != head.count("<th "):
            found.append(head)
        rows = re.findall(r"<tr.*?</tr>", body, re.DOTALL)
        found += [row for row in rows if not row.count('<th scope="row') == row.count("<th") == 1]
    return found
