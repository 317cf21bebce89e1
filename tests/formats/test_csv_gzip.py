"""Text tables that are compressed with gzip are read as the tables in them, bounded, and errors are one line."""

from __future__ import annotations

import gzip
import json
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import cdtool
from cdtool.base.errors import RecordingError
from cdtool.formats.channels.reading import choose_format, log_pieces, survey
from cdtool.formats.pieces import join_pieces
from tests.command import cdtool as command

ROOT = Path(__file__).parents[2]
GATE = ROOT / "sample_logs" / "gate"


@cache
def table(rows: int, header: str = "t;i_motor;x\n", encoding: str = "utf-8", line_end: str = "\n") -> bytes:
    """Return a table with a comma as decimal mark, of more than one block from 40,000 rows on."""
    random = np.random.default_rng(4).normal(size=(rows, 2))
    lines = (f"{k / 1000:.3f};{a:.9f};{b:.12f}".replace(".", ",") for k, (a, b) in enumerate(random))
    return (header + "".join(line + "\n" for line in lines)).replace("\n", line_end).encode(encoding)


def written(folder: Path, content: bytes, name: str = "a.csv") -> tuple[Path, Path]:
    """Write a table as it is, and compressed in a folder of its own; return both paths."""
    plain, packed = folder / name, folder / f"{name}.gz"
    plain.write_bytes(content)
    packed.write_bytes(gzip.compress(content, 6, mtime=0))
    return plain, packed


def assert_same(left, right) -> None:
    assert list(left.columns) == list(right.columns) and left.columns
    for name, column in left.columns.items():
        assert column.values.tobytes() == right.columns[name].values.tobytes()
        assert column.unit == right.columns[name].unit
    assert [str(item) for item in left.findings] == [str(item) for item in right.findings]
    assert (left.origin, left.details, left.dialect) == (right.origin, right.details, right.dialect)


@pytest.mark.parametrize(
    "content",
    [
        pytest.param(table(200), id="small"),
        pytest.param(table(45_000), id="several blocks"),
        pytest.param(table(45_000)[:-9], id="unfinished last line"),
        pytest.param(table(45_000) + bytes(3000), id="NUL bytes at the end"),
        pytest.param(table(45_000) + b"\n\n \n", id="blank lines at the end"),
        pytest.param(table(45_000) + b"End of file;;\n", id="footer"),
        pytest.param(table(40_000, encoding="utf-16"), id="UTF-16"),
        pytest.param(table(45_000, line_end="\r"), id="carriage returns"),
        pytest.param(table(45_000, header=""), id="no header"),
        pytest.param(b"# cdtool: origin_s: 12.5\n" + table(45_000), id="stated origin"),
    ],
)
def test_a_compressed_table_is_read_as_the_table_in_it(content, tmp_path):
    plain, packed = written(tmp_path, content)
    assert_same(survey(plain), survey(packed))
    assert_same(join_pieces(log_pieces(plain), sort=False), join_pieces(log_pieces(packed), sort=False))


@pytest.mark.parametrize("name", ["a.csv", "a.CSV", "a.txt", "a.tsv", "a.dat", "a", "a.csv.1"])
def test_a_compressed_table_is_recognised_by_content_and_not_by_name(name, tmp_path):
    _, packed = written(tmp_path, table(200), name)
    assert choose_format(packed).name == "csv"
    renamed = packed.rename(tmp_path / "log.csv")
    assert choose_format(renamed).name == "csv"


def test_members_that_were_appended_to_each_other_are_one_table(tmp_path):
    content = table(45_000)
    plain, packed = written(tmp_path, content)
    cuts = (0, 5, 70_001, 1_400_000, len(content))
    parts = (content[start:end] for start, end in pairwise(cuts))
    packed.write_bytes(b"".join(map(gzip.compress, parts)))
    assert_same(survey(plain), survey(packed))


def test_every_command_reads_a_compressed_log(tmp_path):
    log = GATE / "stiff" / "03.csv"
    packed = tmp_path / "03.csv.gz"
    packed.write_bytes(gzip.compress(log.read_bytes()))
    machine = GATE / "machine.toml"
    alarms = [
        json.loads(command("detect", file, "-m", machine, "-d", "gm", "--set=threshold.limits=400", "--json").out)
        for file in (log, packed)
    ]
    for key in ("time_s", "statistic", "contact_onset_s"):
        assert len({run["alarms"][0][key] for (run,) in alarms}) == 1
    done = command("info", packed, "-m", machine)
    assert done.status == 0 and "csv" in done.out
    assert command("convert", packed, tmp_path / "03.mcap", "-m", machine).status == 0
    assert cdtool.read(packed, machine).name == "03"
    done = command("init", packed, "-o", tmp_path / "draft.toml")
    assert done.status in (0, 1) and (tmp_path / "draft.toml").exists()


