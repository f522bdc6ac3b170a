"""Pixels are those of ``astropy.io.fits.getdata``, however a frame is passed."""

import io
import warnings

import numpy as np
import pytest
from astropy import units as u
from astropy.io import fits
from astropy.nddata import CCDData, NDData
from PIL import Image

import starpipe as sp

ORDERS = {"BOTTOM-UP": slice(None, None, -1), "TOP-DOWN": slice(None), None: slice(None, None, -1)}
"""ROWORDER, and how the rows of the picture are stored then."""


@pytest.fixture(params=ORDERS, ids=lambda order: order or "silent")
def file(request, pixels, tmp_path):
    """Return a FITS file of the picture `pixels`."""
    unit = fits.PrimaryHDU(np.ascontiguousarray(pixels[ORDERS[request.param]]))
    if request.param:
        unit.header["ROWORDER"] = request.param
    unit.header["EXPTIME"] = 0.2
    unit.header["DATE-OBS"] = "2021-04-05T06:07:08"
    unit.writeto(tmp_path / "night.fits")
    return tmp_path / "night.fits"


def without_times(result):
    apart = ("frame", "timing_ms")
    return {key: value for key, value in result.to_dict().items() if key not in apart}


def rings_are_bright(result, array):
    """Whether the brightest stars, and their names, are where `array` is bright."""
    bright = np.flatnonzero(result.stars["id"][:40] != "")
    stars = result.stars[bright]
    assert len(stars) > 20
    level = np.median(array)
    noise = 1.5 * np.median(np.abs(array - level))
    x, y = result.wcs.world_to_pixel(result.sky[bright])
    for columns, rows in ((stars["x"].value, stars["y"].value), (x, y)):
        peaks = array[np.rint(rows).astype(int), np.rint(columns).astype(int)]
        if np.mean(peaks > level + 4.0 * noise) < 0.9:
            return False
    return True


def test_a_file_its_array_its_units_and_its_ccddata_give_the_same(pipeline, file):
    array = fits.getdata(file)
    of_file = pipeline.solve(file)
    assert of_file and rings_are_bright(of_file, array)
    assert not rings_are_bright(pipeline.solve(array), array[::-1])
    expected = without_times(of_file)
    known = {"exposure": 0.2, "date": "2021-04-05T06:07:08"}
    of_array = without_times(pipeline.solve(array, **known))
    assert of_array.pop("date") == expected["date"] | {"source": "option"}
    assert of_array == {key: value for key, value in expected.items() if key != "date"}
    assert without_times(pipeline.solve(file.read_bytes())) == expected
    assert without_times(pipeline.solve(CCDData.read(file, unit="adu"))) == expected
    for image in (NDData(array), array * u.adu):
        assert pipeline.solve(image, **known) == pipeline.solve(array, **known)
    with open(file, "rb") as opened:
        assert pipeline.solve(opened) == of_file
    with fits.open(file) as units:
        assert pipeline.solve(units) == of_file
        assert pipeline.solve(units[0]) == of_file
        # Data that are read already.
        assert units[0].data.shape == array.shape
        assert pipeline.solve(units) == of_file


def test_attitude_and_header_agree_with_the_pixels(pipeline, file):
    result = pipeline.solve(file)
    report, stars = result.to_dict(), result.stars
    rows, columns = fits.getdata(file).shape
    # The pinhole camera of the conventions; where the lens is distorted it is nearly one.
    x = (stars["x"].value - (columns - 1) / 2) / report["optics"]["focal_length_px"]
    y = (stars["y"].value - (rows - 1) / 2) / report["optics"]["focal_length_px"]
    x = -x if report["optics"]["mirrored"] else x
    directions = np.stack([x, y, np.ones(len(x))])
    sky = result.rotation.inv().apply((directions / np.linalg.norm(directions, axis=0)).T)
    expected = result.sky.cartesian.xyz.value.T
    assert np.degrees(np.abs(sky - expected).max()) < 0.05
    # The header can be added to the file's own, which is then drawn as before.
    with fits.open(file, mode="update") as units:
        before = units[0].header.get("ROWORDER", "BOTTOM-UP")
        units[0].header.update(result.to_header())
        assert units[0].header["ROWORDER"] == before
        assert "ROWORDER" not in pipeline.solve(units[0].data).to_header()
    assert pipeline.solve(file).to_dict()["attitude"] == report["attitude"]


def test_masks_and_masters_are_those_of_the_same_rows(pipeline, file, tmp_path):
    array = fits.getdata(file)
    mask = np.zeros(array.shape, dtype=bool)
    mask[:150] = True
    for image in (file, array, CCDData.read(file, unit="adu")):
        found = pipeline.solve(image, mask)
        assert found.star_columns["y"].min() > 147
    # A dark that takes away the lower stars of the array alone.
    dark = np.zeros(array.shape, dtype=np.float32)
    dark[:150] = array[:150]
    fits.PrimaryHDU(dark, fits.getheader(file)).writeto(tmp_path / "dark.fits")
    opposite = fits.PrimaryHDU(dark[::-1].copy())
    of_frame = fits.getheader(file).get("ROWORDER", "BOTTOM-UP")
    opposite.header["ROWORDER"] = "TOP-DOWN" if of_frame == "BOTTOM-UP" else "BOTTOM-UP"
    opposite.writeto(tmp_path / "opposite.fits")
    pairs = [
        (file, tmp_path / "dark.fits"),
        (file, tmp_path / "opposite.fits"),
        (file, dark),
        (array, dark),
        (array, tmp_path / "dark.fits"),
    ]
    for image, master in pairs:
        found = pipeline.solve(image, dark=master)
        assert found.star_columns["y"].min() > 147


