"""The docs are correct: every command runs, every example has its output, every link and key exists."""

from __future__ import annotations

import doctest
import json
import re
import runpy
import shlex
import shutil
import statistics
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from cdtool.base.errors import ConfigurationError
from cdtool.commands.scoring.benchmark_file import read_benchmark_file
from cdtool.detectors import DETECTORS
from cdtool.formats.channels.channel_map import ChannelMap
from cdtool.formats.machine_file import read_machine_file
from cdtool.machines import MACHINES
from cdtool.recordings.recording import CHANNELS
from cdtool.recordings.units import UNITS
from tests.command import Outcome, cdtool
from tests.data_folder import DATA, UR10E_LOGS, needs_data
from tests.project.pages import (
    DOCS,
    FENCE,
    PAGES,
    ROOT,
    check_detector_page,
    docs_script,
    machine_files,
    name_of,
    toml_blocks,
)

# Lines of shell blocks that set something up or take long: run by CI or by hand, not here.
NOT_RUN_HERE = ("python3 -m venv ", "python benchmarks/", "python docs/make_")
# Of the recordings that an example writes the later commands of its page get so many: each is learned from for every
# other one. What the page says of all of them is checked by tests/whole_runs/test_first_log.py.
FEWER = {"docs/examples/robot_collisions.py": ("hits/hit_*.csv", 10)}

_LINK = re.compile(r"\[[^\]]*\]\((?P<target>[^)\s]+)\)")
_FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


@dataclass(frozen=True)
class Step:
    """A command line or a Python example of a page, and its expected exit status."""

    kind: str
    text: str
    status: int = 0


def steps_of(page: Path) -> Iterator[Step]:
    for block in FENCE.finditer(page.read_text(encoding="utf-8")):
        body, status = block["body"], int(block["status"] or 0)
        if block["kind"] == "python":
            yield Step("python", body)
        elif block["kind"] == "console":
            for line in re.findall(r"^\$ (.*)$", body, re.MULTILINE):
                yield Step("command", line, status)
        elif block["kind"] == "sh":
            for line in body.replace("\\\n", " ").splitlines():
                if line.strip() and not line.startswith(("#", *NOT_RUN_HERE)):
                    yield Step("command", line, status)


def run_command(line: str) -> Outcome:
    """Run a line like a shell: variables and wildcards expanded, in the current folder; quoted words as they are."""
    words: list[str] = []
    line = line.replace("$CDTOOL_DATA", str(DATA))
    for word, written in zip(shlex.split(line), shlex.split(line, posix=False), strict=True):
        matches = sorted(map(str, Path().glob(word))) if "*" in word and not written.startswith("'") else [word]
        assert matches, f"nothing matches {word} in: {line}"
        words += matches
    if words[0] == "cdtool":
        return cdtool(*words[1:])
    assert words[0] == "python" and words[1].startswith("docs/examples/"), f"this test cannot run: {line}"
    kept, status = sys.argv, 0
    sys.argv = words[1:]
    try:
        runpy.run_path(words[1], run_name="__main__")
    except SystemExit as end:
        status = int(end.code or 0)
    finally:
        sys.argv = kept
    if words[1] in FEWER:
        leave_fewer(*FEWER[words[1]])
    return Outcome(status, "", "")


def leave_fewer(pattern: str, count: int) -> None:
    written = sorted(Path().glob(pattern))
    assert len(written) > count, f"{pattern}: {len(written)} recordings"
    for path in written[count:]:
        path.unlink()


def run_example(text: str, names: dict[str, object], page: str) -> None:
    """Run a Python block: as a doctest if it begins with a prompt, else as a program."""
    if not text.lstrip().startswith(">>>"):
        exec(compile(text, page, "exec"), names)
        return
    test = doctest.DocTestParser().get_doctest(text, names, page, page, 0)
    said: list[str] = []
    runner = doctest.DocTestRunner(optionflags=_FLAGS, verbose=False)
    failed = runner.run(test, out=said.append, clear_globs=False).failed
    names.update(test.globs)
    assert not failed, "".join(said)


Printed = dict[str, str]  # by the commands of a page, whose claims are checked against it


def printed_by(printed: Printed, start: str) -> str:
    (out,) = [out for line, out in printed.items() if line.startswith(start)]
    return out


