"""1,000 damaged files, each compared with its expected messages and findings; and bombs, each in its own process.

Other seeds: `python -m tests.formats.mcap_damage SEED COUNT`.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections import Counter
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import NonSeekingReader

from tests.formats.mcap_damage import logs, messages
from tests.formats.mcap_damage.assembly import assemble, blocks_of
from tests.formats.mcap_damage.assessment import faults, warm_up
from tests.formats.mcap_damage.bomb_probe import measurable
from tests.formats.mcap_damage.bombs import bombs
from tests.formats.mcap_damage.generator import KINDS, cases, kind_of
from tests.time_bounds import check

SEED, COUNT, STEP = 1, 1000, 100
SECONDS = 5.0  # processor time per bomb
ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the file of a case is written; all kernels are compiled."""
    file = tmp_path_factory.mktemp("damage") / "case.mcap"
    warm_up(file)
    return file


@pytest.mark.parametrize("first", range(0, COUNT, STEP))
def test_a_damaged_file_yields_all_readable_messages_and_nothing_else_and_reports_every_loss(path, first):
    failures = {
        f"{number} {case.name}": problems
        for number, case in enumerate(cases(SEED, STEP, first), start=first)
        if (problems := faults(case, path))
    }
    assert not failures


@pytest.mark.parametrize("number", [1126, 1261], ids=["a data end before the data's end", "an index beyond any file"])
def test_cases_of_another_seed_that_have_failed_before(path, number):
    (case,) = cases(22, 1, number)
    assert not faults(case, path)


def test_every_kind_of_damage_is_among_the_cases():
    counts = Counter(kind_of(SEED, number)[0] for number in range(COUNT))
    assert set(counts) == set(KINDS)


@pytest.mark.parametrize("compression", ["", "lz4", "zstd"])
def test_the_mcap_package_reads_the_undamaged_files_of_the_generator(compression):
    rng = np.random.default_rng(0)
    written = messages.ordinary(rng, 64)
    log = logs.write(rng, logs.Style(compression))
    for data, known in ((assemble(blocks_of(written, 8, compression)), written), (log.data, log.messages)):
        reader = NonSeekingReader(BytesIO(data), validate_crcs=True)
        read = reader.iter_messages(log_time_order=False)
        messages_read = [(channel.topic, message.log_time, message.data) for _, channel, message in read]
        assert messages_read == [(message.topic, message.time, message.payload) for message in known]


@pytest.mark.skipif(not measurable(), reason="the peak memory is only measured on Linux")
def test_bombs_are_refused_within_300_mb_and_the_other_messages_are_read(tmp_path):
    command = [sys.executable, "-m", "tests.formats.mcap_damage.bomb_probe", str(tmp_path)]
    ran = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=600)
    assert ran.returncode == 0, ran.stderr
    measured = [json.loads(line) for line in ran.stdout.splitlines()]
    assert len(measured) == 2 * len(bombs())
    for bomb in measured:
        check(bomb["seconds"], SECONDS)
    assert not [bomb for bomb in measured if bomb["faults"] or bomb["bytes"] >= 300e6]
