"""`cdtool init`: draft a machine file from a log and mark every guess."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from cdtool.base.errors import CdtoolError, RecordingError, UsageError
from cdtool.base.files.writing import write_text, write_texts
from cdtool.base.findings import Finding, worst_first
from cdtool.base.log_names import log_stem
from cdtool.base.plain_text import counted
from cdtool.base.remote.remote_path import location, relative_name
from cdtool.base.settings import Place
from cdtool.commands.console.json_schema import refuse_other_schema, with_schema
from cdtool.commands.init.benchmark_draft import draft_benchmark
from cdtool.commands.init.channel_guess import guess_channels
from cdtool.commands.init.derived_speed import propose_low_pass
from cdtool.commands.init.draft_text import Clock, Draft, UnreadWord, draft_text, toml
from cdtool.commands.init.machine_side import Side, side_of
from cdtool.commands.init.names.units import Evidence, fits_as_well, is_si
from cdtool.commands.init.names.units_in_names import factor_of, unit_in_name
from cdtool.commands.init.speed_ratio import Ratio, ratio_of
from cdtool.commands.init.streams import Channels, column_key, streams_of
from cdtool.commands.init.table_clock import DraftedClock, split_stamp, table_clock
from cdtool.commands.init.unmapped import Unmapped, unmapped_columns
from cdtool.commands.judging.impact_free import contacts_shown
from cdtool.commands.judging.information import info
from cdtool.commands.judging.log_findings import before_contact
from cdtool.commands.judging.runs import find_logs, read, several_logs
from cdtool.formats.channels.channel_map import TablePins
from cdtool.formats.channels.reading import choose_format, element_names, has_topics, log_parts, with_nanoseconds
from cdtool.formats.csv import Csv
from cdtool.formats.csv_dialect.pins import read_pins
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.formats.source import Format, Source
from cdtool.machines.plausibility import check_channels
from cdtool.machines.urdf_reader import moving_joints
from cdtool.results.results import Skipped
from cdtool.thresholds.signature import ENOUGH_RUNS
from cdtool.truth.force_vector import with_scalar_force
from cdtool.truth.onset import OnsetRule

# Contradictions that a change of sign cures, and those of a channel that is another quantity.
_REVERSED, _ANOTHER = ("friction", "sign"), ("place", "course", "still", "joints", "other joint")


@dataclass(frozen=True, repr=False)
class Drafted:
    """The draft's text, the channels it maps, those written as comments, warnings, and the columns not mapped."""

    path: str
    text: str
    channels: tuple[str, ...]
    left_out: tuple[str, ...]
    findings: tuple[Finding, ...]
    unmapped: tuple[Unmapped, ...] = ()

    def __repr__(self) -> str:
        return f"Drafted({self.path!r}, channels {', '.join(self.channels)})"


def init(
    log: str | Path,
    output: str | Path = "machine.toml",
    *,
    force: bool = False,
    csv: Mapping[str, Any] | None = None,
    urdf: str | Path | None = None,
) -> Drafted:
    """Write a draft of a machine file for a log.

    Parameters
    ----------
    log : str or Path
        The log, or a folder with its parts.
    output : str or Path, optional
        The file to write.
    force : bool, optional
        Replace an existing file.
    csv : mapping, optional
        Keys of `[csv]` for a table that cannot be read without them, as {"header": False}; they are part of the draft.
    urdf : str or Path, optional
        The URDF of the robot: the draft is of a urdf_robot with its joints.

    Returns
    -------
    Drafted
        The text, in which CHECK marks what is uncertain; the channels mapped; those in it only as comments, because the
        log contradicts the guess; the findings of `cdtool info` with the draft; and the columns that it does not map,
        each with the next best guess.

    Raises
    ------
    UsageError
        The file already exists.
    RecordingError
        The log cannot be read.
    ConfigurationError
        `csv` has a wrong key or value.

    Examples
    --------
    >>> import cdtool
    >>> draft = cdtool.init("sample_logs/gate/stiff/03.csv", "draft.toml")
    >>> "[machine]" in draft.text, "CHECK" in draft.text, "speed" in draft.channels
    (True, True, True)
    """
    target = location(output)
    _refuse_existing(force, {"machine": target})
    return _written([location(log)], target, csv or {}, urdf)


