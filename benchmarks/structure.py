"""How the code is built: what a read and a benchmark run, import cycles, single callers, lines, complexity.

    python benchmarks/structure.py           # one table
    python benchmarks/structure.py --show    # and what each number consists of
    python benchmarks/structure.py --lower   # write counts that have become smaller into tests/project/house.toml

* **Reach.** The distinct functions of the package and their modules that run, and how deeply their calls are nested,
  while the CSV log `sample_logs/gate/stiff/03.csv` is read with the machine file already read, and while
  `sample_logs/gate` is benchmarked with one detector. Comprehensions and bodies of classes do not count.
* **Import cycles.** Groups of modules that import one another, directly or through others; imports for the type checker
  count. Imports inside functions close further cycles, which are counted separately.
* **Single callers.** Modules that only one module imports, if it is in the same folder. A module that a table names in
  a string (`"cdtool.detectors.momentum:Momentum"`) is registered and does not count.
* **Code lines.** Lines without docstrings, comments, blank lines and imports.
* **House.** Counts that may become smaller but not larger: code lines of each room and in all, files (at most 15 in a
  folder, and no folder below those of a room), import cycles, compiled kernels, numbers as constants of modules, class
  names used more than once. Their bounds are in tests/project/house.toml, which tests/project/test_house.py checks;
  only a commit that says why raises one.
* **Complexity.** Functions above ruff's C901 (10) or PLR0913 (7); `noqa` is ignored. Compiled kernels are left out, and
  the commands and the functions of the Python API from PLR0913: each parameter is an option or a keyword of its own.
"""

from __future__ import annotations

import argparse
import ast
import io
import json
import subprocess
import sys
import tokenize
import tomllib
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.util import find_spec
from inspect import CO_OPTIMIZED
from pathlib import Path
from types import FrameType
from typing import Any

from timing import table

PACKAGE = Path(__file__).parents[1] / "cdtool"
BOUNDS = Path(__file__).parents[1] / "tests" / "project" / "house.toml"
MOST_SINGLE_CALLERS = 40
GOAL_LINES = 52_000  # what the package is to have at most once its files are in the rooms of the measuring chain
MOST_COMPLEX, MOST_ARGUMENTS = 10, 7
GATE = Path(__file__).parents[1] / "sample_logs" / "gate"
# The most functions, modules and nested calls of one read, and functions and modules of one benchmark.
MOST_READ, MOST_BENCHMARK = (60, 20, 9), (650, 120, None)


@dataclass(frozen=True)
class Import:
    """One import: `kind` is "module", "types" (for the type checker), "function" or "name" (in a table of names)."""

    importer: str
    imported: str
    kind: str


@dataclass(frozen=True)
class Module:
    """One file of a package; `name` is dotted."""

    name: str
    path: Path

    @cached_property
    def text(self) -> str:
        return self.path.read_text(encoding="utf-8")

    @cached_property
    def tree(self) -> ast.Module:
        return ast.parse(self.text)

    @property
    def is_package(self) -> bool:
        return self.path.name == "__init__.py"


def modules_of(package: Path) -> dict[str, Module]:
    """Every module of a package, by its dotted name."""
    found = {}
    for path in sorted(package.rglob("*.py")):
        parts = path.relative_to(package.parent).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        found[name] = Module(name, path)
    return found


def imports_of(modules: Mapping[str, Module]) -> list[Import]:
    """The imports between the modules, as written: that importing `a.b` also imports `a` does not count."""
    return [
        Import(module.name, imported, kind)
        for module in modules.values()
        for imported, kind in _imports(module.tree, modules, "module")
        if imported != module.name
    ]


def _imports(node: ast.AST, known: Mapping[str, Module], kind: str) -> Iterator[tuple[str, str]]:
    yield from _named_by(node, known, kind)
    if isinstance(node, ast.If) and _last_name(node.test) == "TYPE_CHECKING":
        for inner in node.body:
            yield from _imports(inner, known, "types")
        for inner in node.orelse:
            yield from _imports(inner, known, kind)
        return
    inside = "function" if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda) else kind
    for child in ast.iter_child_nodes(node):
        yield from _imports(child, known, inside)


