"""The attitude from frame to frame."""

import json
import pickle
import subprocess

import numpy as np
import pytest
from astropy import units as u
from astropy.time import Time, TimeDelta

import starpipe as sp

CAMERA = "experiment-1"
STEP_DEG = 0.02
"""The camera turns by this much from frame to frame, southwards."""


@pytest.fixture(scope="module")
def turning():
    """Return frames of a turning camera."""
    pointings = [-1.2 - STEP_DEG * number for number in range(5)]
    return [sp.simulate(CAMERA, ra=83.8, dec=dec, frame=n) for n, dec in enumerate(pointings)]


def test_a_turning_camera_is_followed(pipeline, turning):
    tracker = sp.Tracker(pipeline)
    tracks = [tracker.track(frame.image, time=0.1 * n) for n, frame in enumerate(turning)]
    assert all(tracks)
    assert [track.mode for track in tracks] == ["acquired"] * 2 + ["tracked"] * 3
    for track, frame in zip(tracks, turning, strict=True):
        assert abs(np.dot(track.quaternion, frame.quaternion)) > 1.0 - 1e-8
        sigma = np.sqrt(np.diag(track.attitude_covariance))
        stated = u.Quantity([*track.center_err[::-1], track.roll_err]).to_value("rad")
        np.testing.assert_allclose(sigma, stated, rtol=6e-3)
        assert track.stars_used >= 4 and track.reason is None
    assert tracks[0].rate is None and tracks[0].rate_err is None
    last = tracks[-1]
    assert last.stars_used <= 30
    assert last.rate.unit == u.deg / u.s
    turned = np.linalg.norm(last.rate.value) / (STEP_DEG / 0.1)
    assert turned == pytest.approx(1.0, abs=0.05)
    assert (last.rate_err > 0 * u.deg / u.s).all()
    assert last.center.dec.deg == pytest.approx(-1.2 - 4 * STEP_DEG, abs=0.002)
    assert pickle.loads(pickle.dumps(last)).to_dict() == last.to_dict()
    assert "tracked" in repr(last)


def test_numbers_are_those_of_the_program(program, pipeline, frame):
    command = [program, "track", "--interval", "0.1", frame, frame, frame]
    printed = subprocess.run(command, capture_output=True, check=True, text=True)
    tracker = sp.Tracker(pipeline)
    for number, line in enumerate(printed.stdout.splitlines()):
        found = tracker.track(frame, time=number * 100 * u.ms).to_dict()
        expected = json.loads(line)
        assert found.pop("timing_ms").keys() == expected.pop("timing_ms").keys()
        assert found == expected


def test_times_may_be_astropys_or_unknown(pipeline, turning):
    start = Time("2024-05-06T07:08:09")
    differences = [TimeDelta(0.1 * n * u.s) for n in range(3)]
    for times in (differences, [start + difference for difference in differences]):
        tracker = sp.Tracker(pipeline)
        for frame, time in zip(turning, times, strict=False):
            track = tracker.track(frame.image, time=time)
        assert track.mode == "tracked"
        assert np.linalg.norm(track.rate.to_value("deg/s")) == pytest.approx(0.2, abs=0.01)
    tracker = sp.Tracker(pipeline, stars=12)
    for frame in turning[:3]:
        track = tracker.track(frame.image)
    assert track.rate.unit == u.deg and track.stars_used <= 12
    assert np.linalg.norm(track.rate.value) == pytest.approx(STEP_DEG, rel=0.05)
    tracker.reset()
    assert tracker.track(turning[3].image).mode == "acquired"


def test_a_frame_without_stars_is_lost_and_the_next_one_found(pipeline, turning):
    tracker = sp.Tracker(pipeline)
    tracker.track(turning[0].image)
    lost = tracker.track(sp.simulate(CAMERA, dark=True).image)
    assert not lost and lost.mode == "lost" and lost.reason
    assert lost.center is None and lost.quaternion is None and lost.rate is None
    assert lost.attitude_covariance is None and "lost" in repr(lost)
    assert tracker.track(turning[2].image)


def test_masters_are_applied_to_each_frame(pipeline, turning, tmp_path):
    images = [frame.image for frame in turning[:3]]
    pattern = np.random.default_rng(1).integers(0, 2000, images[0].shape).astype(np.uint16)
    dirty = [image.astype(np.uint16) + pattern for image in images]
    plain, calibrated = sp.Tracker(pipeline), sp.Tracker(pipeline, dark=pattern)
    for one, other in zip(images, dirty, strict=True):
        expected, found = plain.track(one), calibrated.track(other)
    assert expected.mode == found.mode == "tracked"
    assert found.center.separation(expected.center) < 5 * u.arcsec
    with pytest.raises(ValueError, match="calibrating"):
        calibrated.track(images[0][1:])


def test_wrong_arguments_are_refused(pipeline, turning, tmp_path):
    with pytest.raises(ValueError, match="stars must be a whole number of at least 4"):
        sp.Tracker(pipeline, stars=3)
    with pytest.raises(ValueError, match="fov must be more than 0"):
        sp.Tracker(pipeline, fov=-1)
    tracker = sp.Tracker(pipeline)
    with pytest.raises(ValueError, match="time must be convertible to s"):
        tracker.track(turning[0].image, time=3 * u.deg)
    with pytest.raises(OSError, match=r"missing\.tif"):
        tracker.track(tmp_path / "missing.tif")
