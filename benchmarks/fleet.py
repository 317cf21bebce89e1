"""A fleet on the local disk: what many recordings cost, what a second run costs, and what a killed run loses.

Every run is a new process on short recordings of a gate (7 s at 250 Hz, CSV, five detectors).

python benchmarks/fleet.py scale [RECORDINGS]   # 20,000: memory, time per recording, workers, cost of the store; 1 h
python benchmarks/fleet.py again [RECORDINGS]   # 20,000: nothing changed, one recording added, one gain changed
python benchmarks/fleet.py kills [KILLS]        # 50 kills of the first process or of a worker
"""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from statistics import median
from time import sleep

from timing import Spread, main, ratio, table, verdict

from cdtool.commands.simulate.gate_recordings import simulate_gate

RECORDINGS, FEW = 20_000, 1_000
KILLS, KILLED_RECORDINGS = 50, 240
ROUNDS = 5
SEED = 1
# What is simulated; each scored one is copied with another last digit, since recordings of equal content are refused.
SIMULATED = {"free": 14, "holdout": 66, "stiff": 67, "soft": 67}
SCORED = ("holdout", "stiff", "soft")
# Of the rows at 1 kHz, each of so many is kept: 250 Hz, 7 s, 115 kB of CSV.
EVERY = 4
AT_MOST_MORE_MIB, AT_MOST_SLOWER, AT_LEAST_FASTER, AT_MOST_STORE = 200.0, 1.10, 1.8, 1.05
AT_MOST_AGAIN = 0.15

_RUN = "import sys; from fleet import child; child(*sys.argv[1:])"


def write_fleet(folder: Path, recordings: int) -> Path:
    """Write a benchmark file with so many scored recordings and 14 impact-free ones; return the benchmark file."""
    with tempfile.TemporaryDirectory() as name:
        base = Path(name)
        simulate_gate(base, SIMULATED, SEED, file_format="csv")
        folder.mkdir(parents=True, exist_ok=True)
        for file in ("benchmark.toml", "machine.toml"):
            (folder / file).write_bytes((base / file).read_bytes())
        for group in ("free", *SCORED):
            (folder / group).mkdir(exist_ok=True)
        for path in sorted((base / "free").glob("*.csv")):
            (folder / "free" / path.name).write_text(_thinned(path)[0], encoding="utf-8", newline="\n")
        texts = [(path.parent.name, path.stem, *_thinned(path)) for path in _in_turn(base)]
        for number in range(recordings):
            group, stem, text, end = texts[number % len(texts)]
            mark = f"{number // len(texts):04d}"
            log = folder / group / f"{mark}-{stem}.csv"
            log.write_text(f"{text[:end]}{mark}{text[end:]}", encoding="utf-8", newline="\n")
    return folder / "benchmark.toml"


def _in_turn(base: Path) -> Iterator[Path]:
    """Yield the scored recordings, the groups in turn."""
    every = [sorted((base / group).glob("*.csv")) for group in SCORED]
    for number in range(max(map(len, every))):
        yield from (logs[number] for logs in every if number < len(logs))


def _thinned(path: Path) -> tuple[str, int]:
    """Return a recording at a lower rate, and where further digits of a cell of its first row go."""
    head, *rows = path.read_text(encoding="utf-8").splitlines(keepends=True)
    text = "".join((head, *rows[::EVERY]))
    return text, text.index("\n", len(head))


def child(file: str, store: str, jobs: str, output: str, *flags: str) -> None:
    """Run a benchmark; print the number done after each recording, and at the end what it took."""
    import hashlib
    import resource
    from time import perf_counter, process_time

    begin = perf_counter()
    from cdtool.commands.scoring.benchmark import benchmark
    from cdtool.execution.store.store import Store
    from cdtool.execution.workers import Workers
    from cdtool.report.outputs import write_outputs
    from cdtool.report.writers.base import Report

    times: list[float] = []

    def progress(done: int, _: int) -> None:
        if done == 1:  # of the runs that are learned from, then of the logs that are scored
            times.clear()
        times.append(perf_counter())
        if "report" in flags:
            os.write(1, b"%d\n" % done)

    use = Store(Path(store)) if store else None
    done = benchmark(file, workers=Workers(int(jobs), progress=progress), store=use)
    write_outputs(Report(done.evaluated, done.traces), [Path(output)], force=True, inputs=done.inputs)
    of = resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN)
    skip = min(len(times) - 1, 40)  # workers start with the first recordings
    figures = {
        "clock": perf_counter() - begin,
        "each": (times[-1] - times[skip]) / (len(times) - 1 - skip) if len(times) > 1 else 0.0,
        "cpu": process_time() + of[1].ru_utime + of[1].ru_stime,
        "own": process_time(),
        "peak": of[0].ru_maxrss / 1024.0,
        "computed": done.stored.computed if done.stored else len(times),
        "recordings": len(done.results.recordings),
        "sha256": hashlib.sha256(Path(output).read_bytes()).hexdigest(),
    }
    print(json.dumps(figures))


