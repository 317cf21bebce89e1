"""Results derived from a value: computed once, stored with it, released with it, not sent with it."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable, Sequence
from dataclasses import fields
from functools import cached_property
from threading import Lock
from typing import Any, TypeVar
from weakref import ref

Result = TypeVar("Result")


class StoresDerived:
    """A frozen value that stores what was derived from it. A copy, changed, pickled or not, starts without any of it.

    Examples
    --------
    >>> class Speeds(StoresDerived):
    ...     def __init__(self, *values):
    ...         self.values = values
    ...
    ...     def highest(self):
    ...         return self.derived("highest", lambda: max(self.values))
    >>> Speeds(0.1, 0.3).highest()
    0.3
    """

    @cached_property
    def _derived(self) -> dict[Hashable, tuple[tuple[object, ...], Any]]:
        return {}

    def derived(self, key: Hashable, compute: Callable[[], Result], *inputs: object) -> Result:
        """Return what `compute` returns, called only the first time for this key and these inputs.

        Parameters
        ----------
        key : hashable
            What is derived, with every setting that it depends on.
        compute : callable
            Returns the result, which must not be changed afterwards.
        *inputs : object
            Other immutable objects that it depends on; they are compared by identity.

        Returns
        -------
        object
            The stored result.
        """
        stored = self._derived.get((key, *map(id, inputs)))
        if stored is None:
            # The inputs are stored too: as long as they exist, no other object has their identity.
            stored = self._derived[(key, *map(id, inputs))] = (inputs, compute())
        result: Result = stored[1]
        return result

    def __getstate__(self) -> dict[str, Any]:
        """Return the state without what was derived: it would multiply the size of a pickle."""
        return {name: value for name, value in vars(self).items() if name != "_derived"}


class SendsFields:
    """A dataclass with cached properties, of which a pickle has the fields only: the rest is computed again.

    Arrays lose their protection against writing in a pickle, and a kernel refuses those that it expects read-only.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class Way(SendsFields):
    ...     speed: float
    ...
    ...     @cached_property
    ...     def double(self):
    ...         return 2.0 * self.speed
    >>> way = Way(0.5)
    >>> way.double, way.__getstate__()
    (1.0, {'speed': 0.5})
    """

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields."""
        return {item.name: getattr(self, item.name) for item in fields(self)}  # type: ignore[arg-type]


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

    def value(self, key: Hashable, runs: Sequence[Any], learn: Callable[[], Result]) -> Result:
        """Return what was learned under a key from these very objects; what `learn` returns if it is not known."""
        whole = (key, tuple(map(id, runs)))
        with self._lock:
            known = self._known.get(whole)
            # An identity is used again once its object is gone.
            if known is not None and all(one() is run for one, run in zip(known[0], runs, strict=True)):
                self._known.move_to_end(whole)
                value: Result = known[1]
                return value
        made = learn()
        with self._lock:
            self._known[whole] = (tuple(map(ref, runs)), made)
            self._known.move_to_end(whole)
            while len(self._known) > self._most:
                self._known.popitem(last=False)
        return made
