"""What a worker process of `--cluster local` does before it begins: it leaves Ctrl-C to the first process."""

from __future__ import annotations

from typing import Any

from cdtool.execution.interruption import ignore_interruption


def dask_setup(_: Any) -> None:
    """Ignore Ctrl-C, which a terminal sends to every process; called by Dask's `preload`."""
    ignore_interruption()
