"""Show the texts of two revisions side by side, chosen by a seed: python docs/make_wording.py FILE

FILE ends in .html: messages, help pages, pages of the documentation and the report of the sample benchmark, in two
columns; this runs both revisions. FILE ends in .md: a table of the messages only.

A message is the text of an error, finding or line on screen, or the help of an option, with two consecutive words: the
string arguments of a raised error, `fault`, `Remark`, `remark`, `Skipped`, `echo` and `say`, the `words` of a fact or
what its `sentence` returns, the texts of `kinds.toml`, and `help=`. It has changed if its words are nowhere among the
messages of the other revision. A changed message of the revision before is paired with the most similar one of the
revision after, first within a hunk of `git diff -U0`, then in the whole package, where at least half of the words must
be the same. All pairs are chosen with equal probability; messages without a counterpart are only counted.
"""

from __future__ import annotations

import argparse
import ast
import difflib
import html
import io
import os
import random
import re
import subprocess
import sys
import tempfile
import zipfile
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import zip_longest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
# The last revision before the texts were rewritten.
BEFORE, AFTER, SEED = "417f04c0da33dee66291a5d76e4166575e93d7f1", "HEAD", 15
MESSAGES, HELP_PAGES, PAGES = 20, 5, 3
BENCHMARK = "sample_logs/gate/benchmark.toml"

# Calls with a message: these take one in their first argument, errors and faults in all.
_FIRST = ("Finding", "Remark", "remark", "echo", "say")
_ALL = ("fault", "Skipped", "RecordingFinding")
_KEYWORDS = ("message", "hint", "reason")
_TWO_WORDS = re.compile(r"[A-Za-z]{2,},? [A-Za-z]{2,}")
# Least share of equal words in a pair from one hunk, and from anywhere.
_LEAST_IN_HUNK, _LEAST = 0.3, 0.5
_LONGEST_EXPRESSION = 40
# A field of a template.
_FIELD = re.compile(r"\{[\w.:!]*\}")
# A number in a sentence of `kinds.toml`, with its format.
_NAMED = re.compile(r"\{[^{}]*\}")
_HUNK = re.compile(r"^@@ -(\d+)(?:,(\d+))? \+(\d+)(?:,(\d+))? @@")

_LIST_COMMANDS = """
import typer
from cdtool.commands.app import app
def show(command, path):
    for name in command.commands:
        print(" ".join([*path, name]))
        if hasattr(command.commands[name], "commands"):
            show(command.commands[name], [*path, name])
show(typer.main.get_command(app), [])
"""
_RUN = "import sys; sys.argv[0] = 'cdtool'; from cdtool.commands.app import main; main()"

