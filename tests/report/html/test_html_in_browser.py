"""The HTML report in a real browser, without network."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from cdtool.base.plain_text import plain
from cdtool.report import many
from cdtool.report.html.page import to_html
from cdtool.report.writers.base import Report
from tests.report.hostile import HOSTILE
from tests.report.html.html_case import case
from tests.report.many import LIMITS, report_of_many

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
DRIVER = shutil.which("chromedriver")
FLAGS = (
    *("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync"),
    *("--disable-background-networking", "--disable-component-update", "--disable-dev-shm-usage", "--hide-scrollbars"),
)

pytestmark = pytest.mark.skipif(
    not (CHROMIUM and DRIVER), reason="Chromium or chromedriver is absent: the HTML report was not checked"
)


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    webdriver = pytest.importorskip("selenium.webdriver")
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = str(CHROMIUM)
    for flag in (*FLAGS, f"--user-data-dir={tmp_path_factory.mktemp('profile')}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(str(DRIVER)))
    yield driver
    driver.quit()


@pytest.fixture
def shown(browser: Any, tmp_path: Path) -> Callable[..., Any]:
    """Open a report at a width of the window [px]."""

    def show(text: str, width: int = 1400) -> Any:
        path = tmp_path / "report.html"
        path.write_text(text, encoding="utf-8")
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        browser.get(path.as_uri())
        return browser

    return show


def all_of(browser: Any, selector: str) -> list[Any]:
    found: list[Any] = browser.find_elements("css selector", selector)
    return found


def texts(browser: Any, selector: str) -> list[str]:
    script = "return [...document.querySelectorAll(arguments[0])].map((item) => item.textContent)"
    found: list[str] = browser.execute_script(script, selector)
    return found


def drawn_range(browser: Any, selector: str = "#viewer-plot") -> tuple[float, float]:
    """Return the range of the plot's axis; a zoom is drawn with the next frame."""
    browser.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
    element = all_of(browser, selector)[0]
    return float(element.get_attribute("data-from")), float(element.get_attribute("data-to"))


def drag(browser: Any, element: Any, begin: float, end: float) -> None:
    """Drag from one share of an element's width to another."""
    from selenium.webdriver.common.action_chains import ActionChains

    browser.execute_script("arguments[0].scrollIntoView({ block: 'center' })", element)
    width = element.size["width"]
    chain = ActionChains(browser, duration=20)
    chain.move_to_element_with_offset(element, int((begin - 0.5) * width), 0).click_and_hold()
    chain.move_by_offset(int((end - begin) * width), 0).release().perform()


def press(element: Any, keys: str) -> None:
    element.send_keys(keys)


def test_the_page_loads_without_errors_and_draws_every_plot(shown):
    browser = shown(to_html(Report(*case())))
    assert browser.get_log("browser") == []
    kinds = [item.get_attribute("data-plot") for item in all_of(browser, "svg[data-plot]")]
    assert kinds == ["latency"] * 2 + ["survival"] * 2 + ["amoc"] * 2 + ["force"] * 2
    drawn = (
        "return [...document.querySelectorAll('svg[data-plot]')].map((item) => item.querySelectorAll('path').length)"
    )
    assert all(count > 5 for count in browser.execute_script(drawn))
    paths = "return [...document.querySelectorAll('[d]')].map((item) => item.getAttribute('d'))"
    assert not [path for path in browser.execute_script(paths) if any(word in path for word in ("NaN", "Inf", "und"))]
    requests = "return performance.getEntriesByType('resource').map((item) => item.name)"
    assert browser.execute_script(requests) == []


def test_a_click_on_a_recording_shows_its_trigger_plot(shown):
    browser = shown(to_html(Report(*case())))
    row = next(
        item for item in all_of(browser, '.paged[data-table="recordings-table"] tr.opens') if "02.csv" in item.text
    )
    browser.execute_script("arguments[0].scrollIntoView({ block: 'center' }); arguments[0].click()", row)
    assert texts(browser, "#viewer-title") == ["stiff/02.csv"]
    assert browser.switch_to.active_element.get_attribute("id") == "viewer-title"
    assert len(all_of(browser, "#viewer-plot path.line")) == 2
    assert len(all_of(browser, "#viewer-plot path.force")) == 1
    words = texts(browser, "#viewer-plot text")
    assert "30.0 ms" in words and "missed" in words
    assert texts(browser, "#viewer-why strong") == ["quick", "slow"]
    assert texts(browser, "#viewer-why p") == ["the torque moved first"] * 2
    assert "stiff/02.csv" in texts(browser, "tr.open")[0]


def test_dragging_keys_and_buttons_change_the_range_that_is_drawn(shown):
    browser = shown(to_html(Report(*case())))
    plot = all_of(browser, "#viewer-plot")[0]
    home = drawn_range(browser)
    assert home == pytest.approx((1.9, 2.5))
    drag(browser, plot, 0.4, 0.6)
    low, high = drawn_range(browser)
    assert home[0] < low < high < home[1] and high - low == pytest.approx(0.2 * (home[1] - home[0]), rel=0.1)
    press(plot, "0")
    assert drawn_range(browser) == pytest.approx(home)
    press(plot, "+")
    near = drawn_range(browser)
    assert near[1] - near[0] == pytest.approx((home[1] - home[0]) / 1.5)
    press(plot, "\ue014")  # the right arrow
    assert drawn_range(browser)[0] > near[0]
    all_of(browser, '[data-do="whole"]')[0].click()
    assert drawn_range(browser) == pytest.approx((0.0, 4.0))
    press(plot, "-")
    assert drawn_range(browser) == pytest.approx((0.0, 4.0))


