"""Learning from what is before the contacts, with every log scored by what was learned from the others."""

import shutil
from pathlib import Path

import pytest

import cdtool
from cdtool.base.errors import ConfigurationError
from cdtool.commands.detecting.prepared import PreparedDetector
from cdtool.commands.detecting.prepared import prepared as prepare
from cdtool.commands.judging.runs import load_runs
from cdtool.commands.scoring.benchmark import benchmark
from cdtool.commands.scoring.benchmark_file import BenchmarkFile, read_benchmark_file
from cdtool.commands.scoring.learned_thresholds import ThresholdsByLog, learn_thresholds
from cdtool.results.results import Results
from tests.command import cdtool as command
from tests.command import one_line

HEAD = 'machine = "machine.toml"\ndetectors = ["gm"]\nthreshold = "limit"\n'
LEARN = '[learn]\nuntil = "onset"\nlogs = ["stiff/*.csv", "soft/*.csv"]\n'
ONSET = "[onset]\nabove_n = 20.0\nback_to_n = 8.0\n"
GROUPS = '[impacts.stiff]\nlogs = ["stiff/*.csv"]\n[impacts.soft]\nlogs = ["soft/*.csv"]\n'


@pytest.fixture(scope="module")
def gate(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("gate")
    cdtool.simulate_gate(folder, {"free": 2, "stiff": 4, "soft": 3}, seed=5)
    return folder


def setup_of(folder, *parts):
    file = folder / "b.toml"
    file.write_text("".join(parts), encoding="utf-8")
    return read_benchmark_file(file)


def learned_of(setup):
    runs = load_runs(setup.learn, setup.machine_file, setup.run_reading())
    detectors = [setup.machine_file.detector(name) for name in setup.detectors]
    return runs, learn_thresholds(setup, runs.operations, detectors, runs.skipped)


@pytest.fixture(scope="module")
def setup(gate) -> BenchmarkFile:
    """The benchmark of all logs, each learned from until its contact."""
    return setup_of(gate, HEAD, LEARN, ONSET, GROUPS)


@pytest.fixture(scope="module")
def results(setup) -> Results:
    return benchmark(setup).results


@pytest.fixture(scope="module")
def prepared(gate) -> PreparedDetector:
    return prepare(None, benchmark=setup_of(gate, HEAD, LEARN, ONSET, GROUPS).path)


def test_all_contacts_are_detected_and_nothing_before_them_is_an_alarm(results):
    assert [row.outcome for row in results.contacts] == ["detected"] * 7
    assert not results.false_alarms and not results.skipped
    provenance = results.provenance
    assert provenance["learned_until"] == "0.2 s before the first contact of each log"
    assert sorted(provenance["scored_without_own_part"]) == sorted(provenance["learned_runs"])


def test_what_is_learned_ends_before_the_onset_by_the_guard(gate, results):
    onsets = {row.recording: row.onset_s for row in results.contacts}
    for guard in (0.0, 0.2, 1.5):
        runs, _ = learned_of(setup_of(gate, HEAD, LEARN, f"guard_s = {guard}\n", ONSET, GROUPS))
        for operation in runs.operations:
            end = operation.recording.end
            assert onsets[operation.name] - guard - 0.012 < end <= onsets[operation.name] - guard


def test_no_log_judges_itself(gate):
    """A log with an extreme signal before its contact: it would widen its own limit, and does widen the others'."""
    folder = gate.parent / "odd"
    shutil.copytree(gate, folder, dirs_exist_ok=True)
    log = folder / "stiff" / "01.csv"
    header, *rows = log.read_text(encoding="utf-8").splitlines()
    column = header.split(",").index("i_motor")
    for i in range(3000, 3200):
        cells = rows[i].split(",")
        cells[column] = str(float(cells[column]) * 3.0)
        rows[i] = ",".join(cells)
    log.write_text("\n".join([header, *rows]), encoding="utf-8")
    setup = setup_of(folder, HEAD, LEARN, ONSET, GROUPS)
    _, learned = learned_of(setup)
    by_log = ThresholdsByLog.of(setup, learned)
    own, _ = by_log.without(log)
    other, _ = by_log.without(folder / "stiff" / "02.csv")
    assert own["momentum"][0].upper[0] < 0.5 * other["momentum"][0].upper[0]
    done = benchmark(setup).results
    assert [item.recording for item in done.false_alarms] == ["stiff/01.csv"]


def test_the_limits_of_a_log_are_those_learned_from_the_others_alone(gate):
    setup = setup_of(gate, HEAD, LEARN, ONSET, GROUPS)
    _, learned = learned_of(setup)
    log = gate / "soft" / "02.csv"
    own, findings = ThresholdsByLog.of(setup, learned).without(log)
    assert not findings
    others = HEAD, LEARN.replace("soft/*.csv", 'soft/01.csv", "soft/03.csv'), ONSET, GROUPS
    _, alone = learned_of(setup_of(gate, *others))
    assert own["momentum"] == alone.thresholds["momentum"]


def test_detect_and_explain_with_the_benchmark_use_the_same_limits(gate, results, prepared):
    rows = {row.recording: row.latency_ms for row in results.contacts}
    for log in sorted(gate.glob("s*/*.csv")):
        (scored,) = prepared.score(log)
        assert scored.matched is not None
        ((row,),) = scored.matched.contacts
        assert row.latency_ms == rows[row.recording]
        assert not prepared.detect(log).runs[0].learned, "scored with what was learned from the others"


def test_sections_limit_what_is_learned_and_what_is_scored(gate):
    groups = '[impacts.stiff]\nfrom = "1s"\nlogs = ["stiff/0[12].csv", { path = "stiff/0[34].csv", to = "6.9s" }]\n'
    learn = '[learn]\nto = "0.5m"\nlogs = ["free/*.csv", { path = "soft/*.csv", from = "500ms" }]\n'
    setup = setup_of(gate, HEAD, learn, ONSET, groups)
    runs, _ = learned_of(setup)
    for operation in runs.operations:
        travel = operation.recording["position"].values[-1, 0]
        assert travel <= 0.501 and operation.recording.end < 4.0
        assert operation.recording.start == (0.5 if operation.name.startswith("soft") else 0.0)
    done = benchmark(setup).results
    assert {row.outcome for row in done.contacts} == {"detected"}
    seconds = {row.recording: row.seconds for row in done.recordings}
    assert seconds["stiff/03.csv"] == pytest.approx(5.9, abs=0.01)
    assert seconds["stiff/01.csv"] > 6.0
    assert done.provenance["sections"]["stiff/03.csv"] == "from 1 s to 6.9 s"
    assert done.provenance["learned_sections"]["soft/01.csv"] == "from 0.5 s to 0.5 m of travel"


def changed_copy(gate, folder, column, change):
    """A copy of the set in which one log's column is changed, row by row."""
    shutil.copytree(gate, folder, dirs_exist_ok=True)
    log = folder / "stiff" / "01.csv"
    header, *rows = log.read_text(encoding="utf-8").splitlines()
    k = header.split(",").index(column)
    cells = [row.split(",") for row in rows]
    for i, row in enumerate(cells):
        row[k] = change(i, row[k])
    log.write_text("\n".join([header, *(",".join(row) for row in cells)]), encoding="utf-8")
    return log


@pytest.mark.parametrize("first", [0, 5000])
def test_a_log_whose_load_cell_is_lost_is_left_out_because_its_contact_would_be_learned(gate, tmp_path, first):
    changed_copy(gate, tmp_path, "load_cell", lambda i, cell: "" if i >= first else cell)
    runs, _ = learned_of(setup_of(tmp_path, HEAD, LEARN, ONSET, GROUPS))
    assert [item.recording for item in runs.skipped] == ["stiff/01.csv"]
    assert "no contact found, and the load cell" in runs.skipped[0].reason
    done = benchmark(setup_of(tmp_path, HEAD, LEARN, ONSET, GROUPS)).results
    assert [row.outcome for row in done.contacts] == ["detected"] * 6


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ((HEAD, LEARN.replace('until = "onset"\n', ""), GROUPS), 'both learned from and scored .*until = "onset"'),
        ((HEAD, LEARN, '[holdout]\nlogs = ["stiff/*.csv"]\n'), "both learned from and scored"),
        ((HEAD, LEARN.replace("onset", "contact"), GROUPS), "learn.until: is 'contact'"),
        ((HEAD, LEARN.replace('until = "onset"', "guard_s = 0.1"), GROUPS), "learn.guard_s: is given without until"),
        ((HEAD, LEARN, "guard_s = -0.1\n", GROUPS), "learn.guard_s: is -0.1"),
        ((HEAD, LEARN, "to = 3.2\n", GROUPS), "learn.to: is 3.2 .*in quotes"),
        ((HEAD, LEARN, 'to = "3.2"\n', GROUPS), "learn.to: is '3.2'"),
        ((HEAD, LEARN, 'from = "3s"\nto = "2s"\n', GROUPS), "learn.to: the end, 2 s, is not after"),
        (
            (HEAD, LEARN, GROUPS, '[impacts.x]\nlogs = [{ path = "free/01.csv", too = "3s" }]\n'),
            r"logs\[1\].too: unknown",
        ),
        ((HEAD, LEARN, GROUPS, "[impacts.x]\nlogs = [{ to = '3s' }]\n"), r"impacts.x.logs\[1\].path: is missing"),
        ((HEAD, LEARN, GROUPS, "[impacts.x]\nlogs = [3]\n"), "impacts.x.logs.1.: is 3"),
        (
            (HEAD, LEARN, GROUPS, '[impacts.x]\nfrom = "3s"\nlogs = [{ path = "free/01.csv", to = "1s" }]\n'),
            r"impacts.x.logs\[1\].to: the end, 1 s, is not after the begin, 3 s",
        ),
        (
            (HEAD, LEARN, '[impacts.x]\nlogs = ["free/*.csv", { path = "free/01.csv", to = "3s" }]\n'),
            "names .*01.csv with two different parts",
        ),
    ],
)
def test_a_wrong_key_is_named(gate, parts, words):
    with pytest.raises(ConfigurationError, match=words):
        setup_of(gate, *parts)


