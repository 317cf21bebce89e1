from __future__ import annotations

import json
import tomllib
from dataclasses import asdict
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from cdtool.base.errors import UsageError
from cdtool.commands.convert.converting import convert
from cdtool.commands.convert.log_rows import ColumnRows
from cdtool.commands.judging.runs import read
from cdtool.formats.channels.channel_assembly import file_digest
from cdtool.formats.channels.reading import survey
from cdtool.formats.machine_file import read_machine_file
from cdtool.formats.written_files import WRITERS
from tests.command import cdtool
from tests.commands.convert.kinds import KINDS, SEVERAL_CLOCKS, needs, table
from tests.formats.container_files import assert_same, logged, machine_file, two_clocks


def gate(folder: Path) -> tuple[Path, Path]:
    machine = machine_file(folder)
    machine.write_text(machine.read_text().replace('"time", unit = "s"', '"time", unit = "ms"'))
    return table(folder / "run.csv"), machine


@pytest.mark.parametrize(
    ("there", "back"), [pair for pair in product(KINDS, KINDS) if ".csv" in pair or len({*pair}) == 1]
)
def test_a_table_is_unchanged_bit_for_bit_through_any_two_containers(there, back, tmp_path):
    needs(there, back)
    log, machine = gate(tmp_path)
    first = convert(log, tmp_path / f"first{there}", machine=machine)
    second = convert(first.files[0], tmp_path / f"second{back}", machine=first.machine_files[0])
    original = logged(log, machine)
    # A message's time in MCAP is an integer number of nanoseconds; its exact time is passed on to the next container.
    assert_same(original, logged(first.files[0], first.machine_files[0]), exact_time=there != ".mcap")
    assert_same(original, logged(second.files[0], second.machine_files[0]), exact_time=back != ".mcap")


@pytest.mark.parametrize(("there", "back"), [*product(SEVERAL_CLOCKS, SEVERAL_CLOCKS)])
def test_each_channel_keeps_its_own_clock_through_any_two_containers(there, back, tmp_path):
    needs(there, back)
    log, machine = two_clocks(tmp_path / "run.mcap"), machine_file(tmp_path)
    original = logged(log, machine)
    first = convert(log, tmp_path / f"first{there}", machine=machine)
    second = convert(first.files[0], tmp_path / f"second{back}", machine=first.machine_files[0])
    assert first.clocks == second.clocks == 2
    result = logged(second.files[0], second.machine_files[0])
    assert_same(original, result, exact_time=back != ".mcap")
    assert len(result["speed"]) == 300 and len(result["acceleration"]) == 700


def test_each_of_two_clocks_gets_its_own_csv_table_without_resampling(tmp_path):
    log, machine = two_clocks(tmp_path / "run.mcap"), machine_file(tmp_path)
    done = convert(log, tmp_path / "out.csv", machine=machine)
    assert [Path(path).name for path in done.files] == ["out.1.csv", "out.2.csv"]
    original = logged(log, machine)
    parts = [logged(path, machine_path) for path, machine_path in zip(done.files, done.machine_files, strict=True)]
    assert [set(part.channels) for part in parts] == [{"torque", "speed"}, {"acceleration"}]
    for part in parts:
        for name, series in part.channels.items():
            assert series.values.tobytes() == original[name].values.tobytes()
            assert series.time.tobytes() == original[name].time.tobytes()


@pytest.mark.parametrize("suffix", SEVERAL_CLOCKS)
def test_the_start_of_a_log_on_an_epoch_is_kept(suffix, tmp_path):
    needs(suffix)
    log = two_clocks(tmp_path / "run.mcap", start_ns=1_700_000_000_123_456_789)
    machine = machine_file(tmp_path)
    done = convert(log, tmp_path / f"out{suffix}", machine=machine)
    assert logged(done.files[0], done.machine_files[0]).origin == logged(log, machine).origin > 1.6e9


