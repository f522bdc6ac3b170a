#!/usr/bin/env python3
"""Measures which trails `starpipe process --trails` finds, on simulated frames: the table of docs/process.md.

    scripts/validate-trails.py target/release/starpipe [--frames 200] [--seed 1]

Each frame is drawn with some trails, 1.5 on average, without them, and without them with other
noise. Lengths and brightnesses are random. A trail's height is that of its ridge over the noise of a pixel.
"""

import argparse
import csv
import itertools
import json
import math
import pathlib
import random
import statistics
import subprocess
import tempfile

WIDTH_PX, HEIGHT_PX = 1024, 768
SPOT_PX = 1.2
EXPOSURE_S = 2
# Shorter ones are not searched.
SHORTEST_PX = 40
HEIGHTS = [0.2, 0.35, 0.5, 0.75, 1, 2, 5, 100]
LENGTHS = [SHORTEST_PX, 150, 400, 2000]


def run(program, *arguments):
    ran = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, check=False)
    if ran.returncode not in (0, 3):
        raise SystemExit(ran.stderr)
    return ran.stdout


def camera(program, path):
    wanted = {"width_px": WIDTH_PX, "height_px": HEIGHT_PX, "spot_sigma_px": SPOT_PX}
    lines = []
    for line in run(program, "camera", "new", "--preset=imx174-35mm").splitlines():
        key = line.split(" = ")[0]
        lines.append(f"{key} = {wanted[key]}" if key in wanted else line)
    path.write_text("\n".join(lines) + "\n")


def clipped(begin, end):
    """The part of a line on the frame (Liang & Barsky 1984), or None."""
    (x, y), (dx, dy) = begin, (end[0] - begin[0], end[1] - begin[1])
    first, last = 0.0, 1.0
    for step, room in ((-dx, x + 0.5), (dx, WIDTH_PX - 0.5 - x), (-dy, y + 0.5), (dy, HEIGHT_PX - 0.5 - y)):
        if step < 0:
            first = max(first, room / step)
        elif step > 0:
            last = min(last, room / step)
        elif room < 0:
            return None
    if first >= last:
        return None
    ends = [(x + part * dx, y + part * dy) for part in (first, last)]
    return sorted(ends)


def frames(program, directory, count, seed):
    """Draws the frames; returns the magnitudes of their trails."""
    pick = random.Random(seed)
    magnitudes = []
    for number in range(count):
        vmag, rate = pick.uniform(0, 9), pick.choice([1, 2, 4, 8, 20])
        magnitudes.append(vmag)
        for name, trails in (("with", 1.5), ("without", 0)):
            run(program, "simulate", f"--camera={directory / 'camera.toml'}", "--random-attitude", f"--first={number}", f"--seed={seed}", f"--exposure={EXPOSURE_S}", f"--trails={trails}", f"--trail-vmag={vmag}", f"--trail-rate-deg-s={rate}", f"--out={directory / f'{name}-{number:03}.tif'}", "--force")
    return magnitudes


def redraw(program, directory, reports, seed):
    """Draws the frames without trails a second time, with other noise."""
    for name, report in reports.items():
        at = report["attitude"]
        if at and name.startswith("without"):
            out = directory / f"{name.replace('without', 'again')}.tif"
            run(program, "simulate", f"--camera={directory / 'camera.toml'}", f"--ra={at['ra_deg']}", f"--dec={at['dec_deg']}", f"--roll={at['up_pa_deg']}", f"--seed={seed + 1}", f"--exposure={EXPOSURE_S}", f"--out={out}", "--force")


def lost(stars, report):
    """Stars that a frame does not have."""
    return sum(not any(math.hypot(star["x"] - s["x"], star["y"] - s["y"]) < 0.5 for s in report["stars"]) for star in stars)


def truth(path, vmag, report):
    """Ends on the frame, length, and height over the noise of its trails."""
    zero_point = report["photometry"]["zero_point_vmag"]
    noise, trails = report["background"]["noise"], []
    with path.open() as lines:
        for row in csv.DictReader(lines):
            if row["kind"] != "trail":
                continue
            begin, end = (float(row["x"]), float(row["y"])), (float(row["x_end"]), float(row["y_end"]))
            ends = clipped(begin, end)
            if not ends or math.dist(*ends) < SHORTEST_PX:
                continue
            flux = EXPOSURE_S * 10 ** (-0.4 * (vmag - zero_point)) / math.dist(begin, end)
            sigma_px = math.hypot(SPOT_PX, 12**-0.5)
            inside = [math.dist(a, b) < 0.01 for a in ends for b in (begin, end)]
            trails.append({"ends": ends, "height": flux / (sigma_px * math.sqrt(2 * math.pi)) / noise, "flux": flux, "inside": [any(inside[:2]), any(inside[2:])]})
    return trails


