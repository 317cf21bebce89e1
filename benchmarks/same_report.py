"""Compare two folders of reports word by word: the same results before and after a change of the code.

    python benchmarks/same_report.py OLD NEW [--show N]

OLD and NEW are written by `cdtool report results.json -o FOLDER` with the code before and after the change. For each
file it prints the phrases that were replaced and the number of numbers that were added. It exits with 1 if

* a file is missing, or a data file (JSON, CSV, traces) differs;
* a row, paragraph or heading of the old report has numbers that no single one of the new report has;
* a plot of the HTML page has a number that the new page does not have at the same place.

Each is matched with the most similar new one that has all its numbers and is not matched yet. Figures are compared by
their bytes, and a difference is only printed: a label may have changed.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from difflib import SequenceMatcher
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

# What a reader meets as one unit of the HTML page.
BLOCKS = ("tr", "p", "h1", "h2", "h3", "caption", "summary", "figcaption", "title", "li")
DATA = (".json", ".csv", ".gz")
_WORD = re.compile(r"[^\s|,;()“”\"*]+")
_NUMBER = re.compile(r"[-+]?\d[\d.]*(?:e[-+]?\d+)?%?|–")


@dataclass
class Difference:
    """What was found in one file: numbers gone and added, and replaced phrases with how often."""

    gone: list[str] = field(default_factory=list)
    added: Counter[str] = field(default_factory=Counter)
    replaced: Counter[str] = field(default_factory=Counter)


class Page(HTMLParser):
    """The texts of an HTML page by block, and its JSON data."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.blocks: list[str] = []
        self.data: list[Any] = []
        self._open: list[str] = []
        self._json = False
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._json = tag == "script" and dict(attrs).get("type") == "application/json"
        if tag in ("script", "style", *BLOCKS):
            self._open.append(tag)
            self.blocks += [""] * (tag in BLOCKS)

    def handle_endtag(self, tag: str) -> None:
        if self._open and self._open[-1] == tag:
            self._open.pop()

    def handle_data(self, data: str) -> None:
        if self._json:
            self.data.append(json.loads(data))
            self._json = False
        elif self._open and self._open[-1] in BLOCKS:
            self.blocks[-1] += f" {data}"


def blocks_of(path: Path) -> list[list[str]]:
    """Return the words of each row, paragraph and heading of a report."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".html":
        blocks = Page(text).blocks
    elif path.suffix == ".xml":
        cases = ElementTree.fromstring(text).iter()
        blocks = [" ".join([*item.attrib.values(), (item.text or "")]) for item in cases]
    else:
        blocks = [line for line in text.replace("\\", "").splitlines() if not re.fullmatch(r"[|: -]*", line)]
    return [words for words in (_words(block) for block in blocks) if words]


def plot_numbers(path: Path) -> Counter[tuple[str, str]]:
    """Return every number of the page's plots and traces with its place; tables are among the rows."""
    page = Page(path.read_text(encoding="utf-8"))
    return Counter(leaf for i, data in enumerate(page.data) for leaf in _leaves(data, str(i) if i else "plots"))


def compare(old: Sequence[list[str]], new: Sequence[list[str]]) -> Difference:
    """Return what differs between the blocks of two reports."""
    found, left = Difference(), list(new)
    for words in sorted(old, key=lambda words: (words not in left, not _numbers(words), -len(words))):
        match = _match(words, left)
        if match is None:
            if _numbers(words):
                found.gone.append(" ".join(words))
            else:
                found.replaced[f"(gone) {' '.join(words)}"] += 1
            continue
        left.remove(match)
        found.added.update(_numbers(match) - _numbers(words))
        found.replaced.update(_replaced(words, match))
    for words in left:
        found.replaced[f"(new) {' '.join(words)}"] += 1
    return found


def _words(text: str) -> list[str]:
    return [word.rstrip(".:") or word for word in _WORD.findall(text)]


def _numbers(words: Sequence[str]) -> Counter[str]:
    return Counter(word for word in words if _NUMBER.fullmatch(word))


def _match(words: list[str], candidates: Sequence[list[str]]) -> list[str] | None:
    """Return the most similar block that has all numbers of `words`; None if there is no such block."""
    if words in candidates:
        return words
    numbers = _numbers(words)
    fitting = [item for item in candidates if not numbers - _numbers(item)]
    shared = Counter(words)
    fitting.sort(key=lambda item: -sum((shared & Counter(item)).values()) / (len(words) + len(item)))
    best = max(fitting[:5], key=lambda item: SequenceMatcher(None, words, item, autojunk=False).ratio(), default=None)
    return best if best is not None and (numbers or set(words) & set(best)) else None


def _replaced(old: list[str], new: list[str]) -> Iterator[str]:
    for kind, a, b, c, d in SequenceMatcher(None, old, new, autojunk=False).get_opcodes():
        if kind != "equal":
            yield f"{' '.join(old[a:b]) or '(nothing)'} -> {' '.join(new[c:d]) or '(nothing)'}"


def _leaves(data: Any, place: str) -> Iterator[tuple[str, str]]:
    if isinstance(data, dict):
        for key, value in data.items():
            if (place, key) != ("plots", "tables"):
                yield from _leaves(value, f"{place}.{key}")
    elif isinstance(data, list):
        for i, value in enumerate(data):
            yield from _leaves(value, f"{place}.{i}")
    elif isinstance(data, int | float):
        yield place, f"{data}"


def differences(old: Path, new: Path) -> Iterator[tuple[str, Difference]]:
    """Yield each file of the old folder with what differs in the new one."""
    for path in sorted(old.iterdir()):
        other = new / path.name
        found = Difference()
        if not other.is_file():
            found.gone.append("the file")
        elif path.suffix in (".html", ".md", ".xml"):
            found = compare(blocks_of(path), blocks_of(other))
            if path.suffix == ".html":
                found.gone += [" ".join(leaf) for leaf in plot_numbers(path) - plot_numbers(other)]
        elif path.read_bytes() != other.read_bytes():
            found.gone += ["its content"] if path.suffix in DATA else []
            found.replaced["other bytes"] += path.suffix not in DATA
        yield path.name, found


def main() -> int:
    """Print the difference of two folders; return 1 if anything other than words is gone."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    parser.add_argument("--show", type=int, default=20, help="replaced phrases to print per file")
    options = parser.parse_args()
    failed = False
    for name, found in differences(options.old, options.new):
        failed |= bool(found.gone)
        words = "the same words" if not found.replaced else f"{len(found.replaced)} phrases replaced"
        numbers = f"{len(found.gone)} numbers gone" if found.gone else "no number gone"
        print(f"{name}: {words}; {numbers}, {sum(found.added.values())} added")
        for text in found.gone:
            print(f"  GONE {text}")
        for phrase, count in found.replaced.most_common(options.show):
            print(f"  {count:4d} x {phrase}")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
