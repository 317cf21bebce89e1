"""An identified parameter with its standard error, and a parameter that cannot be identified, with the reason."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from enum import Enum
from typing import Any

from cdtool.base.errors import CdtoolError


class IdentificationError(CdtoolError):
    """Nothing can be identified from these recordings; the message names the recording and the reason."""


class Method(Enum):
    """How a parameter was identified."""

    LEAST_SQUARES = "least squares"
    INSTRUMENTAL_VARIABLES = "instrumental variables"
    OUTPUT_ERROR = "output error"
    LOADED_RUNS = "runs with and without a known payload"
    FEASIBLE_LEAST_SQUARES = "physically consistent least squares"


class Missing(Enum):
    """What the recordings would need so that a parameter could be identified."""

    SECOND_SPEED = "runs at other speeds"
    REVERSALS = "runs in both directions"
    ACCELERATION = "runs with stronger acceleration"
    START_UP = "recordings that begin at rest and contain the start of the motion"
    REFERENCE_TORQUE = "the torque reference"
    SATURATION = "a motion during which the limit is reached"
    PAYLOAD = "runs with a known payload"
    PAYLOAD_CENTRE = "the payload's centre of mass (--payload 3.2kg:X,Y,Z)"
    MOTOR_INERTIA = "the motor inertia from its data sheet"
    OTHER_MOTION = "a motion that excites this joint independently of the others"
    MORE_RECORDINGS = "more recordings"
    HIGHER_RATE = "a higher sampling rate"
    GENTLER_START = "starts with less acceleration, which wind the drive up less"
    FINER_MOTION = "a speed or position channel with less noise or finer steps"
    OTHER_CONTROLLER = "references of a P or PI speed controller, alone or under a P position controller"
    TORQUE_FILTER = "the time constant of the torque's low-pass in [model.sensors]"


@dataclass(frozen=True)
class Estimate:
    """An identified parameter on the load side, under the key of the machine file.

    `value` and `standard_error` in `unit`; a standard error that is not known is NaN. `joint`: its index. `section`:
    the table of the machine file, such as "machine" or "model.drive". Raises ValueError for a value that is not finite.
    """

    section: str
    key: str
    value: float
    standard_error: float
    unit: str
    method: Method
    joint: int = 0

    def __post_init__(self) -> None:
        if not math.isfinite(self.value):
            raise ValueError(f"{self.section}.{self.key} is {self.value}")
        if self.standard_error < 0.0:
            raise ValueError(f"the standard error of {self.section}.{self.key} is {self.standard_error}")

    @property
    def relative_error(self) -> float:
        """Return standard error / |value|; infinite for a value of 0."""
        return self.standard_error / abs(self.value) if self.value else math.inf

    @property
    def summary(self) -> dict[str, Any]:
        """Return the estimate as JSON values."""
        return {**asdict(self), "method": self.method.value}


@dataclass(frozen=True)
class NotIdentifiable:
    """A parameter that these recordings do not determine: what they would need, and the numbers that show it.

    `numbers` are named in their unit, for example {"speeds": 1, "condition_number": 150.0}.
    """

    section: str
    key: str
    missing: tuple[Missing, ...]
    numbers: Mapping[str, float] = field(default_factory=dict)
    joint: int = 0

    @property
    def relative_error(self) -> float:
        """Return the relative standard error of a parameter that is too uncertain; NaN where it is not known."""
        value = abs(self.numbers.get("value", 0.0))
        return self.numbers.get("standard_error", math.nan) / value if value > 0.0 else math.nan

    @property
    def summary(self) -> dict[str, Any]:
        """Return it as JSON values."""
        return {**asdict(self), "missing": [missing.name.lower() for missing in self.missing]}


@dataclass(frozen=True)
class Identified:
    """The outcome of a method: what was identified, and what cannot be."""

    estimates: tuple[Estimate, ...]
    not_identifiable: tuple[NotIdentifiable, ...] = ()

    @classmethod
    def of(cls, answers: Sequence[Estimate | NotIdentifiable]) -> Identified:
        """Return answers in their order, those that are estimates apart from the others."""
        return cls(
            tuple(item for item in answers if isinstance(item, Estimate)),
            tuple(item for item in answers if isinstance(item, NotIdentifiable)),
        )

    def __getitem__(self, key: str) -> Estimate:
        for estimate in self.estimates:
            if estimate.key == key:
                return estimate
        raise KeyError(key)

    def __contains__(self, key: object) -> bool:
        return any(estimate.key == key for estimate in self.estimates)
