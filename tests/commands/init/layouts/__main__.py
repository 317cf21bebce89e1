"""Print the score of `cdtool init` on layouts: `python -m tests.commands.init.layouts [FILE...]`, `public` or all."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.commands.init.layouts import SEALED, read_layouts
from tests.commands.init.layouts.score import Score, score


def main(files: Sequence[str]) -> int:
    """Score the layouts of the TOML files with these names, as `public` and `sealed_4`; of all without one."""
    with TemporaryDirectory() as folder:
        layouts = [layout for file in files or ("public", "vendors", *SEALED) for layout in read_layouts(file)]
        scores = [score(layout, Path(folder)) for layout in layouts]
    for item in scores:
        _show(item)
    right, expected = sum(len(item.right) for item in scores), sum(len(item.expected) for item in scores)
    units = sum(len(item.units) for item in scores)
    wrong, unmarked = sum(len(item.wrong) for item in scores), sum(len(item.unmarked) for item in scores)
    print(
        f"{len(scores)} layouts: {right} of {expected} channels mapped right ({100 * right / max(expected, 1):.1f} %), "
        f"{wrong} wrong, {units} with a wrong unit, {unmarked} of these without a CHECK mark"
    )
    return 0


def _show(item: Score) -> None:
    print(f"{item.name}: {len(item.right)} of {len(item.expected)}" + (f"; {item.fault}" if item.fault else ""))
    if item.missing:
        print(f"  missing: {', '.join(item.missing)}")
    for text in (*item.wrong, *item.units):
        print(f"  wrong: {text}{'  WITHOUT CHECK' if text in item.unmarked else ''}")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
