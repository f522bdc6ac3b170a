"""Copies, threads and processes."""

import multiprocessing
import os
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


def _false_stars():
    """Return random places, among which no stars are found: the search takes long."""
    places = np.random.default_rng(1).uniform(0.0, 1000.0, (2, 150))
    return {"x": places[0], "y": places[1], "flux": 1.0 + places[0], "shape": (1000, 1000)}


def _picture_of(x, y, flux, shape):
    picture = np.random.default_rng(2).normal(500.0, 5.0, shape)
    columns, rows = np.meshgrid(np.arange(-4, 5), np.arange(-4, 5))
    spot = np.exp(-(columns**2 + rows**2) / 2.0)
    for column, row, light in zip(x.astype(int), y.astype(int), flux, strict=True):
        if 4 <= column < shape[1] - 4 and 4 <= row < shape[0] - 4:
            picture[row - 4 : row + 5, column - 4 : column + 5] += light * spot
    return picture


LONG_WORK = {
    "solve": lambda pipeline, _: pipeline.solve(_picture_of(**_false_stars())),
    "solve on two threads": lambda pipeline, _: pipeline.solve(
        _picture_of(**_false_stars()), threads=2
    ),
    "identify": lambda pipeline, _: pipeline.identify(**_false_stars()),
    "the index of a catalogue": lambda _, directory: sp.Pipeline(cache_dir=directory),
    "defocus": lambda *_: sp.defocus("nanosat-tracker", count=20, threads=2),
    "validate": lambda *_: sp.validate("nanosat-tracker", count=20, threads=2),
    "robustness": lambda *_: sp.robustness(fov=10, count=1500, threads=2),
}


class StoppedError(Exception):
    """Raised by a handler of a signal."""


@pytest.mark.skipif(sys.platform == "win32", reason="has no timer that sends signals")
@pytest.mark.parametrize("work", LONG_WORK)
def test_a_signal_ends_long_work(pipeline, tmp_path, work):
    def stop(*_):
        raise StoppedError

    def seconds(directory):
        started = time.perf_counter()
        try:
            LONG_WORK[work](pipeline, tmp_path / directory)
        except StoppedError:
            return True, time.perf_counter() - started
        return False, time.perf_counter() - started

    is_stopped, whole = seconds("whole")
    assert not is_stopped
    before = signal.signal(signal.SIGALRM, stop)
    try:
        signal.setitimer(signal.ITIMER_REAL, whole / 4)
        is_stopped, stopped = seconds("stopped")
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    # Python runs a handler when the call is over at the latest.
    assert is_stopped and stopped < 0.8 * whole, (stopped, whole)


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


def test_more_threads_than_help_are_not_started(pipeline, pixels, result):
    before = threading.active_count()
    assert pipeline.solve(pixels, threads=10**9) == result
    assert len(sp.detect(pixels, threads=10**9)) > 10
    found = pipeline.solve_many([pixels] * 3, threads=10**9)
    assert next(found) == result
    assert threading.active_count() - before <= max(8, os.cpu_count())
    assert [other == result for other in found] == [True, True]


def test_centroids_have_a_time_limit(pipeline):
    started = time.perf_counter()
    with pytest.raises(TimeoutError, match="reached the time limit per frame; see time_limit"):
        pipeline.identify(**_false_stars(), time_limit=0.05)
    assert time.perf_counter() - started < 1.0