@pytest.mark.parametrize("suffix", WRITERS)
def test_without_a_machine_file_all_columns_are_written_with_their_units(suffix, tmp_path):
    needs(suffix)
    log, _ = gate(tmp_path)
    done = convert(log, tmp_path / f"all{suffix}")
    assert done.machine_files == () and done.columns == 3
    columns = survey(tmp_path / f"all{suffix}").columns
    for name, column in survey(log).columns.items():
        short = name.split(" ")[0]
        known = {short, f"{short} [{column.unit}]", f"/clock_1 {short}"}
        (found,) = [column for key, column in columns.items() if key in known]
        assert found.values.tobytes() == column.values.tobytes()
        assert suffix == ".mcap" or found.unit == column.unit


def test_the_new_machine_file_is_unchanged_except_for_the_channels(tmp_path):
    log, machine = gate(tmp_path)
    done = convert(log, tmp_path / "out.csv", machine=machine)
    before, after = tomllib.loads(machine.read_text()), tomllib.loads(Path(done.machine_files[0]).read_text())
    assert {k: v for k, v in before.items() if k != "channels"} == {k: v for k, v in after.items() if k != "channels"}
    assert after["channels"]["speed_low_pass_hz"] == 40
    assert "# m/s" in Path(done.machine_files[0]).read_text()
    assert asdict(read_machine_file(done.machine_files[0]).machine) == asdict(read_machine_file(machine).machine)


@pytest.mark.parametrize("suffix", WRITERS)
def test_every_file_states_its_origin(suffix, tmp_path):
    needs(suffix)
    log, machine = gate(tmp_path)
    path = Path(convert(log, tmp_path / f"out{suffix}", machine=machine).files[0])
    told = PROVENANCE[suffix](path)
    assert told["cdtool.source"] == "run.csv" and told["cdtool.sha256"] == file_digest(Path(log))
    assert told["cdtool.machine"] == "gate" and len(told["cdtool.machine_fingerprint"]) == 64
    assert told["cdtool.version"]


def test_nothing_is_overwritten_without_force_and_the_log_never(tmp_path):
    log, machine = gate(tmp_path)
    (tmp_path / "out.csv").write_text("mine")
    with pytest.raises(UsageError, match=r"out\.csv: already exists"):
        convert(log, tmp_path / "out.csv", machine=machine)
    assert (tmp_path / "out.csv").read_text() == "mine"
    convert(log, tmp_path / "out.csv", machine=machine, force=True)
    assert (tmp_path / "out.csv").read_text() != "mine"
    with pytest.raises(UsageError, match="is the log itself"):
        convert(log, log, machine=machine, force=True)


def test_a_log_without_a_clock_is_written_only_to_formats_without_one(tmp_path):
    log = tmp_path / "run.csv"
    log.write_text("a,b\n" + "".join(f"{k % 7},{k % 5}\n" for k in range(50)))
    with pytest.raises(UsageError, match=r"no column of the log is recognised as its clock, and this container needs"):
        convert(log, tmp_path / "out.mcap")
    assert convert(log, tmp_path / "out.csv").columns == 2


def of_csv(path: Path) -> dict[str, str]:
    lines = [line[2:].split(": ", 1) for line in path.read_text().splitlines() if line.startswith("# ")]
    return dict(lines)


def of_mcap(path: Path) -> dict[str, str]:
    from mcap.reader import make_reader

    with path.open("rb") as file:
        return dict(next(iter(make_reader(file).iter_metadata())).metadata)


def of_parquet(path: Path) -> dict[str, str]:
    import pyarrow.parquet

    table = pyarrow.parquet.read_table(path)
    return {key.decode(): value.decode() for key, value in table.schema.metadata.items()}


PROVENANCE = {
    ".csv": of_csv,
    ".mcap": of_mcap,
    ".parquet": of_parquet,
}