def the_tables_of_choosing_are_what_the_runs_gave() -> None:
    both = (("stiff", "soft"), 1)
    columns = {"results.json": both, "arm1.json": both, "arm2.json": (("stiff", "soft"), 3)}
    rows: dict[int, dict[str, list[str]]] = {2: {}, 4: {}}
    for line in (DOCS / "choosing.md").read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if re.match(r"\| `\w+` \|", line) and len(cells) - 1 in rows:
            rows[len(cells) - 1][cells[0].strip("`")] = cells
    for name, (groups, first) in columns.items():
        results = json.loads(Path(name).read_text(encoding="utf-8"))
        stated = rows[2 if name == "results.json" else 4]
        assert sorted(stated) == sorted(results["detectors"])
        assert not results["false_alarms"]
        for detector, cells in stated.items():
            for group, cell in zip(groups, cells[first:], strict=False):
                seen = [c for c in results["contacts"] if (c["detector"], c["group"]) == (detector, group)]
                assert len(seen) == 15
                agrees_with(cell, seen)


def agrees_with(cell: str, contacts: list[dict[str, Any]]) -> None:
    """Check a cell such as `27 ± 1`, `116 ± 5, 11 missed`, `30 missed` or `not assessable` against the outcomes."""
    found = re.fullmatch(r"(?:(\d+) ± (\d+))?(?:, )?(?:(\d+) missed)?(not assessable)?", cell)
    assert found and cell, cell
    mean, deviation, missed, blind = found.groups()
    outcomes = [contact["outcome"] for contact in contacts]
    assert outcomes.count("missed") == int(missed or 0), cell
    assert outcomes.count("not_assessable") == (len(contacts) if blind else 0), cell
    latencies = [contact["latency_ms"] for contact in contacts if contact["outcome"] == "detected"]
    assert bool(mean) == bool(latencies), cell
    if latencies:
        assert statistics.mean(latencies) == pytest.approx(float(mean), abs=1.5), cell
        assert statistics.stdev(latencies) == pytest.approx(float(deviation), abs=1.5), cell


def a_narrow_tracking_limit_misses_the_stiff_impacts_as_stated() -> None:
    stated = (DOCS / "detectors" / "desired-dynamics.md").read_text(encoding="utf-8")
    limit = re.search(r"with `tracking_limit = (\S+)`\s+all 15 stiff impacts .* are missed", stated)
    assert limit
    gate = Path("gate")
    machine = (gate / "machine.toml").read_text(encoding="utf-8")
    (gate / "narrow.toml").write_text(f"{machine}\n[detectors.ddd]\ntracking_limit = {limit[1]}\n", encoding="utf-8")
    text = (gate / "benchmark.toml").read_text(encoding="utf-8").replace('"machine.toml"', '"narrow.toml"')
    text = re.sub(r"^\[(?:holdout|impacts\.soft)\].*\nlogs = .*\n", "", text, flags=re.MULTILINE)
    (gate / "narrow_benchmark.toml").write_text(text, encoding="utf-8")
    assert cdtool("benchmark", gate / "narrow_benchmark.toml", "--detectors", "ddd", "-o", "narrow.json").status == 0
    contacts = json.loads(Path("narrow.json").read_text(encoding="utf-8"))["contacts"]
    assert [c["outcome"] for c in contacts if c["group"] == "stiff"] == ["missed"] * 15


def choosing_says_what_the_runs_gave(_: Printed) -> None:
    the_tables_of_choosing_are_what_the_runs_gave()
    a_narrow_tracking_limit_misses_the_stiff_impacts_as_stated()


def the_thesis_rule_alarms_in_every_impact_free_run(_: Printed) -> None:
    gate = Path("gate")
    machine, free, holdout = gate / "machine.toml", sorted(gate.glob("free/*")), sorted(gate.glob("holdout/*"))
    for detector in ("feekf", "gm", "igm", "pi", "pt"):
        rule = ("-m", machine, "-d", detector, "--set=signature.rule=thesis", "-o", "rule.json")
        assert cdtool("learn-signature", *free, *rule).status == 0
        found = json.loads(cdtool("detect", *holdout, "-m", machine, "-s", "rule.json", "--json").out)
        assert [item["verdict"] for item in found] == ["alarm"] * 40, detector


def the_alarms_of_the_robot_with_its_model_are_as_stated() -> None:
    text = (DOCS / "ur-rtde.md").read_text(encoding="utf-8")
    limits = ("-d", "gm", "--set=threshold.limits=31.8,29.2,11.3,3.2,2.6,2.9", "--set=activation.debounce=3", "--json")
    log = UR10E_LOGS / "link4.csv.gz"
    (found,) = json.loads(cdtool("detect", log, "-m", UR10E_LOGS / "machine.toml", *limits).out)
    stated = re.findall(r"^\| ([\d.]+) s \| joint (\d) \| ([\d.]+) \|", text, re.MULTILINE)
    rows = [(f"{a['time_s']:.3f}", a["joint"].removeprefix("joint"), a["time_s"] - 3262.867) for a in found["alarms"]]
    assert [(time, joint, f"{late:.2f}") for time, joint, late in rows] == stated


