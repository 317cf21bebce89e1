"""Every file that cdtool writes goes through cdtool/base/files/writing.py: no module opens a file name for writing."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
# The blocks in which a temporary file or folder is written, which `files` flushes and renames.
BLOCKS = {"replaced", "replaced_folder", "TemporaryDirectory"}
WRITES = {"write_text", "write_bytes", "rename", "renames", "touch", "mkstemp", "NamedTemporaryFile", "savefig"}
ELSEWHERE = {
    "cdtool/base/remote/session.py": "locks a temporary folder of its own, and notes in it what was read",
    "cdtool/commands/console/streams.py": "opens the null device",
    "cdtool/execution/on_cluster.py": "opens the null device",
    "cdtool/execution/store/store.py": "names a file when it is complete; a damaged one is computed again",
    "cdtool/commands/simulate/recording_folder.py": "writes into the folder that replaced_folder gives it",
    "cdtool/commands/inject/injecting.py": "writes into the folder that replaced_folder gives it",
    "cdtool/commands/inject/injected_logs.py": "writes into that folder, or into the benchmark's own",
    "cdtool/commands/inject/with_injected.py": "marks such a folder with what it depends on",
}


def writes(tree: ast.AST) -> Iterator[int]:
    """Return the lines on which something is written outside the blocks."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.With) and BLOCKS & {_called(item.context_expr) for item in node.items}:
            continue
        if isinstance(node, ast.Call) and _is_write(node):
            yield node.lineno
        yield from writes(node)


def _called(node: ast.expr) -> str:
    return ast.unparse(node.func).rpartition(".")[2] if isinstance(node, ast.Call) else ""


def _is_write(call: ast.Call) -> bool:
    if isinstance(call.func, ast.Attribute) and call.func.attr in WRITES:
        return True
    given = [*call.args, *(item.value for item in call.keywords)]
    modes = [item.value for item in given if isinstance(item, ast.Constant) and isinstance(item.value, str)]
    return _called(call) in ("open", "fdopen", "File") and any(
        set(mode) & set("wax+") and len(mode) < 4 for mode in modes
    )


def texts_without_line_ends(tree: ast.AST) -> Iterator[int]:
    """Return the lines on which text is written to a file and `newline` is not given."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call) or "devnull" in ast.unparse(node.func):
            continue
        is_method = isinstance(node.func, ast.Attribute) and node.func.attr == "write_text"
        modes = {item.value for item in node.args if isinstance(item, ast.Constant)}
        is_text = _called(node) in ("open", "fdopen") and bool(modes & {"w", "a", "x"})
        if (is_method or is_text) and "newline" not in {item.arg for item in node.keywords}:
            yield node.lineno


def test_files_are_written_only_by_the_module_for_it():
    """The writers of formats write to the name passed to them: the temporary file of a `replaced` block."""
    found = set()
    for path in sorted((ROOT / "cdtool").rglob("*.py")):
        name = path.relative_to(ROOT).as_posix()
        if name != "cdtool/base/files/writing.py" and not name.startswith("cdtool/formats/"):
            found |= {name for _ in writes(ast.parse(path.read_text(encoding="utf-8")))}
    assert found == set(ELSEWHERE)


def test_a_text_file_has_the_same_bytes_on_every_system():
    """Windows would write another line end where none is given."""
    found = [
        f"{path.relative_to(ROOT).as_posix()}:{line}"
        for path in sorted((ROOT / "cdtool").rglob("*.py"))
        for line in texts_without_line_ends(ast.parse(path.read_text(encoding="utf-8")))
    ]
    assert found == []
