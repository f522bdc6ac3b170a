"""Frames for the tests."""

import os
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import starpipe as sp

# Results do not depend on the catalogs that are installed here.
os.environ["STARPIPE_CATALOGS"] = ""

REPOSITORY = Path(__file__).parents[2]
SHARED = REPOSITORY.parent / "shared"


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
def program():
    """Return the program, whose numbers the package's are compared with."""
    program = os.environ.get("STARPIPE_PROGRAM")
    if program is None:
        pytest.skip("STARPIPE_PROGRAM does not name the program")
    return program


def _shared(pattern):
    found = sorted(SHARED.glob(pattern))
    if not found:
        if os.environ.get("STARPIPE_REQUIRE_SHARED") == "1":
            pytest.fail(f"no {pattern} in {SHARED}")
        pytest.skip(f"no {pattern} in {SHARED}")
    return found


@pytest.fixture
def sky2000():
    """Return the whole catalogue as it was distributed."""
    return _shared("sky2000/SKYMAP_SKY2000_V5R4.gz")[0]


@pytest.fixture
def real_frames():
    return _shared("frames/*.tiff")
