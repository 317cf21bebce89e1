"""A Dask scheduler and workers as processes of their own on the loopback interface, and a plug-in that ends them."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
# A worker that takes more is ended by its nanny; one with cdtool and its libraries takes a third of it.
MEMORY = "700MB"
# A file format whose logs contain how the process that reads them ends.
FATAL = '''
"""A log that ends the process that reads it."""
import ctypes
import faulthandler
import json
import os
import signal
from dataclasses import dataclass
from typing import ClassVar

@dataclass(frozen=True)
class Fatal:
    """A log that ends the process that reads it."""
    name: ClassVar[str] = "fatal"
    suffixes: ClassVar[tuple[str, ...]] = (".fatal",)

    def sniff(self, path):
        return path.suffix == ".fatal"

    def columns(self, path, wanted=None):
        how = path.read_text(encoding="utf-8").strip()
        if how == "segfault":
            faulthandler.disable()
            ctypes.string_at(0)
        os.kill(os.getpid(), signal.SIGKILL)
'''


def site_with_plugin(folder: Path) -> Path:
    """Return a folder for PYTHONPATH with an installed package that provides the format `fatal`."""
    site = folder / "site"
    about = site / "cdtool_fatal-1.0.dist-info"
    about.mkdir(parents=True)
    (site / "cdtool_fatal.py").write_text(FATAL, encoding="utf-8")
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: cdtool-fatal\nVersion: 1.0\n", encoding="utf-8")
    (about / "entry_points.txt").write_text("[cdtool.formats]\nfatal = cdtool_fatal:Fatal\n", encoding="utf-8")
    return site


def environment(*folders: Path) -> dict[str, str]:
    """Return the environment of a process that finds this source and the packages in some folders."""
    return {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, (ROOT, *folders)))}


@dataclass
class Cluster:
    """The address of a scheduler, and the processes."""

    address: str
    scheduler: subprocess.Popen[str]
    workers: list[subprocess.Popen[str]]


@contextmanager
def cluster(
    folder: Path, workers: int = 2, sites: Sequence[Path] = (), options: Sequence[str] = ()
) -> Iterator[Cluster]:
    """Start a scheduler on a free port and workers with nannies; end them all after the block."""
    file = folder / "scheduler.json"
    shared = {"env": environment(*sites), "cwd": folder, "start_new_session": True, "text": True}
    silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    dask = [sys.executable, "-m", "dask"]
    server = ["scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--dashboard-address", "127.0.0.1:0"]
    started: list[subprocess.Popen[str]] = []
    try:
        started.append(subprocess.Popen([*dask, *server, "--scheduler-file", str(file)], **shared, **silent))
        place = [
            "--scheduler-file",
            str(file),
            "--host",
            "127.0.0.1",
            "--no-dashboard",
            "--local-directory",
            str(folder),
        ]
        threads = ["--nworkers", str(workers), "--nthreads", "1", "--memory-limit", MEMORY]
        if workers:
            started.append(subprocess.Popen([*dask, "worker", *place, *threads], **shared, **silent))
        yield Cluster(_address(file), started[0], started[1:])
    finally:
        for process in started:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def _address(file: Path) -> str:
    until = time.monotonic() + 60.0
    while time.monotonic() < until:
        with suppress(OSError, ValueError, KeyError):
            address: str = json.loads(file.read_text(encoding="utf-8"))["address"]
            return address
        time.sleep(0.05)
    raise TimeoutError(file)
