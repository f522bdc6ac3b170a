#!/usr/bin/env python3
"""Measures how right the answers for all-sky frames are, on simulated ones: a table of docs/accuracy.md.

    scripts/validate-lenses.py target/release/starpipe [--frames 100] [--seed 77] [--hard] [--coma-px 4]

Lenses, cameras, skies, clouds, skylines, lamps and the Moon are random; nothing is given but the frame. An
answer is right if its attitude is off by less than 10′. Errors are told in units of the stated ones.
`--hard` draws frames of 8 bits with clouds over up to 80 % of the sky, half of them with the Moon.
"""

import argparse
import collections
import csv
import json
import math
import pathlib
import random
import statistics
import subprocess
import tempfile

PITCH_MM = 4e-3
RIGHT_ARCSEC = 600
# Distance from the axis over the focal length.
RADIUS = {
    "equidistant": lambda angle: angle,
    "equisolid": lambda angle: 2 * math.sin(angle / 2),
    "stereographic": lambda angle: 2 * math.tan(angle / 2),
    "orthographic": math.sin,
}
AXES = ("x", "y", "roll")
# Neighbours of a star are within this.
NEAR_PX = 8


def run(*command):
    ran = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False)
    if ran.returncode not in (0, 3):
        raise SystemExit(ran.stderr)
    return ran.stdout


