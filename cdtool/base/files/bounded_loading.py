"""Read TOML, JSON, gzip and small text files with bounds on size, depth, memory and numbers.

Conventions: an error of the file itself (missing, not a regular file, too large) is raised as the caller's error class,
with the path. An error of its contents is a ContentError: its text is the reason, and the caller adds the file and the
next step. Files written by cdtool or by a person stay within all bounds; a hostile file is refused before it uses the
memory.
"""

from __future__ import annotations

import json
import math
import os
import re
import stat
import tomllib
import zlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from sys import intern
from typing import TYPE_CHECKING, Any

import numpy as np

from cdtool.base.errors import CdtoolError, ConfigurationError, MistakesError
from cdtool.base.files.kinds import kind_of
from cdtool.base.remote.storage import StorageError

if TYPE_CHECKING:
    from cdtool.base.settings import Place

#: The unit of bounds and sizes, and what is read at once of a file [bytes].
MIB = 2**20
# Text written by a person: a machine, benchmark, label or trigger file, a URDF.
MOST_TEXT = 16 * MIB
# tomllib needs up to 200 times as much memory.
MOST_TOML = MIB
# Results, signatures and traces, on disk and unpacked.
MOST_JSON = 512 * MIB
#: Files that cdtool writes are a few levels deep; Python's JSON reader ends at 1000.
MOST_DEPTH = 64
_SWAPPED = ("a signature file", "a machine file")  # given, needed: commands take both
# A file may need this much memory, and a multiple of its size on disk; only hostile files need more.
_FREE = 160 * MIB

#: The beginning of a table or of a key with its value; not that of an item in a list.
_STATEMENT = re.compile(r"""\s*+(?:\[\[?[\w.' "-]++\]|(?:[\w.-]++|"[^"]*+")\s*+=)""")
# The time that tomllib takes for a key is quadratic in its parts.
_LONG_KEY = re.compile(r"""(?<![\w-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')\s*+\.\s*+){16}""")
# The end is optional: the rest of an unterminated text is searched only once, not from each of its quotes.
_JSON_TEXT = re.compile(rb'"[^"\\]*+(?:\\.[^"\\]*+)*+"?', re.DOTALL)
_NO_BRACKETS = bytes(set(range(256)) - set(b"[]{}"))


class ContentError(ValueError):
    """The contents of a file are not as required; the text is the reason, on one line, without the file's name.

    `line` is the one that is not TOML, counted from 1, if the rest of the text may be; behind the last one if it ends
    too early.
    """

    line: int | None = None


def read_bytes(
    path: Path, error: type[CdtoolError], *, most: int = MOST_TEXT, hint: str = "check the path", missing: str = ""
) -> bytes:
    """Return the bytes of a regular file of at most `most` bytes; otherwise raise `error` with the path and `hint`.

    A FIFO, device or folder is refused without being read. `missing`: the hint for a missing file.
    """
    try:
        # Without O_NONBLOCK, opening a FIFO would wait for a writer.
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    except FileNotFoundError:
        raise error(f"{path}: no such file", missing or hint) from None
    except StorageError as fault:
        raise error(fault.message, fault.hint) from fault
    except ValueError as fault:  # a NUL, which is not allowed in file names
        raise error(f"{str(path)!r}: is not a file name", hint) from fault
    except OSError as fault:
        raise error(f"{path}: cannot be read: {fault.strerror}", hint) from fault
    state = os.fstat(handle)
    if not stat.S_ISREG(state.st_mode):
        os.close(handle)
        if stat.S_ISDIR(state.st_mode):
            raise error(f"{path}: cannot be read: is a folder", "give a file in it")
        raise error(f"{path}: is not a regular file", "save the stream to a file first")
    with os.fdopen(handle, "rb") as file:
        if state.st_size > most:
            raise error(
                f"{path}: has {state.st_size / MIB:.0f} MiB; at most {most / MIB:.0f} are read",
                "check that it is the right file",
            )
        try:
            content = file.read(most + 1)  # a file in /proc has more bytes than stated
        except OSError as fault:
            raise error(f"{path}: cannot be read: {fault.strerror}", hint) from fault
    if len(content) > most:
        raise error(f"{path}: has more than {most / MIB:.0f} MiB", "check that it is the right file")
    return content


