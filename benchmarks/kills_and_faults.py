"""Kills and failing calls at random points of every command that writes: each file is old or new, and complete.

Kills: SIGKILL, SIGTERM and SIGINT, half of them after a random time, half at a random call on a file of the output
folder. Faults: an open, write, fsync or rename there fails with ENOSPC, EIO, EACCES or EMFILE, by a library that is
preloaded (failing_calls.c, built with the system's compiler; without one there are no faults and kills come by time).
Each command runs through its real entry point in a process of its own, forked from one that has the imports done.

After a kill each file, or each report folder, must be the old or the new one, to the byte; a SIGKILL may leave hidden
temporaries, which the next write removes. Of two files that belong together it may leave the second one set aside,
whole, under a hidden name that ends in .old, so that no old file is beside a new one. After a fault, SIGTERM or SIGINT
each target is old or new with all that belongs to it (results and traces, a converted log and its machine file),
nothing else is there, and the status is the documented one: 2 with one line "error: ...", 143, 130.

python benchmarks/kills_and_faults.py                              # 500 and 500
python benchmarks/kills_and_faults.py --kills 10 --faults 10     # as in CI
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import errno
import importlib
import io
import itertools
import os
import pkgutil
import random
import shutil
import signal
import stat
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from timing import environment, table
from writing_commands import Case, cases, prepare

_LIBRARY = "CDTOOL_FAILING_CALLS"
OPEN, WRITE, FSYNC, RENAME, ANY = range(5)
KINDS = ("open", "write", "fsync", "rename", "any call")
FAULTS = {
    OPEN: (errno.ENOSPC, errno.EIO, errno.EACCES, errno.EMFILE),
    WRITE: (errno.ENOSPC, errno.EIO),
    FSYNC: (errno.ENOSPC, errno.EIO),
    RENAME: (errno.ENOSPC, errno.EIO, errno.EACCES),
}
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
_STATUS_OF = {signal.SIGTERM: 143, signal.SIGINT: 130}
# Of commands that have done their work: it was in order, a limit is not met, something was left out, or is incomplete.
_FINISHED = (0, 1, 3, 4)
# Lines about the input, unrelated to writing.
_OF_THE_WORK = ("warning: ", "note: ", "left out: ", "loss: ")
_HEAVY = ("matplotlib.backends.backend_agg", "matplotlib.backends.backend_svg", "matplotlib.backends.backend_pdf")
_OPTIONAL = ("h5py", "pyarrow.parquet", "pyarrow.ipc", "nptdms", "mcap.writer", "mcap.reader", "jinja2")
Snapshot = dict[str, tuple[int, bytes]]
# A folder whose files are written separately: one per log.
_PLOTS = "plots"


@dataclass(frozen=True)
class Outcome:
    status: int
    error: str
    seconds: float
    counts: tuple[int, ...]


@dataclass(frozen=True)
class Known:
    """The result of a case without a disturbance."""

    old: Path
    old_files: Snapshot
    new_files: Snapshot
    masks: dict[str, set[int]]
    outcome: Outcome


@dataclass(frozen=True)
class Strike:
    """What happens to a command: a signal after some seconds or at a call, or a call that fails."""

    signal: int = 0
    after: float = 0.0
    kind: int = ANY
    count: int = 0
    error: int = 0

    def __str__(self) -> str:
        if self.error:
            return f"{errno.errorcode[self.error]} at {KINDS[self.kind]} {self.count}"
        where = f"at call {self.count}" if self.count else f"after {self.after:.3f} s"
        return f"{signal.Signals(self.signal).name} {where}"


def main() -> int:
    options = _options()
    library = os.environ.get(_LIBRARY)
    if library is None:
        return _again_with_library()
    print(f"== kills and faults\n{environment()}", flush=True)
    if not library:
        print("skipped: faults and kills at calls: no C compiler, or not Linux")
    _import_everything()
    calls = ctypes.CDLL(library) if library else None
    with tempfile.TemporaryDirectory(prefix="kills") as name:
        return _measure(Path(name).resolve(), calls, options)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=500)
    parser.add_argument("--faults", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="cases whose name holds this")
    return parser.parse_args()


def _again_with_library() -> int:
    """This program again, with the library of failing calls preloaded where one can be built."""
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder) / "failing_calls.so"
        source = Path(__file__).with_name("failing_calls.c")
        compiler = shutil.which("cc") or shutil.which("gcc")
        built = sys.platform == "linux" and compiler is not None
        if built:
            command = [str(compiler), "-O1", "-shared", "-fPIC", "-o", str(library), str(source), "-ldl"]
            built = subprocess.run(command, check=False).returncode == 0
        again = os.environ | ({"LD_PRELOAD": str(library), _LIBRARY: str(library)} if built else {_LIBRARY: ""})
        return subprocess.run([sys.executable, __file__, *sys.argv[1:]], env=again, check=False).returncode


def _import_everything() -> None:
    import cdtool

    for item in pkgutil.walk_packages(cdtool.__path__, "cdtool."):
        importlib.import_module(item.name)
    for name in (*_HEAVY, *_OPTIONAL):
        try:
            importlib.import_module(name)
        except ImportError:
            print(f"not installed: {name}")


def _run_once(inputs: Path) -> None:
    """Run a few commands in this process: its children have their imports, compiled kernels and first plot."""
    for words in (
        ("benchmark", f"{inputs}/benchmark.toml", "-o", f"{inputs}/first.json", "-o", f"{inputs}/first.html"),
        ("info", f"{inputs}/1.csv", "-m", f"{inputs}/gate/machine.toml"),
        ("convert", f"{inputs}/1.csv", f"{inputs}/first.csv", "--force"),
        (
            "detect",
            f"{inputs}/1.csv",
            "-m",
            f"{inputs}/gate/machine.toml",
            "-s",
            f"{inputs}/a.json",
            "--plot",
            f"{inputs}/first.png",
        ),
    ):
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            status = _cdtool(words)
        if status not in _FINISHED:
            sys.exit(f"error: {' '.join(words)}: status {status}")


def _cdtool(words: Sequence[str]) -> int:
    from cdtool.commands.app import main as cdtool

    sys.argv = ["cdtool", *words]
    try:
        cdtool()
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(end.code is not None)
    return 0


def _measure(folder: Path, calls: Any, options: argparse.Namespace) -> int:
    inputs = folder / "inputs"
    inputs.mkdir()
    prepare(inputs, lambda words: _must(run(words, None, Strike(), inputs), words))
    _run_once(inputs)
    known: dict[Case, Known] = {}  # a few tries do not come to every command
    rng = random.Random(options.seed)
    rows, wrong = [], []
    chosen = [case for case in cases(inputs) if options.only in case.name]
    turns = itertools.cycle(chosen)  # faults begin with the case after the last one that was killed
    for what, wanted in (("kills", options.kills), ("faults", options.faults if calls else 0)):
        begin, done, tried = time.monotonic(), Counter[str](), 0
        while tried < wanted:
            case = next(turns)
            if case not in known:
                known[case] = _undisturbed(case, folder / f"old{len(known)}", folder / "out", calls)
            of_case = known[case]
            strike = _kill(rng, of_case, calls) if what == "kills" else _fault(rng, of_case)
            problem, struck = _try(case, of_case, strike, folder / "out", calls)
            if not struck:
                continue  # the command had already ended
            tried += 1
            if tried % 25 == 0:
                print(f"{tried} {what}, {len(wrong)} wrong", file=sys.stderr, flush=True)
            done[problem.partition(":")[0] if problem else "old or new"] += 1
            if problem:
                wrong.append(f"{case.name}: {strike}: {problem}")
                print(f"FAIL  {wrong[-1]}", flush=True)
        minutes = (time.monotonic() - begin) / 60.0
        rows.append((what, wanted, *(done[name] for name in ("old or new", *PROBLEMS)), f"{minutes:.1f}"))
    table(("", "number", "old or new", *PROBLEMS, "minutes"), rows)
    print(f"{len(known)} commands; {'FAIL' if wrong else 'ok'}: {len(wrong)} wrong")
    return 1 if wrong else 0


PROBLEMS = ("corrupt", "strays", "status", "lines")


def _must(outcome: Outcome, words: Sequence[str]) -> None:
    if outcome.status not in _FINISHED:
        sys.exit(f"error: {' '.join(words)}: status {outcome.status}\n{outcome.error}")


def _undisturbed(case: Case, old: Path, out: Path, calls: Any) -> Known:
    old.mkdir()
    if case.old:
        words = case.arguments(old, old=True)
        _must(run(words, None, Strike(), old), words)
    seen: list[Snapshot] = []
    for _ in range(1 if case.same_bytes else 3):
        _renew(out, old)
        words = case.arguments(out)
        outcome = run(words, calls, Strike(), out)
        _must(outcome, words)
        seen.append(snapshot(out))
    masks = {} if case.same_bytes else {name: _differing([files[name][1] for files in seen]) for name in seen[0]}
    seen = [masked(files, masks) for files in seen]
    if any(files != seen[0] for files in seen):
        sys.exit(f"error: {case.name}: runs differ by more than some bytes")
    if snapshot(old) == seen[0]:
        sys.exit(f"error: {case.name}: what it writes is what was there")
    return Known(old, masked(snapshot(old), masks), seen[0], masks, outcome)


def _differing(contents: list[bytes]) -> set[int]:
    """Return where runs differ (the time of writing), and the bytes around."""
    places = {at for at in range(min(map(len, contents))) if len({content[at] for content in contents}) > 1}
    return {at + shift for at in places for shift in range(-8, 9)}


def masked(files: Snapshot, masks: dict[str, set[int]]) -> Snapshot:
    """Return the files without the parts that differ from run to run."""
    return {
        name: (mode, bytes(0 if at in masks[name] else byte for at, byte in enumerate(content)))
        if masks.get(name)
        else (mode, content)
        for name, (mode, content) in files.items()
    }


def _renew(out: Path, old: Path) -> None:
    shutil.rmtree(out, ignore_errors=True)
    shutil.copytree(old, out, symlinks=True)


def _kill(rng: random.Random, known: Known, calls: Any) -> Strike:
    number = rng.choice(SIGNALS)
    if calls and rng.random() < 0.5:
        return Strike(number, count=rng.randint(1, known.outcome.counts[ANY]))
    return Strike(number, after=rng.uniform(0.0, known.outcome.seconds))


def _fault(rng: random.Random, known: Known) -> Strike:
    kind = rng.choice([kind for kind in FAULTS if known.outcome.counts[kind]])
    return Strike(kind=kind, count=rng.randint(1, known.outcome.counts[kind]), error=rng.choice(FAULTS[kind]))


def _try(case: Case, known: Known, strike: Strike, out: Path, calls: Any) -> tuple[str, bool]:
    """What is wrong after a command was struck ("" if nothing), and whether it was struck before it ended."""
    _renew(out, known.old)
    done = run(case.arguments(out), calls, strike, out)
    left = masked(snapshot(out), known.masks)
    if strike.signal and strike.count == 0 and done.status == known.outcome.status:
        return ("" if left == known.new_files else "corrupt: after it had ended"), False
    problem = _hard_kill(known, left, out) if strike.signal == signal.SIGKILL else _soft_end(known, left)
    return problem or _told(known, strike, done, left), True


def _hard_kill(known: Known, left: Snapshot, out: Path) -> str:
    """After SIGKILL: each file or folder old or new; hidden temporaries may be left until the next write."""
    from cdtool.base.files.writing import write_text

    whole = {name: value for name, value in left.items() if ".cdtool-" not in name}
    for unit in sorted({_unit(name) for name in {*whole, *known.old_files, *known.new_files}}):
        states = [_of(_unit, files, unit) for files in (known.old_files, known.new_files)]
        if _of(_unit, whole, unit) not in states and not _is_set_aside(known, left, whole, unit):
            return f"corrupt: {unit}"
    write_text(out / "next", "")
    for folder in (out, *(path for path in out.iterdir() if path.is_dir())):
        write_text(folder / "next", "")
        (folder / "next").unlink()
    strays = [name for name in snapshot(out) if ".cdtool-" in name and not name.endswith(".old")]
    return f"strays: {strays[0]} after the next write" if strays else ""


def _is_set_aside(known: Known, left: Snapshot, whole: Snapshot, unit: str) -> bool:
    """Whether a file has its old bytes under a hidden name, and nothing under its own."""
    aside = {f"{unit}{i}": left[name] for i, name in enumerate(left) if name.endswith(".old")}
    files = masked(aside, dict.fromkeys(aside, known.masks.get(unit, set())))
    return unit not in whole and known.old_files.get(unit) in files.values()


def _soft_end(known: Known, left: Snapshot) -> str:
    strays = sorted({*left} - {*known.old_files} - {*known.new_files})
    empty = [name for name in left if name == _PLOTS and not any(other.startswith(f"{_PLOTS}/") for other in left)]
    if strays or empty:
        return f"strays: {[*strays, *empty][0]}"
    for target in sorted({_target(name) for name in {*left, *known.old_files, *known.new_files}}):
        states = [_of(_target, files, target) for files in (known.old_files, known.new_files)]
        if _of(_target, left, target) not in states:
            return f"corrupt: {target}"
    return ""


def _unit(name: str) -> str:
    """What a file is old or new with: its folder, if that is swapped in as a whole, else itself."""
    first = Path(name).parts[0]
    return name if first == _PLOTS else first


def _target(name: str) -> str:
    """The same after an orderly end: results go with their traces, a converted log with its machine file, too."""
    return _unit(name).replace(".traces.json.gz", ".json").replace(".machine.toml", "")


def _of(belongs_to: Callable[[str], str], files: Snapshot, target: str) -> Snapshot:
    return {name: value for name, value in files.items() if belongs_to(name) == target}


def _told(known: Known, strike: Strike, done: Outcome, left: Snapshot) -> str:
    """Whether status and message are as documented."""
    if strike.signal == signal.SIGKILL:
        return "" if done.status == -signal.SIGKILL else f"status: {done.status}"
    if "Traceback" in done.error:
        return f"lines: {done.error.strip().splitlines()[-1]}"
    if strike.signal:
        expected = _STATUS_OF[signal.Signals(strike.signal)]
        # Before the command has begun the signal itself ends it, which a shell shows as the same status.
        seen = 128 - done.status if done.status < 0 else done.status
        return "" if seen == expected else f"status: {done.status} {done.error.strip()[-200:]}"
    if done.status == known.outcome.status and left == known.new_files:
        return ""  # what failed was not needed
    if done.status != 2:
        return f"status: {done.status} {done.error.strip()[-200:]}"
    lines = [line for line in done.error.splitlines() if not line.startswith(_OF_THE_WORK)]
    return "" if len(lines) == 1 and lines[0].startswith("error: ") else f"lines: {' / '.join(lines)[-300:]}"


def snapshot(folder: Path) -> Snapshot:
    """Every file, link and folder below a folder: its mode and its content.

    What a search has measured so far is meant to stay: the next run goes on from it.
    """
    found: Snapshot = {}
    for path in sorted(folder.rglob("*")):
        if "search" in path.relative_to(folder).parts:
            continue
        status = path.lstat()
        content = b""
        if stat.S_ISLNK(status.st_mode):
            content = os.fsencode(path.readlink())
        elif stat.S_ISREG(status.st_mode):
            content = path.read_bytes()
        found[str(path.relative_to(folder))] = status.st_mode, content
    return found


def run(words: Sequence[str], calls: Any, strike: Strike, out: Path) -> Outcome:
    """Run `cdtool WORDS` in a child of this process, struck as asked; `out` is the folder whose calls count."""
    ready, begun = os.pipe()
    counted, told = os.pipe()
    with tempfile.TemporaryFile() as output, tempfile.TemporaryFile() as error:
        sys.stdout.flush()
        child = os.fork()
        if child == 0:
            os.dup2(output.fileno(), 1)
            os.dup2(error.fileno(), 2)
            _child(words, calls, strike, out, begun, told)
        os.close(begun)
        os.close(told)
        os.read(ready, 1)
        begin = time.monotonic()
        if strike.signal and not strike.count:
            time.sleep(strike.after)
            os.kill(child, strike.signal)  # it is there until it is waited for, even where it has ended
        _, status = os.waitpid(child, 0)
        seconds = time.monotonic() - begin
        numbers = os.read(counted, 1 << 12).decode().split()
        os.close(ready)
        os.close(counted)
        error.seek(0)
        text = error.read().decode("utf-8", "replace")
    return Outcome(os.waitstatus_to_exitcode(status), text, seconds, tuple(map(int, numbers)))


def _child(words: Sequence[str], calls: Any, strike: Strike, out: Path, begun: int, told: int) -> None:
    from cdtool.base.files.writing import clean_up

    # As in a terminal: what runs in the background of a script ignores SIGINT, and its children with it.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    sys.stdout, sys.stderr = (os.fdopen(handle, "w", closefd=False) for handle in (1, 2))
    if calls:
        number = 0 if not strike.count else strike.signal
        calls.failing_calls_set(os.fsencode(f"{out}/"), strike.kind, strike.count, strike.error, number)
    status = 0
    os.write(begun, b"x")
    try:
        status = _cdtool(words)
    except KeyboardInterrupt:
        status = 130  # before the command has begun, or after it has ended: Python itself would say so
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    clean_up()  # as at the end of Python; its other tasks are the parent's
    sys.stdout.flush()
    sys.stderr.flush()
    if calls:
        os.write(told, " ".join(str(calls.failing_calls_count(kind)) for kind in range(5)).encode())
    os._exit(status)


if __name__ == "__main__":
    sys.exit(main())
