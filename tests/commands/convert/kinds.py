"""The kinds of files that `convert` writes, and the converted table."""

from __future__ import annotations

import re
import tomllib
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np
import pytest

from cdtool.formats import FORMATS
from cdtool.formats.written_files import ONE_CLOCK, WRITERS

# One suffix per writer: others mean the same container.
KINDS = list({writer: suffix for suffix, writer in reversed(WRITERS.items())}.values())[::-1]
SEVERAL_CLOCKS = [suffix for suffix in KINDS if suffix not in ONE_CLOCK]
_EXTRAS = tomllib.loads((Path(__file__).parents[3] / "pyproject.toml").read_text(encoding="utf-8"))["project"][
    "optional-dependencies"
]


def needs(*suffixes: str) -> None:
    """Skip, by name, if a package is missing from the extra that reads containers with one of these suffixes."""
    formats = [FORMATS.load(name) for name in FORMATS.names()]
    for extra in {found.name for found in formats if not {*suffixes}.isdisjoint(found.suffixes)} & {*_EXTRAS}:
        for package in (re.split(r"[^\w-]", requirement)[0] for requirement in _EXTRAS[extra]):
            try:
                version(package)
            except PackageNotFoundError:
                pytest.skip(f"{package} is not installed")


def table(path: Path, rows: int = 400) -> Path:
    """A CSV table in ms with values of all magnitudes, and a missing one."""
    random = np.random.default_rng(7)
    torque = random.normal(size=rows) * 10.0 ** random.integers(-200, 200, rows)
    lines = [f"{k * 0.7},{float(torque[k])!r},{float(k) / 3.0!r}" for k in range(rows)]
    lines[5] = "3.5,,0.1"
    path.write_text("time [ms],torque [N m],speed [rad/s]\n" + "\n".join(lines) + "\n")
    return path
