"""Logs of one stroke with chosen columns, and their drafts by `cdtool init`."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cdtool.commands.init.drafting import Drafted, init

FloatArray = np.ndarray
RPM = 60.0 / (2.0 * np.pi)


@dataclass(frozen=True)
class Stroke:
    """Time [s], speed [m/s], travel [m], drive torque [N m] and load-cell force [N] of a stroke with a push."""

    time: FloatArray
    speed: FloatArray
    travel: FloatArray
    torque: FloatArray
    force: FloatArray


def stroke(period: float = 1e-3, length: float = 4.0) -> Stroke:
    """Half a second up, half a second down; noise of a fixed seed on the torque and the force."""
    noise = np.random.default_rng(1)
    time = np.arange(round(length / period)) * period
    speed = np.clip(np.minimum(time / 0.5, (length - time) / 0.5), 0.0, 1.0)
    torque = 0.8 * np.gradient(speed, period) + 0.5 * np.tanh(100.0 * speed) + noise.normal(0.0, 0.02, len(time))
    push = np.where((time > 2.0) & (time < 2.1), 350.0, 0.0)
    return Stroke(time, speed, np.cumsum(speed) * period, torque, push + noise.normal(0.0, 2.0, len(time)))


def write(path: Path, columns: Mapping[str, FloatArray]) -> Path:
    """Write a CSV file with these columns."""
    rows = np.column_stack(list(columns.values()))
    np.savetxt(path, rows, fmt="%.9g", delimiter=",", header=",".join(columns), comments="", encoding="utf-8")
    return path


@dataclass(frozen=True)
class Draft:
    """A draft read back: its tables, and the comments on each key."""

    done: Drafted
    machine: dict
    channels: dict
    text: str

    def said(self, key: str) -> str:
        """Return the comment of a key, after its line or before it, as one line."""
        lines = self.text.splitlines()
        at = next(i for i, line in enumerate(lines) if re.match(rf"{key} = ", line))
        if "  # " in lines[at]:
            return lines[at].split("  # ", 1)[1]
        first = at
        while lines[first - 1].startswith("# "):
            first -= 1
        return " ".join(line.removeprefix("# ") for line in lines[first:at])

    def checked(self, key: str) -> bool:
        """Whether the comment asks for a check."""
        return "CHECK" in self.said(key)

    def unit(self, channel: str) -> str:
        """Return the unit of the channel in the draft."""
        return self.channels[channel]["unit"]


def drafted(log: Path, folder: Path, left_out: tuple[str, ...] = ()) -> Draft:
    """Return the draft of a log; `cdtool info` reads the log with it, and no comment line is too wide."""
    path = folder / "machine.toml"
    done = init(log, path, force=True)
    assert done.left_out == left_out
    assert max(len(line) for line in done.text.splitlines() if line.startswith("#")) <= 100
    values = tomllib.loads(done.text)
    channels = values["channels"]
    return Draft(done, values["machine"], channels.get("mcap", channels), done.text)


def drafted_columns(folder: Path, columns: Mapping[str, FloatArray], left_out: tuple[str, ...] = ()) -> Draft:
    """Return the draft of a table with these columns."""
    return drafted(write(folder / "log.csv", columns), folder, left_out)
