"""Settings that people write: each is one annotated field of a model, with type, bounds, unit, default and meaning.

A model is a dataclass. Its fields are the keys of a table in a TOML file: they give the check of
each value, the error with what is allowed, and the JSON schema. A field of a type that no TOML value has is not a key.
"""

from __future__ import annotations

import datetime as dt
import math
from collections.abc import Callable, Collection, Hashable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING, dataclass, field, fields, is_dataclass, replace
from difflib import get_close_matches
from enum import Enum
from functools import cache
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import msgspec
from msgspec import Meta

from cdtool.base.errors import CdtoolError, ConfigurationError, FieldsError, MistakesError, UsageError, nearest
from cdtool.base.value_words import value_in_words

Model = TypeVar("Model")
Made = TypeVar("Made")

#: No quantity of a machine in SI is larger, or smaller than its inverse unless 0: squares and products stay finite.
_LARGEST = 1e12

NotNegative = Annotated[float, Meta(ge=0.0)]
Positive = Annotated[float, Meta(gt=0.0)]
Text = Annotated[str, Meta(pattern=r"\S")]
Count = Annotated[int, Meta(ge=1)]
CountFromZero = Annotated[int, Meta(ge=0)]


#: Annotation of a field that is not a key, because it is filled in.
NOT_A_KEY = Meta(extra={"key": None})


def setting(
    meaning: str, *, key: str = "", unit: str = "", infinite: bool = False, empty: bool = False, hint: str = ""
) -> Meta:
    """Return the annotation of a field: what it means, its key in a file if that is not its name, and its unit.

    `infinite`: inf is allowed, for a limit that is not there. `empty`: so is an empty list. `hint`: what to give in
    place of a wrong value, where type and bounds do not say it.

    >>> from typing import Annotated
    >>> Hold = Annotated[NotNegative, setting("how long the force stays above", key="hold_s", unit="s")]
    """
    extra = {"key": key, "unit": unit, "infinite": infinite, "empty": empty, "hint": hint}
    return Meta(description=meaning, extra=extra)


@dataclass(frozen=True)
class Key:
    """A key of a model: `name` in the file, `attribute` of the model, its type, and what `setting` says about it."""

    name: str
    attribute: str
    hint: Any
    required: bool
    meaning: str = ""
    extra: Mapping[str, Any] = field(default_factory=dict)

    @property
    def allowed(self) -> str:
        """Return what to give, in words."""
        return self.extra.get("hint") or f"give {kind_in_words(self.hint)}"


def keys_of(model: Any) -> Mapping[str, Key]:
    """Return the keys of a model by their names in a file, in the order of its fields."""
    return _keys_of(model)


@cache
def _keys_of(model: Hashable) -> Mapping[str, Key]:
    hints = get_type_hints(model, include_extras=True)
    found = {}
    for attribute, required, noted in _fields_of(model):
        meta = _meta(hints[attribute])
        extra = (meta and meta.extra) or {"key": ""}
        key = Key(
            extra.get("key") or attribute,
            attribute,
            hints[attribute],
            required,
            (meta and meta.description) or noted,
            extra,
        )
        if extra.get("key") is not None and all(_is_written(part) for part in alternatives(key.hint)):
            found[key.name] = key
    return found


def _fields_of(model: Any) -> list[tuple[str, bool, str]]:
    """Return the names of a model's fields, whether each must be given, and its meaning if its metadata has it."""
    return [
        (item.name, item.default is MISSING and item.default_factory is MISSING, item.metadata.get("meaning", ""))
        for item in fields(model)
        if item.init
    ]


def tables_of(model: Any) -> Mapping[str, Any]:
    """Return the models of the tables among the keys of a model."""
    parts = [(name, bare_type(part)) for name, key in keys_of(model).items() for part in alternatives(key.hint)]
    return {name: kind for name, kind in parts if is_model(kind)}


def is_model(hint: Any) -> bool:
    """Whether a type is a table with keys of its own."""
    return is_dataclass(hint)


def _is_written(hint: Any) -> bool:
    """Whether a TOML value can have that type."""
    bare = bare_type(hint)
    origin = get_origin(bare)
    if origin in (tuple, list, dict, Literal) or bare is Any or is_model(bare):
        return True
    return bare in (bool, int, float, str, dt.date) or (isinstance(bare, type) and issubclass(bare, Enum))


