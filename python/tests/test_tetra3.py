"""The interface of tetra3 and cedar-solve: its conventions, with truth that is made here."""

import csv
import inspect
import threading
import time
import warnings

import numpy as np
import pytest
from astropy.wcs import WCS
from conftest import REPOSITORY, SHARED
from PIL import Image

import starpipe as sp
from starpipe import tetra3
from starpipe.tetra3 import cedar_detect_client
from starpipe.tetra3._sky import SkyMap

WITHOUT_A_MATCH = {
    *("RA", "Dec", "Roll", "FOV", "distortion", "RMSE", "P90E", "MAXE", "Matches", "Prob"),
    *("epoch_equinox", "epoch_proper_motion", "cache_hit_fraction"),
}
SIZE = (900, 1200)
FOV = 20.0
NOISE_PX = 0.02
CENTER = (83.8, 4.0)


def vectors(ra_dec):
    ra, dec = np.radians(ra_dec).T
    return np.stack([np.cos(ra) * np.cos(dec), np.sin(ra) * np.cos(dec), np.sin(dec)], axis=-1)


def rotation(ra, dec, roll):
    """Return boresight, left and top of a picture whose north is `roll` counterclockwise of up."""
    ra, dec, roll = np.radians([ra, dec, roll])
    boresight = [np.cos(ra) * np.cos(dec), np.sin(ra) * np.cos(dec), np.sin(dec)]
    # East is left of north on the sky.
    east = np.array([-np.sin(ra), np.cos(ra), 0.0])
    north = np.cross(boresight, east)
    # What is up is clockwise of north, so north is to the left of it.
    up = np.cos(roll) * north - np.sin(roll) * east
    left = np.sin(roll) * north + np.cos(roll) * east
    return np.array([boresight, left, up])


def project(directions, matrix, k=0.0, fov=FOV, size=SIZE):
    """Return the pixels (y, x) of directions in a camera as tetra3 defines it."""
    height, width = size
    place = directions @ matrix.T
    left, up = place[:, 1] / place[:, 0], place[:, 2] / place[:, 0]
    ideal = np.hypot(left, up) / np.tan(np.radians(fov) / 2.0)
    radii = np.linspace(0.0, 1.6, 40001)
    seen = np.interp(ideal, radii * (1.0 - k * radii**2) / (1.0 - k), radii)
    scale = seen / ideal * width / 2.0 / np.tan(np.radians(fov) / 2.0)
    return np.stack([height / 2.0 - scale * up, width / 2.0 - scale * left], axis=-1)


@pytest.fixture(scope="module")
def catalog():
    """Return right ascension, declination and magnitude of the bright stars around `CENTER`."""
    camera = {"focal_length_mm": 8.0, "spot_sigma_px": 1.0}
    rows = sp.simulate("nanosat-tracker", ra=CENTER[0], dec=CENTER[1], **camera).columns
    stars = np.stack([rows["ra_deg"], rows["dec_deg"], rows["vmag"]], axis=-1)
    return stars[np.argsort(stars[:, 2])]


@pytest.fixture(scope="module")
def solver():
    return tetra3.Tetra3()


@pytest.fixture
def sky(catalog):
    """Return a function that photographs the stars: rows of (y, x), brightest first."""

    def seen(matrix, k=0.0, count=80):
        pixels = project(vectors(catalog[:, :2]), matrix, k)
        inside = ((pixels > 1.0) & (pixels < np.array(SIZE) - 1.0)).all(axis=1)
        pixels = pixels[inside][:count]
        return pixels + np.random.default_rng(4).normal(0.0, NOISE_PX, pixels.shape)

    return seen


def angle(one, other):
    return abs((one - other + 180.0) % 360.0 - 180.0)


