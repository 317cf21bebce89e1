"""Items that end their workers or take too long are tried again and reported once; all others have their results."""

import ctypes
import faulthandler
import multiprocessing
import os
import signal
import struct
import sys
import threading
import time
from collections import deque
from concurrent.futures import Future
from contextlib import contextmanager
from functools import partial

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.base.errors import UsageError, WorkerError
from cdtool.execution import processes
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


class CutOff:
    """The sending end of a pipe whose process is killed while it sends a result."""

    def __init__(self, writer):
        self.writer = writer

    def send_bytes(self, content):
        os.write(self.writer.fileno(), struct.pack("!i", len(content)) + bytes(content[:10]))
        os.kill(os.getpid(), signal.SIGKILL)


def cut_off(folder, number):
    """The result of item 3 is cut off the first time."""
    with (folder / f"{number}.txt").open("a", encoding="utf-8") as file:
        file.write("x")
    if number == 3 and (folder / "3.txt").stat().st_size == 1:
        frame = sys._getframe()
        while "result_queue" not in frame.f_locals:
            frame = frame.f_back
        results = frame.f_locals["result_queue"]
        results._writer = CutOff(results._writer)
    return number


class OddError(Exception):
    """It cannot be copied to another process."""

    def __init__(self, file, number):
        super().__init__(f"{file} is strange")
        self.number = number


def odd(number):
    if number == 5:
        raise OddError("05.csv", number)
    if number > 5:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        time.sleep(60.0)
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


def run(work, count, workers, together=1):
    return list(in_order(work, range(count), count, workers, of_lost=lost, together=together))


@pytest.mark.parametrize("together", [1, 8])
@pytest.mark.parametrize("jobs", [2, 3])
def test_items_that_crash_their_workers_are_lost_and_no_other(jobs, together):
    reason = "its worker process crashed (SIGSEGV), in each of 2 attempts"
    made = run(crash, 60, Workers(jobs), together)
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
        made = run(ended, 12, Workers(2, retries=0), 2)
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


def test_an_error_that_cannot_be_copied_arrives_as_its_words_and_processes_that_ignore_sigterm_end(capfd, monkeypatch):
    monkeypatch.setattr(processes, "_ENDED_WITHIN", 0.5)
    before = set(multiprocessing.active_children())
    with pytest.raises(Exception, match=r"05\.csv is strange"):  # Dask, once imported, makes it possible to copy it
        run(odd, 8, Workers(2))
    until = time.monotonic() + 10.0
    # A process that a thread of the pool has waited for is listed until that thread goes on.
    while set(multiprocessing.active_children()) != before and time.monotonic() < until:
        time.sleep(0.01)
    assert set(multiprocessing.active_children()) == before
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("together", [1, 8])
@pytest.mark.parametrize("retries", [0, 1])
def test_a_worker_that_is_killed_while_it_sends_a_result_is_replaced(tmp_path, monkeypatch, together, retries):
    """The pool waits for the rest of the result, and the other workers wait for the right to send theirs."""
    monkeypatch.setattr(processes, "_NOTICED_WITHIN", 0.2)
    monkeypatch.setattr(processes, "_CHECKED_EVERY", 0.1)
    made = run(partial(cut_off, tmp_path), 12, Workers(2, retries=retries), together)
    reason = "its worker process was killed (SIGKILL): mostly because the memory was not enough"
    assert made == [(number, reason) if number == 3 and not retries else number for number in range(12)]
    assert (tmp_path / "3.txt").stat().st_size == 1 + retries


def always_cut_off(folder, number):
    """The result of item 3 is cut off every time."""
    if number == 3:  # another item's worker would remove the file under it
        (folder / "3.txt").unlink(missing_ok=True)
    return cut_off(folder, number)


def test_an_item_whose_result_never_arrives_is_lost_and_no_other(tmp_path, monkeypatch):
    monkeypatch.setattr(processes, "_NOTICED_WITHIN", 0.2)
    monkeypatch.setattr(processes, "_CHECKED_EVERY", 0.1)
    made = run(partial(always_cut_off, tmp_path), 12, Workers(2, retries=1), 8)
    assert [item for item in made if isinstance(item, int)] == [number for number in range(12) if number != 3]
    assert made[3][0] == 3 and "in each of 2 attempts" in made[3][1]