def test_a_log_without_ground_truth_or_with_too_little_before_the_contact_is_left_out_by_name(gate):
    machine = (gate / "machine.toml").read_text(encoding="utf-8").splitlines()
    blind = [line for line in machine if not line.startswith("force =")]
    assert len(blind) == len(machine) - 2, "of the CSV table and of the MCAP topics"
    (gate / "blind.toml").write_text("\n".join(blind), encoding="utf-8")
    setup = setup_of(gate, HEAD.replace("machine.toml", "blind.toml"), LEARN, ONSET, GROUPS)
    runs = load_runs(setup.learn, setup.machine_file, setup.run_reading())
    assert len(runs.skipped) == 7 and not runs.operations
    assert all("no ground truth: until = 'onset' needs a load cell" in item.reason for item in runs.skipped)
    runs, _ = learned_of(setup_of(gate, HEAD, LEARN.replace("soft/", "free/"), "guard_s = 5.6\n", ONSET, GROUPS))
    left_out = {item.recording: item.reason for item in runs.skipped}
    assert left_out and all(name.startswith("stiff") for name in left_out)
    assert all("s before the contact at" in reason and "at least 0.5 s" in reason for reason in left_out.values())
    assert {operation.name for operation in runs.operations} >= {"free/01.csv", "free/02.csv"}