_HEAD = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>Wording before and after</title><style>
body { font: 14px/1.4 sans-serif; margin: 1em auto; max-width: 1500px; padding: 0 1em }
table { border-collapse: collapse; table-layout: fixed; width: 100% }
td, th { border: 1px solid #ddd; padding: 2px 6px; text-align: left; vertical-align: top; overflow-wrap: anywhere }
td { white-space: pre-wrap } .mono td { font: 11px/1.3 monospace } .same { color: #777 }
del { background: #fdd; text-decoration: none } ins { background: #dfd; text-decoration: none }
</style></head><body>
"""


@dataclass(frozen=True)
class Message:
    """A message in the source: its text with expressions in braces, and the `words` by which it is compared."""

    file: str
    first: int
    last: int
    text: str
    words: tuple[str, ...]


@dataclass(frozen=True)
class Pair:
    """A message before and after."""

    before: Message
    after: Message


@dataclass(frozen=True)
class Hunk:
    """Changed lines of a file before and after; renamed files have two names."""

    old_file: str
    old_lines: range
    new_file: str
    new_lines: range


class Revision:
    """The files of a revision; raises CalledProcessError if git does not know it."""

    def __init__(self, name: str, root: Path = ROOT) -> None:
        self.name = _git(root, "rev-parse", "--short", name).decode().strip()
        self._archive = zipfile.ZipFile(io.BytesIO(_git(root, "archive", "--format=zip", name)))
        self.names = [item for item in self._archive.namelist() if not item.endswith("/")]

    def text(self, name: str) -> str:
        """Return the text of a file."""
        return self._archive.read(name).decode("utf-8")

    def messages(self) -> list[Message]:
        """Return the messages of the package in order of file and line."""
        files = sorted(name for name in self.names if name.startswith("cdtool/"))
        found = [message for name in files if name.endswith(".py") for message in messages_in(self.text(name), name)]
        for name in files:
            found += _kinds(self.text(name), name) if name.endswith("/kinds.toml") else []
        return found

    def pages(self) -> list[str]:
        """Return the names of the pages of the documentation."""
        return [name for name in self.names if name.endswith(".md") and name.startswith(("docs/", "README"))]

    def unpack(self, folder: Path) -> None:
        """Write package and sample logs to a folder."""
        self._archive.extractall(folder, [name for name in self.names if name.startswith(("cdtool/", "sample_logs/"))])


def messages_in(source: str, file: str) -> list[Message]:
    """Return the messages in the source of a module in order of their lines."""
    found = {}
    for node in ast.walk(ast.parse(source)):
        for parts in _texts(node):
            literals = [text for part in parts for text in _literals(part)]
            if any(_TWO_WORDS.search(text) for text in literals):
                first, last = parts[0].lineno, parts[-1].end_lineno or parts[-1].lineno
                text = " ".join(_joined([_shown(part) for part in parts]).split())
                words = tuple(_FIELD.sub(" ", " ".join(literals)).lower().split())
                found[first, parts[0].col_offset] = Message(file, first, last, text, words)
    return [found[place] for place in sorted(found)]


def _kinds(source: str, file: str) -> Iterator[Message]:
    """Yield the sentences of the kinds of findings, each on a line of its own."""
    for number, line in enumerate(source.splitlines(), 1):
        text = line.partition(" = ")[2].strip("\"'")
        if _TWO_WORDS.search(text) and not line.startswith("#"):
            yield Message(file, number, number, text, tuple(_NAMED.sub(" ", text).lower().split()))


def _texts(node: ast.AST) -> Iterator[list[ast.expr]]:
    """Yield the expressions of each message that a node of the syntax tree states."""
    if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
        yield _arguments(node.exc)
    elif isinstance(node, ast.FunctionDef) and node.name == "sentence":
        yield from ([item.value] for item in ast.walk(node) if isinstance(item, ast.Return) and item.value)
    elif isinstance(node, ast.ClassDef):
        given = [item for item in node.body if isinstance(item, ast.Assign)]
        yield from ([item.value] for item in given if ast.unparse(item.targets[0]) == "words")
    elif isinstance(node, ast.Call):
        name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        if name in _FIRST and node.args:
            yield node.args[:1]
        elif name in _ALL or name.endswith("Error"):
            yield _arguments(node)
        yield from ([item.value] for item in node.keywords if item.arg == "help")


def _arguments(call: ast.Call) -> list[ast.expr]:
    """Return the arguments that may be text."""
    given = [*call.args, *(item.value for item in call.keywords if item.arg in _KEYWORDS)]
    return [item for item in given if isinstance(item, ast.JoinedStr) or any(_literals(item))]


def _literals(node: ast.AST) -> Iterator[str]:
    """Yield the strings in an expression, without formats such as .3f."""
    if isinstance(node, ast.Constant):
        if isinstance(node.value, str):
            yield node.value
    elif isinstance(node, ast.FormattedValue):
        yield from _literals(node.value)
    else:
        for child in ast.iter_child_nodes(node):
            yield from _literals(child)


def _shown(node: ast.expr) -> str:
    """Return a text as a reader sees it: expressions are in braces, long ones as {...}."""
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.JoinedStr):
        return "".join(_shown(part) for part in node.values)
    expression = ast.unparse(node.value if isinstance(node, ast.FormattedValue) else node)
    return f"{{{expression if len(expression) <= _LONGEST_EXPRESSION or _TWO_WORDS.search(expression) else '...'}}}"


def _joined(texts: Sequence[str]) -> str:
    """Return the parts of a message as an error shows them: the hint, which is last, in brackets."""
    return texts[0] if len(texts) == 1 else f"{' '.join(texts[:-1])} ({texts[-1]})"


def hunks_between(before: str, after: str, root: Path = ROOT) -> list[Hunk]:
    """Return the changed places of the package's modules."""
    diff = _git(root, "diff", "-U0", "-M", "--no-color", "--no-ext-diff", before, after, "--", "cdtool/*.py").decode()
    hunks, names = [], {"---": "", "+++": ""}
    for line in diff.splitlines():
        if line[:4] in ("--- ", "+++ "):
            names[line[:3]] = line[4:].partition("/")[2]
        elif found := _HUNK.match(line):
            first, count, new_first, new_count = (1 if group is None else int(group) for group in found.groups())
            lines, new_lines = range(first, first + count), range(new_first, new_first + new_count)
            hunks.append(Hunk(names["---"], lines, names["+++"], new_lines))
    return hunks


def changed_pairs(before: Sequence[Message], after: Sequence[Message], hunks: Iterable[Hunk]) -> list[Pair]:
    """Return every changed message that has a counterpart, in order of the files before."""
    known_before, known_after = {item.words for item in before}, {item.words for item in after}
    old = [item for item in before if item.words not in known_after]
    new = [item for item in after if item.words not in known_before]
    pairs: list[Pair] = []
    for hunk in hunks:
        here = [item for item in old if item.file == hunk.old_file and _overlaps(item, hunk.old_lines)]
        there = [item for item in new if item.file == hunk.new_file and _overlaps(item, hunk.new_lines)]
        _pair(here, there, _LEAST_IN_HUNK, pairs)
    _pair(old, new, _LEAST, pairs)
    return sorted(pairs, key=lambda pair: (pair.before.file, pair.before.first))


def _overlaps(message: Message, lines: range) -> bool:
    return message.first < lines.stop and lines.start <= message.last


def _pair(old: Sequence[Message], new: Sequence[Message], least: float, pairs: list[Pair]) -> None:
    """Add pairs of messages that are in no pair yet, the most similar first."""
    paired = {item for pair in pairs for item in (pair.before, pair.after)}
    old, new = ([item for item in items if item not in paired] for items in (old, new))
    counts = {item: Counter(item.words) for item in (*old, *new)}
    alike = [(_similarity(counts[a], counts[b]), i, j) for i, a in enumerate(old) for j, b in enumerate(new)]
    left, free = set(range(len(old))), set(range(len(new)))
    for similarity, i, j in sorted(alike, key=lambda found: (-found[0], *found[1:])):
        if similarity >= least and i in left and j in free:
            left.remove(i)
            free.remove(j)
            pairs.append(Pair(old[i], new[j]))


def _similarity(a: Counter[str], b: Counter[str]) -> float:
    """Return the share of words that two messages have in common (Dice)."""
    return 2.0 * sum((a & b).values()) / (a.total() + b.total())


def chosen(items: Sequence[object], count: int, seed: int) -> list[int]:
    """Return the numbers of the items that the seed chooses, in their order; all if there are not more."""
    return sorted(random.Random(seed).sample(range(len(items)), min(count, len(items))))


def table_of_messages(pairs: Iterable[Pair]) -> str:
    """Return messages as a Markdown table."""
    lines = ["| | where | before | after |", "|---|---|---|---|"]
    for number, pair in enumerate(pairs, 1):
        where = _where(pair).replace("\n", ", now ")
        cells = [str(number), *(cell.replace("|", "\\|") for cell in (where, pair.before.text, pair.after.text))]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _where(pair: Pair) -> str:
    place = f"{pair.before.file}:{pair.before.first}"
    return place if pair.after.file == pair.before.file else f"{place}\n{pair.after.file}:{pair.after.first}"


def side_by_side(old: Sequence[str], new: Sequence[str]) -> str:
    """Return the rows of an HTML table with two columns; different words are marked."""
    rows = []
    for kind, i, i_end, j, j_end in difflib.SequenceMatcher(None, old, new, autojunk=False).get_opcodes():
        for before, after in zip_longest(old[i:i_end], new[j:j_end], fillvalue=""):
            cells = (html.escape(before), html.escape(after)) if kind == "equal" else _marked(before, after)
            rows.append(f"<tr{' class=same' if kind == 'equal' else ''}><td>{cells[0]}<td>{cells[1]}")
    return "\n".join(rows)


def _marked(old: str, new: str) -> tuple[str, str]:
    """Return two texts with the words that differ marked."""
    a, b = (re.findall(r"\s+|[^\s]+", text) for text in (old, new))
    before, after = "", ""
    for kind, i, i_end, j, j_end in difflib.SequenceMatcher(None, a, b, autojunk=False).get_opcodes():
        out, came = html.escape("".join(a[i:i_end])), html.escape("".join(b[j:j_end]))
        before += out if kind == "equal" or not out else f"<del>{out}</del>"
        after += came if kind == "equal" or not came else f"<ins>{came}</ins>"
    return _merged(before), _merged(after)


def _merged(text: str) -> str:
    """Return a text with marks joined if only blanks are between them."""
    return re.sub(r"</(del|ins)>(\s+)<\1>", r"\2", text)


def units_of(page: str) -> list[str]:
    """Return the paragraphs, list items, rows of tables and lines of code of a Markdown page, without line breaks."""
    units: list[str] = []
    is_code, goes_on = False, False
    for line in page.splitlines():
        begins_item = line.startswith(("* ", "- "))
        if line.startswith("```"):
            is_code, goes_on = not is_code, False
        elif is_code or line.startswith(("|", "#", "!")) or not line.strip():
            goes_on = False
        elif goes_on and not begins_item:
            units[-1] += f" {line.strip()}"
            continue
        else:
            goes_on = True
        if line.strip():
            units.append(line)
    return units


def _lines(text: str) -> list[str]:
    return [line.rstrip() for line in text.splitlines()]


def write_page(revisions: Sequence[Revision], pairs: Sequence[Pair], seed: int, changed: int) -> str:
    """Return the HTML page; runs both revisions for help pages and reports."""
    before, after = revisions
    parts = [
        _HEAD,
        f"<h1>Wording before ({before.name}) and after ({after.name})</h1><p>Chosen by the seed {seed}: "
        f"{MESSAGES} of {len(pairs)} pairs of changed messages ({changed} messages changed), {HELP_PAGES} help pages, "
        f"{PAGES} pages of the documentation, and the Markdown report of {BENCHMARK}.</p><h2>Messages</h2>",
        _message_rows(pairs[i] for i in chosen(pairs, MESSAGES, seed)),
    ]
    with tempfile.TemporaryDirectory() as temporary:
        folders = [Path(temporary) / name for name in ("before", "after")]
        for revision, folder in zip(revisions, folders, strict=True):
            revision.unpack(folder)
        commands = [_run(folder, "-c", _LIST_COMMANDS).splitlines() for folder in folders]
        common = sorted(set(commands[0]) & set(commands[1]))
        for name in (common[i] for i in chosen(common, HELP_PAGES, seed)):
            helps = [_run(folder, "-c", _RUN, *name.split(), "--help") for folder in folders]
            parts.append(_section(f"cdtool {name} --help", helps, _lines, "mono"))
        common = sorted(set(before.pages()) & set(after.pages()))
        for name in (common[i] for i in chosen(common, PAGES, seed)):
            parts.append(_section(name, [revision.text(name) for revision in revisions], units_of))
        parts.append(_section("Report of the benchmark", [_report(folder) for folder in folders], units_of))
    return "\n".join([*parts, "</body></html>\n"])


def _message_rows(pairs: Iterable[Pair]) -> str:
    rows = ["<table><tr><th style='width: 20%'>where<th>before<th>after"]
    for pair in pairs:
        before, after = _marked(pair.before.text, pair.after.text)
        rows.append(f"<tr><td>{html.escape(_where(pair))}<td>{before}<td>{after}")
    return "\n".join([*rows, "</table>"])


def _section(title: str, texts: Sequence[str], split: Callable[[str], list[str]], look: str = "") -> str:
    rows = side_by_side(*(split(text) for text in texts))
    return f"<h2>{html.escape(title)}</h2>\n<table class='{look}'><tr><th>before<th>after\n{rows}\n</table>"


def _report(folder: Path) -> str:
    """Return the Markdown report of the sample benchmark."""
    _run(folder, "-c", _RUN, "benchmark", BENCHMARK, "-o", "report.md", statuses=(0, 1))
    return (folder / "report.md").read_text(encoding="utf-8")


def _run(folder: Path, *arguments: str, statuses: Sequence[int] = (0,)) -> str:
    """Return what Python prints in a folder with the package; raises RuntimeError for another exit status."""
    settings = {**os.environ, "PYTHONPATH": str(folder), "COLUMNS": "80", "NO_COLOR": "1", "TERM": "dumb"}
    done = subprocess.run(
        [sys.executable, *arguments], cwd=folder, env=settings, capture_output=True, text=True, encoding="utf-8"
    )
    if done.returncode not in statuses:
        raise RuntimeError(f"{' '.join(arguments[2:])}: status {done.returncode}: {done.stderr[-2000:]}")
    return done.stdout


def _git(root: Path, *arguments: str) -> bytes:
    return subprocess.run(["git", "-C", str(root), *arguments], capture_output=True, check=True).stdout


def main(arguments: Sequence[str], root: Path = ROOT) -> int:
    """Write the file; return the exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition(":")[0])
    parser.add_argument("file", type=Path, help="the file to write, .html or .md")
    parser.add_argument("--before", default=BEFORE, help="the revision before (default: %(default).7s)")
    parser.add_argument("--after", default=AFTER, help="the revision after (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=SEED, help="chooses the texts (default: %(default)s)")
    given = parser.parse_args(arguments)
    revisions = [Revision(name, root) for name in (given.before, given.after)]
    messages = [revision.messages() for revision in revisions]
    pairs = changed_pairs(*messages, hunks_between(given.before, given.after, root))
    known = {item.words for item in messages[1]}
    changed = sum(item.words not in known for item in messages[0])
    print(f"{changed} of {len(messages[0])} messages changed, {len(pairs)} with a counterpart among {len(messages[1])}")
    texts = {
        ".md": lambda: table_of_messages(pairs[i] for i in chosen(pairs, MESSAGES, given.seed)),
        ".html": partial(write_page, revisions, pairs, given.seed, changed),
    }
    if given.file.suffix not in texts:
        parser.error(f"{given.file}: the name must end in .html or .md")
    given.file.write_text(texts[given.file.suffix](), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