def _meta(hint: Any) -> Meta | None:
    """Return the last annotation of a field that `setting` made, also that of a part of a union."""
    for item in reversed(getattr(hint, "__metadata__", ())):
        if isinstance(item, Meta) and item.extra is not None:
            return item
    return None


def bare_type(hint: Any) -> Any:
    """Return a type without its annotations."""
    return hint.__origin__ if get_origin(hint) is Annotated else hint


def alternatives(hint: Any) -> tuple[Any, ...]:
    """Return the types that a value may have: the members of a union without None, or the type itself."""
    bare = bare_type(hint)
    if get_origin(bare) in (Union, UnionType):
        return tuple(part for part in get_args(bare) if part is not NoneType)
    return (hint,)


def words_of(hint: Any) -> tuple[str, ...]:
    """Return the words that are allowed, for a choice; else empty."""
    bare = bare_type(hint)
    if get_origin(bare) is Literal:
        return tuple(map(str, get_args(bare)))
    return tuple(str(item.value) for item in bare) if isinstance(bare, type) and issubclass(bare, Enum) else ()


def kind_in_words(hint: Any, plural: bool = False) -> str:
    """Return what a type allows in words.

    >>> kind_in_words(Count | None), kind_in_words(tuple[Positive, ...]), kind_in_words(bool)
    ('a whole number of at least 1', 'one number or a list of numbers above 0', 'true or false, without quotes')
    >>> kind_in_words(float | tuple[float, ...])
    'a number or a list of numbers'
    """
    parts = alternatives(hint)
    alone = not any(map(_is_scalar, parts))
    return " or ".join(dict.fromkeys(_one_kind(part, plural, alone) for part in parts))


def _one_kind(hint: Any, plural: bool, alone: bool) -> str:
    bare = bare_type(hint)
    if words := words_of(hint):
        return f"one of {', '.join(words)}"
    if get_origin(bare) in (tuple, list):
        items = [part for part in get_args(bare) if part is not Ellipsis]
        size = "" if Ellipsis in get_args(bare) or get_origin(bare) is list else f"{len(items)} "
        one = "one number or " if alone and not size and bare_type(items[0]) in (int, float) else ""
        return f"{one}{size or 'a list of '}{kind_in_words(items[0], plural=True)}"
    if bare is bool:
        return "true or false, without quotes"
    if bare in (int, float):
        number = "whole number" if bare is int else "number"
        return f"{number}s{_bounds(hint)}" if plural else f"a {number}{_bounds(hint)}"
    if bare is dt.date:
        return "a day as 2026-03-31"
    if bare is str:
        return "texts" if plural else "a text in quotes"
    return "tables" if plural else "a table"


_BOUNDS = {"ge": "of at least", "gt": "above", "le": "of at most", "lt": "below"}


def _bounds(hint: Any) -> str:
    notes = getattr(hint, "__metadata__", ())
    known = {name: value for item in notes for name in _BOUNDS if (value := getattr(item, name)) is not None}
    if known.keys() >= {"ge", "le"}:
        return f" from {known['ge']:g} to {known['le']:g}"
    return " and".join(f" {_BOUNDS[name]} {value:g}" for name, value in known.items())


def _scalar(key: Key, hint: Any, value: Any) -> tuple[Any, str, str]:
    """Return a single value as its type has it, what is wrong with it, and what to give instead; "" if it is allowed.

    Each type of a union is tried by itself: msgspec 0.23 aborts on a union of a bounded number and a tuple.
    """
    problem, allowed = f"is {value_in_words(value)}", key.extra.get("hint") or f"give {kind_in_words(hint)}"
    for part in alternatives(hint):
        if not _is_scalar(part):
            continue
        try:
            found = _date(value) if bare_type(part) is dt.date else msgspec.convert(value, part)
        except (msgspec.ValidationError, ValueError):
            continue
        is_number = isinstance(found, float) and not math.isfinite(found)
        if is_number and not (key.extra.get("infinite") and found == math.inf):
            break
        return found, "", ""
    words = [words_of(part) for part in alternatives(hint)]
    is_choice = all(words) and isinstance(value, str) and not key.extra.get("hint")
    return value, problem, nearest(value, sum(words, ())) if is_choice else allowed


