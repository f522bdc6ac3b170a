"""The lens of a camera, from several frames."""

from __future__ import annotations

import pickle
from pathlib import Path

import pytest

import starpipe as sp

CAMERA = Path(__file__).parents[2] / "docs/validation/camera.toml"
DATE = "2000-01-01T12:00:00"


def night(numbers: range) -> list[sp.Simulation]:
    lens = {"distortion_px": -30.0, "axis_x_px": 12.0}
    return [sp.simulate(CAMERA, date=DATE, seed=5, frame=number, **lens) for number in numbers]


def test_a_lens_is_measured_saved_and_held(tmp_path: Path) -> None:
    pipeline = sp.Pipeline()
    results = [pipeline.solve(frame.image, date=DATE) for frame in night(range(6))]
    lens = sp.calibrate(results)
    assert len(lens.report["frames"]) == 6
    assert "pinhole" in repr(lens)
    path = tmp_path / "lens.toml"
    lens.save(path)
    held = sp.Pipeline(camera=path)
    (frame,) = night(range(6, 7))
    sure = held.solve(frame.image, date=DATE)
    free = held.solve(frame.image, date=DATE, refine_lens=True)
    assert sure.to_dict()["optics"]["held"] and not free.to_dict()["optics"]["held"]
    with pytest.raises(FileExistsError):
        lens.save(path)


def test_what_cannot_be_calibrated_is_refused() -> None:
    with pytest.raises(ValueError, match="none of the frames is identified"):
        sp.calibrate([])
    (frame,) = night(range(1))
    restored = pickle.loads(pickle.dumps(sp.Pipeline().solve(frame.image)))
    with pytest.raises(ValueError, match="unpickled result"):
        sp.calibrate([restored])