def _written(logs: Sequence[Path], target: Path, csv: Mapping[str, Any], urdf: str | Path | None) -> Drafted:
    draft = _drafted(logs[0], csv, target.absolute().parent.name)
    draft = draft if urdf is None else _of_robot(draft, location(urdf).absolute())
    drafted = _settled(logs, draft)
    # While guesses are settled the draft is elsewhere, and names the URDF by its whole path.
    text = drafted.text if urdf is None else _with_relative_urdf(drafted.text, location(urdf), target.parent)
    files = with_schema("machine", target, text)
    write_texts(files)
    return replace(drafted, path=str(target), text=files[target])


@dataclass(frozen=True, repr=False)
class DraftedStudy:
    """A machine file and a benchmark file in one folder: their paths, the benchmark's text, and logs left out.

    `machine` is the draft of the machine file, None if one was given; `beside` are further files that were written.
    `has_detectors`: the benchmark file names a detector. `kept`: files to fill in that existed and stay as they are.
    """

    machine: Drafted | None
    machine_path: str
    path: str
    text: str
    beside: tuple[str, ...]
    skipped: tuple[Skipped, ...]
    has_detectors: bool = True
    kept: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"DraftedStudy({self.path!r})"


def init_study(
    logs: Sequence[str | Path],
    folder: str | Path,
    *,
    machine: str | Path | None = None,
    force: bool = False,
    csv: Mapping[str, Any] | None = None,
    free: Sequence[str] = (),
    urdf: str | Path | None = None,
) -> DraftedStudy:
    """Write drafts of a machine file and of a benchmark file for some logs into a folder.

    Parameters
    ----------
    logs : sequence of str or Path
        The logs of one machine; the machine file is drafted from the first, and its signs are checked in all.
    folder : str or Path
        The folder to write to; it is made if it does not exist.
    machine : str or Path, optional
        A machine file to use in place of a draft; it is named in the benchmark file.
    force : bool, optional
        Replace existing files, except a label file.
    csv : mapping, optional
        Keys of `[csv]` of the drafted machine file, for tables that cannot be read without them.
    free : sequence of str, optional
        Further logs, or patterns of them, that are impact-free: limits are learned from them.
    urdf : str or Path, optional
        The URDF of the robot: the drafted machine file is of a urdf_robot with its joints.

    Returns
    -------
    DraftedStudy
        What was written. The groups follow from the logs' ground truth, folders and names.

    Raises
    ------
    UsageError
        A file already exists.
    CdtoolError
        No log can be read, or the machine file is wrong.

    Examples
    --------
    >>> import cdtool
    >>> from pathlib import Path
    >>> logs = sorted(Path("sample_logs/gate/stiff").iterdir())
    >>> study = cdtool.init_study(logs, "study", machine="sample_logs/gate/machine.toml")
    >>> "[impacts.stiff]" in study.text, "above_n" in study.text
    (True, True)
    """
    target, paths = location(folder), [location(log) for log in several_logs(logs)]
    file = target / "benchmark.toml"
    impact_free = find_logs(free, Path()) if free else []
    known = {path.resolve() for path in impact_free}
    paths = [*(path for path in paths if path.resolve() not in known), *impact_free]
    if urdf is not None and machine is not None:
        raise UsageError("--urdf and --machine: both describe the machine", "write urdf into the machine file")
    _refuse_existing(force, {"benchmark": file, **({"machine": target / "machine.toml"} if machine is None else {})})
    target.mkdir(parents=True, exist_ok=True)
    drafted = None if machine is not None else _written(paths, target / "machine.toml", csv or {}, urdf)
    machine_path = location(machine) if machine is not None else target / "machine.toml"
    made = draft_benchmark(paths, read_machine_file(machine_path), target, known)
    files = with_schema("benchmark", file, made.text)
    write_texts(files)
    kept = tuple(str(target / name) for name in made.beside if (target / name).exists())
    beside = tuple(str(target / name) for name in made.beside if str(target / name) not in kept)
    for name in beside:
        write_text(location(name), made.beside[location(name).name])
    return DraftedStudy(
        drafted, str(machine_path), str(file), files[file], beside, made.skipped, made.has_detectors, kept
    )


