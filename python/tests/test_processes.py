"""Copies, threads and processes."""

import multiprocessing
import pickle
import threading
import time

import pytest


def test_results_and_pipelines_are_pickled(pipeline, pixels, result):
    copy = pickle.loads(pickle.dumps(result))
    assert copy == result and copy and repr(copy) == repr(result)
    assert copy.wcs.wcs.compare(result.wcs.wcs)
    assert (copy.attitude_covariance == result.attitude_covariance).all()
    assert pickle.loads(pickle.dumps(pipeline)).solve(pixels) == result


@pytest.mark.parametrize("method", ["fork", "spawn"])
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


def test_ctrl_c_ends_a_run_of_many_frames(pipeline, pixels):
    results = pipeline.solve_many([pixels] * 10_000, threads=2)
    next(results)
    started = time.perf_counter()
    results.close()
    assert time.perf_counter() - started < 5.0


def test_a_card_for_notebooks(result):
    card = result._repr_html_()
    assert card.startswith("<table>") and "named" in card
    assert "\n" not in repr(result)
