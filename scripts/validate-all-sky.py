#!/usr/bin/env python3
"""Compares the answers for all-sky frames that scripts/all_sky.py draws with the truth.

    scripts/validate-all-sky.py target/release/starpipe SKYMAP_SKY2000_V5R4.gz DIR [--frames 100] [--seed 1000] [--set NAME=VALUE ...]

DIR keeps frames, truth, and answers (`starpipe sky` with date and site); frames that are there are not drawn again.
`--set` takes the options of scripts/all_sky.py, such as `bits=8`. An answer is wrong if its attitude is off by more
than 2°. Errors are in units of the stated ones. `--sky` compares brightness, clouds and limits of the sky's cells.
"""

import math
import sys

import all_sky
import all_sky_maps
import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

RIGHT_ARCSEC = 7200
AXES = ("x", "y", "roll")


def turn_arcsec(found, truth):
    """The small turn from the true attitude to that found, about the axes of the camera."""
    w, *xyz = found["attitude"]["quaternion"]
    true_w, *true_xyz = truth["quaternion"]
    turn = Rotation.from_quat([*xyz, w]) * Rotation.from_quat([*true_xyz, true_w]).inv()
    return np.degrees(turn.as_rotvec()) * 3600


def star_pulls(found, maps):
    """Light of the neighbors over a star's own, and errors of its place over the stated ones by axis, of named stars."""
    drawn = np.c_[maps["x"], maps["y"]]
    bright = maps["electrons"] > 30
    tree, light = cKDTree(drawn[bright]), maps["electrons"][bright]
    pulls = []
    for star in found["stars"]:
        if star["id"] is None or "blended" in star["flags"] or "saturated" in star["flags"]:
            continue
        near = tree.query_ball_point([star["x"], star["y"]], 4)
        if not near:
            continue
        main = max(near, key=lambda index: light[index])
        neighbors = sum(light[index] for index in near) / light[main] - 1
        x, y = drawn[bright][main]
        pulls.append((neighbors, (star["x"] - x) / star["sigma_x"], (star["y"] - y) / star["sigma_y"]))
    return pulls


def rms(values):
    return math.sqrt(np.mean(np.square(values))) if len(values) else math.nan


def main():
    parser = all_sky.comparison(__doc__, 1000)
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE")
    parser.add_argument("--argument", action="append", default=[], help="one more argument of `starpipe sky`")
    parser.add_argument("--sky", action="store_true", help="compare the sky's cells, too")
    options = parser.parse_args()
    words = [word for setting in options.set for word in ("--" + setting.split("=")[0].replace("_", "-"), setting.split("=")[1])]
    nees, focal, pulls, cells, skies, none, wrong = [], [], [], [], [], 0, 0
    for seed in range(options.seed, options.seed + options.frames):
        frame, truth, maps = all_sky.frame_of(options, seed, words)
        found = all_sky.answer(options, frame, truth, *options.argument)
        if found["status"] != "identified":
            none += 1
            continue
        off = turn_arcsec(found, truth)
        if np.linalg.norm(off) > RIGHT_ARCSEC:
            wrong += 1
            print(f"{frame}: off by {np.linalg.norm(off):.0f}″", file=sys.stderr)
            continue
        nees.append(sum((off[i] / found["attitude"]["sigma_arcsec"][axis]) ** 2 for i, axis in enumerate(AXES)))
        optics = found["optics"]
        focal.append((optics["focal_length_px"] - truth["focal_length_px"]) / optics["focal_length_sigma_px"])
        pulls += star_pulls(found, maps)
        print(f"{frame}: {found['match']['matched']} named, squared error {nees[-1]:.1f}, focal length {focal[-1]:+.2f}", file=sys.stderr)
        if options.sky and found["sky"]:
            of_cells, of_frame = all_sky_maps.compared(found, truth, maps)
            cells += of_cells
            skies.append(of_frame)
    print(f"{options.frames} frames: {len(nees)} right, {wrong} wrong, {none} not identified")
    if len(nees) > 1:
        error = np.std(nees, ddof=1) / math.sqrt(len(nees))
        print(f"squared error of the attitude {np.mean(nees):.2f} ± {error:.2f} (3), median {np.median(nees):.2f} (2.37), largest {max(nees):.1f}")
        print(f"focal length {rms(focal):.2f} of its errors")
        for most in (0.5, 0.02):
            of_stars = np.array([pull[1:] for pull in pulls if pull[0] < most])
            middle = np.median(np.abs(of_stars)) / 0.6745
            print(f"places of {len(of_stars)} stars with neighbors of less than {most} of their light: {rms(of_stars.ravel()):.2f}, by the median {middle:.2f}")
    if cells:
        print(all_sky_maps.summary(cells, skies))


if __name__ == "__main__":
    main()
