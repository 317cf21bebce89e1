"""A folder of simulated recordings with machine.toml and contacts.csv.

Where the runs make one also benchmark.toml.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, Literal, Protocol, TypeVar

from cdtool.base.errors import UsageError
from cdtool.base.files.writing import replaced_folder
from cdtool.formats.written_files import require_free_folder
from cdtool.thresholds.signature import ENOUGH_RUNS, LEAST_RUNS

IMPACT_OF: Mapping[str, Literal["none", "stiff", "soft"]] = {
    "free": "none",
    "holdout": "none",
    "stiff": "stiff",
    "soft": "soft",
}
GROUPS = tuple(IMPACT_OF)
# MCAP stamps count from a fixed instant, so that the same seed gives the same bytes.
EPOCH_NS = 1_700_000_000_000_000_000

# With the format "mixed" this many of each group are MCAP files.
_MIXED_MCAP = 2


class Run(Protocol):
    """What the folder uses of a run."""

    @property
    def contact_start(self) -> float | None:
        """Instant of first touch [s]; None without one."""
        ...


AnyRun = TypeVar("AnyRun", bound=Run)


@dataclass(frozen=True)
class Bench(Generic[AnyRun]):
    """One simulated machine on its test bench: how a run is simulated and logged, and the content of the TOML files.

    `simulate` takes a group of GROUPS and a number from 1. In benchmark.toml the lines `settings` come before the
    groups and `rules` after them.
    """

    simulate: Callable[[str, int], AnyRun]
    write_csv: Callable[[Path, AnyRun], None]
    write_mcap: Callable[[Path, AnyRun], None]
    machine_toml: str
    settings: tuple[str, ...]
    rules: tuple[str, ...]


def without_references(machine_toml: str) -> str:
    """Return a machine file that maps no reference channel."""
    return "".join(line for line in machine_toml.splitlines(keepends=True) if not line.startswith("reference_"))


def without_benchmark(counts: Mapping[str, int]) -> str:
    """Return why recordings of so many runs of each group make no benchmark; empty where they do."""
    if counts.get("free", 0) < LEAST_RUNS:
        return f"a benchmark learns from {LEAST_RUNS} runs or more: --set free=10"
    if not any(counts.get(group, 0) for group in GROUPS if group != "free"):
        return "a benchmark needs logs to score: set holdout, stiff or soft"
    return ""


def write_folder(
    folder: Path,
    counts: Mapping[str, int],
    file_format: str,
    bench: Bench[AnyRun],
    progress: Callable[[int, int], None] | None = None,
) -> int:
    """Write `counts` recordings of each group of GROUPS below `folder`, all or nothing; returns how many.

    There is no benchmark.toml where these recordings make no benchmark (`without_benchmark`).

    `file_format`: csv, mcap, or mixed (the first two of each group as MCAP, the others as CSV). Raises UsageError
    where nothing is to be written or the folder is not empty.
    """
    planned = list(_plan(counts, file_format))
    if not planned:
        raise UsageError("no recording is requested", "give a number above 0 for free, holdout, stiff or soft")
    require_free_folder(folder)
    with replaced_folder(folder) as part:
        _write_all(part, planned, bench, progress)
    return len(planned)


def _write_all(
    folder: Path, planned: list[_Planned], bench: Bench[AnyRun], progress: Callable[[int, int], None] | None
) -> None:
    contacts = []
    for done, item in enumerate(planned, 1):
        run = bench.simulate(item.group, item.number)
        path = folder / item.group / f"{item.name}{item.suffix}"
        path.parent.mkdir(parents=True, exist_ok=True)
        (bench.write_mcap if item.suffix == ".mcap" else bench.write_csv)(path, run)
        if run.contact_start is not None:
            contacts.append((f"{item.group}/{path.name}", f"{run.contact_start:.6f}", item.group))
        if progress:
            progress(done, len(planned))
    (folder / "machine.toml").write_text(bench.machine_toml, encoding="utf-8", newline="\n")
    if not without_benchmark({group: sum(item.group == group for item in planned) for group in GROUPS}):
        (folder / "benchmark.toml").write_text(_benchmark_toml(planned, bench), encoding="utf-8", newline="\n")
    with (folder / "contacts.csv").open("w", encoding="utf-8", newline="") as stream:
        csv.writer(stream, lineterminator="\n").writerows([("recording", "true_contact_s", "kind"), *contacts])


@dataclass(frozen=True)
class _Planned:
    group: str
    number: int
    name: str
    suffix: str


def _plan(counts: Mapping[str, int], file_format: str) -> Iterator[_Planned]:
    for group in GROUPS:
        count = counts.get(group, 0)
        width = max(2, len(str(count)))
        for number in range(1, count + 1):
            as_mcap = file_format == "mcap" or (file_format == "mixed" and number <= _MIXED_MCAP)
            yield _Planned(group, number, f"{number:0{width}d}", ".mcap" if as_mcap else ".csv")


def _benchmark_toml(planned: list[_Planned], bench: Bench[AnyRun]) -> str:
    def logs(group: str) -> str:
        suffixes = sorted({item.suffix for item in planned if item.group == group})
        return ", ".join(f'"{group}/*{suffix}"' for suffix in suffixes)

    titles = {
        "free": "[learn]",
        "holdout": "[holdout]                       # impact-free, never learned from: false alarms",
    }
    lines = list(bench.settings)
    for group in GROUPS:
        if any(item.group == group for item in planned):
            lines += ["", titles.get(group, f"[impacts.{group}]"), f"logs = [{logs(group)}]"]
    few = sum(item.group == "free" for item in planned) < ENOUGH_RUNS
    return "\n".join([*lines, "", *(_forced(bench.rules) if few else bench.rules), ""])


def _forced(rules: Sequence[str]) -> list[str]:
    """Rules by which a signature is learned from few runs."""
    force = f"force = true                    # fewer than {ENOUGH_RUNS} runs to learn from"
    at = next((i for i, line in enumerate(rules, 1) if line.startswith("[signature]")), 0)
    return [*rules[:at], force, *rules[at:]] if at else [*rules, "", "[signature]", force]