def test_detections_and_dark_frames_have_the_same_rows(pipeline, file):
    array = fits.getdata(file)
    np.testing.assert_array_equal(sp.detect(file).y, sp.detect(array).y)
    masters = sp.darks([file, file]).masters
    np.testing.assert_array_equal(next(iter(masters.values())), array)


def test_of_several_units_that_is_taken_which_is_taken_of_the_file(pipeline, pixels, tmp_path):
    image = fits.ImageHDU(pixels[::-1].copy())
    units = fits.HDUList([fits.PrimaryHDU(), image, fits.ImageHDU(np.zeros((30, 40)))])
    units.writeto(tmp_path / "several.fits")
    of_file = pipeline.solve(tmp_path / "several.fits")
    assert of_file
    assert without_times(pipeline.solve(units)) == without_times(of_file)
    assert without_times(pipeline.solve(units[1])) == without_times(of_file)
    fits.CompImageHDU(pixels[::-1].copy()).writeto(tmp_path / "packed.fits")
    of_file = pipeline.solve(tmp_path / "packed.fits")
    with fits.open(tmp_path / "packed.fits") as packed:
        for passed in (packed, packed[1]):
            assert without_times(pipeline.solve(passed)) == without_times(of_file)
    with pytest.raises(ValueError, match="empty"):
        pipeline.solve(fits.HDUList())
    with pytest.raises(ValueError, match="image"):
        pipeline.solve(fits.HDUList([fits.PrimaryHDU()]))


def test_colors_are_solved_as_of_a_file(pipeline, pixels, tmp_path):
    grey = (pixels // 257).astype(np.uint8)
    colors = np.stack([grey, grey, grey], axis=-1)
    Image.fromarray(colors).save(tmp_path / "color.png")
    of_file = pipeline.solve(tmp_path / "color.png")
    assert of_file
    opaque = np.concatenate([colors, np.full_like(colors[..., :1], 255)], axis=-1)
    images = [colors, opaque, np.asfortranarray(colors), Image.fromarray(colors)]
    for image in [*images, Image.fromarray(opaque), Image.open(tmp_path / "color.png")]:
        assert without_times(pipeline.solve(image)) == without_times(of_file)
    for image in (colors.astype(np.float32), colors / 255.0, colors.astype(np.uint16) * 257):
        assert pipeline.solve(image).center.separation(of_file.center) < 10 * u.arcsec
    of_grey = pipeline.solve(grey)
    palette = Image.fromarray(grey).convert("P")
    for image in (Image.fromarray(grey), grey[..., None], grey[None]):
        assert pipeline.solve(image) == of_grey
    assert pipeline.solve(palette)


def test_planes_of_colors_are_as_in_their_file(pipeline, pixels, tmp_path):
    planes = np.stack([pixels[::-1] // 2, pixels[::-1], pixels[::-1] // 3])
    fits.PrimaryHDU(planes).writeto(tmp_path / "planes.fits")
    of_file = pipeline.solve(tmp_path / "planes.fits")
    array = fits.getdata(tmp_path / "planes.fits")
    assert of_file and array.shape == (3, *pixels.shape)
    for image in (array, array[None], np.moveaxis(array, 0, -1), np.moveaxis(array, 0, 1)):
        assert without_times(pipeline.solve(image)) == without_times(of_file)
    masked = np.ma.MaskedArray(array, np.zeros(array.shape, dtype=bool))
    masked[1, :150] = np.ma.masked
    assert pipeline.solve(masked).star_columns["y"].min() > 147


def test_files_of_many_kinds_are_read(pipeline, frame, tmp_path):
    expected = pipeline.solve(frame)
    content = frame.read_bytes()
    for image in (io.BytesIO(content), bytearray(content), memoryview(content)):
        assert without_times(pipeline.solve(image)) == without_times(expected)
    with open(frame, "rb") as opened:
        assert pipeline.solve(opened).to_dict()["frame"] == str(frame)


def test_rings_are_drawn_on_the_stars(pipeline, file):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    array = fits.getdata(file)
    axes = pipeline.solve(file).plot(rings="all")
    rings = np.concatenate([group.get_offsets() for group in axes.collections])
    inside = [(x, y) for x, y in np.rint(rings).astype(int) if 0 < x < array.shape[1] - 1]
    # Each pixel is drawn as four.
    drawn = axes.images[0].get_array()[::2, ::2, 0].astype(float)
    assert drawn.shape == array.shape
    ringed = np.mean([drawn[y, x] for x, y in inside])
    assert ringed > np.mean(drawn) + 3.0 * np.std(np.asarray(drawn)) / np.sqrt(len(inside))
    assert ringed > 1.2 * np.mean([drawn[-1 - y, x] for x, y in inside])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        matplotlib.pyplot.close("all")
