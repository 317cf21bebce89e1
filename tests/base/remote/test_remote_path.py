"""A file at a URL is asked as a local path is, wherever cdtool asks one."""

from __future__ import annotations

import os
import pickle
from pathlib import Path

import pytest

from cdtool.base.remote.remote_path import is_remote, joined, location, version_of
from cdtool.commands.judging.runs import find_logs

NAMES = [
    "a/01.csv",
    "a/02.csv",
    "a/.hidden.csv",
    "a/deep/er/03.csv",
    "b c/ü#7.csv",
    "b c/4?.csv",
    "x.toml",
    ".d/05.csv",
]


@pytest.fixture
def tree(memory, tmp_path):
    """The same files below a local folder and below a URL."""
    for name in NAMES:
        path = tmp_path / "logs" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(name.encode())
        memory.pipe_file(f"/logs/{name}", name.encode())
    return tmp_path / "logs", location("memory://logs")


def test_a_text_is_a_local_path_or_a_url(tmp_path):
    assert location("a/b.csv") == Path("a/b.csv") and not is_remote(location("a/b.csv"))
    assert location(f"file://{tmp_path}/a b.csv") == tmp_path / "a b.csv"
    assert location("file:///a%20b.csv") == Path("/a b.csv")
    path = location("s3://bucket/a//b.csv")
    assert is_remote(path) and location(path) is path and str(path) == "s3://bucket/a//b.csv"


def test_paths_are_joined_as_local_ones():
    base = location("s3://bucket/one")
    assert str(base / "../machine.toml") == "s3://bucket/machine.toml"
    assert str(base / "./a" / "b.csv") == "s3://bucket/one/a/b.csv"
    assert str(base / "s3://other/x.csv") == "s3://other/x.csv" and base / "/local/x.csv" == Path("/local/x.csv")
    assert joined(Path("local"), "s3://b/x") == location("s3://b/x") and joined(Path("local"), "x") == Path("local/x")
    assert str(location("s3://bucket//one")) == "s3://bucket//one" and str(base / "a//b") == "s3://bucket/one/a//b"


def test_credentials_travel_to_other_processes_but_not_into_texts():
    path = location("sftp://robot:geheim@host/a.csv")
    assert b"geheim" in pickle.dumps(path)
    assert "geheim" not in f"{path} {path!r} {path.parent} {path.parts} {path.as_posix()}"


def test_content_is_read_by_any_way_of_opening(tree):
    _, remote = tree
    path = remote / "a/01.csv"
    with open(path, "rb") as file, path.open(encoding="utf-8") as text:  # noqa: PTH123  what libraries do
        assert file.read() == b"a/01.csv" and text.read() == "a/01.csv"
    handle = os.open(path, os.O_RDONLY)
    assert os.read(handle, 99) == b"a/01.csv"
    os.close(handle)
    assert path.read_bytes() == b"a/01.csv"
    assert path.stat().st_size == 8 and path.is_file() and not path.is_dir() and path.exists()
    assert path.parent.is_dir() and not path.parent.is_file() and path.samefile(location("memory://logs/a/01.csv"))
    assert [item.name for item in (remote / "a").iterdir()] == [".hidden.csv", "01.csv", "02.csv", "deep"]


def test_a_missing_file_is_missing_as_a_local_one(memory):
    path = location("memory://logs/none.csv")
    assert not path.exists() and not path.is_file() and not path.is_dir() and not list(path.parent.glob("*"))
    for reading in (
        path.open,
        path.stat,
        path.read_bytes,
        path.unlink,
        lambda: os.fspath(path),
        lambda: version_of(path),
    ):
        with pytest.raises(FileNotFoundError, match=r"memory://logs/none.csv: no such file"):
            reading()
    path.unlink(missing_ok=True)


@pytest.mark.parametrize(
    "pattern",
    [
        "*",
        "*/*.csv",
        "a/0[12].csv",
        "**/*.csv",
        "a/**/*.csv",
        ".d/*.csv",
        "*/ü#7.csv",
        "b c/*",
        "a/01.csv",
    ],
)
def test_patterns_find_what_they_find_in_a_folder(tree, pattern):
    local, remote = tree
    expected = [path.relative_to(local).as_posix() for path in find_logs([pattern], local)]
    assert [path.relative_to(remote).as_posix() for path in find_logs([pattern], remote)] == expected
