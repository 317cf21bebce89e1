"""`cdtool schema`."""

from __future__ import annotations

from typing import Annotated

import typer

from cdtool.base.errors import UsageError, nearest
from cdtool.commands.console.completions import one_of

_KINDS = ("machine", "benchmark", "protocol")


def schema(
    kind: Annotated[
        str, typer.Argument(help="machine, benchmark or protocol.", metavar="KIND", autocompletion=one_of(_KINDS))
    ],
) -> None:
    """Print the JSON schema of a machine, benchmark or protocol file, by which editors complete and check it.

    Example: cdtool schema machine > machine.schema.json
    """
    if kind not in _KINDS:
        raise UsageError(f"unknown kind '{kind}'", nearest(kind, _KINDS))
    from cdtool.commands.console.json_schema import schema_text

    typer.echo(schema_text(kind), nl=False)
