"""The picture of the layers is that of the imports, and shows them all running downward."""

from __future__ import annotations

from types import ModuleType
from xml.etree import ElementTree

import pytest

from tests.project.pages import docs_script

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def script() -> ModuleType:
    return docs_script("make_layers")


@pytest.fixture(scope="module")
def layers(script):
    return script.read_layers()


def test_the_picture_of_the_docs_is_that_of_the_imports(script, layers):
    text = script.FILE.read_text(encoding="utf-8")
    assert text == script.svg(layers), "run python docs/make_layers.py"
    root = ElementTree.fromstring(text)
    assert root.findtext(f"{SVG}title") and "alarms imports" in (root.findtext(f"{SVG}desc") or "")
