"""The answer as astropy's objects."""

import gzip
from dataclasses import FrozenInstanceError, asdict

import numpy as np
import pytest
from astropy import units as u
from astropy.coordinates import EarthLocation, SkyCoord
from astropy.io.votable.ucd import parse_ucd
from astropy.nddata import CCDData
from astropy.table import QTable
from astropy.time import Time

import starpipe as sp
from starpipe._tables import STAR_COLUMNS


def named(result):
    stars = result.stars
    return stars[stars["id"] != ""]


def check_wcs(result, tolerance_px):
    wcs, stars = result.wcs, result.stars
    x, y = stars["x"].value, stars["y"].value
    sky = wcs.pixel_to_world(x, y)
    back = wcs.world_to_pixel(sky)
    assert np.hypot(back[0] - x, back[1] - y).max() < tolerance_px
    unnamed = stars["id"] == ""
    # Where no star is named, the table has the direction of the detection itself.
    assert sky[unnamed].separation(result.sky[unnamed]).arcsec.max(initial=0) < 0.5
    rotated = result.rotation.apply(sky.cartesian.xyz.value.T)
    centre = result.rotation.apply(result.center.cartesian.xyz.value)
    np.testing.assert_allclose(centre, [0, 0, 1], atol=1e-6)
    assert (rotated[:, 2] > 0).all()


def test_world_coordinates_go_there_and_back(result):
    check_wcs(result, 0.02)
    shape = result.to_dict()["height"], result.to_dict()["width"]
    assert result.wcs.array_shape == shape
    assert result.to_header()["CTYPE1"].startswith("RA---TAN")


def test_world_coordinates_of_real_frames_go_there_and_back(pipeline, real_frames):
    for frame in real_frames:
        check_wcs(pipeline.solve(frame), 0.02)


def test_world_coordinates_of_a_distorted_frame_go_there_and_back(pipeline, frame):
    distorted = frame.parents[1] / "regression" / "distorted.tif"
    result = pipeline.solve(distorted)
    assert result.wcs.sip is not None
    check_wcs(result, 0.02)


def test_the_covariance_is_that_of_the_stated_errors(result):
    sigma = result.to_dict()["attitude"]["sigma_arcsec"]
    stated = [sigma["x"], sigma["y"], sigma["roll"]] * u.arcsec
    found = np.sqrt(np.diag(result.attitude_covariance)) * u.rad
    np.testing.assert_allclose(found.to_value("arcsec"), stated.value, rtol=6e-3)
    np.testing.assert_allclose(result.attitude_covariance, result.attitude_covariance.T)


def test_what_was_measured_has_its_units(result):
    report = result.to_dict()
    attitude, optics = report["attitude"], report["optics"]
    assert result.shape == (report["height"], report["width"])
    assert list(result.fov.to_value("deg")) == [optics["fov_x_deg"], optics["fov_y_deg"]]
    half = result.fov[0] / 2
    scale = result.pixel_scale.to(u.rad / u.pix)
    assert scale.value * optics["focal_length_px"] == pytest.approx(1.0)
    assert result.shape[1] / 2 * scale.value == pytest.approx(np.tan(half).value, rel=0.01)
    assert result.roll.to_value("deg") == attitude["up_pa_deg"]
    sigma = attitude["sigma_arcsec"]
    assert list(result.center_err.to_value("arcsec")) == [sigma["y"], sigma["x"]]
    assert result.roll_err.to_value("arcsec") == sigma["roll"]
    assert asdict(result.match) == report["match"] | {"stars_expected": None}
    with pytest.raises(FrozenInstanceError):
        result.match.matched = 0


def test_up_has_the_position_angle_of_roll(result):
    rows, columns = result.shape
    middle = result.wcs.pixel_to_world((columns - 1) / 2, (rows - 1) / 2)
    up = result.wcs.pixel_to_world((columns - 1) / 2, (rows - 1) / 2 - 1.0)
    assert middle.separation(result.center) < 1 * u.arcsec
    difference = (middle.position_angle(up) - result.roll).wrap_at(180 * u.deg)
    assert abs(difference) < 0.1 * u.deg


def test_the_limit_is_detected_and_predicted(frame, result):
    measured = result.to_dict()["photometry"]
    assert result.limit.limit50_vmag == measured["limit50_vmag"]
    assert result.limit.limit50_sigma_mag == measured["limit50_sigma_mag"]
    assert result.limit.faintest_vmag == np.nanmax(result.star_columns["vmag"])
    assert result.limit.predicted_limit_vmag is None
    compared = sp.Pipeline(camera=frame.parent / "camera.toml").solve(frame, exposure=0.2)
    assert compared.limit.predicted_limit_vmag == compared.prediction["limit50_vmag"]
    difference = compared.limit.limit50_vmag - compared.limit.predicted_limit_vmag
    assert compared.limit.limit_difference_mag == pytest.approx(difference, abs=0.011)
    assert compared.limit.limit_difference_sigma_mag > 0.0
    assert compared.match.stars_expected == compared.prediction["stars_expected"] > 10


def test_a_distortion_is_that_of_the_report(pipeline, frame, result):
    distorted = pipeline.solve(frame.parents[1] / "regression" / "distorted.tif")
    found, expected = distorted.distortion, distorted.to_dict()["optics"]["distortion"]
    assert (found.model, found.largest_px) == (expected["model"], expected["largest_px"])
    np.testing.assert_array_equal(found.coefficients_px, expected["coefficients_px"])
    expected = result.to_dict()["optics"]["distortion"]
    assert (result.distortion is None) == (expected is None)


