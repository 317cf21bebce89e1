"""The documentation site: its navigation, generated pages, link check and list of versions.

The strict build itself is a step of `.ci/run`; it takes too long for a test.
"""

from __future__ import annotations

import inspect
import json
import re
import runpy
import tomllib
from pathlib import Path
from typing import Any

import pytest

import cdtool
from cdtool.commands.app import COMMANDS
from tests.project.pages import DOCS, PAGES, ROOT

SITE = DOCS / "site"


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
        assert name in pages or (DOCS / f"{name}.md").is_file(), name
    patterns = [item for items in navigation["below"].values() for item in items]
    reached = {(DOCS / f"{name}.md").resolve() for name in named}
    reached |= {file.resolve() for pattern in patterns for file in DOCS.glob(f"{pattern}.md")}
    missing = {page.resolve() for page in PAGES if page != ROOT / "README.md"} - reached
    assert not missing, f"add to docs/site/navigation.toml: {sorted(page.name for page in missing)}"


def test_the_front_page_begins_as_the_readme():
    front, readme = (file.read_text(encoding="utf-8") for file in (SITE / "front_page.txt", ROOT / "README.md"))
    (line,) = re.findall(r"^python3 -m venv .*$", front, re.MULTILINE)
    assert line in readme
    (question,) = re.findall(r"^\*\*.*\?\*\*$", front, re.MULTILINE)
    assert question in readme
    for page in re.findall(r":link: (\S+)", front):
        assert (ROOT / f"{page}.md").is_file(), page


@pytest.mark.parametrize(
    "page",
    [
        "gate-with-force-meter.md",  # a gate, CSV in German number format, a force meter
        "ur-rtde.md",  # a UR robot
        "ci.md",  # fail a build when the latency grows
        "protocol.md",  # a document for a notified body
        "evaluation.md#not-assessable",
        "choosing.md",  # which detector
        "ci.md#status-3-what-now",
        "index.md#how-to-cite",
    ],
)
def test_the_front_page_leads_to_what_people_come_for(page):
    assert f"](docs/{page})" in (SITE / "front_page.txt").read_text(encoding="utf-8")
    name, _, anchor = page.partition("#")
    headings = re.findall(r"^#+ (.*)$", (DOCS / name).read_text(encoding="utf-8"), re.MULTILINE)
    slugs = [re.sub(r"[^\w\- ]", "", text.lower()).replace(" ", "-") for text in headings]
    assert not anchor or anchor in slugs


def test_every_page_that_the_search_puts_later_exists(pages):
    patterns = re.findall(r"\[/(\S+)/, \d+\]", (SITE / "search_order.js").read_text(encoding="utf-8"))
    assert len(patterns) == 9
    names = {page.relative_to(ROOT).with_suffix("").as_posix() for page in [*PAGES, ROOT / "CHANGELOG.md"]}
    names |= {f"docs/{name}" for name in pages} | {"index", "CONTRIBUTING"}
    for pattern in patterns:
        assert any(re.search(pattern, name) for name in names), pattern


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


def test_every_function_and_field_is_on_a_generated_page(pages):
    python = {name: text for name, text in pages.items() if name.startswith("reference/python/")}
    classes = [place for text in python.values() for place in re.findall(r"autoclass:: (\S+)", text)]
    assert len(classes) == len(set(classes))
    for name in (name for name in cdtool.__all__ if not name.startswith("__")):
        item = getattr(cdtool, name)
        if inspect.isclass(item):
            assert f"{item.__module__}.{item.__qualname__}" in classes, name
            continue
        assert f".. autofunction:: cdtool.{name}\n" in pages["reference/python/functions"]
        assert re.search(rf"\[`cdtool\.{name}`\]\([^)]*\) \| \w", pages["reference/python/index"]), name
    for name in (
        "BenchmarkResult",
        "BenchmarkPlots",
        "DetectionResult",
        "DetectionResults",
        "LearnedSignature",
        "Recording",
    ):
        assert re.search(rf"^## {name}$", pages["reference/python/results"], re.MULTILINE), name
    assert not re.search(r"^## (Benchmark|Score|DetectedRuns)$", pages["reference/python/results"], re.MULTILINE)
    schema = json.loads((DOCS / "results.schema.json").read_text(encoding="utf-8"))
    for part in (schema, *schema["$defs"].values()):
        for field in part.get("properties", ()):
            assert f"| `{field}` |" in pages["reference/results"], field


def test_a_broken_link_a_missing_anchor_and_a_file_of_another_host_are_found(tmp_path):
    broken_links = runpy.run_path(str(SITE / "check_links.py"))["broken_links"]
    (tmp_path / "b.html").write_text('<h2 id="there">x</h2><a href="a.html#here">a</a>', encoding="utf-8")
    (tmp_path / "a.html").write_text('<p id="here"><a href="b.html#there">b</a>', encoding="utf-8")
    assert broken_links(tmp_path) == []
    (tmp_path / "a.html").write_text(
        '<a href="c.html">c</a><a href="b.html#not">d</a><a href="https://example.org">e</a>'
        '<script src="https://example.org/x.js"></script>',
        encoding="utf-8",
    )
    assert broken_links(tmp_path) == [
        "a.html: loads https://example.org/x.js from another host",
        "a.html: c.html: no such file",
        "a.html: b.html#not: no such anchor",
        "b.html: a.html#here: no such anchor",
    ]


def test_the_newest_release_is_the_front_page_of_all_versions(tmp_path):
    write_versions = runpy.run_path(str(SITE / "versions.py"))["write_versions"]
    for name in ("main", "0.9", "0.10"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "index.html").write_text("", encoding="utf-8")
    assert write_versions(tmp_path, "/cdtool/") == ["0.10", "0.9", "main"]
    assert "url=0.10/index.html" in (tmp_path / "index.html").read_text(encoding="utf-8")
    rows = json.loads((tmp_path / "switcher.json").read_text(encoding="utf-8"))
    assert (rows[0]["version"], rows[0]["url"]) == ("0.10", "/cdtool/0.10/")


def test_equations_are_written_as_github_and_the_site_render_them():
    blocks = [text for page in PAGES for text in re.findall(r"```math\n(.*?)```", page.read_text("utf-8"), re.DOTALL)]
    assert len(blocks) > 20
    latex2mathml = pytest.importorskip("docutils.utils.math.latex2mathml")
    for text in blocks:
        latex2mathml.tex2mathml(text.strip(), as_block=True)


def test_the_workflow_builds_the_site_as_ci_does():
    yaml = pytest.importorskip("yaml")
    jobs = yaml.safe_load((ROOT / ".github" / "workflows" / "docs.yml").read_text(encoding="utf-8"))["jobs"]
    lines = [step.get("run", "") for step in jobs["build"]["steps"]]
    assert any("docs/make_site.py" in line for line in lines)
    assert jobs["external-links"]["continue-on-error"] is True
    assert "docs/make_site.py" in (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    for name in re.findall(r"docs/[\w/]+\.py", Path(ROOT / ".github" / "workflows" / "docs.yml").read_text("utf-8")):
        assert (ROOT / name).is_file(), name