GATE_TABLE = """[machine]
type = "linear_axis"
name = "gate"
load_mass = 100.0
coordinates = "load"
[channels]
time = { column = "t", unit = "s" }
position = { column = "x", unit = "m" }
torque = { column = "F", unit = "N" }
"""


def test_a_clock_that_begins_at_5_s_begins_there_in_mcap_too(tmp_path):
    rows = "\n".join(f"{5 + i / 1000:.3f},{i / 1000},{i % 7}" for i in range(200))
    (tmp_path / "log.csv").write_text(f"t,x,F\n{rows}\n", encoding="utf-8")
    (tmp_path / "gate.toml").write_text(GATE_TABLE, encoding="utf-8")
    done = convert(tmp_path / "log.csv", tmp_path / "log.mcap", machine=tmp_path / "gate.toml")
    before = read(tmp_path / "log.csv", read_machine_file(tmp_path / "gate.toml"))
    after = read(done.files[0], read_machine_file(done.machine_files[0]))
    assert before["torque"].time[0] == 5.0
    assert after["torque"].time.tolist() == before["torque"].time.tolist()
    assert after.origin == before.origin


def unverified_log(path):
    from mcap.writer import Writer

    with path.open("wb") as file:
        writer = Writer(file, enable_crcs=False)
        writer.start()
        channel = writer.register_channel("/a", "json", 0)
        for i in range(20):
            writer.add_message(channel, i * 10**6, b'{"data": %d}' % i, i * 10**6)
        writer.finish()
    return path


def test_unverified_data_stays_unverified_and_marked_after_converting(tmp_path):
    log = unverified_log(tmp_path / "log.mcap")
    done = cdtool("convert", log, tmp_path / "out.mcap")
    assert done.status == 0 and "20 of 20 messages without a checksum: unverified" in done.err
    assert any(
        "20 of 20 messages without a checksum" in str(finding) for finding in survey(tmp_path / "out.mcap").findings
    )


@pytest.mark.parametrize("suffix", KINDS)
def test_names_that_are_equal_for_a_container_are_made_unique(suffix, tmp_path):
    needs(suffix)
    rows = "\n".join(f"{i / 100:.2f},{i},{-i}" for i in range(20))
    (tmp_path / "log.csv").write_text(f"t [s],a.b,a/b\n{rows}\n", encoding="utf-8")
    done = convert(tmp_path / "log.csv", tmp_path / f"out{suffix}")
    ends = {(column.values[0], column.values[-1]) for column in survey(Path(done.files[0])).columns.values()}
    assert {(0.0, 19.0), (0.0, -19.0)} <= ends


LOGS = Path(__file__).parents[3] / "sample_logs"


def test_a_converted_log_is_read_with_its_new_machine_file(tmp_path):
    machine = LOGS / "gate/machine.toml"
    out = tmp_path / "run.mcap"
    done = cdtool("convert", LOGS / "gate/stiff/03.csv", out, "-m", machine)
    assert done.status == 0 and "7 columns on 1 clock" in done.out
    arguments = ("-d", "gm", "--set=threshold.limits=400", "--json")
    before = cdtool("detect", LOGS / "gate/stiff/03.csv", "-m", machine, *arguments)
    after = cdtool("detect", out, "-m", f"{out}.machine.toml", *arguments)
    assert before.status == after.status == 0
    alarms = [json.loads(text.out)[0]["alarms"] for text in (before, after)]
    assert alarms[0] and [item["time_s"] for item in alarms[0]] == pytest.approx([item["time_s"] for item in alarms[1]])


