"""Simulation, prediction and studies: the same numbers as the program's."""

import json
import subprocess

import numpy as np
import pytest
from astropy import units as u
from PIL import Image

import starpipe as sp

CAMERA = "nanosat-tracker"


def test_a_simulated_frame_is_that_of_the_program(program, tmp_path):
    options = ["--preset", CAMERA, "--random-attitude", "--seed", "3", "--first", "5"]
    frame = tmp_path / "frame.tif"
    subprocess.run([program, "simulate", *options, "--out", frame], check=True)
    simulated = sp.simulate(CAMERA, seed=3, frame=5)
    assert np.array_equal(np.array(Image.open(frame)), simulated.image)
    rows = (tmp_path / "frame.csv").read_text().splitlines()
    assert len(simulated.stars) == len(rows) - 1
    assert str(simulated.stars["id"][0]) == rows[1].split(",")[1]


def test_a_simulated_frame_is_solved_where_it_points(pipeline):
    simulated = sp.simulate(CAMERA, ra=83.8 * u.deg, dec=-1.2, roll=20.0)
    result = pipeline.solve(simulated.image)
    assert result.center.separation(simulated.wcs.pixel_to_world(*_centre(simulated))).arcsec < 30
    assert abs(np.dot(result.quaternion, simulated.quaternion)) > 1.0 - 1e-6


def _centre(simulated):
    rows, columns = simulated.image.shape
    return (columns - 1) / 2, (rows - 1) / 2


def test_detections_can_be_identified(pipeline):
    image = sp.simulate(CAMERA, ra=83.8, dec=-1.2).image
    found = sp.detect(image)
    assert len(found) == len(found.stars) == len(found.x)
    result = pipeline.identify(
        found.x, found.y, flux=found.flux, error=found.error, shape=image.shape
    )
    whole = pipeline.solve(image)
    assert result.center.separation(whole.center).arcsec < 10
    assert np.array_equal(found.x, whole.star_columns["x"])


def test_the_limit_is_the_programs(program):
    command = [program, "limit", "--preset", "experiment-1", "--exposure", "0.2"]
    printed = subprocess.run([*command, "--format", "json"], capture_output=True, check=True)
    found = sp.limit("experiment-1", exposure=200 * u.ms)
    assert found == json.loads(printed.stdout)
    wider = sp.limit("experiment-1", exposure=0.2, aperture_mm=5 * u.cm)
    assert wider["parameters"]["aperture_mm"] == 50.0


def test_a_validation_is_the_programs(program, tmp_path):
    options = ["--preset", CAMERA, "--frames", "12", "--seed", "4"]
    subprocess.run(
        [program, "validate", *options, "--out", tmp_path], check=True, capture_output=True
    )
    found = sp.validate(CAMERA, count=12, seed=4, threads=2)
    assert found.summary == json.loads((tmp_path / "summary.json").read_text())
    assert list(found.frames["frame"]) == list(range(12))
    assert len(found.stars) == found.frames["star_rows"].sum()


def test_robustness_has_a_row_or_the_standard_table():
    (row,) = sp.robustness(fov=10 * u.deg, count=60, threads=2)
    assert (row["trials"], row["wrong_of_all"]) == (60, 0)
    assert len(sp.robustness(count=2)) == 17


def test_darks_give_master_mask_and_noise(pipeline):
    noise = {"read_noise_e": 8.0, "hot_pixels_per_mpx": 200.0}
    frames = [sp.simulate(CAMERA, dark=True, frame=n, **noise).image for n in range(5)]
    found = sp.darks(frames, exposure=0.1, bits=12)
    (master,) = found.masters.values()
    assert list(found.masters) == [0.1]
    assert master == pytest.approx(np.mean(frames, axis=0), abs=1e-3)
    assert found.mask.sum() == len(found.hot_pixels) > 10
    image = sp.simulate(CAMERA, ra=83.8, dec=-1.2, **noise).image
    assert pipeline.solve(image, found.mask, dark=master)