def _refuse_existing(force: bool, targets: Mapping[str, Path]) -> None:
    for kind, target in targets.items():
        refuse_other_schema(kind, target, force=force)
        if target.exists() and not force:
            raise UsageError(f"{target}: already exists", "choose another name with -o, or overwrite it with --force")


def _settled(logs: Sequence[Path], draft: Draft) -> Drafted:
    """Return the draft with which `cdtool info` reads the first log; guesses that the logs contradict are withdrawn.

    Signs that the mechanics of the machine contradict are reversed.
    """
    left_out: dict[str, str] = {}
    reverse: list[Finding] = []
    if not draft.channels.found:
        return Drafted("", draft_text(draft, {}, ()), (), (), (), draft.unmapped)
    with TemporaryDirectory() as folder:
        trial = Path(folder) / "draft.toml"
        while True:
            text = draft_text(draft, left_out, reverse)
            trial.write_text(text, encoding="utf-8", newline="\n")
            mapped = tuple(name for name in draft.channels.found if name not in left_out)
            try:
                machine_file = read_machine_file(trial)
                findings = info(logs[0], machine=machine_file).findings if mapped else ()
            except CdtoolError as fault:
                if fault.channel not in mapped:
                    raise
                left_out[fault.channel] = ""
                continue
            if len(logs) > 1 and mapped:
                findings = tuple(item for item in findings if item.kind != "channel_check")
                findings += _checked_together(logs[:ENOUGH_RUNS], machine_file)
            checks = [item for item in findings if item.kind == "channel_check"]
            wrong = [item for item in checks if item.numbers["answer"] == "contradicts"]
            agreed = {_checked(item) for item in checks if item.numbers["answer"] == "agrees"}
            turned = {item.channel for item in reverse}
            reversed_ = [item for item in wrong if item.numbers["found"] in _REVERSED]
            signs = [item for item in reversed_ if item.channel not in turned]
            another = [item for item in wrong if item.numbers["found"] in _ANOTHER]
            another += [item for item in reversed_ if item.channel in turned]
            others = {item.channel: item.words_for("seen") for item in another}
            if not signs and not others:
                # What is left contradicts a placeholder, as a transmission ratio, or a unit that is marked.
                found = [replace(item, severity="warning") if item in wrong else item for item in findings]
                return Drafted("", text, mapped, tuple(left_out), worst_first(found), draft.unmapped)
            # The sign of a channel is usually that of all its joints, also of those whose motion does not show it.
            reverse += [
                item if _checked(item) in agreed else replace(item, numbers={**item.numbers, "joint": ""})
                for item in signs
            ]
            left_out |= others


def _checked(item: Finding) -> tuple[str, str]:
    return item.channel, item.numbers["check"]


def _checked_together(logs: Sequence[Path], machine_file: MachineFile) -> tuple[Finding, ...]:
    """Return the checks of the channels by the mechanics of the machine, in all logs that can be read."""
    parts = []
    for log in logs:
        with suppress(CdtoolError):
            recording = with_scalar_force(read(log, machine_file), OnsetRule())
            parts.append(before_contact(recording, contacts_shown(recording, OnsetRule())))
    return check_channels(parts, machine_file.machine)


def _pins(csv: Mapping[str, Any]) -> TablePins:
    """Return the dialect that --set gives; raises ConfigurationError."""
    place = Place("--set", by_option={f"csv.{key}" for key in csv}).below("csv")
    pins = read_pins(csv, place)
    place.finish()
    return pins


def _surveyed(path: Path, found: Format, csv: Mapping[str, Any]) -> Source:
    """Return all columns of a log; a table that cannot be read without settings names the option for them."""
    is_table = found.name == Csv.name
    if csv and not is_table:
        raise UsageError(f"{path}: is {found.name}, not a text table", "remove --set csv.*")
    try:
        return Csv().columns(path, pins=_pins(csv)) if csv else found.columns(path)
    except RecordingError as fault:
        if not is_table or csv:
            raise
        raise RecordingError(fault.message, f"{fault.hint}; keys of [csv] here: --set csv.header=false") from fault


