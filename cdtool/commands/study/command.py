"""`cdtool study`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from cdtool.base.errors import UsageError
from cdtool.base.exit_status import statuses_words
from cdtool.commands.console.console import number, plain, print_json, print_line, table
from cdtool.commands.console.options import ForceOption, JsonOption, MachineOption, keys_option
from cdtool.commands.console.place import Place, location

if TYPE_CHECKING:
    from cdtool.commands.study.study import SensorStudy

study = typer.Typer(help="Study an impact before the machine is built.", no_args_is_help=True, rich_markup_mode=None)

NOT_SEEN = "not seen"


@study.callback()
def _study() -> None:
    """Study an impact before the machine is built."""


@study.command(
    "sensors", short_help="Rank the sensors by when they detect an impact.", epilog=statuses_words("study sensors")
)
def sensors(
    machine: MachineOption,
    file: Annotated[
        Place | None,
        typer.Option(
            "--study", parser=location, help="TOML: [impact], [drive], [controller], [sensors.*]; docs/study.md."
        ),
    ] = None,
    settings: Annotated[
        list[str] | None,
        keys_option(
            "A key of the study file in place of its value, repeatable, as impact.speed=0.2.",
            "cdtool.commands.study.study_file:StudyTable",
        ),
    ] = None,
    output: Annotated[
        Place | None, typer.Option("--output", "-o", parser=location, help="A figure: .png, .svg, .pdf.")
    ] = None,
    force: ForceOption = False,
    as_json: JsonOption = False,
) -> None:
    """Rank the sensors by when they detect an impact, with the force and the limiting factor (thesis figure 4.10).

    Example: cdtool study sensors -m sample_logs/gate/machine.toml --set impact.speed=0.2
    """
    from cdtool.commands.judging.settings_table import given_settings
    from cdtool.commands.study.study import study_sensors

    if output:
        from cdtool.base.files.foreign import refuse_foreign_figure
        from cdtool.report.plots.figures import SUFFIXES

        if output.suffix.lower() not in SUFFIXES:
            raise UsageError(f"--output is '{output}'", f"the name must end in {', '.join(SUFFIXES)}")
        refuse_foreign_figure(output, force=force)
    done = study_sensors(machine, file, settings=given_settings(settings or ()))
    if output:
        from cdtool.commands.study.sensor_plot import plot_ranking

        plot_ranking(done.ranking, output)
    if as_json:
        print_json(_as_dict(done))
    else:
        _show(done)


def _show(done: SensorStudy) -> None:
    ranking = done.ranking
    case = ranking.case
    print_line(
        f"{plain(done.machine)}, joint {plain(done.joint)}: {case.transmission.load_mass:.4g} kg at {case.speed:g} m/s "
        f"on {case.obstacle.stiffness:g} N/m: {0.5 * case.transmission.load_mass * case.speed**2:.3g} J"
    )
    columns = [("sensor", "left"), ("where", "left")]
    columns += [
        ("limit", "right"),
        ("", "left"),
        ("seen\nms", "right"),
        ("force then\nN", "right"),
        ("largest so far\nN", "right"),
    ]
    columns += [("limited by", "left"), ("what helps most", "left")]
    rows = []
    for item in ranking.responses:
        time = NOT_SEEN if item.time is None else f"{1e3 * item.time:.1f}"
        saving = "" if item.saving is None else f": {1e3 * item.saving:.1f} ms earlier"
        cells = (item.sensor.name, item.sensor.place, number(item.threshold), item.sensor.unit, time)
        rows.append(
            (*cells, _newtons(item.force), _newtons(item.peak_so_far), item.limited_by, f"{item.remedy}{saving}")
        )
    table(columns, rows)
    typer.echo()
    print_line(
        f"seen: beyond {ranking.factor:g} sigma and the resolution, at the least favourable sampling instants, "
        "without the machine's own variation"
    )
    peak = f"{ranking.peak_force:.4g} N at {1e3 * ranking.peak_time:.3g} ms"
    print_line(f"if the drive is not stopped, the force reaches {peak} (analysed for {1e3 * case.window:g} ms)")
    print_line(ranking.rigidity.words)
    if done.waves:
        print_line(done.waves.words)
    for words in done.assumptions:
        print_line(f"assumed: {plain(words)}")


def _newtons(force: float | None) -> str:
    return "-" if force is None else f"{force:.0f}"


def _as_dict(done: SensorStudy) -> dict[str, Any]:
    ranking = done.ranking
    rows = [
        {
            "sensor": item.sensor.name,
            "where": item.sensor.place,
            "limit": item.threshold,
            "unit": item.sensor.unit,
            "time_ms": None if item.time is None else 1e3 * item.time,
            "force_n": item.force,
            "peak_so_far_n": item.peak_so_far,
            "limited_by": item.limited_by,
            "remedy": item.remedy,
            "saving_ms": None if item.saving is None else 1e3 * item.saving,
        }
        for item in ranking.responses
    ]
    rigidity = ranking.rigidity
    return {
        "machine": done.machine,
        "joint": done.joint,
        "speed": ranking.case.speed,
        "stiffness": ranking.case.obstacle.stiffness,
        "k": ranking.factor,
        "sensors": rows,
        "peak_force_n": ranking.peak_force,
        "peak_time_ms": 1e3 * ranking.peak_time,
        "rigidity": {"share": rigidity.share, "rigid": rigidity.rigid, "motion_ratio": rigidity.motion_ratio},
        "waves": None if done.waves is None else {"ratio": done.waves.ratio, "warning": done.waves.warning},
        "assumptions": list(done.assumptions),
    }