@pytest.mark.parametrize("roll", [0.0, 33.0, 200.0])
def test_angles_and_field_have_their_conventions(solver, sky, roll):
    matrix = rotation(*CENTER, roll)
    centroids = sky(matrix)
    found = solver.solve_from_centroids(centroids, SIZE, return_rotation_matrix=True)
    assert found["status"] == tetra3.MATCH_FOUND
    assert found["RA"] == pytest.approx(CENTER[0], abs=2e-4)
    assert found["Dec"] == pytest.approx(CENTER[1], abs=2e-4)
    assert angle(found["Roll"], roll) < 2e-3
    assert 0.0 <= found["Roll"] < 360.0
    assert found["FOV"] == pytest.approx(FOV, abs=1e-3)
    assert found["distortion"] == pytest.approx(0.0, abs=1e-4)
    np.testing.assert_allclose(found["rotation_matrix"], matrix, atol=3e-5)
    assert 0.0 < found["RMSE"] <= found["MAXE"] < 5.0
    assert 0.0 < found["P90E"] <= found["MAXE"]
    assert 40 < found["Matches"] <= len(centroids)
    assert 0.0 <= found["Prob"] < 1e-8
    assert (found["epoch_equinox"], found["epoch_proper_motion"]) == (2000, 2000.0)
    assert found["T_solve"] > 0.0
    assert set(found) == WITHOUT_A_MATCH | {"T_solve", "status", "rotation_matrix"}


@pytest.mark.parametrize("k", [-0.08, 0.03])
def test_distortion_and_field_are_those_at_half_the_width(solver, sky, k):
    matrix = rotation(*CENTER, 70.0)
    centroids = sky(matrix, k)
    found = solver.solve_from_centroids(centroids, SIZE)
    assert found["distortion"] == pytest.approx(k, abs=2e-3)
    assert found["FOV"] == pytest.approx(FOV, abs=5e-3)
    assert found["RA"] == pytest.approx(CENTER[0], abs=1e-3)
    assert solver.solve_from_centroids(centroids, SIZE, distortion=None)["distortion"] is None
    # The scale in the middle differs by more than that from the one of the whole field.
    narrow = solver.solve_from_centroids(centroids, SIZE, fov_estimate=FOV, fov_max_error=0.1)
    assert narrow["FOV"] == pytest.approx(FOV, abs=5e-3)


def test_targets_are_where_they_were_put(solver, sky):
    matrix, k = rotation(*CENTER, 120.0), -0.05
    places = np.array([[83.0, 1.0], [85.5, 7.0], [263.0, -4.0], [83.0, 40.0]])
    pixels = project(vectors(places), matrix, k)
    centroids = sky(matrix, k)
    found = solver.solve_from_centroids(
        centroids, SIZE, target_pixel=pixels[:2], target_sky_coord=places
    )
    np.testing.assert_allclose(found["RA_target"], places[:2, 0], atol=1e-3)
    np.testing.assert_allclose(found["Dec_target"], places[:2, 1], atol=1e-3)
    np.testing.assert_allclose(found["y_target"][:2], pixels[:2, 0], atol=0.1)
    np.testing.assert_allclose(found["x_target"][:2], pixels[:2, 1], atol=0.1)
    # What is behind the camera or outside the frame has no pixel.
    assert found["x_target"][2:] == found["y_target"][2:] == [None, None]
    one = solver.solve_from_centroids(
        centroids, SIZE, target_pixel=pixels[0], target_sky_coord=places[0]
    )
    assert one["RA_target"] == found["RA_target"][0]
    assert one["y_target"] == pytest.approx(found["y_target"][0])


def test_a_mirrored_picture_is_solved_and_its_matrix_says_so(solver, sky):
    matrix = rotation(*CENTER, 30.0)
    centroids = sky(matrix)
    centroids[:, 1] = SIZE[1] - centroids[:, 1]
    found = solver.solve_from_centroids(
        centroids, SIZE, return_rotation_matrix=True, target_pixel=centroids[0], return_matches=True
    )
    assert found["RA"] == pytest.approx(CENTER[0], abs=2e-4)
    assert np.linalg.det(found["rotation_matrix"]) == pytest.approx(-1.0)
    # North is now clockwise of up.
    assert angle(found["Roll"], -30.0) < 2e-3
    star = found["matched_stars"][found["matched_centroids"].index(centroids[0].tolist())]
    assert found["RA_target"] == pytest.approx(star[0], abs=1e-3)


