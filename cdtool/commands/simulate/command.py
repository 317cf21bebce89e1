"""`cdtool simulate`."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Literal

import typer

from cdtool.base.errors import UsageError
from cdtool.base.plain_text import counted
from cdtool.commands.console.console import plain, progress
from cdtool.commands.console.options import QuietOption, keys_option
from cdtool.commands.console.place import Place, location

# Most logs per group: more numbered files in one folder become unwieldy.
_MOST = 100_000


def simulate(
    machine: Annotated[
        Literal["gate", "arm"], typer.Argument(help="The thesis's sliding gate or robot arm.", metavar="MACHINE")
    ],
    output: Annotated[Place, typer.Option("--output", "-o", parser=location, help="Output folder.")],
    free: Annotated[int, typer.Option("--free", min=0, max=_MOST, help="Impact-free runs to learn from.")] = 14,
    holdout: Annotated[int, typer.Option("--holdout", min=0, max=_MOST, help="Impact-free runs to score only.")] = 40,
    stiff: Annotated[int, typer.Option("--stiff", min=0, max=_MOST, help="Impacts on the bare load cell.")] = 30,
    soft: Annotated[int, typer.Option("--soft", min=0, max=_MOST, help="Impacts with a rubber bumper.")] = 30,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Same seed, same bytes.")] = 1,
    trial: Annotated[
        Literal["1", "2"] | None, typer.Option("--trial", help="Arm: impact on the arm (1) or the forearm (2).")
    ] = None,
    settings: Annotated[
        list[str] | None,
        keys_option(
            "What differs, repeatable, as friction=1.2 or format=mcap; docs/simulators.md.",
            "cdtool.commands.simulate.simulation_table:SimulationTable",
        ),
    ] = None,
    quiet: QuietOption = False,
) -> None:
    """Simulate recordings with known contacts, machine.toml and benchmark.toml: the gate of chapter 5, the arm of 6.

    Example: cdtool simulate gate --free 14 --holdout 40 --stiff 30 --soft 30 --seed 1 -o gate
    """
    from cdtool.commands.judging.settings_table import read_settings
    from cdtool.commands.simulate.arm_recordings import simulate_arm
    from cdtool.commands.simulate.gate_recordings import simulate_gate
    from cdtool.commands.simulate.recording_folder import without_benchmark
    from cdtool.commands.simulate.simulation_table import SimulationTable

    if trial and machine == "gate":
        raise UsageError("--trial is only for the arm", "omit it")
    table = read_settings(SimulationTable, settings or ())
    simulate_machine = simulate_gate if machine == "gate" else partial(simulate_arm, trial=2 if trial == "2" else 1)
    counts = {"free": free, "holdout": holdout, "stiff": stiff, "soft": soft}
    with progress("simulating", quiet=quiet) as advance:
        written = simulate_machine(
            output,
            counts,
            seed,
            file_format=table.format,
            progress=advance,
            references=table.reference,
            changed=table.changed,
        )
    why_not = without_benchmark(counts)
    files = "machine.toml" if why_not else "machine.toml, benchmark.toml"
    typer.echo(f"{counted(written, 'recording')}, {files} and contacts.csv written to {plain(output)}")
    if why_not:
        typer.echo(f"no benchmark.toml: {why_not}")
