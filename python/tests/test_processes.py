"""Copies, threads and processes."""

import multiprocessing
import pickle
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import starpipe as sp

STATUS = Path("/proc/self/status")


def test_results_and_pipelines_are_pickled(pipeline, pixels, result):
    copy = pickle.loads(pickle.dumps(result))
    assert copy == result and copy and repr(copy) == repr(result)
    assert copy.wcs.wcs.compare(result.wcs.wcs)
    assert (copy.attitude_covariance == result.attitude_covariance).all()
    assert pickle.loads(pickle.dumps(pipeline)).solve(pixels) == result


@pytest.mark.parametrize("method", multiprocessing.get_all_start_methods())
def test_other_processes_solve(pipeline, pixels, result, method):
    context = multiprocessing.get_context(method)
    with context.Pool(2) as pool:
        pending = pool.map_async(pipeline.solve, [pixels] * 4)
        assert pending.get(timeout=60) == [result] * 4


def test_threads_share_a_pipeline_and_python_runs_meanwhile(pipeline, pixels, result):
    found = []
    work = [threading.Thread(target=lambda: found.append(pipeline.solve(pixels))) for _ in range(8)]
    for thread in work:
        thread.start()
    for thread in work:
        thread.join()
    assert found == [result] * 8


INTERRUPTED = """
import itertools, sys, time
import numpy as np
import starpipe as sp

noise = np.random.default_rng(1).normal(500.0, 10.0, (2000, 3000)).astype(np.float32)
try:
    for result in sp.Pipeline().solve_many(itertools.repeat(noise), threads=2):
        print("solved", flush=True)
except KeyboardInterrupt:
    print("interrupted", time.time(), flush=True)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="has no SIGINT for one process")
def test_ctrl_c_ends_a_run_of_many_frames():
    command = [sys.executable, "-c", INTERRUPTED]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout.readline() == "solved\n"
        signalled = time.time()
        child.send_signal(signal.SIGINT)
        last = child.stdout.read().splitlines()[-1]
        assert child.wait(timeout=60) == 0
    told, when = last.split()
    # Some hundredths of a second on an idle machine.
    assert told == "interrupted" and float(when) - signalled < 2.0


def test_a_frame_of_16_bits_is_not_copied():
    if not STATUS.exists():
        pytest.skip(f"{STATUS} does not tell the memory of a process")
    growth_mb = []
    for dtype in ("=u2", ">u2" if sys.byteorder == "little" else "<u2"):
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            growth_mb.append(pool.apply(memory_of_a_frame, [dtype]))
    # The frame has 76 MB. In the other byte order it is copied.
    assert growth_mb[0] + 60 < growth_mb[1], growth_mb


def memory_of_a_frame(dtype):
    """Return by how many MB the process grows while a frame is solved."""
    pipeline = sp.Pipeline()
    noise = np.random.default_rng(1)
    pipeline.solve(noise.integers(400, 500, (512, 512), dtype=np.uint16))
    pixels = np.zeros((5000, 8000), dtype=dtype)
    for row in pixels:
        row[:] = noise.integers(400, 500, len(row), dtype=np.uint16)
    before = _peak_mb()
    pipeline.solve(pixels)
    return _peak_mb() - before


def _peak_mb():
    (line,) = (line for line in STATUS.read_text().splitlines() if line.startswith("VmHWM"))
    return int(line.split()[1]) / 1024
