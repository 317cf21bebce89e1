"""Parts of benchmark.toml that are a few plain settings each; every error names its key."""

from __future__ import annotations

from collections.abc import Sequence

from cdtool.activation import Activation
from cdtool.errors import UsageError, nearest
from cdtool.evaluation.false_alarm_budget import Budget
from cdtool.evaluation.truth.onset_rule import LONGEST_HOLD, SAMPLE, OnsetRule
from cdtool.tables import Table


def read_budget(table: Table) -> Budget | None:
    """`false_alarm_budget`; None where the file has none."""
    if "false_alarm_budget" not in table:
        return None
    text = table.text("false_alarm_budget")
    try:
        return Budget.parse(text)
    except UsageError as fault:
        raise table.fault("false_alarm_budget", f"is '{text}'", fault.hint) from fault


def read_watched(table: Table, joints: Sequence[str]) -> tuple[str, ...]:
    """`joints`: those to watch; empty: all of them."""
    watched = table.texts("joints", ())
    for joint in watched:
        if joint not in joints:
            raise table.fault("joints", f"names '{joint}', which the machine file does not", nearest(joint, joints))
    return watched


def read_activation(table: Table) -> Activation:
    """[activation]: how an exit from the band becomes an alarm."""
    activation = Activation(
        debounce=table.whole("debounce", 1, minimum=1) if "debounce" in table else None,
        rearm=table.number("rearm_s", Activation.rearm, minimum=0.0),
        hysteresis=_share(table, "hysteresis", Activation.hysteresis),
        latch=table.flag("latch", Activation.latch),
    )
    table.finish()
    return activation


def _share(table: Table, name: str, default: float) -> float:
    value = table.number(name, default, minimum=0.0)
    if value >= 1.0:
        raise table.fault(name, f"is {value:g}", "a number from 0 to below 1 is needed")
    return value


def migrated_onset(table: Table) -> tuple[str, ...]:
    """How a setting of an earlier version is read; nothing where there is none."""
    if "samples" not in table:
        return ()
    return (f"{table.key('samples')}: read as hold_s = {_hold(table):g} (samples of 1 kHz): write that instead",)


def _hold(table: Table) -> float:
    """`hold_s`, or `samples` of an earlier version: those of a load cell of 1 kHz, whatever this one's rate is."""
    if "samples" not in table:
        hold = table.number("hold_s", OnsetRule.hold, minimum=0.0)
        if hold > LONGEST_HOLD:
            raise table.fault("hold_s", f"is {hold:g}", f"at most {LONGEST_HOLD:g} s")
        return hold
    samples = table.whole("samples", 3, minimum=1)
    if "hold_s" in table:
        raise table.fault(
            "samples", "is given together with hold_s", "leave samples out: the onset rule counts in seconds"
        )
    if samples * SAMPLE > LONGEST_HOLD:
        raise table.fault(
            "samples", f"is {samples}: the onset rule counts in seconds now", f"write hold_s, at most {LONGEST_HOLD:g}"
        )
    return samples * SAMPLE


def read_onset(table: Table) -> OnsetRule:
    """[onset]: when a contact begins."""
    above = table.number("above_n", above=0.0) if "above_n" in table else None
    back_to = table.number("back_to_n", above=0.0) if "back_to_n" in table else None
    if above is not None and back_to is not None and back_to > above:
        raise table.fault("back_to_n", f"is {back_to:g}, more than above_n", "at most above_n")
    rule = OnsetRule(
        above=above,
        back_to=back_to,
        hold=_hold(table),
        sigmas=table.number("sigmas", OnsetRule.sigmas, above=0.0),
        separation=table.number("separation_s", OnsetRule.separation, above=0.0),
    )
    table.finish()
    return rule