def the_alarms_of_the_rtde_logs_are_as_stated(printed: str) -> None:
    stated = re.findall(r"^rtde/\S+ +(?:no )?alarm .*$", (DOCS / "ur-rtde.md").read_text("utf-8"), re.MULTILINE)
    assert len(stated) == 5
    assert [" ".join(row.split()) for row in stated] == [
        " ".join(row.split()) for row in printed.splitlines() if row.startswith("rtde/")
    ]


def the_alarms_of_the_robot_are_as_stated(printed: Printed) -> None:
    the_alarms_of_the_rtde_logs_are_as_stated(printed_by(printed, "cdtool detect rtde/"))
    the_alarms_of_the_robot_with_its_model_are_as_stated()


def the_latencies_of_the_gate_with_a_force_meter_are_as_stated(printed: Printed) -> None:
    lines = printed_by(printed, "cdtool benchmark yard/").splitlines()
    stated = re.findall(r"^stiff .*$", (DOCS / "gate-with-force-meter.md").read_text("utf-8"), re.MULTILINE)
    assert len(stated) == 3
    for row in stated:  # group, detector, median, range, n, missed
        assert any(" ".join(line.split()).startswith(" ".join(row.split())) for line in lines), row


def the_alarms_in_the_real_recordings_are_as_stated(_: Printed) -> None:
    assert DATA is not None
    text = (DOCS / "real-recordings.md").read_text(encoding="utf-8")
    limits = ("-d", "pt", "--set=threshold.limits=33,inf,53,inf,inf,inf", "--set=activation.debounce=2")
    limits = ("-m", "docs/examples/ur10e.toml", *limits, "--json")
    link4 = json.loads(cdtool("detect", UR10E_LOGS / "link4.csv.gz", *limits).out)
    times = [f"{alarm['time_s'] - 3262.867:.3f}" for alarm in link4[0]["alarms"]]
    assert times == ["3.576", "4.208", "9.702", "9.712", "16.628", "16.958"]
    assert all(time in text for time in times)
    free = json.loads(cdtool("detect", UR10E_LOGS / "no_torque.csv.gz", *limits).out)
    static = json.loads(cdtool("detect", UR10E_LOGS / "ur-static.csv.gz", *limits).out)
    assert (len(free[0]["alarms"]), len(static[0]["alarms"])) == (2, 0)
    emps = ("-m", "docs/examples/emps.toml", "--set=operations=motion", "--json")
    learned, limit = {1, 2}, {0}
    by_hand = (limit, "-d", "gm", "--set=threshold.limits=15")
    tried = ((learned, "-s", "emps.gm.json"), (learned, "-s", "emps.pt.json"), by_hand)
    for alarms, *threshold in tried:
        strokes = json.loads(cdtool("detect", DATA / "emps" / "DATA_EMPS_PULSES.mat", *emps, *threshold).out)
        assert len(strokes) == 8 and {len(stroke["alarms"]) for stroke in strokes} == alarms, threshold


def the_table_of_the_readme_is_what_its_benchmark_prints(printed: Printed) -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(re.findall(r"^(?:stiff|soft) +\w+ +\d", text, re.MULTILINE)) == 10
    assert docs_script("make_results").with_rows(text, printed_by(printed, "cdtool benchmark ")) == text, (
        "run python docs/make_results.py"
    )


def the_examples_of_explain_are_what_it_prints(printed: Printed) -> None:
    shown = re.findall(r"^```text\n(.*?)^```$", (DOCS / "explain.md").read_text("utf-8"), re.MULTILINE | re.DOTALL)
    explained = [out for line, out in printed.items() if line.startswith("cdtool explain ")]
    assert len(shown) == 2
    for text, out in zip(shown, explained, strict=True):
        assert [line.rstrip() for line in out.split("\nwritten: ")[0].rstrip().splitlines()] == text.splitlines()


def the_ranking_of_the_study_is_what_it_prints(printed: Printed) -> None:
    (block,) = re.findall(r"^```console\n(.*?)^```$", (DOCS / "study.md").read_text("utf-8"), re.MULTILINE | re.DOTALL)
    command, *shown = block.removeprefix("$ ").splitlines()
    assert len(shown) >= 9 and shown[-1] == "..."
    lines = [line.rstrip() for line in printed[command].splitlines()]
    assert [line.rstrip() for line in shown[:-1]] == lines[: len(shown) - 1]


