"""What cannot be solved is refused with a message that says why."""

import io
import re

import numpy as np
import pytest
from astropy import units as u

import starpipe as sp


@pytest.mark.parametrize(
    ("image", "message"),
    [
        (np.zeros((20, 20), dtype=complex), "real numbers, not complex128"),
        (np.full((20, 20), None), "real numbers, not object"),
        (np.full((20, 20), "a"), "real numbers, not <U1"),
        (np.zeros((20, 20, 5)), r"\(rows, columns, 3\) of colors, not .*image\[0\]"),
        (np.zeros(20), r"\(rows, columns\).* not \(20,\)"),
        (np.zeros((0, 20)), "20 x 0|too small|at least"),
        (np.broadcast_to(np.uint8(7), (300_000, 300_000)), "300000 x 300000 pixels"),
        (np.full((20, 20), np.nan), "value"),
        (b"", "empty"),
        (b"no image", "format|image"),
    ],
)
def test_what_is_no_frame_is_refused(pipeline, image, message):
    with pytest.raises(ValueError, match=message):
        pipeline.solve(image)


def test_files_that_cannot_be_read_are_named(pipeline, tmp_path):
    with pytest.raises(OSError, match=r"missing\.tif"):
        pipeline.solve(tmp_path / "missing.tif")
    with pytest.raises(OSError, match=re.escape(tmp_path.name)):
        pipeline.solve(tmp_path)
    with pytest.raises(OSError, match=r"none\.csv"):
        sp.Pipeline(catalog=tmp_path / "none.csv")


@pytest.mark.parametrize(
    ("known", "message"),
    [
        ({"fov": 3 * u.kg}, "fov must be convertible to deg"),
        ({"fov": -1}, "fov must be more than 0"),
        ({"fov": "wide"}, "fov must be a number"),
        ({"fov": np.nan}, "fov must be a finite number"),
        ({"fov": 10, "pixel_scale": 30}, "are alternatives"),
        ({"radius": 0}, "radius must be more than 0"),
        ({"near": (10, 95), "radius": 5}, "declination"),
        ({"near": 10, "radius": 5}, "SkyCoord or"),
        ({"date": "yesterday"}, "yesterday"),
        ({"date": 5}, "date must be ISO 8601"),
        ({"site": (95, 0)}, "latitude"),
        ({"site": (5,)}, "EarthLocation or"),
        ({"site": 5}, "EarthLocation or"),
        ({"threads": "many"}, "threads must be a whole number of at least 1"),
        ({"threads": np.nan}, "threads must be a whole number of at least 1"),
        ({"exposure": 3 * u.m}, "exposure must be convertible to s"),
        ({"threads": 0}, "threads must be a whole number of at least 1"),
        ({"max_stars": 2}, "max_stars must be a whole number of at least 4"),
        ({"sigma": -3}, "sigma must be more than 0, not -3"),
        ({"mask": np.zeros((3, 3), dtype=bool)}, "mask has shape"),
        ({"mask": np.zeros((3, 3))}, "array of bool"),
    ],
)
def test_wrong_arguments_are_refused(pipeline, pixels, known, message):
    with pytest.raises(ValueError, match=message):
        pipeline.solve(pixels, **known)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((None,), "must be a path, bytes, .*, not NoneType"),
        (({"a": 1},), "must be a path, bytes, .*, not dict"),
        ((iter([]),), "must be a path, bytes, .*, not list_iterator"),
        ((io.StringIO("text"),), "binary mode"),
        ((np.zeros((20, 20)), 11.4), r"mask must be an array of bool, not 11\.4; .* fov=20"),
        ((np.zeros((20, 20)), None, 11.4), "positional"),
    ],
)
def test_what_is_of_a_wrong_type_is_told_in_pythons_words(pipeline, arguments, message):
    with pytest.raises(TypeError, match=message):
        pipeline.solve(*arguments)


def test_advice_names_keywords(pipeline, pixels):
    found = pipeline.solve(pixels, fov=100.0)
    assert not found and "--" not in found.reason
    assert found.remedies == ["fov", "pixel_scale"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"x": [1.0, 2.0], "y": [1.0]}, "of one length, not"),
        ({"x": [1.0], "y": [1.0], "error": 0.0}, "error must be above 0"),
        ({"x": [[1.0]], "y": [[1.0]]}, "of one length, not"),
        ({"x": [1.0], "y": [1.0], "mag": [1.0]}, "flux and mag are alternatives"),
    ],
)
def test_wrong_lists_are_refused(pipeline, arguments, message):
    arguments = {"flux": np.ones(len(arguments["x"])), "shape": (100, 100)} | arguments
    with pytest.raises(ValueError, match=message):
        pipeline.identify(**arguments)


def test_positions_that_are_no_stars_are_left_out_and_told(pipeline):
    x = [1.0, np.nan, 5.0, 8.0, 8.1, 20.0]
    flux = [5.0, 5.0, -1.0, 2.0, 3.0, 7.0]
    error = [0.1, 0.1, 0.1, 0.1, 0.1, 0.0]
    found = pipeline.identify(x, [1.0] * 6, flux=flux, error=error, shape=(100, 100))
    assert [note[:5] for note in found.notes] == ["1 row"] * 4
    assert len(found.stars) == 2
    ordered = pipeline.identify(x, [1.0] * 6, shape=(100, 100))
    assert "sorted by brightness" in ordered.notes[-1] and len(ordered.notes) == 3


def test_what_is_odd_about_a_catalogue_goes_to_the_logger(frame, tmp_path, caplog):
    stars = ["id,ra_deg,dec_deg,vmag", *(f"{n},{3.6 * n},{n - 50},3.0" for n in range(100))]
    catalog = tmp_path / "stars.csv"
    catalog.write_text("\n".join([*stars, "100,not a number,2.0,3.0"]) + "\n")
    sp.Pipeline(catalog=catalog, cache_dir=tmp_path)
    (record,) = caplog.records
    assert record.name == "starpipe" and record.levelname == "WARNING"
    assert str(catalog) in record.message
