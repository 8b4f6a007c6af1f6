"""Python's other threads run while the library works, and Ctrl-C is heard."""

from __future__ import annotations

import pathlib
import subprocess
import sys
import threading

import imucal

#: Longer than any calibration here takes, s: only a failure waits for it.
LONG = 300


def test_a_thread_of_python_runs_while_a_calibration_does(rig: imucal.Recording) -> None:
    done = threading.Event()
    counted = 0
    before = threading.Event()

    def count() -> None:
        nonlocal counted
        before.set()
        # Waiting lets the GIL go, so that the calibrating thread gets it back.
        while not done.wait(0.001):
            counted += 1

    thread = threading.Thread(target=count)
    interval = sys.getswitchinterval()
    # Longer than the calibration: only a GIL that is released lets the other thread on.
    sys.setswitchinterval(LONG)
    try:
        thread.start()
        before.wait(LONG)
        at_start = counted
        found = imucal.calibrate(rig)
        at_end = counted
        done.set()
    finally:
        sys.setswitchinterval(interval)
        done.set()
        thread.join(LONG)
    assert found.sensors and at_end > at_start


def test_two_calibrations_in_two_threads_are_under_way_at_once(rig: imucal.Recording) -> None:
    # A thread that has begun counts itself; whoever finds two has met the other inside.
    inside, most, lock = 0, 0, threading.Lock()
    results: list[str] = []
    start = threading.Barrier(2)

    def work() -> None:
        nonlocal inside, most
        start.wait(LONG)
        with lock:
            inside += 1
            most = max(most, inside)
        found = imucal.calibrate(rig)
        with lock:
            inside -= 1
            results.append(found.json)

    interval = sys.getswitchinterval()
    # No thread is made to give way: the second gets in because the first has let the GIL go.
    sys.setswitchinterval(LONG)
    try:
        threads = [threading.Thread(target=work) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(LONG)
    finally:
        sys.setswitchinterval(interval)
    assert most == 2 and len(results) == 2 and results[0] == results[1]


INTERRUPTED = """
import os, signal, sys, threading, imucal

recording = imucal.read(sys.argv[1])
threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
try:
    while True:
        imucal.diagnose(recording)
except KeyboardInterrupt:
    print("heard")
"""


def test_ctrl_c_ends_a_diagnosis(folder: pathlib.Path) -> None:
    words = [sys.executable, "-c", INTERRUPTED, str(folder / "rig.csv.gz")]
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=LONG)
    assert done.stdout == "heard\n", done.stderr
