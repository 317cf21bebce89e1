"""Print the lower bound of each dependency in pyproject.toml as a pin, `numpy==2.1`, one per line.

`pip install $(python .ci/lowest_versions.py) .` installs cdtool with the oldest versions that it promises to work with.
With names of extras as arguments, their dependencies too: `python .ci/lowest_versions.py urdf hdf5`.
"""

from __future__ import annotations

import re
import sys
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path

_PYPROJECT = Path(__file__).parents[1] / "pyproject.toml"
_REQUIREMENT = re.compile(r"(?P<name>[A-Za-z0-9._-]+)(\[(?P<extras>[^\]]*)\])?(?P<bounds>[^;]*)")
_LOWER_BOUND = re.compile(r">=\s*(?P<version>[0-9][0-9A-Za-z.]*)")


def lowest_versions(project: dict, extras: Sequence[str] = ()) -> Iterator[str]:
    """The pins of a [project] table and of some of its extras; raises ValueError where a lower bound is missing."""
    for text in project["dependencies"]:
        yield _pin(text)
    for extra in extras:
        for text in project["optional-dependencies"][extra]:
            match = _REQUIREMENT.match(text)
            if match and match["name"] == project["name"]:
                yield from list(lowest_versions(project | {"dependencies": []}, match["extras"].split(",")))
            else:
                yield _pin(text)


def _pin(requirement: str) -> str:
    match = _REQUIREMENT.fullmatch(requirement.replace(" ", ""))
    bound = _LOWER_BOUND.search(match["bounds"]) if match else None
    if match is None or bound is None:
        raise ValueError(f"pyproject.toml: '{requirement}' has no lower bound")
    return f"{match['name']}=={bound['version']}"


if __name__ == "__main__":
    print("\n".join(lowest_versions(tomllib.loads(_PYPROJECT.read_text())["project"], sys.argv[1:])))
