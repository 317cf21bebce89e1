"""`cdtool init LOG... -o DIR`: a machine file and a benchmark file that run as drafted."""

import json
import shutil
import tomllib
from importlib.util import find_spec
from pathlib import Path

import jsonschema
import pytest

import cdtool as api
from tests.command import cdtool, one_line

ROBOT = Path(__file__).parents[3] / "sample_logs" / "ur10e"


@pytest.fixture
def gate(gate_folder, tmp_path):
    folder = tmp_path / "logs"
    shutil.copytree(gate_folder, folder)
    return folder


def csv_logs(folder, *groups):
    return [log for group in groups for log in sorted((folder / group).glob("*.csv"))]


def drafted(folder):
    return tomllib.loads((folder / "benchmark.toml").read_text(encoding="utf-8"))


def test_the_draft_runs_as_it_is_and_detects_the_impacts(gate, tmp_path):
    done = cdtool("init", *csv_logs(gate, "free", "stiff"), "-o", tmp_path / "study")
    assert done.status == 0, done.err
    assert "cdtool benchmark" in done.out and "cdtool info" in done.out
    values = drafted(tmp_path / "study")
    assert values["machine"] == "machine.toml" and set(values["detectors"]) == {"pt", "pi", "td"}
    assert values["impacts"]["stiff"]["logs"] == ["../logs/stiff/*.csv"]
    run = cdtool("benchmark", tmp_path / "study" / "benchmark.toml", "-o", tmp_path / "r.json")
    assert run.status in (0, 1), run.err
    results = json.loads((tmp_path / "r.json").read_text(encoding="utf-8"))
    assert {row["outcome"] for row in results["contacts"] if row["detector"] == "pure_inertia"} == {"detected"}


def test_logs_are_grouped_by_folder_and_the_free_ones_are_learned_from(gate, tmp_path):
    study = api.init_study(csv_logs(gate, "free", "stiff"), tmp_path / "study", machine=gate / "machine.toml")
    assert study.machine is None and study.machine_path == str(gate / "machine.toml")
    values = drafted(tmp_path / "study")
    free = len(csv_logs(gate, "free"))
    if free >= 10:
        assert "until" not in values["learn"] and "gm" in values["detectors"]
    assert list(values["impacts"]) == ["stiff"] and values["onset"]["above_n"] > 0.0


def test_without_impact_free_logs_it_learns_from_what_is_before_the_contacts(gate, tmp_path):
    logs = csv_logs(gate, "stiff")
    for number in range(2):  # other logs of the same kind
        logs.append(gate / "stiff" / f"9{number}.csv")
        logs[-1].write_text(logs[number].read_text(encoding="utf-8") + "\n", encoding="utf-8")
    api.init_study(logs, tmp_path / "study", machine=gate / "machine.toml")
    values = drafted(tmp_path / "study")
    assert (values["threshold"], values["learn"]["until"]) == ("limit", "onset")
    api.init_study(csv_logs(gate, "stiff")[:2], tmp_path / "two", machine=gate / "machine.toml")
    assert drafted(tmp_path / "two")["threshold"] == "baseline" and "learn" not in drafted(tmp_path / "two")
    for folder in ("study", "two"):
        assert cdtool("benchmark", tmp_path / folder / "benchmark.toml", "--detectors", "gm").status == 0


def test_file_names_make_the_groups_of_a_single_folder(gate, tmp_path):
    mixed = tmp_path / "mixed"
    mixed.mkdir()
    for name, log in zip(("wall_01", "wall_02", "foam_01"), 2 * csv_logs(gate, "stiff"), strict=False):
        shutil.copy(log, mixed / f"{name}.csv")
    api.init_study(sorted(mixed.iterdir()), tmp_path / "study", machine=gate / "machine.toml")
    groups = drafted(tmp_path / "study")["impacts"]
    assert groups == {"foam": {"logs": ["../mixed/foam_01.csv"]}, "wall": {"logs": ["../mixed/wall*.csv"]}}


