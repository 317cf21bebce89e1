"""From a rig's recordings to a protocol to sign, by the steps that the commands themselves name."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from pathlib import Path

import pytest

from cdtool.base.errors import MistakesError
from cdtool.commands.protocol.of_benchmark import protocol_names
from cdtool.commands.protocol.protocol_file import read_protocol_file
from tests.command import Outcome, cdtool
from tests.synthetic.force_rig import half_sine, write_protocol, write_rig

FORCES = (half_sine(300.0), half_sine(320.0), half_sine(340.0))
FILLED_IN = {
    "type": '"sliding door"',
    "maker": '"A"',
    "serial_number": '"1"',
    "installation": '"hall"',
    "software_version": '"1.0"',
    "tester": '"B"',
    "date": "2026-03-31",
    "place": '"C"',
    "temperature_c": "20",
    "model": '"Rig"',
    "calibrated_on": "2026-01-15",
    "calibration_valid_until": "2027-01-14",
    "range_n": "2000",
    "accuracy_class": '"1"',
    "filter": '"none"',
    "position": '"closing edge"',
    "region": '"gap of 300 mm"',
    "obstacle_stiffness_n_per_mm": "500",
    "contact_area_mm2": "5027",
    "speed_m_per_s": "0.2",
    "profile": '"en_12453_reducing_gap"',
}


def commands(outcome: Outcome) -> list[list[str]]:
    """Return the commands that an output names as next steps."""
    lines = [line.partition(": ") for line in outcome.out.splitlines()]
    return [shlex.split(step)[1:] for word, _, step in lines if word in ("next", "then") and step.startswith("cdtool ")]


def fill_in(path: Path) -> None:
    """Fill in a draft, as a person would."""
    lines = path.read_text(encoding="utf-8").splitlines()
    for number, line in enumerate(lines):
        key, _, value = line.partition(" = ")
        if value.startswith('""') and "FILL IN" in f"{lines[number - 1]}{value}":
            lines[number] = f"{key} = {FILLED_IN[key]}"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def test_from_a_rig_s_logs_to_a_protocol_in_four_commands_each_named_by_the_one_before(tmp_path, monkeypatch):
    write_rig(tmp_path, FORCES)
    monkeypatch.chdir(tmp_path)
    first = cdtool("init", *sorted(Path("edge").glob("*.csv")), "-m", "machine.toml", "-o", "study")
    steps = {words[0]: words for words in commands(first)}
    drafted = cdtool(*steps["protocol"])
    assert drafted.status == 0, drafted.err
    (check,) = commands(drafted)
    incomplete = cdtool(*check)
    assert incomplete.status == 4 and "Missing in protocol.toml" in incomplete.out
    fill_in(tmp_path / "study" / "protocol.toml")
    complete = cdtool(*check)
    assert complete.status == 0, complete.out
    (benchmark,) = commands(complete)
    assert benchmark[0] == "benchmark" and benchmark[-1] == "protocol.pdf"
    made = cdtool(*benchmark[:-1], "protocol.html")
    assert made.status == 0 and "protocol: pass" in made.out, made.out + made.err
    assert "print and sign" in made.out and "PASS" in Path("protocol.html").read_text(encoding="utf-8")


def test_a_benchmark_without_detectors_takes_those_of_the_option_and_else_names_the_protocol(rig, tmp_path):
    path = rig / "without.toml"
    path.write_text((rig / "benchmark.toml").read_text(encoding="utf-8").replace('["gm"]', "[]"), encoding="utf-8")
    refused = cdtool("benchmark", path)
    assert refused.status == 2 and f"cdtool protocol init {path}" in refused.err.replace("\n", " ")
    scored = cdtool("benchmark", path, "--detectors", "gm", "-o", tmp_path / "results.json")
    assert scored.status == 0, scored.err
    assert json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))["detectors"] == ["momentum"]


@pytest.fixture(scope="module")
def rig(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("rig")
    write_rig(folder, FORCES)
    return folder


@pytest.mark.parametrize(
    ("flaws", "status", "word"),
    [({}, 0, "pass"), ({"valid_until": "2026-01-20"}, 4, "incomplete"), ({"repetitions": 4}, 4, "incomplete")],
)
def test_the_exit_status_is_that_of_the_verdict(flaws, status, word, rig, tmp_path):
    path = write_protocol(rig, **flaws)
    made = cdtool("benchmark", rig / "benchmark.toml", "-p", path, "-o", tmp_path / "Prüfprotokoll.html")
    assert (made.status, f"protocol: {word}" in made.out) == (status, True), made.out + made.err


def test_a_failed_protocol_is_the_first_sentence_everywhere_and_exits_with_1(tmp_path):
    write_rig(tmp_path, [half_sine(peak) for peak in (700.0, 710.0, 720.0)])
    benchmark = tmp_path / "benchmark.toml"
    limits = '\n[limits]\n"*.missed" = { max = 3 }\n"*.false_alarms" = { max = 9 }\n'
    benchmark.write_text(benchmark.read_text(encoding="utf-8") + limits, encoding="utf-8")
    targets = [tmp_path / name for name in ("protocol.html", "report.html", "report.md", "junit.xml", "results.json")]
    options = [word for path in targets for word in ("-o", path)]
    made = cdtool("benchmark", benchmark, "-p", write_protocol(tmp_path), *options)
    fail = "est protocol: fail: 1 of 1 measuring points do not pass"
    assert made.status == 1 and made.out.startswith(f"t{fail}; all 2 limits are met")
    document, html, markdown, junit, results = (path.read_text(encoding="utf-8") for path in targets)
    assert fail.partition("fail: ")[2] in document
    assert re.search(rf'<div class="verdict bad">\s*<h1>T{fail}; all 2', html)
    assert (
        markdown.startswith(f"# Collision detection: t{fail}; all 2") and f'"failure" message="t{fail}; all 2' in junit
    )
    assert json.loads(results)["conclusion"]["headline"].startswith(f"t{fail}; all 2")
    again = cdtool("report", targets[-1])
    assert (again.status, again.out.splitlines()[0]) == (1, made.out.splitlines()[0])


@pytest.mark.parametrize(
    ("file", "removed", "named"),
    [
        ("benchmark.toml", r"threshold = .*\n", "learn: is missing"),
        ("machine.toml", r"force = .*\n", "Missing in machine.toml: channels.force"),
    ],
)
def test_check_is_not_complete_where_the_next_command_fails(rig, tmp_path, file, removed, named):
    rig = shutil.copytree(rig, tmp_path / "rig")
    path = write_protocol(rig)
    assert cdtool("protocol", "check", path).status == 0
    text = (rig / file).read_text(encoding="utf-8")
    (rig / file).write_text(re.sub(removed, "", text), encoding="utf-8")
    checked = cdtool("protocol", "check", path)
    assert checked.status == 4
    assert named in " ".join(checked.out.split())


def test_a_protocol_without_its_file_and_a_file_without_a_protocol_name_the_next_step(rig, tmp_path):
    benchmark = rig / "benchmark.toml"
    without = cdtool("benchmark", benchmark, "-o", tmp_path / "protocol.html")
    assert without.status == 2 and "cdtool protocol init" in without.err
    unused = cdtool("benchmark", benchmark, "-p", write_protocol(rig), "-o", tmp_path / "report.html")
    assert unused.status == 2 and "-o protocol.pdf" in unused.err
    other = tmp_path / "other.toml"
    other.write_text("[protocols]\n", encoding="utf-8")
    for wrong in ("[protocols]\n", ""):
        other.write_text(wrong, encoding="utf-8")
        refused = cdtool("protocol", "check", other)
        assert refused.status == 2 and "other.toml" in refused.err and len(refused.err.splitlines()) == 1


def test_a_protocol_file_names_the_key_of_a_missing_file_and_is_no_benchmark_for_a_table_machine(tmp_path):
    text = '[protocol]\nbenchmark = "b.toml"\nlimits = "yard.toml"\n[machine]\ntype = "gate"\n'
    point = "[[protocol.point]]\nrepetition = 4\nspeed_tolerance_percent = 30\n"
    (tmp_path / "protocol.toml").write_text(text + point, encoding="utf-8")
    with pytest.raises(MistakesError) as caught:
        read_protocol_file(tmp_path / "protocol.toml")
    keys = ["machine", "protocol.limits", "protocol.point[1].repetition", "protocol.point[1].speed_tolerance_percent"]
    assert sorted(fault.key for fault in caught.value.mistakes) == keys


@pytest.mark.parametrize(
    ("names", "protocols"),
    [
        (["prot.pdf"], ["prot.pdf"]),
        (["gate 7.HTML", "report.html", "results.json"], ["gate 7.HTML"]),
        (["latency.pdf", "prot.html"], ["prot.html"]),
        (["protocol.pdf", "gate.html"], ["protocol.pdf"]),
        (["report.html", "latency.pdf"], []),
    ],
)
def test_with_p_every_pdf_or_html_is_the_protocol_unless_one_has_its_name(names, protocols):
    documents, others = protocol_names([Path(name) for name in names], is_wanted=True)
    assert [path.name for path in documents] == protocols
    assert [path.name for path in others] == [name for name in names if name not in protocols]
    assert protocol_names([Path("prot.pdf")], is_wanted=False)[0] == []