def test_matches_are_the_given_centroids_with_their_stars(solver, sky, catalog):
    matrix = rotation(*CENTER, 10.0)
    centroids = sky(matrix)
    found = solver.solve_from_centroids(centroids, SIZE, return_matches=True, return_catalog=True)
    given, matched = centroids.tolist(), found["matched_centroids"]
    numbers = [given.index(centroid) for centroid in matched]
    assert numbers == sorted(numbers)
    assert len(matched) == len(found["matched_stars"]) == found["Matches"]
    stars = np.array(found["matched_stars"])
    np.testing.assert_allclose(project(vectors(stars[:, :2]), matrix), matched, atol=0.2)
    assert np.allclose(found["pattern_centroids"], matched[:4])
    # Betelgeuse, by its number in the catalog of Hipparcos.
    betelgeuse = stars[found["matched_catID"].index(27989)]
    np.testing.assert_allclose(betelgeuse[:2], [88.793, 7.407], atol=1e-3)
    assert 0.0 < betelgeuse[2] < 1.0
    of_catalog = np.array(found["catalog_stars"])
    assert len(of_catalog) >= len(stars)
    np.testing.assert_allclose(
        project(vectors(of_catalog[:, :2]), matrix), of_catalog[:, 3:], atol=0.5
    )


def test_a_centroid_that_is_not_a_number_is_passed_over(solver, sky):
    centroids = sky(rotation(*CENTER, 10.0))
    given = np.insert(centroids, 7, np.nan, axis=0)
    matched = solver.solve_from_centroids(given, SIZE, return_matches=True)["matched_centroids"]
    assert len(matched) > 40
    assert {tuple(place) for place in matched} <= {tuple(place) for place in centroids.tolist()}


def test_transformations_invert_each_other_and_are_those_of_the_camera(solver, sky):
    matrix, k = rotation(*CENTER, 250.0), 0.04
    found = solver.solve_from_centroids(sky(matrix, k), SIZE, return_rotation_matrix=True)
    camera = (SIZE[1], SIZE[0], found["FOV"], found["rotation_matrix"], found["distortion"])
    places = [(83.8, 4.0), (80.0, 6.0), (83.8, 60.0), (263.8, -4.0)]
    pixels = tetra3.transform_to_image_coords(places, *camera)
    assert len(pixels) == 2
    np.testing.assert_allclose(pixels, project(vectors(places[:2]), matrix, k), atol=0.1)
    back = tetra3.transform_to_celestial_coords(pixels, *camera)
    np.testing.assert_allclose(back, places[:2], atol=1e-9)


