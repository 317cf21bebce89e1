"""Safe writing: links, locks, modes, leftover files, signals, whole folders."""

from __future__ import annotations

import errno
import os
import signal
import stat
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from cdtool.base.errors import CdtoolError, OutputError, UsageError
from cdtool.base.files import locks as file_locks
from cdtool.base.files import writing as files
from cdtool.base.files.writing import clean_up, locked, replaced, replaced_folder, write_pieces, write_text

ROOT = Path(__file__).parents[3]
posix_only = pytest.mark.skipif(os.name != "posix", reason="links, modes and signals as POSIX has them")


def names(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*")}


def test_a_file_is_made_of_its_pieces_or_stays_as_it_was(tmp_path):
    write_pieces(tmp_path / "a.md", (text for text in ("ä", "", "\n", "\ud800")))
    assert (tmp_path / "a.md").read_bytes() == b"\xc3\xa4\n?"

    def broken():
        yield "new"
        raise ValueError("a fault")

    with pytest.raises(ValueError, match="a fault"):
        write_pieces(tmp_path / "a.md", broken())
    assert (tmp_path / "a.md").read_bytes() == b"\xc3\xa4\n?"
    assert [path.name for path in tmp_path.iterdir()] == ["a.md"]


@posix_only
def test_a_link_stays_and_what_it_leads_to_is_written(tmp_path):
    (tmp_path / "real").mkdir()
    (tmp_path / "real" / "a.md").write_text("old")
    (tmp_path / "link.md").symlink_to("real/a.md")
    write_text(tmp_path / "link.md", "new")
    assert (tmp_path / "link.md").is_symlink() and (tmp_path / "real" / "a.md").read_text() == "new"
    assert names(tmp_path) == {"link.md", "real", "real/a.md"}


@posix_only
def test_a_link_to_a_missing_file_is_refused(tmp_path):
    (tmp_path / "link.md").symlink_to("elsewhere/a.md")
    (tmp_path / "elsewhere").mkdir()
    with pytest.raises(UsageError, match=r"link\.md: is a link to a missing file"):
        write_text(tmp_path / "link.md", "new")
    with pytest.raises(UsageError, match="a missing file"), replaced_folder(tmp_path / "link.md"):
        pass
    assert names(tmp_path) == {"link.md", "elsewhere"}


@posix_only
@pytest.mark.parametrize("mask", [0o022, 0o077, 0o002])
def test_a_new_file_and_folder_get_the_mode_that_the_umask_leaves(tmp_path, mask):
    before = os.umask(mask)
    try:
        write_text(tmp_path / "a.md", "x")
        with replaced_folder(tmp_path / "folder") as part:
            write_text(part / "b.md", "x")
    finally:
        os.umask(before)
    modes = [stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("a.md", "folder/b.md", "folder")]
    assert modes == [0o666 & ~mask, 0o666 & ~mask, 0o777 & ~mask]


@posix_only
@pytest.mark.parametrize("mode", [0o600, 0o664, 0o640])
def test_an_existing_file_keeps_its_mode(tmp_path, mode):
    path = tmp_path / "a.md"
    path.write_text("old")
    path.chmod(mode)
    with replaced(path) as (part,):
        assert stat.S_IMODE(part.stat().st_mode) & ~mode & 0o077 == 0  # no additional readers meanwhile
        part.write_text("new")
    assert stat.S_IMODE(path.stat().st_mode) == mode and path.read_text() == "new"


def test_an_error_in_the_block_leaves_the_old_file_only(tmp_path):
    (tmp_path / "a.md").write_text("old")
    with pytest.raises(CdtoolError, match=r"^.*a\.md is bad$"), replaced(tmp_path / "a.md", tmp_path / "b.md") as parts:
        parts[1].write_text("new")
        raise CdtoolError(f"{parts[0]} is bad")
    assert names(tmp_path) == {"a.md"} and (tmp_path / "a.md").read_text() == "old"


@pytest.mark.parametrize("failing", [1, 2])
def test_of_several_files_all_are_replaced_or_none(tmp_path, monkeypatch, failing):
    (tmp_path / "a.md").write_text("old")
    (tmp_path / "b.md").write_text("old")
    real, done = Path.replace, []

    def replace(self: Path, target: Path) -> Path:
        done.append(self)
        if len(done) == failing:
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        return real(self, target)

    monkeypatch.setattr(Path, "replace", replace)
    paths = [tmp_path / name for name in ("a.md", "b.md", "c.md")]
    with pytest.raises(OutputError, match=r"a\.md: cannot be written: Input/output error"), replaced(*paths) as parts:
        for part in parts:
            part.write_text("new")
    assert names(tmp_path) == {"a.md", "b.md"}
    assert {(tmp_path / name).read_text() for name in ("a.md", "b.md")} == {"old"}


def test_what_cannot_be_put_back_is_not_removed(tmp_path, monkeypatch):
    paths = [tmp_path / name for name in ("a.md", "b.md", "c.md")]
    for path in paths:
        path.write_text("old")

    def refused(self: Path, target: Path) -> Path:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(Path, "replace", refused)
    with pytest.raises(OutputError), replaced(*paths):
        pass
    clean_up()
    monkeypatch.undo()
    write_text(tmp_path / "d.md", "another command")
    left = [path for path in tmp_path.iterdir() if path.name != "d.md"]
    assert [path.read_text() for path in left] == ["old"] * 3 and (tmp_path / "a.md") in left


KILLED = """
import os, sys
from pathlib import Path
from cdtool.base.files.writing import write_texts
left = [int(sys.argv[2])]
def killing(call):
    def counted(*arguments, **options):
        if not left[0]:
            os._exit(9)
        left[0] -= 1
        return call(*arguments, **options)
    return counted
Path.replace, Path.rename, Path.unlink, os.link = map(killing, (Path.replace, Path.rename, Path.unlink, os.link))
write_texts({Path(sys.argv[1]) / name: "new" for name in ("log.csv", "log.csv.machine.toml")})
"""


@posix_only
def test_a_killed_process_leaves_no_old_file_beside_a_new_one(tmp_path):
    log, machine = tmp_path / "log.csv", tmp_path / "log.csv.machine.toml"
    seen = set()
    for calls in range(40):
        log.write_text("old")
        machine.write_text("old")
        command = [sys.executable, "-c", KILLED, str(tmp_path), str(calls)]
        status = subprocess.run(command, cwd=ROOT, check=False, timeout=60).returncode
        state = log.read_text(), machine.read_text() if machine.exists() else "none"
        assert state in {("old", "old"), ("old", "none"), ("new", "none"), ("new", "new")}, calls
        seen.add(state)
        if not status:
            break
    assert status == 0 and len(seen) == 4


def test_file_and_folder_are_flushed_to_the_disk(tmp_path, monkeypatch):
    flushed = []
    real = os.fsync
    monkeypatch.setattr(
        "cdtool.base.files.writing.os.fsync", lambda handle: (flushed.append(os.fstat(handle)), real(handle))
    )
    write_text(tmp_path / "a.md", "x")
    assert [stat.S_ISDIR(item.st_mode) for item in flushed] == [False, True]
    assert os.path.samestat(flushed[0], (tmp_path / "a.md").stat()) and os.path.samestat(flushed[1], tmp_path.stat())


DYING = """
import os, sys
from pathlib import Path
from cdtool.base.files.writing import replaced, replaced_folder
with replaced(Path(sys.argv[1]) / "a.md") as (part,), replaced_folder(Path(sys.argv[1]) / "folder") as folder:
    (folder / "b.md").write_text("x")
    print(flush=True)
    if sys.argv[2] == "die":
        os._exit(9)
    sys.stdin.read()
"""


def _writer(folder: Path, how: str) -> subprocess.Popen[bytes]:
    pipe = subprocess.PIPE
    process = subprocess.Popen([sys.executable, "-c", DYING, str(folder), how], stdin=pipe, stdout=pipe, cwd=ROOT)
    assert process.stdout is not None
    process.stdout.readline()
    return process


@posix_only
def test_files_of_a_dead_writer_are_removed_and_those_of_a_living_one_are_not(tmp_path):
    _writer(tmp_path, "die").wait(60)
    left = names(tmp_path)
    assert len(left) == 5 and all(name.startswith(".cdtool-") for name in left)
    (tmp_path / ".cdtool-mine.tmp").write_text("not of cdtool: no such name")
    living = _writer(tmp_path, "live")
    assert not left & names(tmp_path) - {name for name in left if name.endswith(".lock")}
    in_work = names(tmp_path)
    write_text(tmp_path / "c.md", "x")
    assert names(tmp_path) == {*in_work, "c.md"}
    living.communicate(b"", 60)
    assert names(tmp_path) == {"a.md", "c.md", "folder", "folder/b.md", ".cdtool-mine.tmp"}


def test_one_writer_of_a_file_at_a_time(tmp_path, monkeypatch):
    monkeypatch.setattr(file_locks, "LOCK_SECONDS", 0.05)
    with locked(tmp_path / "a.json") as target:
        assert target == (tmp_path / "a.json").resolve()
        write_text(target, "mine")  # under the lock held by this thread
        told: list[Exception] = []

        def other() -> None:
            try:
                write_text(tmp_path / "a.json", "other")
            except CdtoolError as fault:
                told.append(fault)

        thread = threading.Thread(target=other)
        thread.start()
        thread.join(30)
        assert "a.json: is being written by another process" in str(told[0])
        write_text(tmp_path / "b.json", "another file is free")
    assert (tmp_path / "a.json").read_text() == "mine" and names(tmp_path) == {"a.json", "b.json"}


def test_a_folder_is_replaced_as_a_whole(tmp_path):
    target = tmp_path / "deep" / "report"
    with replaced_folder(target) as part:
        (part / "a.md").write_text("first")
        (part / "gone.md").write_text("first")
        assert not target.exists()
    with replaced_folder(target, lambda _: True) as part:
        (part / "a.md").write_text("second")
        assert names(target) == {"a.md", "gone.md"} and (target / "a.md").read_text() == "first"
    assert names(tmp_path) == {"deep", "deep/report", "deep/report/a.md"}
    assert (target / "a.md").read_text() == "second"


def test_a_folder_that_fails_leaves_the_old_one_and_no_new_parents(tmp_path):
    (tmp_path / "report").mkdir()
    (tmp_path / "report" / "a.md").write_text("old")
    for target in (tmp_path / "report", tmp_path / "new" / "deep" / "report"):
        with (
            pytest.raises(OutputError, match="cannot be written: No space"),
            replaced_folder(target, lambda _: True) as part,
        ):
            (part / "a.md").write_text("new")
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert names(tmp_path) == {"report", "report/a.md"} and (tmp_path / "report" / "a.md").read_text() == "old"


@pytest.mark.parametrize("why", ["not everything may go", "no exchange", "current folder"])
def test_if_a_folder_cannot_be_exchanged_its_files_are_replaced(tmp_path, monkeypatch, why):
    target = tmp_path / "report"
    target.mkdir()
    (target / "a.md").write_text("old")
    (target / "other").write_text("mine")
    if why == "no exchange":
        monkeypatch.setattr(files, "_exchange", lambda *_: False)
    if why == "current folder":
        monkeypatch.chdir(target)
    with replaced_folder(target, lambda _: why != "not everything may go") as part:
        (part / "a.md").write_text("new")
    assert names(target) == {"a.md", "other"}
    assert (target / "a.md").read_text() == "new" and (target / "other").read_text() == "mine"


def test_two_writers_of_a_folder_do_not_mix(tmp_path):
    def write(text: str) -> None:
        with replaced_folder(tmp_path / "report", lambda _: True) as part:
            for number in range(5):
                (part / f"{number}").write_text(text)
            (part / text).write_text(text)

    threads = [threading.Thread(target=write, args=(text,)) for text in "abcdefgh"]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    held = {path.name: path.read_text() for path in (tmp_path / "report").iterdir()}
    assert len(held) == 6 and len(set(held.values())) == 1
    assert names(tmp_path) == {"report", *(f"report/{name}" for name in held)}


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
def test_a_device_is_written_to_and_never_replaced():
    with pytest.raises(OutputError, match="/dev/full: cannot be written: No space left"):
        write_text(Path("/dev/full"), "x")
    with pytest.raises(UsageError, match="not a regular file"), replaced(Path("/dev/full")):
        pass
    assert stat.S_ISCHR(Path("/dev/full").stat().st_mode)


COMMAND = """
import os, signal, sys
from pathlib import Path
import cdtool.report.plots.figures as figures
number = getattr(signal, sys.argv[1])
signal.signal(signal.SIGINT, signal.default_int_handler)  # what runs in the background of a script ignores it
def slow(path, content):
    from cdtool.base.files.writing import replaced
    with replaced(path) as (part,):
        os.kill(os.getpid(), number)
        for _ in range(1000): pass
figures.write_bytes = slow
sys.argv = ["cdtool", "study", "sensors", "-m", "sample_logs/gate/machine.toml", "-o", sys.argv[2]]
from cdtool.commands.app import main
main()
"""


@posix_only
@pytest.mark.parametrize(("name", "status", "word"), [("SIGINT", 130, "interrupted"), ("SIGTERM", 143, "terminated")])
def test_sigterm_cleans_up_as_sigint_does(tmp_path, name, status, word):
    arguments = [sys.executable, "-c", COMMAND, name, str(tmp_path / "ranking.png")]
    done = subprocess.run(arguments, cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (status, f"{word}\n")
    assert names(tmp_path) == set()


@posix_only
@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_ends_a_command_even_during_an_import(monkeypatch, number, status):
    import cdtool.base.registry
    from tests.command import cdtool as run

    def struck(*_: object, **__: object) -> None:
        try:
            signal.raise_signal(number)
        except BaseException:
            raise ImportError("initialization failed") from None

    monkeypatch.setattr(cdtool.base.registry.Registry, "names", struck)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        done = run("list", "detectors")
    finally:
        signal.signal(signal.SIGINT, before)
    assert done.status == status and "Traceback" not in done.err
