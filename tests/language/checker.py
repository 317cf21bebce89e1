"""Check the project's texts for phrases that are not plain technical English.

    python -m tests.language.checker [FILE|FOLDER ...]

Without arguments, it checks all Python and Markdown files and the sentences of findings under version control. It exits
with 1 if it finds a phrase, and prints each as file:line: "phrase": what to write in its place. A line that needs the
phrase gives its reason in itself: `# language: reason` in Python, `<!-- language: reason -->` in Markdown. After the
closing quotes of a docstring that counts for the whole docstring.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from tests.language.phrases import Phrase, read_phrases
from tests.language.texts import markdown_prose, python_prose

ROOT = Path(__file__).parents[2]
_PROSE = ("*.py", "*.md", "*kinds.toml")

_EXEMPT = re.compile(r"(?:#|<!--) language: (?!-->)\S+")


@dataclass(frozen=True)
class Hit:
    """A refused phrase: file relative to the root, line from 1, the words found and what to write in their place."""

    file: str
    line: int
    words: str
    phrase: Phrase

    def __str__(self) -> str:
        return f'{self.file}:{self.line}: "{self.words}": {self.phrase.instead} ({self.phrase.name})'


def hits_in(text: str, suffix: str, name: str, phrases: Iterable[Phrase]) -> Iterator[Hit]:
    """Yield every hit in the text of a file `name` that ends in `suffix`; all but ".py" is read as Markdown."""
    prose = python_prose(text) if suffix == ".py" else markdown_prose(text)
    joined = prose.joined()
    lower_case = joined.lower()
    lines: list[str] = []
    for phrase in phrases:
        for found in phrase.find(joined, lower_case):
            lines = lines or text.split("\n")
            begin, end = (text.count("\n", 0, prose.source(index)) for index in (found.start(), found.end() - 1))
            if not any(_EXEMPT.search(line) for line in lines[begin : _last_line(lines, end) + 1]):
                yield Hit(name, begin + 1, " ".join(found[0].replace("\0", "").split()), phrase)


def _last_line(lines: list[str], line: int) -> int:
    """Return the line of the closing quotes where `line` is inside a docstring that is exempt behind them."""
    for at in range(line, min(line + 40, len(lines))):
        if re.search(r'"""\s*# language: ', lines[at]):
            return at
        if at > line and '"""' in lines[at]:
            break
    return line


def versioned_files(root: Path = ROOT) -> list[str]:
    """Return the files with prose under version control, relative to `root`."""
    command = ("git", "-C", str(root), "ls-files", "--cached", "--others", "--exclude-standard", *_PROSE)
    listed = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    return [name for name in listed if (root / name).is_file()]


def check(names: Iterable[str], root: Path = ROOT) -> list[Hit]:
    """Return every hit in the files, relative to `root`, in their order."""
    phrases = read_phrases()
    hits: list[Hit] = []
    for name in names:
        text = (root / name).read_text(encoding="utf-8")
        hits += sorted(hits_in(text, Path(name).suffix, name, phrases), key=lambda hit: hit.line)
    return hits


def files_of(path: Path) -> list[Path]:
    """Return the file itself, or the files with prose below a folder in order of their names."""
    return sorted({file for kind in _PROSE for file in path.rglob(kind)}) if path.is_dir() else [path]


def main(arguments: list[str], root: Path = ROOT) -> int:
    """Print the hits in the given files or folders, or in all files; return the exit status."""
    if arguments:
        given = [Path(argument).resolve() for argument in arguments]
        if unknown := [str(path) for path in given if not path.exists()]:
            print(f"{', '.join(unknown)}: no such file or folder (check the path)", file=sys.stderr)
            return 2
        names = [file.relative_to(root).as_posix() for path in given for file in files_of(path)]
    else:
        names = versioned_files(root)
    hits = check(names, root)
    for hit in hits:
        print(hit)
    return 1 if hits else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
