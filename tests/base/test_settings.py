"""Models of settings: every mistake of a table at once, each by its key, with what is allowed."""

from __future__ import annotations

import datetime as dt
import pickle
from dataclasses import dataclass, field
from enum import Enum
from typing import Annotated, Literal

import numpy as np
import pytest

from cdtool.base.errors import ConfigurationError, FieldsError, MistakesError, UsageError
from cdtool.base.files.bounded_loading import read_toml
from cdtool.base.settings import (
    NOT_A_KEY,
    Count,
    NotNegative,
    Place,
    Positive,
    check,
    read,
    setting,
    tables_of,
)


class Side(Enum):
    ONE = "one"
    TWO = "two"


@dataclass(frozen=True, kw_only=True)
class Inner:
    rate: Annotated[Positive, setting("how often", key="rate_hz", unit="Hz")]
    name: str = ""


@dataclass(frozen=True, kw_only=True)
class Outer:
    mass: Annotated[Positive, setting("of the load", key="mass_kg", unit="kg")] = 1.0
    count: Count | None = None
    latch: bool = False
    side: Side = Side.ONE
    shape: Literal["line", "table"] = "line"
    names: tuple[str, ...] = ()
    limits: Annotated[tuple[Positive, ...], setting("limits", infinite=True)] = ()
    gravity: NotNegative | tuple[float, float, float] = 9.81
    inner: Inner | None = None
    groups: dict[str, Inner] = field(default_factory=dict)
    made: Annotated[Inner | None, NOT_A_KEY] = None

    def __post_init__(self) -> None:
        check(self)
        if self.latch and self.count is None:
            raise FieldsError(("latch", "count"), "is given without count", "give count")
        if len(self.names) > 1 and self.mass > 5.0:
            raise FieldsError(("mass", "names"), "is above 5 for several names", "give one name")


def mistakes(**values: object) -> list[str]:
    place = Place("m.toml", tables=lambda: tables_of(Outer))
    read(Outer, values, place)
    return [str(item) for item in place.mistakes]


def test_values_become_those_of_the_model():
    place = Place("m.toml")
    found = read(
        Outer,
        {
            "mass_kg": 2,
            "side": "two",
            "names": "a",
            "limits": [1, float("inf")],
            "gravity": [0, 0, -9.81],
            "inner": {"rate_hz": 3},
            "groups": {"any name": {"rate_hz": 1.0, "name": "x"}},
        },
        place,
    )
    assert not place.mistakes and found == Outer(
        mass=2.0,
        side=Side.TWO,
        names=("a",),
        limits=(1.0, float("inf")),
        gravity=(0.0, 0.0, -9.81),
        inner=Inner(rate=3.0),
        groups={"any name": Inner(rate=1.0, name="x")},
    )


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"mass_kg": "2"}, "m.toml: mass_kg: is '2' (give a number above 0)"),
        ({"mass_kg": True}, "m.toml: mass_kg: is true (give a number above 0)"),
        ({"mass_kg": float("nan")}, "m.toml: mass_kg: is nan (give a number above 0)"),
        ({"mass_kg": 1e15}, "m.toml: mass_kg: is 1e+15 (no quantity is above 1e+12 or, unless 0, below 1e-12: check"),
        ({"mass": 2.0}, "m.toml: mass: unknown key (did you mean mass_kg? known:"),
        ({"rate_hz": 2.0}, "m.toml: rate_hz: unknown key (it belongs in [inner])"),
        ({"count": 1.5}, "m.toml: count: is 1.5 (give a whole number of at least 1)"),
        ({"latch": "yes"}, "m.toml: latch: is 'yes' (give true or false, without quotes)"),
        ({"side": "oen"}, "m.toml: side: is 'oen' (did you mean one? known: one, two)"),
        ({"shape": 3}, "m.toml: shape: is 3 (give one of line, table)"),
        ({"names": ["a", 1]}, "m.toml: names[2]: is 1 (give a text in quotes)"),
        ({"limits": [1.0, -2.0]}, "m.toml: limits[2]: is -2 (give a number above 0)"),
        ({"gravity": -9.81}, "m.toml: gravity: is -9.81 (give a number of at least 0 or 3 numbers)"),
        ({"gravity": [0.0, 1.0]}, "m.toml: gravity: has 2 values (give a number of at least 0 or 3 numbers)"),
        ({"inner": 3}, "m.toml: inner: is 3 (add a table [inner])"),
        ({"inner": {}}, "m.toml: inner.rate_hz: is missing (give a number above 0)"),
        ({"groups": {"x": {"rate_hz": 0}}}, "m.toml: groups.x.rate_hz: is 0 (give a number above 0)"),
        ({"made": {"rate_hz": 1}}, "m.toml: made: unknown key"),
        ({"latch": True}, "m.toml: latch: is given without count (give count)"),
    ],
)
def test_a_mistake_names_its_key_its_value_and_what_is_allowed(values, said):
    (found,) = mistakes(**values)
    assert found.startswith(said)


