"""Compiled kernels: lazy, linked, cached, and without a writable cache."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import cdtool.activation
import cdtool.machines.tree_inverse_kernel
import cdtool.machines.tree_kernel
import cdtool.thresholds.first_order
from cdtool import kernel_warm_up, kernels
from cdtool.kernel_warm_up import compile_package, shares
from cdtool.kernels import Kernel, kernel, read_only
from cdtool.recording import FloatArray


@kernel("float64(float64)")
def _double(x: float) -> float:
    return 2.0 * x


@kernel("float64(float64)")
def _twice_and_one(x: float) -> float:
    return _double(x) + 1.0


def test_a_kernel_may_call_a_kernel_of_its_module():
    assert _twice_and_one(3.0) == 7.0


def test_a_kernel_keeps_the_docstring_of_its_function():
    assert _double.__name__ == "_double"


class _Scale(NamedTuple):
    factor: float
    values: FloatArray


@kernel("float64(_Scale, int64)")
def _scaled(scale: _Scale, k: int) -> float:
    return scale.factor * scale.values[k]


@pytest.mark.parametrize("values", [np.arange(3.0), np.arange(6.0)[::2] / 2.0, read_only(np.arange(3.0))])
def test_a_named_tuple_gives_a_kernel_numbers_and_arrays_by_name(values):
    assert _scaled(_Scale(values=read_only(values), factor=5.0), 2) == 10.0


def test_arrays_in_a_named_tuple_are_read_only_and_not_copied():
    values = np.arange(3.0)
    shown = read_only(values)
    assert np.shares_memory(shown, values) and values.flags.writeable
    with pytest.raises(ValueError, match="read-only"):
        shown[0] = 1.0


@pytest.fixture
def no_cache_folder(monkeypatch):
    """As in a read-only installation with a read-only home: numba has no writable cache."""
    from numba.core import caching

    implementation = getattr(caching, "_CacheImpl", None) or caching.CacheImpl
    monkeypatch.setattr(implementation, "_locator_classes", [])
    monkeypatch.setattr(kernels, "_told", False)


def test_without_a_writable_cache_it_compiles_and_warns_once(no_cache_folder):
    first = kernel("float64(float64)")(lambda x: x + 1.0)
    second = kernel("float64(float64)")(lambda x: x + 2.0)
    with pytest.warns(UserWarning, match="NUMBA_CACHE_DIR") as told:
        assert (first(1.0), second(1.0)) == (2.0, 3.0)
    assert len(told) == 1


@pytest.mark.parametrize(
    ("folder", "named"), [("/cache/numba", "(NUMBA_CACHE_DIR = /cache/numba)"), ("", "(neither that of cdtool nor one")]
)
def test_the_warning_names_the_folder_that_cannot_be_written(no_cache_folder, monkeypatch, folder, named):
    monkeypatch.setenv("NUMBA_CACHE_DIR", folder)
    with pytest.warns(UserWarning, match=re.escape(named)) as told:
        assert kernel("float64(float64)")(lambda x: x + 3.0)(1.0) == 4.0
    assert "\n" not in str(told[0].message)


_DEFINE = "from cdtool.kernels import kernel\n@kernel('float64(float64)')\ndef "


@pytest.mark.parametrize(
    ("outer", "inner"),
    [
        (f"{_DEFINE}outer(x):\n    return inner(x)\n", _DEFINE + "inner(x):\n    return {} * x\n"),
        (f"{_DEFINE}outer(x):\n    return inner * x\n", "inner = {}\n"),
        (
            f"{_DEFINE}outer(x):\n    return inner.FACTOR.value * x\n",
            "from enum import IntEnum\nclass inner(IntEnum):\n    FACTOR = {}\n",
        ),
    ],
    ids=["kernel", "number", "enumeration"],
)
def test_a_cached_kernel_is_recompiled_when_what_it_imports_has_changed(outer, inner, tmp_path):
    (tmp_path / "outer.py").write_text(f"from inner import inner\n{outer}print(outer(3.0))")
    project = str(Path(__file__).parents[1])
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": project}
    said = []
    for factor in (2, 2, 5):
        (tmp_path / "inner.py").write_text(inner.format(factor))
        run = [sys.executable, "-B", str(tmp_path / "outer.py")]
        said.append(float(subprocess.run(run, env=environment, capture_output=True, check=True).stdout))
    assert said == [6.0, 6.0, 15.0]


def test_a_cached_kernel_is_recompiled_when_a_field_of_its_named_tuple_has_another_name(tmp_path):
    (tmp_path / "outer.py").write_text(
        "from cdtool.kernels import kernel\nfrom inner import inner\n"
        "@kernel('float64(inner)')\ndef outer(x):\n    return 2.0 * x.value\nprint(outer(inner(3.0, 5.0)))\n"
    )
    project = str(Path(__file__).parents[1])
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": project}
    said = []
    for fields in ("value: float\n    other: float", "other: float\n    value: float"):
        (tmp_path / "inner.py").write_text(f"from typing import NamedTuple\nclass inner(NamedTuple):\n    {fields}\n")
        run = [sys.executable, "-B", str(tmp_path / "outer.py")]
        said.append(float(subprocess.run(run, env=environment, capture_output=True, check=True).stdout))
    assert said == [6.0, 10.0]


def test_importing_modules_with_kernels_does_not_load_numba():
    code = (
        "import sys, cdtool.detectors.friction_ekf, cdtool.activation, cdtool.clock; sys.exit('numba' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], cwd=Path(__file__).parents[1]).returncode == 0


def test_what_kernels_call_can_be_called_from_python_too():
    assert (_twice_and_one(3.0), _double(3.0)) == (7.0, 6.0)


def test_compiling_all_loaded_kernels_leaves_none_to_compile_later(monkeypatch):
    monkeypatch.setattr(kernel_warm_up, "import_kernels", lambda: None)
    absent = kernel_warm_up.missing()
    assert compile_package() == len(absent)
    assert kernel_warm_up.missing() == []
    assert _twice_and_one in kernels.entries()
    assert _double not in kernels.entries()


def test_instructions_without_a_caller_are_nothing_to_compile():
    code = "import cdtool.instructions; from cdtool.kernel_warm_up import missing; print(len(missing()))"
    run = [sys.executable, "-c", code]
    done = subprocess.run(run, cwd=Path(__file__).parents[1], capture_output=True, text=True, check=True)
    assert done.stdout == "0\n"


def _ours() -> list[Kernel]:
    modules = ("cdtool.activation", "cdtool.machines.tree_kernel", "cdtool.machines.tree_inverse_kernel")
    return [
        item for item in kernels.entries() if item.function.__module__ in (*modules, "cdtool.thresholds.first_order")
    ]


def _callees(items: list[Kernel]) -> set[Kernel]:
    return {part for item in items for part in kernel_warm_up._parts(item) - {item}}


def test_no_kernel_is_compiled_by_two_processes(monkeypatch):
    monkeypatch.setattr(kernel_warm_up, "_WORTH_A_PROCESS", 500)
    made = shares(_ours(), 3)
    assert len(made) == 3
    assert sorted(id(item) for share in made for item in share) == sorted(map(id, _ours()))
    assert sum(len(_callees(share)) for share in made) == len(_callees(_ours())) > 10


def test_kernels_of_plug_ins_stay_with_the_process_that_has_them(monkeypatch):
    monkeypatch.setattr(kernel_warm_up, "_WORTH_A_PROCESS", 500)
    own, *others = shares([*_ours(), _twice_and_one], 3)
    assert others
    assert _twice_and_one in own


def test_one_core_and_little_to_compile_make_one_share():
    assert len(shares(_ours(), 1)) == 1
    assert len(shares([cdtool.thresholds.first_order._recursion], 8)) == 1


_WARM_UP = """
import sys
import cdtool.activation, cdtool.thresholds.first_order
from cdtool import kernel_warm_up
kernel_warm_up.usable_cores, kernel_warm_up._WORTH_A_PROCESS, kernel_warm_up._START = lambda: 2, 100, 0
kernel_warm_up.import_kernels = lambda: None
{change}
missing = kernel_warm_up.missing()
own, others = kernel_warm_up.shares(missing, 2)
print(bool(own), bool(others), kernel_warm_up.compile_package() == len(missing))
print(*(set(len(item.compiled.stats.cache_hits) for item in share) for share in (own, others)))
kernel_warm_up.subprocess.Popen = None  # all is in the cache: no process is started
print(kernel_warm_up.compile_package(), len(kernel_warm_up._not_cached(own + others)))
"""


@pytest.mark.parametrize(
    ("change", "taken"),
    [
        ("", 1),
        ("kernel_warm_up._CHILD = 'print(1); raise SystemExit(1)'", 0),
        ("sys.executable = 'no such program'", 0),
    ],
    ids=["another process", "one that dies", "none that starts"],
)
def test_what_another_process_compiled_is_taken_from_the_cache_and_the_rest_compiled_here(change, taken, tmp_path):
    run = [sys.executable, "-c", _WARM_UP.format(change=change)]
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    project = Path(__file__).parents[1]
    done = subprocess.run(run, cwd=project, env=environment, capture_output=True, text=True, check=False)
    assert done.stdout.splitlines() == ["True True True", f"{{0}} {{{taken}}}", "0 0"], done.stderr


@pytest.mark.parametrize("name", ["kernel", "<lambda>"])
def test_a_kernel_is_not_in_the_cache_before_it_is_compiled_and_after_its_file_has_changed(name, tmp_path):
    source = tmp_path / "own_kernels.py"
    source.write_text("def f(x):\n    return x + 1.0\ng = lambda x: x + 1.0\n")
    namespace: dict = {"__name__": "own_kernels"}
    exec(compile(source.read_text(), str(source), "exec"), namespace)
    item = kernel("float64(float64)")(namespace["f" if name == "kernel" else "g"])
    assert kernel_warm_up._not_cached([item]) == [item]
    assert item(1.0) == 2.0
    assert kernel_warm_up._not_cached([item]) == []
    later = source.stat().st_mtime + 3600.0
    os.utime(source, (later, later))
    assert kernel_warm_up._not_cached([item]) == [item]


def test_without_a_writable_cache_no_process_is_started(no_cache_folder):
    assert kernel_warm_up._not_cached(_ours()) == []


def test_kernels_in_the_cache_that_an_upgrade_left_valid_are_announced_once(tmp_path):
    code = "import cdtool.activation; from cdtool import kernel_warm_up as w; w.import_kernels = lambda: 0; "
    run = [sys.executable, "-c", f"{code}print(w.compile_package() > 0)"]
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    project = Path(__file__).parents[1]
    announced = []
    for _ in range(3):
        done = subprocess.run(run, cwd=project, env=environment, capture_output=True, text=True, check=True)
        announced.append(done.stdout)
        if len(announced) == 1:
            for index in tmp_path.rglob("*.nbi"):
                os.utime(index, (1.0, 1.0))  # older than its file, which is installed again with the same content
    assert announced == ["True\n", "True\n", "False\n"]
