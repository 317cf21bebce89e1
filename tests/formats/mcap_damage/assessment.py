"""Compare what was read from a case with its truth, and describe each fault."""

from __future__ import annotations

import traceback
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from cdtool.base.errors import CdtoolError
from tests.formats.mcap_damage.bombs import without_bomb
from tests.formats.mcap_damage.readers import READERS, Key, Reading
from tests.formats.mcap_damage.truth import Case, Message, Truth
from tests.time_bounds import bounded

# Far more processor time [s] than any of these small files needs.
LONGEST = 20.0
_SHARE = 0.95


def faults(case: Case, path: Path) -> list[str]:
    """Return the faults of all readers for a case, whose file is written to `path`."""
    path.write_bytes(case.data)
    topics = requested_topics(case)
    problems = []
    for reader, key in READERS.items():
        try:
            with bounded(LONGEST):
                reading = reader(path, topics)
        except Exception:  # any traceback is a fault
            trace = traceback.format_exc().strip().splitlines()
            problems.append(f"{reader.__name__}: traceback: {trace[-3].strip()}: {trace[-1]}")
            continue
        problems += [f"{reader.__name__}: {fault}" for fault in faults_in(case.truth, reading, key)]
    return problems


def warm_up(path: Path) -> None:
    """Read a file with every reader once, so that all kernels are compiled."""
    case = without_bomb()
    path.write_bytes(case.data)
    for reader in READERS:
        reader(path, requested_topics(case))


def requested_topics(case: Case) -> tuple[str, ...]:
    """Return the topics with required messages, in half of the cases without /raw."""
    truth = case.truth
    topics = {message.topic for message in truth.required or truth.mostly_required}
    if len(case.data) % 2 and len(topics) > 1:
        topics.discard("/raw")
    return tuple(sorted(topics)) or ("/force",)


def faults_in(truth: Truth, reading: Reading, key: Callable[[Message], Key]) -> Iterator[str]:
    """Yield the faults of one reading."""

    def requested(messages: Iterable[Message]) -> list[Message]:
        return [message for message in messages if reading.topics is None or message.topic in reading.topics]

    required, mostly_required = requested(truth.required), requested(truth.mostly_required)
    written = requested(truth.written)
    if reading.refusal is not None:
        yield from _refused(reading.refusal, truth, bool(required or mostly_required))
        return
    left = _by_key(written + requested(truth.optional), key)
    # Times are exact to float64's resolution.
    near = (
        1e-9 + 1e-15 * max((abs(seconds) for _, seconds in reading.messages), default=0.0) + 1e-15 * abs(reading.origin)
    )
    wrong = [message for message in reading.messages if not _remove(left, *message, near)]
    if wrong and (truth.checked or not reading.has("unverified")):
        yield f"{len(wrong)} values that the file does not contain, the first {wrong[0]}"
    read = _by_key_of(reading)
    gone = [message for message in required if not _remove(read, key(message), message.time / 1e9, near)]
    if gone:
        yield f"{len(gone)} of {len(required)} readable messages were not read, the first at {gone[0].time} ns"
    count = sum(_remove(read, key(message), message.time / 1e9, near) for message in mostly_required)
    if count < _SHARE * len(mostly_required):
        yield f"only {count} of {len(mostly_required)} messages of a cut chunk were read"
    read = _by_key_of(reading)
    missing = [message for message in written if not _remove(read, key(message), message.time / 1e9, near)]
    is_reported = reading.lossy or reading.has("undecodable_messages")
    if missing and not is_reported and not truth.undetectable:
        yield f"{len(missing)} messages are missing without a finding, the first at {missing[0].time} ns"
    if truth.loss is True and not is_reported and (reading.topics is None or not truth.skippable):
        yield "a loss is not reported"
    if truth.loss is False and reading.lossy:
        losses = [finding.message for finding in reading.findings if finding.severity == "loss"]
        yield f"a loss is reported although there is no loss: {losses[0]}"
    if truth.unverified and reading.messages and not reading.has("unverified"):
        yield "messages without a checksum are not reported as unverified"
    yield from _texts(str(finding) for finding in reading.findings)


def _refused(refusal: CdtoolError, truth: Truth, needed: bool) -> Iterator[str]:
    if needed and not truth.refusable:
        yield f"refused: {refusal.message[:200]}"
    if truth.loss is False and not truth.written and needed:
        yield f"refused although undamaged: {refusal.message[:200]}"
    yield from _texts([refusal.message, refusal.hint])


def _texts(texts: Iterable[str]) -> Iterator[str]:
    for text in texts:
        if len(text) > 5000:
            yield f"a message of {len(text)} characters: {text[:80]!r}"


def _by_key(messages: Iterable[Message], key: Callable[[Message], Key]) -> dict[Key, list[float]]:
    times: dict[Key, list[float]] = defaultdict(list)
    for message in messages:
        times[key(message)].append(message.time / 1e9)
    return times


def _by_key_of(reading: Reading) -> dict[Key, list[float]]:
    times: dict[Key, list[float]] = defaultdict(list)
    for key, seconds in reading.messages:
        times[key].append(seconds)
    return times


def _remove(left: dict[Key, list[float]], key: Key, seconds: float, near: float) -> bool:
    """Remove one message from those left; return False if none of them has a time within `near` [s]."""
    times = left.get(key, [])
    for i, known in enumerate(times):
        if abs(known - seconds) <= near:
            del times[i]
            return True
    return False
