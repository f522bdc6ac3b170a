#!/usr/bin/env python3
"""Measures how right the answers for all-sky frames are, on simulated ones: a table of docs/accuracy.md.

    scripts/validate-lenses.py target/release/starpipe [--frames 100] [--seed 77]

Lenses, cameras, skies, clouds, skylines, lamps and the Moon are random; nothing is given but the frame. An
answer is right if its attitude is off by less than 10′. Errors are told in units of the stated ones.
"""

import argparse
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


def run(*command):
    ran = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False)
    if ran.returncode not in (0, 3):
        raise SystemExit(ran.stderr)
    return ran.stdout


def camera(program, pick):
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
    }
    lines = run(program, "camera", "new", "--preset=imx174-35mm").splitlines()
    keys = [line.split(" = ")[0] for line in lines]
    lines = [f"{key} = {numbers[key]}" if key in numbers else line for key, line in zip(keys, lines, strict=True)]
    return "\n".join(lines + [f"{key} = {value}" for key, value in more.items()]) + "\n"


def sky(pick):
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
    if pick.random() < 0.3:
        options |= {"cloud-mag": pick.uniform(0.5, 3), "cloud-size-px": pick.uniform(100, 300), "cloud-light": pick.uniform(0, 1)}
    if pick.random() < 0.3:
        options |= {"skyline-deg": pick.uniform(3, 12)}
    if pick.random() < 0.2:
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


def tried(program, pick, directory):
    """Draws a frame; returns the answer and the truth."""
    description, frame = directory / "camera.toml", directory / "frame.tif"
    description.write_text(camera(program, pick))
    made = run(program, "simulate", f"--camera={description}", f"--out={frame}", "--force", "--format=json", *sky(pick))
    return json.loads(run(program, "process", "--format=json", frame)), json.loads(made)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--frames", type=int, default=100)
    parser.add_argument("--seed", type=int, default=77)
    options = parser.parse_args()
    program, pick = options.program.resolve(), random.Random(options.seed)
    wrong, none, nees, focal, named = 0, 0, [], [], []
    with tempfile.TemporaryDirectory() as directory:
        for _ in range(options.frames):
            found, made = tried(program, pick, pathlib.Path(directory))
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
    print(f"{options.frames} frames: {len(nees)} right, {wrong} wrong, {none} not identified")
    print(f"named: {statistics.mean(named):.1%} of the detections")
    error = statistics.stdev(nees) / math.sqrt(len(nees))
    print(f"NEES {statistics.mean(nees):.2f} ± {error:.2f}, median {statistics.median(nees):.2f}")
    print(f"focal length {math.sqrt(statistics.mean(f * f for f in focal)):.2f} of its errors")


main()
