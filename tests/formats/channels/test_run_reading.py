"""A log is cut into runs before its clock is checked: each run is what a file of its own would be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cdtool.base.errors import RecordingError
from cdtool.formats.channels.reading import read_as_logged
from cdtool.formats.channels.run_reading import read_runs
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.formats.mcap.write import Stream, write_mcap
from cdtool.recordings.operations import RunCut
from tests.base.findings.facts import fact_of

MACHINE = """[machine]
type = "rotary_axis"
name = "wrist"
coordinates = "load"

[channels]
time = { column = "t", unit = "s" }
speed = { column = "w", unit = "rad/s" }
torque = { column = "tau", unit = "N m" }
force = { column = "cell", unit = "N" }

[channels.mcap]
speed = { topic = "/speed", field = "data" }
force = { topic = "/cell", field = "data" }
"""
ROWS = 40


@pytest.fixture
def machine(tmp_path) -> MachineFile:
    path = tmp_path / "machine.toml"
    path.write_text(MACHINE)
    return read_machine_file(path)


def table(run: int, rows: int = ROWS) -> list[str]:
    """The rows of one run, whose jittered clock starts at zero."""
    rng = np.random.default_rng(run)
    time = 0.01 * np.arange(rows) + rng.uniform(0.0, 0.002, rows) * (np.arange(rows) > 0)
    return [f"{t:.6f},{rng.normal():.4f},{rng.normal():.4f},{rng.normal():.3f}" for t in time]


def log_of(path: Path, ids: list[str], separator: str = ",") -> Path:
    """Runs one after the other in one file, each with the text `id` in its last column."""
    rows = [f"{row},{text}" for run, text in enumerate(ids) for row in table(run)]
    return written(path, [row.replace(",", separator) for row in rows], separator)


def written(path: Path, rows: list[str], separator: str = ",", more: str = "") -> Path:
    path.write_text("\n".join([f"t,w,tau,cell,run_id{more}".replace(",", separator), *rows, ""]))
    return path


def alone(path: Path, run: int) -> Path:
    path.write_text("\n".join(["t,w,tau,cell", *table(run), ""]))
    return path


def assert_equal_runs(found, folder: Path, machine: MachineFile, numbers: list[int]) -> None:
    assert len(found.runs) == len(numbers)
    for logged, number in zip(found.runs, numbers, strict=True):
        own = read_as_logged(alone(folder / f"alone_{number}.csv", number), machine).recording
        assert set(own.channels) == set(logged.recording.channels)
        for name, series in own.channels.items():
            assert np.array_equal(series.time, logged.recording[name].time)
            assert np.array_equal(series.values, logged.recording[name].values)
        kinds = [item.kind for item in own.findings if item.kind != "stuck_channel"]
        assert [item.kind for item in logged.recording.findings if item.kind != "stuck_channel"] == kinds


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize(
    ("ids", "names"),
    [
        (["1", "2", "3"], ["1", "2", "3"]),
        (["run_A", "run B", "7.50"], ["run_A", "run B", "7.5"]),
        (["2024-05-01", "true", "10:30"], ["2024-05-01", "1", "10:30"]),
    ],
)
def test_a_run_by_its_id_is_what_a_file_of_its_own_is(tmp_path, machine, ids, names, separator):
    log = log_of(tmp_path / "log.csv", ids, separator)
    found = read_runs(log, machine, RunCut("column", "run_id"))
    assert [logged.recording.source for logged in found.runs] == [f"{log}#{name}" for name in names]
    assert len({logged.recording.digest for logged in found.runs}) == len(ids)
    assert_equal_runs(found, tmp_path, machine, [0, 1, 2])
    assert not found.left_out and not [item for item in found.findings if item.severity != "note"]


def test_a_run_by_the_clock_that_starts_again_is_what_a_file_of_its_own_is(tmp_path, machine):
    log = log_of(tmp_path / "log.csv", ["1", "1", "1"])
    found = read_runs(log, machine, RunCut("clock-reset"))
    assert [logged.recording.name for logged in found.runs] == ["log#1", "log#2", "log#3"]
    assert_equal_runs(found, tmp_path, machine, [0, 1, 2])


def test_an_id_that_comes_back_is_reported_and_a_label_that_comes_back_is_not(tmp_path, machine):
    log = log_of(tmp_path / "log.csv", ["push", "free", "push"])
    found = read_runs(log, machine, RunCut("column", "run_id"))
    assert [logged.recording.name for logged in found.runs] == ["log#push", "log#free", "log#push/2"]
    assert [fact_of(item) for item in found.findings if item.severity == "warning"] == [
        ("returning_ids", {"names": ("push/2",), "column": "run_id"})
    ]
    labelled = read_runs(log, machine, RunCut("label", "run_id"))
    assert [logged.recording.name for logged in labelled.runs] == ["log#push", "log#free", "log#push/2"]
    assert not [item for item in labelled.findings if item.severity == "warning"]


def test_rows_without_an_id_are_counted_and_a_label_of_none_ends_a_run(tmp_path, machine):
    log = log_of(tmp_path / "log.csv", ["", "a", "", "a", "b"])
    by_id, by_label = (read_runs(log, machine, RunCut(by, "run_id")) for by in ("column", "label"))
    assert [fact_of(item) for item in by_id.findings if item.severity == "warning"] == [
        ("samples_outside_runs", {"count": ROWS, "total": 5 * ROWS, "column": "run_id"})
    ]
    assert [logged.recording.name for logged in by_label.runs] == ["log#a", "log#a/2", "log#b"]
    assert [fact_of(item) for item in by_label.findings if item.severity == "warning"] == [
        ("samples_outside_runs", {"count": 2 * ROWS, "total": 5 * ROWS, "column": "run_id"})
    ]


def test_a_run_that_is_too_short_is_left_out_by_name(tmp_path, machine):
    lines = [f"{row},long" for row in table(0)] + [f"{row},brief" for row in table(1, 7)]
    log = written(tmp_path / "log.csv", lines)
    found = read_runs(log, machine, RunCut("column", "run_id"))
    assert [logged.recording.name for logged in found.runs] == ["log#long"]
    assert found.left_out == ((log, "1 run (brief) with 7 samples in all is shorter than 8 samples: left out"),)


def test_a_run_that_cannot_be_read_does_not_stop_the_others(tmp_path, machine):
    lines = [f"{row},1" for row in table(0)] + [f"5.0,{row.partition(',')[2]},2" for row in table(1)]
    log = written(tmp_path / "log.csv", lines)
    found = read_runs(log, machine, RunCut("column", "run_id"))
    assert [logged.recording.name for logged in found.runs] == ["log#1"]
    ((path, reason),) = found.left_out
    assert str(path) == f"{log}#2" and "the clock stands still" in reason


def test_runs_can_be_chosen_by_id_or_by_pattern(tmp_path, machine):
    log = log_of(tmp_path / "log.csv", ["a1", "a2", "b1"])
    cut = RunCut("column", "run_id")
    chosen = {
        ids: [logged.recording.name for logged in read_runs(Path(f"{log}#{ids}"), machine, cut).runs]
        for ids in ("a2", "a*", "?1")
    }
    assert chosen == {"a2": ["log#a2"], "a*": ["log#a1", "log#a2"], "?1": ["log#a1", "log#b1"]}
    with pytest.raises(RecordingError, match=r"log\.csv: no run 'c' \(its runs are a1, a2, b1\)"):
        read_runs(Path(f"{log}#c"), machine, cut)
    whole = read_runs(log, machine, cut).runs[1].recording
    assert read_runs(Path(f"{log}#a2"), machine, cut).runs[0].recording.digest == whole.digest


@pytest.mark.parametrize(
    ("cut", "words"),
    [
        (RunCut("column", "runid"), r"no column 'runid' \(channel 'run id'\) \(did you mean run_id"),
        (RunCut("column", "w"), r"none of 120 runs by column 'w' has 8 samples: the longest has 1"),
        (RunCut("column", "none"), r"column 'none' has no value in any sample"),
    ],
)
def test_a_wrong_column_is_an_error_with_the_next_step(tmp_path, machine, cut, words):
    lines = [f"{row},{run}," for run in range(3) for row in table(run)]
    log = written(tmp_path / "log.csv", lines, more=",none")
    with pytest.raises(RecordingError, match=words):
        read_runs(log, machine, cut)


EPOCHS = [
    ("%s", lambda time: f"{time:.3f}", 's"'),
    ("ms", lambda time: f"{1000 * time:.0f}", 'ms"'),
    ("dates", lambda time: str(np.datetime64(round(time * 1000), "ms")).replace("T", " "), 's"'),
]


@pytest.mark.parametrize(("name", "stamp", "unit"), EPOCHS, ids=[name for name, *_ in EPOCHS])
@pytest.mark.parametrize("apart", [3600.0, -86400.0])
def test_the_time_of_a_run_counts_from_its_own_start_if_the_clock_counts_from_an_epoch(
    tmp_path, name, stamp, unit, apart
):
    (tmp_path / "machine.toml").write_text(MACHINE.replace('"t", unit = "s"', f'"t", unit = "{unit}'))
    machine = read_machine_file(tmp_path / "machine.toml")
    starts = [1_700_000_000.0 + apart * run for run in range(3)]
    lines = [f"{stamp(begin + k / 100)},{k},1,0,{run}" for run, begin in enumerate(starts) for k in range(ROWS)]
    log = written(tmp_path / "log.csv", lines)
    cuts = [RunCut("column", "run_id"), RunCut("column", "4")]
    for cut in [*cuts, RunCut("clock-reset")] if apart < 0.0 else cuts:
        found = read_runs(log, machine, cut).runs
        assert [run.recording.origin for run in found] == pytest.approx(starts, abs=1e-6)
        for run in found:
            np.testing.assert_allclose(run.recording["speed"].time, np.arange(ROWS) / 100, atol=1e-6)


def test_a_rate_in_place_of_a_clock_cannot_start_again(tmp_path):
    path = tmp_path / "machine.toml"
    text = MACHINE.replace('{ column = "t", unit = "s" }', "{ rate_hz = 100 }")
    path.write_text(text)
    log = log_of(tmp_path / "log.csv", ["1", "2"])
    with pytest.raises(RecordingError, match="no clock that could start again"):
        read_runs(log, read_machine_file(path), RunCut("clock-reset"))
    found = read_runs(log, read_machine_file(path), RunCut("column", "run_id"))
    assert [logged.recording["speed"].time[0] for logged in found.runs] == [0.0, 0.0]


def test_texts_are_refused_where_the_same_column_is_a_channel(tmp_path):
    path = tmp_path / "machine.toml"
    path.write_text(MACHINE.replace("[channels.mcap]", 'label = { column = "run_id" }\n[channels.mcap]'))
    log = log_of(tmp_path / "log.csv", ["a", "b"])
    with pytest.raises(RecordingError, match="column 'run_id' has texts"):
        read_runs(log, read_machine_file(path), RunCut("label", "run_id"))
    numbers = log_of(tmp_path / "numbers.csv", ["0", "1"])
    found = read_runs(numbers, read_machine_file(path), RunCut("label", "run_id"))
    assert [logged.recording["label"].values[0, 0] for logged in found.runs] == [0.0, 1.0]


def bag(path: Path, start: float = 0.0, ids: tuple[tuple[float, float], ...] = ((0.2, 1.0), (1.0, 2.0), (2.0, 1.0))):
    """Speeds at 100 Hz, a load cell in the first second only, and ids that are logged when they change."""
    time = start + np.arange(300) / 100.0
    cell = time[time < 1.0]
    streams = [Stream("/speed", "std_msgs/msg/Float64", time, {"data": np.sin(time)})]
    if len(cell):
        streams.append(Stream("/cell", "std_msgs/msg/Float64", cell, {"data": cell}))
    if ids:
        at, values = np.array(ids).T
        streams.append(Stream("/run", "std_msgs/msg/Float64", start + at, {"data": values}))
    write_mcap(path, streams, start_ns=0)
    return path


def test_the_id_of_a_topic_holds_from_its_message_to_the_next_one(tmp_path, machine):
    found = read_runs(bag(tmp_path / "log.mcap"), machine, RunCut("column", "/run data"))
    spans = [(item.recording.name, item.recording["speed"].time[[0, -1]].round(6).tolist()) for item in found.runs]
    assert spans == [("log#1", [0.0, 0.79]), ("log#2", [0.0, 0.99]), ("log#1/2", [0.0, 0.99])]
    assert [round(item.recording.origin, 6) for item in found.runs] == [0.2, 1.0, 2.0]
    assert [sorted(item.recording.channels) for item in found.runs] == [["force", "speed"], ["speed"], ["speed"]]
    assert "absent_truth" in [item.kind for item in found.runs[1].recording.findings]
    outside = [(item.channel, item.numbers["count"]) for item in found.findings if item.kind == "samples_outside_runs"]
    assert outside == [("speed", 20), ("force", 20)]


def test_a_run_may_continue_in_the_next_part_of_a_log(tmp_path, machine):
    folder = tmp_path / "bag"
    folder.mkdir()
    bag(folder / "bag_0.mcap", 0.0)
    bag(folder / "bag_1.mcap", 3.0, ((1.0, 5.0),))
    text = MACHINE.replace('force = { topic = "/cell", field = "data" }\n', "")
    (tmp_path / "machine.toml").write_text(text)
    found = read_runs(folder, read_machine_file(tmp_path / "machine.toml"), RunCut("column", "/run data"))
    spans = [(item.recording.name, item.recording["speed"].time[[0, -1]].round(6).tolist()) for item in found.runs]
    assert spans == [
        ("bag#1", [0.0, 0.79]),
        ("bag#2", [0.0, 0.99]),
        ("bag#1/2", [0.0, 1.99]),
        ("bag#5", [0.0, 1.99]),
    ]


def test_messages_cannot_be_cut_by_their_clock_nor_by_a_topic_without_a_field(tmp_path, machine):
    log = bag(tmp_path / "log.mcap")
    with pytest.raises(RecordingError, match="their clock cannot start again"):
        read_runs(log, machine, RunCut("clock-reset"))
    with pytest.raises(RecordingError, match="does not name a field of a topic"):
        read_runs(log, machine, RunCut("column", "/run"))
    with pytest.raises(RecordingError, match=r"no message of topic '/runs' .*did you mean /run"):
        read_runs(log, machine, RunCut("column", "/runs data"))


def test_texts_of_parquet_and_hdf5_are_ids(tmp_path, machine):
    pa, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    h5py = pytest.importorskip("h5py")
    rows = [list(map(float, row.split(","))) for run in range(3) for row in table(run)]
    columns = dict(zip(("t", "w", "tau", "cell"), np.array(rows).T, strict=True))
    texts = [text for text in ("A", "", "B") for _ in range(ROWS)]
    for name, column in (("plain", pa.array(texts)), ("coded", pa.array(texts).dictionary_encode())):
        parquet.write_table(pa.table({**columns, "run_id": column}), tmp_path / f"{name}.parquet")
    with h5py.File(tmp_path / "log.h5", "w") as file:
        for name, values in columns.items():
            file[name] = values
        file["run_id"] = texts
    for path in (tmp_path / "plain.parquet", tmp_path / "coded.parquet", tmp_path / "log.h5"):
        found = read_runs(path, machine, RunCut("column", "run_id"))
        assert [Path(logged.recording.source).name for logged in found.runs] == [f"{path.name}#A", f"{path.name}#B"]
        assert_equal_runs(found, tmp_path, machine, [0, 2])
        assert [item.numbers["count"] for item in found.findings if item.kind == "samples_outside_runs"] == [ROWS]
