"""A Dask cluster does the work as local processes do: the same results, and the same items left out."""

from __future__ import annotations

import ctypes
import faulthandler
import json
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

import pytest

from cdtool.base.errors import RecordingError, UsageError, WorkerError
from cdtool.execution import cluster_session, on_cluster
from cdtool.execution.cluster_session import session_of
from cdtool.execution.environment import difference, environment
from cdtool.execution.on_cluster import Sight
from cdtool.execution.store.digest import code_version
from cdtool.execution.workers import Workers, in_order
from tests.command import cdtool, keys
from tests.execution import dask_cluster

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals")
needs_dask = pytest.mark.skipif(
    not __import__("importlib.util").util.find_spec("distributed"),
    reason="distributed is not installed (cdtool[cluster])",
)
ROOT = dask_cluster.ROOT
MAIN = "from cdtool.commands.app import main; main()"


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    return dask_cluster.site_with_plugin(tmp_path_factory.mktemp("plugin"))


@pytest.fixture(scope="module")
def address(tmp_path_factory, site):
    """The address of a scheduler with two workers, which have the same plug-in as this process."""
    with (
        pytest.MonkeyPatch.context() as here,
        dask_cluster.cluster(tmp_path_factory.mktemp("cluster"), sites=[site]) as running,
    ):
        here.syspath_prepend(site)
        for known in (environment, code_version):
            known.cache_clear()
        yield running.address
    for known in (environment, code_version):
        known.cache_clear()


def lost(item, reason):
    return item, reason


def fate(number):
    """Return the number, unless it is one of those that end their worker or take too long."""
    if number == 3:
        faulthandler.disable()
        ctypes.string_at(0)
    if number == 9:
        time.sleep(60.0)
    if number == 14:
        ctypes.PyDLL(None).sleep(60)  # holds the interpreter lock
    if number == 20:
        raise MemoryError
    if number == 21:
        sys.exit(8)
    return number


REASONS = {
    3: "its worker process crashed (SIGSEGV)",
    9: "took longer than 2 s (execution.timeout_s)",
    14: "took longer than 2 s (execution.timeout_s)",
    20: "not enough memory",
    21: "its worker process ended with exit status 8",
}


@needs_dask
def test_items_that_end_their_workers_are_lost_with_the_reason_and_no_other(address):
    workers = Workers(cluster=address, timeout=2.0, retries=0)
    made = list(in_order(fate, range(40), 40, workers, of_lost=lost))
    assert made == [(number, REASONS[number]) if number in REASONS else number for number in range(40)]


def refused(number):
    if number == 5:
        raise RecordingError("05.csv: no row", "check the file", channel="torque")
    return Path.cwd(), number


@needs_dask
def test_results_are_in_order_relative_paths_are_those_of_here_and_errors_arrive_as_raised(address):
    results = in_order(refused, range(100), 100, Workers(cluster=address))
    assert [next(results) for _ in range(5)] == [(Path.cwd(), number) for number in range(5)]
    with pytest.raises(RecordingError) as raised:
        next(results)
    assert (raised.value.message, raised.value.channel) == ("05.csv: no row", "torque")


@needs_dask
def test_items_are_taken_when_their_work_begins_not_all_at_once(address):
    taken = []
    with session_of(address, 1) as session:
        count = len(session.workers)
        results = in_order(abs, (taken.append(k) or k for k in range(500)), 500, Workers(cluster=address))
        for number in range(10):
            assert next(results) == number
        assert len(taken) <= 10 + 8 * count
        results.close()


def test_wrong_addresses_are_refused_without_repeating_a_password():
    for wrong in ("host", "http://host:1", "tcp://user:secret@host:1", "tcp://host", "tcp://host:1/secret"):
        with pytest.raises(UsageError) as raised:
            Workers(cluster=wrong)
        assert "secret" not in str(raised.value) and "tcp://host:8786" in raised.value.hint
    with pytest.raises(UsageError, match="--jobs"):
        Workers(2, cluster="tcp://host:8786")


@needs_dask
def test_a_scheduler_that_does_not_answer_is_one_line():
    threads = set(threading.enumerate())
    done = cdtool("benchmark", ROOT / "sample_logs/gate/benchmark.toml", "--cluster", "tcp://127.0.0.1:9")
    assert done.status == 2 and done.out == ""
    assert done.err == (
        "error: --cluster tcp://127.0.0.1:9: no scheduler answers (check the address, or start one: dask scheduler)\n"
    )
    assert set(threading.enumerate()) == threads, "with more of them, later processes would not be forked"


def test_without_the_package_one_line_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    done = cdtool("benchmark", ROOT / "sample_logs/gate/benchmark.toml", "--cluster", "local")
    assert done.status == 2
    assert done.err == "error: --cluster needs the package distributed (pip install '.[cluster]')\n"


def test_everything_that_is_here_must_be_the_same_there():
    here = environment()
    assert {"python", "cdtool", "numpy", "scipy", "numba"} <= here.keys() and difference(here, here) == ""
    assert difference(here, {**here, "more": "1"}) == ""
    assert difference(here, {**here, "numpy": "1.0"}) == f"numpy is 1.0 there, {here['numpy']} here"
    assert difference(here, {key: here[key] for key in here if key != "scipy"}).startswith("scipy is not installed")
    assert difference(here, {**here, "the code of cdtool": "0"}) == "the code of cdtool is not the same there"


