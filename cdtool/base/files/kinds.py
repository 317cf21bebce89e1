"""Recognise the kind of a file by its content, for messages about a file of the wrong kind."""

from __future__ import annotations

import re

_MARKS = (
    (re.compile(rb'\s*\{\s*"kind":\s*"cdtool signature"'), "a signature file"),
    (re.compile(rb'\s*\{\s*"provenance":\s*\{\s*"tool":\s*"cdtool"'), "a results file"),
    (re.compile(rb'\s*\{\s*"verdict":\s*"'), "a comparison of two results"),
    (re.compile(rb"\s*(?:\{|\[\s*\[?\s*[{\"\d-])"), "JSON"),
    (re.compile(rb"(?:[^\n]*\n)*?\s*\[machine\]"), "a machine file"),
    (re.compile(rb"(?:[^\n]*\n)*?\s*\[(?:learn|holdout|impacts\.[^\]\n]+)\]"), "a benchmark file"),
    (re.compile(rb"\x89MCAP0"), "an MCAP recording"),
    (re.compile(rb"<\?xml|<testsuites"), "XML"),
    (re.compile(rb"<!DOCTYPE html|<html", re.IGNORECASE), "HTML"),
    (re.compile(rb"\x1f\x8b"), "gzip-compressed"),
    (re.compile(rb"\x89PNG"), "a PNG image"),
    (re.compile(rb"(?:[^\n]*\n){1,3}?[-+\d.eE]+(?:[,;\t ]\s*[-+\d.eE]+)+\r?\n"), "a table of numbers"),
)
#: The beginning or the end of a file, which has its mark [bytes]: behind comments and the first tables, too.
LOOKED_AT = 1 << 13


def kind_of(content: bytes) -> str:
    """Return the kind of a file by its beginning, with its article; empty if unknown."""
    head = content[:LOOKED_AT]
    return next((words for mark, words in _MARKS if mark.match(head)), "")
