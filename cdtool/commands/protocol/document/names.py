"""Which outputs are test protocols: reports and figures have the same suffixes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

ENDINGS = ("protocol.pdf", "protocol.html", "protokoll.pdf", "protokoll.html")
# The names of a report and of a figure, as the documentation gives them.
_OTHERS = ("report", "latency")


def protocol_names(targets: Sequence[Path], is_wanted: bool) -> tuple[list[Path], list[Path]]:
    """Return the targets that are test protocols, and the others.

    A name that ends like gate-7-protocol.pdf or Prüfprotokoll.html is one. If a protocol `is_wanted` and there is no
    such name, every PDF and HTML is one, except report.html and latency.pdf.
    """
    named = [target for target in targets if target.name.lower().endswith(ENDINGS)]
    if is_wanted and not named:
        pages = (target for target in targets if target.suffix.lower() in (".pdf", ".html"))
        named = [target for target in pages if target.stem.lower() not in _OTHERS]
    return named, [target for target in targets if target not in named]