def test_flats_give_a_master_and_the_gain_of_the_program(program, pipeline, tmp_path):
    light = [2000.0, 2000.0, 6000.0, 6000.0]
    frames = [sp.simulate(CAMERA, flat=e, frame=n).image for n, e in enumerate(light)]
    dark = sp.simulate(CAMERA, dark=True).image
    found = sp.flats(frames, dark=dark)
    assert found.master.shape == dark.shape and found.master.dtype == np.float32
    assert np.nanmean(found.master) == pytest.approx(1.0, abs=1e-3)
    paths = []
    for number, image in enumerate([*frames, dark]):
        paths.append(tmp_path / f"{number}.tif")
        Image.fromarray(image).save(paths[-1])
    command = [program, "flats", "--format", "json", "--dark", paths[-1], *paths[:-1]]
    printed = subprocess.run(command, capture_output=True, check=True)
    expected = json.loads(printed.stdout)
    assert sp.flats(paths[:-1], dark=paths[-1]).report == expected
    assert found.report["gain_e_per_adu"] == expected["gain_e_per_adu"] > 0.0
    image = sp.simulate(CAMERA, ra=83.8, dec=-1.2).image
    assert pipeline.solve(image, dark=dark, flat=found.master)


def test_flats_without_a_level_of_darkness_warn(caplog):
    flat = sp.simulate(CAMERA, flat=8000.0).image
    assert sp.flats([flat], camera=CAMERA).report["gain_e_per_adu"] is None
    assert not caplog.records
    sp.flats([flat])
    assert "assumed to be 0" in caplog.text


@pytest.mark.parametrize("camera", [None, CAMERA])
def test_the_best_radius_is_the_programs(program, camera):
    command = [program, "defocus", "--trials", "4", "--required-error", "0.05"]
    command += ["--preset", camera] if camera else []
    # Its exit status says whether a radius meets the required error.
    printed = subprocess.run([*command, "--format", "json"], capture_output=True).stdout
    found = sp.defocus(camera, count=4, threads=2, required_error=0.05)
    assert found == json.loads(printed)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: sp.limit(CAMERA, apertur_mm=3.0), "did you mean 'aperture_mm'"),
        (lambda: sp.limit(CAMERA, aperture_mm=3.0 * u.s), "aperture_mm must be convertible to mm"),
        (lambda: sp.limit(CAMERA, exposure=-1.0), "exposure must be more than 0 s"),
        (lambda: sp.limit(CAMERA, reading="own"), "reading must be 'paper' or 'physical'"),
        (lambda: sp.limit("no-such.toml"), "no-such.toml"),
        (lambda: sp.limit(CAMERA, pitch_x_um=5.0, pixel_area_um2=9.0), "set the same quantity"),
        (lambda: sp.simulate(CAMERA, ra=3.0), "ra and dec belong together"),
        (lambda: sp.simulate(CAMERA, dark=True, ra=1.0, dec=2.0), "are alternatives: give one"),
        (lambda: sp.simulate(CAMERA, flat=-1.0), "flat must be at least 0 electron, not -1"),
        (lambda: sp.simulate(CAMERA, read_noise_e=-1.0), "read_noise_e is -1"),
        (lambda: sp.detect(np.zeros((2, 2))), "2 "),
        (lambda: sp.robustness(fov=200.0), "fov must be more than 0 and less than 179 deg"),
        (lambda: sp.robustness(missing=200.0), "missing must be from 0 to 100"),
        (lambda: sp.defocus(vmag=5.0), "need a camera"),
        (lambda: sp.darks([]), "frame"),
        (lambda: sp.flats([], camera=CAMERA), "frame"),
        (lambda: sp.flats([np.ones((9, 9)), np.ones((9, 8))], camera=CAMERA), "9|light"),
        (lambda: sp.flats([np.zeros((9, 9))], camera=CAMERA), "light"),
        (lambda: sp.darks([np.zeros((9, 9)), np.zeros((9, 8))]), "9"),
        (lambda: sp.darks([np.zeros((9, 9))], exposure=[1.0, 2.0]), "2 exposures"),
    ],
)
def test_wrong_arguments_are_refused(call, message):
    with pytest.raises((ValueError, OSError), match=message):
        call()