def across(ends, point):
    (x, y), (x1, y1) = ends
    return ((point[1] - y) * (x1 - x) - (point[0] - x) * (y1 - y)) / math.dist(*ends)


def along(ends, point):
    (x, y), (x1, y1) = ends
    return ((point[0] - x) * (x1 - x) + (point[1] - y) * (y1 - y)) / math.dist(*ends)


def is_same(true, found):
    ends = [(found["x_begin"], found["y_begin"]), (found["x_end"], found["y_end"])]
    if any(abs(across(true["ends"], end)) > 4 for end in ends):
        return False
    begin, end = sorted(along(true["ends"], end) for end in ends)
    shared = min(end, math.dist(*true["ends"])) - max(begin, 0)
    return shared > 0.5 * (end - begin)


def near_trail(trails, star):
    point = star["x"], star["y"]
    return any(abs(across(t["ends"], point)) < 12 and -12 < along(t["ends"], point) < math.dist(*t["ends"]) + 12 for t in trails)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--frames", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    cells = {(height, length): [0, 0] for height in HEIGHTS[:-1] for length in LENGTHS[:-1]}
    false, false_without, offs, ends_off, fluxes, stars = 0, 0, [], [], [], 0
    lost_with, lost_again = 0, 0
    left_out = 0
    with tempfile.TemporaryDirectory() as name:
        directory = pathlib.Path(name)
        camera(options.program, directory / "camera.toml")
        magnitudes = frames(options.program, directory, options.frames, options.seed)
        reports = {}
        for kind in ("with", "without", "again"):
            if kind == "again":
                redraw(options.program, directory, reports, options.seed)
            files = sorted(directory.glob(f"{kind}-*.tif"))
            text = run(options.program, "process", f"--camera={directory / 'camera.toml'}", "--trails", "--format=json", *files)
            for line in text.splitlines():
                report = json.loads(line)
                reports[pathlib.Path(report["frame"]).stem] = report
        for number, vmag in enumerate(magnitudes):
            seen, clean = reports[f"with-{number:03}"], reports[f"without-{number:03}"]
            false_without += len(clean["trails"])
            if not clean["photometry"] or not clean["photometry"]["zero_point_vmag"]:
                left_out += 1
                continue
            trails = truth(directory / f"with-{number:03}.csv", vmag, clean)
            for true in trails:
                matches = [found for found in seen["trails"] if is_same(true, found)]
                height = max((least for least in HEIGHTS[:-1] if least <= true["height"]), default=None)
                length = max(least for least in LENGTHS[:-1] if least <= math.dist(*true["ends"]))
                if height is not None:
                    cells[height, length][0] += 1
                    cells[height, length][1] += bool(matches)
                if len(matches) == 1:
                    found = matches[0]
                    places = sorted([(found["x_begin"], found["y_begin"]), (found["x_end"], found["y_end"])])
                    middle = tuple(statistics.mean(at) for at in zip(*places))
                    offs.append(across(true["ends"], middle))
                    fluxes.append(found["flux_per_px"] / true["flux"] - 1)
                    ends_off += [along(true["ends"], at) - along(true["ends"], end) for at, end, inside in zip(places, true["ends"], true["inside"]) if inside]
            false += sum(not any(is_same(true, found) for true in trails) for found in seen["trails"])
            sure = [star for star in clean["stars"] if star["snr"] > 10 and not near_trail(trails, star)]
            stars += len(sure)
            lost_with += lost(sure, seen)
            lost_again += lost(sure, reports[f"again-{number:03}"])
    print("| height of the ridge over the noise | " + " | ".join(f"{a} to {b} px long" for a, b in itertools.pairwise(LENGTHS)) + " |")
    print("|---" * len(LENGTHS) + "|")
    for low, high in itertools.pairwise(HEIGHTS):
        counts = [cells[low, length] for length in LENGTHS[:-1]]
        print(f"| {low} to {high} | " + " | ".join(f"{found} of {count}" for count, found in counts) + " |")
    print(f"\n{options.frames} frames, {left_out} without a zero point left out")
    print(f"false trails: {false} in frames with trails, {false_without} in the same without")
    print(f"place across: median error {statistics.median(map(abs, offs)):.3f} px")
    print(f"ends: median error {statistics.median(map(abs, ends_off)):.2f} px, 90 % within {sorted(map(abs, ends_off))[int(0.9 * len(ends_off))]:.1f} px")
    print(f"flux: median error {statistics.median(fluxes):+.3f}, median of its size {statistics.median(map(abs, fluxes)):.3f}")
    print(f"stars of S/N 10 that are not near a trail: {stars}, lost {lost_with}; with other noise and no trail {lost_again}")


if __name__ == "__main__":
    main()
