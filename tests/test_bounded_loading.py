"""Files are bounded before they are parsed, and what is in bounds is parsed as tomllib and json parse it."""

from __future__ import annotations

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.bounded_loading import ContentError, parse_toml, read_text
from cdtool.errors import ConfigurationError

PIECES = st.lists(st.sampled_from(['"', "'", '\\"', "\\\\", "\n", "a", " ", "#", "[", "]", '""', "''"]), max_size=12)


@pytest.mark.parametrize(
    "text",
    [
        '"""one line"""',
        '"""two\nlines"""',
        '"""with "a" quote and ""two"""',
        '"""\\" \\\\"""',
        "'''it's\nso'''",
        '"""x"""""',
    ],
)
def test_a_text_over_several_lines_may_contain_quotes_and_escapes(text):
    document = f"note = {text}\nmass_kg = 3.0\n"
    assert parse_toml(document) == tomllib.loads(document)


@given(PIECES)
def test_a_text_that_tomllib_reads_is_never_refused(pieces):
    document = f'note = """{"".join(pieces)}"""\n'
    try:
        expected = tomllib.loads(document)
    except tomllib.TOMLDecodeError:
        return
    assert parse_toml(document) == expected


def test_a_text_that_does_not_end_is_refused_with_its_line():
    with pytest.raises(ContentError, match="line 2 is not terminated"):
        parse_toml('a = 1\nb = """' + '\\"' * 1000)


def test_the_mark_at_the_start_of_a_windows_text_is_no_part_of_it(tmp_path):
    file = tmp_path / "machine.toml"
    file.write_bytes(b"\xef\xbb\xbf[machine]\r\n")
    assert read_text(file, ConfigurationError) == "[machine]\n"
