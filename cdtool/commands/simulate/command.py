"""`cdtool simulate`."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Literal

import typer

from cdtool.base.errors import UsageError
from cdtool.base.plain_text import counted
from cdtool.commands.console.console import plain, print_line, print_next, progress
from cdtool.commands.console.options import keys_option
from cdtool.commands.console.place import Place, location


def simulate(
    machine: Annotated[
        Literal["gate", "arm"], typer.Argument(help="The thesis's sliding gate or robot arm.", metavar="MACHINE")
    ],
    output: Annotated[Place, typer.Option("--output", "-o", parser=location, help="Output folder.")],
    seed: Annotated[int, typer.Option("--seed", min=0, help="Same seed, same bytes.")] = 1,
    trial: Annotated[
        Literal["1", "2"] | None, typer.Option("--trial", help="Arm: impact on the arm (1) or the forearm (2).")
    ] = None,
    settings: Annotated[
        list[str] | None,
        keys_option(
            "How many logs, and what differs, repeatable: stiff=4, friction=1.2, format=mcap; docs/simulators.md.",
            "cdtool.commands.simulate.simulation_table:SimulationTable",
        ),
    ] = None,
) -> None:
    """Simulate recordings with known contacts, machine.toml and benchmark.toml: the gate of chapter 5, the arm of 6.

    Example: cdtool simulate gate --set free=14 --set stiff=10 --seed 1 -o gate
    """
    from cdtool.commands.judging.settings_table import given_settings, read_settings
    from cdtool.commands.simulate.arm_recordings import simulate_arm
    from cdtool.commands.simulate.gate_recordings import simulate_gate
    from cdtool.commands.simulate.recording_folder import without_benchmark
    from cdtool.commands.simulate.simulation_table import SimulationTable

    if trial and machine == "gate":
        raise UsageError("--trial is only for the arm", "omit it")
    table, place = read_settings(SimulationTable, given_settings(settings or ()))
    place.finish()
    simulate_machine = simulate_gate if machine == "gate" else partial(simulate_arm, trial=2 if trial == "2" else 1)
    counts = table.counts
    with progress("simulating") as advance:
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
    print_line(f"{counted(written, 'recording')}, {files} and contacts.csv written to {plain(output)}")
    if why_not:
        print_line(f"no benchmark.toml: {why_not}")
    else:
        print_next("cdtool", "benchmark", output / "benchmark.toml", "-o", output / "report")
