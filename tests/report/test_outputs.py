"""Tables and folders: right figures, nothing active from names, nothing outside the folder."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import replace

import pytest
from markdown_it import MarkdownIt

from cdtool.errors import UsageError
from cdtool.evaluation.results import Skipped
from cdtool.report.contacts_csv import contacts_csv
from cdtool.report.markdown import Image, to_markdown
from cdtool.report.outputs import check_outputs, slug, write_outputs
from cdtool.workflows.benchmark import Benchmark
from tests.report.conftest import Bench, contact
from tests.report.hostile import HOSTILE

ALL = "".join(HOSTILE.values())


def rows(text: str) -> list[list[str]]:
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in text.splitlines() if line[:1] == "|"]


def test_the_table_holds_the_figures_of_each_group(results):
    text = to_markdown(results)
    found = rows(text)
    assert ["friction_ekf (feekf)", "34.0", "4.00", "34.0", "3", "0", "1", "0", "0"] in found
    assert ["momentum", "65.0", "7.07", "65.0", "2", "1", "0", "0", "3"] in found
    assert ["momentum", "–", "–", "–", "–", "–", "–", "1", "40"] in found
    assert [line for line in text.splitlines() if line.startswith("## ")][:3] == ["## stiff", "## soft", "## holdout"]


def test_onset_rule_skipped_recordings_and_provenance_are_stated(results):
    text = to_markdown(results)
    assert "above 20 N, back to 8 N" in text
    assert ["broken.csv", "empty file"] in rows(text)
    for expected in ("9.8.7", "c0ffee" * 10, "5eed" * 16, "ab12" * 16, "bandwidth = 30.0"):
        assert expected in text


def test_images_are_linked_by_relative_name_below_their_group(results):
    text = to_markdown(results, [Image("latency.png", "all"), Image("triggers_soft.png", "soft [x]", "soft")])
    assert text.index("![all](latency.png)") < text.index("## stiff") < text.index("## soft")
    assert text.index("## soft") < text.index("](triggers_soft.png)") < text.index("## holdout")


@pytest.mark.parametrize("kind", HOSTILE)
def test_markdown_shows_hostile_names_as_text(results, kind):
    name = HOSTILE[kind]
    changed = replace(
        results,
        groups=(name,),
        detectors=(name,),
        contacts=(contact(name, name, 30.0),),
        skipped=(Skipped(name, name),),
        findings=(Skipped(name, name),),
        provenance={"onset": name, "machine": name, "gains": {name: {name: name}}, "logs_sha256": {name: name}},
    )
    tokens = (
        MarkdownIt("commonmark")
        .enable(["table", "strikethrough"])
        .parse(to_markdown(changed, [Image("a.png", name, name)]))
    )
    inline = [child for token in tokens for child in token.children or ()]
    images = [child for child in inline if child.type == "image"]
    assert [image.attrs["src"] for image in images] == ["a.png"]
    active = {child.type for child in inline} - {"text", "text_special", "softbreak", "image"}
    assert not active
    assert not any(token.type.startswith("html") for token in tokens)
    assert sum(token.type == "table_open" for token in tokens) == 6
    widths = [len(row) for row in _table_rows(tokens)]
    assert set(widths) == {9, 2, 3}
    assert widths.count(9) == 2


def _table_rows(tokens):
    found, current = [], []
    for token in tokens:
        if token.type == "tr_open":
            current = []
        elif token.type in ("td_open", "th_open"):
            current.append(token)
        elif token.type == "tr_close":
            found.append(current)
    return found


def test_the_csv_holds_every_contact_with_untouched_numbers(results):
    low = replace(contact("momentum", "stiff", -0.5), onset_s=-1.25)
    read = list(csv.DictReader(io.StringIO(contacts_csv(replace(results, contacts=(*results.contacts, low))))))
    assert len(read) == len(results.contacts) + 1
    assert read[0]["latency_ms"] == "30.0"
    assert read[0]["clipped"] == "false"
    assert read[0]["force_at_alarm_n"] == ""
    assert read[-1]["onset_s"] == "-1.25"
    assert read[-1]["latency_ms"] == "-0.5"


@pytest.mark.parametrize("start", ["=", "+", "-", "@", "\t", "\r"])
def test_a_spreadsheet_runs_no_cell(results, start):
    text = f'{start}cmd|"/c calc"!A1,\nrest'
    read = list(
        csv.DictReader(
            io.StringIO(contacts_csv(replace(results, contacts=(contact(text, text, 1.0, name=text),))), newline="")
        )
    )
    assert len(read) == 1
    assert [read[0][key] for key in ("recording", "group", "detector")] == [f"'{text}"] * 3
    assert read[0]["outcome"] == "detected"


@pytest.fixture
def done(bench: Bench, simulated, results) -> Benchmark:
    """Traces of groups whose names are hostile, or alike once they are file names."""
    recording = simulated("stiff", 1)
    groups = (*HOSTILE.values(), "Stiff", "stiff", "stiff_momentum")
    traces = tuple(bench.trace(replace(recording, name=ALL), group, ("momentum",)) for group in groups)
    return Benchmark(replace(results, groups=groups), traces, {})


def test_a_folder_holds_every_file_and_nothing_leaves_it(done, tmp_path):
    folder = tmp_path / "deep" / "report"
    folder.parent.mkdir()
    assert write_outputs(done, [folder]) == [folder / "report.md"]
    assert [path.name for path in tmp_path.iterdir()] == ["deep"]
    assert [path.name for path in folder.parent.iterdir()] == ["report"]
    names = {path.name for path in folder.iterdir()}
    assert all(path.is_file() for path in folder.iterdir())
    assert {"report.md", "results.json", "contacts.csv", "latency.png"} <= names
    assert len(names) == 4 + 2 * len(done.traces)
    assert {"triggers_stiff.png", "triggers_stiff-2.png", "detection_stiff-momentum_momentum.png"} <= names
    assert all(name.isascii() and len(name) < 120 for name in names)
    report = (folder / "report.md").read_text(encoding="utf-8")
    assert all(f"]({name})" in report for name in names if name.endswith(".png"))


def test_each_suffix_gets_its_content(done, tmp_path):
    targets = [tmp_path / name for name in ("a.json", "a.md", "a.csv", "a.png", "a.SVG", "a.pdf")]
    assert write_outputs(done, targets) == targets
    assert json.loads(targets[0].read_text(encoding="utf-8"))["schema_version"] == 1
    assert targets[1].read_text(encoding="utf-8") == to_markdown(done.results)
    assert targets[2].read_text(encoding="utf-8") == contacts_csv(done.results)
    assert [target.read_bytes()[:4] for target in targets[3:]] == [b"\x89PNG", b"<?xm", b"%PDF"]


@pytest.mark.parametrize(
    ("name", "words"),
    [("a.html", "a.html"), ("no/a.json", "no folder"), ("no/report", "no folder"), ("file", "no folder")],
)
def test_a_wrong_target_is_refused_before_any_work(tmp_path, name, words):
    (tmp_path / "file").write_text("x", encoding="utf-8")
    with pytest.raises(UsageError, match=words):
        check_outputs([tmp_path / "fine.json", tmp_path / name])
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_good_targets_pass_and_nothing_is_written_yet(tmp_path):
    (tmp_path / "report.v2").mkdir()
    check_outputs([tmp_path / "a.json", tmp_path / "b.PDF", tmp_path / "new", tmp_path / "report.v2"])
    assert [path.name for path in tmp_path.iterdir()] == ["report.v2"]


def test_a_folder_without_permission_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("cdtool.report.outputs.os.access", lambda *_: False)  # root may write everywhere
    for target in (tmp_path, tmp_path / "a.json", tmp_path / "new"):
        with pytest.raises(UsageError, match="may not be written"):
            check_outputs([target])


def test_slugs_are_safe_and_unique():
    taken: set[str] = set()
    found = [slug(name, taken) for name in (*HOSTILE.values(), "A b", "a_b", "Grün", "碰撞")]
    assert len(set(found)) == len(found)
    assert found[-4:] == ["a-b", "a-b-2", "grun", "unnamed-2"]
    assert all(set(name) <= set("abcdefghijklmnopqrstuvwxyz0123456789-") for name in found)