def _command(file: Path, store: Path | None, jobs: int, output: Path, *flags: str) -> list[str]:
    return [sys.executable, "-c", _RUN, str(file), str(store or ""), str(jobs), str(output), *flags]


def _environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}


def _run(file: Path, store: Path | None = None, jobs: int = 1, *flags: str) -> dict[str, float]:
    done = subprocess.run(
        _command(file, store, jobs, file.parent / "results.json", *flags),
        check=True,
        capture_output=True,
        text=True,
        cwd=Path(__file__).parent,
        env=_environment(),
    )
    figures: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    print(f"  {file.parent.name}, {jobs} jobs{', store' if store else ''}: {done.stdout.splitlines()[-1]}", flush=True)
    return figures


def scale(recordings: int) -> bool:
    with tempfile.TemporaryDirectory() as name:
        few, many = write_fleet(Path(name) / "few", FEW), write_fleet(Path(name) / "many", recordings)
        _run(few)  # compiles, and reads the files once
        small, large = [_run(few) for _ in range(ROUNDS)], _run(many)
        pairs = []
        for number in range(ROUNDS):
            store = Path(name) / f"store{number}"
            pairs.append((_run(few), _run(few, store), _run(few, None, 2)))
            shutil.rmtree(store)
        two = _run(many, None, 2)
        stored = _run(many, Path(name) / "store")
    grown = large["peak"] - median(item["peak"] for item in small)
    each = Spread.of([large["each"] / item["each"] for item in small])
    store_cost = ratio([item[1]["cpu"] for item in pairs], [item[0]["cpu"] for item in pairs])
    workers_cost = ratio([item[2]["cpu"] for item in pairs], [item[0]["cpu"] for item in pairs])
    faster = Spread.of([item[0]["each"] / item[2]["each"] for item in pairs])
    share = ratio([item[2]["own"] for item in pairs], [item[2]["cpu"] for item in pairs])
    print(f"CPU time of the first process with two workers / of all three: {share}")
    rows = [
        (f"{FEW}", median(1e3 * item["each"] for item in small), median(item["peak"] for item in small)),
        (f"{recordings}", 1e3 * large["each"], large["peak"]),
        (f"{recordings}, 2 workers", 1e3 * two["each"], two["peak"]),
        (f"{recordings}, store", 1e3 * stored["each"], stored["peak"]),
    ]
    table(("recordings", "clock ms each", "peak MiB"), [(n, f"{a:.2f}", f"{b:.0f}") for n, a, b in rows])
    print(f"CPU time with two workers / one, without a store: {workers_cost}")
    print(f"two workers on {recordings}, one after the other: {large['each'] / two['each']:.2f} times as fast")
    return all(
        [
            verdict("first process, MiB more", Spread.of([grown]), AT_MOST_MORE_MIB, at_most=True),
            verdict("time per recording, many / few", each, AT_MOST_SLOWER, at_most=True),
            verdict(f"two workers on {FEW}, times as fast", faster, AT_LEAST_FASTER),
            verdict("CPU time with a store / without", store_cost, AT_MOST_STORE, at_most=True),
            verdict(
                "first process with a store, MiB more",
                Spread.of([stored["peak"] - median(item["peak"] for item in small)]),
                AT_MOST_MORE_MIB,
                at_most=True,
            ),
        ]
    )


