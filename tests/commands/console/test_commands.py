"""The commands from a user's view: what they print, write and return."""

from __future__ import annotations

import json
import re
from dataclasses import asdict, fields
from pathlib import Path

import pytest

from cdtool.base.exit_status import STATUSES_OF
from cdtool.detectors import DETECTORS
from cdtool.results.results import SCHEMA_VERSION
from tests.command import cdtool, keys, one_line

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize("command", STATUSES_OF)
def test_every_help_contains_an_example_and_exits_with_0(command):
    done = cdtool(*command.split(), "--help")
    assert done.status == 0
    assert "Example: cdtool" in one_line(done.out)
    samples = re.findall(r"sample_logs/\S+", one_line(done.out))
    assert not [path for path in samples if not list(ROOT.glob(path.strip("'")))]


def test_the_version_is_shown():
    from cdtool import __version__

    assert cdtool("--version").out.strip() == f"cdtool {__version__}"


def test_info_shows_columns_without_and_channels_with_a_machine_file(gate_folder):
    log = gate_folder / "stiff" / "01.csv"
    plain = cdtool("info", log)
    assert plain.status == 0 and "i_motor" in plain.out and "separator comma" in plain.out
    mapped = cdtool("info", log, "--machine", gate_folder / "machine.toml")
    assert mapped.status == 0
    for word in (
        "torque",
        "speed",
        "m/s",
        "1000",
        "fits the derivative of the speed",
        "friction takes power",
    ):
        assert word in mapped.out
    (values,) = json.loads(cdtool("info", log, "--machine", gate_folder / "machine.toml", "--json").out)
    by_name = {channel["name"]: channel for channel in values["channels"]}
    assert by_name["speed"]["rate_hz"] == pytest.approx(1000.0)
    assert by_name["force"]["maximum"] > 3000.0


def test_info_finds_an_accelerometer_that_is_mounted_the_other_way_round(gate_folder, tmp_path):
    text = (gate_folder / "machine.toml").read_text().replace('unit = "g", scale = -1', 'unit = "g", scale = 1')
    (tmp_path / "m.toml").write_text(text)
    done = cdtool("info", gate_folder / "free" / "01.csv", "--machine", tmp_path / "m.toml")
    assert "loss: acceleration: has the opposite sign of the derivative of the speed" in done.out
    assert "reverse the sign of its scale" in done.out  # it may be -1 already
    text = text.replace('unit = "g", scale = 1', 'unit = "m/s2", scale = -1')
    (tmp_path / "m.toml").write_text(text)
    done = cdtool("info", gate_folder / "free" / "01.csv", "--machine", tmp_path / "m.toml")
    assert "times the derivative of the speed (a factor as between g and m/s2)" in done.out


def test_learning_writes_a_signature_file_and_shows_its_class(feekf_signature, gate_folder, tmp_path):
    values = json.loads(feekf_signature.read_text())
    assert values["detector"]["name"] == "friction_ekf" and values["unit"] == "N s/m"
    assert len(values["runs"]) == 11 and all(len(run["sha256"]) == 64 for run in values["runs"])
    logs = sorted((gate_folder / "free").glob("*.csv"))
    machine = gate_folder / "machine.toml"
    done = cdtool("learn-signature", *logs, "-m", machine, "-d", "gm", "-o", tmp_path / "gm.json", "--json")
    assert json.loads(done.out)["classes"] == [
        {"direction": 1, "nominal_speed": pytest.approx(0.2, rel=0.01), "runs": 11}
    ]


def test_detecting_an_impact_shows_time_and_latency_and_draws(gate_folder, feekf_signature, tmp_path):
    plot = tmp_path / "out.png"
    arguments = ("-m", gate_folder / "machine.toml", "--signature", feekf_signature)
    done = cdtool("detect", gate_folder / "stiff" / "01.csv", *arguments, "--plot", plot)
    assert done.status == 0 and "alarm" in done.out and plot.read_bytes()[:4] == b"\x89PNG"
    (values,) = json.loads(cdtool("detect", gate_folder / "stiff" / "01.csv", *arguments, "--json").out)
    alarm, contact = values["alarms"][0], values["contacts"][0]
    assert values["verdict"] == "alarm" and 0.02 < alarm["time_s"] - contact["onset_s"] < 0.05
    quiet = cdtool("detect", gate_folder / "holdout" / "01.csv", *arguments)
    assert quiet.status == 0 and "no alarm" in quiet.out


def test_detecting_with_a_hand_set_limit(gate_folder):
    log = gate_folder / "stiff" / "01.csv"
    machine = ("-m", gate_folder / "machine.toml")
    done = cdtool("detect", log, *machine, "-d", "gm", "--set=threshold.limits=250", "--json")
    (values,) = json.loads(done.out)
    assert values["alarms"][0]["limit"] == 250.0
    assert values["contacts"][0]["outcome"] == "detected" and values["contacts"][0]["latency_ms"] > 20.0
    high = cdtool("detect", log, *machine, "-d", "gm", "--set=threshold.limits=1e6")
    assert high.status == 0 and "missed" in high.out and "contact at" in high.out
    for wrong in (
        ("--set=threshold.limits=250"),
        ("-d", "gm"),
        ("-d", "gm", "--set=threshold.limits=many"),
        ("-d", "gmm", "--set=threshold.limits=3"),
    ):
        assert cdtool("detect", log, *machine, *wrong).status == 2


