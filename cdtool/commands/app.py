"""The command line: the table of commands, and how an error becomes one line and an exit status."""

from __future__ import annotations

import atexit
import gc
import logging
import os
import signal
import sys
import threading
import traceback
import warnings
from collections import UserDict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from cdtool.base.errors import CdtoolError
from cdtool.base.exit_status import ExitStatus, Fact, help_epilog, status_of, statuses_words
from cdtool.base.plain_text import counted, one_line
from cdtool.base.remote import session
from cdtool.commands.console.streams import Pace, lost_output, open_standard_streams

_GROUPS: Mapping[str, Mapping[str, tuple[str, str]]] = {
    "start": {
        "info": ("cdtool.commands.info.command:info", "Show a log's channels, units, rates and warnings."),
        "init": ("cdtool.commands.init.command:init", "Draft a machine and a benchmark file from logs."),
        "benchmark": ("cdtool.commands.benchmark.command:benchmark", "Score detectors: latency, misses, false alarms."),
        "report": ("cdtool.commands.report.command:report", "Write the reports of a benchmark again."),
        "protocol": ("cdtool.commands.protocol.command:protocol", "Draft, check and write a test protocol."),
    },
    "understand": {
        "detect": ("cdtool.commands.detect.command:detect", "Run one detector over logs and show its alarms."),
        "explain": ("cdtool.commands.explain.command:explain", "Explain alarms, and why a contact was missed."),
    },
    "CI": {
        "compare": ("cdtool.commands.compare.command:compare", "Compare two builds: real changes from noise."),
        "score": ("cdtool.commands.score.command:score", "Score the triggers of any controller or program."),
        "plan": ("cdtool.commands.compare.plan_command:plan", "Calculate how many recordings a test needs."),
    },
    "model": {
        "learn-signature": ("cdtool.commands.learn.command:learn_signature", "Learn a detector's limits from runs."),
        "signature": ("cdtool.commands.signature.command:signature", "Show, check or update a signature."),
        "identify": ("cdtool.commands.identify.command:identify", "Identify the model of an axis or robot."),
        "inject": ("cdtool.commands.inject.command:inject", "Put simulated contacts into logs, and map them."),
        "tune": ("cdtool.commands.tune.command:tune", "Tune detectors at a false-alarm budget."),
        "simulate": ("cdtool.commands.simulate.command:simulate", "Write simulated logs with known contacts."),
        "study": ("cdtool.commands.study.command:study", "Study an impact before the machine is built."),
    },
    "files": {
        "convert": ("cdtool.commands.convert.command:convert", "Convert a log, or recover a damaged one."),
        "list": ("cdtool.commands.list_known.command:list_known", "List detectors, thresholds, machines, formats."),
        "schema": ("cdtool.commands.schema.command:schema", "Print the JSON schema of a file for editors."),
    },
}
COMMANDS: Mapping[str, str] = {name: place for group in _GROUPS.values() for name, (place, _) in group.items()}
"""Every command in the order of the help: the function that defines its options, or the app with its subcommands."""

# The logger on which `cdtool.base.kernels` reports that it compiles.
_LOGGER = logging.getLogger("cdtool.base.kernels")

# The help is plain text: rich drops text in brackets, such as units, and frames make it twice as long.
_LOOK: Any = {"pretty_exceptions_enable": False, "rich_markup_mode": None}


class _Commands(UserDict[str, Any]):
    """The commands by name, each imported on first use: running one does not load the options of the others."""

    def __getitem__(self, name: str) -> Any:
        if isinstance(self.data[name], str):
            self.data[name] = _load_command(name, self.data[name])
        return self.data[name]


def _load_command(name: str, place: str) -> Any:
    module, _, attribute = place.partition(":")
    command = getattr(import_module(module), attribute)
    group = typer.Typer(add_completion=False, **_LOOK)
    group.callback()(lambda: None)  # without a callback typer does not create a group for a single command
    if isinstance(command, typer.Typer):
        group.add_typer(command, name=name)
    else:
        group.command(name, epilog=statuses_words(name))(command)
    return typer.main.get_group(group).commands[name]


class _CommandGroup(TyperGroup):
    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.commands = _Commands(COMMANDS)

    def format_commands(self, _: Any, formatter: Any) -> None:
        """Write a line for each command, by groups; no command is imported for it."""
        formatter.write_paragraph()
        for group, commands in _GROUPS.items():
            for place, (name, (_, summary)) in enumerate(commands.items()):
                formatter.write(f"{group if place == 0 else '':<12}{name:<17}{summary}\n")


app = typer.Typer(
    name="cdtool",
    cls=_CommandGroup,
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    **_LOOK,
)

_WHAT_FOR = "Measure when, how surely and at what force a machine detects a collision."
# Sent by a service manager or pipeline to end a command, and by a terminal that is closed.
_ENDING = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))


def _show_version(wanted: bool) -> None:
    if wanted:
        from cdtool.base.version import __version__

        typer.echo(f"cdtool {__version__}")
        raise typer.Exit


@app.callback(help=_WHAT_FOR, epilog=help_epilog())
def _options(
    version: Annotated[
        bool, typer.Option("--version", help="Show the version and exit.", callback=_show_version, is_eager=True)
    ] = False,
) -> None:
    """Options of cdtool itself."""


