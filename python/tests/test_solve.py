"""Frames are solved, however they are passed."""

import json
import pickle
import subprocess

import numpy as np
import pytest

import starpipe as sp


def without_times(report):
    return {key: value for key, value in report.items() if key not in ("timing_ms", "frame")}


def test_an_array_gives_what_the_file_gives(pipeline, frame, pixels):
    of_file = pipeline.solve(frame)
    of_bytes = pipeline.solve(frame.read_bytes())
    of_array = pipeline.solve(pixels, exposure=of_file.to_dict()["exposure_s"])
    assert of_file and of_file == pipeline.solve(str(frame))
    stars = of_file.to_dict()["stars"]
    assert of_bytes.to_dict()["stars"] == stars
    assert of_array.to_dict()["stars"] == stars
    assert of_array.to_dict()["attitude"] == of_file.to_dict()["attitude"]


def test_the_numbers_are_those_of_the_program(pipeline, program, frame, real_frames):
    for path in [frame, *real_frames]:
        command = [program, "process", path, "--format", "json"]
        printed = subprocess.run(command, capture_output=True, check=True).stdout
        assert without_times(pipeline.solve(path).to_dict()) == without_times(json.loads(printed))


@pytest.mark.parametrize(
    "dtype", [np.int32, np.uint32, np.float32, np.float64, ">u2", ">f4", ">i4"]
)
def test_any_real_type_and_byte_order_gives_the_same_pointing(pipeline, pixels, result, dtype):
    found = pipeline.solve(pixels.astype(dtype))
    assert found
    np.testing.assert_allclose(found.quaternion, result.quaternion, atol=2e-7)


def test_an_array_with_gaps_or_read_only_is_solved_as_its_copy(pipeline, pixels, result):
    spread = np.zeros((2 * pixels.shape[0], 2 * pixels.shape[1]), dtype=np.uint16)
    spread[::2, ::2] = pixels
    assert pipeline.solve(spread[::2, ::2]) == result
    assert pipeline.solve(np.asfortranarray(pixels)) == result
    fixed = pixels.copy()
    fixed.flags.writeable = False
    assert pipeline.solve(fixed) == result


