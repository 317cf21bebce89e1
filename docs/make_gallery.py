"""Run the examples of the gallery and write their pages: python docs/make_gallery.py

docs/examples/gallery/NAME.py becomes docs/gallery/NAME.md. The parts of a script begin with `# %%`, as editors and
Jupyter (jupytext) know them; `# %% [markdown]` begins text. As in a notebook, a part shows what it prints, the value of
its last line, and its figures: docs/images/gallery_NAME_1.png. With a folder as argument, everything is written there.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import io
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cycler import cycler
from matplotlib import rc_context

from cdtool.detectors.look import BLUE, OCHRE, PLUM, RUST, TEAL
from cdtool.report.plots.figures import drawing

DOCS = Path(__file__).resolve().parent
SCRIPTS = DOCS / "examples" / "gallery"
# The order of the pages.
NAMES = (
    "first_look",
    "tune",
    "write_a_detector",
    "sweep_a_parameter",
    "query_a_fleet",
)
_PART = re.compile(r"^# %%(?P<kind> \[markdown\])?\n", re.MULTILINE)
# As wide as a line of the pages.
_FRAMES = {"display.width": 118, "display.max_columns": 20, "display.precision": 1, "display.max_colwidth": 40}


@dataclass(frozen=True)
class Page:
    """A page of the gallery: its Markdown, and its pictures by file name."""

    text: str
    pictures: dict[str, bytes]


def parts_of(script: str) -> Iterator[tuple[bool, str]]:
    """Yield the parts of a script below its docstring: whether it is text, and its content."""
    found = list(_PART.finditer(script))
    for part, after in zip(found, [*found[1:], None], strict=True):
        content = script[part.end() : after.start() if after else len(script)].strip("\n")
        if part["kind"]:
            yield True, "\n".join(line.removeprefix("#").removeprefix(" ") for line in content.splitlines())
        else:
            yield False, content


def run_part(code: str, names: dict[str, Any]) -> tuple[str, Any]:
    """Run a part; return what it prints, and the value of its last line if that is an expression."""
    tree, value = ast.parse(code), None
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    printed = io.StringIO()
    colours = {"axes.prop_cycle": cycler(color=(BLUE, OCHRE, PLUM, TEAL, RUST))}
    with contextlib.redirect_stdout(printed), drawing(), rc_context(colours):
        exec(compile(tree, "gallery", "exec"), names)
        if isinstance(last, ast.Expr):
            value = eval(compile(ast.Expression(last.value), "gallery", "eval"), names)
    return printed.getvalue(), value


def open_figures() -> Iterator[bytes]:
    """Yield the figures that a part has drawn with pyplot, as Jupyter shows them below it, and close them."""
    if "matplotlib.pyplot" not in sys.modules:
        return
    from matplotlib import pyplot

    for number in pyplot.get_fignums():
        drawn = io.BytesIO()
        pyplot.figure(number).savefig(
            drawn, format="png", dpi=100, bbox_inches="tight", metadata={"Software": "cdtool"}
        )
        pyplot.close(number)
        yield drawn.getvalue()


def text_of(value: Any) -> str:
    """Return a value as a notebook shows it in text."""
    import pandas as pd

    settings = [item for pair in _FRAMES.items() for item in pair]
    with pd.option_context(*settings):
        return "" if value is None else "\n".join(line.rstrip() for line in repr(value).splitlines())


def page_of(name: str) -> Page:
    """Run a script in the current folder, which has `sample_logs`; return its page."""
    script = (SCRIPTS / f"{name}.py").read_text(encoding="utf-8")
    title, _, text = (ast.get_docstring(ast.parse(script)) or "").partition("\n\n")
    lines = [f"# {title.rstrip('.')}", "", *([text, ""] if text else [])]
    pictures: dict[str, bytes] = {}
    names: dict[str, Any] = {"__name__": "gallery"}
    sys.modules["gallery"] = type(sys)("gallery")  # where the dataclasses of a script look for its names
    for is_text, content in parts_of(script):
        if is_text:
            lines += [content, ""]
            continue
        lines += ["```py", content, "```", ""]
        printed, value = run_part(content, names)
        figures = [(picture, title.rstrip(".")) for picture in open_figures()]
        if hasattr(value, "_repr_png_"):
            picture, about = value._repr_png_()
            figures.append((picture, about["alt"]))
        shown = "\n".join(filter(None, [printed.rstrip(), "" if figures else text_of(value)]))
        lines += ["```text", shown, "```", ""] if shown else []
        for picture, about in figures:
            file = f"gallery_{name}_{len(pictures) + 1}.png"
            pictures[file] = picture
            lines += [f"![{about}](../images/{file})", ""]
    source = f"[{name}.py](../examples/gallery/{name}.py)"
    lines += [f"This page is made from {source} by `python docs/make_gallery.py`.", ""]
    return Page("\n".join(lines), pictures)


def main() -> None:
    """Write all pages and pictures, or those into a folder."""
    parser = argparse.ArgumentParser(description="Run the examples of the gallery and write their pages.")
    parser.add_argument("folder", type=Path, nargs="?", default=DOCS, help="where the pages are written")
    docs = parser.parse_args().folder.resolve()
    for folder in (docs / "gallery", docs / "images"):
        folder.mkdir(parents=True, exist_ok=True)
    for name in NAMES:
        with tempfile.TemporaryDirectory() as work, contextlib.chdir(work):
            shutil.copytree(DOCS.parent / "sample_logs", "sample_logs")
            page = page_of(name)
        (docs / "gallery" / f"{name}.md").write_text(page.text, encoding="utf-8")
        for old in (docs / "images").glob(f"gallery_{name}_*.png"):
            old.unlink()
        for file, picture in page.pictures.items():
            (docs / "images" / file).write_bytes(picture)


if __name__ == "__main__":
    os.environ["COLUMNS"], os.environ["MPLBACKEND"] = "120", "Agg"
    main()
