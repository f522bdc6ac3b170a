#!/usr/bin/env python3
"""Compares the answers for all-sky frames that scripts/all_sky.py draws with the truth.

    scripts/validate-all-sky.py target/release/starpipe SKYMAP_SKY2000_V5R4.gz DIR [--frames 100] [--seed 1000] [--set NAME=VALUE ...]

DIR keeps frames, truth, and answers (`starpipe sky` with date and site); frames that are there are not drawn again.
`--set` takes the options of scripts/all_sky.py, such as `bits=8`. An answer is wrong if its attitude is off by more
than 2°. Errors are in units of the stated ones.
"""

import argparse
import json
import math
import pathlib
import subprocess
import sys

import all_sky
import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

RIGHT_ARCSEC = 7200
AXES = ("x", "y", "roll")


def draw(catalog, path, seed, settings):
    """Draws a frame, unless it is there; returns the file."""
    there = [path.with_suffix(end) for end in (".fits", ".png", ".jpg") if path.with_suffix(end).exists()]
    if there:
        return there[0]
    words = [word for setting in settings for word in ("--" + setting.split("=")[0].replace("_", "-"), setting.split("=")[1])]
    options = all_sky.parser().parse_args(["--seed", str(seed), *words])
    return all_sky.write(path, *all_sky.drawn(catalog(), options))


def answer(program, frame, truth, arguments):
    """The JSON of `starpipe sky`."""
    site = ",".join(str(number) for number in truth["site"])
    command = [program, "sky", "--format=json", f"--site={site}", f"--date={truth['date']}", *arguments, frame]
    ran = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
    if ran.returncode not in (0, 3):
        raise SystemExit(f"{frame}: {ran.stderr}")
    return json.loads(ran.stdout.splitlines()[0])


def turn_arcsec(found, truth):
    """The small turn from the true attitude to that found, about the axes of the camera."""
    w, *xyz = found["attitude"]["quaternion"]
    true_w, *true_xyz = truth["quaternion"]
    turn = Rotation.from_quat([*xyz, w]) * Rotation.from_quat([*true_xyz, true_w]).inv()
    return np.degrees(turn.as_rotvec()) * 3600


def star_pulls(found, maps):
    """Errors of places over stated errors, of named stars that are drawn alone, by axis."""
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
        if sum(light[index] for index in near) > 1.02 * light[main]:
            continue
        x, y = drawn[bright][main]
        pulls.append(((star["x"] - x) / star["sigma_x"], (star["y"] - y) / star["sigma_y"]))
    return pulls


def rms(values):
    return math.sqrt(np.mean(np.square(values))) if len(values) else math.nan


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("catalog", type=pathlib.Path)
    parser.add_argument("directory", type=pathlib.Path)
    parser.add_argument("--frames", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1000)
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE")
    parser.add_argument("--argument", action="append", default=[], help="one more argument of `starpipe sky`")
    options = parser.parse_args()
    options.directory.mkdir(parents=True, exist_ok=True)
    from astropy.utils import iers

    iers.conf.auto_download = False
    stars = []

    def catalog():
        if not stars:
            stars.append(all_sky.read_catalog(options.catalog))
        return stars[0]

    nees, focal, pulls, none, wrong = [], [], [], 0, 0
    for seed in range(options.seed, options.seed + options.frames):
        path = options.directory / f"{seed}"
        frame = draw(catalog, path, seed, options.set)
        truth = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
        found = answer(options.program.resolve(), frame, truth, options.argument)
        path.with_suffix(".answer.json").write_text(json.dumps(found), encoding="utf-8")
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
        pulls += star_pulls(found, np.load(path.with_suffix(".npz")))
        print(f"{frame}: {found['match']['matched']} named, squared error {nees[-1]:.1f}, focal length {focal[-1]:+.2f}", file=sys.stderr)
    print(f"{options.frames} frames: {len(nees)} right, {wrong} wrong, {none} not identified")
    if len(nees) > 1:
        error = np.std(nees, ddof=1) / math.sqrt(len(nees))
        print(f"squared error of the attitude {np.mean(nees):.2f} ± {error:.2f} (3), median {np.median(nees):.2f} (2.37), largest {max(nees):.1f}")
        print(f"focal length {rms(focal):.2f} of its errors; places of {len(pulls)} stars {rms(np.ravel(pulls)):.3f}")


main()
