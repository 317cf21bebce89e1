"""Signals that end a program wait while a library calls back into Python, which must not raise there."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

_ENDING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


@contextmanager
def held_signals() -> Iterator[Callable[[], None]]:
    """Hold SIGINT, SIGTERM and SIGHUP until the end, or until the function that this yields is called.

    What they then do, and raise, is what they would have done. Outside the main thread, which alone gets signals,
    nothing is held.
    """
    came: list[int] = []
    before: dict[int, Any] = {}

    def deliver() -> None:
        while came:
            number = came.pop(0)
            handler = before[number]
            if callable(handler):
                handler(number, None)
            elif handler == signal.SIG_DFL:
                signal.signal(number, signal.SIG_DFL)
                signal.raise_signal(number)

    if threading.current_thread() is not threading.main_thread():
        yield deliver
        return
    for number in _ENDING:
        before[number] = signal.signal(number, lambda number, _: came.append(number))
    try:
        yield deliver
    finally:
        for number, handler in before.items():
            signal.signal(number, handler if handler is not None else signal.SIG_DFL)
        deliver()
