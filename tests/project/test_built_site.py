"""The documentation site as it is built, in a browser: its first screen, its search, the height of its pages."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.project.pages import DOCS
from tests.report.html.test_html_in_browser import browser as browser
from tests.report.html.test_html_in_browser import pytestmark as pytestmark

TALLEST = 5500  # [px] at a width of 1,400
# The page that explains a word comes first when a reader searches for it.
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
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    for name in ("sphinx", "myst_parser", "pydata_sphinx_theme", "sphinx_design", "nbclient", "ipykernel"):
        pytest.importorskip(name)
    folder = tmp_path_factory.mktemp("built") / "site"
    done = subprocess.run([sys.executable, DOCS / "make_site.py", "-o", folder], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def test_the_site_opens_with_a_report_and_its_search_with_what_explains_a_word(site: Path, browser: Any):
    size = {"width": 1400, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    browser.get((site / "index.html").as_uri())
    seen = "return document.querySelector(arguments[0]).getBoundingClientRect().bottom"
    assert max(browser.execute_script(seen, item) for item in (".live", "article img")) <= 900
    assert len(browser.find_elements("css selector", ".sd-card")) == 5  # a route for each person
    first = "return document.querySelector('#search-results li > a')?.getAttribute('href').split('#')[0]"
    found = {}
    browser.implicitly_wait(20)
    for word in EXPLAINS:
        browser.get(f"{(site / 'search.html').as_uri()}?q={word}")
        browser.find_element("css selector", "#search-results li > a")
        found[word] = browser.execute_script(first)
    assert found == EXPLAINS
    height = "return document.documentElement.scrollHeight"
    pages = [path for path in site.rglob("*.html") if path.name != "sample-report.html"]
    tall = {path.name: size for path in pages if (browser.get(path.as_uri()), size := browser.execute_script(height))}
    assert len(tall) > 50 and not {name: size for name, size in tall.items() if size > TALLEST}
