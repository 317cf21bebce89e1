"""Errors of click for a wrong command, option or value, in the words of cdtool: click's own change with the version."""

from __future__ import annotations

import re
from difflib import get_close_matches
from typing import Any

from cdtool.base.errors import UsageError, nearest

_QUOTED = re.compile("'([^']*)'")
# What pydantic says of a wrong value, which it does not repeat; its first part is enough.
_EXPECTED = re.compile(r"Input should be ([^,]*)")


def usage_error(fault: Any) -> UsageError:
    """Return what is wrong with a command line, with the nearest known word or where the help is."""
    context: Any = getattr(fault, "ctx", None)
    see = f"see {context.command_path if context else 'the command with'} --help"
    message = " ".join(fault.message.split()).rstrip(".")
    quoted = _QUOTED.findall(message)
    if message.startswith("No such command"):
        return UsageError(f"unknown command '{quoted[0]}'", nearest(quoted[0], context.command.commands))
    if message.startswith("Got unexpected extra argument"):
        return UsageError(f"unexpected argument {message.rpartition(' (')[2].rstrip(')')}", see)
    if hasattr(fault, "possibilities"):
        known = {name.lstrip("-"): name for item in context.command.params for name in item.opts}
        close = [known[name] for name in get_close_matches(fault.option_name.lstrip("-"), known, n=2)]
        meant = f"did you mean {' or '.join(close)}? " if close else ""
        return UsageError(f"unknown option {fault.option_name}", f"{meant}{see}")
    if not getattr(fault, "param", None):
        return UsageError(message, see)
    name = _QUOTED.findall(fault.format_message())[0]
    if type(fault).__name__ == "MissingParameter":
        return UsageError(f"{name} is missing", see)
    if "is not one of" in message:
        return UsageError(f"{name} is '{quoted[0]}'", nearest(quoted[0], quoted[1:]))
    if (expected := _EXPECTED.match(message)) and hasattr(fault.__cause__, "errors"):
        return UsageError(f"{name} is '{fault.__cause__.errors()[0]['input']}', not {expected[1]}", see)
    return UsageError(f"{name}: {message}", see)
