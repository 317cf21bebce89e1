"""Frozen dataclasses that are completed at their first use: they behave as frozen dataclasses."""

from __future__ import annotations

import copy
import inspect
import pickle
import subprocess
import sys
import threading
from abc import ABC, abstractmethod
from dataclasses import FrozenInstanceError, dataclass, field, fields, is_dataclass, replace
from pathlib import Path

import pytest

from cdtool.frozen import frozen


@frozen
class Base:
    count: int
    names: tuple[str, ...] = field(default=(), metadata={"meaning": "names"})


@frozen
class Derived(Base):
    last: str = "z"


@dataclass(frozen=True)
class Plain(Base):
    last: str = "z"


class Undecorated(Derived):
    pass


@pytest.mark.parametrize("kind", [Derived, Plain, Undecorated])
def test_it_has_the_fields_methods_and_equality_of_a_frozen_dataclass(kind):
    value = kind(3, last="y")
    assert [item.name for item in fields(kind)] == ["count", "names", "last"]
    assert is_dataclass(kind)
    assert value == kind(3, (), "y") != kind(4, (), "y")
    assert hash(value) == hash(kind(3, (), "y"))
    assert repr(value) == f"{kind.__name__}(count=3, names=(), last='y')"
    assert replace(value, count=5).count == 5
    with pytest.raises(FrozenInstanceError):
        value.count = 4
    with pytest.raises(TypeError, match="count"):
        kind()
    with pytest.raises(TypeError, match="other"):
        kind(3, other=4)


def _fresh() -> type:
    @frozen
    class Fresh:
        """A class that no one has used."""

        count: int
        name: str = "a"

    return Fresh


def _plain() -> type:
    @dataclass(frozen=True)
    class Fresh:
        """A class that no one has used."""

        count: int
        name: str = "a"

    return Fresh


@pytest.mark.parametrize(
    "question",
    [
        lambda kind: [item.name for item in fields(kind)],
        is_dataclass,
        lambda kind: str(inspect.signature(kind)),
        lambda kind: repr(kind(2)).rpartition(".")[2],
        lambda kind: kind(2) == kind(2),
        lambda kind: [item.name for item in fields(dataclass(frozen=True)(type("Child", (kind,), {})))],
        lambda kind: kind(2).__match_args__,
    ],
    ids=["fields", "is_dataclass", "signature", "repr", "equality", "derived", "match"],
)
def test_the_first_question_to_a_class_has_the_answer_of_a_dataclass(question):
    assert question(_fresh()) == question(_plain())


def test_a_class_pattern_matches_by_position_and_ignores_a_class_without_instances():
    unused = _fresh()
    match Derived(3, ("a",)):
        case unused(count, name):
            found = (count, name)
        case Base(count, names):
            found = (count, names)
    assert found == (3, ("a",))


def test_a_class_without_a_docstring_gets_its_signature_as_docstring():
    @frozen
    class Undocumented:
        count: int

    assert Undocumented(2).count == 2
    assert Undocumented.__doc__ == "Undocumented(count: 'int')"


def test_an_abstract_class_stays_abstract():
    @frozen
    class Abstract(ABC):
        count: int

        @property
        @abstractmethod
        def words(self) -> str:
            """Nothing."""

    @frozen
    class Concrete(Abstract):
        words = "a"

    with pytest.raises(TypeError, match="abstract"):
        Abstract(2)
    assert Concrete(2).count == 2


_OTHER_PROCESS = """
import pickle, sys
first, second = pickle.loads(sys.stdin.buffer.read())
sys.exit(0 if first == second and len({first, second}) == 1 else 1)
"""


def test_values_from_another_process_are_equal_there_too():
    values = pickle.dumps((Base(3, ("a",)), Base(3, ("a",))))
    run = [sys.executable, "-c", _OTHER_PROCESS]
    assert subprocess.run(run, input=values, cwd=Path(__file__).parents[1], check=False).returncode == 0


def test_copies_are_equal():
    value = Derived(3, ("a",))
    assert copy.copy(value) == copy.deepcopy(value) == pickle.loads(pickle.dumps(value)) == value


def test_threads_that_use_a_class_first_at_once_all_get_complete_instances():
    for _ in range(20):
        kind, values, start = _fresh(), [], threading.Barrier(4)

        def make(kind=kind, values=values, start=start):
            start.wait()
            values.append(kind(2, name="b"))

        threads = [threading.Thread(target=make) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert values == [kind(2, "b")] * 4
