"""Settings of Sphinx for the site; `docs/make_site.py` copies the pages, adds the generated ones, and runs Sphinx."""

from __future__ import annotations

import math
import os
import re
import sys
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.utils.math import latex2mathml
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.errors import SphinxError

sys.path.insert(0, str(Path(__file__).parent))

project = "cdtool"
author = "The cdtool authors"
version = release = os.environ.get("CDTOOL_DOCS_VERSION", "main")
copyright = f"the cdtool authors, Apache-2.0. Documentation of version {version}"
root_doc = "index"
language = "en"

extensions = ["myst_parser", "sphinx.ext.autodoc", "numpydoc", "sphinx_design", "sphinx_copybutton"]
exclude_patterns: list[str] = []
smartquotes = False  # `--option` in the text of a help page stays as it is
add_module_names = False
toc_object_entries = False

# Markdown as GitHub renders it: `$...$`, blocks of `math`, anchors of headings.
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_fence_as_directive = ["math"]
myst_heading_anchors = 5
myst_dmath_double_inline = True
html_math_renderer = "mathml"

autodoc_typehints = "none"  # numpydoc states the types in words
autodoc_member_order = "bysource"
numpydoc_show_class_members = False
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True

html_theme = "pydata_sphinx_theme"
html_title = "cdtool"
html_static_path = ["_static"]
html_extra_path = ["_extra"]  # the sample report
html_css_files = ["style.css"]
html_js_files = ["folds.js"]
html_use_index = False
html_context = {"default_mode": "auto"}
html_search_scorer = str(Path(__file__).parent / "search_order.js")
html_copy_source = False
html_show_sourcelink = False
html_theme_options: dict[str, Any] = {
    "logo": {"text": "cdtool"},
    "header_links_before_dropdown": 5,
    "navbar_end": ["theme-switcher"],
    "show_toc_level": 2,
    "show_nav_level": 2,
    "navigation_with_keys": True,
    "footer_start": ["copyright"],
    "footer_end": [],
    "secondary_sidebar_items": ["page-toc"],
    "pygments_light_style": "tango",
    "pygments_dark_style": "monokai",
    "back_to_top_button": True,
}
if switcher := os.environ.get("CDTOOL_DOCS_SWITCHER"):  # the list of versions, beside their folders
    html_theme_options["navbar_end"].insert(0, "version-switcher")
    html_theme_options["switcher"] = {"json_url": switcher, "version_match": version}
    html_theme_options["check_switcher"] = False
html_sidebars = {"index": [], "docs/tasks": [], "docs/concepts": [], "docs/reference": [], "docs/gallery": []}


def mathml(translator: Any, node: nodes.Node, *, block: bool) -> None:
    """Write an equation as MathML, which browsers render themselves: no script, no font or file from elsewhere."""
    text = node.astext()
    try:
        equation = latex2mathml.tex2mathml(text, as_block=block)
    except Exception as fault:
        raise SphinxError(f"{translator.builder.current_docname}: equation not understood: {fault}: {text}") from fault
    translator.body.append(f'<div class="equation">{equation}</div>' if block else equation)
    raise nodes.SkipNode


def plain_rst(app: Sphinx, what: str, name: str, item: object, options: object, lines: list[str]) -> None:
    """Turn the docstrings' single backticks and marks into what reStructuredText understands as code and text."""
    del app, what, name, item, options
    turned, in_example, before = list[str](), False, ""
    for line in lines:
        in_example = line.lstrip().startswith(">>>") or (in_example and bool(line.strip()))
        # An indented block after a paragraph is an equation or a listing.
        if line.startswith("    ") and turned and not turned[-1].strip() and before[:1] not in ("", " ", "*"):
            turned += ["::", ""]
            before = ""
        in_block = line.startswith("    ") and before == ""
        before = before if not line.strip() or in_block else line
        turned.append(line if in_example or in_block else _as_rst(line))
    lines[:] = turned


def _as_rst(line: str) -> str:
    bullet, text = (line[:2], line[2:]) if line.startswith("* ") else ("", line)
    parts = re.split(r"(``[^`]*``|`[^`]*`)", text)
    for i, part in enumerate(parts):
        if i % 2:
            parts[i] = f"``{part.strip('`')}``"
        else:
            parts[i] = re.sub(r"(?<!\\)([*|])", r"\\\1", re.sub(r"(?<=\w)_(?=\W|$)", r"\\_", part))
    return bullet + "".join(parts)


