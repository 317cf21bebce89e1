"""The pages of the documentation and their fenced blocks."""

from __future__ import annotations

import importlib.util
import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

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


def docs_script(name: str) -> ModuleType:
    """A script of docs/ as a module; docs is no package."""
    spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    assert spec and spec.loader
    sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(sys.modules[name])
    return sys.modules[name]
