"""Results as pictures and tables."""

import pickle
import re
import subprocess
import sys
from xml.etree import ElementTree

import matplotlib
import numpy as np
import pytest
from astropy.io import fits
from astropy.wcs import WCS
from PIL import Image

matplotlib.use("agg")


@pytest.fixture(autouse=True)
def close_figures():
    yield
    matplotlib.pyplot.close("all")


@pytest.fixture
def orange(pixels, tmp_path):
    """Return a picture of an orange sky."""
    grey = (pixels.astype(np.float64) / pixels.max()) ** 0.5
    colors = np.round(255 * grey[..., None] * [1.0, 0.7, 0.4]).astype(np.uint8)
    Image.fromarray(colors).save(tmp_path / "orange.png")
    return tmp_path / "orange.png"


def rings_of(axes):
    return sum(len(group.get_offsets()) for group in axes.collections)


def test_a_plot_has_the_photograph_its_stars_and_their_names(result, pixels):
    axes = result.plot(names=5)
    named = result.stars[result.stars["name"] != ""][:5]
    texts = [text.get_text() for text in axes.texts]
    assert texts[:5] == list(named["name"])
    constellations = [
        shown["label"] for shown in result.annotations if shown["kind"] == "constellation"
    ]
    assert constellations and set(constellations) <= set(texts[5:])
    (rings,) = axes.collections
    np.testing.assert_allclose(rings.get_offsets()[:, 0], named["x"].value)
    low, high = axes.get_ylim()
    assert low > high and axes.get_xlim()[1] == pixels.shape[1] - 0.5
    (photograph,) = axes.images
    assert photograph.get_extent() == [-0.5, pixels.shape[1] - 0.5, -0.5, pixels.shape[0] - 0.5]
    axes.figure.canvas.draw()


def test_stars_without_a_name_have_their_number(result):
    stars = result.star_columns
    all_names = np.sum(stars["name"] != "")
    axes = result.plot(names=10_000)
    called = np.sum((stars["id"] != "") | (stars["name"] != ""))
    texts = [text.get_text() for text in axes.texts][:called]
    assert len(texts) == called > all_names
    others = np.flatnonzero((stars["id"] != "") & (stars["name"] == ""))
    first = others[0]
    hd, hip = stars["hd"][first], stars["hip"][first]
    expected = f"HD {hd:.0f}" if hd > 0 else f"HIP {hip:.0f}" if hip > 0 else stars["id"][first]
    assert texts[all_names] == expected
    axes.figure.canvas.draw()


def test_a_name_of_a_file_is_text(result, pixels):
    names = "a\n\t\x1b[31m\u202e$\\frac$<b>.tif"
    odd = pickle.loads(pickle.dumps(result))
    odd._report["frame"] = names
    for shown in (repr(odd), odd._repr_html_(), odd.plot(image=pixels).get_title()):
        assert not set(names) & set("\n\t\x1b\u202e") & set(shown), shown
        assert "\\u202e$\\frac$" in shown
    assert "<b>" not in odd._repr_html_()
    matplotlib.pyplot.gcf().canvas.draw()


def test_a_plain_table_has_numbers(result):
    plain = result.plain_stars
    assert plain.colnames == result.stars.colnames and str(plain["x"].unit) == "pix"
    row, with_units = plain[0], result.stars[0]
    assert float(row["x"]) == with_units["x"].value and plain.meta == result.stars.meta


def test_a_plot_marks_what_is_wanted(result, pipeline):
    assert rings_of(result.plot(rings="all")) == len(result.stars)
    assert rings_of(result.plot(rings="none")) == 0
    axes = matplotlib.pyplot.subplots()[1]
    assert result.plot(axes, names=0) is axes and not axes.texts and not axes.collections
    with pytest.raises(ValueError, match="rings must be 'named', 'all' or 'none', not 'some'"):
        result.plot(rings="some")
    # What is not identified has no names: all is marked.
    noise = np.random.default_rng(1).normal(500.0, 5.0, (300, 400))
    noise[100:103, 200:203] += 500.0
    unknown = pipeline.solve(noise)
    assert not unknown and rings_of(unknown.plot()) == len(unknown.stars) > 0


def test_the_photograph_is_that_of_the_programs_overlay(program, pipeline, orange, tmp_path):
    options = ["--out", tmp_path / "out", "--rings", "none"]
    subprocess.run([program, "process", orange, *options], check=True, capture_output=True)
    with Image.open(tmp_path / "out" / "orange.png") as image:
        overlay = np.array(image)
    result = pipeline.solve(orange)
    of_file = result.plot().images[0].get_array()
    differs = (overlay[: len(of_file), : of_file.shape[1]] != of_file).any(axis=-1)
    # Where the overlay has names.
    assert 0 < differs.mean() < 0.15
    # Below it is the legend.
    assert 0 < len(overlay) - len(of_file) < 0.3 * len(overlay)


