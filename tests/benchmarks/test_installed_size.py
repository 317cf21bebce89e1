"""benchmarks/installed_size.py: what a distribution brings that nothing else needs."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import pytest

from tests.project.pages import benchmark_script


@pytest.fixture(scope="module")
def script() -> ModuleType:
    return benchmark_script("installed_size")


def put(folder: Path, name: str, files: dict[str, int], *requires: str) -> None:
    """Write an installed distribution: files with sizes, and what it requires."""
    info = folder / f"{name}-1.0.dist-info"
    info.mkdir(parents=True)
    lines = [f"Requires-Dist: {text}\n" for text in requires]
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n{''.join(lines)}")
    for file, size in files.items():
        (folder / file).parent.mkdir(exist_ok=True)
        (folder / file).write_bytes(b"x" * size)
    (info / "RECORD").write_text("".join(f"{file},,\n" for file in files))


def test_sizes_are_those_of_blocks_and_what_others_need_too_is_not_counted(script, tmp_path, capsys):
    put(tmp_path, "cdtool", {"cdtool/a.py": 4096}, "kernels", "frames", "absent; extra == 'x'")
    put(tmp_path, "kernels", {"kernels/a.so": 8_192_000, "kernels/a.pyc": 4096}, "compiler", "arrays")
    put(tmp_path, "compiler", {"compiler/a.so": 81_920_000})
    put(tmp_path, "frames", {"frames/a.py": 4096}, "arrays")
    put(tmp_path, "arrays", {"arrays/a.so": 40_960_000})
    put(tmp_path, "other", {"other/a.so": 409_600_000 // 100})
    known = script.installed(tmp_path)
    assert known["kernels"].files >= 8_192_000 and known["kernels"].compiled >= 4096
    assert script.reached(known, ["cdtool"]) == {"cdtool", "kernels", "compiler", "frames", "arrays"}
    script.main(tmp_path)
    out = capsys.readouterr().out
    assert "| kernels | 8.2 | 0.0 | 90.1 (compiler) |" in out and "(arrays" not in out
    assert "altogether 131 MB" in out


def test_an_environment_without_cdtool_is_refused(script, tmp_path):
    with pytest.raises(SystemExit, match="is not installed there"):
        script.main(tmp_path)
