"""Draw the layers of the package from its imports: python docs/make_layers.py

The rows of docs/images/layers.svg are the rooms of cdtool/ in the order of the import contract in pyproject.toml. A
filled square means: the row's room imports the column's. Imports for the type checker and inside functions count; names
in the tables of the registry do not.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

DOCS = Path(__file__).resolve().parent
PACKAGE = DOCS.parent / "cdtool"
FILE = DOCS / "images" / "layers.svg"
# By the text: to parse every file takes seconds.
_IMPORT = re.compile(
    r"^[ \t]*(?:(?:from|import) cdtool\.(?P<module>\w+)|from cdtool import (?P<names>[^()\n]+|\([^)]+\)))", re.MULTILINE
)
_CELL, _LEFT, _TOP, _MARGIN = 24, 136, 118, 48
_INK, _SHADES, _DIAGONAL, _GRID = "#222222", ("#e3eaf2", "#f6f8fa"), "#b8c4d0", "#ffffff"


@dataclass(frozen=True)
class Layers:
    """The rooms of each layer from the top down, and the rooms that each room imports."""

    layers: tuple[tuple[str, ...], ...]
    imports: dict[str, frozenset[str]]

    @property
    def rooms(self) -> tuple[str, ...]:
        """All rooms in the order of the picture."""
        return tuple(room for layer in self.layers for room in layer)


def read_contract() -> list[tuple[str, ...]]:
    """Return the modules of each layer of the import contract, from the top down."""
    config = tomllib.loads((DOCS.parent / "pyproject.toml").read_text(encoding="utf-8"))
    contract = next(item for item in config["tool"]["importlinter"]["contracts"] if item["containers"] == ["cdtool"])
    return [tuple(re.split(r"\s*[|:]\s*", layer)) for layer in contract["layers"]]


def read_layers() -> Layers:
    """Return the contract's layers with the imports of the code; raises ValueError for a module without a layer."""
    layers = tuple(read_contract())
    imports: dict[str, set[str]] = {room: set() for layer in layers for room in layer}
    for file in sorted(PACKAGE.rglob("*.py")):
        name = file.relative_to(PACKAGE).parts[0].removesuffix(".py")
        if name in ("__init__", "__main__"):
            continue
        if name not in imports:
            raise ValueError(f"cdtool/{name} is in no layer of pyproject.toml")
        imports[name] |= {item for item in _imported(file) if item in imports}
    return Layers(layers, {room: frozenset(found - {room}) for room, found in imports.items()})


def _imported(file: Path) -> Iterator[str]:
    """The first name below `cdtool` of everything that a file imports."""
    for found in _IMPORT.finditer(file.read_text(encoding="utf-8")):
        yield from [found["module"]] if found["module"] else re.findall(r"\w+", found["names"])


def svg(layers: Layers) -> str:
    """Return the picture; its description lists every import in words."""
    rooms = layers.rooms
    side = _CELL * len(rooms)
    width, height = _LEFT + side + _MARGIN, _TOP + side + _MARGIN
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
        'font-family="DejaVu Sans, Verdana, sans-serif" font-size="12">',
        "<title>The layers of cdtool: which room imports which</title>",
        f"<desc>{_described(layers)}</desc>",
        f'<rect width="{width}" height="{height}" fill="#ffffff"/>',
    ]
    row = 0
    for number, layer in enumerate(layers.layers):
        top, tall = _TOP + _CELL * row, _CELL * len(layer)
        lines.append(f'<rect x="4" y="{top}" width="{_LEFT + side - 4}" height="{tall}" fill="{_SHADES[number % 2]}"/>')
        row += len(layer)
    for index, room in enumerate(rooms):
        middle = _TOP + _CELL * index + _CELL // 2 + 4
        lines.append(f'<text x="{_LEFT - 8}" y="{middle}" text-anchor="end" fill="{_INK}">{room}</text>')
        x, y = _LEFT + _CELL * index + _CELL // 2 + 4, _TOP - 8
        lines.append(f'<text transform="translate({x} {y}) rotate(-60)" fill="{_INK}">{room}</text>')
        lines.append(_square(index, index, _DIAGONAL))
        lines += [_square(index, rooms.index(other), _INK) for other in rooms if other in layers.imports[room]]
    return "\n".join([*lines, "</svg>\n"])


def _square(row: int, column: int, colour: str) -> str:
    x, y = _LEFT + _CELL * column + 5, _TOP + _CELL * row + 5
    return f'<rect x="{x}" y="{y}" width="{_CELL - 10}" height="{_CELL - 10}" fill="{colour}" stroke="{_GRID}"/>'


def _described(layers: Layers) -> str:
    rooms = layers.rooms
    said = (
        f"{room} imports {', '.join(other for other in rooms if other in layers.imports[room]) or 'nothing'}."
        for room in rooms
    )
    return f"A matrix with a row and a column per room, from the top layer down. {' '.join(said)}"


if __name__ == "__main__":
    FILE.write_text(svg(read_layers()), encoding="utf-8")