def assert_orange(drawn):
    red, green, blue = np.moveaxis(drawn.astype(float), -1, 0)
    assert (red >= green).all() and (green >= blue).all()
    assert (red > 1.5 * blue).mean() > 0.5


def test_a_color_picture_is_drawn_in_its_colors(pipeline, orange):
    with Image.open(orange) as image:
        array = np.array(image)
    of_file = pipeline.solve(orange).plot().images[0].get_array()
    assert_orange(of_file)
    # A photograph of 8 bits is drawn as it is.
    times = len(of_file) // len(array)
    assert np.array_equal(of_file[::times, ::times], array)
    for image in (array, orange.read_bytes()):
        drawn = pipeline.solve(image).plot().images[0].get_array()
        assert np.array_equal(drawn, of_file)
    # More bits are linear, and are stretched.
    wide = array.astype(np.uint16) * 257
    stretched = pipeline.solve(wide).plot().images[0].get_array()
    assert_orange(stretched)
    assert np.median(stretched) > 1.2 * np.median(of_file)
    planes = pipeline.solve(np.moveaxis(wide, -1, 0)).plot().images[0].get_array()
    assert np.array_equal(planes, stretched)
    floats = array.astype(np.float32) / 255.0
    assert_orange(pipeline.solve(floats).plot().images[0].get_array())


def test_a_large_frame_is_drawn_smaller_in_the_same_place(pipeline):
    noise = np.random.default_rng(1).normal(500.0, 5.0, (90, 2600))
    noise[40, 2500] = 5000.0
    axes = pipeline.solve(noise).plot()
    (photograph,) = axes.images
    assert photograph.get_array().shape == (45, 1300, 3)
    assert photograph.get_extent() == [-0.5, 2599.5, -0.5, 89.5]
    levels = photograph.get_array()[..., 0]
    assert levels[20, 1250] == 255 and levels.mean() < 120


def test_the_rows_of_a_file_run_as_it_says(pipeline, pixels, tmp_path):
    fits.PrimaryHDU(pixels[::-1].copy()).writeto(tmp_path / "night.fits")
    low, high = pipeline.solve(tmp_path / "night.fits").plot().get_ylim()
    assert (low, high) == (-0.5, pixels.shape[0] - 0.5)


def test_a_plot_of_what_has_no_photograph(pipeline, result, pixels, frame):
    stars = result.star_columns
    listed = pipeline.identify(stars["x"], stars["y"], flux=stars["flux"], shape=pixels.shape)
    (restored,) = (pickle.loads(pickle.dumps(one)) for one in [result])
    (of_array,) = pipeline.solve_many([pixels])
    for without in (listed, restored, of_array):
        axes = without.plot()
        assert not axes.images and axes.collections
        assert without.plot(image=frame).images
        with pytest.raises(ValueError, match="image is 512 x 383 pixels, the frame 512 x 384"):
            without.plot(image=pixels[1:])
    (of_file,) = pipeline.solve_many([frame])
    assert of_file.plot().images and pickle.loads(pickle.dumps(of_file)).plot().images
    (missing,) = pipeline.solve_many(["missing.tif"])
    with pytest.raises(OSError, match=r"missing\.tif"):
        missing.plot()


