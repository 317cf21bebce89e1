"""Local copies of files at URLs: bounded, of the current version, and removed."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from cdtool.base.errors import is_lasting
from cdtool.base.remote import session, staging, storage
from cdtool.base.remote.remote_path import location
from cdtool.base.remote.storage import StorageError

ROOT = Path(__file__).parents[3]
MIB = 1 << 20


def copies() -> list[Path]:
    """Return the copies of this process."""
    return sorted(session.folder().glob(f"{os.getpid()}-*"))


def test_a_file_is_copied_once_and_removed_after_use(memory, monkeypatch):
    memory.pipe_file("/logs/a.csv", b"1")
    fetched = []
    fetch = storage.fetch
    monkeypatch.setattr(storage, "fetch", lambda url, target: fetched.append(url) or fetch(url, target))
    path = location("memory://logs/a.csv")
    first = os.fspath(path)
    assert path.open("rb").read() == b"1" and os.fspath(path) == first and first.endswith(".csv")
    assert len(fetched) == 1 and [str(item) for item in copies()] == [first]
    staging.release()
    assert not copies()


def test_a_thread_keeps_the_copies_of_another_one_that_is_at_work(memory):
    memory.pipe_file("/logs/a.csv", b"1")
    with staging.copies_in_use():
        mine = Path(os.fspath(location("memory://logs/a.csv")))
        with ThreadPoolExecutor(1) as thread:
            thread.submit(_use_copies).result()
        assert mine.exists()
    assert not mine.exists()


def _use_copies() -> None:
    with staging.copies_in_use():
        os.fspath(location("memory://logs/a.csv"))


def test_the_copies_are_bounded(memory, monkeypatch):
    monkeypatch.setenv("CDTOOL_CACHE_MIB", "2.5")
    for name in "abc":
        memory.pipe_file(f"/logs/{name}.csv", name.encode() * MIB)
    paths = [location(f"memory://logs/{name}.csv") for name in "abc"]
    os.fspath(paths[0]), os.fspath(paths[1]), os.fspath(paths[0])
    os.fspath(paths[2])  # makes room by removing the one that was used longest ago
    assert sum(path.stat().st_size for path in copies()) == 2 * MIB
    assert {path.read_bytes()[:1] for path in copies()} == {b"a", b"c"}


def test_a_file_larger_than_the_bound_is_refused_before_it_is_read(memory, monkeypatch):
    monkeypatch.setenv("CDTOOL_CACHE_MIB", "0.5")
    memory.pipe_file("/logs/a.csv", b"a" * MIB)
    with pytest.raises(StorageError, match=r"has 1 MiB; .* \(set CDTOOL_CACHE_MIB to a larger number\)"):
        os.fspath(location("memory://logs/a.csv"))
    assert not copies()


def test_a_replaced_file_is_copied_again(memory, monkeypatch):
    memory.pipe_file("/logs/a.csv", b"old")
    path = location("memory://logs/a.csv")
    assert path.open("rb").read() == b"old"
    before = path.stat()
    memory.pipe_file("/logs/a.csv", b"newer")
    assert path.stat().st_mtime_ns != before.st_mtime_ns and path.open("rb").read() == b"newer"


def test_a_file_that_changes_while_it_is_copied_is_not_used(memory, monkeypatch):
    memory.pipe_file("/logs/a.csv", b"0")
    fetch, count = storage.fetch, iter(range(1, 9))

    def changing(url, target):
        fetch(url, target)
        memory.pipe_file("/logs/a.csv", b"x" * next(count))

    monkeypatch.setattr(storage, "fetch", changing)
    with pytest.raises(StorageError, match="changed while it was read") as caught:
        os.fspath(location("memory://logs/a.csv"))
    assert not is_lasting(caught.value) and not copies()


_COPIES = """
import os, sys, fsspec
fsspec.filesystem("memory").pipe_file("/a.csv", b"1")
from cdtool.base.remote.remote_path import location
os.fspath(location("memory://a.csv"))
print(len(os.listdir(sys.argv[1])), flush=True)
{end}
"""


@pytest.mark.parametrize(
    ("end", "left"),
    [("", 0), ("raise SystemExit(143)", 0), ("os.kill(os.getpid(), 9)", 1)],
    ids=["end", "term", "kill"],
)
def test_nothing_is_left_when_a_process_ends_and_the_next_removes_what_a_killed_one_left(tmp_path, end, left):
    environment = {**os.environ, "TMPDIR": str(tmp_path), "PYTHONPATH": str(ROOT)}
    environment.pop("CDTOOL_REMOTE_FOLDER", None)
    command = [sys.executable, "-c", _COPIES.format(end=end), str(tmp_path)]
    first = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert first.stdout == "1\n"
    assert len(list(tmp_path.iterdir())) == left
    subprocess.run(
        [*command[:2], _COPIES.format(end=""), str(tmp_path)], env=environment, check=True, capture_output=True
    )
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_forked_worker_has_copies_of_its_own(memory):
    memory.pipe_file("/logs/a.csv", b"1")
    path = location("memory://logs/a.csv")
    mine = os.fspath(path)
    child = os.fork()
    if not child:
        other = os.fspath(path)
        staging.release()
        os._exit(0 if other != mine and Path(mine).exists() and not Path(other).exists() else 1)
    assert os.waitpid(child, 0)[1] == 0 and Path(mine).exists()
    assert Path(mine).is_relative_to(tempfile.gettempdir())