@needs_dask
def test_a_worker_with_another_version_or_other_files_is_refused_by_its_address(address, monkeypatch, tmp_path):
    monkeypatch.setattr(cluster_session, "environment", lambda: {**environment(), "numpy": "9.9"})
    with pytest.raises(WorkerError) as raised, session_of(address, 1):
        pass
    assert "worker tcp://127.0.0.1:" in raised.value.message and "there, 9.9 here" in raised.value.message
    monkeypatch.setattr(cluster_session, "environment", environment)
    log = tmp_path / "log.csv"
    log.write_text("time\n")
    monkeypatch.setattr(Sight, "of", classmethod(lambda cls, path: cls(str(path), 99)))
    with pytest.raises(WorkerError, match="is not the same there"), session_of(address, 1, [log]):
        pass


def test_a_file_is_seen_if_it_has_the_same_size_and_a_folder_if_it_exists(tmp_path):
    log = tmp_path / "log.csv"
    log.write_text("time\n")
    seen, folder = Sight.of(log), Sight.of(tmp_path)
    assert seen.is_same and folder.is_same
    log.write_text("time,speed\n")
    assert not seen.is_same
    log.unlink()
    assert not seen.is_same and folder.is_same


def test_an_item_for_an_earlier_process_of_the_same_address_is_not_begun():
    begun = on_cluster.begin(pickle.dumps(os.remove), str(Path.cwd()), None)
    assert on_cluster.do(begun, "another process", pickle.dumps("no-such-file")) is None


def slow(number):
    time.sleep(0.3)
    return number


@needs_dask
def test_a_scheduler_that_ends_is_one_error_and_nothing_hangs(tmp_path, site):
    with dask_cluster.cluster(tmp_path, workers=1, sites=[site]) as running:
        results = in_order(slow, range(200), 200, Workers(cluster=running.address))
        assert next(results) == 0
        os.killpg(running.scheduler.pid, signal.SIGKILL)
        with pytest.raises(WorkerError, match="the scheduler has ended or does not answer"):
            list(results)


def gate_with_fatal_logs(folder):
    done = cdtool("simulate", "gate", "-o", folder, *keys(free=10, holdout=4, stiff=4, soft=3))
    assert done.status == 0, done.err
    (folder / "stiff" / "00a.fatal").write_text("segfault", encoding="utf-8")
    (folder / "free" / "05b.fatal").write_text("killed", encoding="utf-8")
    benchmark = folder / "benchmark.toml"
    text = benchmark.read_text(encoding="utf-8")
    benchmark.write_text(text.replace("*.csv", "*"), encoding="utf-8")
    return benchmark


def command(site, folder, *arguments):
    line = [sys.executable, "-c", MAIN, *map(str, arguments)]
    env = dask_cluster.environment(site)
    return subprocess.run(line, capture_output=True, text=True, env=env, cwd=folder, check=False)


@needs_dask
def test_a_benchmark_on_a_cluster_is_that_of_local_processes(address, site, tmp_path):
    gate_with_fatal_logs(tmp_path / "gate")
    common = ("benchmark", "gate/benchmark.toml", "--detectors", "gm", "--set=execution.retries=0")
    here = command(site, tmp_path, *common, "-j", 2, "-o", "here.json")
    there = command(site, tmp_path, *common, "--cluster", address, "-o", "there.json")
    assert here.returncode == there.returncode == 3
    assert here.stderr == there.stderr
    assert here.stderr.splitlines()[-1] == "done, but 2 items were left out"
    assert "left out: stiff/00a.fatal: its worker process crashed (SIGSEGV)" in here.stderr
    assert "left out: free/05b.fatal: its worker process was killed (SIGKILL)" in here.stderr
    assert (tmp_path / "here.json").read_bytes() == (tmp_path / "there.json").read_bytes()
    assert here.stdout.replace("here.json", "there.json") == there.stdout
    assert len(json.loads((tmp_path / "here.json").read_text(encoding="utf-8"))["recordings"]) == 11


def children_of(session):
    """Return the processes of a session that have not ended."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            fields = (folder / "stat").read_text(encoding="utf-8").rpartition(")")[2].split()
            if int(fields[3]) == session and fields[0] != "Z":
                found.append(int(folder.name))
    return found


LOCAL = """
import os, signal, sys, time
from cdtool.execution.workers import Workers, in_order
signal.signal(signal.SIGINT, signal.default_int_handler)

def work(number):
    time.sleep(0.01 if number < 4 else 60.0)
    return number

if __name__ == "__main__":
    try:
        for number in in_order(work, range(8), 8, Workers(2, cluster="local")):
            print(number, flush=True)
    except KeyboardInterrupt:
        sys.exit("interrupted")
"""


@needs_dask
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="reads /proc")
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_no_process_of_a_local_cluster_is_left_when_the_first_one_is_interrupted_or_killed(how, tmp_path):
    script = tmp_path / "local.py"
    script.write_text(LOCAL, encoding="utf-8")
    env = dask_cluster.environment()
    pipe = subprocess.PIPE
    first = subprocess.Popen(
        [sys.executable, script], stdout=pipe, stderr=pipe, text=True, env=env, start_new_session=True
    )
    try:
        assert [first.stdout.readline() for _ in range(4)] == [f"{number}\n" for number in range(4)]
        assert len(children_of(first.pid)) >= 3
        if how == signal.SIGINT:
            os.killpg(first.pid, how)  # as a terminal does
        else:
            first.send_signal(how)
        words = first.communicate(timeout=60.0)[1]
        until = time.monotonic() + 30.0
        while children_of(first.pid) and time.monotonic() < until:
            time.sleep(0.05)
        assert not children_of(first.pid)
        if how == signal.SIGINT:
            assert words == "interrupted\n"
    finally:
        with suppress(ProcessLookupError):
            os.killpg(first.pid, signal.SIGKILL)
        first.wait()
