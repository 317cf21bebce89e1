"""What differs on Windows, simulated: open files stay, other locks, cp1252 as encoding, at most 61 processes."""

from __future__ import annotations

import errno
import io
import re
import sys
from contextlib import closing
from pathlib import Path

import pytest

from cdtool.base.files.locks import holding, lock_handle
from cdtool.base.files.writing import replaced_folder, write_text
from cdtool.commands.console import streams
from cdtool.execution import processes
from cdtool.execution.in_worker import Done
from cdtool.formats.mcap import file_bytes
from tests.command import FEW, cdtool
from tests.fuzz.hostile_commands import make_bench
from tests.windows_files import CAN_SIMULATE, windows_files

ROOT = Path(__file__).parents[2]
# Names that Windows gives to devices, and signs that it does not allow.
DEVICES = {"con", "prn", "aux", "nul", *(f"{name}{number}" for name in ("com", "lpt") for number in range(10))}
FORBIDDEN = re.compile(r'[<>:"\\|?*\x00-\x1f]|[. ]$')


@pytest.fixture
def on_windows():
    if not CAN_SIMULATE:
        pytest.skip("no /proc: which files are open is not known")
    with windows_files():
        yield


def left(folder: Path) -> list[str]:
    return [path.name for path in folder.rglob(".cdtool-*")]


def test_a_lock_is_held_by_one_and_its_file_is_removed_at_its_end(on_windows, tmp_path):
    target = tmp_path / "a.json"
    with holding(target, tmp_path, target):
        (lock,) = tmp_path.iterdir()
        with lock.open("r+b") as other:
            assert not lock_handle(other.fileno())
    assert list(tmp_path.iterdir()) == []


def test_a_folder_is_replaced_without_an_exchange_of_folders(on_windows, monkeypatch, tmp_path):
    import ctypes

    def absent(name, **_):
        raise TypeError("LoadLibrary() argument 1 must be str, not None")

    monkeypatch.setattr(ctypes, "CDLL", absent)
    for text in ("old", "new"):
        with replaced_folder(tmp_path / "report", lambda _: True) as part:
            write_text(part / "a.md", text)
    assert (tmp_path / "report" / "a.md").read_text() == "new" and left(tmp_path) == []


def test_commands_write_replace_and_reuse_their_files(on_windows, tmp_path):
    make_bench(tmp_path)
    log, machine, bench = tmp_path / "stiff" / "01.csv", tmp_path / "machine.toml", tmp_path / "benchmark.toml"
    free = sorted(tmp_path.glob("free/*.csv"))
    for _ in range(2):
        for words in (
            ("learn-signature", *free, "-m", machine, "-d", "feekf", FEW, "-o", tmp_path / "feekf.json"),
            ("detect", log, "-m", machine, "-s", tmp_path / "gate.json", "--plot", tmp_path / "a.png", "--force"),
            ("benchmark", bench, "-o", f"{tmp_path / 'report'}/", "-o", tmp_path / "results.parquet", "--force"),
            ("benchmark", bench, "--store", tmp_path / "store"),
            *(("convert", log, tmp_path / f"to{end}", "--force") for end in (".csv", ".mcap", ".parquet")),
        ):
            done = cdtool(*words)
            assert done.status in (0, 1, 3) and "cannot be written" not in done.err, (words, done.err)
    done = cdtool("signature", "update", tmp_path / "gate.json", tmp_path / "holdout" / "01.csv", "-m", machine)
    assert done.status == 0, done.err
    assert "store: 0 recordings computed" in cdtool("benchmark", bench, "--store", tmp_path / "store").out
    assert left(tmp_path) == [] and not list(tmp_path.rglob("*.journal"))


@pytest.mark.parametrize("is_console", [False, True])
def test_output_in_a_narrow_encoding_never_raises(monkeypatch, tmp_path, is_console):
    monkeypatch.setattr(streams, "_IS_WINDOWS", True)
    with (tmp_path / "out.txt").open("wb") as file:
        stream = io.TextIOWrapper(io.FileIO(file.fileno(), "wb", closefd=False), encoding="cp1252")
        monkeypatch.setattr(stream, "isatty", lambda: is_console, raising=False)
        made = streams._opened(stream, file.fileno())
        assert (made is stream) is is_console  # a console has a writer of its own
        made.write("≥ 95 % – Größe\n")
        made.flush()
    assert (tmp_path / "out.txt").read_text(encoding="cp1252") == "? 95 % – Größe\n"


@pytest.mark.parametrize(("on_windows", "is_an_error"), [(True, False), (False, True)])
def test_a_closed_pipe_of_windows_is_not_a_full_disk(monkeypatch, on_windows, is_an_error):
    class Stream(streams._Stream):
        descriptor = streams._Descriptor(0, "rb", closefd=False)

        def __init__(self):
            super().__init__(io.BytesIO())

    Stream.descriptor.fault = OSError(errno.EINVAL, "Invalid argument")
    monkeypatch.setattr(streams, "_IS_WINDOWS", on_windows)
    monkeypatch.setattr(sys, "stdout", Stream())
    assert (streams.lost_output() is not None) is is_an_error


def doubled(item):
    return 2 * item


def test_no_more_processes_are_started_than_windows_waits_for(monkeypatch):
    monkeypatch.setattr(processes, "_MOST_PROCESSES", 2)
    pool = processes.Processes(doubled, 100, None)
    with pool:
        pool.begin(0, 4)
        ended = pool.ended(wait_for_one=True) or pool.ended(wait_for_one=True)  # at first it may be ready only
        assert pool.size == 2 and ended == [(0, Done(8))]


def test_every_file_of_the_repository_can_exist_on_every_system():
    folders = ("cdtool", "docs", "sample_logs", "tests", "benchmarks", ".ci", ".github", "docker")
    paths = [path for name in folders for path in (ROOT / name).rglob("*") if "__pycache__" not in path.parts]
    assert len(paths) > 1000
    seen: dict[str, Path] = {}
    for path in paths:
        shown = path.relative_to(ROOT).as_posix()
        assert not FORBIDDEN.search(path.name) and path.name.partition(".")[0].lower() not in DEVICES, shown
        assert seen.setdefault(shown.lower(), path) == path, f"{shown}: the same name in other letters"
        assert len(shown) < 120, f"{shown}: with the folder of a user it is longer than 260 characters"


def test_a_large_record_is_read_in_as_many_calls_as_the_system_needs(monkeypatch, tmp_path):
    """MacOS refuses 2 GiB and more in one call."""
    monkeypatch.setattr(file_bytes, "_MOST_AT_ONCE", 1000)
    content = bytes(range(256)) * 40
    (tmp_path / "a.mcap").write_bytes(content)
    with closing(file_bytes.FileBytes(tmp_path / "a.mcap")) as file:
        assert bytes(file.read(5, 9000)) == content[5:9005]
