"""Which outputs are test protocols: by the end of their names, because reports and figures have the same suffixes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

ENDINGS = ("protocol.pdf", "protocol.html", "protokoll.pdf", "protokoll.html")


def is_protocol_name(target: Path) -> bool:
    """Return whether a name is that of a test protocol, as gate-7-protocol.pdf or Prüfprotokoll.html."""
    return target.name.lower().endswith(ENDINGS)


def protocol_names(targets: Sequence[Path]) -> tuple[list[Path], list[Path]]:
    """Return the targets that are test protocols, and the others."""
    return [target for target in targets if is_protocol_name(target)], [
        target for target in targets if not is_protocol_name(target)
    ]
