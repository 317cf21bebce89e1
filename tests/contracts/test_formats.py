"""What holds for every registered format, those of installed plug-ins included, and for unknown names."""

from __future__ import annotations

import tomllib
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from cdtool.base.errors import CdtoolError, UsageError
from cdtool.base.registry import Registry
from cdtool.detectors import DETECTORS
from cdtool.formats import FORMATS
from cdtool.formats.channels.reading import has_topics
from cdtool.machines import MACHINES

REGISTRIES = (FORMATS, MACHINES, DETECTORS)
PROJECT = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text(encoding="utf-8"))["project"]


@pytest.mark.parametrize("name", FORMATS.names(plugins=True))
def test_a_format_knows_its_suffixes_and_refuses_what_is_of_another(name, tmp_path):
    found = FORMATS.load(name)()
    assert found.name == name and all(suffix.startswith(".") for suffix in found.suffixes)
    path = tmp_path / f"x{found.suffixes[0]}"
    for content in (b"", b"\x00" * 64, b"\x89PNG\r\n\x1a\n" + bytes(64)):
        path.write_bytes(content)
        assert found.sniff(path) is False
        with pytest.raises(CdtoolError, match=r"x\."):
            found.columns(path)


@pytest.mark.parametrize("name", FORMATS.names(plugins=True))
def test_a_format_whose_library_is_absent_says_how_to_install_it(name, tmp_path, monkeypatch):
    def absent(module: str) -> None:
        raise ImportError(module)

    monkeypatch.setattr("cdtool.formats.containers.container_checks.import_module", absent)
    found = FORMATS.load(name)()
    path = tmp_path / f"x{found.suffixes[0]}"
    path.write_bytes(b"no recording")
    extra = rf"is not installed \(pip install '\.\[{name}\]'\)"
    with pytest.raises(CdtoolError, match=extra if name in PROJECT["optional-dependencies"] else None):
        found.columns(path)


def test_formats_of_messages_have_topics_and_tables_have_none():
    with_topics = {name for name in FORMATS.names() if has_topics(FORMATS.load(name)())}
    assert with_topics > {"mcap"} and not with_topics & {"csv", "mat", "parquet"}


@pytest.mark.parametrize("registry", REGISTRIES, ids=lambda registry: registry.kind)
def test_an_unknown_name_lists_the_nearest_known_ones(registry):
    wrong = registry.names()[0][:-1] + "_"
    with pytest.raises(UsageError, match=f"did you mean {registry.names()[0]}"):
        registry.load(wrong)


class Fake:
    """A detector of another package."""


def test_a_plugin_is_looked_for_only_when_an_unknown_name_is_asked_for(monkeypatch):
    asked = []

    def found(group: str) -> list[EntryPoint]:
        asked.append(group)
        return [
            EntryPoint("mine", "tests.contracts.test_formats:Fake", group),
            EntryPoint("broken", "no_such_package.detector:X", group),
        ]

    monkeypatch.setattr("cdtool.base.registry.entry_points", found)
    registry = Registry("detector", dict(DETECTORS.table))
    registry.load("momentum")
    assert asked == []
    assert registry.load("mine") is Fake
    assert "mine" in registry.names(plugins=True)
    with pytest.raises(CdtoolError, match="no_such_package"):
        registry.load("broken")