def test_without_ground_truth_it_writes_a_label_file_to_fill_in(gate, tmp_path):
    text = (gate / "machine.toml").read_text(encoding="utf-8")
    (gate / "blind.toml").write_text("\n".join(line for line in text.splitlines() if "force =" not in line))
    logs = csv_logs(gate, "stiff")
    done = cdtool("init", *logs, "-m", gate / "blind.toml", "-o", tmp_path / "study")
    assert done.status == 0 and "fill in" in done.out and "protocol init" not in done.out
    rows = (tmp_path / "study" / "labels.csv").read_text(encoding="utf-8").splitlines()
    assert rows[0] == "recording,start_s,end_s,uncertainty_s" and len(rows) == 1 + len(logs)
    found = api.detect(logs, gate / "machine.toml", detector="gm", settings={"threshold.limits": 400})
    contacts = {log.name: each.detected.contacts[0] for log, each in zip(logs, found, strict=True)}
    filled = [rows[0], *(f"{row[:-3]},{contacts[row[:-3].rpartition('/')[2]].start},6.9," for row in rows[1:])]
    (tmp_path / "study" / "labels.csv").write_text("\n".join(filled), encoding="utf-8")
    assert cdtool("benchmark", tmp_path / "study" / "benchmark.toml", "--detectors", "gm").status == 0
    again = cdtool("init", *logs, "-m", gate / "blind.toml", "-o", tmp_path / "study", "--force")
    assert again.status == 0 and "labels.csv kept" in again.out  # what was filled in stays
    assert (tmp_path / "study" / "labels.csv").read_text(encoding="utf-8").splitlines() == filled


@pytest.mark.parametrize(("free", "folders"), [("Frei", 1), ("ohne_kontakt", 5), ("run-free", 5), ("no_contact", 1)])
def test_logs_named_free_are_learned_from_and_folders_of_one_log_are_one_group(gate, tmp_path, free, folders):
    """Without ground truth; each of the others in a folder of its own, or all in one."""
    text = (gate / "machine.toml").read_text(encoding="utf-8")
    (gate / "blind.toml").write_text("\n".join(line for line in text.splitlines() if "force =" not in line))
    log = csv_logs(gate, "stiff")[0]
    logs = [tmp_path / free / f"{i}.csv" for i in range(10)]
    logs += [tmp_path / (f"trial_{i}" if folders > 1 else "trial") / f"{i}.csv" for i in range(5)]
    for path in logs:
        path.parent.mkdir(exist_ok=True)
        shutil.copy(log, path)
    api.init_study(logs, tmp_path / "study", machine=gate / "blind.toml")
    made = drafted(tmp_path / "study")
    assert made["learn"]["logs"] == [f"../{free}/*.csv"] and "until" not in made["learn"]
    assert list(made["impacts"]) == ["trial"]
    assert "# CHECK: 10 logs impact-free by their names" in (tmp_path / "study" / "benchmark.toml").read_text()