def again(recordings: int) -> bool:
    with tempfile.TemporaryDirectory() as name:
        file = write_fleet(Path(name) / "fleet", recordings)
        store = Path(name) / "store"
        _run(file)
        first = _run(file, store)
        second = [_run(file, store) for _ in range(ROUNDS)]
        log = file.parent / "stiff" / "added.csv"
        text = (file.parent / "stiff" / "0000-01.csv").read_text(encoding="utf-8")
        log.write_text(text.replace("\n", "9\n", 2).replace("9\n", "\n", 1), encoding="utf-8", newline="\n")
        added = _run(file, store)
        plain = _run(file)
        with (file.parent / "machine.toml").open("a", encoding="utf-8") as machine:
            machine.write("\n[detectors.momentum]\nbandwidth = 17.0\n")
        changed = _run(file, store)
        other = _run(file)
    same = all(item["sha256"] == first["sha256"] for item in second)
    same = same and added["sha256"] == plain["sha256"] and changed["sha256"] == other["sha256"]
    print(f"one recording added: {added['computed']:.0f} computed; one gain changed: {changed['computed']:.0f}")
    print(f"the same bytes in every run: {same}")
    shares = Spread.of([item["clock"] / first["clock"] for item in second])
    held = verdict("second run / first", shares, AT_MOST_AGAIN, at_most=True)
    return held and same and added["computed"] == 1 and changed["computed"] == recordings + 1


def kills(number: int) -> bool:
    """Kill the first process or a worker at a random moment, and resume; the bytes must be those of a quiet run."""
    chance = random.Random(SEED)
    failures: list[str] = []
    most_lost = 0
    with tempfile.TemporaryDirectory() as name:
        file = write_fleet(Path(name) / "fleet", KILLED_RECORDINGS)
        quiet = _run(file, None, 2)
        for kill in range(number):
            store = Path(name) / f"store{kill}"
            kills_worker = bool(chance.getrandbits(1))
            after = chance.randrange(0, KILLED_RECORDINGS - 1)
            gathered, result = _killed(file, store, after, worker=kills_worker)
            if result is None:
                result = _run(file, store, 2)
                most_lost = max(most_lost, int(result["computed"]) - (KILLED_RECORDINGS - gathered))
                if result["computed"] > KILLED_RECORDINGS - gathered:
                    failures.append(f"kill {kill}: {result['computed']} computed, {gathered} were done")
            if result["sha256"] != quiet["sha256"]:
                failures.append(f"kill {kill} ({'worker' if kills_worker else 'first process'}): other results")
            shutil.rmtree(store)
            what = "a worker" if kills_worker else "the first process"
            print(f"kill {kill + 1} of {number}: {what} after {gathered}", flush=True)
    print("\n".join(failures) or f"{number} kills: the same bytes each time, no finished recording computed again")
    return not failures


def _killed(file: Path, store: Path, after: int, *, worker: bool) -> tuple[int, dict[str, float] | None]:
    """Return how many recordings were reported as done, and the figures of the run if it went on."""
    process = subprocess.Popen(
        _command(file, store, 2, file.parent / "results.json", "report"),
        stdout=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parent,
        env=_environment(),
    )
    assert process.stdout is not None
    gathered, last, hit = 0, "", False
    for line in process.stdout:
        last = line
        if not line.strip().isdigit():
            continue
        gathered = int(line)
        if not hit and gathered > after:
            hit = True
            _kill(process.pid, worker=worker)
    process.wait()
    return gathered, None if process.returncode else json.loads(last)


def _kill(first: int, *, worker: bool) -> None:
    if not worker:
        os.kill(first, signal.SIGKILL)
        return
    with suppress(OSError, ProcessLookupError):
        children = Path(f"/proc/{first}/task/{first}/children").read_text().split()
        if children:
            os.kill(int(random.choice(children)), signal.SIGKILL)
            sleep(0.01)


PARTS: dict[str, tuple[Callable[[int], bool], int]] = {
    "scale": (scale, RECORDINGS),
    "again": (again, RECORDINGS),
    "kills": (kills, KILLS),
}

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", choices=PARTS)
    parser.add_argument("number", type=int, nargs="?")
    chosen = parser.parse_args()
    measure, usual = PARTS[chosen.part]
    main(f"fleet: {chosen.part}", lambda: measure(chosen.number or usual))