def _date(value: Any) -> dt.date:
    """Return a day, written as a date of TOML or as a text in the order of ISO 8601 or with points; ValueError."""
    if isinstance(value, dt.date) and not isinstance(value, dt.datetime):
        return value
    if not isinstance(value, str):
        raise ValueError
    return dt.datetime.strptime(value, "%d.%m.%Y").date() if "." in value else dt.date.fromisoformat(value)


def _is_scalar(hint: Any) -> bool:
    bare = bare_type(hint)
    return not is_model(bare) and get_origin(bare) not in (tuple, list, dict) and bare is not Any


@dataclass(frozen=True)
class Place:
    """Where in a file values stand, and the mistakes that were found in the file so far.

    `excused`: full keys that are missing because of another mistake, such as a misspelt name. `by_option`: full keys
    that --set gave. `tables`: returns the models of the file's tables, to say where a key belongs.
    """

    where: str
    prefix: str = ""
    mistakes: list[ConfigurationError] = field(default_factory=list)
    excused: list[str] = field(default_factory=list)
    by_option: Collection[str] = ()
    tables: Callable[[], Mapping[str, Any]] | None = None

    def key(self, name: str) -> str:
        """Return file and full key, for an error message; or --set and the key, if that gave it or a part of it."""
        full = f"{self.prefix}{name}"
        given = self.is_option(name) or any(key.startswith(f"{full}.") for key in self.by_option)
        return f"--set {full}" if given else f"{self.where}: {full}"

    def is_option(self, name: str) -> bool:
        """Whether --set gave the key, or the list of which it is an item."""
        return f"{self.prefix}{name}".partition("[")[0] in self.by_option

    def home_of(self, name: str) -> str:
        """Return the table of the file that has a key of that name, if only one has; else an empty text."""
        models = self.tables() if self.tables else {}
        homes = [table for table, model in models.items() if name in keys_of(model)]
        return homes[0] if len(homes) == 1 and self.prefix != f"{homes[0]}." else ""

    @property
    def is_whole(self) -> bool:
        """Whether the whole file could be read: no line of it is broken."""
        return all(mistake.key for mistake in self.mistakes if self._is_own(mistake))

    def below(self, name: str) -> Place:
        """Return the place of the table `name` in this one."""
        return replace(self, prefix=f"{self.prefix}{name}.")

    def fault(self, name: str, problem: str, hint: str = "") -> ConfigurationError:
        """Return an error about one key."""
        found = ConfigurationError(f"{self.key(name)}: {problem}", hint)
        found.key, found.file = f"{self.prefix}{name}", self.where
        return found

    def whole(self, fault: CdtoolError) -> ConfigurationError:
        """Return an error about the table itself."""
        if not self.prefix:
            return ConfigurationError(f"{self.where}: {fault.message}", fault.hint)
        above, dot, table = self.prefix.removesuffix(".").rpartition(".")
        return replace(self, prefix=f"{above}{dot}").fault(table, fault.message, fault.hint)

    def note(self, name: str, problem: str, hint: str = "") -> None:
        """Remember a mistake, so that the rest of the file is checked as well."""
        self._add(self.fault(name, problem, hint))

    def _add(self, mistake: ConfigurationError) -> None:
        """Remember a mistake, unless it only follows from one about the same key or a part of it."""
        if not mistake.key or not self.has_mistake(mistake.key):
            self.mistakes.append(mistake)

    def _is_own(self, mistake: ConfigurationError) -> bool:
        """Whether a mistake is of this file: one of a file that it names has keys of its own."""
        return mistake.file in ("", self.where)

    def has_mistake(self, *keys: str) -> bool:
        """Whether a mistake is about one of these full keys or a part of it, or excuses one of them."""
        own = [f"{known.key}.".replace("[", ".") for known in self.mistakes if self._is_own(known)]
        names, excused = ([f"{key}.".replace("[", ".") for key in some] for some in (keys, self.excused))
        return any(name.startswith(tuple(excused)) or any(key.startswith(name) for key in own) for name in names)

    def tried(self, otherwise: Made, make: Callable[..., Made], *given: Any) -> Made:
        """Return what `make` makes of what is given; after an error, which is remembered, `otherwise`."""
        with self.noting():
            return make(*given)
        return otherwise

    @contextmanager
    def at(self, name: str, value: Any = None) -> Iterator[None]:
        """Name the key in an error that is raised inside; with a value, that it is this one is what is wrong.

        An error of a file that the key names stays as it is.
        """
        try:
            yield
        except ConfigurationError as fault:
            fault.key = fault.key or f"{self.prefix}{name}"
            raise
        except UsageError as fault:
            problem = fault.message if value is None else f"is {value_in_words(value)}"
            raise self.fault(name, problem, fault.hint) from fault

    @contextmanager
    def noting(self) -> Iterator[None]:
        """Remember an error that is raised inside instead of raising it."""
        try:
            yield
        except MistakesError as faults:
            for fault in faults.mistakes:
                self._add(fault)
        except ConfigurationError as fault:
            self._add(fault)

    def finish(self) -> None:
        """Raise the mistakes that were found, all at once."""
        if self.mistakes:
            raise MistakesError.of(self.mistakes)