def picture_links(app: Sphinx, page: str, template: str, context: dict[str, Any], tree: nodes.document) -> None:
    """Let a picture lead to itself, so that a phone can enlarge it."""
    del app, page, template, tree
    if body := context.get("body"):
        picture = re.compile(r'<img [^>]*src="([^"]*_images/[^"]*)"[^>]*>')
        context["body"] = picture.sub(r'<a class="picture" href="\g<1>">\g<0></a>', body)


def whole_options(app: Sphinx, page: str, template: str, context: dict[str, Any], tree: nodes.document) -> None:
    """Keep the options of a command whole where its line wraps: browsers break a line after any hyphen."""
    del app, page, template, tree
    if body := context.get("body"):
        commands = re.compile(r'<span id="command[\d-]+">.*', re.MULTILINE)
        option = re.compile(r"(?<=</span>)-{1,2}[a-z][\w-]*")
        context["body"] = commands.sub(lambda line: option.sub(r'<span class="option">\g<0></span>', line[0]), body)


def front_page_title(app: Sphinx, page: str, template: str, context: dict[str, Any], tree: nodes.document) -> None:
    """Let the browser show "cdtool" for the front page, not "cdtool — cdtool"."""
    del app, template, tree
    if page == root_doc:
        context["docstitle"] = ""


def separate_commands(app: Sphinx, tree: nodes.document, page: str) -> None:
    """Let each line of a block of commands be an element, so that a long one wraps with an indent."""
    del app, page
    blocks = (block for block in tree.findall(nodes.literal_block) if block.get("language") in ("sh", "bash"))
    for number, block in enumerate(blocks, 1):
        block["highlight_args"] = {**block.get("highlight_args", {}), "linespans": f"command{number}"}


TALLEST = 4400  # of a page 1,400 px wide [px]; taller ones fold their longest sections


def height(node: nodes.Node) -> float:
    """Return about how tall a part of a page is [px]."""
    if isinstance(node, nodes.paragraph | nodes.term):
        return 18 + 27 * math.ceil(len(node.astext()) / 105) + 500 * len(list(node.findall(nodes.image)))
    if isinstance(node, nodes.literal_block):
        return 45 + 20 * (1 + node.astext().count("\n"))
    if isinstance(node, nodes.row):
        return 18 + 27 * math.ceil(len(node.astext()) / 60)
    own = {nodes.title: 100, nodes.math_block: 90, addnodes.desc_signature: 70}
    return next((size for kind, size in own.items() if isinstance(node, kind)), 0) or sum(map(height, node.children))


def contents(hidden: list[nodes.Node]) -> str:
    """Return in words what a fold hides."""
    found = [part for node in hidden for part in node.findall()]
    if any(isinstance(part, addnodes.desc) for part in found):
        return "signature, parameters and examples"
    kinds = {"table": nodes.table, "example": nodes.literal_block, "picture": nodes.image}
    counts = {name: sum(isinstance(part, kind) for part in found) for name, kind in kinds.items()}
    counts["paragraph"] = sum(
        isinstance(part, nodes.paragraph) and not isinstance(part.parent, nodes.entry) for part in found
    )
    return ", ".join(f"{count} {name}{'s' * (count > 1)}" for name, count in counts.items() if count)


def fold_sections(app: Sphinx, tree: nodes.document, page: str) -> None:
    """Fold the longest sections of a tall page behind their first paragraph, until it is short enough."""
    del app
    (whole,) = [node for node in tree.children if isinstance(node, nodes.section)][:1] or [nodes.section()]
    below = [node for node in whole.children if isinstance(node, nodes.section)]
    if len(below) == 1:
        below = [node for node in below[0].children if isinstance(node, nodes.section)]
    total = 300 + height(tree)
    for section in sorted(below, key=height, reverse=True):
        first = 1 + isinstance(section.children[min(1, len(section.children) - 1)], nodes.paragraph)
        hidden = section.children[first:]
        if total < TALLEST or page == root_doc or not hidden:
            break
        section[first:] = [
            nodes.raw("", f'<details class="fold"><summary>Show {contents(hidden)}</summary>', format="html"),
            *hidden,
            nodes.raw("", "</details>", format="html"),
        ]
        total -= sum(map(height, hidden)) - 45


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the renderer of equations, and the reader of docstrings before numpydoc's."""
    app.add_html_math_renderer(
        "mathml",
        (lambda self, node: mathml(self, node, block=False), None),
        (lambda self, node: mathml(self, node, block=True), None),
    )
    app.connect("autodoc-process-docstring", plain_rst, priority=100)
    app.connect("doctree-resolved", separate_commands)
    app.connect("doctree-resolved", fold_sections)
    app.connect("html-page-context", front_page_title)
    app.connect("html-page-context", picture_links)
    app.connect("html-page-context", whole_options)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
