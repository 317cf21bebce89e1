"""Options shared by several commands, as one dataclass: typer shows its fields, the command receives one object."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import wraps
from typing import Any, get_type_hints


def with_options(command: Callable[..., None]) -> Callable[..., None]:
    """Return the command with its parameter `options`, a dataclass, replaced by the fields of that dataclass.

    Each field's annotation defines its option; typer reads it like the annotation of a parameter.
    """
    hints = get_type_hints(command, include_extras=True)
    group = hints["options"]
    group_hints = get_type_hints(group, include_extras=True)
    shared = {
        name: item.replace(kind=inspect.Parameter.POSITIONAL_OR_KEYWORD, annotation=group_hints[name])
        for name, item in inspect.signature(group).parameters.items()
    }
    parameters: list[inspect.Parameter] = []
    for name, item in inspect.signature(command).parameters.items():
        parameters += shared.values() if name == "options" else [item.replace(annotation=hints[name])]

    @wraps(command)
    def with_fields(**given: Any) -> None:
        command(options=group(**{name: given.pop(name) for name in shared}), **given)

    # typer reads the signature; older releases also read the annotations.
    vars(with_fields)["__signature__"] = inspect.Signature(parameters, return_annotation=None)
    with_fields.__annotations__ = {item.name: item.annotation for item in parameters}
    return with_fields
