"""Files that are written to URLs."""

from __future__ import annotations

import pytest

from cdtool.base.errors import OutputError, UsageError
from cdtool.base.files.foreign import Kind, refuse_inputs, refuse_other_kind
from cdtool.base.files.writing import locked, replaced, replaced_folder, write_bytes, write_text
from cdtool.base.remote.remote_path import location


def test_a_file_is_written_and_replaced_in_one_step(memory):
    path = location("memory://out/a b.json")
    write_text(path, "ä\n")
    assert memory.cat("/out/a b.json") == "ä\n".encode() and path.read_bytes().decode() == "ä\n"
    assert path.open("rb").read() == "ä\n".encode()
    write_bytes(path, b"new")
    assert path.open("rb").read() == b"new" and memory.find("/out") == ["/out/a b.json"]


def test_a_folder_is_uploaded_and_other_files_stay(memory):
    memory.pipe_file("/out/old.txt", b"old")
    memory.pipe_file("/out/report.html", b"old")
    asked = []
    target = location("memory://out")
    with replaced_folder(target, lambda folder: bool(asked.append(folder))) as part:
        (part / "report.html").write_text("new")
        (part / "figures").mkdir()
        (part / "figures" / "1.png").write_bytes(b"1")
    assert asked == [target]
    assert memory.cat("/out/report.html") == b"new" and memory.cat("/out/old.txt") == b"old"
    assert memory.cat("/out/figures/1.png") == b"1"


def test_a_folder_that_may_be_replaced_keeps_nothing_old(memory):
    for name in ("rows/0001.parquet", "rows/0002.parquet"):
        memory.pipe_file(f"/out/results.parquet/{name}", b"old")
    with replaced_folder(location("memory://out/results.parquet"), lambda _: True) as part:
        (part / "rows").mkdir()
        (part / "rows" / "0001.parquet").write_bytes(b"new")
    assert memory.find("/out") == ["/out/results.parquet/rows/0001.parquet"]
    assert memory.cat("/out/results.parquet/rows/0001.parquet") == b"new"


def test_what_may_not_be_replaced_is_not(memory):
    memory.pipe_file("/out/a.json", b'{"kind": "of another program"}')
    path, kind = location("memory://out/a.json"), Kind(b'"kind": "cdtool"', "results of cdtool")
    with pytest.raises(UsageError, match=r"memory://out/a.json: already exists and contains no results of cdtool"):
        refuse_other_kind(path, kind)
    write_bytes(path, b'{"kind": "cdtool"}')
    refuse_other_kind(path, kind)
    with pytest.raises(UsageError, match="is read by this command"):
        refuse_inputs([path], [path])
    refuse_inputs([path, location("memory://out/new.json")], [location("memory://out/other.json")])


def test_a_storage_that_cannot_be_written_is_named_in_one_line(memory, monkeypatch):
    def fail(*_: object, **__: object) -> None:
        raise PermissionError("Access Denied for https://u:pw@host/a?sig=abc")

    monkeypatch.setattr(type(memory), "put_file", fail)
    path = location("memory://out/a.json")
    with pytest.raises(OutputError) as caught:
        write_text(path, "x")
    assert caught.value.message == (
        "memory://out/a.json: cannot be written: access is denied: Access Denied for https://host/a"
    )
    with pytest.raises(OutputError, match="cannot be written"), replaced(path) as (part,):
        part.write_bytes(b"")
    with pytest.raises(OutputError, match="cannot be written"), replaced_folder(path.parent) as part:
        (part / "a.json").write_bytes(b"")


def test_an_update_on_s3_does_not_overwrite_what_another_process_wrote(bucket):
    path = location(bucket.put("gate.json", b"first"))
    with locked(path):
        write_bytes(path, b"second")
    assert bucket.get("gate.json") == b"second"
    with pytest.raises(OutputError, match="was changed by another process meanwhile"), locked(path):
        bucket.put("gate.json", b"of another process")
        write_bytes(path, b"third")
    assert bucket.get("gate.json") == b"of another process"
    write_bytes(path, b"fourth")  # without the lock, the last writer wins
    assert bucket.get("gate.json") == b"fourth"