@pytest.mark.parametrize("how", ["detour", "absolute", "link"])
def test_no_log_judges_itself_whatever_its_path_is_written(gate, how):
    folder = gate / "stiff"
    if how == "link" and not (gate / "linked").exists():
        (gate / "linked").symlink_to(folder, target_is_directory=True)
    pattern = {"detour": "soft/../stiff/*.csv", "absolute": str(folder / "*.csv"), "link": "linked/*.csv"}[how]
    setup = setup_of(gate, HEAD, LEARN.replace("stiff/*.csv", pattern), ONSET, GROUPS)
    plain = setup_of(gate, HEAD, LEARN, ONSET, GROUPS)
    assert sorted(setup.learn) == sorted(plain.learn)
    _, learned = learned_of(setup)
    own, _ = ThresholdsByLog.of(setup, learned).without(folder / "01.csv")
    assert own["momentum"] != learned.thresholds["momentum"]


@pytest.mark.parametrize("threshold", ["signature", "cusum", "glr", "innovation"])
@pytest.mark.parametrize("option", [[], ["--dry-run"]])
def test_limits_by_location_learned_up_to_the_onset_only_are_refused(gate, threshold, option):
    """Nothing is read: no run passes a contact without one. With impact-free runs in [learn] it is accepted."""
    head = HEAD.replace('"limit"', f'"{threshold}"')
    (gate / "place.toml").write_text("".join([head, LEARN, ONSET, GROUPS]), encoding="utf-8")
    done = command("benchmark", gate / "place.toml", *option)
    assert done.status == 2 and f"the threshold {threshold} would know no limit where" in one_line(done.err)
    assert 'set threshold = "limit"' in one_line(done.err) and not done.out
    setup_of(gate, head, LEARN.replace('["stiff', '["free/*.csv", "stiff'), ONSET, GROUPS)


