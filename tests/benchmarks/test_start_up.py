"""What benchmarks/start_up.py measures: CPU time of child processes, and a bare app of the size of cdtool's."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def start_up(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    import start_up

    return start_up


@pytest.mark.skipif(sys.platform == "win32", reason="no CPU time of child processes")
def test_the_cpu_time_is_that_of_the_child_processes_and_waiting_is_not_in_it(start_up, tmp_path):
    work = "import time\nwhile time.process_time() < 0.3: pass"
    rest = "import time; time.sleep(0.3)"
    environment = start_up._environment(tmp_path)
    tasks = {name: start_up._task(["-c", code], environment) for name, code in (("work", work), ("rest", rest))}
    clock, processor = start_up.measured(tasks, 2)
    assert {len(each) for each in (*clock.values(), *processor.values())} == {2}
    assert min(processor["work"]) >= 0.3
    assert max(processor["rest"]) < 0.3 <= min(clock["rest"])
