"""Targets and folders: each suffix gets its content, a folder contains all reports, nothing is written outside."""

from __future__ import annotations

import json
from dataclasses import replace
from xml.etree import ElementTree

import pytest

from cdtool.base.errors import UsageError
from cdtool.report.markdown.report import to_markdown
from cdtool.report.outputs import check_outputs, write_outputs
from cdtool.report.plots.figures import slug
from cdtool.report.writers.base import Report
from cdtool.report.writers.contacts import contacts_lines
from cdtool.report.writers.junit import to_junit
from cdtool.results.evaluated import evaluate
from cdtool.results.results import SCHEMA_VERSION
from cdtool.results.traces.file import encode_traces, read_traces
from tests.report.bench import Bench
from tests.report.hostile import HOSTILE

ALL = "".join(HOSTILE.values())
WHOLE = {"report.html", "report.md", "results.json", "results.traces.json.gz", "contacts.csv", "junit.xml"}


@pytest.fixture
def done(bench: Bench, simulated, results) -> Report:
    """Traces of groups whose names are hostile, or equal as file names."""
    recording = simulated("stiff", 1)
    groups = (*HOSTILE.values(), "Stiff", "stiff", "stiff_momentum")
    traces = tuple(bench.trace(replace(recording, name=ALL), group, ("momentum",)) for group in groups)
    return Report(evaluate(replace(results, groups=groups)), traces)


def test_a_folder_holds_every_file_and_nothing_leaves_it(done, tmp_path):
    folder = tmp_path / "deep" / "report"
    folder.parent.mkdir()
    assert write_outputs(done, [folder]) == [folder / "report.html"]
    assert [path.name for path in tmp_path.iterdir()] == ["deep"]
    assert [path.name for path in folder.parent.iterdir()] == ["report"]
    names = {path.name for path in folder.iterdir()}
    assert all(path.is_file() for path in folder.iterdir())
    assert names >= WHOLE
    images = names - WHOLE
    assert {"latency.png", "triggers_stiff.png", "triggers_stiff-2.png", "triggers_stiff-momentum.png"} <= images
    assert sum(name.startswith("triggers_") for name in images) == len(done.traces)
    assert all(name.isascii() and len(name) < 120 for name in names)
    report = (folder / "report.md").read_text(encoding="utf-8")
    assert all(name.endswith(".png") and f"]({name})" in report for name in images)


def test_each_suffix_gets_its_content(done, tmp_path):
    names = ("a.json", "a.md", "a.csv", "a.xml", "a.html", "a.png", "a.SVG", "a.pdf")
    targets = [tmp_path / name for name in names]
    assert write_outputs(done, targets) == targets
    assert json.loads(targets[0].read_text(encoding="utf-8"))["schema_version"] == SCHEMA_VERSION
    assert encode_traces(read_traces(tmp_path / "a.traces.json.gz")) == encode_traces(done.traces)
    assert targets[1].read_text(encoding="utf-8") == to_markdown(Report(done.evaluated))
    assert targets[2].read_text(encoding="utf-8") == "".join(contacts_lines(done.evaluated.results))
    assert targets[3].read_text(encoding="utf-8") == to_junit(done)
    assert ElementTree.parse(targets[3]).getroot().tag == "testsuites"
    assert targets[4].read_text(encoding="utf-8").lower().startswith("<!doctype html>")
    assert [target.read_bytes()[:4] for target in targets[5:]] == [b"\x89PNG", b"<?xm", b"%PDF"]


@pytest.mark.parametrize(
    ("name", "words"),
    [("a.txt", "a.txt"), ("no/a.json", "no folder"), ("no/report", "no folder"), ("file", "not a folder")],
)
def test_a_wrong_target_is_refused_before_any_work(tmp_path, name, words):
    (tmp_path / "file").write_text("x", encoding="utf-8")
    with pytest.raises(UsageError, match=words):
        check_outputs([tmp_path / "fine.json", tmp_path / name])
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_folder_without_permission_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("cdtool.report.outputs.os.access", lambda *_: False)  # root may write everywhere
    for target in (tmp_path, tmp_path / "a.json", tmp_path / "new"):
        with pytest.raises(UsageError, match="is not writable"):
            check_outputs([target])


def test_slugs_are_safe_and_unique():
    taken: set[str] = set()
    found = [slug(name, taken) for name in (*HOSTILE.values(), "A b", "a_b", "Grün", "碰撞")]
    assert len(set(found)) == len(found)
    assert found[-4:] == ["a-b", "a-b-2", "grun", "unnamed-2"]
    assert all(set(name) <= set("abcdefghijklmnopqrstuvwxyz0123456789-") for name in found)
