"""The last line of a file that does not end it: whole, or cut off within its last number?

A cut leaves fewer digits. So the last number is believed if it has as many decimals as all those above it; where their
number varies, if it has no fewer than any of them, and that is said; else the line is dropped.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

RECENT = 20
_SHAPE = re.compile(r"[+-]?(?P<whole>[0-9]*)(?:[.,](?P<decimals>[0-9]*))?(?:[eE][+-]?(?P<power>[0-9]*))?")


@dataclass(frozen=True)
class _Shape:
    """Digits before and after the decimal mark (-1: no mark), and of the exponent (-1: none)."""

    whole: int
    decimals: int
    power: int

    @classmethod
    def of(cls, cell: str) -> _Shape | None:
        found = _SHAPE.fullmatch(cell)
        if found is None:
            return None
        decimals, power = found["decimals"], found["power"]
        return cls(len(found["whole"]), -1 if decimals is None else len(decimals), -1 if power is None else len(power))


def is_whole(cell: str, above: Sequence[str]) -> tuple[bool, bool]:
    """Is the last cell of an unfinished line whole, and is that certain? `above` are cells of its column."""
    if not above:
        return True, False
    if cell == '"':  # the quote that closes it is there
        return True, True
    last, shapes = _Shape.of(cell), [_Shape.of(other) for other in above]
    known = [shape for shape in shapes if shape is not None]
    if last is None:  # words, a stamp, nothing: as long as those above
        lengths = {len(other) for other in above}
        return bool(lengths) and len(cell) >= min(lengths), len(lengths) == 1 and len(cell) in lengths
    if not known:
        return False, False
    powers = {shape.power for shape in known}
    if len(powers) == 1 and last.power not in powers:
        return False, False
    if last.power >= 0:
        fewest = min((shape.power for shape in known if shape.power >= 0), default=2)
        return last.power >= fewest, powers == {last.power}
    decimals = {shape.decimals for shape in known if shape.power < 0}
    if decimals == {-1} or not decimals:
        digits = {shape.whole for shape in known}
        return last.whole >= min(digits), digits == {last.whole}
    certain = len(decimals) == 1 and last.decimals in decimals and last.decimals > 0
    return certain or last.decimals >= max(1, min(decimals)), certain
