"""Results derived from a value: computed once, stored with it, released with it."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from functools import cached_property
from typing import Any, TypeVar

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
