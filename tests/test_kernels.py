"""Compiled kernels: lazy, linked, cached, and without a cache where none can be written."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from cdtool import kernels
from cdtool.kernels import kernel


@kernel("float64(float64)")
def _double(x: float) -> float:
    return 2.0 * x


@kernel("float64(float64)")
def _twice_and_one(x: float) -> float:
    return _double(x) + 1.0


def test_a_kernel_may_call_a_kernel_of_its_module():
    assert _twice_and_one(3.0) == 7.0


def test_a_kernel_says_what_the_function_said():
    assert _double.__name__ == "_double"


@pytest.fixture
def no_cache_folder(monkeypatch):
    """As in a read-only installation with a read-only home: numba finds nowhere to put its cache."""
    from numba.core import caching

    implementation = getattr(caching, "_CacheImpl", None) or caching.CacheImpl
    monkeypatch.setattr(implementation, "_locator_classes", [])
    monkeypatch.setattr(kernels, "_told", False)


def test_where_no_cache_can_be_written_it_compiles_anyway_and_says_so_once(no_cache_folder):
    first = kernel("float64(float64)")(lambda x: x + 1.0)
    second = kernel("float64(float64)")(lambda x: x + 2.0)
    with pytest.warns(RuntimeWarning, match="NUMBA_CACHE_DIR") as told:
        assert (first(1.0), second(1.0)) == (2.0, 3.0)
    assert len(told) == 1


def test_a_cached_kernel_is_compiled_anew_when_a_kernel_it_imports_has_changed(tmp_path):
    define = "from cdtool.kernels import kernel\n@kernel('float64(float64)')\ndef "
    (tmp_path / "outer.py").write_text(
        f"from inner import inner\n{define}outer(x):\n    return inner(x)\nprint(outer(3.0))"
    )
    project = str(Path(__file__).parents[1])
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": project}
    said = []
    for factor in (2, 2, 5):
        (tmp_path / "inner.py").write_text(f"{define}inner(x):\n    return {factor} * x\n")
        run = [sys.executable, "-B", str(tmp_path / "outer.py")]
        said.append(float(subprocess.run(run, env=environment, capture_output=True, check=True).stdout))
    assert said == [6.0, 6.0, 15.0]


def test_importing_modules_with_kernels_does_not_load_numba():
    code = (
        "import sys, cdtool.detectors.friction_ekf, cdtool.activation, cdtool.clock; sys.exit('numba' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], cwd=Path(__file__).parents[1]).returncode == 0


def test_compiling_all_loaded_kernels_leaves_none_to_compile_later():
    assert kernels.compile_loaded() >= 2
    assert all(item._compiled is not None for item in kernels._all)
    assert np.isfinite(_double(1.0))
