"""How much was read from URLs by this process and by its workers."""

from __future__ import annotations

import threading
from contextlib import suppress
from pathlib import Path

_SUFFIX = ".read"
_lock = threading.Lock()
_bytes = _requests = 0


def add(size: int) -> None:
    """Count a request that has read `size` bytes."""
    global _bytes, _requests
    with _lock:
        _bytes += size
        _requests += 1


def here() -> tuple[int, int]:
    """Return the bytes that this process has read from URLs, and in how many requests."""
    return _bytes, _requests


def forget() -> None:
    """Begin at zero, as a worker that was forked does."""
    global _bytes, _requests
    _bytes = _requests = 0


def note(folder: Path, name: str) -> None:
    """Note in a folder of the first process what this process, a worker, has read."""
    with suppress(OSError):
        (folder / f"{name}{_SUFFIX}").write_text(f"{_bytes} {_requests}", encoding="ascii", newline="\n")


def altogether(folder: Path | None) -> tuple[int, int]:
    """Return the bytes and requests of this process and of the workers that have noted theirs in a folder."""
    size, requests = here()
    for path in sorted(folder.glob(f"*{_SUFFIX}")) if folder is not None else ():
        with suppress(OSError, ValueError):
            of_worker = path.read_text(encoding="ascii").split()
            size, requests = size + int(of_worker[0]), requests + int(of_worker[1])
    return size, requests
