"""The journal of a store: what is in it outlives its writer, and a journal that is in use stays with it."""

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from cdtool.execution.store import journal
from cdtool.execution.store.entry import Entry
from cdtool.execution.store.journal import Journal, left_behind
from cdtool.execution.store.sources import SourceFile

ENTRY = Entry("ab" * 32, "detector", "stiff/ü\udcff 1.csv", "momentum", '["a\\tb", 1.5]', (SourceFile(1, 2, "cd"),))


def test_a_journal_in_use_is_not_taken_over_one_that_was_left_is(tmp_path):
    own = Journal(tmp_path)
    own.add([ENTRY, ENTRY])
    assert list(left_behind(tmp_path)) == []
    own._file.close()
    assert list(left_behind(tmp_path)) == [(own.path, [ENTRY, ENTRY])]


def test_what_is_in_a_part_is_no_longer_in_the_journal(tmp_path):
    own = Journal(tmp_path)
    own.add([ENTRY])
    own.clear()
    own.add([ENTRY])
    own._file.close()
    assert [entries for _, entries in left_behind(tmp_path)] == [[ENTRY]]


@settings(max_examples=60, deadline=None)
@example(cut=0, flipped=169)  # the end of the first line
@example(cut=171, flipped=339)  # the end of the second one, which is cut off
@given(cut=st.integers(0, 400), flipped=st.integers(0, 399))
def test_lines_that_are_cut_off_or_damaged_do_not_count(tmp_path_factory, cut, flipped):
    folder = tmp_path_factory.mktemp("store")
    own = Journal(folder)
    own.add([ENTRY, ENTRY, ENTRY])
    own._file.close()
    content = bytearray(own.path.read_bytes())
    length = len(content) // 3
    assert length * 3 == len(content)
    content[flipped % len(content)] ^= 1
    own.path.write_bytes(content[: len(content) - cut] if cut < len(content) else b"")
    found = [entry for _, entries in left_behind(folder) for entry in entries]
    size, position = max(0, len(content) - cut), flipped % len(content)
    whole = (size + 1) // length  # the last line may be without its end
    line = position // length
    damaged = {line, (position + 1) // length} if position < size else set()  # without its end a line joins the next
    assert found == [ENTRY] * len(set(range(whole)) - damaged)


def test_a_new_journal_that_another_run_has_taken_is_replaced(tmp_path, monkeypatch):
    lock, tries = journal._lock, []

    def taken_once(handle):
        tries.append(handle)
        return len(tries) > 1 and lock(handle)

    monkeypatch.setattr(journal, "_lock", taken_once)
    own = Journal(tmp_path)
    assert len(tries) == 2
    assert own.path.exists()
    with pytest.raises(FileExistsError):
        own.path.open("xb")