BENCHMARK = """
machine = "{machine}"
detectors = ["gm"]
learn = {{ logs = ["{folder}/free/*.csv{end}"] }}
impacts.stiff = {{ logs = ["{folder}/stiff/*.csv{end}"] }}
signature = {{ force = true }}
onset = {{ above_n = 20.0, back_to_n = 8.0 }}
"""


def test_a_benchmark_and_its_draft_name_compressed_logs_by_a_pattern(tmp_path):
    for group in ("free", "stiff"):
        (tmp_path / group).mkdir()
        for log in sorted((GATE / group).glob("*.csv"))[:6]:
            (tmp_path / group / log.name).write_bytes(log.read_bytes())
            (tmp_path / group / f"{log.name}.gz").write_bytes(gzip.compress(log.read_bytes(), 1))
    done = command("init", *sorted(tmp_path.glob("*/*.csv.gz")), "-o", tmp_path / "study")
    draft = (tmp_path / "study" / "benchmark.toml").read_text(encoding="utf-8")
    assert done.status in (0, 1) and '"../free/*.csv.gz"' in draft and '"../stiff/*.csv.gz"' in draft
    results = []
    for end in ("", ".gz"):
        file, target = tmp_path / f"benchmark{end}.toml", tmp_path / f"results{end}.json"
        text = BENCHMARK.format(machine=(GATE / "machine.toml").as_posix(), folder=tmp_path.as_posix(), end=end)
        file.write_text(text, encoding="utf-8")
        assert command("benchmark", file, "-o", target, "--force").status in (0, 1)
        contacts = json.loads(target.read_text(encoding="utf-8"))["contacts"]
        results.append([(row["latency_ms"], row["force_at_alarm_n"]) for row in contacts])
    assert results[0] == results[1] and len(results[0]) == 2


@pytest.mark.parametrize("rows", [200, 45_000], ids=["small", "several blocks"])
@pytest.mark.parametrize("kept", [0.02, 0.5, 0.999], ids=["beginning", "half", "nearly all"])
def test_a_truncated_file_is_one_line(rows, kept, tmp_path):
    _, packed = written(tmp_path, table(rows))
    content = packed.read_bytes()
    packed.write_bytes(content[: int(len(content) * kept) + 1])
    with pytest.raises(RecordingError, match=r"a\.csv\.gz: truncated: its gzip data have no end") as fault:
        survey(packed)
    assert "copy it again" in fault.value.hint
    done = command("info", packed)
    assert done.status == 2 and done.err.count("\n") == 1 and "Traceback" not in done.err


@pytest.mark.parametrize("more", [b"a", b"trailing", b"more than that"])
def test_bytes_after_the_end_are_damage(more, tmp_path):
    _, packed = written(tmp_path, table(200))
    packed.write_bytes(packed.read_bytes() + more)
    with pytest.raises(RecordingError, match=r"a\.csv\.gz: .*(few bytes follow it|Not a gzipped file|damaged)"):
        survey(packed)


def test_what_is_compressed_but_no_table_is_named(tmp_path):
    for name, content in (("a.csv.gz", b"{}"), ("a.mcap.gz", b"\x89MCAP0\r\n" + bytes(100)), ("b.gz", bytes(2000))):
        (tmp_path / name).write_bytes(gzip.compress(content))
        with pytest.raises(RecordingError, match="is not a recording: it is gzip-compressed") as fault:
            survey(tmp_path / name)
        assert "unpack it first" in fault.value.hint
    (tmp_path / "a.csv.gz").write_bytes(gzip.compress(b""))
    with pytest.raises(RecordingError, match=r"a\.csv\.gz: is empty"):
        survey(tmp_path / "a.csv.gz")


# Lines that are not rows: tens of kilobytes of .csv.gz unpacked to 2.7 GB, or took 100 s.
NO_ROWS = {
    "blank": b"t,a\n0,1.5\n1,2.5\n" + b"\n" * 2_000_000,
    "blank in one column": b"a\n1.5\n2.5\n" + b"\n" * 2_000_000 + b"3.5\n",
    "blank at the end of one column": b"a\n1.5\n2.5\n" + b"\n" * 2_000_000,
    "comments": b"t,a\n0,1.5\n1,2.5\n" + b"#\n" * 1_000_000 + b"2,3\n",
    "the header again": b"t,a\n" + b"0,1.5\n" * 30_000 + b"t,a\n" * 100_000 + b"2,3\n",
}


@pytest.mark.parametrize("content", NO_ROWS.values(), ids=NO_ROWS)
def test_a_file_of_lines_that_are_no_rows_is_refused(tmp_path, content):
    path = tmp_path / "log.csv.gz"
    path.write_bytes(gzip.compress(content))
    for read in (survey, lambda path: list(log_pieces(path))):
        with pytest.raises(RecordingError, match=r"lines are not rows|of blank lines|unpacks to"):
            read(path)
