"""Print the score of `cdtool init` on the public layouts: `python -m tests.commands.init.layouts [NAME...]`."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.commands.init.layouts import LAYOUTS, Layout
from tests.commands.init.layouts.score import Score, score


def main(arguments: Sequence[str]) -> int:
    """Score the layouts with these names, or all; `module:NAME` scores the layouts of another module."""
    layouts: Sequence[Layout] = LAYOUTS
    names = []
    for argument in arguments:
        module, _, attribute = argument.partition(":")
        if attribute:
            layouts = getattr(importlib.import_module(module), attribute)
        else:
            names.append(argument)
    with TemporaryDirectory() as folder:
        scores = [score(layout, Path(folder)) for layout in layouts if not names or layout.name in names]
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
