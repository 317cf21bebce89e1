"""What determines outcomes beside a log and its settings: the code, and the libraries that read logs and compute.

A worker of a cluster must have the same as this process; otherwise results would depend on who scored a log.
"""

from __future__ import annotations

import platform
import re
from collections.abc import Mapping
from functools import cache
from importlib import metadata

from cdtool.base.registry import plugin_packages
from cdtool.base.version import __version__
from cdtool.execution.store.digest import code_version

# Libraries that only show results, or only start commands.
_ONLY_SHOWN = frozenset({"typer", "rich", "matplotlib", "jinja2"})
# Extras with what is needed to develop cdtool, and those that name other extras.
_NOT_FOR_LOGS = frozenset({"all", "test", "dev", "benchmarks"})
_CODE, _PLUGINS = "the code of cdtool", "the list of plug-in packages"


@cache
def environment() -> Mapping[str, str]:
    """Return the versions of this process, by name: Python, cdtool, the libraries installed, plug-ins, the code."""
    versions = {"python": ".".join(platform.python_version_tuple()[:2]), "cdtool": __version__}
    for name in _libraries():
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    plugins = ", ".join(f"{name} {version}" for name, version in plugin_packages().items())
    return {**versions, _PLUGINS: plugins or "none", _CODE: code_version()[:12]}


def difference(here: Mapping[str, str], there: Mapping[str, str]) -> str:
    """Return the first thing that is not the same there as here, as words; empty if all that is here is the same.

    More libraries may be installed there.
    """
    for name, version in here.items():
        if there.get(name) != version:
            if name == _CODE:
                return f"{_CODE} is not the same there"
            return f"{name} is {there.get(name, 'not installed')} there, {version} here"
    return ""


def _libraries() -> list[str]:
    """Return the names of the libraries that cdtool requires, with those of its extras for logs."""
    try:
        required = metadata.requires("cdtool") or []
    except metadata.PackageNotFoundError:  # run from its source
        required = ["numpy", "scipy", "numba"]
    found: dict[str, None] = {}
    for text in required:
        extra = re.search(r"extra\s*==\s*['\"]([^'\"]+)['\"]", text)
        name = re.match(r"[A-Za-z0-9._-]+", text)
        if name and not (extra and extra[1] in _NOT_FOR_LOGS):
            found[name[0]] = None
    return [name for name in found if name.lower() not in _ONLY_SHOWN | {"cdtool"}]
