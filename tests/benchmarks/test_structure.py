"""benchmarks/structure.py on small generated packages."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from textwrap import dedent
from types import ModuleType

import pytest

from tests.project.pages import benchmark_script


@pytest.fixture(scope="module")
def script() -> ModuleType:
    return benchmark_script("structure")


@pytest.fixture
def package(tmp_path: Path) -> Callable[..., Path]:
    """Write a package of files by their paths below it, where PKG stands for its name."""

    def write(files: Mapping[str, str], name: str = "pkg") -> Path:
        root = tmp_path / name
        for file, text in files.items():
            path = root / file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(dedent(text).replace("PKG", name), encoding="utf-8")
            for folder in (path.parent, *path.parent.parents):
                if folder.is_relative_to(root):
                    (folder / "__init__.py").touch()
        return root

    return write


def imported(script: ModuleType, root: Path) -> set[tuple[str, str, str]]:
    return {(item.importer, item.imported, item.kind) for item in script.imports_of(script.modules_of(root))}


def test_an_import_is_found_at_any_position_in_any_form(script, package):
    root = package(
        {
            "a.py": "from typing import TYPE_CHECKING\nfrom pkg import b\nif TYPE_CHECKING:\n    from pkg.c import C\n",
            "b.py": "import pkg.sub.d\nTABLE = {'c': 'pkg.c:C'}\n",
            "c.py": "def f():\n    from pkg.sub import d, THING\n    importlib.import_module('pkg.a')\n",
            "sub/d.py": "import os\nfrom otherwise import pkg\nTEXT = 'pkg.a'\n",
        }
    )
    assert imported(script, root) == {
        ("pkg.a", "pkg.b", "module"),
        ("pkg.a", "pkg.c", "types"),
        ("pkg.b", "pkg.sub.d", "module"),
        ("pkg.b", "pkg.c", "name"),
        ("pkg.c", "pkg.sub.d", "function"),
        ("pkg.c", "pkg.sub", "function"),  # THING is one of its names
        ("pkg.c", "pkg.a", "function"),
    }


CODE = '''"""What it is.

More of it.
"""

from __future__ import annotations

from typing import (
    TYPE_CHECKING,
    Any,
)

if TYPE_CHECKING:
    import os

# A comment.
TEXT = """one
two"""  # counts twice


class Thing:
    """Documented."""

    value: int = 1
    """So is this."""

    def method(self) -> Any:
        """Return it."""
        import sys

        return (
            self.value,  # and a comment behind code
        )
'''


def test_code_lines_are_neither_docstrings_nor_imports_nor_comments_nor_blank(script, package):
    root = package({"sub/thing.py": CODE, "top.py": "a = 1\n\n# no\nb = 2; c = 3\n"})
    modules = script.modules_of(root)
    assert script.code_lines(modules["pkg.sub.thing"]) == 8
    assert script.lines_by_room(modules) == {"(top level)": (2, 2), "sub": (2, 8)}