def _show_note(message: Warning | str, category: type[Warning], *_: object, **__: object) -> None:
    """Show a warning that is meant for the user; those of NumPy and other libraries are about our code."""
    if category is UserWarning:
        from cdtool.commands.console.console import print_line

        print_line(one_line(f"note: {message}"), err=True)


# Base class of click's errors for a wrong option or argument. typer uses its own copy of click or the installed one.
_CLICK_ERROR = typer.BadParameter.__mro__[2]


def _print_usage_error(fault: Any) -> None:
    from cdtool.commands.console.console import print_error
    from cdtool.commands.console.wrong_words import usage_error

    if type(fault).__name__ != "NoArgsIsHelpError":  # its constructor has printed the help
        print_error(usage_error(fault))


@contextmanager
def _ending_as_if_interrupted() -> Iterator[list[int]]:
    """Let SIGTERM and SIGHUP undo half-written output as Ctrl-C does; the exit status is 128 plus the signal's number.

    Yields the list of signals received so far.
    """
    came: list[int] = []

    def end(number: int, _: object) -> None:
        signal.signal(number, signal.SIG_IGN)  # a second signal must not interrupt the clean-up
        came.append(number)
        raise _end_of(number)

    if threading.current_thread() is not threading.main_thread():
        yield came
        return
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, *_ENDING)}
    usual = (signal.SIG_DFL, signal.default_int_handler)
    for number in (number for number, handler in before.items() if handler in usual):
        signal.signal(number, end)
    try:
        yield came
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _end_of(number: int) -> BaseException:
    return KeyboardInterrupt() if number == signal.SIGINT else SystemExit(128 + number)


@contextmanager
def showing_first_use() -> Iterator[None]:
    """Show in the block that kernels are compiled."""
    before, handler = _LOGGER.level, Pace()
    _LOGGER.addHandler(handler)
    _LOGGER.setLevel(logging.INFO)
    try:
        yield
    finally:
        _LOGGER.setLevel(before)
        _LOGGER.removeHandler(handler)


def main() -> None:
    """Run the app. A known error prints one line to stderr and exits with status 2."""
    session.begin()
    with _ending_as_if_interrupted() as came:
        try:
            _main(came)
        finally:
            size, requests = session.amount_read()
            if requests:
                typer.echo(f"read from URLs: {size / 2**20:.1f} MiB in {counted(requests, 'request')}", err=True)


def _run_app(came: list[int]) -> Any:
    """Run the app and return its status. A signal ends it even if a library replaced the exception during an import."""
    try:
        with showing_first_use():
            return app(standalone_mode=False)
    except (KeyboardInterrupt, SystemExit, typer.Abort):
        raise
    except BaseException:
        if came:
            raise _end_of(came[0]) from None
        raise


def _main(came: list[int]) -> None:
    open_standard_streams()
    # NumPy starts a thread of linear algebra per core: a sixth of the CPU time of a short command. The matrices here
    # are small, and jobs are processes.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # Imported modules stay alive: collecting garbage among them takes a tenth of a short command's time, and as much
    # again when Python ends.
    gc.set_threshold(50_000, 10, 10)
    atexit.register(gc.freeze)
    warnings.showwarning = _show_note
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # hides its advice about its own cache
    try:
        status = _run_app(came)
        if fault := lost_output():
            raise CdtoolError(f"standard output: {fault.strerror}", "the output is incomplete; free some disk space")
        status = status if isinstance(status, int) else status_of([])
        sys.exit(status)
    except SystemExit as end:
        if end.code == ExitStatus.INTERRUPTED:
            typer.echo("interrupted", err=True)
        elif end.code in {128 + number for number in _ENDING}:
            typer.echo("terminated", err=True)
        raise
    except (KeyboardInterrupt, typer.Abort):
        typer.echo("interrupted", err=True)
        sys.exit(status_of([Fact.INTERRUPTED]))
    except Exception as fault:
        sys.exit(status_of([_show_fault(fault)]))


def _show_fault(fault: Exception) -> Fact:
    """Print why a command failed, in one line if the cause is known, and return the fact that sets its exit status."""
    if isinstance(fault, _CLICK_ERROR):
        _print_usage_error(fault)
        return Fact.WRONG_USAGE
    known = _known_fault(fault)
    if known is None:
        # Python would exit with 1, which means a violated limit to a pipeline.
        traceback.print_exception(fault)
        return Fact.INTERNAL_ERROR
    from cdtool.commands.console.console import print_error

    error, fact = known
    print_error(error)
    return fact


def _known_fault(fault: Exception) -> tuple[CdtoolError, Fact] | None:
    if isinstance(fault, CdtoolError):
        return fault, Fact.WRONG_USAGE
    if isinstance(fault, OSError):
        where = f"{fault.filename}: " if fault.filename else ""
        error = CdtoolError(f"{where}{fault.strerror or fault}", "check path, permissions and disk space")
        return error, Fact.NOTHING_USABLE
    if isinstance(fault, MemoryError):
        return CdtoolError(
            "not enough memory", "use fewer or shorter logs, a smaller --jobs, or more memory"
        ), Fact.NOTHING_USABLE
    return None