def test_printed_patterns_of_a_folder_with_blanks_can_be_pasted_into_a_shell(gate, tmp_path):
    (gate / "stiff").rename(gate / "my stiff")
    text = (gate / "machine.toml").read_text(encoding="utf-8").replace("force =", "# force =")
    (gate / "blind.toml").write_text(text, encoding="utf-8")
    done = cdtool("init", *csv_logs(gate, "my stiff"), "-m", gate / "blind.toml", "-o", tmp_path / "study")
    assert "/my stiff/'*.csv --machine" in done.out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("a.csv", "b.csv", "-o", "m.toml"), "--output is the file m.toml, with 2 logs (give a folder: -o study)"),
        (("a.csv", "-m", "x.toml", "-o", "m.toml"), "--output is the file m.toml, with --machine"),
        (("a.csv", "b.csv"), "--output is the file machine.toml, with 2 logs"),
        (("missing.csv", "-o", "study"), "missing.csv"),
        (("a.csv", "-o", "x.txt"), "--output is x.txt (give a machine file, NAME.toml, or a folder without a suffix)"),
        (("a.csv", "--free", "b.csv"), "--output is the file machine.toml, with --free"),
        (("a.csv", "--free", "no/*.csv", "-o", "study"), "no file matches 'no/*.csv'"),
        (("a.csv", "--urdf", "r.urdf", "-m", "m.toml", "-o", "study"), "--urdf and --machine: both describe"),
    ],
)
def test_a_wrong_call_is_one_line(arguments, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = cdtool("init", *arguments)
    assert done.status == 2 and words in one_line(done.err) and "Traceback" not in done.err


def test_logs_given_as_impact_free_are_learned_from_unless_they_show_a_contact(gate, tmp_path):
    (gate / "free").rename(gate / "quiet")
    struck = gate / "quiet" / "99.csv"
    shutil.copy(gate / "stiff" / "01.csv", struck)
    pattern = f"{gate}/quiet/*.csv"
    done = cdtool(
        "init", *csv_logs(gate, "stiff"), "--free", pattern, "-m", gate / "machine.toml", "-o", tmp_path / "s"
    )
    assert done.status == 3 and "99.csv: given as impact-free, but shows 1 contact" in done.err
    values = drafted(tmp_path / "s")
    named = [item for group in ("learn", "holdout") for item in values.get(group, {}).get("logs", [])]
    assert any("quiet/" in item for item in named) and not any("99" in item for item in named)
    assert list(values["impacts"]) == ["stiff"]


@pytest.mark.skipif(find_spec("pinocchio") is None, reason="pinocchio is not installed (cdtool[urdf])")
def test_a_robot_is_drafted_with_the_joints_of_its_urdf(tmp_path):
    log, urdf = ROBOT / "link4.csv.gz", ROBOT / "ur10e.urdf"
    done = cdtool("init", log, "--urdf", urdf, "-o", tmp_path / "m.toml")
    assert done.status == 0, done.err
    machine = tomllib.loads((tmp_path / "m.toml").read_text(encoding="utf-8"))["machine"]
    assert machine["type"] == "urdf_robot" and (tmp_path / machine["urdf"]).resolve() == urdf
    assert machine["joint_map"] == {f"joint_{n}": f"joint{n}" for n in range(1, 7)}
    assert cdtool("info", log, "-m", tmp_path / "m.toml").status == 0
    few = cdtool(
        "init", log, "--urdf", ROBOT.parents[1] / "docs" / "examples" / "scara.urdf", "-o", tmp_path / "f.toml"
    )
    assert few.status == 2 and "has 4 moving joints, the log 6" in few.err


@pytest.mark.parametrize("name", ["study/machine.toml", "study/benchmark.toml", "protocol.toml"])
def test_a_draft_names_the_schema_beside_it_and_follows_it(name, gate, tmp_path):
    assert cdtool("init", *csv_logs(gate, "stiff"), "-o", tmp_path / "study").status == 0
    assert (
        cdtool("protocol", "init", tmp_path / "study" / "benchmark.toml", "-o", tmp_path / "protocol.toml").status == 0
    )
    path = tmp_path / name
    schema = path.with_suffix(".schema.json")
    text = path.read_text(encoding="utf-8")
    assert text.startswith(f"#:schema ./{schema.name}\n")
    validator = jsonschema.Draft7Validator(json.loads(schema.read_text(encoding="utf-8")))
    assert not list(validator.iter_errors(tomllib.loads(text)))


def test_a_schema_that_cdtool_did_not_write_is_kept(gate, tmp_path):
    (tmp_path / "machine.schema.json").write_text("{}", encoding="utf-8")
    done = cdtool("init", csv_logs(gate, "stiff")[0], "-o", tmp_path / "m.toml")
    assert done.status == 2 and "contains no JSON schema of cdtool" in done.err and not (tmp_path / "m.toml").exists()


def test_existing_files_are_replaced_only_with_force(gate, tmp_path):
    logs = csv_logs(gate, "stiff")
    assert cdtool("init", *logs, "-o", tmp_path / "study").status == 0
    again = cdtool("init", *logs, "-o", tmp_path / "study")
    assert again.status == 2 and "benchmark.toml: already exists" in again.err
    assert cdtool("init", *logs, "-o", tmp_path / "study", "--force", "--json").status == 0
