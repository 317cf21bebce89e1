"""Items that end their workers or take too long are tried again and reported once; all others have their results."""

import ctypes
import faulthandler
import multiprocessing
import os
import random
import signal
import sys
import tempfile
import threading
import time
from functools import partial
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.base.errors import WorkerError
from cdtool.execution import in_worker, processes
from cdtool.execution.in_worker import Done, Failed, NotBegun, Raised
from cdtool.execution.workers import Workers, _Ordered, in_order

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals")


def crash(number):
    if number in (3, 11):
        faulthandler.disable()  # the test runner's would print where
        ctypes.string_at(0)
    return number


def killed(number):
    if number == 5:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def left(number):
    if number == 4:
        os._exit(7)
    if number == 6:
        sys.exit(8)
    return number


def ended(number):
    if number == 1:
        os._exit(0)
    if number == 3:
        sys.exit()
    if number == 5:
        raise KeyboardInterrupt
    if number == 7:
        os.kill(os.getpid(), signal.SIGTERM)
    if number == 9:  # as while code is compiled: no exception passes the library written in C
        ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal(signal.SIGTERM))()
    return number


def cut_off(folder, number, how=signal.SIGKILL):
    """The result of item 3 is cut off the first time."""
    with (folder / f"{number}.txt").open("a", encoding="utf-8") as file:
        file.write("x")
    if number == 3 and (folder / "3.txt").stat().st_size == 1:

        def send(pipe, content):
            pipe.sendall((len(content) + 1000).to_bytes(in_worker.HEADER) + content)
            os.kill(os.getpid(), how)

        in_worker._send = send
    return number


def stopped(number):
    if number == 2:
        os.kill(os.getpid(), signal.SIGSTOP)
    return number


def slow(number):
    if number == 2:
        time.sleep(60.0)
    return number


def stuck(number):
    """Hold the interpreter lock, so that no Python code of the worker can end it."""
    if number == 2:
        ctypes.PyDLL(None).sleep(60)
    return number


def hungry(number):
    if number in (1, 2):
        raise MemoryError
    return number


def once(folder, number):
    """Kill the worker of every fifth item the first time, and note each attempt."""
    with (folder / f"{number}.txt").open("a", encoding="utf-8") as file:
        file.write("x")
    if number % 5 == 0 and (folder / f"{number}.txt").stat().st_size == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def lost(item, reason):
    return item, reason


def run(work, count, workers):
    return list(in_order(work, range(count), count, workers, of_lost=lost))


@pytest.mark.parametrize("jobs", [2, 3])
def test_items_that_crash_their_workers_are_lost_and_no_other(jobs):
    reason = "its worker process crashed (SIGSEGV), in each of 2 attempts"
    made = run(crash, 60, Workers(jobs))
    assert made == [(number, reason) if number in (3, 11) else number for number in range(60)]


@pytest.mark.parametrize(
    ("work", "number", "reason"),
    [
        (killed, 5, "its worker process was killed (SIGKILL): mostly because the memory was not enough"),
        (left, 4, "its worker process ended with exit status 7"),
        (left, 6, "its worker process ended with exit status 8"),
        (hungry, 1, "not enough memory"),
    ],
)
@pytest.mark.parametrize("retries", [0, 1, 3])
def test_the_reason_and_the_number_of_attempts_are_stated(work, number, reason, retries):
    made = run(work, 9, Workers(2, retries=retries))
    words = reason if not retries else f"{reason}, in each of {retries + 1} attempts"
    assert made[number] == (number, words)
    assert made[0] == 0 and made[7:] == [7, 8]


@pytest.mark.parametrize("beside", [0, 1])
def test_items_that_leave_their_workers_in_any_way_are_lost_and_no_other(beside, capfd):
    stop = threading.Event()
    threads = [threading.Thread(target=stop.wait) for _ in range(beside)]  # then processes are not forked
    for thread in threads:
        thread.start()
    try:
        made = run(ended, 12, Workers(2, retries=0))
    finally:
        stop.set()
    reasons = {
        1: "its worker process ended with exit status 0",
        3: "its worker process ended with exit status 0",
        5: "it was ended by KeyboardInterrupt",
        7: "its worker process crashed (SIGTERM)",
        9: "its worker process crashed (SIGTERM)",
    }
    assert made == [(number, reasons[number]) if number in reasons else number for number in range(12)]
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("retries", [0, 1])
def test_a_worker_that_is_killed_while_it_sends_a_result_is_replaced(tmp_path, retries):
    made = run(partial(cut_off, tmp_path), 12, Workers(2, retries=retries))
    reason = "its worker process was killed (SIGKILL): mostly because the memory was not enough"
    assert made == [(number, reason) if number == 3 and not retries else number for number in range(12)]
    assert (tmp_path / "3.txt").stat().st_size == 1 + retries


