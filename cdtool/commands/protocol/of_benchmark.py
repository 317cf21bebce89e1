"""What `cdtool benchmark` makes of its section [protocol], or of a protocol file: the protocol among its outputs."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path

from cdtool.base.errors import UsageError
from cdtool.base.plain_text import plain
from cdtool.commands.protocol.assessment.protocol import Protocol
from cdtool.commands.protocol.protocol_file import ProtocolTable, has_protocol, read_protocol_file
from cdtool.commands.scoring.benchmark_result import BenchmarkResult
from cdtool.report.outputs import check_outputs, write_outputs
from cdtool.results.evaluated import Evaluated

ENDINGS = ("protocol.pdf", "protocol.html", "protokoll.pdf", "protokoll.html")
# The names of a report and of a figure, as the documentation gives them.
_OTHERS = ("report", "latency")


def protocol_names(targets: Sequence[Path], is_wanted: bool) -> tuple[list[Path], list[Path]]:
    """Return the targets that are test protocols, and the others.

    A name that ends like gate-7-protocol.pdf or Prüfprotokoll.html is one. If a protocol `is_wanted` and there is no
    such name, every PDF and HTML is one, except report.html and latency.pdf.
    """
    named = [target for target in targets if target.name.lower().endswith(ENDINGS)]
    if is_wanted and not named:
        pages = (target for target in targets if target.suffix.lower() in (".pdf", ".html"))
        named = [target for target in pages if target.stem.lower() not in _OTHERS]
    return named, [target for target in targets if target not in named]


class ProtocolOfBenchmark:
    """The protocol among the `outputs` of a benchmark; `reports` are the other outputs.

    `given` is the protocol file; None: [protocol] of the benchmark file. Raises UsageError for a protocol without a
    file, or a file without a protocol to write. With `force` a file that cdtool did not write is replaced.
    """

    table = ProtocolTable

    def __init__(self, benchmark: Path, given: Path | None, outputs: Sequence[Path], force: bool) -> None:
        self._force = force
        self._documents, self.reports = protocol_names(outputs, given is not None)
        if not self._documents:
            if given is not None:
                raise UsageError("-p: no output is the protocol", "add -o protocol.pdf or -o protocol.html")
            return
        if given is None and not has_protocol(benchmark):
            draft = f"cdtool protocol init {shlex.quote(plain(benchmark))} -o protocol.toml"
            raise UsageError(
                f"--output is {plain(self._documents[0])}, and {plain(benchmark)} has no [protocol]",
                f"draft one, {draft}, then -p protocol.toml",
            )
        self._file = read_protocol_file(benchmark if given is None else given)

    def check(self) -> None:
        """Raise UsageError for a document that cannot be written."""
        check_outputs(self._documents, force=self._force, subject="protocol")

    def verdict_of(self, done: BenchmarkResult, command: str) -> Evaluated:
        """Make the protocol of a finished benchmark, and return its evaluation with the verdict."""
        if not self._documents:
            return done.evaluated
        from cdtool.commands.protocol.document.document import protocol_statement
        from cdtool.commands.protocol.making import make_protocol

        self._made = make_protocol(self._file, done, command)
        return done.evaluated.with_protocol(*protocol_statement(self._made))

    def write(self, inputs: Sequence[Path]) -> list[str]:
        """Write the protocol, without replacing one of the inputs; return the lines to show."""
        if not self._documents:
            return []
        from cdtool.commands.protocol.document.document import protocol_document

        report, every = protocol_document(self._made), (*inputs, self._file.path)
        write_outputs(report, self._documents, force=self._force, inputs=every, subject="protocol")
        return written_lines(self._made, self._documents)


def written_lines(made: Protocol, written: Sequence[Path]) -> list[str]:
    """Return the files of a protocol, and the next step."""
    step = {
        "pass": "check entries, curves and limits against the standard, print and sign",
        "fail": "settle why it fails and what is incomplete, and repeat the test",
        "incomplete": "settle what is incomplete, and write the protocol again",
    }[made.verdict.outcome]
    return [*(f"written: {plain(path)}" for path in written), f"next: {step}"]