def test_the_load_cells_synchronisation_is_part_of_the_guard(gate):
    plain, _ = learned_of(setup_of(gate, HEAD, LEARN, ONSET, GROUPS))
    late, _ = learned_of(setup_of(gate, HEAD, LEARN, ONSET, "synchronisation_s = 0.5\n", GROUPS))
    for before, after in zip(plain.operations, late.operations, strict=True):
        assert before.recording.end - after.recording.end == pytest.approx(0.5, abs=0.002)


def test_a_threshold_that_needs_the_logs_own_part_leaves_it_not_assessable_with_the_reason(gate):
    few = setup_of(gate, HEAD, LEARN.replace("*.csv", "01.csv"), ONSET, GROUPS.replace("*.csv", "01.csv"))
    done = benchmark(few).results
    assert {row.outcome for row in done.contacts} == {"not_assessable"}
    assert any(
        "nothing can be learned from the other recordings: a limit needs at least 2" in str(item.reason)
        for item in done.findings
    )


def changed(log, rows, factor, column="i_motor"):
    """Multiply a column of a log in some of its rows."""
    header, *lines = log.read_text(encoding="utf-8").splitlines()
    at = header.split(",").index(column)
    for i in rows:
        cells = lines[i].split(",")
        cells[at] = repr(float(cells[at]) * factor)
        lines[i] = ",".join(cells)
    log.write_text("\n".join([header, *lines]), encoding="utf-8")


def test_plausible_ranges_of_a_log_are_those_of_the_others(gate):
    folder = gate.parent / "own"
    shutil.copytree(gate, folder, dirs_exist_ok=True)
    for name in ("01", "02"):
        changed(folder / "stiff" / f"{name}.csv", range(500, 3000), 3.0)
    own, _ = learned_of(setup_of(folder, HEAD, LEARN, ONSET, GROUPS))
    alone, _ = learned_of(setup_of(folder, HEAD, LEARN.replace("stiff/*", "stiff/0[2-4]"), ONSET, GROUPS))
    assert own.ranges.without("stiff/01.csv") == alone.ranges.all != own.ranges.all
    assert own.ranges.without("free/01.csv") == own.ranges.all


def test_a_value_far_from_those_of_the_other_logs_is_masked_whatever_its_own_log_has(gate):
    """Two of six logs have fill values before their contacts; in the range of all, such values would be usual."""
    folder = gate.parent / "fill"
    shutil.copytree(gate, folder, dirs_exist_ok=True)
    for name in ("01", "02"):
        changed(folder / "stiff" / f"{name}.csv", range(500, 3000), 1e6)
    parts = HEAD, LEARN.replace("soft/*", "soft/0[12]"), ONSET, GROUPS
    found = [item.recording for item in benchmark(setup_of(folder, *parts)).results.findings if item.is_loss]
    assert sorted(found) == ["stiff/01.csv", "stiff/02.csv"]
