"""The documentation site: its navigation and generated pages; where the extra `docs` is installed, the built site."""

from __future__ import annotations

import re
import runpy
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest

from cdtool.commands.app import COMMANDS
from tests.project.pages import DOCS, PAGES, ROOT
from tests.report.html.test_html_in_browser import browser as browser
from tests.report.html.test_html_in_browser import pytestmark as in_browser

SITE = DOCS / "site"
TALLEST = 5100  # [px] of a page at a width of 1,400
# The page that a search for a word shows first.
EXPLAINS = {
    **dict.fromkeys(("false alarm", "latency", "onset", "missed", "not assessable"), "docs/evaluation.html"),
    "threshold": "docs/thresholds.html",
    "signature": "docs/signature.html",
    "protocol": "docs/protocol.html",
    "debounce": "docs/benchmark-file.html",
    "units": "docs/machine-file.html",
    "MCAP": "docs/recordings.html",
}


@pytest.fixture(scope="module")
def navigation() -> dict[str, Any]:
    return tomllib.loads((SITE / "navigation.toml").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def pages() -> dict[str, str]:
    written: dict[str, str] = runpy.run_path(str(SITE / "generated_pages.py"))["generated_pages"](
        DOCS / "results.schema.json"
    )
    return written


def test_the_navigation_names_every_page_once_and_only_pages_that_exist(navigation, pages):
    parts = [part for section in navigation["section"] for part in section["part"]]
    named = [name for part in parts for name in part["pages"]]
    assert len(named) == len(set(named))
    for name in named:
        assert name in pages or any((DOCS / f"{name}.{kind}").is_file() for kind in ("md", "ipynb")), name
    patterns = [item for items in navigation["below"].values() for item in items]
    reached = {(DOCS / f"{name}.md").resolve() for name in named}
    reached |= {file.resolve() for pattern in patterns for file in DOCS.glob(f"{pattern}.md")}
    missing = {page.resolve() for page in PAGES if page != ROOT / "README.md"} - reached
    assert not missing, f"add to docs/site/navigation.toml: {sorted(page.name for page in missing)}"


def test_every_command_and_option_is_on_its_page(pages):
    from typer.main import get_command

    root: Any = get_command(__import__("cdtool.commands.app", fromlist=["app"]).app)
    for name in COMMANDS:
        text = pages[f"reference/cli/{name}"]
        assert text.startswith(f"# cdtool {name}\n")
        for item in (item for item in root.commands[name].params if item.param_type_name == "option"):
            assert item.hidden or f"`{item.opts[0]}`" in text, (name, item.opts)
            assert item.hidden or item.help, (name, item.opts)
    assert all(f"[`cdtool {name}`]" in pages["reference/cli/index"] for name in COMMANDS)


def test_equations_are_written_as_github_and_the_site_render_them():
    blocks = [text for page in PAGES for text in re.findall(r"```math\n(.*?)```", page.read_text("utf-8"), re.DOTALL)]
    assert len(blocks) > 20
    latex2mathml = pytest.importorskip("docutils.utils.math.latex2mathml")
    for text in blocks:
        latex2mathml.tex2mathml(text.strip(), as_block=True)


@in_browser
def test_the_built_site_opens_with_a_report_and_its_search_with_what_explains_a_word(browser: Any, tmp_path: Path):
    for name in ("sphinx", "myst_parser", "pydata_sphinx_theme", "sphinx_design", "nbclient", "ipykernel"):
        pytest.importorskip(name)
    subprocess.run([sys.executable, DOCS / "make_site.py", "-o", tmp_path], check=True)
    size = {"width": 1400, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    browser.get((tmp_path / "index.html").as_uri())
    bottom = "return document.querySelector(arguments[0]).getBoundingClientRect().bottom"
    assert max(browser.execute_script(bottom, item) for item in (".live", "article img")) <= 900
    assert len(browser.find_elements("css selector", ".sd-card")) == 5  # a route for each person
    browser.implicitly_wait(20)
    for word, page in EXPLAINS.items():
        browser.get(f"{(tmp_path / 'search.html').as_uri()}?q={word}")
        first = browser.find_element("css selector", "#search-results li > a")
        assert first.get_dom_attribute("href").split("#")[0] == page, word
    for path in set(tmp_path.rglob("*.html")) - {tmp_path / "sample-report.html"}:
        browser.get(path.as_uri())
        assert browser.execute_script("return document.documentElement.scrollHeight") < TALLEST, path.name
