"""Run a command line in this process, as a shell would see it."""

from __future__ import annotations

import contextlib
import io
import sys
from dataclasses import dataclass
from unittest import mock

from cdtool.commands.app import main

# A signature of fewer runs than usual.
FEW = "--set=signature.force=true"


@dataclass(frozen=True)
class Outcome:
    status: int
    out: str
    err: str


def one_line(text: str) -> str:
    """Return a text without line ends and frames of the help, independent of the terminal's width."""
    return " ".join(text.replace("│", " ").split())


def cdtool(*arguments: object) -> Outcome:
    """Run `cdtool ARGUMENTS`; return exit status, standard output, standard error."""
    out, err = io.StringIO(), io.StringIO()
    status = 0
    argv = ["cdtool", *map(str, arguments)]
    with mock.patch.object(sys, "argv", argv), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main()
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else int(end.code is not None)
    return Outcome(int(status), out.getvalue(), err.getvalue())


def keys(**values: object) -> tuple[str, ...]:
    """Return --set for each key that has no dot."""
    return tuple(word for key, value in values.items() for word in ("--set", f"{key}={value}"))