def test_a_plot_without_matplotlib_says_what_to_install(result, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(ImportError, match="pip install matplotlib"):
        result.plot()


def run(program, frame, out, *options):
    """Return the file of each name that the program writes for a frame."""
    command = [program, "process", frame, "--out", out, *options]
    subprocess.run(command, check=True, capture_output=True)
    return {path.name.partition(".")[2]: path for path in out.iterdir()}


def test_files_are_those_of_the_program(program, pipeline, frame, tmp_path):
    options = ["--html", "--regions", "--write-fits"]
    expected = run(program, frame, tmp_path / "out", *options)
    result = pipeline.solve(frame)
    result.write_regions(tmp_path / "a.reg")
    assert (tmp_path / "a.reg").read_text() == expected["reg"].read_text()
    result.write_fits(tmp_path / "a.fits")
    assert (tmp_path / "a.fits").read_bytes() == expected["solved.fits"].read_bytes()
    result.write_page(tmp_path / "a.html")
    pages = [path.read_text() for path in (tmp_path / "a.html", expected["html"])]
    pictures = [re.search(r"data:image/jpeg;base64,[^\"]+", page)[0] for page in pages]
    assert pictures[0] == pictures[1] and len(pictures[0]) > 10_000
    script = re.compile(r"<script[^>]*json[^>]*>(.*?)</script>", re.DOTALL)
    data = [script.search(page)[1] for page in pages]
    assert data[0] == data[1] and "Deneb" in data[0]


@pytest.mark.parametrize("order", ["BOTTOM-UP", "TOP-DOWN"])
def test_a_copy_has_the_pixels_and_the_coordinates_of_the_array(pipeline, pixels, tmp_path, order):
    header = fits.Header([("ROWORDER", order)])
    fits.PrimaryHDU(pixels, header).writeto(tmp_path / "night.fits")
    dark = np.full(pixels.shape, 7, dtype=np.uint16)
    dark[3, 4] = 20
    result = pipeline.solve(tmp_path / "night.fits", dark=dark)
    result.write_fits(tmp_path / "copy.fits")
    data, header = fits.getdata(tmp_path / "copy.fits", header=True)
    expected = pixels.astype(int)
    expected[3, 4] -= 13
    np.testing.assert_array_equal(data, expected)
    assert header["ROWORDER"] == order
    x, y = WCS(header).world_to_pixel(result.center)
    assert (x, y) == pytest.approx(((pixels.shape[1] - 1) / 2, (pixels.shape[0] - 1) / 2), abs=0.01)
    again = pipeline.solve(tmp_path / "copy.fits")
    np.testing.assert_array_equal(again.star_columns["y"], result.star_columns["y"])


def test_files_are_not_replaced_unless_it_is_wanted(pipeline, result, pixels, tmp_path):
    for write in (result.write_page, result.write_regions, result.write_fits):
        path = tmp_path / write.__name__
        write(path)
        content = path.read_bytes()
        path.write_text("mine")
        with pytest.raises(FileExistsError, match="overwrite=True"):
            write(path)
        assert path.read_text() == "mine"
        write(path, overwrite=True)
        assert path.read_bytes() == content
        with pytest.raises(OSError):
            write(tmp_path / "no directory" / "file")
        with pytest.raises(ValueError, match="unpickled result"):
            getattr(pickle.loads(pickle.dumps(result)), write.__name__)(
                tmp_path / "other", **{} if write == result.write_regions else {"image": pixels}
            )
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "write_fits",
        "write_page",
        "write_regions",
    ]


def test_what_has_no_frame_or_no_coordinates_has_no_copy(pipeline, result, pixels, tmp_path):
    stars = result.star_columns
    listed = pipeline.identify(stars["x"], stars["y"], flux=stars["flux"], shape=pixels.shape)
    with pytest.raises(ValueError, match="image="):
        listed.write_fits(tmp_path / "a.fits")
    listed.write_page(tmp_path / "without.html")
    listed.write_page(tmp_path / "with.html", image=pixels)
    pages = [(tmp_path / f"{name}.html").read_text() for name in ("without", "with")]
    assert ["data:image/jpeg" in page for page in pages] == [False, True]
    for write in (listed.write_page, listed.write_fits):
        with pytest.raises(ValueError, match="the image is 512 x 383 pixels, the frame 512 x 384"):
            write(tmp_path / "b", image=pixels[1:])
    noise = np.random.default_rng(1).normal(500.0, 5.0, (300, 400))
    with pytest.raises(ValueError, match="not identified has no coordinates"):
        pipeline.solve(noise).write_fits(tmp_path / "a.fits")
    assert not (tmp_path / "a.fits").exists() and not (tmp_path / "b").exists()


def test_arrow_has_the_same_columns(result):
    table = result.to_arrow()
    columns = result.star_columns
    assert table.column_names == list(columns)
    np.testing.assert_array_equal(table["flux"].to_numpy(), columns["flux"])
    assert table["id"].to_pylist() == list(columns["id"])


def test_a_card_for_notebooks(result):
    card = result._repr_html_()
    picture, table = ElementTree.fromstring(card)
    circles = [mark for mark in picture if mark.tag.endswith("circle")]
    assert len(circles) == len(result.stars) and "Deneb" in card
    match = result.to_dict()["match"]
    assert f"{match['matched']} of {match['detected']} named" in [row[1].text for row in table]
    assert "\n" not in repr(result)


def test_a_card_of_centroids(pipeline, result):
    stars = result.star_columns
    found = pipeline.identify(stars["x"], stars["y"], flux=stars["flux"], shape=(384, 512))
    assert found._repr_html_().count("<circle") == len(stars["x"])
