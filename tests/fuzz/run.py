"""Run one target under atheris: `python -m tests.fuzz.run mcap|messages|csv [libFuzzer's options] CORPUS`."""

from __future__ import annotations

import sys
import tempfile
from importlib import import_module
from pathlib import Path

import atheris


def modules() -> list[str]:
    """All modules of the readers."""
    root = Path(__file__).parents[2]
    found = sorted(root.glob("cdtool/formats/**/*.py"))
    files = (file.relative_to(root).with_suffix("") for file in found)
    return [".".join(file.parts).removesuffix(".__init__") for file in files]


def main() -> None:
    """Fuzz until something is found or the options' time is over."""
    name = sys.argv.pop(1)
    # numba cannot compile what is instrumented; what is imported later would not be instrumented.
    kernels = [module for module in modules() if module.endswith("_kernel")]
    with atheris.instrument_imports(
        include=["cdtool.formats", "cdtool.formats.messages", "cdtool.formats.channels"], exclude=kernels
    ):
        for module in modules():
            import_module(module)
        from tests.fuzz.targets import TARGETS
    target = TARGETS[name]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "input"
        atheris.Setup(sys.argv, lambda data: target(data, path))
        atheris.Fuzz()


if __name__ == "__main__":
    main()
