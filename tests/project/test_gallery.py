"""The gallery: every example runs, and its page shows what it printed and drew."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.project.pages import DOCS, ROOT, docs_script, script_at

NAMES = docs_script("make_gallery").NAMES
_IMPORT = re.compile(r"^(?:>>> )?from (cdtool[\w.]*) import", re.MULTILINE)


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """All pages and pictures, made in a process of its own: pandas draws with pyplot."""
    folder = tmp_path_factory.mktemp("gallery")
    command = [sys.executable, str(DOCS / "make_gallery.py"), str(folder)]
    done = subprocess.run(
        command, capture_output=True, text=True, check=False, env={**os.environ, "PYTHONPATH": str(ROOT)}
    )
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.parametrize("name", NAMES)
def test_a_page_of_the_gallery_shows_what_its_example_prints(made, name):
    page = f"gallery/{name}.md"
    shown = (DOCS / page).read_text(encoding="utf-8")
    assert shown == (made / page).read_text(encoding="utf-8"), "run python docs/make_gallery.py"


def test_every_example_of_the_gallery_has_a_page():
    assert sorted(path.stem for path in (DOCS / "examples" / "gallery").glob("*.py")) == sorted(NAMES)
    assert sorted(path.stem for path in (DOCS / "gallery").glob("*.md")) == sorted([*NAMES, "index"])


def test_the_notebook_shows_the_verdict_and_the_numbers_of_the_readme():
    pytest.importorskip("ipykernel")
    pytest.importorskip("nbclient")
    notebook = DOCS / "examples" / "gate.ipynb"
    assert '"image/png"' not in notebook.read_text(encoding="utf-8")  # the site shows what its cells give
    outputs = [item for cell in script_at(DOCS / "site" / "notebook_page.py").run(notebook).cells
               for item in cell.get("outputs", ())]  # fmt: skip
    assert {item.output_type for item in outputs} <= {"execute_result", "display_data"}
    (table,) = [text for item in outputs if "limits are met" in (text := item.data.get("text/html", ""))]
    rows = re.findall(
        r"^(stiff|soft) +(\w+) +([\d.]+) ", (ROOT / "README.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    assert len(rows) == 10
    for group, detector, median in rows:
        assert re.search(rf"<td>{group}</td>\s*<td>{detector}</td>\s*<td>{median}(\.0)?\b", table), (group, detector)


def test_the_python_page_imports_everything_from_cdtool():
    # A detector with gains of its own is the one thing that the package's own names do not have.
    assert _IMPORT.findall((DOCS / "python.md").read_text(encoding="utf-8")) == ["cdtool.detectors.momentum"]
