"""Start-up: how long commands take that do little, warm and at first use.

* `cdtool --help` compared with a bare typer app of as many commands, subcommands and options, started in the same way.
* CPU time and time on the clock of short commands on the sample logs, kernels cached; `import numba` as a peer.
* `cdtool detect` with its plot.
* The first `cdtool benchmark` of a fresh installation, and a later one.

Every number is that of a new process.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from time import perf_counter
from typing import Any

from timing import Spread, interleaved, main, ratio, table, verdict

import cdtool
from cdtool.commands.simulate.gate_recordings import simulate_gate

HELP_ROUNDS = 25
COMMAND_ROUNDS = 7
DETECT_ROUNDS = 5
FIRST_ROUNDS = 2
HELP_AT_MOST = 1.3
# 0.6 s, and the time in which numba prepares its compiler before it loads a kernel.
DETECT_AT_MOST_CPU_S = 0.9
DETECT_AT_MOST_S = 2.0
SAMPLES = Path(cdtool.__file__).parents[1] / "sample_logs" / "gate"

_CDTOOL = "from cdtool.commands.app import main\n\nmain()\n"
_BARE = "from bare_app import app\n\napp()\n"


def measure() -> bool:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        environment = _environment(folder)
        (folder / "cdtool_command.py").write_text(_CDTOOL, encoding="utf-8")
        return all(
            [
                _help(folder, environment),
                _commands(folder, environment),
                _detect(folder, environment),
                _first_start(folder, environment),
            ]
        )


def _help(folder: Path, environment: dict[str, str]) -> bool:
    source, commands, options = _bare_app()
    (folder / "bare_app.py").write_text(source, encoding="utf-8")
    (folder / "bare.py").write_text(_BARE, encoding="utf-8")
    tasks = {
        "cdtool --help": lambda: _run([str(folder / "cdtool_command.py"), "--help"], environment),
        "bare typer app --help": lambda: _run([str(folder / "bare.py"), "--help"], environment),
        "python -c pass": lambda: _run(["-c", "pass"], environment),
    }
    seconds = interleaved(tasks, HELP_ROUNDS)
    spread = ratio(seconds["cdtool --help"], seconds["bare typer app --help"])
    held = verdict("cdtool --help / bare typer app, seconds", spread, HELP_AT_MOST, at_most=True)
    table(("task", "ms (low-high)"), [(task, Spread.of([1e3 * s for s in each])) for task, each in seconds.items()])
    print(f"both with {commands} commands and {options} options and arguments\n")
    return held


def _commands(folder: Path, environment: dict[str, str]) -> bool:
    """Short commands on the sample logs; the kernels are cached in the round that is not counted."""
    log, machine = str(SAMPLES / "stiff" / "03.csv"), ["--machine", str(SAMPLES / "machine.toml")]
    free = sorted(map(str, (SAMPLES / "free").iterdir()))
    signature = str(folder / "signature.json")
    learn = [
        "learn-signature",
        *free,
        *machine,
        "--detectors",
        "momentum",
        "-o",
        signature,
        "--set=signature.force=true",
    ]
    arguments = {
        "--help": ["--help"],
        "learn-signature": learn,
        "info": ["info", log, *machine],
        "detect": ["detect", log, *machine, "--detectors", "momentum", "--set=threshold.limits=400"],
        "detect --signature": ["detect", log, *machine, "--signature", signature],
        "benchmark": ["benchmark", str(SAMPLES / "benchmark.toml"), "--json"],
    }
    command = str(folder / "cdtool_command.py")
    _run([command, *learn], environment)
    runs = {f"cdtool {name}": [command, *each] for name, each in arguments.items()}
    runs |= {"python -c 'import numba'": ["-c", "import numba"], "python -c pass": ["-c", "pass"]}
    clock, processor = measured({name: _task(each, environment) for name, each in runs.items()}, COMMAND_ROUNDS)
    spread = Spread.of(processor["cdtool detect"])
    held = verdict("cdtool detect, CPU s", spread, DETECT_AT_MOST_CPU_S, at_most=True)
    table(
        ("task", "CPU s (low-high)", "s (low-high)"),
        [(name, Spread.of(processor[name]), Spread.of(clock[name])) for name in runs],
    )
    print("sample logs of the gate; kernels cached\n")
    return held


def _first_start(folder: Path, environment: dict[str, str]) -> bool:
    """The benchmark of the samples with an empty cache, and again."""
    arguments = [str(folder / "cdtool_command.py"), "benchmark", str(SAMPLES / "benchmark.toml"), "--json"]
    times: dict[str, list[tuple[float, float]]] = {"first": [], "again": []}
    for number in range(FIRST_ROUNDS):
        empty = {**environment, "NUMBA_CACHE_DIR": str(folder / f"first_{number}")}
        for each in times.values():
            each.append(_times(_task(arguments, empty)))
    table(
        ("cdtool benchmark", "CPU s (low-high)", "s (low-high)"),
        [
            (name, Spread.of([processor for _, processor in each]), Spread.of([clock for clock, _ in each]))
            for name, each in times.items()
        ],
    )
    return True


def measured(
    tasks: Mapping[str, Callable[[], object]], rounds: int
) -> tuple[dict[str, list[float]], dict[str, list[float]]]:
    """Seconds on the clock, and of CPU in child processes, of every task in every round."""
    processor: dict[str, list[float]] = {name: [] for name in tasks}

    def with_cpu(name: str) -> Callable[[], None]:
        return lambda: processor[name].append(_times(tasks[name])[1])

    clock = interleaved({name: with_cpu(name) for name in tasks}, rounds)
    return clock, {name: each[-rounds:] for name, each in processor.items()}


def _times(task: Callable[[], object]) -> tuple[float, float]:
    """Seconds on the clock, and of CPU in the child processes of this one and theirs."""
    import resource

    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), perf_counter()
    task()
    clock, after = perf_counter() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
    return clock, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def _detect(folder: Path, environment: dict[str, str]) -> bool:
    logs = folder / "gate"
    simulate_gate(logs, {"free": 10, "stiff": 1}, seed=1, file_format="csv")
    command = str(folder / "cdtool_command.py")
    machine = ["--machine", str(logs / "machine.toml")]
    signature, plot = logs / "feekf.json", folder / "plot.png"
    free = sorted(map(str, (logs / "free").glob("*.csv")))
    _run([command, "learn-signature", *free, *machine, "--detectors", "feekf", "-o", str(signature)], environment)
    impact = str(next((logs / "stiff").glob("*.csv")))
    arguments = [command, "detect", impact, *machine, "--signature", str(signature)]
    tasks = {
        "cdtool detect --plot": lambda: _run([*arguments, "--plot", str(plot)], environment),
        "cdtool detect": lambda: _run(arguments, environment),
    }
    seconds = interleaved(tasks, DETECT_ROUNDS)
    if not plot.stat().st_size:
        sys.exit("error: cdtool detect --plot wrote an empty plot")
    spread = Spread.of(seconds["cdtool detect --plot"])
    held = verdict("cdtool detect of a 7 s CSV with --plot, s", spread, DETECT_AT_MOST_S, at_most=True)
    table(("task", "s (low-high)"), [(task, Spread.of(each)) for task, each in seconds.items()])
    print("kernels cached; matplotlib's font cache too (both made by the round that is not counted)")
    return held


def _environment(folder: Path) -> dict[str, str]:
    """The caller's, with cdtool importable, byte code kept, and kernel and byte code caches that begin empty."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    package = str(Path(cdtool.__file__).parents[1])
    environment["PYTHONPATH"] = os.pathsep.join(filter(None, (package, environment.get("PYTHONPATH"))))
    environment["PYTHONPYCACHEPREFIX"] = str(folder / "byte_code")
    environment["NUMBA_CACHE_DIR"] = str(folder / "kernels")
    return environment