def nap(number):
    time.sleep(0.05)
    return number


def test_two_pools_of_one_program_leave_each_other_alone(monkeypatch):
    monkeypatch.setattr(processes, "_NOTICED_WITHIN", 0.2)
    monkeypatch.setattr(processes, "_CHECKED_EVERY", 0.05)
    made = {}

    def work(count):
        made[count] = run(nap, count, Workers(2, retries=0))

    threads = [threading.Thread(target=work, args=(count,)) for count in (4, 60)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60.0)
    assert made == {count: list(range(count)) for count in (4, 60)}


def test_work_that_is_given_up_after_a_result_was_cut_off_leaves_nothing(tmp_path):
    processes_before, threads_before = set(multiprocessing.active_children()), set(threading.enumerate())
    made = in_order(partial(cut_off, tmp_path), range(12), 12, Workers(2), of_lost=lost)
    assert next(made) == 0
    until = time.monotonic() + 20.0
    while not (tmp_path / "3.txt").exists() and time.monotonic() < until:
        time.sleep(0.05)
    time.sleep(0.2)
    made.close()
    assert set(multiprocessing.active_children()) <= processes_before
    for thread in set(threading.enumerate()) - threads_before:
        thread.join(10.0)
        assert not thread.is_alive()


def test_a_process_that_is_stopped_is_ended_by_the_time_limit(monkeypatch):
    monkeypatch.setattr(processes, "_GRACE", 0.2)
    made = run(stopped, 6, Workers(2, timeout=0.5, retries=0))
    assert made == [0, 1, (2, "took longer than 0.5 s (--timeout)"), 3, 4, 5]


