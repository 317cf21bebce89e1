"""Start-up: `cdtool --help` compared with a bare typer app, one `cdtool detect` with its plot, and cold compilation.

Every number is that of a new process. The bare app has as many commands, subcommands and options as cdtool has now, and
is started in the same way.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from timing import Spread, interleaved, main, ratio, table, verdict

import cdtool
from cdtool.simulation.gate_recordings import write_gate_recordings

HELP_ROUNDS = 25
DETECT_ROUNDS = 5
COLD_ROUNDS = 3
HELP_AT_MOST = 1.3
DETECT_AT_MOST_S = 2.0
COLD_AT_MOST_S = 20.0

_CDTOOL = "from cdtool.cli.app import main\n\nmain()\n"
_BARE = "from bare_app import app\n\napp()\n"
# Imports every module of the package, so that every kernel is known, and compiles them all.
_COMPILE_ALL = """
import importlib, pkgutil
from time import perf_counter
import cdtool, cdtool.kernel_warm_up
for item in pkgutil.walk_packages(cdtool.__path__, "cdtool."):
    importlib.import_module(item.name)
import numba
begin = perf_counter()
count = cdtool.kernel_warm_up.compile_loaded()
print(count, perf_counter() - begin)
"""


def measure() -> bool:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        environment = _environment(folder)
        return all([_help(folder, environment), _cold(folder, environment), _detect(folder, environment)])


def _help(folder: Path, environment: dict[str, str]) -> bool:
    source, commands, options = _bare_app()
    (folder / "bare_app.py").write_text(source, encoding="utf-8")
    (folder / "bare.py").write_text(_BARE, encoding="utf-8")
    (folder / "cdtool_command.py").write_text(_CDTOOL, encoding="utf-8")
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


def _cold(folder: Path, environment: dict[str, str]) -> bool:
    """Compiles into an empty cache each time; the last one is that which `_detect` then uses."""
    seconds = []
    for i in range(1 + COLD_ROUNDS):
        cache = environment["NUMBA_CACHE_DIR"] if i == COLD_ROUNDS else str(folder / f"kernels_{i}")
        count, each = _run(["-c", _COMPILE_ALL], environment | {"NUMBA_CACHE_DIR": cache}).split()
        seconds.append(float(each))
    # The first one finds no byte code of numba either, which an installation leaves behind.
    spread = Spread.of(seconds[1:])
    held = verdict(f"cold compilation of {count} kernels, s", spread, COLD_AT_MOST_S, at_most=True)
    print()
    return held


def _detect(folder: Path, environment: dict[str, str]) -> bool:
    logs = folder / "gate"
    write_gate_recordings(logs, {"free": 10, "stiff": 1}, seed=1, file_format="csv")
    command = str(folder / "cdtool_command.py")
    machine = ["--machine", str(logs / "machine.toml")]
    signature, plot = logs / "feekf.json", folder / "plot.png"
    free = sorted(map(str, (logs / "free").glob("*.csv")))
    _run([command, "learn-signature", *free, *machine, "--detector", "feekf", "-o", str(signature)], environment)
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


def _bare_app() -> tuple[str, int, int]:
    """Source of a typer app shaped like cdtool's, how many commands it has, and how many options and arguments."""
    import typer.main

    from cdtool.cli.app import app

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
