"""What a person writes into a test protocol: machine, test, instruments and measuring points.

Conventions: each field states its meaning, and whether a complete protocol needs it and when it is due. From these the
file is read, drafted and checked. Units are in the names. An empty text or None is a value that is not known yet.
"""

from __future__ import annotations

import datetime as dt
from collections.abc import Iterator
from dataclasses import dataclass, field, fields
from typing import Annotated, Any, Literal

from msgspec import Meta

from cdtool.base.errors import FieldsError
from cdtool.base.settings import CountFromZero, NotNegative, check, setting

Due = Literal["before_test", "test_day", "never"]
Language = Literal["en", "de"]
FORCE, PRESSURE = "force", "pressure"
# The mark of a value that a draft leaves open; a value that begins with it counts as missing.
FILL_IN = "FILL IN"
# A measured speed may differ from the planned one by this share if the plan states no other, and at most by so much.
SPEED_TOLERANCE, MOST_SPEED_TOLERANCE = 0.1, 0.25


def entry(meaning: str, due: Due = "before_test", default: Any = "") -> Any:
    """A dataclass field with its meaning, and until when it must be filled in; `never`: it may stay empty."""
    return field(default=default, metadata={"meaning": meaning, "due": due})


@dataclass(frozen=True)
class MachineParticulars:
    """The machine under test."""

    type: str = entry("type of the machine, as on its plate")
    maker: str = entry("who made it")
    serial_number: str = entry("serial number, as on its plate")
    installation: str = entry("where and how it is installed")
    software_version: str = entry("version of its control software and of its parameters")


@dataclass(frozen=True)
class TestParticulars:
    """Who tested, when, where and under which conditions."""

    tester: str = entry("name of the person who tests, and signs")
    organisation: str = entry("test body or company", due="never")
    date: dt.date | None = entry("day of the test, as 2026-03-31", default=None)
    place: str = entry("place of the test")
    temperature_c: float | None = entry("temperature at the machine [°C]", due="test_day", default=None)
    humidity_percent: Annotated[float, Meta(ge=0.0, le=100.0)] | None = entry(
        "relative humidity [%]", due="never", default=None
    )
    conditions: str = entry("other conditions: wind, supply voltage, warm-up", due="never")

    __test__ = False  # not a test of pytest


@dataclass(frozen=True)
class Instrument:
    """One measuring instrument; the first of the quantity "force" measured the contact forces."""

    quantity: str = entry('what it measures: "force", "pressure", "speed", "temperature"')
    model: str = entry("maker and model")
    serial_number: str = entry("serial number")
    calibrated_on: dt.date | None = entry("day of the calibration, as 2026-01-31", default=None)
    calibration_valid_until: dt.date | None = entry("last day on which the calibration is valid", default=None)
    range_n: NotNegative | None = entry("largest force that it measures [N]; only of a force", default=None)
    range_n_per_cm2: NotNegative | None = entry(
        "largest pressure that it measures [N/cm2]; only of a pressure", default=None
    )
    range: str = entry("measuring range of another quantity, with its unit", due="never")
    accuracy_class: str = entry("accuracy class or uncertainty, as on the calibration certificate")
    sample_rate_hz: NotNegative | None = entry("sample rate [Hz]; only of a force", default=None)
    filter: str = entry('filter before recording, as "100 Hz low-pass, 2nd order", or "none"')

    @property
    def measures_force(self) -> bool:
        """Whether it measures a force."""
        return self.quantity == FORCE

    @property
    def not_its_own(self) -> tuple[str, ...]:
        """Return the entries that are of another quantity only."""
        of_force = () if self.measures_force else ("range_n", "sample_rate_hz", "filter")
        return of_force if self.quantity == PRESSURE else (*of_force, "range_n_per_cm2")


@dataclass(frozen=True)
class MeasuringPoint:
    """One location at which the machine is tested, several times.

    Its recordings are those of `logs`, patterns relative to the file, or of a `group` of the benchmark file.
    """

    name: str = entry("short name, each once")
    position: str = entry("where on the machine, and where along its travel")
    region: str = entry("opening gap or body region: what can be hit or crushed there")
    obstacle: str = entry("the obstacle", due="never")
    obstacle_stiffness_n_per_mm: NotNegative | None = entry(
        "stiffness of the obstacle or its spring [N/mm]", default=None
    )
    contact_area_mm2: NotNegative | None = entry("area of the contact [mm2]", default=None)
    speed_m_per_s: NotNegative | None = entry("speed at the contact [m/s]", default=None)
    repetitions: CountFromZero = entry("number of measurements", default=0)
    profile: str = entry("name of the force profile; empty: that of the recordings' group", due="never")
    group: str = entry("group of the benchmark file whose recordings are the repetitions", due="never")
    logs: tuple[str, ...] = entry("recordings of the repetitions, instead of a group", due="never", default=())
    peak_pressures_n_per_cm2: tuple[NotNegative, ...] = entry(
        "peak pressure of each repetition [N/cm2], from a film or sensor of its own", due="never", default=()
    )
    body_area: str = entry(
        "area of the body whose pressure limit applies; empty: the lowest of the region", due="never"
    )
    pressure_not_applicable: str = entry("why no pressure is measured here; shown as a deviation", due="never")
    speed_tolerance_percent: NotNegative | None = entry(
        "how far the measured speed may be from the planned one [%], at most 25; empty: 10", due="never", default=None
    )

    def __post_init__(self) -> None:
        if self.group and self.logs:
            raise FieldsError(("group", "logs"), f"is given with logs for '{self.name}'", "give one of them")
        check(self)
        if not 0.0 <= self.speed_tolerance <= MOST_SPEED_TOLERANCE:
            raise FieldsError(
                ("speed_tolerance_percent",),
                f"is {self.speed_tolerance_percent:g}",
                f"give at most {100.0 * MOST_SPEED_TOLERANCE:g}: a test at another speed is another test",
            )

    @property
    def speed_tolerance(self) -> float:
        """Return how far the measured speed may be from the planned one, as a share of it."""
        percent = self.speed_tolerance_percent
        return SPEED_TOLERANCE if percent is None else 0.01 * percent

    @property
    def no_pressure_reason(self) -> str:
        """Return why no pressure is measured; empty if it must be, or if only the mark of a draft is there."""
        text = self.pressure_not_applicable.strip()
        return "" if text.upper().startswith(FILL_IN) else text