def test_without_shared_memory_one_line_states_it(monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(multiprocessing.context.BaseContext, "RawArray", full)
    with pytest.raises(WorkerError, match="no shared memory for processes: No space left on device"):
        run(abs, 8, Workers(2))


@pytest.mark.parametrize("jobs", [1, 2])
@pytest.mark.parametrize("work", [slow, stuck])
def test_an_item_that_takes_too_long_is_ended(work, jobs):
    begin = time.monotonic()
    made = run(work, 6, Workers(jobs, timeout=0.5, retries=0))
    assert made == [0, 1, (2, "took longer than 0.5 s (--timeout)"), 3, 4, 5]
    assert time.monotonic() - begin < 30.0


def test_a_time_limit_ends_no_item_that_keeps_it():
    assert run(abs, 200, Workers(2, timeout=5.0), 8) == list(range(200))


@pytest.mark.parametrize("together", [1, 8])
def test_an_item_that_ends_its_worker_once_is_repeated_and_done(tmp_path, together):
    assert run(partial(once, tmp_path), 40, Workers(2), together) == list(range(40))
    attempts = [(tmp_path / f"{number}.txt").stat().st_size for number in range(0, 40, 5)]
    assert attempts == [2] * 8, "what is blamed for nothing would have been tried once more"


def test_a_lost_item_is_an_error_where_nothing_stands_for_it():
    with pytest.raises(WorkerError) as raised:
        list(in_order(killed, range(8), 8, Workers(2)))
    assert "5: its worker process was killed" in raised.value.message and "--jobs" in raised.value.hint


def test_results_used_slowly_do_not_hide_a_lost_item():
    made = []
    for result in in_order(killed, range(20), 20, Workers(2), of_lost=lost):
        time.sleep(0.02)
        made.append(result)
    assert [item for item in made if not isinstance(item, tuple)] == [number for number in range(20) if number != 5]


def idle(folder, number):
    """Kill the other worker, which waits for work, once."""
    own = folder / f"{os.getpid()}.pid"
    own.touch()
    # Long enough for the other worker to have returned the item before.
    time.sleep(0.3 if number == 7 else 0.05)
    others = [int(file.stem) for file in folder.glob("*.pid") if file != own]
    if number == 7 and others and not (folder / "done").exists():
        (folder / "done").touch()
        os.kill(others[0], signal.SIGKILL)
        time.sleep(0.3)
    return number


def test_a_worker_that_is_killed_between_two_items_costs_none(tmp_path):
    assert run(partial(idle, tmp_path), 8, Workers(2, retries=0)) == list(range(8))


@pytest.mark.parametrize("wrong", [{"jobs": 0}, {"timeout": 0.0}, {"timeout": -1.0}, {"retries": -1}])
def test_workers_that_cannot_be_are_refused(wrong):
    with pytest.raises(UsageError):
        Workers(**wrong)


class Shared:
    """A pool whose only worker holds a queue of batches, all of which are lost when one of them ends it.

    `ends` are the items that always end the worker, `once` those that do so the first time. An item that is to be alone
    is done while the queue is elsewhere.
    """

    broken = (ConnectionError,)
    isolates = True
    size = 1

    def __init__(self, ends, once):
        self.ends, self.once = ends, set(once)
        self.queue = deque()
        self.may_work = threading.Condition()
        self.ended = False

    def submit(self, batch, *, alone=False):
        future = Future()
        with self.may_work:
            self.queue.append((batch, future, alone))
            self.may_work.notify()
        return future

    def work(self):
        while not self.ended:
            with self.may_work:
                self.may_work.wait_for(lambda: self.queue or self.ended)
                if not self.queue:
                    continue
                batch, future, alone = self.queue.popleft()
                numbers = {number for number, _ in batch}
                if fatal := numbers & (self.ends | self.once):
                    self.once -= fatal
                    future.set_exception(ConnectionError(*(numbers if alone and len(batch) == 1 else ())))
                    for other in [item for item in self.queue if not alone and not item[2]]:
                        self.queue.remove(other)
                        other[1].set_exception(ConnectionError())
                else:
                    future.set_result([10 * item for _, item in batch])

    def blamed(self, lost):
        return dict.fromkeys(lost.exception().args, "its worker ended")

    def check(self):
        return None

    def progressed(self):
        pass

    @contextmanager
    def __call__(self):
        worker = threading.Thread(target=self.work)
        worker.start()
        try:
            yield self
        finally:
            with self.may_work:
                self.ended = True
                self.may_work.notify()
            worker.join()


@given(
    st.integers(1, 40),
    st.sets(st.integers(0, 39), max_size=4),
    st.sets(st.integers(0, 39), max_size=4),
    st.integers(0, 3),
    st.integers(1, 8),
)
def test_where_several_share_a_worker_only_those_that_end_it_alone_are_lost(count, ends, once, retries, together):
    pool = Shared(ends, once - ends)
    ordered = _Ordered(pool, count, retries, lost, together)
    made = list(ordered.results(range(count)))
    gone = {item for item in made if isinstance(item, tuple)}
    lost_items, always = {number for number, _ in gone}, {number for number in ends if number < count}
    # One that ends it alone for the first time is lost if nothing is tried again.
    assert always <= lost_items <= (always | once if not retries else always)
    assert [item[0] * 10 if isinstance(item, tuple) else item for item in made] == [10 * k for k in range(count)]


class Sizes:
    """A pool that notes how many items it receives at once."""

    broken = ()
    isolates = False

    def __init__(self, size):
        self.size, self.seen = size, []

    def submit(self, batch, *, alone=False):  # noqa: ARG002
        self.seen.append(len(batch))
        future = Future()
        future.set_result([item for _, item in batch])
        return future

    def blamed(self, _):
        raise AssertionError

    def check(self):
        return None

    def progressed(self):
        pass

    @contextmanager
    def __call__(self):
        yield self


@given(st.integers(0, 3000), st.integers(1, 64))
def test_batches_are_small_at_the_beginning_and_at_the_end(count, jobs):
    pool = Sizes(jobs)
    assert list(_Ordered(pool, count, 1, None, 8).results(range(count))) == list(range(count))
    assert sum(pool.seen) == count and all(1 <= size <= 8 for size in pool.seen)
    done = 0
    for size in pool.seen:
        assert size == 1 or size * 4 * jobs <= min(done, count - done), "other workers have as much to do"
        done += size
