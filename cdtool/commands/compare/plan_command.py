"""`cdtool plan`."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer

from cdtool.base.errors import UsageError
from cdtool.commands.console import completions
from cdtool.commands.console.console import plain, print_json
from cdtool.commands.console.options import JsonOption, listed
from cdtool.commands.console.place import Place, location


def plan(
    difference_ms: Annotated[
        float | None, typer.Option("--difference-ms", help="Difference of mean latencies to detect [ms].")
    ] = None,
    std_ms: Annotated[
        float | None, typer.Option("--std-ms", help="Estimated standard deviation of the paired differences [ms].")
    ] = None,
    source: Annotated[
        Place | None,
        typer.Option(
            "--from",
            parser=location,
            help="Take the standard deviation from results.json of an earlier test.",
            autocompletion=completions.files(".json", ".parquet"),
        ),
    ] = None,
    detectors: Annotated[
        str,
        typer.Option(
            "--detectors",
            help="With --from: the two detectors to compare, as feekf,gm; unpaired: one or two.",
            autocompletion=completions.detector_list,
        ),
    ] = "",
    group: Annotated[str, typer.Option("--group", help="With --from: the group of impacts.")] = "",
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
    allowed: Annotated[
        int | None, typer.Option("--allowed", min=0, help="Misses or false alarms to allow in the test. Default: one.")
    ] = None,
    level: Annotated[float, typer.Option("--level", help="Probability of a wrong conclusion.")] = 0.05,
    as_json: JsonOption = False,
) -> None:
    """Calculate how many impacts and impact-free operations a test needs.

    Example: cdtool plan --difference-ms 5 --std-ms 8 --missed-at-most 5% --false-alarms-at-most 1/1000op
    """
    from cdtool.commands.compare.planning import measured_std
    from cdtool.commands.compare.planning import plan as run

    if source is not None and std_ms is not None:
        raise UsageError("--std-ms and --from cannot be combined", "give one of them")
    without = difference_ms is None
    idle = {
        "--std-ms": std_ms is not None and without,
        "--from": source is not None and without,
        "--unpaired": unpaired and without,
        "--detectors": bool(detectors) and source is None,
        "--group": bool(group) and source is None,
        "--allowed": allowed is not None and not missed_at_most and not false_alarms_at_most,
    }
    for option, useless in idle.items():
        if useless:
            raise UsageError(f"{option} has no effect", _GOES_WITH[option])
    std = measured_std(source, listed(detectors), group, unpaired=unpaired) if source else std_ms
    found = run(
        difference_ms=difference_ms,
        std_ms=std,
        unpaired=unpaired,
        power=power,
        missed_at_most=missed_at_most,
        false_alarms_at_most=false_alarms_at_most,
        allowed=allowed,
        significance=level,
    )
    if as_json:
        print_json(asdict(found))
        return
    for answer in found.answers:
        typer.echo(plain(answer.words))


_GOES_WITH = {
    **dict.fromkeys(("--std-ms", "--from", "--unpaired"), "use it with --difference-ms"),
    **dict.fromkeys(("--detectors", "--group"), "use it with --from"),
    "--allowed": "use it with --missed-at-most or --false-alarms-at-most",
}
