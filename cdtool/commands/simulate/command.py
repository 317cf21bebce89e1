"""`cdtool simulate`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from cdtool.base.errors import UsageError, nearest
from cdtool.base.exit_status import statuses_words
from cdtool.base.plain_text import counted
from cdtool.commands.console import completions
from cdtool.commands.console.console import plain, print_json, progress
from cdtool.commands.console.options import JsonOption, QuietOption
from cdtool.commands.console.place import Place, location

simulate = typer.Typer(
    help="Write simulated recordings with known contacts.", no_args_is_help=True, rich_markup_mode=None
)

_FORMATS = ("csv", "mcap", "mixed")
# Most logs per group: more numbered files in one folder become unwieldy.
_MOST = 100_000


@simulate.callback()
def _simulate() -> None:
    """Write simulated recordings with known contacts."""


FreeOption = Annotated[int, typer.Option("--free", min=0, max=_MOST, help="Impact-free runs to learn from.")]
HoldoutOption = Annotated[int, typer.Option("--holdout", min=0, max=_MOST, help="Impact-free runs for scoring only.")]
StiffOption = Annotated[int, typer.Option("--stiff", min=0, max=_MOST, help="Impacts on the bare load cell.")]
SoftOption = Annotated[int, typer.Option("--soft", min=0, max=_MOST, help="Impacts with a rubber bumper.")]
SeedOption = Annotated[int, typer.Option("--seed", min=0, help="Same seed, same bytes.")]
FormatOption = Annotated[
    str,
    typer.Option(
        "--format",
        help="csv, mcap, or mixed (two logs per group as MCAP).",
        autocompletion=completions.one_of(_FORMATS),
    ),
]
ReferenceOption = Annotated[
    bool, typer.Option("--reference/--no-reference", help="Also log the references: speed, and torque or position.")
]
FrictionOption = Annotated[float, typer.Option("--friction", help="Factor of the load's friction: 1.2 is 20 % more.")]
SpeedOption = Annotated[float, typer.Option("--speed", help="Factor of the nominal speed.")]
MassOption = Annotated[float, typer.Option("--mass", help="Factor of the load's mass.")]
CurrentOffsetOption = Annotated[float, typer.Option("--current-offset", help="Offset of the motor current [A].")]
AccelerationOffsetOption = Annotated[
    float, typer.Option("--acceleration-offset", help="Further offset of the accelerometers [m/s2].")
]
WarmingOption = Annotated[
    float, typer.Option("--warming", help="Warming of the motor [K]: more current for the same torque.")
]
OutputOption = Annotated[Place, typer.Option("--output", "-o", parser=location, help="Output folder.")]


@simulate.command("gate", epilog=statuses_words("simulate gate"))
def gate(
    output: OutputOption,
    free: FreeOption = 14,
    holdout: HoldoutOption = 40,
    stiff: StiffOption = 30,
    soft: SoftOption = 30,
    seed: SeedOption = 1,
    file_format: FormatOption = "csv",
    reference: ReferenceOption = True,
    friction: FrictionOption = 1.0,
    speed: SpeedOption = 1.0,
    mass: MassOption = 1.0,
    current_offset: CurrentOffsetOption = 0.0,
    acceleration_offset: AccelerationOffsetOption = 0.0,
    warming: WarmingOption = 0.0,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Simulate the heavy sliding gate of chapter 5 of the thesis: recordings, machine.toml and benchmark.toml.

    Example: cdtool simulate gate --free 14 --holdout 40 --stiff 30 --soft 30 --seed 1 -o gate
    """
    _check_format(file_format)
    from cdtool.commands.simulate.changed_machine import ChangedMachine
    from cdtool.commands.simulate.gate_recordings import simulate_gate

    counts = {"free": free, "holdout": holdout, "stiff": stiff, "soft": soft}
    changed = ChangedMachine(friction, speed, mass, current_offset, acceleration_offset, warming)
    with progress("simulating", quiet=quiet) as advance:
        written = simulate_gate(
            output, counts, seed, file_format=file_format, progress=advance, references=reference, changed=changed
        )
    _report(output, written, counts, seed, as_json)


@simulate.command("arm", epilog=statuses_words("simulate arm"))
def arm(
    output: OutputOption,
    trial: Annotated[int, typer.Option("--trial", min=1, max=2, help="1: impact on the arm; 2: on the forearm.")] = 1,
    free: FreeOption = 14,
    holdout: HoldoutOption = 40,
    stiff: StiffOption = 30,
    soft: SoftOption = 30,
    seed: SeedOption = 1,
    file_format: FormatOption = "csv",
    reference: ReferenceOption = True,
    friction: FrictionOption = 1.0,
    speed: SpeedOption = 1.0,
    mass: MassOption = 1.0,
    current_offset: CurrentOffsetOption = 0.0,
    acceleration_offset: AccelerationOffsetOption = 0.0,
    warming: WarmingOption = 0.0,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Simulate the light robot arm of chapter 6 of the thesis: recordings, machine.toml and benchmark.toml.

    Example: cdtool simulate arm --trial 2 --free 14 --holdout 40 --stiff 30 --soft 30 --seed 1 -o forearm
    """
    _check_format(file_format)
    from cdtool.commands.simulate.arm_recordings import simulate_arm
    from cdtool.commands.simulate.changed_machine import ChangedMachine

    counts = {"free": free, "holdout": holdout, "stiff": stiff, "soft": soft}
    changed = ChangedMachine(friction, speed, mass, current_offset, acceleration_offset, warming)
    with progress("simulating", quiet=quiet) as advance:
        written = simulate_arm(
            output,
            counts,
            seed,
            trial=1 if trial == 1 else 2,
            file_format=file_format,
            progress=advance,
            references=reference,
            changed=changed,
        )
    _report(output, written, counts, seed, as_json)


def _check_format(file_format: str) -> None:
    if file_format not in _FORMATS:
        raise UsageError(f"unknown format '{file_format}'", nearest(file_format, _FORMATS))


def _report(output: Path, written: int, counts: Mapping[str, int], seed: int, as_json: bool) -> None:
    from cdtool.commands.simulate.recording_folder import without_benchmark

    if as_json:
        print_json({"folder": str(output), "recordings": written, "seed": seed})
        return
    recordings, why_not = counted(written, "recording"), without_benchmark(counts)
    files = "machine.toml" if why_not else "machine.toml, benchmark.toml"
    typer.echo(f"{recordings}, {files} and contacts.csv written to {plain(output)}")
    if why_not:
        typer.echo(f"no benchmark.toml: {why_not}")
