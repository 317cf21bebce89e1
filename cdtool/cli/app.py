"""The app: one command a file, and the one place where a known error becomes one line and an exit status."""

from __future__ import annotations

import errno
import gc
import logging
import signal
import sys
import threading
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated

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
from cdtool.cli.study import study
from cdtool.errors import CdtoolError, ExitStatus

app = typer.Typer(
    name="cdtool",
    help="How fast, how surely and at which force does a machine notice that it has hit something?",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",  # in its default the help loses what stands in brackets, such as units
)
app.command("info")(info)
app.command("init")(init)
app.command("learn-signature")(learn_signature)
app.command("detect")(detect)
app.command("explain")(explain)
app.command("benchmark")(benchmark)
app.command("report")(report)
app.command("score")(score)
app.command("compare")(compare)
app.command("plan")(plan)
app.command("convert")(convert)
app.command("recover")(recover)
app.add_typer(signature, name="signature")
app.add_typer(simulate, name="simulate")
app.add_typer(study, name="study")
app.command("list")(list_known)


# As a shell counts it: 128 and the number of the signal that Ctrl-C sends.
_INTERRUPTED = 130
# What a service manager or a pipeline sends to end a command, and a terminal that is closed.
_ENDING = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))


def _show_version(wanted: bool) -> None:
    if wanted:
        from cdtool.version import __version__

        typer.echo(f"cdtool {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", help="Show the version and end.", callback=_show_version, is_eager=True)
    ] = False,
) -> None:
    """How fast, how surely and at which force does a machine notice that it has hit something?

    Exit status: 0 done, 1 a limit is broken, 2 wrong usage or nothing usable, 3 done but some data was left out,
    130 interrupted, 143 terminated.
    """


def _show_note(message: Warning | str, *_: object, **__: object) -> None:
    typer.echo(f"note: {message}", err=True)


@contextmanager
def _ending_as_if_interrupted() -> Iterator[None]:
    """Let SIGTERM and SIGHUP undo what is half written, as Ctrl-C does; the exit status is 128 and their number."""

    def end(number: int, _: object) -> None:
        signal.signal(number, signal.SIG_IGN)  # a second one must not stop the undoing
        raise SystemExit(128 + number)

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in _ENDING}
    for number in (number for number, handler in before.items() if handler == signal.SIG_DFL):
        signal.signal(number, end)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def main() -> None:
    """Run the app; a known error ends with one line on stderr and status 2."""
    with _ending_as_if_interrupted():
        _main()


def _main() -> None:
    # What imports make stays: searching it for garbage is a tenth of a short command.
    gc.set_threshold(50_000, 10, 10)
    warnings.showwarning = _show_note
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # its advice about its own cache is not the user's matter
    try:
        app()
    except CdtoolError as fault:
        from cdtool.cli.console import print_error

        print_error(fault)
        sys.exit(ExitStatus.UNUSABLE)
    except BrokenPipeError:
        sys.stderr.close()  # the reader of our output (a pager, head) has gone: nothing to tell
        sys.exit(ExitStatus.OK)
    except SystemExit as end:
        if end.code == _INTERRUPTED:
            typer.echo("interrupted", err=True)
        elif end.code in {128 + number for number in _ENDING}:
            typer.echo("terminated", err=True)
        # click ends with 1 where the reader has gone; here 1 means a broken limit.
        if isinstance(end.__context__, OSError) and end.__context__.errno == errno.EPIPE:
            sys.exit(ExitStatus.OK)
        raise
    except OSError as fault:
        from cdtool.cli.console import print_error

        where = f"{fault.filename}: " if fault.filename else ""
        print_error(CdtoolError(f"{where}{fault.strerror or fault}", "check path, permissions and space"))
        sys.exit(ExitStatus.UNUSABLE)
    except KeyboardInterrupt:
        typer.echo("interrupted", err=True)
        sys.exit(_INTERRUPTED)
    except Exception:
        # Python would end with 1, which means a broken limit to a pipeline.
        traceback.print_exc()
        sys.exit(ExitStatus.UNUSABLE)
