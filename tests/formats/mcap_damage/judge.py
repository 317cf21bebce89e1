"""A reading held against the truth: what is wrong with it, in words."""

from __future__ import annotations

import traceback
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from cdtool.errors import CdtoolError
from tests.formats.mcap_damage.bombs import honest
from tests.formats.mcap_damage.truth import Case, Message, Truth
from tests.formats.mcap_damage.ways import WAYS, Key, Reading
from tests.noted_times import noted

# Far more processor time than any of these small files takes [s].
LONGEST = 20.0
_SHARE = 0.95


def faults(case: Case, path: Path) -> list[str]:
    """What any way of reading does wrong with a case; `path` is where its file may be written."""
    path.write_bytes(case.data)
    topics = asked(case)
    found = []
    for way, key in WAYS.items():
        try:
            with noted(LONGEST):
                reading = way(path, topics)
        except Exception:  # the point of the exercise
            trace = traceback.format_exc().strip().splitlines()
            found.append(f"{way.__name__}: traceback: {trace[-3].strip()}: {trace[-1]}")
            continue
        found += [f"{way.__name__}: {fault}" for fault in judged(case.truth, reading, key)]
    return found


def warm_up(path: Path) -> None:
    """Read a file in every way once: compiling the kernels takes long, and only once."""
    case = honest()
    path.write_bytes(case.data)
    for way in WAYS:
        way(path, asked(case))


def asked(case: Case) -> tuple[str, ...]:
    """The topics that are asked for: those of which something must be given, half of the time without /raw."""
    truth = case.truth
    topics = {message.topic for message in truth.must or truth.mostly}
    if len(case.data) % 2 and len(topics) > 1:
        topics.discard("/raw")
    return tuple(sorted(topics)) or ("/force",)


def judged(truth: Truth, reading: Reading, key: Callable[[Message], Key]) -> Iterator[str]:
    """The faults of one reading."""

    def looked_at(messages: Iterable[Message]) -> list[Message]:
        return [message for message in messages if reading.topics is None or message.topic in reading.topics]

    must, mostly, held = looked_at(truth.must), looked_at(truth.mostly), looked_at(truth.held)
    if reading.refusal is not None:
        yield from _refused(reading.refusal, truth, bool(must or mostly))
        return
    left = _by_key(held + looked_at(truth.also), key)
    # Times are right to float64's resolution.
    near = 1e-9 + 1e-15 * max((abs(seconds) for _, seconds in reading.given), default=0.0) + 1e-15 * abs(reading.origin)
    wrong = [given for given in reading.given if not _take(left, *given, near)]
    if wrong and (truth.checked or not reading.says("unverified")):
        yield f"{len(wrong)} values that the file does not hold, the first {wrong[0]}"
    given = _by_key_of(reading)
    gone = [message for message in must if not _take(given, key(message), message.time / 1e9, near)]
    if gone:
        yield f"{len(gone)} of {len(must)} messages are not given that can be had, the first at {gone[0].time} ns"
    there = sum(_take(given, key(message), message.time / 1e9, near) for message in mostly)
    if there < _SHARE * len(mostly):
        yield f"{there} of {len(mostly)} messages are given of a chunk that is cut off"
    given = _by_key_of(reading)
    missing = [message for message in held if not _take(given, key(message), message.time / 1e9, near)]
    said = reading.lossy or reading.says("cannot be decoded")
    if missing and not said and not truth.silent:
        yield f"{len(missing)} messages are missing without a word, the first at {missing[0].time} ns"
    if truth.loss is True and not said and (reading.topics is None or not truth.passed_over):
        yield "a loss is not said"
    if truth.loss is False and reading.lossy:
        told = [finding.message for finding in reading.findings if finding.severity == "loss"]
        yield f"a loss is said where there is none: {told[0]}"
    if truth.unverified and reading.given and not reading.says("unverified"):
        yield "what no checksum covers is not marked as unverified"
    yield from _texts(str(finding) for finding in reading.findings)


def _refused(refusal: CdtoolError, truth: Truth, needed: bool) -> Iterator[str]:
    if needed and not truth.refusable:
        yield f"refused: {refusal.message[:200]}"
    if truth.loss is False and not truth.held and needed:
        yield f"refused although whole: {refusal.message[:200]}"
    yield from _texts([refusal.message, refusal.hint])


def _texts(texts: Iterable[str]) -> Iterator[str]:
    for text in texts:
        if len(text) > 5000:
            yield f"a message of {len(text)} characters: {text[:80]!r}"


def _by_key(messages: Iterable[Message], key: Callable[[Message], Key]) -> dict[Key, list[float]]:
    found: dict[Key, list[float]] = defaultdict(list)
    for message in messages:
        found[key(message)].append(message.time / 1e9)
    return found


def _by_key_of(reading: Reading) -> dict[Key, list[float]]:
    found: dict[Key, list[float]] = defaultdict(list)
    for key, seconds in reading.given:
        found[key].append(seconds)
    return found


def _take(left: dict[Key, list[float]], key: Key, seconds: float, near: float) -> bool:
    """Take one message out of those left; False where none is among them whose time is as near as that [s]."""
    times = left.get(key, [])
    for i, known in enumerate(times):
        if abs(known - seconds) <= near:
            del times[i]
            return True
    return False
