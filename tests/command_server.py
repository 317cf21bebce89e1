"""Commands in forked children of a new interpreter that has done its imports.

`python -m tests.command_server MODULE ...`

A new process for every command takes a second or more for imports alone. Here one new process imports the modules and
forks a child per command, which runs `cdtool ARGUMENTS` to the end of the interpreter: own output, status, processor
time and memory, as those of a new process. It reads requests, one line of JSON each, and answers with another line.

`CommandServer` starts such a process and sends it commands. It needs `os.fork`.
"""

from __future__ import annotations

import contextlib
import ctypes
import importlib
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
LONGEST = 120
"""Seconds until a command is ended by SIGALRM."""
_MADV_POPULATE_READ = 22  # Linux 5.14; an older kernel refuses it, and the measured memory is larger


@dataclass(frozen=True)
class Ended:
    """A command that has ended: status (negative: the signal), outputs, processor time [s], memory it needed [MiB]."""

    status: int
    out: str
    err: str
    seconds: float
    more_mib: float


class CommandServer:
    """Send commands to a process of tests.command_server."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process

    def run(self, *arguments: object, folder: Path = ROOT) -> Ended:
        """Run `cdtool ARGUMENTS` in a folder; `more_mib` is the peak memory above that of the imports."""
        with tempfile.TemporaryDirectory() as outputs:
            files = [Path(outputs) / name for name in ("out", "err")]
            status, seconds, more = self._answer(arguments, folder, files)
            out, err = (file.read_text(encoding="utf-8", errors="replace") for file in files)
        return Ended(status, out, err, seconds, more / 1024.0)

    def warm_up(self, *arguments: object, status: int = 0) -> None:
        """Run `cdtool ARGUMENTS` in the server itself: its later children have the imports and compiled kernels."""
        ended, threads, _ = self._answer(arguments, ROOT, [])
        assert ended == status
        assert threads == 1, "a fork of several threads may keep their locks for ever"

    def _answer(self, arguments: Sequence[object], folder: Path, files: Sequence[Path]) -> tuple[int, float, int]:
        assert self._process.stdin is not None and self._process.stdout is not None
        request = {"arguments": [*map(str, arguments)], "folder": str(folder), "files": [*map(str, files)]}
        print(json.dumps(request), file=self._process.stdin, flush=True)
        answer: tuple[int, float, int] = tuple(json.loads(self._process.stdout.readline()))
        return answer


@contextmanager
def command_server(*modules: str, environment: Mapping[str, str] | None = None) -> Iterator[CommandServer]:
    """Start a process that imports the modules, and end it after use; `environment` is added to that of this one."""
    path = {"PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
    process = subprocess.Popen(
        [sys.executable, "-m", "tests.command_server", *modules],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | path | dict(environment or {}),
        cwd=ROOT,
    )
    with process:  # closes its standard input, at which it ends, and waits
        yield CommandServer(process)


def _peak() -> int:
    """Return the peak memory of this process [KiB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def _populate() -> None:
    """Map all pages of this process's files, which a fork leaves out: they would count as memory of the command."""
    library = ctypes.CDLL(None)
    for line in Path("/proc/self/maps").read_text(encoding="utf-8").splitlines():
        addresses, mode, _, _, inode = line.split(maxsplit=5)[:5]
        first, end = (int(address, 16) for address in addresses.split("-"))
        if inode != "0" and mode.startswith("r"):
            library.madvise(ctypes.c_void_p(first), ctypes.c_size_t(end - first), _MADV_POPULATE_READ)


def _run_here(main: Callable[[], None]) -> tuple[int, float, int]:
    """Run the command in this process; return its status and how many threads there are now."""
    status = 0
    with (
        Path(os.devnull).open("w") as nothing,
        contextlib.redirect_stdout(nothing),
        contextlib.redirect_stderr(nothing),
    ):
        try:
            main()
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else int(end.code is not None)
    return status, threading.active_count(), 0


def _serve(modules: Sequence[str]) -> None:
    """Answer requests until their end; in a child, return when the command has ended."""
    requests, replies = os.fdopen(os.dup(0)), os.fdopen(os.dup(1), "w")
    nothing = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1):
        os.dup2(nothing, stream)
    for name in modules:
        importlib.import_module(name)
    from cdtool.commands.app import main

    while line := requests.readline():
        request = json.loads(line)
        sys.argv = ["cdtool", *request["arguments"]]
        os.chdir(request["folder"])
        if not request["files"]:
            answer = _run_here(main)
        else:
            memory, told = os.pipe()
            child = os.fork()
            if child == 0:
                for stream, file in enumerate(request["files"], start=1):
                    os.dup2(os.open(file, os.O_WRONLY | os.O_CREAT), stream)
                if Path("/proc/self/maps").exists():
                    _populate()
                before = _peak()
                signal.alarm(LONGEST)
                try:
                    main()
                finally:
                    os.write(told, str(_peak() - before).encode())
                return
            os.close(told)
            _, status, used = os.wait4(child, 0)
            more = int(os.read(memory, 32) or 0)  # nothing if a signal has ended it
            os.close(memory)
            answer = os.waitstatus_to_exitcode(status), used.ru_utime + used.ru_stime, more
        print(json.dumps(answer), file=replies, flush=True)


if __name__ == "__main__":
    _serve(sys.argv[1:])
