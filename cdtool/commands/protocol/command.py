"""`cdtool protocol init|check|write`."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cdtool.base.errors import UsageError
from cdtool.base.exit_status import Fact, statuses_words
from cdtool.base.plain_text import LISTED, counted
from cdtool.commands.console.console import leave, plain, print_json, print_line, print_next, progress, say
from cdtool.commands.console.options import ForceOption, JsonOption
from cdtool.commands.console.place import Place, location

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from cdtool.commands.protocol.assessment.protocol import Protocol
    from cdtool.commands.protocol.checking import CheckedProtocol

protocol = typer.Typer(
    help="Draft and check the file of a test protocol, and write it; cdtool benchmark -p adds latencies.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
_FACTS: Mapping[str, tuple[Fact, ...]] = {"fail": (Fact.FORCE_VIOLATED,), "incomplete": (Fact.INCOMPLETE,), "pass": ()}


@protocol.callback()
def _protocol() -> None:
    """Draft and check the file of a test protocol, and write it; cdtool benchmark -p adds latencies."""


@protocol.command(
    "init", short_help="Draft a protocol file from a benchmark file.", epilog=statuses_words("protocol init")
)
def init(
    benchmark: Annotated[
        Place | None,
        typer.Argument(
            parser=location, help="Benchmark file; without one, an empty plan is drafted.", metavar="[BENCHMARK]"
        ),
    ] = None,
    output: Annotated[
        Place, typer.Option("--output", "-o", parser=location, help="Protocol file to write (.toml).")
    ] = Path("protocol.toml"),
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing file.")] = False,
) -> None:
    """Draft a protocol file: measuring points from the benchmark's groups, sample rate and speed from its recordings.

    Example: cdtool protocol init sample_logs/gate/benchmark.toml -o protocol.toml
    """
    from cdtool.commands.protocol.drafting import draft_protocol

    drafted = draft_protocol(benchmark, output, force=force)
    typer.echo(drafted.text)
    print_line(f"written: {plain(drafted.path)}, with {counted(drafted.to_fill_in, 'value')} marked FILL IN")
    print_next("cdtool", "protocol", "check", drafted.path)


@protocol.command(
    "check", short_help="List what is missing in a protocol file.", epilog=statuses_words("protocol check")
)
def check(
    file: Annotated[
        Place,
        typer.Argument(parser=location, help="Protocol file, or a benchmark file with [protocol].", metavar="FILE"),
    ],
    as_json: JsonOption = False,
) -> None:
    """List what is missing or contradictory in a protocol file, without reading a recording.

    Exits with status 4 if anything is.

    Example: cdtool protocol check sample_logs/gate/protocol.toml
    """
    from cdtool.commands.protocol.checking import check_protocol

    checked = check_protocol(file)
    reasons = checked.verdict.reasons
    if as_json:
        items = [
            {"kind": item.kind, "due": item.due, **{key: _plain(value) for key, value in item.values.items()}}
            for item in reasons
        ]
        print_json({"complete": not reasons, "incomplete": items, "recordings": checked.recordings})
    else:
        _show_checked(checked)
    leave(facts=[Fact.INCOMPLETE] if reasons else [])


@protocol.command(
    "write", short_help="Write the protocol without running detectors.", epilog=statuses_words("protocol write")
)
def write(
    file: Annotated[
        Place,
        typer.Argument(parser=location, help="Protocol file, or a benchmark file with [protocol].", metavar="FILE"),
    ],
    output: Annotated[
        list[Place] | None,
        typer.Option("--output", "-o", parser=location, help="Output, repeatable: .pdf or .html."),
    ] = None,
    force: ForceOption = False,
) -> None:
    """Write the protocol without running detectors, for recordings of a force rig that have only a force.

    cdtool benchmark -p writes the same with their latencies. Exits with 1 if it fails and 4 if it is incomplete.

    Example: cdtool protocol write sample_logs/gate/protocol.toml -o protocol.html
    """
    from cdtool.commands.protocol.document.document import protocol_document
    from cdtool.commands.protocol.making import protocol as make
    from cdtool.report.outputs import check_outputs, write_outputs

    if not output:
        raise UsageError("--output is missing", "add -o protocol.pdf or -o protocol.html")
    check_outputs(output, force=force, subject="protocol")
    names = [word for path in output for word in ("-o", path.name)]
    with progress("writing the protocol", pulses=True):
        made = make(file, command=shlex.join(["cdtool", "protocol", "write", str(file), *names]))
        write_outputs(protocol_document(made), output, force=force, inputs=(file,), subject="protocol")
    show_protocol(made, output)
    leave(facts=_FACTS[made.verdict.outcome])


def _show_checked(checked: CheckedProtocol) -> None:
    from cdtool.commands.protocol.assessment.reasons import ProtocolVerdict
    from cdtool.commands.protocol.document.words import words_of

    file, words = checked.file, words_of("en")
    done = not checked.verdict.reasons
    say("protocol file: complete" if done else "protocol file: incomplete", tone="good" if done else "unknown")
    for name, count in checked.recordings.items():
        print_line(f"{plain(name)}: {counted(count, 'recording')}")
    for due, title in (("before_test", "before the test"), ("test_day", "on the day of the test")):
        part = ProtocolVerdict(tuple(item for item in checked.verdict.reasons if item.due == due))
        sentences = [*words.reasons(part, "fail"), *words.reasons(part, "incomplete")]
        if sentences:
            print_line(f"missing {title}:")
        for sentence in sentences:
            say(f"- {sentence}", indent="  ")
    for profile in {point.profile for point in file.plan.points if point.profile}:
        if not file.profiles[profile].checked:
            say(f"note: {profile}: {file.profiles[profile].warning}; the protocol states this")
    folder = file.path.parent
    benchmark = file.benchmark or folder / "benchmark.toml"
    own = [] if benchmark == file.path else ["-p", file.path]
    command = ["benchmark", benchmark, *own] if checked.has_detectors else ["protocol", "write", file.path]
    print_next("cdtool", *command, "-o", "protocol.pdf", first="next" if done else "then")


def show_protocol(made: Protocol, written: Sequence[Path]) -> None:
    """Print the verdict of a protocol, the first of its reasons, its files, and the next step."""
    from cdtool.commands.protocol.document.document import protocol_statement
    from cdtool.commands.protocol.of_benchmark import written_lines

    outcome, headline, *sentences = protocol_statement(made)
    say(headline, tone={"pass": "good", "fail": "bad"}.get(outcome, "unknown"))
    for sentence in sentences[:LISTED]:
        say(f"- {sentence}", indent="  ")
    if len(sentences) > LISTED:
        print_line(f"  and {len(sentences) - LISTED} more, all in the protocol")
    for line in written_lines(made, written):
        print_line(line)


def _plain(value: object) -> object:
    return value if isinstance(value, int | float | str) else str(value)
