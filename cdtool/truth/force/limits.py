"""Force limits: the largest allowed force of a contact, as steps over the time since it began. Data, not code.

A profile may limit the contact pressure too, by area of the body; only a test protocol assesses it.

Conventions: time counts from the contact's onset [s]; a step applies from its `from_s` to the next step's, the last one
to the end of the record. The shipped file is limits.toml in this folder; a user's file replaces it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from cdtool.base.errors import ConfigurationError, UsageError, nearest
from cdtool.base.tables import Table, read_toml
from cdtool.base.value_words import value_in_words

_SHIPPED = Path(__file__).with_name("limits.toml")
# Requirements on the measurement: they change no verdict on a contact, only what a test protocol concludes from it.
_MEASURING = ("sample_rate_at_least_hz", "record_at_least_s", "obstacle_stiffness_n_per_mm", "measuring_source")
_PRESSURE = ("pressures", "pressure_source")


@dataclass(frozen=True)
class ForceStep:
    """From `from_s` [s] after the onset on, the force may be at most `at_most_n` [N]."""

    from_s: float
    at_most_n: float
    name: str


@dataclass(frozen=True)
class PressureLimit:
    """The allowed pressure on an area of the body [N/cm2].

    `quasi_static` applies from the second step of the profile on, `transient` before it; None: there is no transient
    allowance, and the quasi-static limit applies from the first moment.
    """

    area: str
    quasi_static: float
    transient: float | None = None

    @property
    def first(self) -> float:
        """Return the limit from the first moment of the contact on [N/cm2]."""
        return self.quasi_static if self.transient is None else self.transient


@dataclass(frozen=True)
class ForceProfile:
    """Named force limits in steps, with their source; the steps begin at 0 s and their times increase.

    `checked`: someone has checked the values against the text of the standard. `average_of`: the number of tests at one
    point that are averaged; 1: each test is assessed on its own. What a test protocol requires of a measurement, 0 for
    no requirement, with `measuring_source`: the lowest sample rate [Hz], the shortest record after the onset [s], and
    the stiffness of the obstacle, which is the spring of the force meter [N/mm]. `pressures`, with `pressure_source`:
    the allowed pressures on the areas of the body region, for a test protocol; empty: pressure is not limited.
    `permissible`: False of a region that nothing may touch: no contact passes, whatever its force.
    """

    name: str
    title: str
    source: str
    checked: bool
    steps: tuple[ForceStep, ...]
    average_of: int = 1
    note: str = ""
    sample_rate_at_least_hz: float = 0.0
    record_at_least_s: float = 0.0
    obstacle_stiffness_n_per_mm: float = 0.0
    measuring_source: str = ""
    pressures: tuple[PressureLimit, ...] = ()
    pressure_source: str = ""
    permissible: bool = True

    @property
    def warning(self) -> str:
        """What a report has to state with results of this profile; empty if its values were checked."""
        return "" if self.checked else "values to be checked against the standard"

    @property
    def described(self) -> dict[str, Any]:
        """Return what determines the verdict on a force, for provenance: without what only a test protocol uses."""
        # As files of earlier versions have it: without what is so of nearly every region.
        beside = (*_MEASURING, *_PRESSURE, *(("permissible",) if self.permissible else ()))
        return {name: value for name, value in asdict(self).items() if name not in beside}

    def pressure_limit(self, area: str = "") -> PressureLimit | None:
        """Return the limit of an area; without one the lowest of all areas, and None of a profile without pressures.

        It has the lowest quasi-static and the lowest first limit, which may be those of two areas. Raises UsageError
        for an area that the profile does not have.
        """
        if area:
            known = {item.area: item for item in self.pressures}
            if area not in known:
                raise UsageError(
                    f"the profile '{self.name}' has no pressure for the body area '{area}'",
                    nearest(area, known) if known else "remove body_area",
                )
            return known[area]
        if not self.pressures:
            return None
        lowest = min(self.pressures, key=lambda item: (item.quasi_static, item.first))
        return PressureLimit(lowest.area, lowest.quasi_static, min(item.first for item in self.pressures))

    def ends(self, step: int) -> float:
        """Return until when a step applies [s after the onset]; infinite for the last one."""
        return self.steps[step + 1].from_s if step + 1 < len(self.steps) else float("inf")


def read_force_limits(path: Path | None = None) -> dict[str, ForceProfile]:
    """Read the force profiles of a file.

    Parameters
    ----------
    path : Path, optional
        A TOML file; by default the shipped one.

    Returns
    -------
    dict of str to ForceProfile
        The profiles by name.

    Raises
    ------
    ConfigurationError
        The file is wrong; the message names file, key and reason.

    Examples
    --------
    >>> profile = read_force_limits()["en_12453_reducing_gap"]
    >>> [(step.name, step.from_s, step.at_most_n) for step in profile.steps]
    [('dynamic', 0.0, 400.0), ('static', 0.75, 150.0), ('residual', 5.0, 25.0)]
    """
    file = _SHIPPED if path is None else path
    where = str(file) if path else "the shipped limits.toml"
    root = Table(read_toml(file, "a file of force limits"), where)
    profiles = {name: _profile(name, root.table(name)) for name in root.values}
    if not profiles:
        raise ConfigurationError(
            f"{where}: contains no profile", "write one table per profile, see docs/force-limits.md"
        )
    return profiles


def profile_of(profiles: Mapping[str, ForceProfile], name: str) -> ForceProfile:
    """Return the force profile of a name.

    Parameters
    ----------
    profiles : mapping of str to ForceProfile
        The profiles of a file.
    name : str
        The name.

    Returns
    -------
    ForceProfile
        The profile.

    Raises
    ------
    UsageError
        The name is unknown; the hint lists the nearest known ones.

    Examples
    --------
    >>> profile_of(read_force_limits(), "en_12453_reducing_gap").ends(0)
    0.75
    """
    if name not in profiles:
        raise UsageError(f"unknown force profile '{name}'", nearest(name, profiles))
    return profiles[name]


def _profile(name: str, table: Table) -> ForceProfile:
    profile = ForceProfile(
        name=name,
        title=_words(table, "title"),
        source=_words(table, "source"),
        checked=table.flag("checked", False),
        steps=_steps(table),
        average_of=table.whole("average_of", 1, minimum=1),
        note=table.text("note", ""),
        sample_rate_at_least_hz=table.number("sample_rate_at_least_hz", 0.0, minimum=0.0),
        record_at_least_s=table.number("record_at_least_s", 0.0, minimum=0.0),
        obstacle_stiffness_n_per_mm=table.number("obstacle_stiffness_n_per_mm", 0.0, minimum=0.0),
        measuring_source=table.text("measuring_source", ""),
        pressures=_pressures(table),
        pressure_source=table.text("pressure_source", ""),
        permissible=table.flag("permissible", True),
    )
    _check_pressures(profile, table)
    table.finish()
    return profile


def _steps(table: Table) -> tuple[ForceStep, ...]:
    listed = table.raw("steps")
    if not isinstance(listed, list) or not listed or not all(isinstance(item, dict) for item in listed):
        problem = "is missing" if listed is None else f"is {value_in_words(listed)}"
        raise table.fault(
            "steps", problem, "give a list such as [{ from_s = 0.0, at_most_n = 400.0, name = 'dynamic' }]"
        )
    steps: list[ForceStep] = []
    for i, item in enumerate(listed):
        row = Table(item, table.where, f"{table.prefix}steps[{i}].")
        step = ForceStep(row.number("from_s"), row.number("at_most_n", above=0.0), _words(row, "name"))
        row.finish()
        if not steps and step.from_s != 0.0:
            raise row.fault("from_s", f"is {step.from_s:g}", "the first step begins with the contact, at 0")
        if steps and step.from_s <= steps[-1].from_s:
            raise row.fault("from_s", f"is {step.from_s:g} after {steps[-1].from_s:g}", "times must increase")
        if any(step.name == earlier.name for earlier in steps):
            raise row.fault("name", f"'{step.name}' names two steps", "give each step a different name")
        steps.append(step)
    return tuple(steps)


def _pressures(table: Table) -> tuple[PressureLimit, ...]:
    listed = table.raw("pressures", [])
    if not isinstance(listed, list) or not all(isinstance(item, dict) for item in listed):
        hint = "give a list such as [{ area = 'palm', transient_n_per_cm2 = 520, quasi_static_n_per_cm2 = 260 }]"
        raise table.fault("pressures", f"is {value_in_words(listed)}", hint)
    limits: list[PressureLimit] = []
    for i, item in enumerate(listed):
        row = Table(item, table.where, f"{table.prefix}pressures[{i}].")
        quasi_static = row.number("quasi_static_n_per_cm2", above=0.0)
        transient = row.number("transient_n_per_cm2", above=0.0) if "transient_n_per_cm2" in row else None
        limit = PressureLimit(_words(row, "area"), quasi_static, transient)
        row.finish()
        if transient is not None and transient < quasi_static:
            hint = f"give at least the quasi-static one, {quasi_static:g}"
            raise row.fault("transient_n_per_cm2", f"is {transient:g}", hint)
        if any(limit.area == earlier.area for earlier in limits):
            raise row.fault("area", f"'{limit.area}' names two areas", "give each area a different name")
        limits.append(limit)
    return tuple(limits)


def _check_pressures(profile: ForceProfile, table: Table) -> None:
    """Raise ConfigurationError for pressures without a source, or without the time at which the transient one ends."""
    if profile.pressures and not profile.pressure_source.strip():
        raise table.fault(
            "pressure_source", "is missing", "state from where the pressures are: standard, edition, table"
        )
    if len(profile.steps) < 2 and any(item.transient is not None for item in profile.pressures):
        raise table.fault(
            "steps", "has one step", "give a second one: from its time on, the quasi-static pressure applies"
        )


def _words(table: Table, name: str) -> str:
    text = table.text(name)
    if not text.strip():
        raise table.fault(name, "is empty", "give a text")
    return text
