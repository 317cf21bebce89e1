"""The store: a folder of files with what was computed, each named by the digest of everything that determines it.

    store.json                what the folder is
    KIND/ab/cdef...           the content of a key of a kind, compressed

A file is complete or not there; a damaged one is as if it were missing. So processes need no order: each asks for what
it is about to compute, and keeps what it has computed; what two of them compute is written twice.
"""

from __future__ import annotations

import json
import os
import secrets
import time
import zlib
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from cdtool.base.errors import ConfigurationError, OutputError
from cdtool.base.files.bounded_loading import parse_json, read_bytes
from cdtool.base.files.locks import is_temporary
from cdtool.base.files.writing import write_bytes, write_text
from cdtool.base.remote.remote_path import is_remote

Kind = Literal["logs", "traces", "learned"]
_KIND, _SCHEMA = "cdtool store", 2  # a change of the layout counts on
_MARK = "store.json"


@dataclass(frozen=True)
class Store:
    """The folder of a store."""

    folder: Path

    @property
    def exists(self) -> bool:
        """Whether the folder exists and is not empty."""
        return self.folder.is_dir() and any(not is_temporary(item.name) for item in self.folder.iterdir())

    @property
    def mark(self) -> Path:
        """Return the file that says what the folder is."""
        return self.folder / _MARK

    def create(self) -> None:
        """Create the store, unless it exists; raises ConfigurationError for a folder with other content."""
        if not self.mark.is_file():
            has_content = self.folder.exists() and (not self.folder.is_dir() or self.exists)
            if has_content and not self.mark.is_file():  # another process may just have created it
                raise ConfigurationError(
                    f"{self.folder}: is neither a store nor an empty folder", "give another folder"
                )
            self.folder.mkdir(parents=True, exist_ok=True)
            values = {"kind": _KIND, "schema_version": _SCHEMA, "created": int(time.time())}
            write_text(self.mark, json.dumps(values) + "\n")
        self.check()

    def check(self) -> None:
        """Raise ConfigurationError if the folder is not a store of this version."""
        if not self.mark.is_file():
            raise ConfigurationError(f"{self.folder}: is not a store", "give the folder that was given as --store")
        values = _values(self.mark)
        if values.get("kind") != _KIND or values.get("schema_version") != _SCHEMA:
            raise ConfigurationError(
                f"{self.mark}: is not that of a store of this version", "give another folder, or remove this one"
            )

    def known(self, kind: Kind, key: str) -> str | None:
        """Return the content of a key; None if it is missing or damaged."""
        path = self._path(kind, key)
        try:
            content = zlib.decompress(path.read_bytes()).decode("utf-8", "surrogatepass")
        except (OSError, ValueError, zlib.error):
            return None
        if not is_remote(self.folder):
            with suppress(OSError):
                if path.stat().st_mtime < time.time() - 86_400.0:  # after a day it is noted that the file is in use
                    os.utime(path)
        return content

    def keep(self, kind: Kind, key: str, content: str) -> None:
        """Keep the content of a key; when it returns, it outlives this process. Raises OutputError."""
        # Level 3: speed counts more than size, half the time of the default.
        path, packed = self._path(kind, key), zlib.compress(content.encode("utf-8", "surrogatepass"), 3)
        if is_remote(self.folder):
            write_bytes(path, packed)
            return
        part = path.with_name(f".{secrets.token_hex(8)}")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            part.write_bytes(packed)
            part.replace(path)
        except OSError as fault:
            with suppress(OSError):
                part.unlink()
            raise OutputError(f"{self.folder}: cannot be written: {fault.strerror or fault}") from fault

    def _path(self, kind: Kind, key: str) -> Path:
        return self.folder / kind / key[:2] / key[2:]


def _values(mark: Path) -> Mapping[str, Any]:
    try:
        values = parse_json(read_bytes(mark, ConfigurationError))
    except ValueError:
        return {}
    return values if isinstance(values, dict) else {}