_WRONG: Any = object()


def read(model: type[Model], values: Mapping[str, Any], place: Place, **filled_in: Any) -> Model | None:
    """Return the model that the `values` of a table describe, with every mistake in `place`.

    `filled_in` are fields that are not keys.

    A wrong value is replaced by its default, or by some value of its type, so that what depends on it can still be
    checked: use the model only if `place` has no mistakes. A single value stands for a list with one. None if the
    values do not fit together.
    """
    keys, known = keys_of(model), len(place.mistakes)
    given = {}
    for name, value in values.items():
        if name not in keys:
            home = place.home_of(name)
            meant = get_close_matches(name, keys.keys() - values.keys(), n=1)
            place.excused.extend(f"{place.prefix}{key}" for key in meant)
            where = f"write {home}.{name}" if place.is_option(name) else f"it belongs in [{home}]"
            place.note(name, "unknown key", where if home else nearest(name, keys))
        elif (found := _value(keys[name], keys[name].hint, name, value, place)) is not _WRONG:
            given[keys[name].attribute] = found
    for name, key in keys.items():
        if key.required and name not in values and place.is_whole:
            place.note(name, "is missing", key.allowed)
        elif key.required and name not in values:  # perhaps on a line that is not TOML
            place.excused.append(f"{place.prefix}{name}")
        if key.required and key.attribute not in given:
            given[key.attribute] = _stand_in(key.hint)
    return _made(model, {**given, **filled_in}, place, known)


def _stand_in(hint: Any) -> Any:
    """Return some value of a type."""
    bare = bare_type(alternatives(hint)[0])
    if is_model(bare):
        return read(bare, {}, Place(""))
    if get_origin(bare) is Literal:
        return get_args(bare)[0]
    if get_origin(bare) in (tuple, list):
        return tuple(_stand_in(part) for part in get_args(bare) if part is not Ellipsis)
    if isinstance(bare, type) and issubclass(bare, Enum):
        return next(iter(bare))
    return {bool: False, str: "?"}.get(bare, 1)


def _made(model: type[Model], given: Mapping[str, Any], place: Place, known: int) -> Model | None:
    """Return the model of these values; None if some do not fit together, with every mistake in `place`.

    Values that do not fit are replaced by their defaults to check the others.
    """
    try:
        return model(**given)
    except FieldsError as fault:
        names = {key.attribute: name for name, key in keys_of(model).items()}
        parts = [attribute.partition("[") for attribute in fault.fields]  # of an item: points[2].name
        concerned = [f"{names[attribute]}{bracket}{item}" for attribute, bracket, item in parts]
        if not place.has_mistake(*(f"{place.prefix}{name}" for name in concerned)):  # else it follows from the default
            place.note(concerned[0], fault.problem, fault.hint)
        others = given.keys() - {attribute for attribute, *_ in parts}
        if len(others) < len(given) and not any(keys_of(model)[names[attribute]].required for attribute, *_ in parts):
            return _made(model, {name: given[name] for name in others}, place, known)
    except CdtoolError as fault:
        if len(place.mistakes) == known:  # else it may only follow from a value that was replaced
            place.mistakes.append(place.whole(fault))
    return None