CLAIMS: dict[str, Callable[[Printed], None]] = {
    "README.md": the_table_of_the_readme_is_what_its_benchmark_prints,
    "docs/choosing.md": choosing_says_what_the_runs_gave,
    "docs/signature.md": the_thesis_rule_alarms_in_every_impact_free_run,
    "docs/ur-rtde.md": the_alarms_of_the_robot_are_as_stated,
    "docs/gate-with-force-meter.md": the_latencies_of_the_gate_with_a_force_meter_are_as_stated,
    "docs/real-recordings.md": the_alarms_in_the_real_recordings_are_as_stated,
    "docs/explain.md": the_examples_of_explain_are_what_it_prints,
    "docs/study.md": the_ranking_of_the_study_is_what_it_prints,
}


RECORDINGS = ("emps/DATA_EMPS.mat", "emps/DATA_EMPS_PULSES.mat")


def page_with_its_recordings(page: Path) -> object:
    real = any("$CDTOOL_DATA" in step.text for step in steps_of(page))
    return pytest.param(page, marks=[needs_data(*RECORDINGS)] if real else [], id=name_of(page))


@pytest.mark.usefixtures("checkout")
@pytest.mark.parametrize("page", [page_with_its_recordings(page) for page in PAGES if any(steps_of(page))])
def test_every_command_and_example_of_a_page_runs_in_order(page):
    steps, name = list(steps_of(page)), name_of(page)
    names: dict[str, object] = {}
    printed: Printed = {}
    for step in steps:
        if step.kind == "python":
            run_example(step.text, names, name)
            continue
        done = run_command(step.text)
        assert done.status == step.status, f"{step.text}\n{done.out}\n{done.err}"
        assert "Traceback" not in done.out + done.err
        printed[step.text] = done.out
    if name in CLAIMS:
        CLAIMS[name](printed)


def test_the_pages_show_commands_and_examples():
    kinds = [step.kind for page in PAGES for step in steps_of(page)]
    assert kinds.count("command") > 80 and kinds.count("python") > 20
    assert set(CLAIMS) <= {name_of(page) for page in PAGES}


def test_every_link_and_image_resolves():
    checked = 0
    for page in [*PAGES, ROOT / "sample_logs" / "README.md", ROOT / "CONTRIBUTING.md"]:
        prose = FENCE.sub("", page.read_text(encoding="utf-8"))
        for target in _LINK.findall(prose):
            if re.match(r"https?://", target):
                continue
            path, _, anchor = target.partition("#")
            linked = (page.parent / path).resolve() if path else page
            assert linked.exists(), f"{name_of(page)}: {target}"
            if anchor:
                headings = re.findall(r"^#+ (.*)$", linked.read_text(encoding="utf-8"), re.MULTILINE)
                slugs = [re.sub(r"[^\w\- ]", "", text.lower()).replace(" ", "-") for text in headings]
                assert anchor in slugs, f"{name_of(page)}: {target}"
            checked += 1
    assert checked > 60


def test_every_page_and_image_is_reached_and_no_image_is_large():
    listed = {
        (index.parent / target).resolve()
        for index in DOCS.rglob("index.md")
        for target in _LINK.findall(index.read_text(encoding="utf-8"))
    }
    everything = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    for page in DOCS.rglob("*.md"):
        assert page == DOCS / "index.md" or page.resolve() in listed, page
    images = list((DOCS / "images").iterdir())
    assert images
    for image in images:
        assert f"images/{image.name})" in everything, f"{image.name} is used on no page"
        assert image.stat().st_size < 200_000, image.name


def test_the_lists_of_detectors_and_formats_are_made_from_the_registry_and_their_pages():
    for file, text in runpy.run_path(str(DOCS / "make_lists.py"))["files"]().items():
        assert file.read_text(encoding="utf-8") == text, f"{name_of(file)}: run python docs/make_lists.py"


def test_every_detector_has_a_page_whose_table_names_each_gain_with_default_and_unit():
    detectors = json.loads(cdtool("list", "detectors", "--json").out)
    assert len(detectors) >= len(DETECTORS.table)
    for detector in detectors:
        text = (DOCS / "detectors" / f"{detector['name'].replace('_', '-')}.md").read_text(encoding="utf-8")
        check_detector_page(detector, text)


def named_in(page: str) -> set[str]:
    return set(re.findall(r"`([^`\n]+)`", FENCE.sub("", (DOCS / page).read_text(encoding="utf-8"))))