def _with_words(path: Path, found: Format, csv: Mapping[str, Any]) -> tuple[Source, tuple[UnreadWord, ...]]:
    """Return all columns of a log, and the words among their numbers, which are read as missing."""
    source = first = _surveyed(path, found, csv)
    words: tuple[UnreadWord, ...] = ()
    given = csv.get("missing", [])
    given = given if isinstance(given, list) else [given]
    # A finding names one word of a column: behind it there may be others.
    while found.name == Csv.name and (more := _words(source.findings)):
        words += more
        if len(words) > 4:  # more do not stand for missing values
            return first, ()
        source = _surveyed(path, found, {**csv, "missing": [*given, *(word.text for word in words)]})
    return source, words


def _drafted(log: Path, csv: Mapping[str, Any], folder: str) -> Draft:
    path = log_parts(log)[0]
    found = choose_format(path)
    source, words = _with_words(path, found, csv)
    topics = has_topics(found)
    stamp = None if topics else split_stamp(source)
    if stamp:
        source = with_nanoseconds(source, *stamp)
    clock, times = (None if topics else table_clock(source)) or (None, None)
    streams = streams_of(source, times.time if times else None, times.column if times else None, topics)
    if not streams:
        raise RecordingError(f"{log}: has no column of numbers apart from a clock", "see cdtool info for its content")
    channels = guess_channels(streams, topics)
    own = any(column.time is not None for column in source.columns.values()) and not topics
    clock = None if own else clock
    types = {name: topic.schema for name, topic in source.topics.items()}
    motion = [channels.found[name].stream.topic for name in ("position", "speed") if name in channels.found]
    messages_si = bool(motion) and all(is_si(types.get(topic, "")) for topic in motion)
    # Without a clock the times are sample numbers, which say nothing about units.
    ratio = ratio_of(channels, clock, messages_si) if topics or own or clock is not None else None
    unit = ratio.fitting[0].clock if ratio is not None and ratio.fitting else clock.unit if clock is not None else ""
    side = side_of(channels, ratio, clock, messages_si)
    if own or topics:
        assumed = next((item.sentence for item in source.findings if item.kind == "clock_unit_assumed"), "")
        time = Clock({"column": "time", "unit": "s"}, "the file's own clock", assumed, 1.0)
    else:
        time = _clock(channels, clock, ratio, side.gear is not None)
    if stamp and time.keys.get("column") == stamp[0]:
        keys = {**time.keys, "nanoseconds": stamp[1]}
        time = replace(time, keys=keys, why="seconds and nanoseconds of one stamp, by their names")
    evidence = Evidence(channels, side, ratio, unit, clock is None or bool(clock.told), types)
    position = channels.found.get("position")
    derived = position is not None and "speed" not in channels.found
    low_pass = propose_low_pass(position.stream, time.in_seconds) if position is not None and derived else None
    joints, why = _joints(path, channels, topics)
    left = unmapped_columns(channels)
    name = folder or log_stem(log)  # the files of a machine are in a folder of its own
    return Draft(name, log.name, side, joints, why, time, channels, topics, evidence, left, low_pass, csv, words)


def _of_robot(draft: Draft, urdf: Path) -> Draft:
    """Return the draft of a urdf_robot: its joints by their names, or else in the order of the URDF.

    Raises ConfigurationError for a URDF that cannot be read, UsageError if it has fewer joints than the log.
    """
    names, logged = moving_joints(urdf), draft.joints
    if len(names) < len(logged):
        raise UsageError(
            f"{urdf}: has {counted(len(names), 'moving joint')}, the log {len(logged)}", "give the URDF of this robot"
        )
    robot: dict[str, object] = {"urdf": str(urdf)}
    used = logged if set(logged) <= set(names) else names[: len(logged)]
    if used != logged:
        robot["joint_map"] = dict(zip(logged, used, strict=True))
    if locked := [name for name in names if name not in used]:
        robot["locked"] = dict.fromkeys(locked, 0.0)
    side = Side("urdf_robot", "load", "a URDF is given")
    return replace(draft, side=side, evidence=replace(draft.evidence, side=side), robot=robot)