def _value(key: Key, hint: Any, name: str, value: Any, place: Place) -> Any:
    """Return a value as its type has it, or _WRONG with its mistakes in `place`."""
    if bare_type(hint) is Any:
        return value
    parts = alternatives(hint)
    kinds = [bare_type(part) for part in parts]
    tables = [kind for kind in kinds if is_model(kind) or get_origin(kind) is dict]
    if tables and isinstance(value, dict):
        return _table(key, tables[0], value, place.below(name))
    lists = [kind for kind in kinds if get_origin(kind) in (tuple, list)]
    of_tables = bool(lists) and is_model(bare_type(get_args(lists[0])[0]))
    stands_alone = not of_tables and not any(map(_is_scalar, parts))
    if lists and (isinstance(value, list | tuple) or stands_alone):
        return _list(key, lists[0], name, value, place)
    found, problem, allowed = _scalar(key, hint, value)
    if problem and of_tables:
        allowed = key.extra.get("hint") or f"write each as a table [[{place.prefix}{name}]]"
    elif problem and len(tables) == len(kinds):
        table = f"add a table [{place.prefix}{name}]"
        allowed = key.extra.get("hint") or (
            f"give one of its keys: {name}.KEY=VALUE" if place.is_option(name) else table
        )
    if not problem:
        problem, allowed = _size(found)
    if problem:
        place.note(name, problem, allowed)
        return _WRONG
    return found


def _size(value: Any) -> tuple[str, str]:
    """Return what is wrong with the size of a number, and what to do; empty texts if nothing is."""
    is_size = isinstance(value, float) and 0.0 < abs(value) < math.inf
    if not is_size or 1.0 / _LARGEST <= abs(value) <= _LARGEST:
        return "", ""
    hint = f"no quantity is above {_LARGEST:g} or, unless 0, below {1.0 / _LARGEST:g}: check the unit"
    return f"is {value_in_words(value)}", hint


def _table(key: Key, kind: Any, values: Mapping[str, Any], place: Place) -> Any:
    """Return a table: a model, or one whose keys are names that the user chooses, without those with a wrong value."""
    if is_model(kind):
        found = read(kind, values, place)
        return _WRONG if found is None else found
    every = {name: _value(key, get_args(kind)[1], name, value, place) for name, value in values.items()}
    return {name: value for name, value in every.items() if value is not _WRONG}


def _list(key: Key, hint: Any, name: str, value: Any, place: Place) -> Any:
    """Return a list; a single value is a list with one. Its items are counted from 1; --set may have joints=a,b."""
    kinds = [part for part in get_args(hint) if part is not Ellipsis]
    if isinstance(value, str) and str in map(bare_type, alternatives(kinds[0])) and place.is_option(name):
        value = [part.strip() for part in value.split(",")]
    single = not isinstance(value, list | tuple)
    items = [value] if single else value
    if not items and _is_scalar(kinds[0]) and not key.extra.get("empty"):
        place.note(name, "is empty", key.allowed)
        return _WRONG
    if Ellipsis not in get_args(hint) and get_origin(hint) is tuple and len(items) != len(kinds):
        place.note(name, f"has {len(items)} values", key.allowed)
        return _WRONG
    names = [name if single else f"{name}[{i}]" for i in range(1, len(items) + 1)]
    found = [_value(key, kinds[0], own, item, place) for own, item in zip(names, items, strict=True)]
    return tuple(_stand_in(kinds[0]) if item is _WRONG else item for item in found)


def check(values: Any) -> None:
    """Raise FieldsError for the first field of a model whose value its annotation does not allow.

    For `__post_init__` of a model that is also made in Python.
    """
    for key in keys_of(type(values)).values():
        value, parts = getattr(values, key.attribute), alternatives(key.hint)
        if any(is_model(bare_type(part)) or get_origin(bare_type(part)) is dict for part in parts):
            continue
        lists = [bare_type(part) for part in parts if get_origin(bare_type(part)) is tuple]
        is_list = bool(lists) and hasattr(value, "__len__") and not isinstance(value, str | dict)
        for item in value if is_list else (value,):
            if item is None and NoneType in get_args(bare_type(key.hint)):
                continue
            number = item.item() if getattr(item, "shape", None) == () else item  # of numpy
            _, problem, allowed = _scalar(key, get_args(lists[0])[0] if is_list else key.hint, number)
            if problem:
                raise FieldsError((key.attribute,), problem, allowed)
