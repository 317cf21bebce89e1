"""Everything that determines the outcome of a log, as the key of a store.

A name is among it, since rows contain it, and so are the code and the content of every file read for the log; a path of
the machine and the rows that a label file has on other logs are not.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path, PurePosixPath
from typing import Any

from cdtool.base.arrays import FloatArray
from cdtool.commands.judging.runs import shown_path
from cdtool.commands.scoring.benchmark_file import BenchmarkFile, ImpactGroup
from cdtool.commands.scoring.learned import Learned
from cdtool.execution.store.digest import code_version, combined, digest_of
from cdtool.execution.store.sources import SourceFile
from cdtool.formats.channels.run_reading import split_run
from cdtool.formats.labels.labels import Labels
from cdtool.recordings.log_section import LogSection
from cdtool.recordings.plausible import PlausibleRanges
from cdtool.thresholds.stored import fitted_to_dict, rule_to_dict

Sources = Sequence[SourceFile]


@dataclass(frozen=True)
class Determinants:
    """What determines the outcomes of a benchmark's logs, given what was `learned` from its impact-free runs.

    `runs` are the sources of these runs; `factors` are the safety factors of the sweep by detector.
    """

    setup: BenchmarkFile
    learned: Learned
    runs: Mapping[Path, Sources]
    factors: Mapping[str, FloatArray]

    def key(self, group: str, path: Path, sources: Sources) -> str:
        """Return the key of the outcome of a log."""
        setup, name = self.setup, shown_path(path, self.setup.path.parent)
        section = str(setup.sections.get(path, "")) if setup.sections else ""
        own = json.dumps([name, section, setup.campaigns.get(path), setup.points.get(path), self._ranges(name)])
        labels = "" if setup.labels is None else digest_of(labels_of_log(setup, path))
        taught = self._taught if self._is_learned_from(path) else ""
        content = (item.content for item in sources)
        return combined("log", self._common, self._groups[group], own, labels, taught, *content)

    @cached_property
    def _common(self) -> str:
        """Return what is the same for all logs: how they are read, and the detectors with what these have learned."""
        setup, learned = self.setup, self.learned
        detectors = [
            [
                name,
                setup.machine_file.detector(name),
                [fitted_to_dict(setup.rule, item) for item in learned.thresholds.get(name, ())],
                learned.about.unusable.get(name),
                self.factors.get(name),
            ]
            for name in setup.detectors
        ]
        normals = [[item.to_dict() for item in learned.normals.motions], str(learned.normals.absent)]
        rules = [rule_to_dict(setup.rule), setup.activation, setup.watched, setup.grace]
        return digest_of(code_version(), how_logs_are_read(setup), rules, detectors, normals)

    @cached_property
    def _groups(self) -> dict[str, str]:
        """Return the digest of the settings of each group."""
        return {
            name: digest_of(
                name, group.is_impact_free, group.window, group.force, group.labels, group.refused, _own_channels(group)
            )
            for name, group in self.setup.impacts.items()
        }

    @cached_property
    def _range_digests(self) -> dict[int, str]:
        return {}

    def _ranges(self, name: str) -> str:
        """Return the digest of the plausible ranges that a log is compared with; few are different."""
        ranges: PlausibleRanges = self.learned.ranges.without(name)
        if id(ranges) not in self._range_digests:
            self._range_digests[id(ranges)] = digest_of(ranges)
        return self._range_digests[id(ranges)]

    def _is_learned_from(self, path: Path) -> bool:
        if not self.setup.has_runs:
            return path in self.setup.both
        return split_run(path)[0] in {split_run(log)[0] for log in self.setup.both}

    @cached_property
    def _taught(self) -> str:
        """Return what determines the thresholds of a log that is learned from, too: all others."""
        return learned_key(self.setup, self.runs, self.setup.detectors)


def trace_key(log_key: str, number: int) -> str:
    """Return the key of the trace of an operation of a log."""
    return combined("trace", str(number), log_key)


def _own_channels(group: ImpactGroup) -> list[Any]:
    """Return how the logs of a group are read if it has its own machine file."""
    file = group.machine_file
    return [] if file is None else [file.machine, file.columns, file.topics]


def how_logs_are_read(setup: BenchmarkFile) -> list[Any]:
    """Return the settings that determine how any log of a benchmark is read, cut and matched."""
    machine_file = setup.machine_file
    return [
        machine_file.machine,
        machine_file.columns,
        machine_file.topics,
        setup.operations,
        setup.onset,
        setup.synchronisation,
        setup.mass_before_cell,
    ]


def labels_of_log(setup: BenchmarkFile, path: Path) -> list[Any] | None:
    """Return what the label file says about a log, or about each of its runs; None without a label file."""
    labels = setup.labels
    if labels is None:
        return None
    name = shown_path(path, setup.path.parent)
    if setup.has_runs:
        file = shown_path(split_run(path)[0], setup.path.parent)
        names = [item for item in labels.contacts if _file_of(item) in (file, PurePosixPath(file).name)]
    else:
        known = labels.name_of(name)
        names = [] if known is None else [known]
    return [labels.clock, labels.not_contacts, _rows(labels, names)]


def _file_of(name: str) -> str:
    return name.partition("#")[0]


def _rows(labels: Labels, names: Sequence[str]) -> list[Any]:
    return [[name, labels.contacts[name], labels.lines[name]] for name in names]


def learned_key(setup: BenchmarkFile, sources: Mapping[Path, Sources], detectors: Sequence[str]) -> str:
    """Return the key of what some detectors learn from the impact-free runs of a benchmark."""
    learn = [
        [
            shown_path(path, setup.path.parent),
            str(setup.learned_sections.get(path, LogSection())),
            labels_of_log(setup, path),
            setup.is_scored_too(path) if setup.both else False,
            [item.content for item in sources[path]],
        ]
        for path in setup.learn
    ]
    return digest_of(
        "learned",
        code_version(),
        how_logs_are_read(setup),
        [[name, setup.machine_file.detector(name)] for name in detectors],
        rule_to_dict(setup.rule),
        str(setup.budget),
        setup.activation,
        setup.watched,
        setup.guard,
        setup.split,
        setup.window,
        learn,
    )