def _named_by(node: ast.AST, known: Mapping[str, Module], kind: str) -> Iterator[tuple[str, str]]:
    """The modules that one node names by itself: an import, a call of `import_module`, or a text "module:name"."""
    if isinstance(node, ast.Import):
        yield from ((found, kind) for item in node.names if (found := _known(item.name, known)))
    elif isinstance(node, ast.ImportFrom) and node.module:
        names = (f"{node.module}.{item.name}" for item in node.names)
        yield from ((found, kind) for name in names if (found := _known(name, known)))
    elif isinstance(node, ast.Call) and _last_name(node.func) == "import_module":
        names = (str(item.value) for item in node.args[:1] if isinstance(item, ast.Constant))
        yield from ((found, "function") for name in names if (found := _known(name, known)))
    elif isinstance(node, ast.Constant) and isinstance(node.value, str):
        name, colon, _ = node.value.partition(":")
        if colon and name in known:
            yield name, "name"


def _known(name: str, known: Mapping[str, Module]) -> str:
    """The module that an imported name is, or is a part of; empty where it is none of them."""
    while name and name not in known:
        name = name.rpartition(".")[0]
    return name


def _last_name(node: ast.AST) -> str:
    """`numba.njit(...)` -> "njit"."""
    node = node.func if isinstance(node, ast.Call) else node
    return node.attr if isinstance(node, ast.Attribute) else node.id if isinstance(node, ast.Name) else ""


def cycles(imports: Iterable[Import], kinds: Sequence[str] = ("module", "types")) -> list[list[str]]:
    """The groups of modules in which each one reaches every other by imports of these kinds, the largest first."""
    graph: dict[str, set[str]] = defaultdict(set)
    for item in imports:
        if item.kind in kinds:
            graph[item.importer].add(item.imported)
    reached = {name: _reached(graph, name) for name in list(graph)}
    groups = {
        tuple(sorted(other for other in there if name in reached.get(other, ())))
        for name, there in reached.items()
        if name in there
    }
    return sorted(map(list, groups), key=lambda group: (-len(group), group))


def _reached(graph: Mapping[str, set[str]], start: str) -> set[str]:
    """Where imports lead to from a module; that module itself only where they lead back."""
    found: set[str] = set()
    waiting = [start]
    while waiting:
        for name in graph.get(waiting.pop(), set()) - found:
            found.add(name)
            waiting.append(name)
    return found


def single_callers(modules: Mapping[str, Module], imports: Iterable[Import]) -> list[tuple[str, str]]:
    """Return modules that only one other module imports, from the same folder, as (caller, module)."""
    callers: dict[str, set[str]] = defaultdict(set)
    registered = set()
    for item in imports:
        callers[item.imported].add(item.importer)
        if item.kind == "name":
            registered.add(item.imported)
    found = []
    for name, its in callers.items():
        module = modules[name]
        if len(its) == 1 and name not in registered and not module.is_package:
            (caller,) = its
            if modules[caller].path.parent == module.path.parent:
                found.append((caller, name))
    return sorted(found)


def code_lines(module: Module) -> int:
    """How many lines hold code: no docstring, no import, not blank and not only a comment."""
    ignored = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
    lines: set[int] = set()
    for item in tokenize.generate_tokens(io.StringIO(module.text).readline):
        if item.type not in ignored:
            lines.update(range(item.start[0], item.end[0] + 1))
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Import | ast.ImportFrom) or _is_docstring(node):
            lines.difference_update(_span(node))
        elif isinstance(node, ast.If) and _last_name(node.test) == "TYPE_CHECKING" and not node.orelse:
            lines.discard(node.lineno)
    return len(lines)


