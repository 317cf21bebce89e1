"""A progress bar that appears only if a command takes long enough to read it."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from threading import Lock, Timer
from typing import TYPE_CHECKING

from cdtool.commands.console.console import progress

if TYPE_CHECKING:
    from cdtool.execution.workers import Progress

# Shorter waits do not need a bar [s].
_AFTER = 1.0


@contextmanager
def late_progress(what: str, after: float = _AFTER, *, quiet: bool = False) -> Iterator[Progress | None]:
    """Show the bar of `progress` once the block has taken longer than `after` [s].

    Without a terminal, or if `quiet`, it yields None and draws nothing. The bar only pulses until the total amount
    of work is known.
    """
    if quiet or not sys.stderr.isatty():
        yield None
        return
    with ExitStack() as drawn:
        bars: list[Progress] = []
        lock, ended = Lock(), False

        def draw() -> None:
            with lock:
                bar = None if ended else drawn.enter_context(progress(what, pulses=True))
                if bar is not None:
                    bars.append(bar)

        def advance(done: int, total: int) -> None:
            for bar in bars:
                bar(done, total)

        timer = Timer(after, draw)
        timer.daemon = True
        timer.start()
        try:
            yield advance
        finally:
            timer.cancel()
            with lock:
                ended = True
