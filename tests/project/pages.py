"""The pages of the documentation and their fenced blocks."""

from __future__ import annotations

import importlib.util
import re
import sys
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
# A recipe that is installed for its tests adds its page.
MACHINE_PAGES = [DOCS / "machine-file.md"]
MACHINE_EXAMPLES = [DOCS / "examples" / "planar_arm.toml", DOCS / "examples" / "scara.toml"]
FENCE = re.compile(
    r"^(?:<!-- exit (?P<status>\d) -->\n)?```(?P<kind>\w+)\n(?P<body>.*?)^```$", re.MULTILINE | re.DOTALL
)


def name_of(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def toml_blocks(page: Path) -> list[str]:
    """The TOML examples of a page, in its order."""
    return [block["body"] for block in FENCE.finditer(page.read_text(encoding="utf-8")) if block["kind"] == "toml"]


def machine_files() -> Iterator[tuple[str, str]]:
    """Each whole machine file that docs/machine-file.md shows or links: the machine's type and the text."""
    shown = [text for page in MACHINE_PAGES for text in toml_blocks(page) if "[machine]" in text]
    for text in [*shown, *(file.read_text(encoding="utf-8") for file in MACHINE_EXAMPLES)]:
        yield tomllib.loads(text)["machine"]["type"], text


def check_detector_page(detector: Mapping[str, Any], text: str) -> None:
    """Assert that a page says what `cdtool list detectors --json` says of its detector, under the usual headings."""
    assert f"`{detector['name']}`" in text and f"`{detector['short_name']}`" in text
    for channel in detector["needs"]:
        assert re.search(rf"Needs:[^.]*`{channel}`", text), (detector["name"], channel)
    for part in ("## Equation", "## Signal", "## Gains", "## Start-up and not applicable", "## When it fails"):
        assert part in text, (detector["name"], part)
    rows = [[cell.strip() for cell in line.split("|")[1:4]] for line in text.splitlines() if line.startswith("| `")]
    stated = {row[0].strip("`"): (float(row[1]), row[2]) for row in rows}
    assert stated == {gain["name"]: (gain["default"], gain["unit"]) for gain in detector["gains"]}, detector["name"]


def docs_script(name: str) -> ModuleType:
    """A script of docs/ as a module; docs is not a package."""
    return script_at(DOCS / f"{name}.py")


def benchmark_script(name: str) -> ModuleType:
    """A script of benchmarks/ as a module; benchmarks is not a package."""
    return script_at(ROOT / "benchmarks" / f"{name}.py")


def script_at(path: Path) -> ModuleType:
    """A script as a module under its own name, which dataclasses look up; it can import from its folder."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    kept = list(sys.path)
    sys.path.insert(0, str(path.parent))
    sys.modules[path.stem] = module
    try:
        spec.loader.exec_module(module)
    finally:
        sys.path[:] = kept
    return module
