"""The folder of a command, in which its processes keep local copies of files at URLs, and what they have read.

It is below the folder for temporary files, and its first process locks it while the command lives and removes it at the
end; what a killed command has left is removed by the next one.
"""

from __future__ import annotations

import atexit
import os
import secrets
import shutil
from contextlib import ExitStack, suppress
from pathlib import Path

# The folder, for the processes that are started here.
_FOLDER = "CDTOOL_REMOTE_FOLDER"
_PREFIX, _LOCK, _READ = "cdtool-remote-", "lock", "read"


def begin() -> None:
    """Begin a command: a folder that it inherits is that of the program that started it."""
    os.environ.pop(_FOLDER, None)


def folder() -> Path:
    """Return the folder of this command; make it at the first call."""
    given = Path(os.environ.get(_FOLDER, os.devnull))
    return given if given.is_dir() else _made()


def note_read(size: int) -> None:
    """Note a request that has read `size` bytes."""
    with suppress(OSError), (folder() / _READ).open("a", encoding="ascii", newline="\n") as file:
        file.write(f"{size}\n")


def amount_read() -> tuple[int, int]:
    """Return the bytes that this command has read from URLs, and in how many requests."""
    noted = Path(os.environ.get(_FOLDER, os.devnull)) / _READ
    sizes = [int(line) for line in noted.read_text(encoding="ascii").split()] if noted.is_file() else []
    return sum(sizes), len(sizes)


def _made() -> Path:
    import tempfile

    from cdtool.base.files.locks import lock_handle

    # Its removal is registered before it is made: a signal may end the command after any step.
    made = Path(tempfile.gettempdir()) / f"{_PREFIX}{secrets.token_hex(8)}"
    ending = ExitStack()
    ending.callback(shutil.rmtree, made, ignore_errors=True)
    atexit.register(_end, ending, os.getpid())
    made.mkdir(mode=0o700)
    lock_handle(ending.enter_context((made / _LOCK).open("xb")).fileno())
    os.environ[_FOLDER] = str(made)
    for left in set(made.parent.glob(f"{_PREFIX}*")) - {made}:
        with suppress(OSError):
            with (left / _LOCK).open("r+b") as file:
                is_left = lock_handle(file.fileno())
            if is_left:
                shutil.rmtree(left, ignore_errors=True)
    return made


def _end(ending: ExitStack, process: int) -> None:
    if os.getpid() == process:  # not in a forked worker
        os.environ.pop(_FOLDER, None)
        ending.close()
