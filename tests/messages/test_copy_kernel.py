"""The copy kernel compared with plain Python on random words, masks and messages."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.messages.columns.copy_kernel import WORD, compared_words, copy_uniform, words_of


@st.composite
def messages(draw):
    size = draw(st.integers(WORD, 60))
    count = draw(st.integers(1, 6))
    first = draw(st.binary(min_size=size, max_size=size))
    mask = draw(st.binary(min_size=size, max_size=size).map(lambda text: bytes(255 * (byte % 3 == 0) for byte in text)))
    rest = []
    for _ in range(count - 1):
        other = bytearray(draw(st.binary(min_size=size, max_size=size + 5)))
        if draw(st.integers(0, 4)):  # most messages match
            other[:size] = bytes(a if hidden else b for a, hidden, b in zip(first, mask, other, strict=False))
        rest.append(bytes(other[: draw(st.integers(size - 1, len(other)))] if not draw(st.integers(0, 9)) else other))
    copied = draw(st.lists(st.integers(0, size - WORD), max_size=5))
    return first, mask, rest, copied, draw(st.lists(st.integers(0, 7), min_size=len(copied), max_size=len(copied)))


@settings(deadline=None)  # the first example compiles
@given(messages())
def test_words_are_copied_if_every_message_matches_the_template(given_messages):
    first, mask, rest, copied, shift = given_messages
    every = [first, *rest]
    data = np.frombuffer(b"".join(every), np.uint8)
    length = np.array([len(each) for each in every])
    start = np.cumsum(length) - length
    compared = compared_words(np.frombuffer(mask, np.uint8), np.frombuffer(first, np.uint8))
    n, k = len(every), len(copied)
    out = np.zeros(n * k, np.uint64)
    all_match = copy_uniform(
        words_of(data),
        start,
        length,
        len(first),
        len(first) + 2,
        *compared,
        np.array(copied, np.uint64),
        8 * np.array(shift, np.uint64),
        np.arange(k) * n,
        np.ones(k, np.int64),
        out,
    )
    expected = all(
        0 <= len(each) - len(first) <= 2 and all(a == b for a, b, bits in zip(each, first, mask, strict=False) if bits)
        for each in every
    )
    assert all_match == expected
    if all_match:
        words = [
            int.from_bytes(each[at + up : at + WORD], "little")
            for at, up in zip(copied, shift, strict=True)
            for each in every
        ]
        assert out.tolist() == words


def test_exactly_the_bytes_of_the_mask_are_compared():
    rng = np.random.default_rng(4)
    for size in range(WORD, 40):
        mask = np.where(rng.random(size) < 0.2, 255, 0).astype(np.uint8)
        content = rng.integers(0, 256, size, dtype=np.uint8)
        offsets, bits, pattern = compared_words(mask, content)
        covered = np.zeros(size, np.uint8)
        for at, each, wanted in zip(offsets.astype(int), bits, pattern, strict=True):
            assert at + WORD <= size
            covered[at : at + WORD] |= np.frombuffer(each.tobytes(), np.uint8)
            assert wanted.tobytes() == content[at : at + WORD].tobytes()
        assert np.array_equal(covered, mask)