def test_all_mistakes_of_a_file_come_at_once_each_of_them_once():
    found = mistakes(mass_kg=-1, latch=2, groups={"a": {"rate_hz": "x", "nmae": 1}, "b": 3}, inner={"name": "n"})
    assert [line.split(": ")[1] for line in found] == [
        "mass_kg",
        "latch",
        "groups.a.rate_hz",
        "groups.a.nmae",
        "groups.b",
        "inner.rate_hz",
    ]


def test_values_that_do_not_fit_together_are_named_with_the_other_mistakes_of_the_table():
    pairs = {"latch": True, "mass_kg": 6, "names": ["a", "b"]}
    latch, mass = "m.toml: latch: is given without count", "m.toml: mass_kg: is above 5 for several names"
    said = [item.split(" (")[0] for item in mistakes(**pairs)]
    assert said == [latch, mass]
    said = [item.split(" (")[0] for item in mistakes(**pairs, gravity="much")]
    assert said == ["m.toml: gravity: is 'much'", latch, mass]


def test_values_are_not_compared_with_one_that_is_wrong():
    said = [item.split(" (")[0] for item in mistakes(latch=True, count="two", mass_kg=6, names=["a", "b"])]
    assert said == ["m.toml: count: is 'two'", "m.toml: mass_kg: is above 5 for several names"]


def test_an_error_of_fields_crosses_processes():
    fault = pickle.loads(pickle.dumps(FieldsError(("mass", "names"), "is above 5", "give less")))
    assert (str(fault), fault.fields, fault.hint) == ("mass is above 5 (give less)", ("mass", "names"), "give less")


def test_what_only_follows_from_a_mistake_is_not_a_second_one():
    place = Place("m.toml")
    read(Outer, {"inner": {"rate_hz": "x"}}, place)
    place.note("inner", "is missing")
    with pytest.raises(ConfigurationError, match=r"inner\.rate_hz: is 'x'"):
        place.finish()
    assert len(place.mistakes) == 1


def test_several_mistakes_are_one_error_and_a_single_one_is_itself():
    place = Place("m.toml", by_option=["mass_kg"])
    read(Outer, {"mass_kg": -1, "latch": 2}, place)
    with pytest.raises(MistakesError, match=r"--set mass_kg: is -1[^\n]*\nm.toml: latch: is 2"):
        place.finish()


def test_a_model_made_in_python_is_checked_by_the_same_annotations():
    assert Outer(count=np.int64(3)).count == 3
    with pytest.raises(UsageError, match="mass is -1"):
        Outer(mass=-1.0)
    with pytest.raises(UsageError, match="limits is -1"):
        Outer(limits=(1.0, -1.0))


@dataclass(frozen=True)
class Day:
    day: dt.date | None = None


@pytest.mark.parametrize("written", [dt.date(2026, 11, 12), "2026-11-12", "12.11.2026"])
def test_a_day_is_one_of_toml_or_a_text_whose_order_is_certain(written):
    place = Place("p.toml")
    assert read(Day, {"day": written}, place) == Day(dt.date(2026, 11, 12)) and not place.mistakes


@pytest.mark.parametrize("written", ["12/11/2026", "12.11.26", "30.2.2026", dt.datetime(2026, 11, 12, 10), 20261112])
def test_another_day_is_refused(written):
    place = Place("p.toml")
    read(Day, {"day": written}, place)
    (mistake,) = place.mistakes
    assert mistake.hint == "give a day as 2026-03-31"


def test_a_broken_line_is_one_mistake_and_the_rest_of_the_file_is_read(tmp_path):
    path = tmp_path / "m.toml"
    path.write_text('mass_kg = -1\ncount =\n[inner\nrate_hz = 3\n[groups.a]\nrate_hz = "x"\n', encoding="utf-8")
    place = Place("m.toml")
    read(Outer, read_toml(path, "a machine file", place), place)
    lines = [str(mistake) for mistake in place.mistakes]
    assert ["at line 2" in lines[0], "at line 3" in lines[1]] == [True, True]
    assert [line.split(": ")[1] for line in lines[2:]] == ["mass_kg", "groups.a.rate_hz"]


@pytest.mark.parametrize("key", ["names", "limits"])
def test_an_empty_list_is_refused_unless_the_field_allows_it(key):
    (found,) = mistakes(**{key: []})
    assert f"m.toml: {key}: is empty" in found


@pytest.mark.parametrize(
    "given",
    [{"mass": {}}, {"mass": (1.0,)}, {"mass": np.array([1.0, 2.0])}, {"side": {}}, {"limits": {}}, {"limits": "x"}],
)
def test_python_values_of_another_kind_are_refused(given):
    with pytest.raises(UsageError, match=next(iter(given))):
        Outer(**given)
