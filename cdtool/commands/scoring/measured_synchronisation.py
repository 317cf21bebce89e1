"""The load cell's synchronisation measured on the logs of a benchmark, as `[onset] synchronisation = "measured"` asks.

Latencies are not corrected: their resolution becomes coarser by what the load cell may be late or early.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from cdtool.base.errors import CdtoolError, ConfigurationError
from cdtool.base.findings import Finding
from cdtool.base.plain_text import counted
from cdtool.base.remote.remote_path import location
from cdtool.commands.judging.runs import named_on_load_side, runs_of
from cdtool.commands.judging.true_contacts import any_contacts
from cdtool.commands.scoring.benchmark_file import BenchmarkFile
from cdtool.execution.workers import Workers, in_order
from cdtool.recordings.log_section import LogSection
from cdtool.recordings.operations import RunCut
from cdtool.results.results import RecordingFinding

if TYPE_CHECKING:
    from cdtool.truth.synchronisation.latency import ChannelLatency


@dataclass(frozen=True)
class _Audited:
    """The latencies of a log's load cell, and what its times count from [s]."""

    latencies: tuple[ChannelLatency, ...] = ()
    origin: float = 0.0


@dataclass(frozen=True)
class _LogAudit:
    """Audits the load cell of one log in the contacts that the load cell itself shows."""

    setup: BenchmarkFile

    def __call__(self, work: tuple[str, Path]) -> list[_Audited]:
        from cdtool.truth.synchronisation.audit import audit

        group, path = work
        setup = self.setup
        cut = RunCut.of(setup.operations)
        try:
            runs = runs_of(path, setup.machine_file, cut).runs
        except CdtoolError:
            return []  # left out with its reason when it is scored
        audited = []
        for logged in runs:
            run = path if cut is None else location(logged.recording.source)
            try:
                whole = named_on_load_side(logged, run, setup.machine_file, setup.path.parent, None, setup.onset)
                section = setup.sections.get(path, LogSection())
                recording = section.of(whole)
                contacts = section.contacts_of(whole, any_contacts(whole, setup.rules_of(group)))
            except CdtoolError:
                continue
            own = [contact for contact in contacts if contact.found_by == "load cell"]
            found = audit(recording, setup.machine_file.machine, own) if own else ()
            audited.append(_Audited(tuple(item for item in found if item.channel == "force"), recording.origin))
        return audited


def with_synchronisation(
    setup: BenchmarkFile, workers: Workers | None = None
) -> tuple[BenchmarkFile, list[RecordingFinding]]:
    """Return the benchmark with the measured synchronisation, and the finding that says so; unchanged if it is stated.

    The synchronisation is the largest offset that the load cell may have in any contact: the measured one at the
    contact's time, plus half the width of its 95 % interval. Raises ConfigurationError if it is not assessable.
    """
    if not setup.measures_synchronisation:
        return setup, []
    from cdtool.commands.judging.synchronisation import latency_findings

    work = [(group, path) for group, item in setup.impacts.items() if not item.is_impact_free for path in item.logs]
    audits = in_order(_LogAudit(setup), work, len(work), workers, of_lost=_not_audited)
    audited = [item for log in audits for item in log]
    found = _of_all(audited)
    if found is None or not found.assessable:
        why = found.reason if found else f"none of {counted(len(work), 'log')} has a contact that its load cell shows"
        raise ConfigurationError(
            f"{setup.path}: onset.synchronisation: measured, but not assessable: {why}",
            "state how far the load cell's clock may be off: synchronisation_s = ...",
        )
    half = 0.5 * (found.offset.high - found.offset.low)
    times = [found.events[number].delay.time for number in found.used]
    # The interval need not be symmetric about the offset: it reaches both kinds of contacts.
    most = max(max(abs(found.offset.low), abs(found.offset.high)), *(abs(found.offset_at(t)) + half for t in times))
    (shown,) = latency_findings([found])
    fact = {"synchronisation": most, "shown": shown.sentence}
    finding = RecordingFinding.of(str(setup.path), Finding("measured_synchronisation", "force", fact))
    return replace(setup, synchronisation=most), [finding]


def _not_audited(*_: object) -> list[_Audited]:
    """Return the audit of a log that ended its workers: it is left out with the reason when it is scored."""
    return []


def _of_all(audited: Sequence[_Audited]) -> ChannelLatency | None:
    """Return the latency of the load cell over all logs; that of the only log that shows one."""
    from cdtool.commands.judging.synchronisation import pooled_latencies
    from cdtool.truth.synchronisation.latency import preferred

    known = [item for item in audited if any(latency.has_delays for latency in item.latencies)]
    logs, origins = [item.latencies for item in known], [item.origin for item in known]
    together = preferred(pooled_latencies(logs, origins)) or (preferred(logs[0]) if logs else ())
    unknown = preferred([latency for item in audited for latency in item.latencies])
    return next(iter((*together, *unknown)), None)