def read_text(path: Path, error: type[CdtoolError], *, most: int = MOST_TEXT) -> str:
    """Return the UTF-8 text of a regular file, without the mark that Windows editors begin it with.

    Raises `error` with the path.
    """
    hint = "give a UTF-8 text file"
    try:
        text = read_bytes(path, error, most=most, hint=hint, missing="check the path").decode("utf-8-sig")
    except UnicodeDecodeError as fault:
        raise error(f"{path}: is not UTF-8 text", hint) from fault
    return text.replace("\r\n", "\n").replace("\r", "\n")


def parse_toml(text: str) -> dict[str, Any]:
    """Return the tables of a TOML text; raises ContentError with the line, or with the key of a number out of range."""
    if found := _LONG_KEY.search(text):
        line = text.count("\n", 0, found.start()) + 1
        raise ContentError(f"a key of more than 16 parts at line {line}")
    try:
        values = tomllib.loads(text)
    except tomllib.TOMLDecodeError as fault:
        broken = ContentError(str(fault))
        at = re.search(r"at line (\d+)", str(fault))  # of tomllib, which has no attribute for it before Python 3.14
        broken.line = int(at[1]) if at else text.count("\n") + 1
        raise broken from fault
    except RecursionError as fault:
        raise ContentError("nested too deeply") from fault
    except ValueError as fault:  # of `int`
        raise ContentError("a whole number of more than 4300 digits") from fault
    for key, number in _integers(values, ""):
        if not -(2**63) <= number < 2**63:
            raise ContentError(f"{key} is a whole number of {len(str(abs(number)))} digits: more than 64 bits")
    return values


def read_toml(path: Path, what: str, place: Place | None = None) -> dict[str, Any]:
    """Return the tables of a TOML file; raises ConfigurationError with the file and the line.

    `what` the file should be, such as "a machine file", is stated if it is something else. With `place` a line that is
    not TOML is a mistake there, and the rest of the file is read without it; below a broken [table] nothing is read
    until the next one.
    """
    text = read_text(path, ConfigurationError, most=MOST_TOML)
    lines, mistakes = text.splitlines(), place.mistakes if place else []
    for _ in range(20):  # more are another kind of file
        try:
            return parse_toml("\n".join(lines) + "\n")
        except ContentError as fault:
            broken, reason = _broken_lines(lines, fault)
            mistakes.append(_not_toml(path, text, what, reason))
            mistakes[-1].file = str(path)
        if place is None or not broken or _other_kind(text):
            break
        for line in broken:
            lines[line] = ""
    raise MistakesError.of(mistakes)


def _broken_lines(lines: Sequence[str], fault: ContentError) -> tuple[range, str]:
    """Return the lines without which the rest may be TOML, empty if none are known, and what is wrong with them.

    A list without its end is reported where the next statement begins, or at the end of the text.
    """
    if fault.line is None:
        return range(0), str(fault)
    line = fault.line - 1
    reported = lines[line] if line < len(lines) else ""
    if not reported.strip() or _STATEMENT.match(reported):
        above = next((i for i in reversed(range(line)) if _STATEMENT.match(lines[i])), line)
        try:
            parse_toml("\n".join(lines[above:line]))
        except ContentError:
            return range(above, line), f"a list that does not end (at line {above + 1})"
    if not reported.strip():
        return range(0), str(fault)
    end = line + 1
    if reported.lstrip().startswith("["):
        end = next((i for i in range(end, len(lines)) if lines[i].lstrip().startswith("[")), len(lines))
    return range(line, end), str(fault)


def _other_kind(text: str) -> str:
    """Return what a text is that is not meant to be TOML; empty for one that is, and for one that is not known."""
    kind = kind_of(text.encode())
    return "" if kind.endswith(("machine file", "benchmark file")) else kind


def _not_toml(path: Path, text: str, what: str, reason: str) -> ConfigurationError:
    kind = _other_kind(text)
    if not kind:
        return ConfigurationError(f"{path}: not valid TOML: {reason}", "write texts in quotes, decimals with a point")
    swapped = "; it may be swapped with the signature" if (kind, what) == _SWAPPED else ""
    return ConfigurationError(f"{path}: is {kind}, not {what}", f"give {what}{swapped}")