def keeps(folder, number):
    (folder / f"{number}.txt").write_text(tempfile.mkdtemp(), encoding="utf-8")
    if number == 5:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def test_temporary_files_of_workers_are_removed_also_of_killed_ones(tmp_path):
    assert len(run(partial(keeps, tmp_path), 8, Workers(2, retries=0))) == 8
    made = [Path(file.read_text(encoding="utf-8")) for file in tmp_path.iterdir()]
    assert len(made) == 8 and not any(path.exists() for path in made)


def test_work_that_is_given_up_after_a_result_was_cut_off_leaves_nothing(tmp_path):
    processes_before, threads_before = set(multiprocessing.active_children()), set(threading.enumerate())
    made = in_order(partial(cut_off, tmp_path), range(12), 12, Workers(2), of_lost=lost)
    assert [next(made) for _ in range(3)] == [0, 1, 2]
    until = time.monotonic() + 20.0
    while not (tmp_path / "3.txt").exists() and time.monotonic() < until:
        time.sleep(0.05)
    time.sleep(0.2)
    made.close()
    assert set(multiprocessing.active_children()) <= processes_before
    for thread in set(threading.enumerate()) - threads_before:
        thread.join(10.0)
        assert not thread.is_alive()


def test_a_process_that_is_stopped_is_ended_by_the_time_limit():
    made = run(stopped, 6, Workers(2, timeout=0.5, retries=0))
    assert made == [0, 1, (2, "took longer than 0.5 s (execution.timeout_s)"), 3, 4, 5]


@pytest.mark.parametrize("jobs", [1, 2])
@pytest.mark.parametrize("work", [slow, stuck])
def test_an_item_that_takes_too_long_is_ended(work, jobs):
    begin = time.monotonic()
    made = run(work, 6, Workers(jobs, timeout=0.5, retries=0))
    assert made == [0, 1, (2, "took longer than 0.5 s (execution.timeout_s)"), 3, 4, 5]
    assert time.monotonic() - begin < 30.0


def test_an_item_that_ends_its_worker_once_is_repeated_and_done(tmp_path):
    assert run(partial(once, tmp_path), 40, Workers(2)) == list(range(40))
    attempts = [(tmp_path / f"{number}.txt").stat().st_size for number in range(0, 40, 5)]
    assert attempts == [2] * 8, "what is blamed for nothing would have been tried once more"


def test_a_lost_item_is_an_error_where_nothing_stands_for_it():
    with pytest.raises(WorkerError) as raised:
        list(in_order(killed, range(8), 8, Workers(2)))
    assert "5: its worker process was killed" in raised.value.message and "--jobs" in raised.value.hint


def test_processes_that_never_begin_are_one_error(monkeypatch):
    monkeypatch.setattr(in_worker, "keep_freed_memory", lambda: os._exit(1))
    monkeypatch.setattr(processes, "shares_memory", lambda: True)
    with pytest.raises(WorkerError, match="worker processes end before they begin their work"):
        run(abs, 8, Workers(2))


class Fake:
    """A pool without processes: `fates` are the outcomes of the attempts of an item before it is done."""

    def __init__(self, size, fates, order):
        self.size, self.fates, self.order = size, {number: list(each) for number, each in fates.items()}, order
        self.has = []

    @property
    def free(self):
        return self.size - len(self.has)

    def begin(self, number, item):
        assert self.free and item == 10 * number
        self.has.append(number)

    def ended(self, *, wait_for_one):
        if not self.has or not (wait_for_one or self.order.random() < 0.5):
            return []
        number = self.has.pop(self.order.randrange(len(self.has)))
        left = self.fates.get(number)
        return [(number, left.pop(0) if left else Done(number))]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass


@given(
    st.integers(0, 40),
    st.dictionaries(st.integers(0, 39), st.lists(st.sampled_from([Failed("why"), NotBegun()]), max_size=6)),
    st.integers(1, 8),
    st.integers(0, 3),
    st.randoms(use_true_random=False),
)
def test_every_item_has_its_result_in_order_or_is_lost_after_its_attempts(count, fates, size, retries, order):
    made = list(_Ordered(Fake(size, fates, order), range(0, 10 * count, 10), retries, lost).results(count))
    words = f"why, in each of {retries + 1} attempts" if retries else "why"
    gone = {number for number, each in fates.items() if each.count(Failed("why")) > retries}
    assert made == [(10 * number, words) if number in gone else number for number in range(count)]


def test_an_error_is_raised_at_its_turn():
    pool = Fake(2, {3: [Raised(ValueError("3"))]}, random.Random(1))
    results = _Ordered(pool, range(0, 80, 10), 1, None).results(8)
    assert [next(results) for _ in range(3)] == [0, 1, 2]
    with pytest.raises(ValueError, match="3"):
        next(results)