def _is_docstring(node: ast.AST) -> bool:
    """Whether a string is a statement by itself, which documents the code before it and runs nothing."""
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def _span(node: Any) -> range:
    return range(node.lineno, node.end_lineno + 1)


def lines_by_room(modules: Mapping[str, Module]) -> dict[str, tuple[int, int]]:
    """Files and code lines of each folder directly below the package; the package's own files are "(top level)"."""
    rooms: dict[str, tuple[int, int]] = {}
    for module in modules.values():
        parts = module.name.split(".")
        room = parts[1] if len(parts) > 2 or (module.is_package and len(parts) > 1) else "(top level)"
        files, lines = rooms.get(room, (0, 0))
        rooms[room] = files + 1, lines + code_lines(module)
    return dict(sorted(rooms.items()))


def number_constants(module: Module) -> list[str]:
    """The names that a module binds to numbers at its top level: `A = 3`, `A, B = 0.5, 2**20`, `A: Final = -1`."""
    names = []
    for node in module.tree.body:
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
            continue
        target, value = node.targets[0] if isinstance(node, ast.Assign) else node.target, node.value
        pairs = [(target, value)]
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
            pairs = list(zip(target.elts, value.elts, strict=True))
        names += [one.id for one, its in pairs if isinstance(one, ast.Name) and _is_number(its)]
    return names


def _is_number(node: ast.AST) -> bool:
    """Whether an expression consists of numbers and operators."""
    if isinstance(node, ast.BinOp):
        return _is_number(node.left) and _is_number(node.right)
    if isinstance(node, ast.UnaryOp):
        return _is_number(node.operand)
    return isinstance(node, ast.Constant) and type(node.value) in (int, float)


def repeated_class_names(modules: Mapping[str, Module]) -> dict[str, list[str]]:
    """The class names that are used more than once, with the modules that define them."""
    places: dict[str, list[str]] = defaultdict(list)
    for name, module in modules.items():
        for node in ast.walk(module.tree):
            if isinstance(node, ast.ClassDef):
                places[node.name].append(name)
    return {name: found for name, found in sorted(places.items()) if len(found) > 1}


def files_by_folder(modules: Mapping[str, Module]) -> Counter[str]:
    """The files of each folder without its `__init__`; detectors and thresholds have one per method, in any number."""
    names = (name.rpartition(".")[0] for name, module in modules.items() if not module.is_package)
    return Counter(name for name in names if name not in ("cdtool", "cdtool.detectors", "cdtool.thresholds"))


def too_deep(modules: Mapping[str, Module]) -> list[str]:
    """The modules below the folders of a room; the folder of a command is a room of its own."""
    return [name for name in modules if name.count(".") > (4 if name.startswith("cdtool.commands.") else 3)]


def house(modules: Mapping[str, Module], imports: Sequence[Import]) -> dict[str, int]:
    """The counts that may become smaller but not larger, by their names in tests/project/house.toml."""
    rooms = lines_by_room(modules)
    return {
        "code lines": sum(lines for _, lines in rooms.values()),
        "files": len(modules),
        "files in a folder beyond 15": sum(max(0, count - 15) for count in files_by_folder(modules).values()),
        "files below the folders of a room": len(too_deep(modules)),
        "import cycles": len(cycles(imports)),
        "import cycles with imports in functions": len(cycles(imports, ("module", "types", "function"))),
        "compiled kernels": sum(len(kernel_lines(module.tree)) for module in modules.values()),
        "numbers as module constants": sum(len(number_constants(module)) for module in modules.values()),
        "class names used more than once": len(repeated_class_names(modules)),
        **{f"code lines in {room}": lines for room, (_, lines) in rooms.items()},
    }


def lower_bounds(counts: Mapping[str, int]) -> None:
    """Write the counts that have become smaller into house.toml; a room that is gone leaves it."""
    bounds = tomllib.loads(BOUNDS.read_text(encoding="utf-8"))
    kept = [line for line in BOUNDS.read_text(encoding="utf-8").splitlines() if line.startswith("#")]
    kept += [f'"{name}" = {min(counts[name], most)}' for name, most in bounds.items() if name in counts]
    BOUNDS.write_text("\n".join(kept) + "\n", encoding="utf-8")


