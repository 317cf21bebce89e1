"""Both languages say the same: the same keys, the same placeholders, numbers and dates as usual there."""

from __future__ import annotations

import ast
import string
import typing

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.commands.protocol.assessment.reasons import ProtocolVerdict, Reason
from cdtool.commands.protocol.document.words import LANGUAGES, words_of
from cdtool.truth.force.limits import read_force_limits
from cdtool.truth.force.verdict import CauseKind, StepCause
from tests.project.pages import ROOT


def placeholders(text: str) -> set[str]:
    return {name for _, name, _, _ in string.Formatter().parse(text) if name is not None}


def texts(language: str) -> dict[str, str]:
    tables = words_of(language).texts
    return {
        f"{table}.{key}": text for table, keys in tables.items() if isinstance(keys, dict) for key, text in keys.items()
    }


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_language_has_the_same_keys_and_the_same_placeholders(language):
    english = texts("en")
    other = {key: text for key, text in texts(language).items() if not key.startswith("of_limits.")}
    assert list(other) == list(english)
    assert {key: placeholders(text) for key, text in other.items()} == {
        key: placeholders(text) for key, text in english.items()
    }


def test_every_text_of_the_shipped_limits_is_translated():
    profiles = read_force_limits().values()
    shown = {
        text for item in profiles for text in (item.title, item.source, item.measuring_source, item.pressure_source)
    }
    areas = {limit.area for item in profiles for limit in item.pressures}
    assert set(words_of("de").texts["of_limits"]) == (shown | areas) - {""}


def reason_kinds() -> set[str]:
    """Every text that the code gives as the kind of a reason: all but the names of values and tables."""
    known = {key.removeprefix("reason.") for key in texts("en") if key.startswith("reason.")}
    trees = [ast.parse(path.read_text(encoding="utf-8")) for path in ROOT.glob("cdtool/commands/protocol/*/*.py")]
    trees += [ast.parse(path.read_text(encoding="utf-8")) for path in ROOT.glob("cdtool/commands/protocol/*.py")]
    nodes = [node for tree in trees for node in ast.walk(tree)]
    calls = [node for node in nodes if isinstance(node, ast.Call) and ast.unparse(node.func).startswith("Reason")]
    given = {node.args[0].value for node in calls if node.args and isinstance(node.args[0], ast.Constant)}
    chosen = {node.value for node in nodes if isinstance(node, ast.Constant)} & known
    return given | chosen


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_reason_and_every_cause_has_a_sentence(language):
    known = texts(language)
    assert {f"reason.{kind}" for kind in reason_kinds()} == {key for key in known if key.startswith("reason.")}
    assert {f"cause.{kind}" for kind in typing.get_args(CauseKind)} == {
        key for key in known if key.startswith("cause.")
    }
    causes, of_pressure = (words_of(language).texts[table] for table in ("cause", "pressure_cause"))
    assert {key: placeholders(text) for key, text in causes.items()} == {
        key: placeholders(text) for key, text in of_pressure.items()
    }


@given(st.floats(-2000.0, 2000.0), st.sampled_from([25.0, 150.0, 400.0, 1234.5, 399.98]))
def test_a_value_beside_its_limit_is_on_the_same_side_as_it_is_shown(value, limit):
    words = words_of("en")
    shown, shown_limit = (float(text.replace("−", "-")) for text in (words.beside(value, limit), words.limit(limit)))
    assert shown_limit == limit and (shown > limit) == (value > limit)
    assert shown == pytest.approx(value, rel=5.1e-3)


def test_no_value_of_a_reason_is_rounded_across_its_limit():
    words = words_of("de")
    exceeds = {"point": "edge", "step": "dynamic", "limit": 400.0, "count": 3, "averaged": "mean"}
    assert "400,04 N, Grenzwert 400 N" in words.reason(Reason("point_exceeds", {**exceeds, "force": 400.04}))
    assert "Fdyn 412 N" in words.reason(Reason("point_exceeds", {**exceeds, "force": 412.345}))
    about = {"point": "edge", "repetition": 1, "recording": "a.csv", "profile": "p", "step": "static"}
    short = Reason("record_too_short", {**about, "end": 4.99996, "needed": 5.0})
    assert "endet 4,99996 s nach dem Kontakt, gefordert sind 5 s" in words.reason(short)
    beyond = Reason("beyond_range", {**about, "reading": 5000.4, "range": 5000.0})
    assert "5000,4 N" in words.reason(beyond)
    cause = StepCause("may_exceed", {"missing_ms": 3.0, "most": 150.004, "limit": 150.0})
    assert "150,004 N" in words.reason(Reason("not_assessable", about, cause))
    assert "150.004 N" in cause.sentence()


def test_reasons_that_differ_only_in_place_and_measured_value_are_one_sentence():
    def short(point: str, number: int, end: float) -> Reason:
        about = {"point": point, "repetition": number, "recording": f"{number}.csv", "profile": "p"}
        return Reason("record_too_short", {**about, "end": end, "needed": 5.0})

    reasons = [short("edge", 1, 1.2), short("edge", 2, 4.9996), short("side", 1, 1.3)]
    exceeds = {"step": "static", "limit": 150.0, "count": 3, "averaged": "mean", "force": 160.0}
    failing = [Reason("point_exceeds", {"point": point, **exceeds}) for point in ("edge", "side")]
    verdict = ProtocolVerdict((*failing, *reasons))
    (sentence,) = words_of("de").reasons(verdict, "incomplete")
    assert sentence.startswith("edge, Nr. 1, 2; side, Nr. 1 (1.csv): Die Aufzeichnung endet 1,20 bis 4,9996 s nach")
    assert len(words_of("en").reasons(verdict, "fail")) == 2


def test_measurements_that_are_counted_twice_are_listed_in_one_sentence():
    about = {"other": "1.csv", "contact": 1, "other_contact": 1}
    places = [("edge", "2.csv"), ("edge", "3.csv"), ("side", "4.csv")]
    same = [Reason("same_measurement", {"point": point, "recording": log, **about}) for point, log in places]
    (sentence,) = words_of("en").reasons(ProtocolVerdict(tuple(same)), "incomplete")
    assert sentence.startswith("edge, 2.csv = 1.csv, 3.csv = 1.csv; side, 4.csv = 1.csv: the same measurement")
