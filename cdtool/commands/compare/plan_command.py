"""`cdtool plan`."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer

from cdtool.base.errors import UsageError
from cdtool.commands.console import completions
from cdtool.commands.console.console import plain, print_json, print_line
from cdtool.commands.console.options import JsonOption, listed
from cdtool.commands.console.place import location


def plan(
    difference_ms: Annotated[
        float | None, typer.Option("--difference-ms", help="Difference of mean latencies to detect [ms].")
    ] = None,
    std_ms: Annotated[
        str | None,
        typer.Option(
            "--std-ms",
            help="Standard deviation of the paired differences [ms]; or results.json of an earlier test.",
        ),
    ] = None,
    detectors: Annotated[
        str,
        typer.Option(
            "--detectors",
            help="Of results.json: the detectors to compare, as feekf,gm; unpaired: one or two.",
            autocompletion=completions.detector_list,
        ),
    ] = "",
    group: Annotated[str, typer.Option("--group", help="Of results.json: the group of impacts.")] = "",
    unpaired: Annotated[
        bool, typer.Option("--unpaired", help="Two sets of impacts; the standard deviation is that within a set.")
    ] = False,
    power: Annotated[float, typer.Option("--power", help="Probability of detecting a difference of that size.")] = 0.8,
    missed_at_most: Annotated[
        str, typer.Option("--missed-at-most", help="Upper bound of the missed share to show, as 5%.")
    ] = "",
    false_alarms_at_most: Annotated[
        str,
        typer.Option(
            "--false-alarms-at-most", help="Upper bound of the false-alarm rate to show, as 1/1000op or 0.1/h."
        ),
    ] = "",
    level: Annotated[float, typer.Option("--level", help="Probability of a wrong conclusion.")] = 0.05,
    as_json: JsonOption = False,
) -> None:
    """Calculate how many impacts and impact-free operations a test needs.

    Example: cdtool plan --difference-ms 5 --std-ms 8 --missed-at-most 5% --false-alarms-at-most 1/1000op
    """
    from cdtool.commands.compare.planning import measured_std
    from cdtool.commands.compare.planning import plan as run

    number = _number(std_ms)
    source = std_ms if number is None else None
    without = difference_ms is None
    idle = {
        "--std-ms": std_ms is not None and without,
        "--unpaired": unpaired and without,
        "--detectors": bool(detectors) and source is None,
        "--group": bool(group) and source is None,
    }
    for option, useless in idle.items():
        if useless:
            raise UsageError(f"{option} has no effect", _GOES_WITH[option])
    std = measured_std(location(source), listed(detectors), group, unpaired=unpaired) if source else number
    found = run(
        difference_ms=difference_ms,
        std_ms=std,
        unpaired=unpaired,
        power=power,
        missed_at_most=missed_at_most,
        false_alarms_at_most=false_alarms_at_most,
        significance=level,
    )
    if as_json:
        print_json(asdict(found))
        return
    for answer in found.answers:
        print_line(plain(answer.words))


def _number(text: str | None) -> float | None:
    """Return the number that a text is; None for the name of a file."""
    try:
        return None if text is None else float(text)
    except ValueError:
        return None


_GOES_WITH = {
    **dict.fromkeys(("--std-ms", "--unpaired"), "use it with --difference-ms"),
    **dict.fromkeys(("--detectors", "--group"), "use it with --std-ms results.json"),
}