@dataclass(frozen=True)
class Excess:
    """A function above one of the limits."""

    rule: str
    size: int
    place: str


def excesses(package: Path) -> list[Excess]:
    """Functions that ruff reports as too complex or with too many arguments, the worst first, kernels left out."""
    command = [sys.executable, "-m", "ruff", "check", "--isolated", "--ignore-noqa", "--no-cache"]
    limits = [f"lint.mccabe.max-complexity={MOST_COMPLEX}", f"lint.pylint.max-args={MOST_ARGUMENTS}"]
    options = [part for limit in limits for part in ("--config", limit)]
    command += [*options, "--select", "C901,PLR0913", "--output-format", "json", str(package)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode > 1 or not done.stdout:
        raise SystemExit(f"ruff does not run: {done.stderr.strip()}")
    kernels: dict[Path, set[int]] = {}
    found = []
    for item in json.loads(done.stdout):
        path, row = Path(item["filename"]), item["location"]["row"]
        if path not in kernels:
            kernels[path] = kernel_lines(ast.parse(path.read_text(encoding="utf-8")))
        if row not in kernels[path]:
            size = int(item["message"].partition("(")[2].split()[0])
            found.append(Excess(item["code"], size, f"{path.relative_to(package.resolve().parent)}:{row}"))
    return sorted(found, key=lambda item: (item.rule, -item.size, item.place))


def line_of(place: str) -> str:
    """The line of a function's `def`."""
    path, _, row = place.partition(":")
    return (PACKAGE.parent / path).read_text(encoding="utf-8").splitlines()[int(row) - 1]


def kernel_lines(tree: ast.Module) -> set[int]:
    """The lines on which the `def` of functions that numba compiles stands."""
    return {
        node.lineno
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef)
        and any(
            _last_name(item) in ("kernel", "njit", "jit", "vectorize", "guvectorize") for item in node.decorator_list
        )
    }


@dataclass(frozen=True)
class Reach:
    """What of the package a piece of work runs: functions as module:name, and how deeply their calls are nested."""

    functions: tuple[str, ...]
    depth: int

    @property
    def modules(self) -> int:
        return len({name.partition(":")[0] for name in self.functions})


def reach_of(run: Callable[[], object], package: Path) -> Reach:
    """The functions of the package that `run` calls in the main thread; comprehensions count as their function's."""
    names = {str(module.path): name for name, module in modules_of(package).items()}
    found: dict[str, None] = {}
    depth = deepest = 0

    def record(frame: FrameType, event: str, _: object) -> None:
        nonlocal depth, deepest
        code = frame.f_code
        if event not in ("call", "return") or not code.co_flags & CO_OPTIMIZED or frame.f_back is None:
            return
        if code.co_name in ("<listcomp>", "<setcomp>", "<dictcomp>", "<genexpr>") or code.co_filename not in names:
            return
        depth += 1 if event == "call" else -1
        deepest = max(deepest, depth)
        found.setdefault(f"{names[code.co_filename]}:{code.co_qualname}")

    sys.setprofile(record)
    try:
        run()
    finally:
        sys.setprofile(None)
    return Reach(tuple(found), deepest)


def reached() -> dict[str, tuple[Reach, tuple[int | None, ...]]]:
    """What one read of a log and one benchmark with one detector reach, with their targets."""
    import cdtool
    from cdtool.formats.machine_file import read_machine_file

    if not Path(cdtool.__file__).samefile(PACKAGE / "__init__.py"):
        raise SystemExit(f"cdtool is imported from {cdtool.__file__}, not from this checkout; pip install -e .")
    machine = read_machine_file(GATE / "machine.toml")
    works: dict[str, tuple[Callable[[], object], tuple[int | None, ...]]] = {
        "read of a CSV log": (lambda: cdtool.read(GATE / "stiff" / "03.csv", machine), MOST_READ),
        "benchmark": (lambda: cdtool.benchmark(GATE / "benchmark.toml", detectors=["momentum"]), MOST_BENCHMARK),
    }
    found = {}
    for name, (run, most) in works.items():
        run()  # loads its modules and compiles its kernels
        found[name] = reach_of(run, PACKAGE), most
    return found


