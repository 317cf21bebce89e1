"""What the outputs of an identification show, and the files by suffix."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

import cdtool
from cdtool.base.errors import UsageError
from cdtool.commands.identify.files import check_identification_files, write_identification
from cdtool.commands.identify.identifying import IdentifiedMachine
from tests.command import cdtool as command

ROOT = Path(__file__).parents[3]
GATE = ROOT / "sample_logs" / "gate"
LOGS = [GATE / "free" / f"0{number}.csv" for number in (3, 4, 5)]


@pytest.fixture(scope="module")
def identified() -> IdentifiedMachine:
    return cdtool.identify(LOGS, GATE / "machine.toml")


def test_all_outputs_are_written_together(identified: IdentifiedMachine, tmp_path: Path) -> None:
    targets = [tmp_path / f"identified{suffix}" for suffix in (".toml", ".html", ".json")]
    write_identification(identified, targets)
    toml, page, values = (target.read_text(encoding="utf-8") for target in targets)
    assert toml == identified.text
    assert page.count("data:image/png;base64,") == 4
    for words in (
        "Not identifiable from these logs",
        "Prediction of unseen runs",
        "machine.viscous_friction",
        "What the logged motion excites",
    ):
        assert words in page
    assert "<script" not in page
    assert not re.search(r"(src|href)=\"(?!data:|#)", page)
    joint = json.loads(values)["joints"][0]
    (viscous,) = [item for item in joint["not_identifiable"] if item["key"] == "viscous_friction"]
    assert viscous["missing"] == ["second_speed"]
    assert joint["force_error_on_unseen_runs"]["error_of_worst_run"] > 0.0
    assert joint["excitation"]["speeds"] == pytest.approx([0.2], rel=0.05)
    # A report and a JSON may be rewritten, a machine file may not.
    check_identification_files(targets[1:], GATE / "machine.toml")
    with pytest.raises(UsageError, match="already exists"):
        check_identification_files(targets[:1], GATE / "machine.toml")


def test_a_machine_file_in_another_folder_has_the_schema_that_it_names(
    identified: IdentifiedMachine, tmp_path: Path
) -> None:
    drafted = replace(identified, text=f"#:schema ./machine.schema.json\n{identified.text}")
    assert write_identification(drafted, [tmp_path / "m.toml"]) == (tmp_path / "m.toml",)
    assert json.loads((tmp_path / "machine.schema.json").read_text())["title"] == "cdtool machine file"
    (tmp_path / "machine.schema.json").write_text("{}")
    write_identification(drafted, [tmp_path / "m.toml"])
    assert (tmp_path / "machine.schema.json").read_text() == "{}", "one that is there stays"


def test_an_output_that_cannot_be_written_leaves_no_other(identified: IdentifiedMachine, tmp_path: Path) -> None:
    with pytest.raises(UsageError):
        write_identification(identified, [tmp_path / "m.toml", tmp_path / "no_folder" / "m.json"])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (["a.pdf"], "a.pdf"),
        (["a"], "a"),
        (["a.html", "a.html"], "twice"),
        (["nowhere/a.html"], "no folder"),
        (["foreign.html"], "contains no HTML report"),
        (["foreign.json"], "contains no results"),
    ],
)
def test_a_wrong_output_is_refused_before_anything_is_read(tmp_path: Path, names: list[str], message: str) -> None:
    for suffix in (".html", ".json"):
        (tmp_path / f"foreign{suffix}").write_text("of another program", encoding="utf-8")
    before = sorted(tmp_path.iterdir())
    outputs = [part for name in names for part in ("-o", tmp_path / name)]
    done = command("identify", "no_such_log.csv", "-m", GATE / "machine.toml", *outputs)
    assert done.status == 2
    assert len(done.err.strip().splitlines()) == 1
    assert message in done.err
    assert sorted(tmp_path.iterdir()) == before


def test_the_names_of_logs_and_machines_are_text_in_the_page(identified: IdentifiedMachine, tmp_path: Path) -> None:
    hostile = replace(identified, machine="<script>alert(1)</script>")
    write_identification(hostile, [tmp_path / "page.html"])
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "<script" not in page
    assert "&lt;script&gt;" in page


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--payload", "2kg"], "belong together"),
        (["--loaded-logs", "x.csv"], "belong together"),
        *(
            (["--loaded-logs", "x.csv", "--payload", text], f"--payload is '{text}'")
            for text in ("-2kg", "2", "infkg", "2kg@", "2kg:0,1", "2kg@hand:0,inf,1", "2kg:a,b,c", "kg")
        ),
    ],
)
def test_a_payload_without_its_logs_is_one_line(options: list[object], message: str) -> None:
    done = command("identify", LOGS[0], "-m", GATE / "machine.toml", *options)
    assert done.status == 2
    assert len(done.err.strip().splitlines()) == 1
    assert message in done.err