def _with_relative_urdf(text: str, urdf: Path, folder: Path) -> str:
    """Return the text of a draft that names its URDF relative to the folder of the draft."""
    return text.replace(toml(str(urdf.absolute())), toml(relative_name(urdf, folder)), 1)


def _words(findings: Sequence[Finding]) -> tuple[UnreadWord, ...]:
    """Return the words that findings name in columns of numbers, each once."""
    found: dict[str, UnreadWord] = {}
    for item in findings:
        if item.kind == "unread_cells" and item.numbers["advice"]["looks_like"] == "word":
            cell = item.numbers["cell"]
            found.setdefault(cell, UnreadWord(cell, item.channel, item.numbers["first"][0]))
    return tuple(found.values())


def _joints(path: Path, channels: Channels, topics: bool) -> tuple[tuple[str, ...], str]:
    if channels.joints == 1:
        return ("axis",), ""
    if topics:
        for found in channels.found.values():
            names = element_names(path, found.stream.topic) if found.stream.field.endswith("[:]") else ()
            if len(names) == channels.joints and len(set(names)) == len(names):
                return names, f"names from the messages of {found.stream.topic}"
    named = next((found.stream.joints for found in channels.found.values() if found.stream.joints), ())
    if len(named) == channels.joints:
        return named, "names from the columns"
    return tuple(f"joint_{j}" for j in range(1, channels.joints + 1)), "numbered in the order of the columns"


def _clock(channels: Channels, clock: DraftedClock | None, ratio: Ratio | None, geared: bool) -> Clock:
    """Return the clock of a table; `geared`: position and speed are of two sides of a gear."""
    if clock is None:
        text = "a placeholder: no column looks like a clock: give the rate, or a column with its unit"
        return Clock({"rate_hz": 1000.0}, "", text)
    why, check, rate, unit = "its name or its steps", "", 0.0, clock.unit
    if (named := unit_in_name("time", clock.column)) and not clock.counts:
        why += f", although its name ends with {named}"
    if clock.told:
        why, check = clock.told, "" if geared else _doubt(channels, clock, ratio)
    elif ratio is not None and ratio.fitting:
        first = ratio.fitting[0]
        pair = f"{first.position} and {first.speed}"
        if ratio.tick:
            why, rate = f"{why}; rate: with {pair}", 1.0 / ratio.tick
            check = f"counts, not a time: the rate is correct if position and speed are in {pair}"
        else:
            why, unit = f"{why}; unit: steps of {clock.step:.4g} {first.clock}, with {pair}", first.clock
            check = f"the unit is not stated; {fits_as_well(ratio, False) or 'no other fits the ratio'}"
    elif clock.counts:
        rate = 1000.0 / clock.step
        check = "counts, not a time: 1000 steps per second is a placeholder; give the rate"
    else:
        rates = ", ".join(f"{1.0 / (clock.step * factor_of(unit)):.6g} Hz in {unit}" for unit in clock.units())
        check = f"the unit is not stated: steps of {clock.step:.4g} are {rates}"
    keys = {"column": column_key(clock.column)}
    if rate:
        seconds = ratio.tick if ratio is not None else 0.0
        return Clock({**keys, "rate_hz": float(f"{rate:.5g}")}, why, check, seconds / clock.assumed)
    return Clock({**keys, "unit": unit}, why, check, factor_of(unit) / clock.assumed)


def _doubt(channels: Channels, clock: DraftedClock, ratio: Ratio | None) -> str:
    """Return the doubt about a clock's unit that is only written: another fits the ratio, or the rate is too low."""
    rate = 1.0 / (clock.step * factor_of(clock.unit))
    if not clock.written:
        return ""
    if ratio is not None and not ratio.fitting:
        other = ratio_of(channels, replace(clock, told=""), messages_si=False)
        if other is not None and other.fitting and not other.tick:
            first = other.fitting[0]
            return f"{first.clock} with {first.position}, {first.speed} fits the ratio, {clock.unit} does not"
    # No log of contacts is so slow: the unit that a header states for its clock is doubtful.
    return f"steps of {clock.step:.4g} {clock.unit} are {rate:.3g} Hz" if rate < 2.0 else ""
