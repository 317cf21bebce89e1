"""Frozen dataclasses that are completed at their first use.

`dataclass` writes and compiles six methods for each class, which takes about half a millisecond. A command imports two
hundred kinds of facts and results and uses a few of them.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, field
from threading import RLock
from typing import Any, TypeVar, dataclass_transform

T = TypeVar("T")

_lock = RLock()


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def frozen(kind: type[T]) -> type[T]:
    """Return the class as `dataclass(frozen=True)` does, with its methods created at its first use.

    That is its first instance, also one that is unpickled or copied; a question about its fields or its signature; and
    the completion of a class derived from it. A mistake in its fields is therefore reported at the first use.
    """
    complete = _Completion(kind)

    def new(cls: type[Any], *_: object, **__: object) -> Any:
        complete()
        return object.__new__(cls)

    hooks: dict[str, object] = {
        "__new__": staticmethod(new),
        "__dataclass_fields__": _Completing(complete, lambda _: vars(kind)["__dataclass_fields__"]),
        "__signature__": _Completing(complete, _signature),
    }
    for name, hook in hooks.items():
        setattr(kind, name, hook)
    return kind


class _Completion:
    """Completion of a class as a dataclass, at the first call; other threads wait for it."""

    def __init__(self, kind: type[Any]) -> None:
        self.kind = kind
        self.has_begun = self.is_done = False

    def __call__(self) -> None:
        if self.is_done:
            return
        with _lock:
            if not self.has_begun:  # `dataclass` itself asks for the signature of a class without a docstring
                self.has_begun = True
                dataclass(frozen=True)(self.kind)
                self.is_done = True


class _Completing:
    """An attribute of a class, or of one derived from it, that completes the class when it is read."""

    def __init__(self, complete: Callable[[], None], value: Callable[[type[Any]], object]) -> None:
        self.complete = complete
        self.value = value

    def __get__(self, instance: object, owner: type[Any]) -> object:
        self.complete()
        return self.value(owner)


def _signature(kind: type[Any]) -> inspect.Signature:
    own = inspect.signature(kind.__init__)
    return own.replace(parameters=list(own.parameters.values())[1:])
