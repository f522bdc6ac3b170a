#!/usr/bin/env python3
"""Measures simulated lenses with starpipe, OpenCV and tetra3rs.

    scripts/compare-calibration.py BIN [--sets N] [--frames N]

BIN is the program. Needs numpy, scipy, opencv-python-headless and tetra3rs. Prints a
Markdown table: how far pixels are off and the error of the scale at the frame's centre,
both RMS over the sets, and the mean time for the frames of a set on one thread.

- A pixel is off by the difference of the measured and the true image of a direction,
  after the turn that brings the two closest over the whole frame.
- Frames have no date, hence no aberration. All start from a field of 12 degrees, except
  starpipe, which starts from nothing. Unlike the others it chooses the terms itself.
- OpenCV gets the stars that `starpipe process` names, and the terms that the lens has
  or, as `any terms`, its usual ones: k1, k2, k3, p1, p2 and the axis. Its views may be
  shifted, which is nearly another focal length at any distance of the points. So each
  star is given in its direction and the opposite one, which look the same unshifted.
- `clipped`: stars that are off by more than 3 sigma are left out, three times over.
- tetra3rs solves and calibrates three times, with the lens found before. Its database
  has Gaia's stars at 2000, and stays in the directory of temporary files.
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time
import tomllib

os.environ |= {"RAYON_NUM_THREADS": "1", "OPENCV_LOG_LEVEL": "ERROR"}
try:
    import cv2
    import numpy as np
    import tetra3rs
    from scipy.optimize import least_squares
    from scipy.spatial.transform import Rotation
except ImportError as missing:
    sys.exit(f"{missing}: pip install numpy scipy opencv-python-headless tetra3rs")

CAMERA = pathlib.Path(__file__).parent.parent / "docs/validation/camera.toml"
WIDTH, FOCAL_PX = 1024, 26.79e3 / 5.5
SHAPE, CENTRE, RADIUS_PX = (WIDTH, WIDTH), (WIDTH - 1) / 2, WIDTH / 2**0.5
# Options of `simulate`, in the order of the terms of a lens (docs/conventions.md).
TERMS = "distortion distortion5 distortion7 axis-x axis-y decentring-x decentring-y"
NO_K3 = cv2.CALIB_FIX_K3
NO_K2 = cv2.CALIB_FIX_K2 | NO_K3
RADIAL = cv2.CALIB_FIX_PRINCIPAL_POINT | cv2.CALIB_ZERO_TANGENT_DIST
# The terms in pixels, what OpenCV holds, and the order for tetra3rs.
LENSES = {
    "no distortion": ([], RADIAL | NO_K2 | cv2.CALIB_FIX_K1, 2),
    "r³": ([18], RADIAL | NO_K2, 3),
    "r³, r⁵": ([12.3, 5.8], RADIAL | NO_K3, 5),
    "r³, axis, decentred": ([-36.2, 0, 0, 11.585, 8.689, 2, -1], NO_K2, 3),
}
CLIP = 3 / np.sqrt(2 * np.log(2))  # 3 sigma of an axis, over the median distance


def run(program, *arguments):
    command = [program, *map(str, arguments)]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def starpipe_lens(focal_px, terms):
    """From directions in camera axes to pixels."""
    k3, k5, k7, axis_x, axis_y, p, q, *rest = [*terms, *[0] * (9 - len(terms))]
    assert not any(rest), "stretch and skew are not computed here"

    def image(rays):
        u, v = (rays[:, :2] / rays[:, 2:] * focal_px / RADIUS_PX).T
        uu, uv, vv, r2 = u * u, u * v, v * v, u * u + v * v
        radial = RADIUS_PX + r2 * (k3 + r2 * (k5 + r2 * k7))
        x = u * radial + axis_x + p * (uu + vv / 3) + q * uv * 2 / 3
        y = v * radial + axis_y + p * uv * 2 / 3 + q * (uu / 3 + vv)
        return np.stack([x, y], axis=1) + CENTRE

    return image


def opencv_lens(*intrinsics):
    project, still = cv2.projectPoints, np.zeros(3)
    return lambda rays: project(rays, still, still, *intrinsics)[0][:, 0]


def tetra3rs_lens(model):
    one = lambda ray: model.tanplane_to_pixel(ray[0] / ray[2], ray[1] / ray[2])
    return lambda rays: CENTRE + np.array([one(ray) for ray in rays])


def compare(lens, truth):
    """How far pixels are off (RMS), and the error of the scale in millionths."""
    side = np.linspace(-0.55, 0.55, 34) * WIDTH / FOCAL_PX
    u, v = (grid.ravel() for grid in np.meshgrid(side, side))
    rays = np.stack([u, v, np.ones_like(u)], axis=1)
    rays = rays[np.abs(truth(rays) - CENTRE).max(axis=1) < WIDTH / 2]
    turned = lambda turn, rays: lens(Rotation.from_rotvec(turn).apply(rays))
    off = lambda turn: (turned(turn, rays) - truth(rays)).ravel()
    best = least_squares(off, np.zeros(3), x_scale=1e-4)
    near = np.array([[0, 0, 1], [1e-3, 0, 1], [0, 1e-3, 1]])
    area = lambda corners: np.linalg.det(corners[1:] - corners[0])
    scale = np.sqrt(area(turned(best.x, near)) / area(truth(near)))
    return np.sqrt(2 * np.mean(best.fun**2)), (scale - 1) * 1e6


def by_starpipe(program, frames):
    with tempfile.TemporaryDirectory() as place:
        run(program, "calibrate", "--threads", 1, *frames, "-o", f"{place}/lens.toml")
        text = pathlib.Path(place, "lens.toml").read_text()
    lens = tomllib.loads(text)["lens"]
    return starpipe_lens(lens["focal_length_px"], lens.get("terms_px", []))


def stars_in(program, frames):
    """The stars of each frame, the brightest first."""
    lines = run(program, "process", "--threads", 1, "--format", "json", *frames)
    reports = map(json.loads, lines.splitlines())
    return [sorted(report["stars"], key=lambda s: -s["flux"]) for report in reports]


def by_opencv(program, frames, held, clips):
    views = []
    for stars in stars_in(program, frames):
        named = [star for star in stars if star["id"]]
        ra, dec = np.radians([(s["ra_deg"], s["dec_deg"]) for s in named]).T
        x, y, z = np.cos(dec) * np.cos(ra), np.cos(dec) * np.sin(ra), np.sin(dec)
        at = np.array([(s["x"], s["y"]) for s in named])
        views.append((np.stack([x, y, z], axis=1), at))
    focal = WIDTH / 2 / np.tan(np.radians(12 / 2))
    guess = np.array([[focal, 0, CENTRE], [0, focal, CENTRE], [0, 0, 1]])
    held |= cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_ASPECT_RATIO
    for _ in range(clips + 1):
        both = [np.concatenate([rays, -rays]).astype(np.float32) for rays, _ in views]
        seen = [np.concatenate([at, at]).astype(np.float32) for _, at in views]
        _, *intrinsics, turns, shifts = cv2.calibrateCamera(
            both, seen, SHAPE, guess.copy(), np.zeros(5), flags=held
        )
        assert np.abs(shifts).max() < 1e-6, "OpenCV has shifted a view"
        lens = opencv_lens(*intrinsics)
        inward = [cv2.Rodrigues(turn)[0].T for turn in turns]
        pairs = zip(views, inward)
        off = [np.hypot(*(lens(rays @ turn) - at).T) for (rays, at), turn in pairs]
        limit = CLIP * np.median(np.concatenate(off))
        views = [(rays[d < limit], at[d < limit]) for (rays, at), d in zip(views, off)]
    return lens


def by_tetra3rs(database, stars, **model):
    known = {"fov_estimate_deg": 12, "fov_max_error_deg": 2, "image_shape": SHAPE}
    for _ in range(3):
        solved = [database.solve_from_centroids(frame, **known) for frame in stars]
        found = database.calibrate_camera(solved, stars, image_shape=SHAPE, **model)
        known = {"camera_model": found.camera_model}
    return tetra3rs_lens(found.camera_model)


def extracted(frames):
    pictures = (cv2.imread(str(frame), cv2.IMREAD_UNCHANGED) for frame in frames)
    return [tetra3rs.extract_centroids(picture).centroids for picture in pictures]


def of_starpipe(program, frames):
    at = lambda star: (star["x"] - CENTRE, star["y"] - CENTRE, star["flux"])
    stars = stars_in(program, frames)
    return [[tetra3rs.Centroid(*at(star)) for star in frame] for frame in stars]


def tetra3rs_database():
    file = pathlib.Path(tempfile.gettempdir(), "compare-calibration-gaia.bin")
    if not file.exists():
        field = {"min_fov_deg": 8, "max_fov_deg": 15, "epoch_proper_motion_year": 2000}
        tetra3rs.SolverDatabase.generate_from_gaia(**field).save_to_file(str(file))
    return tetra3rs.SolverDatabase.load_from_file(str(file))


def measured(program, database, frames, held, order):
    """Name of the program, how far its lens is off, and seconds."""
    by_peer = lambda stars, **model: by_tetra3rs(database, stars, **model)
    polynomial = {"model": "polynomial", "order": order}
    ways = {
        "starpipe": lambda: by_starpipe(program, frames),
        "OpenCV": lambda: by_opencv(program, frames, held, 0),
        "OpenCV, clipped": lambda: by_opencv(program, frames, held, 3),
        "OpenCV, any terms, clipped": lambda: by_opencv(program, frames, 0, 3),
        "tetra3rs, radial": lambda: by_peer(extracted(frames), model="radial"),
        "tetra3rs, polynomial": lambda: by_peer(extracted(frames), **polynomial),
        "tetra3rs, polynomial, centroids of starpipe": lambda: by_peer(
            of_starpipe(program, frames), **polynomial
        ),
    }
    for name, way in ways.items():
        start = time.perf_counter()
        lens = way()
        yield name, lens, time.perf_counter() - start


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", metavar="BIN")
    parser.add_argument("--sets", type=int, default=20)
    parser.add_argument("--frames", type=int, default=20)
    options = parser.parse_args()
    cv2.setNumThreads(1)
    database, errors, times = tetra3rs_database(), {}, {}
    for terms, held, order in LENSES.values():
        truth = starpipe_lens(FOCAL_PX, terms)
        given = [f"--{o}-px={t}" for o, t in zip(TERMS.split(), terms)]
        of_lens = {}
        for seed in range(1, options.sets + 1):
            with tempfile.TemporaryDirectory() as place:
                what = ["--camera", CAMERA, "--random-attitude", *given]
                many = ["--count", options.frames, "--seed", seed]
                run(options.program, "simulate", *what, *many, "--out", f"{place}/set")
                frames = sorted(pathlib.Path(place, "set").glob("*.tif"))
                all_ways = measured(options.program, database, frames, held, order)
                for name, lens, seconds in all_ways:
                    of_lens.setdefault(name, []).append(compare(lens, truth))
                    times.setdefault(name, []).append(seconds)
        for name, each in of_lens.items():
            errors.setdefault(name, []).append(np.sqrt(np.mean(np.square(each), 0)))
    print("| |", " | ".join(LENSES), "| time |")
    print("|---" * (len(LENSES) + 2) + "|")
    for name, lenses in errors.items():
        cells = [f"{px:.4f} px, {millionths:.0f} ppm" for px, millionths in lenses]
        print(f"| {name} |", " | ".join(cells), f"| {np.mean(times[name]):.2f} s |")


if __name__ == "__main__":
    main()
