"""What the fuzzers and the damage generator have found once, tried again without them; see README.md."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.fuzz import targets
from tests.fuzz.seed_corpus import write
from tests.fuzz.targets import SEPARATOR, TARGETS, try_messages
from tests.time_bounds import bounded

FOUND = Path(__file__).parent / "found"
_JSON = b"\3"  # the encoding, as targets.try_messages numbers them
FILES = sorted(str(path.relative_to(FOUND)) for path in FOUND.glob("*/*"))


@pytest.mark.parametrize("name", FILES)
def test_an_input_that_was_found_once_is_read_or_refused_in_one_line(tmp_path, name):
    with bounded(30.0):  # compiling the kernels included
        TARGETS[Path(name).parent.name]((FOUND / name).read_bytes(), tmp_path / "input")


def test_the_seed_corpus_passes_its_targets(tmp_path):
    write(tmp_path / "corpus")
    for name, target in TARGETS.items():
        inputs = sorted((tmp_path / "corpus" / name).iterdir())
        assert len(inputs) >= 5
        for path in inputs[::7]:
            target(path.read_bytes(), tmp_path / "input")


@pytest.mark.parametrize("payload", [b'{"x": 1}', b'{"x": 1e400, "y": 2}', b"{}", b'{"x": "1"}', b"["])
def test_json_messages_are_what_python_reads(tmp_path, payload):
    try_messages(_JSON + SEPARATOR.join([b"", payload]), tmp_path / "input")


@pytest.mark.parametrize("other", [lambda _: 7.0, lambda _: int("no number")])
def test_the_target_sees_a_number_that_another_reader_does_not_give(tmp_path, other, monkeypatch):
    monkeypatch.setitem(targets._ORACLES, "json", lambda _: other)
    with pytest.raises(AssertionError):
        try_messages(_JSON + SEPARATOR.join([b"", b'{"x": 1}']), tmp_path / "input")
