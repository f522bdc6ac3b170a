#!/usr/bin/env python3
"""Measures simulated lenses with starpipe, OpenCV and tetra3rs.

    scripts/compare-calibration.py BIN [--sets N]

BIN is the program. Needs numpy, scipy, opencv-python-headless and tetra3rs. Prints how
far pixels are off and the error of the scale at the frame's centre, both RMS over the
sets of 20 frames, and the mean time for a set on one thread, as a table in Markdown.

- A pixel is off by the difference of the measured and the true image of a direction,
  after the turn that brings the two closest over the whole frame.
- Frames have no date, hence no aberration. The peers start from a field of 12 degrees;
  starpipe starts from nothing, and chooses the terms itself.
- OpenCV gets the stars that `starpipe process` names, and the terms of the lens or, as
  `any terms`, its usual ones: k1, k2, k3, p1, p2 and the axis. It may shift its views,
  which is nearly another focal length however far the points are. So each star is given
  in its direction and the opposite one, whose images agree only without a shift.
  `clipped`: three times, stars that are off by more than 3 sigma are left out.
- tetra3rs solves and calibrates three times, with the lens found before.
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
# Options of `simulate`, in the order of the terms (docs/conventions.md).
TERMS = "distortion distortion5 distortion7 axis-x axis-y decentring-x decentring-y"
NO_K3, NO_K2 = cv2.CALIB_FIX_K3, cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3
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
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout


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
    file = frames[0].with_suffix(".toml")
    run(program, "calibrate", "--threads", 1, *frames, "-o", file)
    lens = tomllib.loads(file.read_text())["lens"]
    return starpipe_lens(lens["focal_length_px"], lens.get("terms_px", []))


def stars_in(program, frames):
    """The stars of each frame, the brightest first."""
    text = run(program, "process", "--threads", 1, "--format", "json", *frames)
    each = (json.loads(line)["stars"] for line in text.splitlines())
    return [sorted(stars, key=lambda star: -star["flux"]) for stars in each]


def by_opencv(program, frames, held, clips):
    views = []
    for stars in stars_in(program, frames):
        keys = ["ra_deg", "dec_deg", "x", "y"]
        ra, dec, *at = np.array([[s[key] for key in keys] for s in stars if s["id"]]).T
        ra, dec = np.radians([ra, dec])
        rays = [np.cos(dec) * np.cos(ra), np.cos(dec) * np.sin(ra), np.sin(dec)]
        views.append((np.transpose(rays), np.transpose(at)))
    f = WIDTH / 2 / np.tan(np.radians(12 / 2))
    guess = np.array([[f, 0, CENTRE], [0, f, CENTRE], [0, 0, 1]])
    held |= cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_ASPECT_RATIO
    project, still = cv2.projectPoints, np.zeros(3)
    image = lambda rays, turn, *lens: project(rays, turn, still, *lens)[0][:, 0]
    for _ in range(clips + 1):
        both = [np.concatenate([rays, -rays]).astype(np.float32) for rays, _ in views]
        seen = [np.concatenate([at, at]).astype(np.float32) for _, at in views]
        _, *camera, turns, shifts = cv2.calibrateCamera(
            both, seen, SHAPE, guess.copy(), np.zeros(5), flags=held
        )
        assert np.abs(shifts).max() < 1e-6, "OpenCV has shifted a view"
        images = [image(rays, t, *camera) for (rays, _), t in zip(views, turns)]
        off = [np.hypot(*(at - there).T) for (_, at), there in zip(views, images)]
        limit = CLIP * np.median(np.concatenate(off))
        views = [(rays[d < limit], at[d < limit]) for (rays, at), d in zip(views, off)]
    return lambda rays: image(rays, still, *camera)


def by_tetra3rs(database, stars, **model):
    known = {"fov_estimate_deg": 12, "fov_max_error_deg": 2, "image_shape": SHAPE}
    for _ in range(3):
        solved = [database.solve_from_centroids(frame, **known) for frame in stars]
        found = database.calibrate_camera(solved, stars, image_shape=SHAPE, **model)
        known = {"camera_model": found.camera_model}
    image = found.camera_model.tanplane_to_pixel
    return lambda rays: CENTRE + np.array([image(x / z, y / z) for x, y, z in rays])


def extracted(frames):
    pictures = (cv2.imread(str(frame), cv2.IMREAD_UNCHANGED) for frame in frames)
    return [tetra3rs.extract_centroids(picture).centroids for picture in pictures]


def of_starpipe(program, frames):
    one = lambda s: tetra3rs.Centroid(s["x"] - CENTRE, s["y"] - CENTRE, s["flux"])
    return [list(map(one, stars)) for stars in stars_in(program, frames)]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", metavar="BIN")
    parser.add_argument("--sets", type=int, default=20)
    options = parser.parse_args()
    cv2.setNumThreads(1)
    program = options.program
    # Gaia's stars at the epoch of the frames.
    field = {"min_fov_deg": 8, "max_fov_deg": 15, "epoch_proper_motion_year": 2000}
    database = tetra3rs.SolverDatabase.generate_from_gaia(**field)
    fit = lambda stars, **model: by_tetra3rs(database, stars, **model)
    series = lambda stars, order: fit(stars, model="polynomial", order=order)
    ways = {
        "starpipe": lambda f, *_: by_starpipe(program, f),
        "OpenCV": lambda f, held, _: by_opencv(program, f, held, 0),
        "OpenCV, clipped": lambda f, held, _: by_opencv(program, f, held, 3),
        "OpenCV, any terms, clipped": lambda f, *_: by_opencv(program, f, 0, 3),
        "tetra3rs, radial": lambda f, *_: fit(extracted(f), model="radial"),
        "tetra3rs, polynomial": lambda f, _, n: series(extracted(f), n),
        "… of starpipe's stars": lambda f, _, n: series(of_starpipe(program, f), n),
    }
    print("| |", " | ".join(LENSES), "| time |\n" + "|---" * (len(LENSES) + 2) + "|")
    errors, times = {name: [[] for _ in LENSES] for name in ways}, {n: [] for n in ways}
    for column, (terms, *known) in enumerate(LENSES.values()):
        truth = starpipe_lens(FOCAL_PX, terms)
        given = [f"--{o}-px={t}" for o, t in zip(TERMS.split(), terms)]
        given += ["--camera", CAMERA, "--random-attitude", "--count", 20]
        for seed in range(1, options.sets + 1):
            with tempfile.TemporaryDirectory() as place:
                run(program, "simulate", *given, "--seed", seed, "--out", place)
                frames = sorted(pathlib.Path(place).glob("*.tif"))
                for name, way in ways.items():
                    start = time.perf_counter()
                    lens = way(frames, *known)
                    times[name].append(time.perf_counter() - start)
                    errors[name][column].append(compare(lens, truth))
    for name, lenses in errors.items():
        rms = [np.sqrt(np.mean(np.square(each), axis=0)) for each in lenses]
        cells = [f"{px:.4f} px, {millionths:.0f} ppm" for px, millionths in rms]
        print(f"| {name} |", " | ".join(cells), f"| {np.mean(times[name]):.2f} s |")


if __name__ == "__main__":
    main()
