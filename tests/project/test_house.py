"""The size of the package: no count exceeds its bound in house.toml, and a bound follows what has left."""

from __future__ import annotations

import ast
import tomllib
from types import ModuleType

import pytest

from tests.project.pages import benchmark_script

#: A bound may exceed its count by this share or by `SLACK`: no need to write the file for each line that leaves.
SHARE = 0.005
SLACK = 5


@pytest.fixture(scope="module")
def script() -> ModuleType:
    return benchmark_script("structure")


@pytest.fixture(scope="module")
def counts(script) -> dict[str, int]:
    modules = script.modules_of(script.PACKAGE)
    return script.house(modules, script.imports_of(modules))


@pytest.fixture(scope="module")
def bounds(script) -> dict[str, int]:
    return tomllib.loads(script.BOUNDS.read_text(encoding="utf-8"))


def test_no_count_of_the_house_exceeds_its_bound(counts, bounds):
    above = {
        name: f"{count}, at most {bounds.get(name, 0)}" for name, count in counts.items() if count > bounds.get(name, 0)
    }
    assert not above, "take something out first; or raise the bound in house.toml, and say why in the commit"


def test_the_bounds_follow_what_has_left(counts, bounds):
    loose = {name: most for name, most in bounds.items() if most > counts.get(name, 0) + max(SLACK, SHARE * most)}
    assert not loose, "run python benchmarks/structure.py --lower"


def test_every_number_of_a_module_has_its_reason(script):
    bare = []
    for module in script.modules_of(script.PACKAGE).values():
        numbers, lines = set(script.number_constants(module)), ["", *module.text.splitlines()]
        for node in module.tree.body:
            stored = {
                each.id for each in ast.walk(node) if isinstance(each, ast.Name) and isinstance(each.ctx, ast.Store)
            }
            is_number = isinstance(node, ast.Assign | ast.AnnAssign) and stored & numbers
            if is_number and "#" not in lines[node.lineno] and not lines[node.lineno - 1].startswith("#"):
                bare.append(f"{module.path}:{node.lineno}")
    assert not bare, "say why it is so large, as a comment on its line or the line above"