def known_keys(read: Callable[[Path], object], text: str, folder: Path) -> set[str]:
    """Return the keys listed by an error about the unknown key `zzz`."""
    file = folder / "asked.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigurationError, match=r"unknown (key|channel)") as fault:
        read(file)
    return set(fault.value.hint.partition("known: ")[2].split(", "))


LINEAR = '[machine]\ntype = "linear_axis"\ntransmission_ratio = 1e-3\n'
SECTIONS = {
    # The keys of each machine, by the examples of the page.
    **{
        f"{kind} {number}": text.replace("[machine]\n", "[machine]\nzzz = 1\n", 1)
        for number, (kind, text) in enumerate(machine_files(), 1)
    },
    "file": LINEAR + "[zzz]",
    "channels": LINEAR + "[channels]\ntime = {rate_hz = 1}\nzzz = {}",
    "time": LINEAR + '[channels]\ntime = {column = "t", unit = "s", zzz = 1}',
    "rate": LINEAR + "[channels]\ntime = {rate_hz = 1, zzz = 1}",
    "channel": LINEAR + '[channels]\ntime = {rate_hz = 1}\nforce = {column = "f", unit = "N", zzz = 1}',
    "duty": LINEAR
    + '[channels]\ntime = {rate_hz = 1}\ntorque = {column = "u", unit = "V", kind = "duty", resistance = 1, '
    + "back_emf_constant = 0, torque_constant = 1, zzz = 1}",
    "clock": LINEAR + "[channels.mcap]\ntime = {zzz = 1}",
    "topic": LINEAR + '[channels.mcap]\nforce = {topic = "/f", field = "data", zzz = 1}',
}


@pytest.mark.parametrize("section", SECTIONS)
def test_the_machine_file_page_names_every_key(section, tmp_path):
    if section.startswith("urdf_robot"):
        pytest.importorskip("pinocchio")
        shutil.copy(DOCS / "examples" / "scara.urdf", tmp_path)
    known = known_keys(read_machine_file, SECTIONS[section], tmp_path)
    assert known
    words = " ".join(named_in("machine-file.md"))
    headings = (DOCS / "machine-file.md").read_text(encoding="utf-8")
    for key in known:
        assert re.search(rf"\b{key}\b", words) or f"## [{key}" in headings, key


def test_the_machine_file_page_names_every_channel_unit_and_setting():
    named = named_in("machine-file.md")
    assert set(CHANNELS) <= named
    assert set(UNITS) <= named
    assert {"speed_low_pass_hz", "kind", "saturation", "columns"} <= named
    text = (DOCS / "machine-file.md").read_text(encoding="utf-8")
    assert f"default {ChannelMap.speed_low_pass:g}" in text


def test_the_machine_files_on_the_page_are_valid(tmp_path):
    pytest.importorskip("pinocchio")
    shutil.copy(DOCS / "examples" / "scara.urdf", tmp_path)
    kinds = set()
    for i, (kind, text) in enumerate(machine_files()):
        (tmp_path / f"{i}.toml").write_text(text, encoding="utf-8")
        assert read_machine_file(tmp_path / f"{i}.toml").columns.sources
        kinds.add(kind)
    assert kinds == set(MACHINES.names())
    for text in (block for block in toml_blocks(DOCS / "machine-file.md") if "[machine]" not in block):
        (tmp_path / "part.toml").write_text(LINEAR + text, encoding="utf-8")
        assert read_machine_file(tmp_path / "part.toml").gains


def test_the_benchmark_file_page_is_valid_and_names_every_key(tmp_path):
    for item in (ROOT / "sample_logs" / "gate").iterdir():
        (tmp_path / item.name).symlink_to(item)
    text = toml_blocks(DOCS / "benchmark-file.md")[0]
    (tmp_path / "example.toml").write_text(text, encoding="utf-8")
    assert read_benchmark_file(tmp_path / "example.toml").groups == ("stiff", "soft", "holdout")
    words = " ".join(named_in("benchmark-file.md"))
    for section in ("[zzz]", "[signature]\nzzz = 1"):
        known = known_keys(read_benchmark_file, text + section, tmp_path)
        assert known
        for key in known:
            assert re.search(rf"\b{key}\b", words) or f"`[{key}]`" in words, key
    for key in known_keys(read_benchmark_file, text + "zzz = 1", tmp_path):
        assert key in words, key


def test_the_docs_contain_no_local_paths():
    for page in [*PAGES, *DOCS.rglob("*.py"), *DOCS.rglob("*.toml"), ROOT / "sample_logs" / "README.md"]:
        assert not re.search(r"(?<![\w.])/(work|tmp|home|root)\b", page.read_text(encoding="utf-8")), page
