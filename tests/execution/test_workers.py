"""Work in several processes: the same results in the same order, errors as in this process, and no process left."""

import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.base import errors
from cdtool.base.errors import CdtoolError, RecordingError
from cdtool.execution.workers import Workers, in_order
from cdtool.recordings.recording import Recording, Series


def doubled(number):
    time.sleep(0.002 * (number % 3))
    return 2 * number


def own_process(_):
    return os.getpid()


def refused(number):
    if number == 5:
        raise RecordingError("05.csv: no row", "check the file", channel="torque")
    return number


@pytest.mark.parametrize("jobs", [1, 2, 3, 20])
def test_results_come_in_the_order_of_the_items_whatever_the_number_of_jobs(jobs):
    shown = []
    made = list(
        in_order(doubled, range(13), 13, Workers(jobs, progress=lambda done, total: shown.append((done, total))))
    )
    assert made == [2 * number for number in range(13)]
    assert shown == [(number, 13) for number in range(1, 14)]


def test_no_items_need_no_process():
    assert list(in_order(own_process, [], 0, Workers(4))) == []
    assert list(in_order(own_process, [1, 2], 2, Workers(4))) == [os.getpid(), os.getpid()]


@pytest.mark.parametrize("beside", [0, 1])
def test_work_is_done_in_other_processes_with_and_without_threads_in_this_one(beside):
    stop = threading.Event()
    threads = [threading.Thread(target=stop.wait) for _ in range(beside)]
    for thread in threads:
        thread.start()
    try:
        made = list(in_order(own_process, range(12), 12, Workers(2)))
    finally:
        stop.set()
    assert os.getpid() not in made and 1 <= len(set(made)) <= 2


def test_items_are_taken_when_their_work_begins_not_all_at_once():
    taken = []
    results = in_order(doubled, (taken.append(number) or number for number in range(100)), 100, Workers(2))
    for number in range(10):
        assert next(results) == 2 * number
    assert len(taken) <= 10 + 8 * 2
    results.close()


def test_an_error_of_the_work_arrives_as_it_was_raised():
    results = in_order(refused, range(100), 100, Workers(2))
    assert [next(results) for _ in range(5)] == [0, 1, 2, 3, 4]
    with pytest.raises(RecordingError) as raised:
        next(results)
    assert (raised.value.message, raised.value.hint, raised.value.channel) == (
        "05.csv: no row",
        "check the file",
        "torque",
    )


def public_errors():
    return [
        item
        for item in vars(errors).values()
        if isinstance(item, type) and issubclass(item, CdtoolError) and item is not errors.FieldsError
    ]


@pytest.mark.parametrize("kind", public_errors())
@given(st.text(), st.text(), st.text())
def test_every_error_survives_the_way_to_another_process(kind, message, hint, channel):
    again = pickle.loads(pickle.dumps(kind(message, hint, channel=channel)))
    assert type(again) is kind and vars(again) == {"message": message, "hint": hint, "channel": channel}
    assert str(again) == str(kind(message, hint))


def test_a_recording_from_another_process_is_the_same_and_read_only():
    time_s = np.arange(5) * 1e-3
    speed = Series(time_s, np.array([0.0, 1.0, np.nan, 3.0, 4.0]), "m/s")
    recording = Recording("a", "a.csv", ("axis",), {"speed": speed, "torque": replace(speed, unit="N")})
    assert recording["speed"].period > 0.0
    again = pickle.loads(pickle.dumps(recording))
    np.testing.assert_array_equal(again["speed"].values, speed.values)
    assert again["speed"].unit == "m/s" and again["speed"].period == speed.period
    assert again["torque"].time is again["speed"].time, "a clock shared by channels is sent and stored once"
    for array in (again["speed"].time, again["speed"].values):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


ENDLESS = r"""
import os, signal, sys, time
sys.path.insert(0, sys.argv[1])
signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored by programs that a shell starts in the background
from cdtool.execution.workers import Workers, in_order

def work(number):
    os.write(1, b"%d\n" % os.getpid())
    time.sleep(60.0)

if __name__ == "__main__":
    list(in_order(work, range(4), 4, Workers(2)))
"""


def is_running(process):
    try:
        state = Path(f"/proc/{process}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="reads /proc")
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_no_process_is_left_when_the_first_one_is_interrupted_or_killed(how, tmp_path):
    script = tmp_path / "endless.py"
    script.write_text(ENDLESS, encoding="utf-8")
    root = Path(__file__).parents[2]
    command = [sys.executable, str(script), str(root)]
    first = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)
    try:
        workers = [int(first.stdout.readline()) for _ in range(2)]
        assert all(is_running(worker) for worker in workers)
        if how == signal.SIGINT:
            os.killpg(first.pid, how)  # as a terminal does
        else:
            first.send_signal(how)
        words = first.communicate(timeout=20.0)[1]
        until = time.monotonic() + 20.0
        while any(is_running(worker) for worker in workers) and time.monotonic() < until:
            time.sleep(0.05)
        assert not any(is_running(worker) for worker in workers)
    finally:
        with suppress(ProcessLookupError):
            os.killpg(first.pid, signal.SIGKILL)
        first.wait()
    assert words.count("Traceback") <= 1, "the workers print nothing"
