"""How a command uses a store."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cdtool.execution.store.store import Store


@dataclass(frozen=True)
class StoreUse:
    """The folder of a store, and what of it is used.

    With `trust_times` a file with the size and the time of last change that the store knows is not hashed again. With
    `retry_failed` the logs that could not be read are read again.
    """

    folder: Path
    trust_times: bool = False
    retry_failed: bool = False

    @property
    def exists(self) -> bool:
        """Whether the folder exists and is not empty."""
        return self.folder.is_dir() and any(True for _ in self.folder.iterdir())

    @contextmanager
    def opened(self, *, writes: bool = True) -> Iterator[Store]:
        """Open the store, which is created if it does not exist, and write what was added at the end of the block."""
        from cdtool.execution.store.store import Store

        with Store(self.folder, writes=writes).writing() as store:
            yield store