def parse_json(content: bytes) -> Any:
    """Return the values of strict JSON in UTF-8: finite numbers, integers of at most 64 bits; raises ContentError."""
    _check_memory(_memory(content), _FREE + 16 * len(content))
    if _depth(content) > MOST_DEPTH:
        raise ContentError(f"nested more than {MOST_DEPTH} deep")
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as fault:
        raise ContentError("not UTF-8 text") from fault
    if not text.strip():
        raise ContentError("it is empty")
    try:
        return json.loads(
            text, parse_constant=_refuse, parse_float=_finite, parse_int=_integer, object_pairs_hook=_object
        )
    except json.JSONDecodeError as fault:
        raise ContentError(f"truncated or damaged at line {fault.lineno}") from fault
    except RecursionError as fault:
        raise ContentError("nested too deeply") from fault


def parse_own_json(text: str | bytes) -> Any:
    """Return the values of JSON from inside a file that cdtool wrote, with NaN as it may hold; raises ValueError."""
    try:
        return json.loads(text, object_pairs_hook=_object)
    except RecursionError as fault:
        raise ContentError("nested too deeply") from fault


def unpack_json(content: bytes) -> Any:
    """Return the values of gzipped JSON that cdtool wrote; ContentError, also before it takes far too much memory."""
    bound = _FREE + 100 * len(content)
    pieces: list[bytes] = []
    memory = 0
    for piece in _unpacked(content):
        memory += _memory(piece)
        _check_memory(memory, bound)
        pieces.append(piece)
    return parse_own_json(b"".join(pieces))


def _unpacked(content: bytes) -> Iterator[bytes]:
    stream = zlib.decompressobj(wbits=31)
    packed = content
    try:
        while not stream.eof:
            piece = stream.decompress(packed, MIB)
            packed = stream.unconsumed_tail
            if not piece and not packed and not stream.eof:
                raise ContentError("truncated")
            yield piece
    except zlib.error as fault:
        raise ContentError("not a complete gzip file") from fault
    if stream.unused_data:
        raise ContentError(f"{len(stream.unused_data)} bytes after its end")


def _integers(value: Any, key: str) -> Iterator[tuple[str, int]]:
    """Yield all integers below a value, with their keys."""
    if isinstance(value, Mapping):
        for name, item in value.items():
            yield from _integers(item, f"{key}.{name}" if key else name)
    elif isinstance(value, list):
        for i, item in enumerate(value):
            yield from _integers(item, f"{key}[{i}]")
    elif isinstance(value, int):
        yield key, value


def _memory(content: bytes) -> int:
    """Return an upper bound of the memory for JSON as Python values [bytes]."""
    elements = content.count(b",")
    lists, objects = content.count(b"["), content.count(b"{")
    # Per character (as bytes and text), element, list and object.
    return 2 * len(content) + 40 * elements + 60 * lists + 200 * objects


def _check_memory(memory: int, bound: int) -> None:
    if memory > bound:
        raise ContentError(f"needs more than {bound / MIB:.0f} MiB of memory, too much for its size: refused")


def _depth(content: bytes) -> int:
    """Return the nesting depth of lists and objects, ignoring texts."""
    brackets = np.frombuffer(_JSON_TEXT.sub(b"", content).translate(None, _NO_BRACKETS), dtype=np.uint8)
    if not len(brackets):
        return 0
    steps = np.where((brackets == ord("[")) | (brackets == ord("{")), 1, -1).astype(np.int8)
    return int(np.cumsum(steps, dtype=np.int32).max())


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return an object in which equal texts are one text in memory: rows repeat their names."""
    return {key: intern(value) if type(value) is str else value for key, value in pairs}


def _refuse(constant: str) -> float:
    raise ContentError(f"{constant} is not a JSON number")


def _finite(text: str) -> float:
    value = float(text)
    if math.isinf(value):
        raise ContentError(f"{text[:40]} exceeds the largest number")
    return value


def _integer(text: str) -> int:
    if len(text) > 19:  # those of 2^63
        digits = len(text.removeprefix("-"))
        if digits > 19:
            raise ContentError(f"a whole number of {digits} digits: more than 64 bits")
    return int(text)
