"""Run as a program: read an honest file, then every bomb, and print what each took; `python -m ... FOLDER [NAME]`.

Memory is the process's, so that it needs one of its own.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path

from tests.formats.mcap_damage.bombs import bombs, honest
from tests.formats.mcap_damage.judge import judged
from tests.formats.mcap_damage.truth import Case
from tests.formats.mcap_damage.ways import WAYS, survey, wanted

# Far beyond what is allowed: a bomb that goes off ends this process and not the machine.
_MOST = 8 << 30
_STATUS, _RESET = Path("/proc/self/status"), Path("/proc/self/clear_refs")


def measurable() -> bool:
    """Linux tells a process's peak of memory, and forgets it when asked to."""
    return _STATUS.exists() and _RESET.exists()


def peak() -> int:
    """The most memory this process has held since `forget` [bytes]."""
    lines = _STATUS.read_text(encoding="ascii").splitlines()
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("VmHWM"))


def forget() -> None:
    """Let the peak begin anew."""
    _RESET.write_text("5", encoding="ascii")


def main(folder: Path, only: str = "") -> None:
    """One line of JSON a bomb and way: seconds of CPU, bytes over the honest file's, what is wrong with the reading."""
    resource.setrlimit(resource.RLIMIT_AS, (_MOST, _MOST))
    path = folder / "bomb.mcap"
    whole = honest()
    topics = tuple(sorted({message.topic for message in whole.truth.held}))
    path.write_bytes(whole.data)
    for way in (survey, wanted):
        way(path, topics)
    baseline = peak()
    for name, make in bombs().items():
        if only in name:
            for took in _taken(name, make, path, topics, baseline):
                print(json.dumps(took), flush=True)


def _taken(
    name: str, make: Callable[[], Case], path: Path, topics: tuple[str, ...], baseline: int
) -> list[dict[str, object]]:
    case = make()
    path.write_bytes(case.data)
    truth = case.truth
    del case
    found: list[dict[str, object]] = []
    for way in (survey, wanted):
        forget()
        start = time.process_time()
        reading = way(path, topics)
        seconds = time.process_time() - start
        faults = list(judged(truth, reading, WAYS[way]))
        found.append(
            {"bomb": f"{name}: {way.__name__}", "seconds": seconds, "bytes": peak() - baseline, "faults": faults}
        )
    return found


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:])