def _run(arguments: Sequence[str], environment: dict[str, str]) -> str:
    """Return the output of a new Python process; stop the benchmark if it fails."""
    done = subprocess.run([sys.executable, *arguments], env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"error: {' '.join(arguments[-4:])}: status {done.returncode}\n{done.stderr}")
    return done.stdout


def _task(arguments: Sequence[str], environment: dict[str, str]) -> Callable[[], str]:
    return lambda: _run(arguments, environment)


def _bare_app() -> tuple[str, int, int]:
    """Source of a typer app shaped like cdtool's, how many commands it has, and how many options and arguments."""
    import typer.main

    from cdtool.commands.app import app

    lines = [
        "from __future__ import annotations",
        "from typing import Annotated",
        "import typer",
        "",
        "app = typer.Typer(no_args_is_help=True, pretty_exceptions_enable=False)",
        "",
        "@app.callback()",
        f"def root({_parameters(2)}) -> None:",
        '    """Measure how quickly, how reliably and at which force a collision is detected."""',
    ]
    commands = options = 0
    for name, command in _members(typer.main.get_command(app)):
        group, number = f"group_{commands}", commands
        subcommands = _members(command)
        if subcommands:
            lines += ["", f'{group} = typer.Typer(help="What it does.")', f'app.add_typer({group}, name="{name}")']
        for subname, item in subcommands or [(name, command)]:
            count = len(item.params)
            lines += [
                "",
                f'@{group if subcommands else "app"}.command("{subname}")',
                f"def command_{number}_{commands}({_parameters(count)}) -> None:",
                '    """What the command does, in a line of about the usual length."""',
            ]
            commands += 1
            options += count
    return "\n".join([*lines, ""]), commands, options


def _members(command: Any) -> list[tuple[str, Any]]:
    return list(getattr(command, "commands", {}).items())


def _parameters(count: int) -> str:
    one = 'option_{0}: Annotated[str, typer.Option("--option-{0}", help="What the option is for.")] = ""'
    return ", ".join(one.format(i) for i in range(count))


if __name__ == "__main__":
    main("start-up", measure)
