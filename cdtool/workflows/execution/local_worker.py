"""What a worker process of `--cluster local` does before it begins: it leaves Ctrl-C to the first process."""

from __future__ import annotations

import signal
from typing import Any


def dask_setup(_: Any) -> None:
    """Ignore Ctrl-C, which a terminal sends to every process; called by Dask's `preload`."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
