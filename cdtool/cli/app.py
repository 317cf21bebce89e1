"""The app: one command a file, and the one place where a known error becomes one line and an exit status."""

from __future__ import annotations

import gc
import logging
import signal
import sys
import threading
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated, Any

import typer

from cdtool.cli.benchmark import benchmark
from cdtool.cli.compare import compare
from cdtool.cli.convert import convert
from cdtool.cli.detect import detect
from cdtool.cli.explain import explain
from cdtool.cli.info import info
from cdtool.cli.init import init
from cdtool.cli.learn_signature import learn_signature
from cdtool.cli.list_known import list_known
from cdtool.cli.plan import plan
from cdtool.cli.recover import recover
from cdtool.cli.report import report
from cdtool.cli.score import score
from cdtool.cli.signature import signature
from cdtool.cli.simulate import simulate
from cdtool.cli.streams import lost_output, open_standard_streams
from cdtool.cli.study import study
from cdtool.errors import CdtoolError, UsageError
from cdtool.exit_status import ORDER, STATUSES, ExitStatus, Fact, status_of, statuses_words
from cdtool.plain_text import one_line

app = typer.Typer(
    name="cdtool",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",  # in its default the help loses what stands in brackets, such as units
)
for command in (
    info,
    init,
    learn_signature,
    detect,
    explain,
    benchmark,
    report,
    score,
    compare,
    plan,
    convert,
    recover,
    list_known,
):
    name = "list" if command is list_known else command.__name__.replace("_", "-")
    app.command(name, epilog=statuses_words(name))(command)
app.add_typer(signature, name="signature")
app.add_typer(simulate, name="simulate")
app.add_typer(study, name="study")

_WHAT_FOR = "How fast, how surely and at which force does a machine notice that it has hit something?"
# What a service manager or a pipeline sends to end a command, and a terminal that is closed.
_ENDING = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))


def _show_version(wanted: bool) -> None:
    if wanted:
        from cdtool.version import __version__

        typer.echo(f"cdtool {__version__}")
        raise typer.Exit


def _help() -> str:
    """What cdtool is for, and the table of exit statuses."""
    rows = "\n".join(f"- {int(status)}: {meaning}" for status, meaning in STATUSES.items())
    return f"{_WHAT_FOR}\n\nExit status:\n\n{rows}\n\n{ORDER}"


@app.callback(help=_help())
def _options(
    version: Annotated[
        bool, typer.Option("--version", help="Show the version and end.", callback=_show_version, is_eager=True)
    ] = False,
) -> None:
    """Options of cdtool itself."""


def _show_note(message: Warning | str, *_: object, **__: object) -> None:
    typer.echo(one_line(f"note: {message}"), err=True)


# What click raises for a wrong option or argument; typer brings a click of its own, or the one that is installed.
_CLICK_ERROR = typer.BadParameter.__mro__[2]


def _print_usage_error(fault: Any) -> None:
    from cdtool.cli.console import print_error

    if type(fault).__name__ == "NoArgsIsHelpError":  # making it has printed the help
        return
    command = fault.ctx.command_path if getattr(fault, "ctx", None) else "cdtool"
    message = " ".join(fault.format_message().split()).rstrip(".")
    print_error(UsageError(message, f"see {command} --help"))


@contextmanager
def _ending_as_if_interrupted() -> Iterator[list[int]]:
    """Let SIGTERM and SIGHUP undo what is half written, as Ctrl-C does; the exit status is 128 and their number.

    Yields the signals that have come.
    """
    came: list[int] = []

    def end(number: int, _: object) -> None:
        signal.signal(number, signal.SIG_IGN)  # a second one must not stop the undoing
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


def main() -> None:
    """Run the app; a known error ends with one line on stderr and status 2."""
    with _ending_as_if_interrupted() as came:
        _main(came)


def _run_app(came: list[int]) -> Any:
    """The app's status; a signal ends it as such, whatever a library has made of it that was being imported."""
    try:
        return app(standalone_mode=False)
    except (KeyboardInterrupt, SystemExit, typer.Abort):
        raise
    except BaseException:
        if came:
            raise _end_of(came[0]) from None
        raise


def _main(came: list[int]) -> None:  # noqa: C901  one branch for each way to end
    open_standard_streams()
    # What imports make stays: searching it for garbage is a tenth of a short command.
    gc.set_threshold(50_000, 10, 10)
    warnings.showwarning = _show_note
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # its advice about its own cache is not the user's matter
    try:
        status = _run_app(came)
        if fault := lost_output():
            raise CdtoolError(f"standard output: {fault.strerror}", "what was printed is incomplete: check the space")
        status = status if isinstance(status, int) else status_of([])
        sys.exit(status)
    except CdtoolError as fault:
        from cdtool.cli.console import print_error

        print_error(fault)
        sys.exit(status_of([Fact.WRONG_USAGE]))
    except SystemExit as end:
        if end.code == ExitStatus.INTERRUPTED:
            typer.echo("interrupted", err=True)
        elif end.code in {128 + number for number in _ENDING}:
            typer.echo("terminated", err=True)
        raise
    except OSError as fault:
        from cdtool.cli.console import print_error

        where = f"{fault.filename}: " if fault.filename else ""
        print_error(CdtoolError(f"{where}{fault.strerror or fault}", "check path, permissions and space"))
        sys.exit(status_of([Fact.NOTHING_USABLE]))
    except MemoryError:
        from cdtool.cli.console import print_error

        print_error(CdtoolError("not enough memory", "fewer or shorter logs, a smaller --jobs, or more memory"))
        sys.exit(status_of([Fact.NOTHING_USABLE]))
    except (KeyboardInterrupt, typer.Abort):
        typer.echo("interrupted", err=True)
        sys.exit(status_of([Fact.INTERRUPTED]))
    except Exception as fault:
        if isinstance(fault, _CLICK_ERROR):
            _print_usage_error(fault)
            sys.exit(status_of([Fact.WRONG_USAGE]))
        # Python would end with 1, which means a violated limit to a pipeline.
        traceback.print_exc()
        sys.exit(status_of([Fact.INTERNAL_ERROR]))