def test_masked_pixels_hold_no_stars(pipeline, pixels, result):
    mask = np.zeros(pixels.shape, dtype=bool)
    mask[:, : pixels.shape[1] // 3] = True
    for found in (
        pipeline.solve(pixels, mask),
        pipeline.solve(np.ma.MaskedArray(pixels, mask)),
    ):
        assert 0 < len(found.stars) < len(result.stars)
        assert found.star_columns["x"].min() > pixels.shape[1] // 3 - 3
    assert not mask[:, -1].any() and (pixels == pixels.copy()).all()


def test_no_star_is_no_exception(pipeline):
    noise = np.random.default_rng(1).normal(500.0, 5.0, (300, 400)).astype(np.float32)
    found = pipeline.solve(noise)
    assert not found and found.reason_code and found.reason
    assert found.wcs is None and found.center is None and found.quaternion is None
    assert found.attitude_covariance is None and "not identified" in repr(found)


def test_threads_and_hints_do_not_move_the_answer(pipeline, pixels, result):
    assert pipeline.solve(pixels, threads=3) == result
    near = result.to_dict()["attitude"]
    fov = result.to_dict()["optics"]["fov_x_deg"]
    found = pipeline.solve(pixels, fov=fov, near=(near["ra_deg"], near["dec_deg"]), radius=5)
    np.testing.assert_allclose(found.quaternion, result.quaternion, atol=2e-7)
    # A wrong direction is dropped, and a note says so.
    elsewhere = pipeline.solve(pixels, near=(near["ra_deg"] + 180.0, 0.0), radius=5)
    np.testing.assert_allclose(elsewhere.quaternion, result.quaternion, atol=2e-7)
    assert "direction_wrong" in {note["code"] for note in elsewhere.to_dict()["notes"]}


def test_centroids_are_identified(pipeline, pixels, result):
    stars = result.star_columns
    known = {"flux": stars["flux"], "error": stars["sigma_x"], "shape": pixels.shape}
    found = pipeline.identify(stars["x"], stars["y"], **known)
    assert found
    np.testing.assert_allclose(found.quaternion, result.quaternion, atol=2e-5)


def test_the_shape_of_a_list_is_the_cameras_or_guessed(pipeline, frame, result):
    stars = result.star_columns
    left = stars["x"] < 480.0
    x, y, flux = (stars[name][left] for name in ("x", "y", "flux"))
    with_camera = sp.Pipeline(camera=frame.parent / "camera.toml")
    found = with_camera.identify(x, y, flux=flux)
    assert (found.to_dict()["height"], found.to_dict()["width"]) == (384, 512)
    assert found == with_camera.identify(x, y, flux=flux, shape=(384, 512))
    with pytest.raises(ValueError, match=r"512 . 384"):
        with_camera.identify(x, y, flux=flux, shape=(384, 500))
    with pytest.raises(ValueError, match="outside the frame"):
        pipeline.identify(x, y, flux=flux, shape=(384, 400))
    guessed = pipeline.identify(x, y, flux=flux)
    assert guessed.to_dict()["width"] < 512
    assert "size_guessed" in [note["code"] for note in guessed.to_dict()["notes"]]
    wide, known = (np.diag(one.attitude_covariance) for one in (guessed, found))
    assert (wide[:2] > 4.0 * known[:2]).all()


def test_many_frames_come_in_order_and_errors_in_their_place(pipeline, pixels, result, tmp_path):
    found = pipeline.solve_many([pixels, pixels[:, ::-1], pixels] * 3, threads=2)
    for number, one in enumerate(found):
        assert (one == result) == (number % 3 != 1)
    broken = tmp_path / "broken.tif"
    broken.write_bytes(b"no image")
    images = [pixels, tmp_path / "missing.tif", broken, np.zeros(5), pixels]
    found = list(pipeline.solve_many(images))
    assert [bool(one) for one in found] == [True, False, False, False, True]
    assert found[0] == found[-1] == result and result.error is None
    kinds = [OSError, ValueError, ValueError]
    assert all(isinstance(one.error, kind) for one, kind in zip(found[1:4], kinds, strict=True))
    missing = pickle.loads(pickle.dumps(found[1]))
    for one in (found[1], missing):
        assert "missing.tif" in one.reason and one.reason_code == "unread"
        assert one.to_dict()["status"] == "unread" and "missing.tif" in repr(one)
        assert one.center is None and one.wcs is None and one.quaternion is None
        assert one.to_header() is None and len(one.stars) == 0 and one._repr_html_()


def test_wrong_arguments_of_many_frames_are_refused_at_once(pipeline, pixels):
    with pytest.raises(ValueError, match="fov must be more than 0"):
        pipeline.solve_many([pixels], fov=-1)
    with pytest.raises(TypeError, match="field"):
        pipeline.solve_many([pixels], field=10)


def test_a_bug_that_one_frame_meets_is_its_error(pipeline, pixels, result, monkeypatch, capfd):
    rows, columns = pixels.shape
    monkeypatch.setenv("STARPIPE_PLANTED_PANIC", f"{columns - 1}x{rows}")
    try:
        pipeline.solve(pixels[:, 1:])
    except RuntimeError as error:
        assert "solving array: a bug in starpipe, please report it: planted" in str(error)
    else:
        pytest.skip("a release has no planted bug")
    found = list(pipeline.solve_many([pixels, pixels[:, 1:], pixels], threads=2))
    assert found[0] == found[2] == result and isinstance(found[1].error, RuntimeError)
    with pytest.raises(RuntimeError, match="solving centroids: a bug"):
        pipeline.identify([1, 2], [3, 4], mag=[1, 2], shape=(rows, columns - 1))
    assert capfd.readouterr().err == ""


def test_a_pointing_names_few(pipeline, pixels, result):
    brief = pipeline.point(pixels)
    assert brief
    named = [sum(star["id"] is not None for star in r.to_dict()["stars"]) for r in (brief, result)]
    assert 4 <= named[0] <= named[1]


def test_trails_are_searched_on_demand(pipeline, pixels, result):
    assert result.trails is None
    assert pipeline.solve(pixels, trails=True).trails == []


def test_the_sky_is_measured_on_demand(pipeline, pixels, result):
    assert result.sky_map is None
    sky = pipeline.solve(pixels, sky=True).sky_map
    assert sky["no_brightness"] == "bias_unknown" and len(sky["cells"]) > 20
    assert 0.0 <= sky["cloud_share"] <= 1.0


def test_a_camera_predicts_the_limit(frame):
    camera = frame.parent / "camera.toml"
    pipeline = sp.Pipeline(camera=camera)
    found = pipeline.solve(frame, exposure=0.2)
    assert 3.0 < found.prediction["limit50_vmag"] < 12.0
    assert repr(pipeline) == f"Pipeline(camera={str(camera)!r})"


def test_a_scale_may_be_as_far_off_as_stated(pipeline, pixels, result):
    assert not pipeline.solve(pixels, fov=9.0)
    found = pipeline.solve(pixels, fov=9.0, scale_error=40)
    assert found and found.quaternion == pytest.approx(result.quaternion, abs=1e-4)


def test_surer_names_are_fewer(pipeline, pixels, result):
    surest = pipeline.solve(pixels, name_odds=1e6)
    assert 0 < (surest.star_columns["id"] != "").sum() < (result.star_columns["id"] != "").sum()
    assert np.nanmax(surest.star_columns["p_chance"]) <= 1e-6


def test_air_dims_the_stars_of_a_stated_camera(frame):
    pipeline = sp.Pipeline(camera=frame.parent / "camera.toml")
    limits = [
        pipeline.solve(frame, exposure=0.2, zenith_distance=angle, extinction=0.5).prediction
        for angle in (0.0, 60.0)
    ]
    assert limits[0]["zero_point_vmag"] == pytest.approx(
        limits[1]["zero_point_vmag"] + 0.5, abs=0.1
    )
