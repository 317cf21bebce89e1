"""An empty file system in memory, and an S3 server on the loopback interface."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from cdtool.base.remote import staging
from tests.base.remote.s3_server import Bucket, S3Server


@pytest.fixture(autouse=True)
def _nothing_kept() -> Iterator[None]:
    """Forget copies and answers between tests."""
    staging.release()
    yield
    staging.release()


@pytest.fixture
def memory(monkeypatch):
    """The file system of memory:// URLs, empty."""
    from fsspec.implementations.memory import MemoryFileSystem

    monkeypatch.setattr(MemoryFileSystem, "store", {})
    monkeypatch.setattr(MemoryFileSystem, "pseudo_dirs", [""])
    return MemoryFileSystem()


@pytest.fixture(scope="session")
def s3_server() -> Iterator[S3Server]:
    with S3Server() as server:
        yield server


@pytest.fixture
def bucket(s3_server, monkeypatch) -> Bucket:
    """A new bucket; the environment names its server and has credentials for it."""
    s3_server.set_environment(monkeypatch)
    return s3_server.new_bucket()