def test_the_benchmark_writes_results_and_a_report_folder(gate_folder, tmp_path):
    results, report = tmp_path / "results.json", tmp_path / "report"
    done = cdtool("benchmark", gate_folder / "benchmark.toml", "-o", results, "-o", report)
    assert done.status == 0, done.err
    files = len(list(report.iterdir()))
    assert "friction_ekf" in done.out and f"{files} files in {report}/; open {report}/report.html" in done.out
    values = json.loads(results.read_text())
    assert values["schema_version"] == SCHEMA_VERSION
    assert len(values["contacts"]) == 20 and len(values["exposure"]) == 15
    stiff = {c["detector"]: c["latency_ms"] for c in values["contacts"] if c["recording"] == "stiff/01.csv"}
    assert stiff["pure_inertia"] < stiff["friction_ekf"] < stiff["momentum"] < stiff["pure_torque"]
    wanted = {"recording", "group", "detector", "joint", "onset_s", "onset_uncertainty_s", "alarm_s", "latency_ms"}
    assert wanted | {"outcome", "force_at_alarm_n", "peak_force_n"} <= set(values["contacts"][0])
    provenance = values["provenance"]
    assert provenance["tool_version"] and len(provenance["learned_sha256"]) == 11
    assert len(values["recordings"]) == 6 and len(values["recordings"][0]["sha256"]) == 64
    assert provenance["gains"]["momentum"] == asdict(DETECTORS.load("momentum")())
    names = {path.name for path in report.iterdir()}
    assert {"report.html", "report.md", "junit.xml", "contacts.csv", "results.json", "latency.png", "amoc.png"} <= names


def test_reports_are_written_again_from_the_results_only(gate_folder, tmp_path):
    folder = tmp_path / "first"
    assert cdtool("benchmark", gate_folder / "benchmark.toml", "-o", folder).status == 0
    done = cdtool("report", folder / "results.json", "-o", tmp_path / "again.html", "-o", tmp_path / "again.json")
    assert done.status == 0 and "friction_ekf" in done.out, done.err
    assert (tmp_path / "again.html").read_bytes() == (folder / "report.html").read_bytes()
    assert (tmp_path / "again.json").read_bytes() == (folder / "results.json").read_bytes()
    assert cdtool("report", folder / "results.json", "-o", tmp_path / "second").status == 0
    for path in folder.iterdir():
        assert (tmp_path / "second" / path.name).read_bytes() == path.read_bytes(), path.name
    traces = "results.traces.json.gz"
    assert (tmp_path / "again.traces.json.gz").read_bytes() == (folder / traces).read_bytes()


def test_traces_of_other_results_are_refused(gate_folder, tmp_path):
    file = gate_folder / "benchmark.toml"
    for name, detectors in (("one", "gm"), ("two", "pt")):
        assert cdtool("benchmark", file, "--detectors", detectors, "-o", tmp_path / f"{name}.json").status == 0
    (tmp_path / "two.traces.json.gz").write_bytes((tmp_path / "one.traces.json.gz").read_bytes())
    done = cdtool("report", tmp_path / "two.json")
    assert done.status == 2 and "two.traces.json.gz: belongs to other results" in done.err


def test_a_report_without_traces_says_so_and_a_damaged_file_is_one_line(gate_folder, tmp_path):
    assert cdtool("benchmark", gate_folder / "benchmark.toml", "-o", tmp_path / "r.json").status == 0
    (tmp_path / "r.traces.json.gz").unlink()
    done = cdtool("report", tmp_path / "r.json", "-o", tmp_path / "r.html")
    assert done.status == 0 and "r.traces.json.gz is missing" in done.err
    (tmp_path / "r.json").write_text("{}")
    broken = cdtool("report", tmp_path / "r.json")
    assert broken.status == 2 and broken.err.count("\n") == 1 and "not a results file" in broken.err


