"""The values that were computed last from objects that are still in use."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable, Sequence
from threading import Lock
from typing import Any, TypeVar
from weakref import ref

Learned = TypeVar("Learned")


class Recent:
    """The latest values that were learned from runs, each under a key; it keeps no run in memory.

    Parameters
    ----------
    most : int
        How many values are kept: those used last.

    Examples
    --------
    >>> import numpy as np
    >>> runs = [np.zeros(2) for _ in range(3)]
    >>> recent = Recent(2)
    >>> recent.value("sum", runs, lambda: "learned"), recent.value("sum", runs, lambda: "learned again")
    ('learned', 'learned')
    >>> recent.value("sum", runs[:2], lambda: "of two runs")
    'of two runs'
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._known: OrderedDict[Hashable, tuple[tuple[ref[Any], ...], Any]] = OrderedDict()
        self._lock = Lock()

    def value(self, key: Hashable, runs: Sequence[Any], learn: Callable[[], Learned]) -> Learned:
        """Return what was learned under a key from these very objects; what `learn` returns if it is not known."""
        whole = (key, tuple(map(id, runs)))
        with self._lock:
            known = self._known.get(whole)
            # An identity is used again once its object is gone.
            if known is not None and all(one() is run for one, run in zip(known[0], runs, strict=True)):
                self._known.move_to_end(whole)
                value: Learned = known[1]
                return value
        made = learn()
        with self._lock:
            self._known[whole] = (tuple(map(ref, runs)), made)
            self._known.move_to_end(whole)
            while len(self._known) > self._most:
                self._known.popitem(last=False)
        return made