def test_a_truncated_log_is_converted_up_to_the_cut_with_status_3(tmp_path):
    data = (LOGS / "gate/stiff/01.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: len(data) * 2 // 3])
    done = cdtool("convert", tmp_path / "cut.mcap", tmp_path / "out.mcap", "-m", LOGS / "gate/machine.toml")
    assert done.status == 3 and "loss:" in done.err and (tmp_path / "out.mcap").exists()


EPOCH = 1_700_000_000.25


def dated(path: Path) -> Path:
    """A table whose clock counts from 1970, in ms, and begins at a quarter of a second."""
    rows = "\n".join(f"{EPOCH * 1e3 + k * 2.5!r},{float(np.sin(k))!r},{float(np.cos(k))!r}" for k in range(200))
    path.write_text(f"time [ms],torque [N m],speed [rad/s]\n{rows}\n")
    return path


def known(folder: Path) -> Path:
    path = machine_file(folder)
    path.write_text(path.read_text().replace('"time", unit = "s"', '"time", unit = "ms"'))
    return path


@pytest.mark.parametrize("suffix", KINDS)
def test_a_table_on_an_epoch_keeps_its_start_through_a_container_and_back(suffix, tmp_path):
    needs(suffix)
    log, machine = dated(tmp_path / "run.csv"), known(tmp_path)
    original = logged(log, machine)
    assert original.origin == EPOCH and original.start == 0.0
    first = convert(log, tmp_path / f"out{suffix}", machine=machine)
    second = convert(first.files[0], tmp_path / "back.csv", machine=first.machine_files[0])
    for done in (first, second):
        found = logged(done.files[0], done.machine_files[0])
        assert found.origin == EPOCH
        assert_same(original, found, exact_time=done is first and suffix != ".mcap")


@pytest.mark.parametrize("suffix", KINDS)
def test_all_columns_of_several_clocks_keep_the_start_without_a_machine_file(suffix, tmp_path):
    needs(suffix)
    log = two_clocks(tmp_path / "run.mcap", start_ns=1_700_000_000_250_000_000)
    first = convert(log, tmp_path / f"out{suffix}")
    for path in first.files:
        again = convert(path, tmp_path / "again.csv", force=True)
        for name in (path, again.files[0]):
            assert ColumnRows(Path(name)).origin == ColumnRows(log).origin > 1.6e9


def test_the_kinds_of_a_label_are_kept(tmp_path):
    text = '[machine]\ntype = "linear_axis"\ncoordinates = "load"\n[channels]\ntime = { column = "t", unit = "s" }\n'
    text += (
        'speed = { column = "v", unit = "m/s" }\nlabel = { column = "k", kinds = { 1 = "hard", "2.5" = "so\\"ft" } }\n'
    )
    (tmp_path / "machine.toml").write_text(text, encoding="utf-8")
    (tmp_path / "log.csv").write_text(
        "t,v,k\n" + "".join(f"{i / 10},0.{i},{i % 3}\n" for i in range(9)), encoding="utf-8"
    )
    machine = read_machine_file(tmp_path / "machine.toml")
    convert(tmp_path / "log.csv", tmp_path / "new.parquet", machine=machine)
    again = read_machine_file(tmp_path / "new.parquet.machine.toml")
    assert {item.channel: item.kinds for item in again.columns.sources}["label"] == ((1.0, "hard"), (2.5, 'so"ft'))


@pytest.mark.parametrize(
    ("head", "origin"),
    [
        ("# cdtool.source: a\n# cdtool.origin_s: 12.5\n", 12.5),
        ("# cdtool.origin_s: noon\n", 0.0),
        ("# cdtool.origin_s: nan\n", 0.0),
        ("# a note\n# cdtool.origin_s: 12.5\n", 0.0),
        ("", 0.0),
    ],
    ids=["written", "edited", "no number", "in a comment of another's", "none"],
)
def test_only_a_header_written_by_convert_states_the_start(head, origin, tmp_path):
    (tmp_path / "log.csv").write_text(head + "t [s],v\n" + "".join(f"{k / 10},{k % 7}\n" for k in range(50)))
    assert ColumnRows(tmp_path / "log.csv").origin == origin
    assert list(survey(tmp_path / "log.csv").columns) == ["t [s]", "v"]