def benchmark_with(gate_folder: Path, tmp_path: Path, old: str, new: str) -> Path:
    text = (gate_folder / "benchmark.toml").read_text().replace('"machine.toml"', f'"{gate_folder}/machine.toml"')
    for group in ("free", "holdout", "stiff", "soft"):
        text = text.replace(f'"{group}/', f'"{gate_folder}/{group}/')
    old = old.replace("GATE", str(gate_folder))
    assert old in text
    path = tmp_path / "benchmark.toml"
    path.write_text(text.replace(old, new.replace("GATE", str(gate_folder))))
    return path


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"pi", "feekf"', '"pii", "feekf"', ("pii", "pi")),
        ("[learn]", "[lern]", ("lern: unknown key", "did you mean learn")),
        ('"GATE/stiff/*.csv"', '"GATE/stif/*.csv"', ("impacts.stiff.logs", "no file matches")),
        ('["GATE/stiff/*.csv"]', "[]", ("impacts.stiff.logs", "is empty")),
        ("above_n = 20.0", "above_n = -1", ("onset.above_n", "above 0")),
        ("back_to_n = 8.0", "back_to_n = 30.0", ("onset.back_to_n", "more than above_n")),
        ("above_n", "above", ("onset.above", "above_n")),
        ("[onset]", '[signature]\nforce = "no"\n[onset]', ("signature.force", "true or false")),
        ("[onset]", "[activation]\ndebounce = 2.6\n[onset]", ("activation.debounce", "whole number")),
        ("machine.toml", "machine.tml", ("machine.tml", "no such file")),
    ],
)
def test_a_wrong_benchmark_file_is_one_line_naming_the_key(gate_folder, tmp_path, old, new, words):
    done = cdtool("benchmark", benchmark_with(gate_folder, tmp_path, old, new))
    assert done.status == 2
    assert done.err.count("\n") == 1 and all(word in done.err for word in words), done.err


def test_an_unknown_output_is_refused_before_any_work(gate_folder, tmp_path):
    done = cdtool("benchmark", gate_folder / "benchmark.toml", "-o", tmp_path / "results.xlsx")
    assert done.status == 2 and ".json" in done.err


def test_the_list_shows_detectors_with_gains_units_and_defaults():
    entries = {entry["name"]: entry for entry in json.loads(cdtool("list", "detectors", "--json").out)}
    assert list(entries) == DETECTORS.names()
    assert entries["momentum"]["short_name"] == "gm"
    (bandwidth,) = fields(DETECTORS.load("momentum"))
    (gain,) = entries["momentum"]["gains"]
    assert (gain["name"], gain["default"], gain["unit"]) == ("bandwidth", bandwidth.default, "rad/s")
    for kind in ("thresholds", "machines", "formats", "writers"):
        assert cdtool("list", kind).status == 0
    assert cdtool("list", "detector").status == 2


def test_simulating_is_reproducible_and_refuses_a_folder_that_is_in_use(tmp_path):
    arguments = ("simulate", "gate", *keys(free=1, holdout=0, stiff=1, soft=0), "--seed", 3)
    for name in ("a", "b"):
        done = cdtool(*arguments, "-o", tmp_path / name)
        assert done.out.startswith("2 recordings, machine.toml and contacts.csv written")
    for path in sorted((tmp_path / "a").rglob("*.*")):
        assert path.read_bytes() == (tmp_path / "b" / path.relative_to(tmp_path / "a")).read_bytes(), path
    assert cdtool(*arguments, "-o", tmp_path / "a").status == 2
    more = cdtool("simulate", "gate", *keys(free=2, holdout=0, stiff=0, soft=0), "--seed", 3, "-o", tmp_path / "c")
    assert more.status == 0
    assert (tmp_path / "c" / "free" / "01.csv").read_bytes() == (tmp_path / "a" / "free" / "01.csv").read_bytes()


def test_the_help_shows_text_in_brackets():
    assert "force there [m]" in one_line(cdtool("detect", "--help").out)


def test_an_option_with_an_empty_value_is_an_error(gate_folder, tmp_path):
    file = gate_folder / "benchmark.toml"
    for arguments in (("--false-alarm-budget", ""), ("--detectors", ""), ("-o", "")):
        done = cdtool("benchmark", file, *arguments)
        assert done.status == 2 and done.err.count("\n") == 1, (arguments, done.err)


def write_at_half_speed(gate_folder: Path, path: Path) -> None:
    """The first free run with measured and reference motion halved."""
    lines = (gate_folder / "free" / "01.csv").read_text().splitlines()
    slow = [lines[0]]
    for line in lines[1:]:
        cells = line.split(",")
        for column, digits in ((2, 3), (3, 5), (4, 6), (6, 3)):
            cells[column] = f"{float(cells[column]) / 2:.{digits}f}"
        slow.append(",".join(cells))
    path.write_text("\n".join(slow) + "\n")


def test_a_stray_run_of_another_speed_is_left_out_and_the_others_are_learned(gate_folder, tmp_path):
    write_at_half_speed(gate_folder, tmp_path / "slow.csv")
    logs = sorted((gate_folder / "free").glob("*.csv"))
    machine = ("-m", gate_folder / "machine.toml")
    done = cdtool("learn-signature", *logs, tmp_path / "slow.csv", *machine, "-d", "gm", "-o", tmp_path / "s.json")
    assert done.status == 3 and "slow.csv" in done.err and "forward at 0.1 m/s" in done.err
    assert len(json.loads((tmp_path / "s.json").read_text())["runs"]) == 11


def test_a_signature_of_other_gains_is_refused(gate_folder, feekf_signature, tmp_path):
    text = (gate_folder / "machine.toml").read_text() + "\n[detectors.feekf]\nminimum_speed = 0.04\n"
    (tmp_path / "machine.toml").write_text(text)
    log = gate_folder / "stiff" / "01.csv"
    done = cdtool("detect", log, "-m", tmp_path / "machine.toml", "-s", feekf_signature)
    assert done.status == 2 and "minimum_speed" in done.err
