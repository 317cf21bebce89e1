"""moto's S3 server as a process of its own; tests that need it are skipped where moto is not installed."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
import urllib.request
from contextlib import suppress
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from types import TracebackType
from typing import Any

import pytest

SECRET = "s3cretKeyOfTheTests"


@dataclass(frozen=True)
class Bucket:
    """A bucket of the server, and fsspec's file system for it."""

    name: str
    fs: Any

    @property
    def url(self) -> str:
        return f"s3://{self.name}"

    def put(self, name: str, content: bytes) -> str:
        """Write an object and return its URL."""
        self.fs.pipe_file(f"{self.name}/{name}", content)
        return f"{self.url}/{name}"

    def get(self, name: str) -> bytes:
        return bytes(self.fs.cat_file(f"{self.name}/{name}"))

    def names(self) -> set[str]:
        self.fs.invalidate_cache()
        return {str(path).removeprefix(f"{self.name}/") for path in self.fs.find(self.name)}

    def put_folder(self, folder: Path) -> str:
        """Copy a folder and return its URL."""
        for path in folder.rglob("*"):
            if path.is_file():
                self.put(f"{folder.name}/{path.relative_to(folder).as_posix()}", path.read_bytes())
        return f"{self.url}/{folder.name}"


class S3Server:
    """A server on a free port; `stop` ends it at once."""

    def __init__(self) -> None:
        pytest.importorskip("s3fs", reason="s3fs is not installed: pip install '.[remote]'")
        if any(find_spec(name) is None for name in ("moto", "flask")):
            pytest.skip("no S3 server: pip install '.[s3test]'")
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        self.endpoint = f"http://127.0.0.1:{port}"
        self._count = 0
        self._process = subprocess.Popen(
            [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env={name: value for name, value in os.environ.items() if name != "PYTHONPATH"},
        )
        for _ in range(600):
            with suppress(OSError), urllib.request.urlopen(self.endpoint, timeout=1.0):
                return
            time.sleep(0.1)
        self.stop()
        raise RuntimeError("the S3 server does not answer")

    def __enter__(self) -> S3Server:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    def stop(self) -> None:
        self._process.kill()
        self._process.wait()

    def environment(self) -> dict[str, str]:
        return {
            "AWS_ENDPOINT_URL": self.endpoint,
            "AWS_ACCESS_KEY_ID": "tests",
            "AWS_SECRET_ACCESS_KEY": SECRET,
            "AWS_DEFAULT_REGION": "us-east-1",
            "AWS_MAX_ATTEMPTS": "1",
            "AWS_EC2_METADATA_DISABLED": "true",
        }

    def set_environment(self, monkeypatch: pytest.MonkeyPatch) -> None:
        import s3fs

        for name, value in self.environment().items():
            monkeypatch.setenv(name, value)
        s3fs.S3FileSystem.clear_instance_cache()

    def new_bucket(self) -> Bucket:
        import s3fs

        self._count += 1
        name = f"bucket-{self._count}"
        fs = s3fs.S3FileSystem()
        fs.mkdir(name)
        return Bucket(name, fs)
