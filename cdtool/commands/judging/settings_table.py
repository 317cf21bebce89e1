"""The settings by which recordings are judged: keys of a benchmark file, which `--set` also sets."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

from cdtool.alarms.activation import Activation
from cdtool.base.errors import UsageError
from cdtool.base.files.bounded_loading import ContentError, parse_toml
from cdtool.base.settings import Model, NotNegative, Place, Positive, read, setting
from cdtool.commands.judging.named_logs import OnsetTable
from cdtool.thresholds.signature import Signature


@dataclass(frozen=True, kw_only=True)
class OperationsTable:
    """How a log is cut."""

    by: Annotated[str, setting("whole, motion, trigger, column:NAME, label:NAME or clock-reset")]


@dataclass(frozen=True, kw_only=True)
class ForceTable:
    """[force]: limits of the contact force, and the mass before the load cell."""

    profile: Annotated[str, setting("name of the force limits for all groups")] = ""
    limits: Annotated[str, setting("your own file of force limits; default: the shipped one")] = ""
    mass_before_cell_kg: Annotated[
        NotNegative,
        setting("mass between load cell and contact: the cell does not measure its inertial force", unit="kg"),
    ] = 0.0


@dataclass(frozen=True, kw_only=True)
class JudgingTable:
    """The settings that `detect`, `explain`, `learn-signature`, `score`, `benchmark` and `tune` share."""

    joints: Annotated[
        tuple[str, ...], setting("the joints whose signal is monitored, as in the machine file; default: all")
    ] = ()
    operations: Annotated[
        str | OperationsTable,
        setting(
            "how a log is cut: whole, motion or trigger; into runs, which count as recordings: column:NAME, label:NAME "
            "or clock-reset"
        ),
    ] = "whole"
    window_s: Annotated[
        Positive,
        setting("an alarm belongs to a contact up to this long after its onset, or until the next contact", unit="s"),
    ] = 1.0
    threshold: Annotated[
        str | dict[str, Any],
        setting(
            'the threshold\'s name, or a table with `name` and its settings; name = "limit" with limits sets fixed ones'
        ),
    ] = "signature"
    false_alarm_budget: Annotated[
        str | None, setting('"1/1000op" or "0.1/h": sets each detector\'s safety factor for it; default: none')
    ] = None
    signature: Annotated[Signature, setting("how the normal band is learned")] = field(default_factory=Signature)
    activation: Annotated[Activation, setting("how an exit from the limits becomes an alarm")] = field(
        default_factory=Activation
    )
    onset: Annotated[OnsetTable, setting("when a contact begins")] = field(default_factory=OnsetTable)
    force: Annotated[ForceTable, setting("limits of the contact force")] = field(default_factory=ForceTable)

    @property
    def cut(self) -> str:
        """Return how a log is cut."""
        return self.operations if isinstance(self.operations, str) else self.operations.by


def apply_settings(values: Mapping[str, Any], settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of a file with those of `--set`, whose keys have dots between the tables."""
    found = dict(values)
    for key, value in settings.items():
        *tables, name = key.split(".")
        table = found
        for above in tables:
            inner = table.get(above)
            # threshold = "cusum" and [threshold] name = "cusum" say the same.
            table[above] = dict(inner) if isinstance(inner, dict) else {"name": inner} if inner else {}
            table = table[above]
        table[name] = value
    return found


def read_settings(model: type[Model], texts: Iterable[str]) -> Model:
    """Return the model with the values of --set KEY=VALUE; raises ConfigurationError with every mistake."""
    given = given_settings(texts)
    place = Place("--set", by_option={key: f"--set {key}" for key in given})
    found = read(model, apply_settings({}, given), place)
    place.finish()
    assert found is not None, "without a mistake the model is made"
    return found


def given_settings(texts: Iterable[str]) -> dict[str, Any]:
    """Return the values of --set KEY=VALUE, as TOML has them; a bare word is a text. Raises UsageError.

    >>> given_settings(["activation.debounce=9", "threshold.name=cusum"])
    {'activation.debounce': 9, 'threshold.name': 'cusum'}
    """
    found = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            hint = "give KEY=VALUE; the page of the command in docs/ has the keys"
            raise UsageError(f"--set is '{text}'", hint)
        try:
            found[name] = parse_toml(f"value = {value}")["value"]
        except ContentError:
            found[name] = value
    return found