def test_recordings_are_paged_searched_and_filtered(shown):
    browser = shown(to_html(Report(*case())))
    table = '.paged[data-table="recordings-table"]'
    assert len(all_of(browser, f"{table} tbody tr")) == 15
    assert texts(browser, f"{table} .pages span") == ["1 to 15 of 25"]
    all_of(browser, f"{table} .pages button")[-1].click()
    assert len(all_of(browser, f"{table} tbody tr")) == 10
    all_of(browser, f"{table} input[type=search]")[0].send_keys("SOFT/0")
    assert [name.lstrip("▸ ") for name in texts(browser, f"{table} tbody tr > :first-child")] == [
        f"soft/0{i}.csv" for i in range(1, 10)
    ]
    choice = all_of(browser, f"{table} .filters label:last-child option")
    next(item for item in choice if "missed contact" in item.text).click()
    assert texts(browser, f"{table} tbody tr > :first-child") == ["soft/01.csv"]


def test_of_many_recordings_the_failed_cases_are_found_by_filters_and_shown_with_their_traces(shown, monkeypatch):
    for name, value in LIMITS.items():
        monkeypatch.setattr(many, name, value)
    text = to_html(report_of_many())
    assert len(text.encode()) < 3e6
    browser = shown(text)
    assert browser.get_log("browser") == []
    bars = "return [...document.querySelectorAll('[data-plot=latency] path.bar')].map((item) => item.getAttribute('d'))"
    drawn = browser.execute_script(bars)
    assert len(drawn) == 4 and all(path.count("Z") > 10 and "NaN" not in path for path in drawn)
    table = '.paged[data-table="cases-table"]'
    for heading, wanted in (("group", "soft"), ("detector", "pure_inertia"), ("outcome", "missed")):
        (label,) = [item for item in all_of(browser, f"{table} .filters label") if item.text.startswith(heading)]
        next(item for item in label.find_elements("css selector", "option") if item.text == wanted).click()
    rows = [row.split() for row in texts(browser, f"{table} tbody td:nth-child(n+2):nth-child(-n+4)")]
    assert rows and rows[::3] == [["soft"]] * (len(rows) // 3)
    assert rows[1::3] == [["pure_inertia"]] * (len(rows) // 3) and rows[2::3] == [["missed"]] * (len(rows) // 3)
    first = texts(browser, f"{table} tbody tr > :first-child")[0].removeprefix("▸ ")
    all_of(browser, f"{table} input[type=search]")[0].send_keys(first[-12:])
    assert [name.removeprefix("▸ ") for name in texts(browser, f"{table} tbody tr > :first-child")] == [first]
    browser.execute_script("arguments[0].click()", all_of(browser, f"{table} tbody tr.opens")[0])
    assert texts(browser, "#viewer-title") == [first]
    assert "missed" in texts(browser, "#viewer-plot text")


@pytest.mark.parametrize("kind", ["script", "right to left", "markdown", "not a character", "empty"])
def test_hostile_names_stay_text(shown, kind):
    from selenium.common.exceptions import NoAlertPresentException

    hostile = f'{HOSTILE[kind]}"><img src=x onerror=alert(1)>'
    browser = shown(to_html(Report(*case(lambda name: f"{hostile}{name}"))))
    with pytest.raises(NoAlertPresentException):
        _ = browser.switch_to.alert
    assert browser.get_log("browser") == []
    assert not all_of(browser, "img, iframe, object, embed, form, base, link:not([rel=expect])")
    assert len(all_of(browser, "script")) == len(all_of(browser, 'script[type="application/json"]')) + 1
    name = plain(f"{hostile}stiff/{hostile}01.csv")
    assert texts(browser, "#viewer-title") == [name]
    assert texts(browser, '[data-table="recordings-table"] tbody th button')[0] == f"▸ {name}"


def test_paper_shows_every_failed_recording_all_rows_and_headings(shown):
    browser = shown(to_html(Report(*case())))
    shown_rows = len(all_of(browser, '[data-table="recordings-table"] tbody tr'))
    browser.execute_script("dispatchEvent(new Event('beforeprint'))")
    assert texts(browser, "#printed-plots h3") == ["stiff/01.csv", "stiff/02.csv", "soft/12.csv", "free.csv#2"]
    plots = all_of(browser, "#printed-plots svg")
    assert [len(item.find_elements("css selector", "path.line")) for item in plots] == [2, 2, 2, 2]
    assert {item.get_dom_attribute("viewBox").split()[2] for item in plots} == {"1030"}
    assert len(all_of(browser, '[data-table="recordings-table"] tbody tr')) == 25 > shown_rows
    assert not all_of(browser, "thead th button") and not all_of(browser, "details:not([open])")
    browser.execute_script("dispatchEvent(new Event('afterprint'))")
    assert not all_of(browser, "#printed-plots figure") and all_of(browser, "thead th button")
    assert len(all_of(browser, '[data-table="recordings-table"] tbody tr')) == shown_rows
    assert browser.get_log("browser") == []


def test_without_script_every_table_is_there_and_the_plots_say_what_they_need(shown, browser):
    browser.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": True})
    try:
        shown(to_html(Report(*case())))
        notes = [item.text for item in all_of(browser, "noscript p")]
        assert notes == ["This plot needs script."] * 4
        assert len(all_of(browser, "#recordings-table tbody tr")) == 25
        assert not any(item.is_displayed() for item in all_of(browser, "svg.plot"))
    finally:
        browser.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": False})
