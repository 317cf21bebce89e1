"""Check that a version can be released: `python .ci/release.py v0.1.0 [--notes FILE]`.

Prints every reason against it, one per line, and exits with 1; otherwise writes the notes of the release, which are the
section of the version in CHANGELOG.md.
"""

from __future__ import annotations

import argparse
import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
_TAG = re.compile(r"v(?P<version>\d+\.\d+\.\d+)")
_SECTION = re.compile(
    r"^## (?P<version>\d+\.\d+\.\d+) - (?P<date>\S+)\n(?P<text>.*?)(?=^## |\Z)", re.MULTILINE | re.DOTALL
)
_DATE = re.compile(r"\d{4}-\d{2}-\d{2}")


def problems(tag: str, root: Path) -> Iterator[str]:
    """The reasons why the files below `root` are not those of the release `tag`."""
    match = _TAG.fullmatch(tag)
    if match is None:
        yield f"{tag}: is not a tag as v1.2.3"
        return
    version = match["version"]
    sections = list(_SECTION.finditer(_text(root, "CHANGELOG.md")))
    if not sections or sections[0]["version"] != version:
        yield f"CHANGELOG.md: the first section is not '## {version} - DATE'"
    elif not _DATE.fullmatch(sections[0]["date"]):
        yield f"CHANGELOG.md: {version} has the date '{sections[0]['date']}'; write the day of the release"
    citation = dict(re.findall(r'^(version|date-released): "?([^"\n]*)"?$', _text(root, "CITATION.cff"), re.MULTILINE))
    if citation.get("version") != version:
        yield f"CITATION.cff: version is {citation.get('version')}, not {version}"
    if sections and citation.get("date-released") != sections[0]["date"]:
        yield f"CITATION.cff: date-released is {citation.get('date-released')}, not that in CHANGELOG.md"
    if not tomllib.loads(_text(root, "pyproject.toml"))["project"].get("urls"):
        yield "pyproject.toml: no [project.urls]; write the public address of the repository as Repository"


def notes(tag: str, root: Path) -> str:
    """The section of a tag's version in CHANGELOG.md, without its heading."""
    (found,) = [
        m["text"] for m in _SECTION.finditer(_text(root, "CHANGELOG.md")) if m["version"] == tag.removeprefix("v")
    ]
    return f"{found.strip()}\n"


def _text(root: Path, name: str) -> str:
    return (root / name).read_text(encoding="utf-8")


def main() -> int:
    """Return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tag")
    parser.add_argument("--notes", type=Path, help="file for the notes of the release")
    asked = parser.parse_args()
    found = list(problems(asked.tag, ROOT))
    for line in found:
        print(line, file=sys.stderr)
    if not found and asked.notes is not None:
        asked.notes.write_text(notes(asked.tag, ROOT), encoding="utf-8", newline="\n")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
