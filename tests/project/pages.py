"""The pages of the documentation and their fenced blocks."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
FENCE = re.compile(
    r"^(?:<!-- exit (?P<status>\d) -->\n)?```(?P<kind>\w+)\n(?P<body>.*?)^```$", re.MULTILINE | re.DOTALL
)


def name_of(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def toml_blocks(page: Path) -> list[str]:
    """The TOML examples of a page, in its order."""
    return [block["body"] for block in FENCE.finditer(page.read_text(encoding="utf-8")) if block["kind"] == "toml"]


def machine_files(page: Path = DOCS / "machine-file.md") -> Iterator[tuple[str, str]]:
    """Each whole machine file that a page shows: the machine's type and the text."""
    for text in toml_blocks(page):
        if "[machine]" in text:
            yield tomllib.loads(text)["machine"]["type"], text
