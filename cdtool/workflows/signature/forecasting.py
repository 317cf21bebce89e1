"""Forecast a signature's false alarms over the coming temperatures, from a season of runs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date, datetime, time
from pathlib import Path

import numpy as np

from cdtool.errors import SignatureError, UsageError
from cdtool.evaluation.false_alarm_budget import Budget
from cdtool.evaluation.results import RecordingFinding, Skipped
from cdtool.evaluation.upkeep.ambient import Ambient, read_ambient, read_expected
from cdtool.evaluation.upkeep.demand import Demand, demand_of
from cdtool.evaluation.upkeep.forecast import LEAST_DAYS, Coming, Forecast, forecast_season
from cdtool.evaluation.upkeep.season_model import SeasonRun
from cdtool.operations import Operation
from cdtool.pipeline import judge
from cdtool.remote.remote_path import location, relative_name
from cdtool.same_values import equal_by_values
from cdtool.short_repr import short_repr
from cdtool.signature_file import SignatureFile
from cdtool.signature_store import read_signature
from cdtool.thresholds.common_class import SPEED_TOLERANCE
from cdtool.thresholds.fitted_signature import FittedSignature
from cdtool.workflows.keyword_options import by_keywords
from cdtool.workflows.runs import Runs
from cdtool.workflows.signature.fitting import Pair, signals_of
from cdtool.workflows.signature.upkeep import SeasonOptions, no_signature_for, signatures_in

_DAY = 86400.0
# Expected temperatures by date are taken together by the week.
_WEEK = 7.0
# By default a forecast reaches this share of the season ahead.
_HALF = 0.5
_MOST_RUNS = 10_000_000
_NOTHING_NEW = "give runs of a learned class that the signature was not learned from"


@dataclass(frozen=True, kw_only=True)
class ForecastOptions(SeasonOptions):
    """How a signature's false alarms are forecast.

    Parameters
    ----------
    ambient : str or Path, optional
        A CSV with recording, date and temperature_c of each log. Without it, or without temperatures in it, only the
        drift over the runs, or dates, is used.
    temperatures : tuple of float, optional
        Lowest and highest coming temperature [°C], all between equally frequent. By default those seen.
    expected : str or Path, optional
        In place of `temperatures`: a CSV with date and temperature_c of the coming time.
    until : str, optional
        How far to forecast: a day, or a number of runs where there are no dates. By default half as far ahead as the
        runs cover, or to the end of `expected`.
    false_alarm_budget : str, optional
        The share of operations that may raise a false alarm, as 1/100op. By default that of the signature file.
    seed : int, optional
        Seed of the resampled days.
    """

    ambient: str | Path | None = None
    temperatures: tuple[float, float] | None = None
    expected: str | Path | None = None
    until: str | None = None
    false_alarm_budget: str | None = None
    seed: int = 0


@dataclass(frozen=True)
class Forecasted:
    """The forecasts of a signature file per class, the number of runs learned from, and what was left out.

    Runs that the signature was learned from are not used: they are nearer to it than others.
    """

    file: SignatureFile
    budget: Budget
    classes: tuple[Forecast, ...]
    learned: int
    skipped: tuple[Skipped, ...]
    findings: tuple[RecordingFinding, ...]

    __repr__ = short_repr
    __eq__ = equal_by_values


def forecast_by(path: str | Path, options: ForecastOptions) -> Forecasted:
    """Forecast the share of runs with a false alarm over coming temperatures, and when to relearn a signature.

    Parameters
    ----------
    path : str or Path
        The signature file.
    options : ForecastOptions
        The season's logs with dates and temperatures, the coming temperatures and the budget.

    Returns
    -------
    Forecasted
        For each class of motion the expected share with its interval, the temperatures and the time from which the
        budget is exceeded, and what the model explains.

    Raises
    ------
    SignatureError
        The file does not belong to the machine, contains another threshold or no budget, or the season supports no
        forecast.
    ConfigurationError
        A table of ambient temperatures is wrong.
    UsageError
        An option is wrong, or two do not go together.
    CdtoolError
        No log can be read.

    Notes
    -----
    See `forecast_season`. Runs that the signature was learned from are recognised by their content and not used.

    Examples
    --------
    >>> import cdtool
    >>> from cdtool.signature_store import write_signature
    >>> from cdtool.simulation.season import Season, write_gate_season
    >>> from pathlib import Path
    >>> runs = write_gate_season(Path("season"), Season(45, friction_per_kelvin=-0.01, runs_per_day=3), seed=1)
    >>> logs, machine = sorted(Path("season/free").iterdir()), "season/machine.toml"
    >>> write_signature("july.json", cdtool.learn_signature(logs[:12], machine, "momentum").signature)
    >>> table, budget = "season/ambient.csv", "1/20op"
    >>> done = cdtool.forecast_signature(
    ...     "july.json", logs, machine, ambient=table, temperatures=(8.0, 20.0), false_alarm_budget=budget
    ... )
    >>> forecast = done.classes[0]
    >>> forecast.so_far, forecast.effect("temperature").shown, forecast.exceeds
    ((0, 33), True, True)
    """
    file = read_signature(path)
    signatures = signatures_in(file)
    budget = _budget(file, options.false_alarm_budget)
    _check_options(options)
    machine_file = options.machine_file()
    detector = machine_file.detector(file.detector)
    file.check(machine_file.machine, detector)
    expected = read_expected(location(options.expected)) if options.expected else None
    runs = options.runs(file, machine_file)
    ambient = _ambient(options, runs)
    pairs, unusable = signals_of(runs.operations, machine_file.machine, detector, file.joints, runs.skipped)
    known = {(run.sha256, run.operation) for run in file.runs}
    season = [pair for pair in pairs if (pair[0].recording.digest, pair[0].number) not in known]
    skipped = [*runs.skipped, *unusable]
    seasons = _Season(options, budget, ambient, expected, skipped)
    classes, refused = [], []
    for current, _ in signatures:
        own = [pair for pair in season if current.motion.matches(pair[0].motion, SPEED_TOLERANCE)]
        if not own and len(signatures) > 1:
            continue
        try:
            classes.append(seasons.forecast(file, current, own))
        except SignatureError as fault:
            refused.append(fault)
            skipped.append(Skipped(current.motion.described, str(fault)))
    if not classes:
        raise refused[0] if refused else SignatureError("no run to forecast from", _NOTHING_NEW)
    served = [current for current, _ in signatures]
    skipped += [
        Skipped(item.name, no_signature_for(item.motion, served))
        for item, _ in season
        if not any(current.motion.matches(item.motion, SPEED_TOLERANCE) for current in served)
    ]
    return Forecasted(file, budget, tuple(classes), len(pairs) - len(season), tuple(skipped), runs.findings)


forecast_signature = by_keywords(ForecastOptions, forecast_by)


def _budget(file: SignatureFile, text: str | None) -> Budget:
    if text is None and file.origin.budget is None:
        raise UsageError(f"{file.source}: states no false-alarm budget", "give --false-alarm-budget, as 1/100op")
    budget = Budget.parse(text or file.origin.budget or "")
    if budget.per != "operation" or not budget.rate < 1.0:
        raise UsageError(f"false-alarm budget is {budget}", "a forecast counts operations: give it as 1/100op")
    return budget


def _check_options(options: ForecastOptions) -> None:
    both = options.temperatures
    if both is not None and options.expected is not None:
        raise UsageError("both a range and a table of coming temperatures", "give --temperatures or --expected")
    for name, value in (("--temperatures", both), ("--expected", options.expected)):
        if value is not None and options.ambient is None:
            raise UsageError(f"{name} is given, but not the temperatures of the logs", "add --ambient with their dates")
    if both is not None and not (-100.0 <= both[0] < both[1] <= 200.0):
        raise UsageError(f"temperatures are {both[0]:g} to {both[1]:g}", "give the lower one first, in °C, as -10:5")


def _ambient(options: ForecastOptions, runs: Runs) -> Mapping[str, Ambient]:
    """Return date and temperature by the names of logs or runs."""
    if options.ambient is None:
        return {}
    table = location(options.ambient)
    names: dict[str, str] = {}
    for operation in runs.operations:
        for recording in (operation.recording, operation.whole):
            names[_below(recording.name, table)] = recording.name
            names[_below(_log(recording.name), table)] = _log(recording.name)
    return {names[name]: item for name, item in read_ambient(table, list(names)).items()}


def _below(name: str, table: Path) -> str:
    """Return the path of a recording from the folder of the table."""
    return relative_name(location(name).absolute(), table.absolute().parent)


def _log(name: str) -> str:
    return name.rpartition("#")[0] or name


@dataclass(frozen=True)
class _Season:
    """The season of one class in the making: options, tables, and what is left out of it."""

    options: ForecastOptions
    budget: Budget
    ambient: Mapping[str, Ambient]
    expected: Sequence[Ambient] | None
    skipped: list[Skipped]

    def forecast(self, file: SignatureFile, signature: FittedSignature, pairs: Sequence[Pair]) -> Forecast:
        """Return the forecast of one class; raises SignatureError."""
        if not pairs:
            raise SignatureError("no run to forecast from", _NOTHING_NEW)
        demands = self._demands(file, signature, pairs)
        origin: datetime | None = None
        if self.ambient:
            dated = self._with_temperature([(item, at) for item, at in demands if at is not None])
            if not dated:
                raise SignatureError("no run to forecast from", f"see why the logs of {self.table} are left out")
            origin = dated[0][1].when
            runs = [SeasonRun(item, _days(at.when, origin), at.temperature, at.day) for item, at in dated]
            coming = self._coming_days(runs, origin)
        else:
            runs = _by_number([item for item, _ in demands])
            coming = self._coming_runs(runs)
        position = pairs[0][0].recording.channels.get("position")
        unit = position.unit if position is not None else ""
        return forecast_season(
            *(signature, runs, coming, self.budget.rate), seed=self.options.seed, origin=origin, unit=unit
        )

    @property
    def table(self) -> str:
        """The name of the table, for messages."""
        return str(self.options.ambient)

    def _demands(
        self, file: SignatureFile, signature: FittedSignature, pairs: Sequence[Pair]
    ) -> list[tuple[Demand, Ambient | None]]:
        demands: list[tuple[Demand, Ambient | None]] = []
        for operation, signal in pairs:
            detection = judge(operation, "", signal, (signature,), file.activation)
            ambient = _ambient_of(operation, self.ambient)
            if detection.verdict.outcome == "not_assessable":
                self._leave_out(operation.name, f"not assessable: {detection.verdict.reason}")
            elif self.ambient and ambient is None:
                self._leave_out(operation.name, f"no row in {self.table}")
            else:
                demands.append((demand_of(signature, detection, file.activation), ambient))
        return demands

    def _with_temperature(self, dated: list[tuple[Demand, Ambient]]) -> list[tuple[Demand, Ambient]]:
        """Return the runs in order of time; without those whose temperature is missing, if others have one."""
        dated = sorted(dated, key=lambda pair: pair[1].when)
        known = [pair for pair in dated if not math.isnan(pair[1].temperature)]
        if not known:
            if self.options.temperatures is not None or self.expected is not None:
                raise SignatureError(
                    f"{self.table}: no log has a temperature", "omit the coming temperatures: only drift is forecast"
                )
            return dated
        for item, at in dated:
            if math.isnan(at.temperature):
                self._leave_out(item.name, f"no temperature in {self.table}")
        return known

    def _leave_out(self, name: str, reason: str) -> None:
        self.skipped.append(Skipped(name, reason))

    def _coming_days(self, runs: Sequence[SeasonRun], origin: datetime) -> Coming:
        first, last = runs[0].time, runs[-1].time
        until = self.options.until
        end = last + _HALF * (last - first) if until is None else _days(_day_of(until), origin) + 1.0
        per_day = len(runs) / max(last - first, 1.0)
        if self.expected is None:
            if until is None and not end > last:
                raise SignatureError("all runs are of one time", "give dates with times, or --until")
            if not end > last:
                raise UsageError(f"--until is {until}", "give a day after the last run")
            known = [item.temperature for item in runs if not math.isnan(item.temperature)]
            within = self.options.temperatures or ((min(known), max(known)) if known else None)
            return Coming.over_range(within, last, end, round(per_day * (end - last)))
        both = [(_days(at.when, origin), at.temperature) for at in self.expected]
        both = [(time, temperature) for time, temperature in both if time > last and (until is None or time <= end)]
        if not both:
            raise SignatureError(
                f"{self.options.expected}: no date is in the coming time", "give dates after that of the last run"
            )
        times, temperatures = np.array(both).T
        if float(times.min()) - last > _WEEK:
            days = round(float(times.min()) - last)
            raise SignatureError(
                f"{self.options.expected}: begins {days} days after the last run", "add the days between the two"
            )
        if until is not None and float(times.max()) < end - 1.0:
            raise SignatureError(f"{self.options.expected}: ends before --until {until}", "add days, or omit --until")
        return Coming.by_time(temperatures, times, _WEEK, round(per_day * (float(times[-1]) - last)))

    def _coming_runs(self, runs: Sequence[SeasonRun]) -> Coming:
        until = self.options.until
        ahead = max(len(runs) // 2, 1)
        if until is not None:
            if not until.isascii() or not until.isdigit() or not 0 < int(until) <= _MOST_RUNS:
                raise UsageError(f"--until is '{until}'", "the runs have no dates: give a number of runs, or --ambient")
            ahead = int(until)
        return Coming.over_range(None, float(len(runs)), float(len(runs) + ahead), ahead)


def _ambient_of(operation: Operation, ambient: Mapping[str, Ambient]) -> Ambient | None:
    names = (operation.name, operation.whole.name, _log(operation.name))
    return next((ambient[name] for name in names if name in ambient), None)


def _by_number(demands: Sequence[Demand]) -> list[SeasonRun]:
    """Return runs without dates: the run is the time, and a few consecutive ones count as a day."""
    length = max(min(round(len(demands) ** (1.0 / 3.0)), len(demands) // LEAST_DAYS), 1)
    return [SeasonRun(item, float(i + 1), math.nan, i // length) for i, item in enumerate(demands)]


def _days(when: datetime, origin: datetime) -> float:
    return (when - origin).total_seconds() / _DAY


def _day_of(text: str) -> datetime:
    try:
        return datetime.combine(date.fromisoformat(text), time())
    except ValueError as fault:
        raise UsageError(f"--until is '{text}'", "give a day such as 2026-03-31") from fault