def camera(program, pick, hard, coma_px):
    """The text of a random camera."""
    projection = pick.choice(list(RADIUS))
    field_deg = pick.uniform(60, 80 if projection == "orthographic" else 100)
    width = pick.randint(1100, 2400)
    height = pick.choice([width, width * 3 // 4])
    focal_px = height / 2 * pick.uniform(0.9, 1.05) / RADIUS[projection](math.radians(field_deg))
    corner_px = math.hypot(width, height) / 2
    numbers = {
        "width_px": width,
        "height_px": height,
        "pitch_x_um": 1000 * PITCH_MM,
        "pitch_y_um": 1000 * PITCH_MM,
        "focal_length_mm": focal_px * PITCH_MM,
        "aperture_mm": pick.uniform(1.5, 3),
        "spot_sigma_px": pick.uniform(0.7, 1.2),
    }
    more = {
        "projection": f'"{projection}"',
        "field_radius_deg": field_deg,
        "distortion_px": pick.uniform(-0.02, 0.02) * corner_px,
        "axis_x_px": pick.uniform(-0.03, 0.03) * corner_px,
        "axis_y_px": pick.uniform(-0.03, 0.03) * corner_px,
        "vignetting": pick.uniform(0, 0.5),
        "coma_px": coma_px,
    }
    if hard:
        # A grey level of one to four times the noise of an ordinary frame.
        numbers |= {"bits": 8, "gain_e_per_adu": pick.uniform(20, 80)}
    lines = run(program, "camera", "new", "--preset=imx174-35mm").splitlines()
    keys = [line.split(" = ")[0] for line in lines]
    lines = [f"{key} = {numbers[key]}" if key in numbers else line for key, line in zip(keys, lines, strict=True)]
    return "\n".join(lines + [f"{key} = {value}" for key, value in more.items()]) + "\n"


def sky(pick, hard):
    """Random options of a sky, and where the camera looks."""
    options = {
        "exposure": pick.choice([5, 10, 20]),
        "sky-mag-arcsec2": pick.uniform(18.5, 21.5),
        "by-altitude": 1,
        "ra": pick.uniform(0, 360),
        "dec": math.degrees(math.asin(pick.uniform(-1, 1))),
        "roll": pick.uniform(0, 360),
        "seed": pick.getrandbits(32),
    }
    if pick.random() < (1 if hard else 0.3):
        options |= {"cloud-mag": pick.uniform(0.5, 3), "cloud-size-px": pick.uniform(100, 300), "cloud-light": pick.uniform(0, 1)}
    if hard:
        options |= {"cloud-mag": pick.uniform(1, 8), "cloud-share": pick.uniform(0, 0.8)}
    if pick.random() < 0.3:
        options |= {"skyline-deg": pick.uniform(3, 12)}
    if pick.random() < (0.5 if hard else 0.2):
        options |= {"moon-distance-deg": pick.uniform(10, 70), "moon-direction-deg": pick.uniform(0, 360), "moon-phase-deg": pick.uniform(20, 120), "moon-zenith-distance-deg": pick.uniform(20, 70)}
    if pick.random() < 0.2:
        options |= {"lamps": pick.randint(1, 6)}
    return [f"--{key}={value}" for key, value in options.items()]


def matrix(quaternion):
    w, x, y, z = quaternion
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]


def turn_arcsec(found, made):
    """The small turn from one attitude to the other, about the axes of the camera."""
    a, b = matrix(found), matrix(made)
    turn = [[sum(a[i][k] * b[j][k] for k in range(3)) for j in range(3)] for i in range(3)]
    skew = (turn[2][1] - turn[1][2], turn[0][2] - turn[2][0], turn[1][0] - turn[0][1])
    return [math.degrees(angle / 2) * 3600 for angle in skew]


def tried(options, pick, directory):
    """Draws a frame; returns the answer, the truth, and the stars that are on it."""
    program, description, frame = options.program, directory / "camera.toml", directory / "frame.tif"
    description.write_text(camera(program, pick, options.hard, options.coma_px))
    made = run(program, "simulate", f"--camera={description}", f"--out={frame}", "--force", "--format=json", *sky(pick, options.hard))
    found = json.loads(run(program, "process", "--format=json", frame))
    with frame.with_suffix(".csv").open(newline="") as table:
        stars = [row for row in csv.DictReader(table) if row["kind"] == "star" and row["on_frame"] == "true"]
    return found, json.loads(made), stars


def squared_pulls(found, stars):
    """Squared errors of the named stars' places in units of the stated ones, of x and of y: of all, and of those
    without a neighbour that has a twentieth of their light."""
    cells = collections.defaultdict(list)
    for star in stars:
        star["at"] = float(star["x"]), float(star["y"])
        cells[tuple(int(along // NEAR_PX) for along in star["at"])].append(star)
    by_id = {star["id"]: star for star in stars}
    of_all, of_alone = [], []
    for star in found["stars"]:
        true = by_id.get(star["id"])
        if true is None:
            continue
        pulls = [(star[along] - at) / star[f"sigma_{along}"] for along, at in zip("xy", true["at"], strict=True)]
        squares = [pull * pull for pull in pulls]
        of_all += squares
        column, row = (int(along // NEAR_PX) for along in true["at"])
        around = (other for x in (-1, 0, 1) for y in (-1, 0, 1) for other in cells[column + x, row + y])
        near = (other for other in around if other is not true and math.dist(other["at"], true["at"]) < NEAR_PX)
        if sum(float(other["electrons"]) for other in near) < float(true["electrons"]) / 20:
            of_alone += squares
    return of_all, of_alone


def scatter(squares):
    """Root of the mean square, and what the median says of it (a normal distribution's is 0.455)."""
    return f"{math.sqrt(statistics.mean(squares)):.2f} (by the median {math.sqrt(statistics.median(squares) / 0.4549):.2f})"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--frames", type=int, default=100)
    parser.add_argument("--seed", type=int, default=77)
    parser.add_argument("--hard", action="store_true", help="8 bits, clouds over up to 80 %% of the sky, the Moon in half of the frames")
    parser.add_argument("--coma-px", type=float, default=0, help="flare of a star in the corner")
    parser.add_argument("--each", action="store_true", help="a line for each frame")
    options = parser.parse_args()
    options.program = options.program.resolve()
    pick = random.Random(options.seed)
    wrong, none, nees, focal, named, places, alone = 0, 0, [], [], [], [], []
    with tempfile.TemporaryDirectory() as directory:
        for number in range(options.frames):
            found, made, stars = tried(options, pick, pathlib.Path(directory))
            if found["status"] != "identified":
                none += 1
                continue
            attitude, optics = found["attitude"], found["optics"]
            off = turn_arcsec(attitude["quaternion"], made["attitude"]["quaternion"])
            if math.hypot(*off) > RIGHT_ARCSEC:
                wrong += 1
                continue
            sigmas = [attitude["sigma_arcsec"][axis] for axis in AXES]
            nees.append(sum((a / s) ** 2 for a, s in zip(off, sigmas, strict=True)))
            focal.append((optics["focal_length_px"] - made["focal_length_px"]) / optics["focal_length_sigma_px"])
            named.append(found["match"]["matched"] / found["match"]["detected"])
            of_all, of_alone = squared_pulls(found, stars)
            places += of_all
            alone += of_alone
            if options.each:
                lens = optics["distortion"]["model"] if optics["distortion"] else "none"
                errors = ", ".join(f"{a:+.2f} ± {s:.2f}″" for a, s in zip(off, sigmas, strict=True))
                print(f"{number}: {nees[-1]:.2f}; {errors}; {optics['model']}, {lens}; {found['match']['matched']} of {found['match']['detected']} named; places {scatter(of_all)}", flush=True)
    print(f"{options.frames} frames: {len(nees)} right, {wrong} wrong, {none} not identified")
    print(f"named: {statistics.mean(named):.1%} of the detections")
    error = statistics.stdev(nees) / math.sqrt(len(nees))
    print(f"NEES {statistics.mean(nees):.2f} ± {error:.2f}, median {statistics.median(nees):.2f}, largest {max(nees):.1f}")
    print(f"focal length {math.sqrt(statistics.mean(f * f for f in focal)):.2f} of its errors")
    print(f"places of named stars {scatter(places)}; of those without neighbours {scatter(alone)}")


main()
