"""Pages of the site that are generated from the code: commands, Python functions, fields of the results."""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Iterator, Mapping
from enum import EnumType
from importlib import import_module
from pathlib import Path
from typing import Any, get_args, get_origin

from typer.main import get_command

import cdtool
from cdtool.base.exit_status import STATUSES, STATUSES_OF
from cdtool.commands.app import COMMANDS, app
from cdtool.detectors import DETECTORS
from cdtool.machines import MACHINES
from cdtool.thresholds import THRESHOLDS


def generated_pages(schema: Path) -> dict[str, str]:
    """Return the text of each generated page by its name below docs/, without a suffix."""
    return {
        **_cli_pages(),
        **_python_pages(),
        "reference/results": _results_page(json.loads(schema.read_text("utf-8"))),
    }


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


def _table(head: list[str], rows: list[list[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines) + "\n"


# --- commands


def _commands(command: Any, name: str) -> Iterator[tuple[str, Any]]:
    """Yield a command and its subcommands, each with its name on the command line."""
    yield name, command
    for below, part in getattr(command, "commands", {}).items():
        yield from _commands(part, f"{name} {below}")


def _cli_pages() -> dict[str, str]:
    root: Any = get_command(app)
    pages, rows = {}, []
    for name in COMMANDS:
        command = root.commands[name]
        parts = list(_commands(command, name))
        text = "".join(_command_text(of, part, level=1 + (i > 0)) for i, (of, part) in enumerate(parts))
        pages[f"reference/cli/{name}"] = text
        rows += [[f"[`cdtool {of}`]({name}.md{'#cdtool-' + of.replace(' ', '-') if i else ''})", _first(part)]
                 for i, (of, part) in enumerate(parts)]  # fmt: skip
    statuses = _table(["status", "meaning"], [[f"{int(key)}", _cell(str(text))] for key, text in STATUSES.items()])
    pages["reference/cli/index"] = (
        "# Commands\n\nGenerated from the options of the commands; `cdtool COMMAND --help` shows the same.\n\n"
        + _table(["command", "what it does"], rows)
        + "## Exit statuses\n\n"
        + statuses
    )
    return pages


def _first(command: Any) -> str:
    return _cell((command.help or "").strip().split("\n\n")[0])


def _command_text(name: str, command: Any, level: int) -> str:
    lines = [f"{'#' * level} cdtool {name}\n"]
    for paragraph in (command.help or "").strip().split("\n\n"):
        example = re.fullmatch(r"Example: (.*)", " ".join(paragraph.split()))
        lines.append(f"```text\n{example[1]}\n```\n" if example else _with_links(paragraph.strip()) + "\n")
    arguments = [item for item in command.params if item.param_type_name == "argument"]
    options = [item for item in command.params if item.param_type_name == "option" and not item.hidden]
    if arguments:
        rows = [[f"`{item.metavar or item.name.upper()}`", _linked(item.help or "")] for item in arguments]
        lines.append(_table(["argument", "meaning"], rows))
    if options:
        lines.append(_table(["option", "meaning"], [_option(item) for item in options]))
    if name in STATUSES_OF:
        lines.append(f"Exit statuses: {', '.join(str(int(status)) for status in sorted(STATUSES_OF[name]))}"
                     " ([what they mean](index.md#exit-statuses)).\n")  # fmt: skip
    return "\n".join(lines) + "\n"


def _linked(help_text: str) -> str:
    return _with_links(_cell(help_text))


def _with_links(text: str) -> str:
    """Turn the names of pages in a help text into links with the titles of the pages."""

    def link(match: re.Match[str]) -> str:
        heading = (Path(__file__).parents[1] / match[1]).read_text(encoding="utf-8").partition("\n")[0]
        return f"[{heading.removeprefix('# ')}](../../{match[1]})"

    return re.sub(r"\bdocs/([\w/-]+\.md)", link, text)


def _option(item: Any) -> list[str]:
    names = ", ".join(f"`{text}`" for text in (*item.opts, *item.secondary_opts))
    value = "" if item.is_flag else item.metavar or _value(item)
    text = item.help or ""
    if item.default not in (None, False, (), "") and not callable(item.default) and "efault" not in text:
        default = getattr(item.default, "value", item.default)
        text += f" Default: `{default}`."
    if item.multiple and "epeat" not in text:
        text += " Repeatable."
    if item.required:
        text += " Required."
    return [_cell(f"{names} {value}"), _linked(text)]


def _value(item: Any) -> str:
    """Return what an option expects; typer keeps its type as an annotation, older versions as a type of click."""
    described = getattr(item, "type_descriptor", None)
    kind = described.annotation if described is not None else item.type
    if get_origin(kind) in (list, tuple):
        kind = get_args(kind)[0]
    choices = list(kind) if isinstance(kind, EnumType) else getattr(kind, "choices", None)
    if choices:
        return ", ".join(f"`{getattr(each, 'value', each)}`" for each in choices)
    name = getattr(kind, "name", None) or getattr(kind, "__name__", "")
    return {"int": "number", "integer": "number", "float": "number", "str": "text", "text": "text"}.get(name, "file")


# --- Python


def _python_pages() -> dict[str, str]:
    exported = {name: getattr(cdtool, name) for name in cdtool.__all__ if not name.startswith("__")}
    functions = {name: item for name, item in exported.items() if not inspect.isclass(item)}
    pages, rows, returned = {}, [], dict[str, Any]()
    for name, function in functions.items():
        rows.append([f"[`cdtool.{name}`](functions.md#cdtool{name})", _summary(function)])
        for result in _returned(function, exported):
            returned |= {_place(item): item for item in (result, *_parts(result))}
    text = "# Functions of cdtool\n\n"
    text += "".join(f"## cdtool.{name}\n\n" + _directive("autofunction", f"cdtool.{name}") for name in functions)
    pages["reference/python/functions"] = text
    pages["reference/python/results"] = "# What the functions return\n\n" + "".join(map(_class_text, returned))
    shown = set(returned)
    for title, registry in (("Detectors", DETECTORS), ("Thresholds", THRESHOLDS), ("Machines", MACHINES)):
        places = [_place(registry.load(name)) for name in registry.names(plugins=False)]
        shown.update(places)
        pages[f"reference/python/{title.lower()}"] = f"# {title}\n\n" + "".join(map(_class_text, places))
    about = "What travels between the functions: recordings, signals, bands, verdicts; and the error of all of them."
    values = [_place(item) for item in exported.values() if inspect.isclass(item)]
    texts = (_class_text(place) for place in values if place not in shown)
    pages["reference/python/values"] = f"# Values\n\n{about}\n\n" + "".join(texts)
    more = [
        ["[Results](results.md)", "what the functions return"],
        ["[Values](values.md)", "recordings, signals, bands, verdicts"],
        ["[Detectors](detectors.md)", "the detectors as classes, with their gains"],
        ["[Thresholds](thresholds.md)", "the thresholds as classes"],
        ["[Machines](machines.md)", "the models of machines"],
    ]
    pages["reference/python/index"] = (
        "# Python reference\n\nGenerated from the docstrings, whose examples are run as tests. "
        "[Python](../../python.md) is the introduction.\n\n"
        + _table(["function", "what it does"], rows)
        + _table(["page", "contents"], more)
    )
    return pages


def _returned(function: Any, exported: Mapping[str, Any]) -> list[Any]:
    """Return the classes of cdtool that the docstring names as the result, or else the annotation."""
    section = re.search(r"^Returns\n-+\n(.*)$", inspect.getdoc(function) or "", re.MULTILINE)
    described = re.findall(r"\w+", section[1]) if section else []
    # The names of some annotations are imported for type checkers only.
    known = {**vars(import_module(function.__module__)), **exported}
    found = [known.get(name) for name in described] or [known.get(str(function.__annotations__.get("return")))]
    return [item for item in found if inspect.isclass(item) and item.__module__.startswith("cdtool.")]


def _parts(result: Any) -> list[Any]:
    """Return the classes of a result's own module that its properties return, as the plots of a benchmark."""
    known = vars(import_module(result.__module__))
    getters = (item.fget for item in vars(result).values() if isinstance(item, property))
    found = [known.get(str(getter.__annotations__.get("return"))) for getter in getters]
    return [item for item in found if inspect.isclass(item) and item.__module__ == result.__module__]


def _place(item: Any) -> str:
    return f"{item.__module__}.{item.__qualname__}"


def _class_text(place: str) -> str:
    return f"## {place.rpartition('.')[2]}\n\n" + _directive("autoclass", place, "members")


def _summary(item: Any) -> str:
    return _cell((inspect.getdoc(item) or "").split("\n\n")[0])


def _directive(kind: str, place: str, *options: str) -> str:
    lines = [f".. {kind}:: {place}", *(f"   :{option}:" for option in options)]
    return "```{eval-rst}\n" + "\n".join(lines) + "\n```\n\n"


# --- fields of the results


def _results_page(schema: Mapping[str, Any]) -> str:
    lines = [
        "# Fields of results.json\n",
        "Generated from the [JSON schema](../results.schema.json), which a program can check a file against. "
        "[Benchmark file](../benchmark-file.md) explains the most important fields.\n",
        f"{schema['title']}.\n",
        "## The file\n",
        _fields(schema),
    ]
    for name, part in schema["$defs"].items():
        lines += [
            f"## {name}\n",
            *([_sentence(part["description"]) + "\n"] if part.get("description") else []),
            _fields(part),
        ]
    return "\n".join(lines)


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:] + ("" if text.endswith(".") else ".")


def _fields(part: Mapping[str, Any]) -> str:
    if "properties" not in part:
        return f"Type: {_type(part)}.\n"
    required = set(part.get("required", ()))
    rows = [
        [f"`{name}`", _cell(item.get("description", "")), _type(item), "yes" if name in required else "no"]
        for name, item in part["properties"].items()
    ]
    return _table(["field", "meaning", "type", "always there"], rows)


def _type(item: Mapping[str, Any]) -> str:
    if "$ref" in item:
        name = item["$ref"].rpartition("/")[2]
        return f"[{name}](#{name.lower()})"
    if "const" in item or "enum" in item:
        return " or ".join(f"`{json.dumps(value)}`" for value in item.get("enum", [item.get("const")]))
    if "anyOf" in item or "oneOf" in item:
        return " or ".join(map(_type, item.get("anyOf", item.get("oneOf", []))))
    kind = item.get("type", "any")
    if kind == "array" and isinstance(item.get("items"), Mapping):
        return f"list of {_type(item['items'])}"
    if kind == "object" and isinstance(item.get("additionalProperties"), Mapping) and item["additionalProperties"]:
        return f"object of {_type(item['additionalProperties'])}"
    return " or ".join(kind) if isinstance(kind, list) else str(kind)