@pytest.mark.parametrize("k", [-0.2, 0.01, 0.1])
def test_places_far_outside_the_frame_have_no_pixels(k):
    # Of the whole sky: with pincushion distortion, most directions have no place in the picture.
    directions = np.random.default_rng(5).normal(size=(20_000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    ra, dec = np.degrees([np.arctan2(*directions.T[1::-1]), np.arcsin(directions[:, 2])])
    matrix = rotation(*CENTER, 40.0)
    camera = (SIZE[1], SIZE[0], FOV, matrix, k)
    pixels = tetra3.transform_to_image_coords(np.stack([ra, dec], axis=-1), *camera)
    inside = project(directions[directions @ matrix[0] > 0.9], matrix, k)
    inside = ((inside > 0.0) & (inside < SIZE)).all(axis=1)
    assert len(pixels) == inside.sum() > 50
    back = vectors(tetra3.transform_to_celestial_coords(pixels, *camera))
    apart = np.linalg.norm(back[:, None] - directions, axis=-1).min(axis=1)
    assert apart.max() < 1e-8


def test_a_wrong_estimate_is_dropped_but_a_stated_error_is_kept(solver, sky):
    centroids = sky(rotation(*CENTER, 0.0))
    dropped = solver.solve_from_centroids(centroids, SIZE, fov_estimate=9.0)
    assert dropped["FOV"] == pytest.approx(FOV, abs=1e-3)
    kept = solver.solve_from_centroids(centroids, SIZE, 19.5, 1.0)
    assert kept["status"] == tetra3.MATCH_FOUND
    for estimate, error in ((9.0, 2.0), (19.5, 0.4), (100.0, 75.0)):
        refused = solver.solve_from_centroids(
            centroids, SIZE, fov_estimate=estimate, fov_max_error=error
        )
        assert refused["status"] == tetra3.NO_MATCH
        assert {key for key, value in refused.items() if value is None} == WITHOUT_A_MATCH
    unsure = solver.solve_from_centroids(centroids, SIZE, match_threshold=0.0)
    assert unsure["status"] == tetra3.NO_MATCH


def test_each_failure_has_its_status(solver, sky):
    centroids = sky(rotation(*CENTER, 0.0))
    chance = np.random.default_rng(1).uniform(0.0, 1.0, (30, 2)) * SIZE
    for given, known, status in (
        (centroids[:3], {}, tetra3.TOO_FEW),
        ([], {}, tetra3.TOO_FEW),
        (chance, {}, tetra3.NO_MATCH),
        (chance, {"solve_timeout": 0.5}, tetra3.TIMEOUT),
        (centroids, {"solve_timeout": 0}, tetra3.TIMEOUT),
    ):
        found = solver.solve_from_centroids(given, SIZE, return_matches=True, **known)
        assert found["status"] == status
        assert {key for key, value in found.items() if value is None} == WITHOUT_A_MATCH
        assert set(found) == WITHOUT_A_MATCH | {"T_solve", "status"}


def test_a_cancelled_search_ends_and_the_next_one_does_not(sky):
    solver = tetra3.Tetra3()
    centroids = sky(rotation(*CENTER, 0.0))
    solver.cancel_solve()
    assert solver.solve_from_centroids(centroids, SIZE)["status"] == tetra3.CANCELLED
    assert solver.solve_from_centroids(centroids, SIZE)["status"] == tetra3.MATCH_FOUND
    chance = np.random.default_rng(2).uniform(0.0, 1.0, (300, 2)) * SIZE
    started = time.perf_counter()
    assert solver.solve_from_centroids(chance, SIZE)["status"] == tetra3.NO_MATCH
    whole = time.perf_counter() - started
    timer = threading.Timer(0.1 * whole, solver.cancel_solve)
    timer.start()
    started = time.perf_counter()
    assert solver.solve_from_centroids(chance, SIZE)["status"] == tetra3.CANCELLED
    assert time.perf_counter() - started < 0.7 * whole


def test_arguments_are_known_by_name_and_others_are_errors(solver, sky, pixels):
    names = set(inspect.signature(solver.solve_from_image).parameters)
    assert names >= {"fov_estimate", "solve_timeout", "pattern_checking_stars", "min_sum", "crop"}
    centroids = sky(rotation(*CENTER, 0.0))
    same = solver.solve_from_centroids(
        centroids, SIZE, pattern_checking_stars=8, match_max_error=0.002, match_radius=0.02
    )
    assert same["RA"] == solver.solve_from_centroids(centroids, SIZE)["RA"]
    for name in ("fov_guess", "min_sum"):
        with pytest.raises(TypeError, match=name):
            solver.solve_from_centroids(centroids, SIZE, **{name: 1})
    with pytest.raises(TypeError, match="min_summ"):
        solver.solve_from_image(pixels, min_summ=1)
    with pytest.raises(TypeError, match="sgima"):
        tetra3.get_centroids_from_image(pixels, sgima=1)
    with pytest.raises(ValueError, match="fov_estimate"):
        solver.solve_from_centroids(centroids, SIZE, fov_estimate=-1)
    with pytest.raises(ValueError, match="outside"):
        solver.solve_from_centroids(centroids, (300, 400))


@pytest.fixture(scope="module")
def shot():
    return sp.simulate("nanosat-tracker", ra=CENTER[0], dec=CENTER[1], roll=25.0, exposure=0.2)


def test_an_image_gives_what_was_simulated(solver, shot):
    for image in (shot.image, Image.fromarray(shot.image)):
        found = solver.solve_from_image(image, return_matches=True)
        assert found["RA"] == pytest.approx(CENTER[0], abs=5e-3)
        assert found["Dec"] == pytest.approx(CENTER[1], abs=5e-3)
        # The position angle of up is 25°: north is clockwise of it.
        assert angle(found["Roll"], -25.0) < 0.1
        height, width = shot.image.shape
        borders = shot.wcs.pixel_to_world([-0.5, width - 0.5], [(height - 1) / 2.0] * 2)
        assert found["FOV"] == pytest.approx(borders[0].separation(borders[1]).deg, rel=2e-3)
        assert found["T_extract"] > 0.0 and found["T_solve"] > 0.0


def test_stars_that_were_not_measured_are_where_they_should_be(solver):
    # The Trapezium in Orion, four stars that are one extended spot here.
    shot = sp.simulate("nanosat-tracker", ra=83.8, dec=-1.0, roll=25.0, exposure=2.0)
    found = solver.solve_from_image(
        shot.image, return_catalog=True, return_matches=True, return_visual=True
    )
    matched = {tuple(star) for star in found["matched_stars"]}
    missed = [star for star in found["catalog_stars"] if star[:3] not in matched]
    assert len(found["catalog_stars"]) == found["Matches"] + len(missed)
    (star,) = [star for star in missed if abs(star[2] - 5.13) < 0.01]
    np.testing.assert_allclose(star[:2], [83.8186, -5.3897], atol=3e-3)
    x, y = shot.wcs.world_to_pixel_values(*star[:2])
    np.testing.assert_allclose(star[3:], [y + 0.5, x + 0.5], atol=0.5)
    radius = 0.01 * shot.image.shape[1]
    colors = np.array(found["visual"])[round(star[3]), round(star[4] - radius) - 2 :][:5]
    assert (colors == (255, 0, 0)).all(axis=-1).any()


def test_centroids_are_at_the_true_places_of_the_stars(shot):
    truth = shot.columns
    brightest = np.argsort(truth["vmag"])[:10]
    found = tetra3.get_centroids_from_image(shot.image)
    for number in brightest:
        # (0, 0) is the center of the first pixel in the truth, and (0.5, 0.5) in tetra3.
        place = np.array([truth["y"][number], truth["x"][number]]) + 0.5
        assert np.linalg.norm(found - place, axis=1).min() < 0.2
    assert (
        tetra3.get_centroids_from_image(shot.image, max_returned=5).tolist() == found[:5].tolist()
    )
    client = cedar_detect_client.CedarDetectClient()
    given = client.extract_centroids(shot.image, sigma=8, max_size=10, use_binned=True)
    assert np.array_equal(given, found)


def test_moments_are_those_of_the_spots_and_reject_others(shot):
    centroids, moments = tetra3.get_centroids_from_image(shot.image, return_moments=True)
    total, area, second, ratio = moments
    assert total.tolist() == sorted(total, reverse=True)
    assert len(centroids) == len(area) == len(second) == len(ratio)
    spot = sp.detect(shot.image).spot_sigma_px
    np.testing.assert_allclose(np.sqrt(np.median(second[:5, :2])), spot, rtol=0.3)
    assert (ratio[:5] >= 1.0).all() and np.median(ratio[:5]) < 1.5
    for limit, kept in (
        ({"min_sum": total[4]}, total >= total[4]),
        ({"max_sum": total[4]}, total <= total[4]),
        ({"min_area": area[4]}, area >= area[4]),
        ({"max_area": area[4]}, area <= area[4]),
        ({"max_axis_ratio": ratio[4]}, ratio <= ratio[4]),
    ):
        assert 0 < kept.sum() < len(centroids)
        chosen = tetra3.get_centroids_from_image(shot.image, **limit)
        assert chosen.tolist() == centroids[kept].tolist()
    assert 0 < len(tetra3.get_centroids_from_image(shot.image, image_th=300.0)) < len(centroids)


def test_a_crop_keeps_the_pixels_of_the_image(solver, shot):
    height, width = shot.image.shape
    whole = tetra3.get_centroids_from_image(shot.image)
    part = tetra3.get_centroids_from_image(shot.image, crop=(height // 2, width // 2, 40, -60))
    middle = np.array([height / 2.0 + 40.0, width / 2.0 - 60.0])
    assert (np.abs(part - middle) < np.array([height, width]) / 4.0 + 1.0).all()
    apart = np.linalg.norm(part[:5, None] - whole, axis=-1).min(axis=1)
    assert (apart < 0.1).all()
    found = solver.solve_from_image(shot.image, crop=(height * 3 // 4, width * 3 // 4))
    assert found["RA"] == pytest.approx(CENTER[0], abs=5e-3)


def test_pictures_show_the_steps(solver, shot):
    height, width = shot.image.shape
    solution, moments, images = solver.solve_from_image(
        shot.image, downsample=2, min_area=6, return_moments=True, return_images=True
    )
    assert solution["status"] == tetra3.MATCH_FOUND and len(moments) == 4
    assert images["converted_input"].dtype == np.float32
    small = images["cropped_and_downsampled"]
    assert small.shape == images["binary_mask"].shape == (height // 2, width // 2)
    assert images["converted_input"].sum() == pytest.approx(small.sum(), rel=1e-4)
    assert abs(np.median(images["removed_background"])) < np.median(small) / 10.0
    assert images["binary_mask"].dtype == bool and 0 < images["binary_mask"].sum() < small.size / 20
    marked = np.array(images["final_centroids"])
    assert marked.shape == (height, width, 3)
    assert (marked == (0, 128, 0)).all(axis=-1).any() and (marked == (255, 0, 0)).all(axis=-1).any()
    shown = solver.solve_from_image(shot.image, return_visual=True)["visual"]
    assert shown.size == (width, height)
    assert (np.array(shown) == (0, 128, 0)).all(axis=-1).any()


def test_crop_and_downsample_image():
    image = np.arange(48, dtype=np.uint8).reshape(6, 8)
    crop = tetra3.crop_and_downsample_image
    assert crop(image) is not None and np.array_equal(crop(image), image)
    part, offsets = crop(image, crop=2, return_offsets=True)
    assert offsets == (1, 2) and np.array_equal(part, image[1:5, 2:6])
    assert np.array_equal(crop(image, crop=(2, 4)), image[2:4, 2:6])
    part, offsets = crop(image, crop=(2, 4, 9, -1), return_offsets=True)
    assert offsets == (4, 1) and np.array_equal(part, image[4:, 1:5])
    assert crop(image, downsample=2)[0].tolist() == [18, 26, 34, 42]
    assert crop(image, downsample=2)[-1, -1] == 170 and crop(image, downsample=2).dtype == np.uint8
    assert crop(np.full((2, 2), 200, np.uint8), downsample=2).tolist() == [[255]]
    assert crop(image, downsample=2, sum_when_downsample=False)[0].tolist() == [4, 6, 8, 10]
    for known in ({"crop": 4}, {"crop": (1, 2, 3)}, {"downsample": 4}):
        with pytest.raises(ValueError, match=r"crop|multiple"):
            crop(image, **known)
    with pytest.raises(ValueError, match="rows and columns"):
        crop(image[0])


def test_no_database_is_needed(tmp_path):
    solver = tetra3.Tetra3(load_database=None, debug_folder=tmp_path / "debug")
    assert solver.debug_folder.is_dir()
    with pytest.warns(UserWarning, match="no database is needed"):
        solver.generate_database(max_fov=30, min_fov=10, save_as="mine", star_max_magnitude=7)
    with pytest.warns(UserWarning, match="no database is needed"):
        solver.save_database(tmp_path / "mine")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        solver.load_database("mine")
        assert solver.has_database
    properties = solver.database_properties
    assert properties["min_fov"] < 10 < 30 < properties["max_fov"]
    assert properties["epoch_equinox"] == 2000
    with pytest.raises(TypeError, match="fov_max"):
        solver.generate_database(fov_max=30)


@pytest.mark.parametrize("name", ["cygnus", "all-sky"])
def test_the_sky_of_a_header_is_that_of_astropy(pipeline, result, name):
    if name == "all-sky":
        camera = REPOSITORY / "docs" / "start" / "all-sky.toml"
        shot = sp.simulate(camera, ra=80.0, dec=40.0, exposure=20.0)
        result = pipeline.solve(shot.image)
        assert result
    wcs: WCS = result.wcs
    assert any(kind in wcs.wcs.ctype[0] for kind in ("TAN", "ZPN"))
    height, width = result.shape
    rng = np.random.default_rng(3)
    pixels = (0.3 + 0.4 * rng.uniform(size=(50, 2))) * (height, width)
    sky = SkyMap(result._wcs_header)
    expected = wcs.pixel_to_world(pixels[:, 1] - 0.5, pixels[:, 0] - 0.5)
    directions = sky.directions(pixels)
    np.testing.assert_allclose(directions, expected.cartesian.xyz.value.T, atol=1e-9)
    np.testing.assert_allclose(sky.pixels(directions), pixels, atol=1e-5)


def test_real_frames_are_solved_as_by_another_program(solver, real_frames):
    """The truth is from astrometry.net."""
    with (SHARED / "frames" / "truth.csv").open() as file:
        truth = {row["file"]: row for row in csv.DictReader(file)}
    for path in real_frames:
        expected = {key: float(truth[path.name][key]) for key in ("ra_deg", "dec_deg", "fov_x_deg")}
        with Image.open(path) as image:
            found = solver.solve_from_image(image, fov_estimate=11.4, fov_max_error=0.1)
        assert found["RA"] == pytest.approx(expected["ra_deg"], abs=0.02)
        assert found["Dec"] == pytest.approx(expected["dec_deg"], abs=0.02)
        assert angle(found["Roll"], -float(truth[path.name]["up_pa_deg"])) < 0.1
        assert found["FOV"] == pytest.approx(expected["fov_x_deg"], rel=3e-3)
