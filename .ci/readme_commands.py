"""Run every command of README.md in a terminal with colour, with the cdtool of an environment without extras.

    python .ci/readme_commands.py VENV

Each must end with status 0 and without a traceback; the first shows colour, and the only wait for compiled loops. The
lines that create an environment, install or run the tests are left out: .ci/run does that.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]


def commands() -> list[str]:
    """Return the calls of cdtool in the blocks of README.md."""
    blocks = re.findall(r"```sh\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    parts = [part.strip() for block in blocks for line in block.splitlines() for part in line.split("&&")]
    return [part.removeprefix(".venv/bin/") for part in parts if re.match(r"\S*cdtool ", part)]


def run_in_terminal(command: str, folder: Path, programs: Path) -> tuple[int, str]:
    """Return the exit status of a command and what it shows on a terminal of 80 columns."""
    environment = {name: value for name, value in os.environ.items() if name not in ("NO_COLOR", "FORCE_COLOR")}
    environment |= {"TERM": "xterm-256color", "COLUMNS": "80", "NUMBA_CACHE_DIR": str(folder / "cache")}
    environment["PATH"] = f"{programs}{os.pathsep}{os.environ['PATH']}"
    ours, terminal = os.openpty()
    process = subprocess.Popen(
        ["bash", "-c", command], cwd=folder, env=environment, stdin=terminal, stdout=terminal, stderr=terminal
    )
    os.close(terminal)
    text = b""
    try:
        while part := os.read(ours, 65536):
            text += part
    except OSError:  # Linux, once no process has the other end
        pass
    os.close(ours)
    return process.wait(), text.decode()


def wrong(number: int, status: int, text: str) -> list[str]:
    """Return what is wrong with the result of a command; the first has number 0."""
    reasons = {
        f"status {status}": status != 0,
        "a traceback": "Traceback" in text,
        "kernels are compiled again": number > 0 and "compiling kernels" in text,
        "no colour": number == 0 and "\x1b[3" not in text,
    }
    return [reason for reason, holds in reasons.items() if holds]


def main(programs: Path) -> None:
    """Run the commands in a copy of the sample logs; exit with what is wrong with one of them."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copytree(ROOT / "sample_logs", folder / "sample_logs")
        for number, command in enumerate(commands()):
            begin = time.monotonic()
            status, text = run_in_terminal(command, folder, programs)
            print(f"+ {command}: status {status}, {time.monotonic() - begin:.1f} s", flush=True)
            if reasons := wrong(number, status, text):
                raise SystemExit(f"{text}\nREADME.md: {command}: {', '.join(reasons)}")


if __name__ == "__main__":
    main(Path(sys.argv[1]).absolute() / "bin")