@dataclass(frozen=True)
class Deviation:
    """A deviation from the test plan or the standard, with its reason."""

    text: str = entry("what was done differently")
    reason: str = entry("why", due="test_day")
    point: str = entry("the measuring point that it is about; empty: the whole test", due="never")


@dataclass(frozen=True)
class Exclusion:
    """Recordings that are not counted, with the reason."""

    logs: tuple[str, ...] = entry("the recordings, patterns relative to the file", due="never", default=())
    reason: str = entry("why they are not counted", due="test_day")


@dataclass(frozen=True)
class TestPlan:
    """Everything that a person states about a test; measured values are in the recordings.

    Raises FieldsError for two points of one name, and for a deviation of a point that does not exist.
    """

    number: Annotated[str, setting("number of the protocol")] = ""
    language: Annotated[Language, setting("language of the document")] = "en"
    machine: Annotated[MachineParticulars, setting("the machine under test")] = MachineParticulars()
    test: Annotated[TestParticulars, setting("who tested, when and where")] = TestParticulars()
    instruments: Annotated[tuple[Instrument, ...], setting("measuring instruments", key="instrument")] = ()
    points: Annotated[tuple[MeasuringPoint, ...], setting("measuring points", key="point")] = ()
    deviations: Annotated[tuple[Deviation, ...], setting("deviations from the plan", key="deviation")] = ()
    exclusions: Annotated[tuple[Exclusion, ...], setting("recordings that are not counted", key="exclusion")] = ()

    __test__ = False

    def __post_init__(self) -> None:
        names = [point.name for point in self.points]
        for number, item in enumerate(self.deviations, 1):
            if item.point and item.point not in names:
                field, hint = f"deviations[{number}].point", f"use one of {', '.join(filter(None, names))}"
                raise FieldsError((field,), f"names the measuring point '{item.point}'", hint)
        for number, name in enumerate(names, 1):
            if name and name in names[: number - 1]:
                problem = f"is that of another measuring point, '{name}'"
                raise FieldsError((f"points[{number}].name",), problem, "give each a name of its own")

    @property
    def force_instrument(self) -> Instrument | None:
        """Return the instrument that measured the contact forces; None if the plan does not name it."""
        return next((item for item in self.instruments if item.measures_force), None)

    @property
    def pressure_instrument(self) -> Instrument | None:
        """Return the instrument that measured the contact pressures; None if the plan does not name it."""
        return next((item for item in self.instruments if item.quantity == PRESSURE), None)


@dataclass(frozen=True)
class EmptyEntry:
    """A value that a complete protocol needs and that is not filled in: its key, and when it is due."""

    key: str
    due: Due


def empty_entries(plan: TestPlan) -> list[EmptyEntry]:
    """Return the values that are not filled in, in the order of the file.

    Parameters
    ----------
    plan : TestPlan
        The plan.

    Returns
    -------
    list of EmptyEntry
        The key of each value, as in the file, and when it is due.

    Examples
    --------
    >>> plan = TestPlan(machine=MachineParticulars(type="sliding gate", maker="A", installation="yard"))
    >>> [item.key for item in empty_entries(plan) if "machine" in item.key]
    ['protocol.machine.serial_number', 'protocol.machine.software_version']
    """
    tables: list[tuple[str, Any]] = [("machine", plan.machine), ("test", plan.test)]
    lists = {
        "instrument": plan.instruments,
        "point": plan.points,
        "deviation": plan.deviations,
        "exclusion": plan.exclusions,
    }
    for name, items in lists.items():
        tables += [(f"{name}[{number}]", item) for number, item in enumerate(items, 1)]
    return [
        EmptyEntry(f"protocol.{prefix}.{name}", due) for prefix, values in tables for name, due in _empty_of(values)
    ]


def _empty_of(values: Any) -> Iterator[tuple[str, Due]]:
    for item in fields(values):
        due: Due = item.metadata["due"]
        if due == "never" or (isinstance(values, Instrument) and item.name in values.not_its_own):
            continue
        value = getattr(values, item.name)
        # 0 is a temperature; as a speed, area, range or number of repetitions it means that nothing is stated.
        is_zero = value == 0 and item.name != "temperature_c"
        if value is None or is_zero or (isinstance(value, str) and value.strip().upper() in ("", FILL_IN)):
            yield item.name, due
