"""Which classes of a folder keep a registry's contract: each of them has to be registered."""

from __future__ import annotations

import inspect
import pkgutil
from importlib import import_module
from types import ModuleType

from cdtool.base.registry import Registry


def targets_in(package: ModuleType, registry: Registry) -> set[str]:
    """Return "module:Class" of every class of the package that has what the contract asks, protocols excepted.

    A class that others are derived from is what these share, not one of them.
    """
    modules = [import_module(item.name) for item in pkgutil.walk_packages(package.__path__, f"{package.__name__}.")]
    classes = {
        item
        for module in (package, *modules)
        for _, item in inspect.getmembers(module, inspect.isclass)
        if item.__module__.startswith(f"{package.__name__}.") and not getattr(item, "_is_protocol", False)
    }
    fitting = {item for item in classes if all(hasattr(item, attribute) for attribute in registry.contract)}
    shared = {base for item in fitting for base in item.__mro__[1:]}
    return {f"{item.__module__}:{item.__qualname__}" for item in fitting - shared}
