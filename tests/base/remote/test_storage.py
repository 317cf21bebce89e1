"""Errors of fsspec and of the libraries below it, as one line without secrets; versions of objects."""

from __future__ import annotations

import errno
import pickle
import sys

import pytest

from cdtool.base.errors import CdtoolError, is_lasting
from cdtool.base.remote.remote_path import location
from cdtool.base.remote.storage import MissingObjectError, ObjectInfo, StorageError
from tests.command import cdtool


class NoCredentialsError(Exception):
    """As botocore names it."""


FAULTS = {
    "missing": (FileNotFoundError("x"), "no such file"),
    "denied": (PermissionError("Forbidden"), "access is denied: Forbidden"),
    "no credentials": (NoCredentialsError("Unable to locate credentials"), "no credentials are set"),
    "network": (ConnectionResetError("reset by peer"), "the storage cannot be used: reset by peer"),
    "secret": (
        RuntimeError("503, url='https://u:pw@host/a?X-Amz-Signature=abc'"),
        "the storage cannot be used: 503, url='https://host/a'",
    ),
    "no space": (OSError(errno.ENOSPC, "No space left on device"), "No space left on device"),
    "precondition": (OSError("PreconditionFailed: If-Match"), "was changed by another process meanwhile"),
    "port": (OSError("no answer of 127.0.0.1:34125"), "the storage cannot be used: no answer of 127.0.0.1:34125"),
    "folder": (IsADirectoryError("x"), "is a folder"),
    "without words": (TimeoutError(), "the storage cannot be used: TimeoutError"),
    "many lines": (OSError("one\n  two"), "the storage cannot be used: one two"),
}


@pytest.fixture(params=FAULTS)
def failing(request, memory, monkeypatch):
    """A storage whose calls fail, with the reason that is shown."""
    fault, shown = FAULTS[request.param]

    def fail(*_: object, **__: object) -> None:
        raise fault

    monkeypatch.setattr(type(memory), "info", fail)
    monkeypatch.setattr(type(memory), "ls", fail)
    return shown


def test_a_fault_is_one_line_that_is_not_lasting(failing):
    path = location("memory://logs/a.csv")
    with pytest.raises(StorageError) as caught:
        path.stat()
    fault = caught.value
    assert fault.message == f"memory://logs/a.csv: {failing}" and fault.strerror == failing and fault.hint
    assert isinstance(fault, CdtoolError) and isinstance(fault, OSError) and not is_lasting(fault)
    again = pickle.loads(pickle.dumps(fault))
    assert (type(again), str(again), again.errno) == (type(fault), str(fault), fault.errno)


def test_a_fault_in_any_file_of_a_command_is_one_line(failing):
    done = cdtool("info", "memory://logs/a.csv", "-m", "memory://logs/machine.toml")
    assert done.status in (1, 2, 3, 4) and not done.out
    assert failing in done.err and len(done.err.strip().splitlines()) == 1 and "Traceback" not in done.err


def test_a_missing_object_is_a_missing_file(memory):
    with pytest.raises(MissingObjectError) as caught:
        location("memory://logs/a.csv").stat()
    assert isinstance(caught.value, FileNotFoundError) and isinstance(caught.value, StorageError)
    again = pickle.loads(pickle.dumps(caught.value))
    assert str(again) == str(caught.value) == "memory://logs/a.csv: no such file (check the path)"


def test_without_fsspec_one_line_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "fsspec.registry", None)
    done = cdtool("info", "s3://bucket/a.csv")
    assert done.err.splitlines() == [
        "error: s3://bucket/a.csv: reading a URL needs fsspec, which is not installed (pip install '.[remote]')"
    ]


def test_an_unknown_protocol_is_answered_with_the_nearest():
    done = cdtool("benchmark", "s33://bucket/benchmark.toml")
    assert "s33://bucket/benchmark.toml: unknown protocol 's33' (did you mean s3" in done.err and done.status == 2


def test_a_version_is_its_etag_and_size():
    one, other = ObjectInfo(5, '"abc"', 10**18), ObjectInfo(5, '"abd"', 10**18)
    assert one.digest.startswith("etag:") and one.digest != other.digest != ObjectInfo(6, '"abd"', 10**18).digest
    assert one.digest == ObjectInfo(5, '"abc"', 2 * 10**18).digest
    assert one.modified != other.modified and one.modified // 10**9 == 10**9
    assert ObjectInfo(5, "", 123).digest.startswith("modified:") and ObjectInfo(5, "", 123).modified == 123
