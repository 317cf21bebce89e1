"""Read an undamaged file, then every bomb, and print the time and memory of each; `python -m ... FOLDER [NAME]`.

It runs as a program because memory is measured per process.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path

from tests.formats.mcap_damage.assessment import faults_in
from tests.formats.mcap_damage.bombs import bombs, without_bomb
from tests.formats.mcap_damage.readers import READERS, survey, wanted
from tests.formats.mcap_damage.truth import Case

# A limit far above the allowed memory: a bomb that is decompressed ends this process and does not stop the computer.
_MOST = 8 << 30
_STATUS, _RESET = Path("/proc/self/status"), Path("/proc/self/clear_refs")


def measurable() -> bool:
    """Return whether the system reports the peak memory of a process and can reset it, as Linux does."""
    return _STATUS.exists() and _RESET.exists()


def peak() -> int:
    """Return the peak memory of this process since `reset_peak` [bytes]."""
    lines = _STATUS.read_text(encoding="ascii").splitlines()
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("VmHWM"))


def reset_peak() -> None:
    """Reset the peak memory of this process."""
    _RESET.write_text("5", encoding="ascii")


def main(folder: Path, only: str = "") -> None:
    """Print one line of JSON per bomb and reader: CPU time [s], memory above the undamaged file's [bytes], faults."""
    resource.setrlimit(resource.RLIMIT_AS, (_MOST, _MOST))
    path = folder / "bomb.mcap"
    undamaged = without_bomb()
    topics = tuple(sorted({message.topic for message in undamaged.truth.written}))
    path.write_bytes(undamaged.data)
    for reader in (survey, wanted):
        reader(path, topics)
    baseline = peak()
    for name, make in bombs().items():
        if only in name:
            for measured in _measure(name, make, path, topics, baseline):
                print(json.dumps(measured), flush=True)


def _measure(
    name: str, make: Callable[[], Case], path: Path, topics: tuple[str, ...], baseline: int
) -> list[dict[str, object]]:
    case = make()
    path.write_bytes(case.data)
    truth = case.truth
    del case
    measured: list[dict[str, object]] = []
    for reader in (survey, wanted):
        reset_peak()
        start = time.process_time()
        reading = reader(path, topics)
        seconds = time.process_time() - start
        faults = list(faults_in(truth, reading, READERS[reader]))
        measured.append(
            {"bomb": f"{name}: {reader.__name__}", "seconds": seconds, "bytes": peak() - baseline, "faults": faults}
        )
    return measured


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:])