def measure(show: bool) -> bool:
    """Print all of it; returns whether every target is met."""
    modules = modules_of(PACKAGE)
    imports = imports_of(modules)
    rows: list[tuple[str, object, object, str]] = []
    met: list[bool] = []

    def add(name: str, value: int, most: int | None = None) -> None:
        met.append(most is None or value <= most)
        rows.append((name, f"{value:,}", "" if most is None else f"<= {most:,}", "ok" if met[-1] else "FAIL"))

    lists: dict[str, list[str]] = {}
    for work, (reach, most) in reached().items():
        for what, value, target in zip(
            ("functions", "modules", "depth"), (len(reach.functions), reach.modules, reach.depth), most, strict=True
        ):
            add(f"{work}: {what}", value, target)
        lists[f"Functions of a {work}"] = list(reach.functions)
    groups, more = cycles(imports), cycles(imports, ("module", "types", "function"))
    lists["Import cycles, type checking included"] = [", ".join(group) for group in groups]
    lists["Import cycles with imports in functions"] = [", ".join(group) for group in more]
    single = single_callers(modules, imports)
    add("single-caller modules", len(single), MOST_SINGLE_CALLERS)
    add("  code lines in them", sum(code_lines(modules[name]) for _, name in single))
    lists["Single callers (caller -> module, code lines)"] = [
        f"{caller} -> {name}, {code_lines(modules[name])}" for caller, name in single
    ]
    if find_spec("ruff") is None:
        rows.append(("functions above ruff's limits", "skipped: ruff is not installed", "", ""))
    else:
        found = excesses(PACKAGE)
        by_rule = Counter(item.rule for item in found)
        add(f"functions above C901 {MOST_COMPLEX}", by_rule["C901"], 0)
        add("  the largest", max((item.size for item in found if item.rule == "C901"), default=0))
        commands = [item for item in found if item.rule == "PLR0913" and "command.py" in item.place]
        public = [item for item in found if item.rule == "PLR0913" and "# noqa: PLR0913" in line_of(item.place)]
        add(f"functions above PLR0913 {MOST_ARGUMENTS}", by_rule["PLR0913"] - len(commands) - len(public), 0)
        add("  commands", len(commands))
        add("  public functions, with their reason", len(public))
        lists["Functions above the limits"] = [f"{item.rule} {item.size:3} {item.place}" for item in found]
    bounds = tomllib.loads(BOUNDS.read_text(encoding="utf-8"))
    for name, count in house(modules, imports).items():
        add(name, count, bounds.get(name, 0))
    add("code lines over the goal", max(0, house(modules, imports)["code lines"] - GOAL_LINES))
    lists["Class names used more than once"] = [
        f"{name}: {', '.join(places)}" for name, places in repeated_class_names(modules).items()
    ]
    rooms = lines_by_room(modules)
    table(("measure", "now", "target", ""), [row if row[2] else (*row[:3], "") for row in rows])
    print()
    table(("folder", "files", "code lines"), [(name, *counts) for name, counts in rooms.items()])
    if show:
        for title, lines in lists.items():
            print(f"\n== {title}")
            print("\n".join(lines) or "none")
    return all(met)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--show", action="store_true", help="print the lists, too")
    parser.add_argument("--lower", action="store_true", help="only write smaller counts into tests/project/house.toml")
    options = parser.parse_args()
    if options.lower:
        modules = modules_of(PACKAGE)
        lower_bounds(house(modules, imports_of(modules)))
        return 0
    return 0 if measure(options.show) else 1


if __name__ == "__main__":
    sys.exit(main())
