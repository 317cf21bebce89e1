"""Compiled kernels: lazy, linked, cached; a damaged cache, one that cannot be written, and first starts at once."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from cdtool.base import kernels
from cdtool.base.kernels import kernel

_PROJECT = Path(__file__).parents[2]


@pytest.fixture
def no_cache_folder(monkeypatch):
    """As in a read-only installation with a read-only home: numba has no writable cache."""
    from numba.core import caching

    implementation = getattr(caching, "_CacheImpl", None) or caching.CacheImpl
    monkeypatch.setattr(implementation, "_locator_classes", [])
    kernels._tell_not_stored.cache_clear()


@pytest.mark.parametrize(("folder", "named"), [("/cache/numba", "in /cache/numba: "), ("", "the folder of cdtool or")])
def test_a_cache_that_cannot_be_written_is_reported_once(no_cache_folder, monkeypatch, folder, named):
    monkeypatch.setenv("NUMBA_CACHE_DIR", folder)
    first = kernel("float64(float64)")(lambda x: x + 1.0)
    second = kernel("float64(float64)")(lambda x: x + 2.0)
    with pytest.warns(UserWarning, match="Set NUMBA_CACHE_DIR") as told:
        assert (first(1.0), second(1.0)) == (2.0, 3.0)
    (line,) = [str(item.message) for item in told if item.category is UserWarning]
    assert named in line and "\n" not in line


_DOUBLE = "from cdtool.base.kernels import kernel\n@kernel('float64(float64)')\ndef double(x):\n    return 2.0 * x\n"


@pytest.fixture(scope="module")
def source(tmp_path_factory) -> Path:
    file = tmp_path_factory.mktemp("source") / "own_kernels.py"
    file.write_text(_DOUBLE)
    return file


def _start(source: Path, folder: Path, before: str = "") -> subprocess.Popen[str]:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder), "PYTHONPATH": f"{_PROJECT}:{source.parent}"}
    run = [sys.executable, "-B", "-c", f"{before}from own_kernels import double\nprint(double(1.5))"]
    return subprocess.Popen(run, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


@pytest.fixture(scope="module")
def filled_cache(source, tmp_path_factory) -> dict[str, bytes]:
    folder = tmp_path_factory.mktemp("cache")
    assert _start(source, folder).communicate() == ("3.0\n", "")
    return {str(file.relative_to(folder)): file.read_bytes() for file in folder.rglob("*.nb?")}


@pytest.mark.parametrize(
    ("kind", "left"), [(".nbi", lambda data: data[: len(data) // 2]), (".nbc", lambda data: bytes(len(data)))]
)
def test_a_damaged_cache_is_removed_and_compiled_again(left, kind, filled_cache, source, tmp_path):
    for name, data in filled_cache.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(left(data) if name.endswith(kind) else data)
    damaged = {file: file.read_bytes() for file in tmp_path.rglob(f"*{kind}")}
    assert damaged
    assert _start(source, tmp_path).communicate() == ("3.0\n", "")
    assert not [file for file, data in damaged.items() if file.read_bytes() == data]


def test_three_first_starts_at_once_give_the_same(source, tmp_path):
    assert {process.communicate() for process in [_start(source, tmp_path) for _ in range(3)]} == {("3.0\n", "")}


def test_with_numba_switched_off_a_kernel_runs_as_python(source, tmp_path):
    switched_off = "import os\nos.environ['NUMBA_DISABLE_JIT'] = '1'\n"
    assert _start(source, tmp_path, switched_off).communicate() == ("3.0\n", "")


def test_a_folder_that_becomes_full_or_read_only_later_does_not_end_the_work(source, tmp_path):
    full = (
        "from numba.core.caching import IndexDataCacheFile as file\n"
        "def full(*_): raise OSError(28, 'No space left on device')\n"
        "file.save = full\n"
    )
    result, told = _start(source, tmp_path, full).communicate()
    assert result == "3.0\n"
    assert told.count("Set NUMBA_CACHE_DIR") == 1 and "Traceback" not in told


_DEFINE = "from cdtool.base.kernels import kernel\n@kernel('float64(float64)')\ndef "


def test_a_cached_kernel_is_recompiled_when_what_it_imports_has_changed(tmp_path):
    (tmp_path / "outer.py").write_text(
        f"from inner import inner, number, Enumeration\n{_DEFINE}outer(x):\n"
        "    return inner(x) * number * Enumeration.FACTOR.value\nprint(outer(3.0))"
    )
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": str(_PROJECT)}
    said = []
    for kernels_own, number, enumeration in ((2, 1, 1), (2, 1, 1), (5, 1, 1), (5, 7, 1), (5, 7, 11)):
        (tmp_path / "inner.py").write_text(
            f"from enum import IntEnum\nnumber = {number}\nclass Enumeration(IntEnum):\n    FACTOR = {enumeration}\n"
            f"{_DEFINE}inner(x):\n    return {kernels_own} * x\n"
        )
        run = [sys.executable, "-B", str(tmp_path / "outer.py")]
        said.append(float(subprocess.run(run, env=environment, capture_output=True, check=True).stdout))
    assert said == [6.0, 6.0, 15.0, 105.0, 1155.0]


def test_a_cached_kernel_is_recompiled_when_a_field_of_its_named_tuple_has_another_name(tmp_path):
    (tmp_path / "outer.py").write_text(
        "from cdtool.base.kernels import fields_of, kernel\nfrom inner import inner\n"
        "@kernel(f'float64({fields_of(inner)})')\ndef outer(x: inner):\n    return 2.0 * x.value\n"
        "print(outer(inner(3.0, 5.0)))\n"
    )
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": str(_PROJECT)}
    said = []
    for fields in ("value: float\n    other: float", "other: float\n    value: float"):
        (tmp_path / "inner.py").write_text(f"from typing import NamedTuple\nclass inner(NamedTuple):\n    {fields}\n")
        run = [sys.executable, "-B", str(tmp_path / "outer.py")]
        said.append(float(subprocess.run(run, env=environment, capture_output=True, check=True).stdout))
    assert said == [6.0, 10.0]
