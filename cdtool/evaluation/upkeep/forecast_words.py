"""A forecast of false alarms in plain sentences, for the screen and for figures."""

from __future__ import annotations

import math

from cdtool.evaluation.statistics.interval import Interval
from cdtool.evaluation.upkeep.forecast import CONFOUNDED, Forecast
from cdtool.evaluation.upkeep.season_model import Effect
from cdtool.evaluation.upkeep.words import place_of, slope_words
from cdtool.plain_text import counted, digits, first_of

# Below this share of the runs the nearest place is one of many.
_MANY_PLACES = 0.3


def forecast_lines(found: Forecast) -> tuple[str, ...]:
    """Return the forecast in sentences: the share, the budget, when to relearn, where, and what it rests on.

    Parameters
    ----------
    found : Forecast
        The forecast.

    Returns
    -------
    tuple of str
        One sentence each.

    Examples
    --------
    `cdtool.forecast_signature` returns the forecast of each class.
    """
    return (*headlines(found), _where(found), *_model(found))


def headlines(found: Forecast) -> tuple[str, str, str]:
    """Return the share, the budget and when to relearn, in a sentence each.

    Parameters
    ----------
    found : Forecast
        The forecast.

    Returns
    -------
    tuple of str
        Three sentences.

    Examples
    --------
    `cdtool.forecast_signature` returns the forecast of each class.
    """
    return _expected(found), _budget(found), _relearn(found)


def _expected(found: Forecast) -> str:
    """Return the expected share with its interval."""
    share = f"{_percent(found.share.value)} of the runs ({_percents(found.share)})"
    alarms = found.alarms
    number = (
        f"{round(alarms.value)} ({round(alarms.low)} to {round(alarms.high)}) of {counted(found.coming_runs, 'run')}"
    )
    seen = f"so far {found.so_far[0]} of {found.so_far[1]}"
    return f"false alarms expected in {share}{_range(found)}: {number}; {seen}"


def _budget(found: Forecast) -> str:
    """Return at which temperatures a run exceeds the budget; without temperatures, whether the share does."""
    budget = f"the budget of {_percent(found.budget)}"
    if found.colder is None or found.warmer is None or found.by_temperature is None:
        return f"{budget} is {'exceeded' if found.exceeds else 'met'} over the coming time"
    low, high = found.by_temperature.at[0], found.by_temperature.at[-1]
    parts = []
    if math.isfinite(found.colder.value):
        parts.append(f"below {_degrees(found.colder)}")
    if math.isfinite(found.warmer.value):
        parts.append(f"above {_degrees(found.warmer)}")
    if parts:
        return f"{budget} is exceeded {' and '.join(parts)}"
    perhaps = []
    if math.isfinite(found.colder.high):
        perhaps.append(f"below {found.colder.high:.1f} °C")
    if math.isfinite(found.warmer.low):
        perhaps.append(f"above {found.warmer.low:.1f} °C")
    doubt = f"; not excluded {' and '.join(perhaps)} (95 %)" if perhaps else ""
    return f"{budget} is met from {low:.1f} to {high:.1f} °C{doubt}"


def _relearn(found: Forecast) -> str:
    """Return when the signature has to be relearned, with its interval."""
    by, starts = found.relearn_by, found.by_time.at
    earliest, latest = found.date(by.low), found.date(by.high)
    end = found.date(found.ends)
    if by.value <= starts[0]:
        doubt = "" if by.high <= starts[0] else f" (95 %: to {latest})" if latest else f" (95 %: to after {end})"
        return f"relearn now: the budget is exceeded from {found.date(float(starts[0]))} on{doubt}"
    if math.isfinite(by.value):
        return f"relearn by {found.date(by.value)} (95 %: {earliest} to {latest or f'after {end}'})"
    doubt = f" (95 %: not excluded from {earliest} on)" if earliest else ""
    return f"no need to relearn until {end}{doubt}"


def _model(found: Forecast) -> tuple[str, ...]:
    """Return what the forecast rests on: runs, dependence on temperature and time, extrapolation, runs left out."""
    seen = found.seen_temperatures
    span = f", {seen[0]:.1f} to {seen[1]:.1f} °C" if seen else ""
    days = f" of {counted(found.days, 'day')}" if found.origin else ""
    unit = "day" if found.origin else "run"
    lines = [f"seen: {counted(len(found.runs), 'run')}{days}{span}"]
    temperature, time = found.effect("temperature"), found.effect("time")
    if temperature is not None:
        lines.append(_effect(temperature, "temperature", "kelvin", found))
    elif seen is None:
        lines.append("temperature is not known: only the drift is forecast")
    if time is not None:
        lines.append(_effect(time, "time", unit, found))
    else:
        lines.append(
            f"temperature and time are correlated by {found.correlation:.2f}, more than {CONFOUNDED:g}: all change "
            "counts as that of temperature"
        )
    what = "temperature and time" if seen else "time"
    lines.append(
        f"{what} explain{'' if seen else 's'} {100.0 * found.explained:.0f} % of the variance between runs; "
        f"{found.residual:.2g} spreads remain"
    )
    if found.beyond > 0.0 and seen and found.coming_temperatures:
        colder, warmer = seen[0] - found.coming_temperatures[0], found.coming_temperatures[1] - seen[1]
        parts = [f"{kelvin:.1f} K {word}" for kelvin, word in ((colder, "colder"), (warmer, "warmer")) if kelvin > 0.0]
        lines.append(
            f"extrapolated: up to {' and '.join(parts)} than seen; the interval allows for a curve instead of a line"
        )
    if found.left_out:
        names = first_of([item.demand.name for item in found.left_out])
        lines.append(f"not used: {names}: far from what temperature and time explain; see cdtool explain")
    return tuple(lines)


def _effect(effect: Effect, name: str, unit: str, found: Forecast) -> str:
    slope = slope_words(effect.slope, unit)
    of = f" of {found.joints[effect.joint]}" if len(found.joints) > 1 else ""
    if effect.shown:
        return f"the level{of} changes with {name} by {slope}"
    return f"no dependence on {name} shown at a level of 1 %: {slope}"


def _where(found: Forecast) -> str:
    place = place_of(found.place.at, found.place.axis, found.unit)
    limit = f"the limit of {found.place.joint}" if len(found.joints) > 1 else "the limit"
    share = f"in {100.0 * found.place.share:.0f} % of the runs"
    if found.place.share < _MANY_PLACES:
        return f"runs come nearest to {limit} all along the stroke, most often {place} ({share})"
    return f"runs come nearest to {limit} {place} ({share})"


def _range(found: Forecast) -> str:
    coming = found.coming_temperatures
    return f" from {coming[0]:.1f} to {coming[1]:.1f} °C" if coming else ""


def _degrees(found: Interval) -> str:
    low, high = (f"{value:.1f}" if math.isfinite(value) else "not at all" for value in (found.low, found.high))
    return f"{found.value:.1f} °C (95 %: {low} to {high})"


def _percents(share: Interval) -> str:
    return f"95 %: {_percent(share.low).removesuffix(' %')} to {_percent(share.high)}"


def _percent(share: float) -> str:
    """Two digits, and no more than a tenth of a per mille."""
    percent = 100.0 * share
    if percent >= 10.0:
        return f"{percent:.0f} %"
    return f"{digits(float(f'{percent:.2g}'))} %" if percent >= 0.01 else "0.0 %" if percent == 0.0 else "< 0.01 %"