def test_what_is_not_identified_has_no_measurements(pipeline):
    noise = np.random.default_rng(1).normal(500.0, 5.0, (300, 400))
    found = pipeline.solve(noise)
    names = ("fov", "pixel_scale", "roll", "roll_err", "center", "center_err", "distortion")
    for name in (*names, "match", "limit", "quaternion", "rotation", "sky", "wcs"):
        assert getattr(found, name) is None
    assert found.shape == (300, 400)


def test_a_scale_that_was_measured_is_a_hint(pipeline, pixels, result):
    for known in ({"pixel_scale": result.pixel_scale}, {"fov": result.fov[0]}):
        assert pipeline.solve(pixels, scale_error=1, **known)


@pytest.mark.parametrize("format", ["ascii.ecsv", "votable", "parquet.votable", "fits"])
def test_the_table_survives_a_file(result, tmp_path, format):
    path = tmp_path / "stars"
    stars = result.stars
    result.write(path, format=format)
    read = QTable.read(path, format=format)
    for name in ("x", "sigma_y", "flux", "residual_px"):
        np.testing.assert_array_equal(read[name].value, stars[name].value)
    assert read["residual_px"].unit == u.pix
    # astropy reads empty texts as masked.
    assert list(np.ma.filled(read["id"].astype(str), "")) == list(stars["id"])
    sky = SkyCoord(read["ra_deg"], read["dec_deg"])
    assert sky.separation(result.sky).max() < 1e-9 * u.arcsec
    if format != "fits":
        assert read["ra_deg"].info.meta["ucd"] == "pos.eq.ra;meta.main"


def test_a_file_named_as_a_votable_is_one(result, tmp_path):
    result.write(tmp_path / "stars.vot")
    assert len(QTable.read(tmp_path / "stars.vot")) == len(result.stars)


def test_each_column_of_stars_has_a_unit_a_ucd_and_a_description(result):
    assert list(result.star_columns) == list(STAR_COLUMNS)
    for _, unit, ucd, description in STAR_COLUMNS.values():
        u.Unit(unit)
        parse_ucd(ucd, check_controlled_vocabulary=True)
        assert description


def test_astropys_objects_are_hints(pipeline, pixels, result):
    found = pipeline.solve(
        pixels,
        fov=result.to_dict()["optics"]["fov_x_deg"] * 60 * u.arcmin,
        near=result.center.galactic,
        radius=120 * u.arcmin,
        date=Time("2020-03-01T20:00:00"),
        # It is before dawn, and Cygnus is high.
        site=EarthLocation.from_geodetic(132 * u.deg, 50 * u.deg, 300 * u.m),
        exposure=200 * u.ms,
    )
    report = found.to_dict()
    assert found and report["exposure_s"] == 0.2
    assert report["date"]["iso"].startswith("2020-03-01T20:00:00")
    assert abs(report["observation"]["site"]["lon_deg"] - 132.0) < 1e-9
    assert found.center.separation(result.center) < 30 * u.arcsec


def test_an_image_with_a_header_brings_date_exposure_and_mask(pipeline, pixels, result):
    mask = np.zeros(pixels.shape, dtype=bool)
    mask[:50] = True
    header = {"DATE-OBS": "2021-04-05T06:07:08", "EXPTIME": 0.5}
    image = CCDData(pixels, unit=u.adu, mask=mask, meta=header)
    found = pipeline.solve(image)
    report = found.to_dict()
    assert report["exposure_s"] == 0.5 and report["date"]["iso"].startswith("2021-04-05T06:07:08")
    assert found.star_columns["y"].min() > 47
    assert isinstance(found.center, SkyCoord)


def test_what_a_header_has_wrong_is_not_used(pipeline, pixels, result):
    header = {"DATE-OBS": "tonight", "EXPTIME": 0}
    assert pipeline.solve(CCDData(pixels, unit=u.adu, meta=header)) == result


def _at_date(record, date):
    """Return Skymap number and position of a record of SKY2000, moved by astropy."""

    def field(first, last):
        return float(record[first - 1 : last] or 0.0)

    hours = field(119, 120) + field(121, 122) / 60 + field(123, 129) / 3600
    degrees = field(131, 132) + field(133, 134) / 60 + field(135, 140) / 3600
    dec = (-degrees if record[129:130] == b"-" else degrees) * u.deg
    motion = [record[first:last].strip() for first, last in ((149, 157), (157, 165))]
    # Seconds of time a year, which are 15 arcseconds at the equator.
    pm_ra, pm_dec = (float(text.replace(b" ", b"") or 0.0) for text in motion)
    star = SkyCoord(
        hours * u.hourangle,
        dec,
        pm_ra_cosdec=15.0 * pm_ra * np.cos(dec) * u.arcsec / u.yr,
        pm_dec=pm_dec * u.arcsec / u.yr,
        distance=1.0 * u.kpc,
        obstime=Time("J2000"),
    )
    return star.apply_space_motion(new_obstime=date).icrs


def test_named_stars_are_where_astropy_moves_them(sky2000, real_frames):
    pipeline = sp.Pipeline(catalog=sky2000)
    named = {}
    date = Time("2019-07-29T20:47:26")
    for frame in real_frames:
        result = pipeline.solve(frame, date=date)
        for star, place in zip(result.star_columns["id"], result.sky, strict=True):
            if star:
                named[int(star.removeprefix("SKYMAP "))] = place
    assert len(named) > 500
    compared = 0
    with gzip.open(sky2000) as records:
        for record in records:
            number = record[27:35].strip()
            if number.isdigit() and int(number) in named:
                expected = _at_date(record, date)
                assert named[int(number)].separation(expected) < 0.1 * u.arcsec, number
                compared += 1
    assert compared == len(named)
