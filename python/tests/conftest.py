"""Frames for the tests."""

import os
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import starpipe as sp

REPOSITORY = Path(__file__).parents[2]
SHARED = REPOSITORY.parent / "shared" / "frames"


@pytest.fixture(scope="session")
def pipeline():
    return sp.Pipeline()


@pytest.fixture(scope="session")
def frame():
    return REPOSITORY / "fixtures" / "cygnus" / "cygnus.tif"


@pytest.fixture(scope="session")
def pixels(frame):
    with Image.open(frame) as image:
        return np.array(image).astype(np.uint16)


@pytest.fixture(scope="session")
def result(pipeline, pixels):
    return pipeline.solve(pixels)


@pytest.fixture
def real_frames():
    frames = sorted(SHARED.glob("*.tiff"))
    if not frames:
        if os.environ.get("STARPIPE_REQUIRE_SHARED") == "1":
            pytest.fail(f"no frames in {SHARED}")
        pytest.skip(f"no frames in {SHARED}")
    return frames
