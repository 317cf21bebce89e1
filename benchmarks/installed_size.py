"""What an installation needs on disk: each dependency of cdtool, alone and with what only it brings.

    python benchmarks/installed_size.py [SITE_PACKAGES]

SITE_PACKAGES is the folder of a fresh environment with cdtool and nothing else; by default that of this interpreter. A
size is that of the blocks that files use [MB], compiled modules (.pyc) apart: pip writes them at the installation, and
Python at the first import otherwise.
"""

from __future__ import annotations

import sys
import sysconfig
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from importlib.metadata import Distribution, distributions
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

_BLOCK = 512
_MB = 1e6
PROJECT = "cdtool"


@dataclass(frozen=True)
class Installed:
    """A distribution: bytes of its files and of its compiled modules, and the names of what it requires."""

    files: int
    compiled: int
    requires: tuple[str, ...]

    @property
    def size(self) -> int:
        return self.files + self.compiled


def installed(folder: Path) -> dict[str, Installed]:
    """The distributions in a folder, by name."""
    return {canonicalize_name(item.metadata["Name"]): _measured(item) for item in distributions(path=[str(folder)])}


def _measured(item: Distribution) -> Installed:
    sizes = {True: 0, False: 0}
    for file in item.files or ():
        path = Path(str(item.locate_file(file)))
        if path.is_file():
            sizes[path.suffix == ".pyc"] += _used(path)
    needed = [Requirement(text) for text in item.requires or ()]
    names = [canonicalize_name(one.name) for one in needed if one.marker is None or one.marker.evaluate({"extra": ""})]
    return Installed(sizes[False], sizes[True], tuple(names))


def _used(path: Path) -> int:
    stat = path.stat()
    blocks: int | None = getattr(stat, "st_blocks", None)  # Windows has none
    return stat.st_size if blocks is None else blocks * _BLOCK


def reached(known: Mapping[str, Installed], start: Iterable[str], without: Collection[str] = ()) -> set[str]:
    """The names that `start` needs, themselves included, if `without` are not installed."""
    found: set[str] = set()
    waiting = [name for name in start if name in known and name not in without]
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += [other for other in known[name].requires if other in known and other not in without]
    return found


def main(folder: Path) -> None:
    """Print the tables."""
    known = installed(folder)
    if PROJECT not in known:
        raise SystemExit(f"{folder}: {PROJECT} is not installed there")
    everything = reached(known, [PROJECT])
    print("| dependency | alone | .pyc | with what only it brings |\n|---|---|---|---|")
    rows = []
    for name in sorted({PROJECT, *known[PROJECT].requires} & everything):
        left = reached(known, [PROJECT], [name])
        own = everything - left if name != PROJECT else {name}
        rows.append((sum(known[one].size for one in own), name, sorted(own - {name})))
    for size, name, others in sorted(rows, reverse=True):
        brought = f" ({', '.join(others)})" if others else ""
        item = known[name]
        print(f"| {name} | {item.files / _MB:.1f} | {item.compiled / _MB:.1f} | {size / _MB:.1f}{brought} |")
    files, compiled = (sum(getattr(known[name], part) for name in everything) for part in ("files", "compiled"))
    print(f"\naltogether {(files + compiled) / _MB:.0f} MB, of these {compiled / _MB:.0f} MB compiled modules (.pyc)")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else sysconfig.get_path("purelib")))
