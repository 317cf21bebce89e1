"""The cache of compiled kernels: loading without the compiler, first starts at once or killed, the terminal's line."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path

import pytest

from cdtool.kernel_cache import _SharedCache

_PROJECT = Path(__file__).parents[1]
_RUN = (
    "import numpy as np; from cdtool.thresholds.first_order import _recursion as run; "
    "x = np.ones(3); run(x, x, x.copy())"
)
_HITS = f"{_RUN}; print(sum(run.compiled.stats.cache_hits.values()))"


def _environment(folder: Path) -> dict[str, str]:
    return {**os.environ, "NUMBA_CACHE_DIR": str(folder), "PYTHONPATH": str(_PROJECT)}


def _python(code: str, folder: Path, **settings) -> subprocess.Popen:
    return subprocess.Popen([sys.executable, "-c", code], env=_environment(folder), text=True, **settings)


def _output(process: subprocess.Popen) -> str:
    told, _ = process.communicate()
    assert process.returncode == 0
    return told


def test_a_compiler_that_is_switched_off_is_one_line():
    command = [sys.executable, "-m", "cdtool", "info", "sample_logs/gate/stiff/03.csv"]
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(command, cwd=_PROJECT, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith("error: NUMBA_DISABLE_JIT is set")
    assert "unset it" in line


_ALL = """
import importlib, pkgutil, sys
import cdtool
from cdtool.kernels import entries
for item in pkgutil.walk_packages(cdtool.__path__, "cdtool."):
    importlib.import_module(item.name)
for item in entries():
    item.compiled
print(len(entries()), "numba.np.polynomial.polynomial_core" in sys.modules)
"""


def test_every_kernel_is_loaded_from_the_cache_without_the_compiler():
    # Machine code that needs more than numba's runtime would end the process.
    environment = {**os.environ, "PYTHONPATH": str(_PROJECT)}
    for _ in range(2):
        run = [sys.executable, "-c", _ALL]
        done = subprocess.run(run, env=environment, capture_output=True, text=True, check=True)
    count, compiler = done.stdout.split()
    assert int(count) > 50
    assert compiler == "False"


def test_a_command_loads_neither_scipys_linear_algebra_nor_coverage_with_its_kernels(tmp_path):
    code = f"{_RUN}; import sys; print(*({{'scipy.linalg', 'coverage'}} & set(sys.modules)))"
    _output(_python(_RUN, tmp_path))
    assert _output(_python(code, tmp_path, stdout=subprocess.PIPE)).split() == []


@pytest.mark.parametrize("missing", ["runtime", "refresh"])
def test_a_numba_without_the_names_that_it_does_not_document_loads_kernels_in_its_own_way(missing):
    context = type("Context", (), {} if missing == "refresh" else {"refresh": lambda _: None})()
    asked = []

    class Cache:
        def load_overload(self, signature, given):
            asked.append((signature, given, "refresh" in vars(given)))
            return "loaded"

    with pytest.MonkeyPatch.context() as patch:
        if missing == "runtime":
            patch.delattr("numba.core.runtime.rtsys")
        shared = _SharedCache(Cache(), _function_of_cdtool(), ExitStack())
        assert shared.load_overload("signature", context) == "loaded"
    assert asked == [("signature", context, False)]


def _function_of_cdtool():
    from cdtool.clock import _differentiate

    return _differentiate.function


_AT_ONCE = """
import sys, time
from pathlib import Path
from cdtool.kernel_cache import imported_numba
imported_numba()
Path(sys.argv[1]).touch()
while not all(Path(name).exists() for name in sys.argv[1:]):
    time.sleep(0.001)
"""


def test_two_first_starts_at_once_compile_a_kernel_once(tmp_path):
    ready = [str(tmp_path / "first"), str(tmp_path / "second")]
    both = [
        subprocess.Popen(
            [sys.executable, "-c", _AT_ONCE + _HITS, *names],
            env=_environment(tmp_path / "cache"),
            stdout=subprocess.PIPE,
            text=True,
        )
        for names in (ready, ready[::-1])
    ]
    assert sorted(map(_output, both)) == ["0\n", "1\n"]
    assert list(tmp_path.rglob(".cdtool-*")) == []


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
def test_a_first_start_that_is_killed_does_not_block_the_next(tmp_path):
    killed = _python(_RUN, tmp_path)
    while not list(tmp_path.rglob(".cdtool-*.lock")):
        assert killed.poll() is None
        time.sleep(0.001)
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    begin = time.monotonic()
    assert _output(_python(_HITS, tmp_path, stdout=subprocess.PIPE)) == "0\n"
    assert time.monotonic() - begin < 50.0  # it waits a minute for a process that compiles
    assert list(tmp_path.rglob(".cdtool-*")) == []


_SHOWN = f"""
from cdtool import kernel_warm_up
from cdtool.cli.app import compilation_at_once
kernel_warm_up.import_kernels = lambda: import_module("cdtool.thresholds.whitening")
from importlib import import_module
with compilation_at_once():
    {_HITS}
    from cdtool.thresholds.whitening import _burg as other
    print(other.is_ready)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminal")
def test_the_first_kernel_compiles_all_in_one_wait_with_progress(tmp_path):
    told = []
    for _ in range(2):
        terminal, stderr = os.openpty()
        process = _python(_SHOWN, tmp_path, stdout=subprocess.PIPE, stderr=stderr)
        os.close(stderr)
        hits = _output(process)
        told.append((hits, _read(terminal)))
    first, again = told
    assert first[0] == "1\nTrue\n", "the other one, too, was compiled before the first was loaded"
    assert first[1].startswith("first use: compiling ") and "kernels, which can take a minute" in first[1]
    assert first[1].count("\n") == 1 and re.search(r"\r\x1b\[2K\d+%, about \d+ s left", first[1])
    assert again == ("1\nFalse\n", "")


def _read(terminal: int) -> str:
    try:
        return os.read(terminal, 10_000).decode()
    except OSError:  # nothing was written before the other end was closed
        return ""
    finally:
        os.close(terminal)


def test_without_a_terminal_nothing_is_said(tmp_path):
    process = _python(_SHOWN, tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.communicate() == ("1\nTrue\n", "")
