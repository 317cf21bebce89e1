"""Force limits: the largest allowed force of a contact, as steps over the time since it began. Data, not code.

A profile may limit the contact pressure too, by area of the body; only a test protocol assesses it.

Conventions: time counts from the contact's onset [s]; a step applies from its `from_s` to the next step's, the last one
to the end of the record. The shipped file is limits.toml in this folder; a user's file replaces it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

from cdtool.base.errors import ConfigurationError, FieldsError, UsageError, nearest
from cdtool.base.files.bounded_loading import read_toml
from cdtool.base.settings import NOT_A_KEY, Count, NotNegative, Place, Positive, Text, read, setting
from cdtool.base.value_words import value_in_words

_SHIPPED = Path(__file__).with_name("limits.toml")
# Requirements on the measurement: they change no verdict on a contact, only what a test protocol concludes from it.
_MEASURING = ("sample_rate_at_least_hz", "record_at_least_s", "obstacle_stiffness_n_per_mm", "measuring_source")
_PRESSURE = ("pressures", "pressure_source")


@dataclass(frozen=True)
class ForceStep:
    """From `from_s` [s] after the onset on, the force may be at most `at_most_n` [N]."""

    from_s: Annotated[NotNegative, setting("from when it applies, after the onset; the first one from 0", unit="s")]
    at_most_n: Annotated[Positive, setting("the largest allowed force", unit="N")]
    name: Annotated[Text, setting("its name, each once")]


@dataclass(frozen=True)
class PressureLimit:
    """The allowed pressure on an area of the body [N/cm2].

    `quasi_static` applies from the second step of the profile on, `transient` before it; None: there is no transient
    allowance, and the quasi-static limit applies from the first moment.
    """

    area: Annotated[Text, setting("area of the body, each once")]
    quasi_static: Annotated[
        Positive, setting("from the second step of the profile on", key="quasi_static_n_per_cm2", unit="N/cm2")
    ]
    transient: Annotated[
        Positive | None,
        setting(
            "before that, at least the quasi-static one; default: the quasi-static one",
            key="transient_n_per_cm2",
            unit="N/cm2",
        ),
    ] = None

    def __post_init__(self) -> None:
        if self.transient is not None and self.transient < self.quasi_static:
            hint = f"give at least the quasi-static one, {self.quasi_static:g}"
            raise FieldsError(("transient", "quasi_static"), f"is {self.transient:g}", hint)

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

    name: Annotated[str, NOT_A_KEY]
    title: Annotated[Text, setting("what it limits, for reports")]
    source: Annotated[Text, setting("standard, edition and clause")]
    checked: Annotated[bool, setting("whether someone has checked the values against the text of the standard")] = False
    steps: Annotated[
        tuple[ForceStep, ...],
        setting(
            "the limits, required",
            hint="give a list such as [{ from_s = 0.0, at_most_n = 400.0, name = 'dynamic' }]",
        ),
    ] = ()
    average_of: Annotated[Count, setting("tests at one point that are averaged; 1: each is assessed on its own")] = 1
    note: Annotated[str, setting("for reports")] = ""
    sample_rate_at_least_hz: Annotated[NotNegative, setting("required of a measurement; 0: nothing", unit="Hz")] = 0.0
    record_at_least_s: Annotated[NotNegative, setting("required length after the onset; 0: nothing", unit="s")] = 0.0
    obstacle_stiffness_n_per_mm: Annotated[
        NotNegative, setting("of the spring of the force meter; 0: nothing is required", unit="N/mm")
    ] = 0.0
    measuring_source: Annotated[str, setting("from where these requirements are")] = ""
    pressures: Annotated[
        tuple[PressureLimit, ...],
        setting(
            "the allowed pressures on the areas of the body region, for a test protocol",
            hint="give a list such as [{ area = 'palm', transient_n_per_cm2 = 520, quasi_static_n_per_cm2 = 260 }]",
        ),
    ] = ()
    pressure_source: Annotated[str, setting("from where the pressures are: standard, edition, table")] = ""
    permissible: Annotated[bool, setting("false: a region that nothing may touch; no contact passes")] = True

    def __post_init__(self) -> None:
        for key, names in (
            ("pressures[{}].area", [item.area for item in self.pressures]),
            ("steps[{}].name", [step.name for step in self.steps]),
        ):
            for number, name in enumerate(names, 1):
                if name in names[: number - 1]:
                    raise FieldsError((key.format(number),), f"is '{name}' again", "give each a different name")
        for number, (before, after) in enumerate(pairwise(self.steps), 2):
            if after.from_s <= before.from_s:
                fields = (f"steps[{number}].from_s", f"steps[{number - 1}].from_s")
                hint = f"give more than {before.from_s:g}, of the step before"
                raise FieldsError(fields, f"is {after.from_s:g}", hint)
        if self.steps and self.steps[0].from_s != 0.0:
            hint = "give 0: the first step begins with the contact"
            raise FieldsError(("steps[1].from_s",), f"is {self.steps[0].from_s:g}", hint)
        if len(self.steps) < 2 and any(item.transient is not None for item in self.pressures):
            hint = "give a second one: from its time on, the quasi-static pressure applies"
            raise FieldsError(("steps", "pressures"), "has one step", hint)
        if self.pressures and not self.pressure_source.strip():
            hint = "state from where the pressures are: standard, edition, table"
            raise FieldsError(("pressure_source",), "is missing", hint)
        if not self.steps:
            raise FieldsError(("steps",), "are empty", "give a step from_s = 0: it begins with the contact")

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
    place = Place(where)
    values = read_toml(file, "a file of force limits", place)
    if not values:
        place.finish()
        raise ConfigurationError(
            f"{where}: contains no profile", "write one table per profile, see docs/force-limits.md"
        )
    profiles = {}
    for name, table in values.items():
        if not isinstance(table, dict):
            place.note(name, f"is {value_in_words(table)}", f"add a table [{name}]")
        elif profile := read(ForceProfile, table, place.below(name), name=name):
            profiles[name] = profile
    place.finish()
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
