"""What holds for the tables of detectors, thresholds, machines, formats and report writers."""

from __future__ import annotations

import pytest

import cdtool.commands.compare
import cdtool.commands.protocol.document
import cdtool.detectors
import cdtool.formats
import cdtool.machines
import cdtool.report.writers
import cdtool.thresholds
from tests.contracts.registered import targets_in

REGISTRIES = [
    ((cdtool.detectors,), cdtool.detectors.DETECTORS),
    ((cdtool.thresholds,), cdtool.thresholds.THRESHOLDS),
    ((cdtool.machines,), cdtool.machines.MACHINES),
    ((cdtool.formats,), cdtool.formats.FORMATS),
    # A command's own documents are written by its own writers.
    (
        (cdtool.report.writers, cdtool.commands.compare, cdtool.commands.protocol.document),
        cdtool.report.writers.WRITERS,
    ),
]


@pytest.mark.parametrize(("packages", "registry"), REGISTRIES, ids=[registry.kind for _, registry in REGISTRIES])
def test_every_class_of_the_folder_that_keeps_the_contract_is_registered_in_a_module_of_its_name(packages, registry):
    assert set().union(*(targets_in(package, registry) for package in packages)) == set(registry.table.values())
    for name, target in registry.table.items():
        assert target.split(":")[0].rpartition(".")[2] == name
        assert getattr(registry.load(name), "name", name) == name
