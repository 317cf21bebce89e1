"""Check a built site: every link inside it leads to a file and an anchor, and nothing is loaded from elsewhere."""

from __future__ import annotations

from dataclasses import dataclass, field
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

_LOADED = {("script", "src"), ("img", "src"), ("link", "href"), ("iframe", "src"), ("source", "src")}
# A link of the head that states an address and loads nothing.
_STATED = {"canonical", "next", "prev", "search", "index", "author", "copyright", "home"}


@dataclass
class _Page(HTMLParser):
    """The links of a page, those that the browser loads itself, and the anchors."""

    links: list[str] = field(default_factory=list)
    loaded: list[str] = field(default_factory=list)
    anchors: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        super().__init__()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Collect what an element links to, and its anchor."""
        given = {key: value or "" for key, value in attrs}
        self.anchors |= {given[key] for key in ("id", "name") if key in given}
        for key in ("href", "src"):
            if key not in given:
                continue
            self.links.append(given[key])
            if (tag, key) in _LOADED and given.get("rel", "") not in _STATED:
                self.loaded.append(given[key])


def broken_links(site: Path) -> list[str]:
    """Return one line per broken link, missing anchor, or file from another host, with the page."""
    pages = {}
    for file in (file for file in sorted(site.rglob("*.html")) if "_static" not in file.parts):
        pages[file.resolve()] = page = _Page()
        page.feed(file.read_text(encoding="utf-8"))
    faults = []
    for file, page in pages.items():
        name = file.relative_to(site.resolve()).as_posix()
        faults += [f"{name}: loads {text} from another host" for text in page.loaded if urlsplit(text).netloc]
        for text in dict.fromkeys(page.links):
            parts = urlsplit(text)
            if parts.scheme or parts.netloc or text == "#":
                continue
            linked = (file.parent / unquote(parts.path)).resolve() if parts.path else file
            linked = linked / "index.html" if linked.is_dir() else linked
            if not linked.exists():
                faults.append(f"{name}: {text}: no such file")
            elif parts.fragment and linked in pages and unquote(parts.fragment) not in pages[linked].anchors:
                faults.append(f"{name}: {text}: no such anchor")
    return faults
