"""Build the documentation site: copy the pages, add the generated ones, run Sphinx strictly, check the links.

    pip install '.[docs]'
    python docs/make_site.py                       # into build/site; open build/site/index.html
    python docs/make_site.py --version 0.1 --switcher ../switcher.json -o site/0.1

`docs/site/navigation.toml` is the navigation. A page that it does not name fails the build, and so does every warning,
every broken link or anchor, and every file that a page would load from another host.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import runpy
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from cdtool import benchmark

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
SITE = DOCS / "site"
# Files outside docs/ that pages link to; the Markdown files among them are pages of the site.
OUTSIDE = ("CONTRIBUTING.md", "CHANGELOG.md", "LICENSE", "README.md")
SAMPLES = ROOT / "sample_logs"


def stage(target: Path, source_url: str) -> None:
    """Copy the pages to a new folder, in which Sphinx reads them, with the generated pages and the navigation.

    `source_url` is where the repository's files are shown, for links to files that are not pages; empty if unknown.
    """
    shutil.copytree(DOCS, target / "docs", ignore=shutil.ignore_patterns("*.py", "site", "__pycache__"))
    for name in OUTSIDE:
        shutil.copy(ROOT / name, target / name)
    for page in SAMPLES.rglob("README.md"):
        copy = target / page.relative_to(ROOT)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(page, copy)
    (target / "_static").mkdir()
    shutil.copy(SITE / "style.css", target / "_static")
    shutil.copy(SITE / "conf.py", target)
    order = (SITE / "search_order.js").read_text(encoding="utf-8")
    (target / "search_order.js").write_text(f"var EXPLAINED = {json.dumps(_explained())};\n{order}", encoding="utf-8")
    shutil.copy(SITE / "folds.js", target / "_static")
    (target / "_static" / "fonts").mkdir()
    fonts = Path(str(files("ziamath"))) / "fonts"
    shutil.copy(fonts / "STIXTwoMath-Regular.ttf", target / "_static" / "fonts")
    pages = runpy.run_path(str(SITE / "generated_pages.py"))["generated_pages"](DOCS / "results.schema.json")
    for name, text in pages.items():
        file = target / "docs" / f"{name}.md"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    notebook = runpy.run_path(str(SITE / "notebook_page.py"))
    for file in (DOCS / "examples").glob("*.ipynb"):
        notebook["write_page"](file, target / "docs" / "examples" / f"{file.stem}.md")
    (target / "_extra").mkdir()
    benchmark(SAMPLES / "gate" / "benchmark.toml", jobs=2).save(target / "_extra" / "sample-report.html")
    with (SITE / "navigation.toml").open("rb") as file:
        add_navigation(target, tomllib.load(file))
    (target / "README.md").unlink()  # the front page takes its place
    for page in target.rglob("*.md"):
        page.write_text(_with_links(page, target, source_url), encoding="utf-8")


def add_navigation(target: Path, navigation: Mapping[str, Any]) -> None:
    """Write the front page and the pages of the sections, and let pages list those below them."""
    known = _descriptions()
    sections = navigation["section"]
    for section in sections:
        text = [f"# {section['title']}\n", f"{section['text']}\n"]
        for part in section["part"]:
            names = part["pages"]
            shown = [*names, *part.get("also", ())]  # pages of another part are in the table, not below this one
            rows = "".join(f"| [{_title(target, name)}]({name}.md) | {known.get(name, '')} |\n" for name in shown)
            is_gallery = section["name"] == "gallery"
            table = _pictures(target) if is_gallery else f"| page | contents |\n|---|---|\n{rows}"
            text += [f"## {part['title']}\n", table, _toctree(names, part["title"])]
        (target / "docs" / f"{section['name']}.md").write_text("\n".join(text), encoding="utf-8")
    for parent, patterns in navigation["below"].items():
        page = target / "docs" / f"{parent}.md"
        below = _gathered(target, patterns, [parent])
        inside = [os.path.relpath(target / "docs" / name, page.resolve().parent) for name in below]
        with page.open("a", encoding="utf-8") as file:
            file.write("\n" + _toctree(inside, ""))
    front = (SITE / "front_page.txt").read_text(encoding="utf-8")
    (target / "index.md").write_text(
        front + _toctree([f"docs/{item['name']}" for item in sections], ""), encoding="utf-8"
    )


def _gathered(target: Path, patterns: Iterable[str], given: Sequence[str]) -> list[str]:
    """Return the pages that match the patterns, in the order of these, without those that are given."""
    docs = target / "docs"
    found = [
        os.path.relpath(file, docs).removesuffix(".md").replace(os.sep, "/")
        for pattern in patterns
        for file in sorted(docs.glob(f"{pattern}.md"))
    ]
    return [name for name in dict.fromkeys(found) if name not in given]


def _toctree(names: Sequence[str], caption: str) -> str:
    lines = [":hidden:", *([f":caption: {caption}"] if caption else []), "", *names]
    return "```{toctree}\n" + "\n".join(lines) + "\n```\n" if names else ""


def _title(target: Path, name: str) -> str:
    text = (target / "docs" / f"{name}.md").read_text(encoding="utf-8")
    heading = re.search(r"^# (.*)$", text, re.MULTILINE)
    assert heading, f"{name}: has no heading"
    return heading[1]


def _descriptions() -> dict[str, str]:
    """Return what docs/index.md says of each page."""
    text = (DOCS / "index.md").read_text(encoding="utf-8")
    own = {
        "reference/cli/index": "every command with its options, generated from the code",
        "reference/python/index": "every function and class, generated from the docstrings",
        "reference/results": "every field of `results.json`, generated from the schema",
        "detectors/index": "one page per detector: signal, equation, gains, when it fails",
        "../CONTRIBUTING": "set up, tests, code, language, and how to build this site",
        "../CHANGELOG": "what changed for users",
        "../sample_logs/README": "the recordings that come with cdtool: simulated ones, and those of a real robot",
        "examples/gate": "a notebook: learn, detect, compare, with tables and figures",
        "index": "all pages in one list",
    }
    row = re.compile(r"^\| \[[^\]]*\]\(([\w/.-]+)\.md\) \| (.*) \|$", re.MULTILINE)
    examples = row.findall((DOCS / "gallery" / "index.md").read_text(encoding="utf-8"))
    return {**{f"gallery/{name}": about for name, about in examples}, **dict(row.findall(text)), **own}


def _explained() -> dict[str, str]:
    """Return the page that explains each word of the glossary: the one that its row links, or the glossary itself."""
    text = (DOCS / "glossary.md").read_text(encoding="utf-8")
    found = {}
    for words, meaning in re.findall(r"^\| \*\*(.+?)\*\* \| (.*) \|$", text, re.MULTILINE):
        link = re.search(r"\]\(([\w/-]+)\.md", meaning)
        found |= dict.fromkeys(words.lower().split(", "), f"docs/{link[1] if link else 'glossary'}")
    return found


def _pictures(target: Path) -> str:
    """Return a card for every page with a raster picture: its title, a thumbnail, and where it has the others."""
    cards = []
    docs = target / "docs"
    pages = [file.relative_to(docs).as_posix().removesuffix(".md") for file in sorted(docs.rglob("*.md"))]
    pages.sort(key=lambda name: not name.startswith(("examples/", "gallery/")))
    for name in pages:
        shown = re.findall(r"!\[[^\]]*\]\(([^)\s]+\.png)\)", (docs / f"{name}.md").read_text(encoding="utf-8"))
        if shown:
            place = os.path.relpath((docs / name).parent.resolve() / shown[0], docs.resolve())
            more = f"{len(shown)} pictures" if len(shown) > 1 else ""
            cards.append(
                f":::{{grid-item-card}} {_title(target, name)}\n:img-top: {place}\n:link: {name}\n:link-type: doc\n"
                f":class-card: thumbnail\n{more}\n:::\n"
            )
    return "::::{grid} 1 2 3 4\n:gutter: 3\n\n" + "\n".join(cards) + "::::\n"


def _with_links(page: Path, target: Path, source_url: str) -> str:
    """Return a page whose links to files that are not part of the site lead to the repository, or are text."""

    def linked(match: re.Match[str]) -> str:
        text, place, anchor = match["text"], match["place"], match["anchor"] or ""
        if re.match(r"[a-z]+:", place) or not place:
            return match[0]
        file = (page.parent / place).resolve()
        inside = file.is_relative_to(target.resolve())
        if file.suffix == ".ipynb":  # shown as a page
            return f"{text}({place.removesuffix('.ipynb')}.md)"
        if (
            inside
            and (file.suffix in (".md", ".png", ".svg") or file.name == "results.schema.json")
            and file.exists()
            and file != target.resolve() / "README.md"
        ):
            return match[0]
        relative = file.relative_to(target.resolve()).as_posix() if inside else ""
        if relative == "README.md":
            return f"{text}({os.path.relpath(target / 'index.md', page.parent)})"
        assert inside and (ROOT / relative).exists(), f"{page.relative_to(target)}: {place} does not exist"
        return f"{text}({source_url}{relative}{anchor})" if source_url else text[1:-1]

    parts = re.split(r"(^```.*?^```$)", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    links = re.compile(r"(?P<text>!?\[[^\]]*\])\((?P<place>[^)\s#]*)(?P<anchor>#[^)\s]*)?\)")
    return "".join(part if i % 2 else links.sub(linked, part) for i, part in enumerate(parts))


def build(source: Path, output: Path, builder: str, environment: Mapping[str, str], *, strict: bool = True) -> int:
    """Run Sphinx and return its exit status."""
    options = ["-W", "--keep-going"] if strict else []
    line = [sys.executable, "-m", "sphinx", "-q", "-b", builder, "-j", "2", *options]
    shutil.rmtree(output, ignore_errors=True)
    return subprocess.run([*line, str(source), str(output)], env={**os.environ, **environment}).returncode


def main() -> int:
    """Build and check the site; return 1 if Sphinx warns or a link is broken."""
    parser = argparse.ArgumentParser(description="Build the documentation site.")
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "build" / "site")
    parser.add_argument("--version", default="main", help="the version that the site states")
    parser.add_argument("--switcher", default="", help="where the list of versions will be, from the site's root")
    parser.add_argument("--source-url", default="", help="where files of the repository are shown; default: no links")
    parser.add_argument("--external", action="store_true", help="check the links to other sites instead")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "source"
        source.mkdir()
        stage(source, given.source_url)
        environment = {"CDTOOL_DOCS_VERSION": given.version}
        if given.switcher:
            environment["CDTOOL_DOCS_SWITCHER"] = given.switcher
        if given.external:
            return build(source, Path(folder) / "links", "linkcheck", environment, strict=False)
        if status := build(source, given.output, "html", environment):
            return status
    broken = runpy.run_path(str(SITE / "check_links.py"))["broken_links"](given.output)
    for text in broken:
        print(text)
    print(f"{given.output}: {len(list(given.output.rglob('*.html')))} pages, {len(broken)} broken links")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
