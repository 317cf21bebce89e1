"""A file that cannot be written completely: one line, status 2, no file left."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from cdtool.base.errors import OutputError, RecordingError
from cdtool.base.files.writing import replaced
from cdtool.commands.convert.converting import convert
from cdtool.commands.convert.log_rows import ColumnRows
from cdtool.formats.groups import Part
from tests.commands.convert.kinds import KINDS, needs, table

# A full disk, simulated for a process: no file may exceed a few KiB.
LIMITED = """
import resource, sys
limit = int(sys.argv.pop(1))
resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
sys.argv[0] = "cdtool"
from cdtool.commands.app import main
main()
"""


def on_a_full_disk(limit: int, *arguments: object) -> subprocess.CompletedProcess[str]:
    pytest.importorskip("resource")
    package = str(Path(__file__).parents[2])
    return subprocess.run(
        [sys.executable, "-c", LIMITED, str(limit), *map(str, arguments)],
        env=os.environ | {"PYTHONPATH": package},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize("suffix", KINDS)
def test_a_full_disk_is_one_line_and_leaves_existing_files(suffix, tmp_path):
    needs(suffix)
    log, target = table(tmp_path / "run.csv", rows=10_000), tmp_path / "out" / f"out{suffix}"
    target.parent.mkdir()
    target.write_bytes(b"mine")
    done = on_a_full_disk(1 << 15, "convert", log, target, "--force")
    expected = f"error: {target}: cannot be written: {os.strerror(errno.EFBIG)} (check the folder and its space)\n"
    assert (done.returncode, done.stdout, done.stderr) == (2, "", expected)
    assert target.read_bytes() == b"mine" and len(list(target.parent.iterdir())) == 1


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
def test_a_full_device_is_reported_with_the_file_name(tmp_path):
    target = tmp_path / "out.csv"
    with (
        pytest.raises(OutputError, match=r"out\.csv: cannot be written: No space left on device") as told,
        replaced(target),
        Path("/dev/full").open("w") as file,
    ):
        file.write("1,2\n")
    assert "\n" not in str(told.value) and list(tmp_path.iterdir()) == []


def test_a_read_error_is_not_reported_for_the_file_being_written(tmp_path, monkeypatch):
    log = table(tmp_path / "run.csv")

    def lost(*_: object):
        yield [Part(None, ())]
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    monkeypatch.setattr(ColumnRows, "parts", lost)
    monkeypatch.setattr("cdtool.formats.exports.csv_writing._lines", lambda *_: "")
    monkeypatch.setattr(Part, "__len__", lambda _: 0)
    with pytest.raises(RecordingError, match=r"run\.csv: cannot be read: Input/output error"):
        convert(log, tmp_path / "out.csv")
    assert [path.name for path in tmp_path.iterdir()] == ["run.csv"]
