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


def test_a_room_imports_only_what_lies_below_its_layer(layers):
    depth = {room: number for number, layer in enumerate(layers.layers) for room in layer}
    assert layers.imports["commands"] and not layers.imports["base"]
    for room, imported in layers.imports.items():
        assert all(depth[other] > depth[room] for other in imported), room


def test_another_import_is_another_picture(script, layers):
    fewer = dict(layers.imports, alarms=layers.imports["alarms"] - {"detectors"})
    assert script.svg(script.Layers(layers.layers, fewer)) != script.svg(layers)


def test_a_module_without_a_layer_is_an_error(script, tmp_path, monkeypatch):
    (tmp_path / "stray.py").write_text("import cdtool.recordings.units\n", encoding="utf-8")
    monkeypatch.setattr(script, "PACKAGE", tmp_path)
    with pytest.raises(ValueError, match="cdtool/stray is in no layer"):
        script.read_layers()
