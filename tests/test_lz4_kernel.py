"""The compiled decoder of LZ4 frames returns what the `lz4` package returns, and writes nothing outside its memory."""

from __future__ import annotations

import lz4.frame
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.lz4_kernel import NOT_DECODED, decode_frame

BLOCK_SIZES = [lz4.frame.BLOCKSIZE_MAX64KB, lz4.frame.BLOCKSIZE_MAX256KB, lz4.frame.BLOCKSIZE_MAX4MB]
GUARD = 200
SHORTEST_MATCH = 4


def decode(packed, size):
    """Return the decoded bytes, or None; check the bytes around the memory."""
    memory = np.full(size + 2 * GUARD, 0xA5, np.uint8)
    result = decode_frame(np.frombuffer(packed, np.uint8), memory[GUARD : GUARD + size])
    assert (memory[:GUARD] == 0xA5).all() and (memory[GUARD + size :] == 0xA5).all()
    assert result in (size, NOT_DECODED)
    return memory[GUARD : GUARD + size].tobytes() if result == size else None


def by_package(packed):
    """Return the content of one whole frame, or None."""
    frame = lz4.frame.LZ4FrameDecompressor()
    try:
        content = frame.decompress(packed)
    except RuntimeError:
        return None
    return content if frame.eof and not frame.unused_data else None


@st.composite
def contents(draw):
    """Return bytes with repetitions at any distance and of any length, and without."""
    random = np.random.default_rng(draw(st.integers(0, 2**32)))
    content = b""
    for _ in range(draw(st.integers(0, 12))):
        kind = draw(st.sampled_from(["noise", "period", "earlier"]))
        length = draw(st.one_of(st.integers(0, 40), st.integers(0, 700), st.integers(0, 70_000)))
        if kind == "noise":
            content += random.bytes(length)
        elif kind == "period":
            period = random.bytes(draw(st.integers(1, 40)))
            content += (period * (length // len(period) + 1))[:length]
        else:
            start = draw(st.integers(0, len(content)))
            content += content[start : start + length]
    return content


@settings(max_examples=80, deadline=None)
@given(
    contents(),
    st.sampled_from(BLOCK_SIZES),
    st.booleans(),
    st.booleans(),
    st.sampled_from([-5, 0, 9]),
)
def test_frames_of_any_content_are_decoded(content, block_size, linked, sized, level):
    packed = lz4.frame.compress(
        content, block_size=block_size, block_linked=linked, store_size=sized, compression_level=level
    )
    assert decode(packed, len(content)) == content
    assert decode(packed, len(content) + 1) is None
    assert decode(packed + b"\0", len(content)) is None
    if content:
        assert decode(packed, len(content) - 1) is None


@settings(max_examples=300, deadline=None)
@given(contents(), st.booleans(), st.data())
def test_a_changed_frame_is_decoded_as_by_the_package_or_not_at_all(content, linked, data):
    packed = bytearray(lz4.frame.compress(content, block_linked=linked, store_size=data.draw(st.booleans())))
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.one_of(st.integers(0, len(packed) - 1), st.integers(0, min(60, len(packed) - 1))))
        packed[at] = data.draw(st.integers(0, 255))
    packed = packed[: data.draw(st.one_of(st.just(len(packed)), st.integers(0, len(packed))))]
    decoded = decode(bytes(packed), len(content))
    if decoded is not None:
        assert decoded == by_package(bytes(packed))


def sequence(literals, distance, length):
    """Return a sequence of a block (LZ4 Block Format): literals, then a match."""

    def longer(count):
        return b"" if count < 15 else b"\xff" * ((count - 15) // 255) + bytes([(count - 15) % 255])

    rest = length - SHORTEST_MATCH
    token = bytes([min(len(literals), 15) << 4 | min(rest, 15)])
    return token + longer(len(literals)) + literals + distance.to_bytes(2, "little") + longer(rest)


@settings(max_examples=200, deadline=None)
@given(
    st.lists(
        st.tuples(st.binary(max_size=70), st.integers(1, 80), st.integers(SHORTEST_MATCH, 600)), min_size=1, max_size=40
    ),
    st.binary(min_size=12, max_size=40),
)
def test_matches_of_any_distance_and_length_repeat_earlier_bytes(sequences, end):
    content, block = bytearray(), b""
    for literals, distance, length in sequences:
        content += literals
        if distance > len(content):
            literals, distance = literals + b"x" * distance, distance
            content += b"x" * distance
        for _ in range(length):
            content.append(content[-distance])
        block += sequence(literals, distance, length)
    content += end
    block += sequence(end, 0, SHORTEST_MATCH)[:-2]
    head = lz4.frame.compress(b"", block_linked=True, store_size=False)[:7]
    packed = head + len(block).to_bytes(4, "little") + block + bytes(4)
    assert len(content) < 65536
    assert decode(packed, len(content)) == by_package(packed) == content


@pytest.mark.parametrize("distance", [0, 5])
def test_a_match_before_the_first_byte_is_damage(distance):
    block = sequence(b"abcd", distance, 9) + sequence(b"012345678901", 0, SHORTEST_MATCH)[:-2]
    head = lz4.frame.compress(b"", store_size=False)[:7]
    assert decode(head + len(block).to_bytes(4, "little") + block + bytes(4), 25) is None


@pytest.mark.parametrize("options", [{"content_checksum": True}, {"block_checksum": True}])
def test_frames_with_checksums_are_left_to_the_package(options):
    content = bytes(range(256)) * 20
    assert decode(lz4.frame.compress(content, **options), len(content)) is None


def test_a_wrong_checksum_of_the_descriptor_is_damage():
    content = bytes(5000)
    for sized in (True, False):
        packed = bytearray(lz4.frame.compress(content, store_size=sized))
        packed[14 if sized else 6] ^= 1
        assert by_package(bytes(packed)) is None
        assert decode(bytes(packed), len(content)) is None
