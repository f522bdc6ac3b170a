#!/usr/bin/env python3
"""Draws narrow fields, identifies them with starpipe and with solve-field, and tables rates, times and errors.

    python3 scripts/narrow-fields.py target/release/starpipe --index /usr/share/astrometry/index-tycho2-07.littleendian.fits
        [--fields 0.4,0.5,0.75,1,1.5] [--count 40] [--modes blind,hints,wrong] [--object galaxy|cluster] [--solve-field] [--seed NUMBER]

Needs numpy. The stars are those of an index file of astrometry.net, read here by code of its own, each moved by
0.15" and changed by the color of a camera, with fainter ones of a galactic disc beside them. Nothing is taken from
starpipe's simulator: the spots are Moffat's, not round, and the lens is distorted. Exits with 1 if an answer is wrong.
"""

import argparse
import json
import math
import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import time

import numpy as np

SEED = 20260815
WIDTH, HEIGHT = 1500, 1000
RAD = math.pi / 180
# Logarithm of the stars to a V magnitude in a square degree, at 30 degrees from the galactic plane.
COUNTS = ((8, -0.1), (10, 0.82), (12, 1.65), (14, 2.4), (16, 3.05), (18, 3.55))
NORTH_POLE = (192.859, 27.128)


def read_index(path):
    """Unit vectors and magnitudes of the stars in an index file."""
    data = pathlib.Path(path).read_bytes()
    vectors = mags = None
    at = 0
    order = "<"
    scale = None
    while at < len(data):
        cards = {}
        while True:
            block = data[at : at + 2880].decode("latin-1")
            at += 2880
            for start in range(0, 2880, 80):
                card = block[start : start + 80]
                if card[8:10] == "= ":
                    value = card[10:].split(" /")[0].strip()
                    cards[card[:8].strip()] = value.strip("'").strip()
            if any(block[start : start + 8] == "END     " for start in range(0, 2880, 80)):
                break
        if cards.get("ENDIAN") == "01:02:03:04":
            order = ">"
        size = 0
        if int(cards["NAXIS"]) > 0:
            rows, width = int(cards.get("NAXIS2", 1)), int(cards["NAXIS1"])
            size = rows * width
            name = cards.get("TTYPE1")
            if name == "kdtree_range_stars":
                scale = np.frombuffer(data, order + "f8", 7, at)
            elif name == "kdtree_data_stars":
                steps = np.frombuffer(data, order + "u4", 3 * rows, at).reshape(-1, 3)
                vectors = scale[:3] + steps / scale[6]
            elif cards.get("AN_FILE") == "TAGALONG":
                mags = np.frombuffer(data, ">f4", rows, at).astype(float)
        at += (size + 2879) // 2880 * 2880
    return vectors, mags


def direction(ra_deg, dec_deg):
    ra, dec = ra_deg * RAD, dec_deg * RAD
    return np.array([math.cos(dec) * math.cos(ra), math.cos(dec) * math.sin(ra), math.sin(dec)])


def axes(ra_deg, dec_deg):
    ra = ra_deg * RAD
    east = np.array([-math.sin(ra), math.cos(ra), 0.0])
    return east, np.cross(direction(ra_deg, dec_deg), east)


def count_to(v_mag, latitude_deg):
    """Number of stars to a V magnitude in a square degree."""
    at_30 = np.interp(v_mag, [mag for mag, _ in COUNTS], [count for _, count in COUNTS])
    return 10**at_30 * (0.45 + 2.6 * math.exp(-abs(latitude_deg) / 12))


def faint_stars(rng, radius_deg, latitude_deg, brighter):
    """Offsets in degrees and magnitudes of stars that the catalog has not."""
    area = math.pi * radius_deg**2
    grid = np.arange(9.0, 17.01, 0.05)
    counts = np.array([count_to(mag, latitude_deg) for mag in grid]) * area
    known = np.array([np.count_nonzero(brighter < mag) for mag in grid])
    missing = np.maximum.accumulate(np.maximum(counts - known, 0))
    # Catalogs are complete to about V 11.
    missing[grid < 11] = 0
    number = rng.poisson(missing[-1])
    mags = np.interp(rng.uniform(missing[0], missing[-1], number), missing, grid)
    radius = radius_deg * np.sqrt(rng.uniform(0, 1, number))
    angle = rng.uniform(0, 2 * math.pi, number)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], 1), mags


def cluster(rng):
    """Places and magnitudes of the stars of a globular cluster, as Plummer distributes them."""
    number, core_px = 4000, rng.uniform(40, 110)
    radius = core_px / np.sqrt(rng.uniform(0.02, 1, number) ** (-2 / 3) - 1 + 1e-9)
    angle = rng.uniform(0, 2 * math.pi, number)
    mags = np.minimum(11.5 + rng.gamma(4.0, 0.8, number), 18)
    return radius * np.cos(angle) + WIDTH / 2, radius * np.sin(angle) + HEIGHT / 2, mags


def galaxy(rng, sky):
    """Light of an inclined disc with a nucleus that fills the frame."""
    length, axis, angle = rng.uniform(0.1, 0.25) * WIDTH, rng.uniform(0.3, 1), rng.uniform(0, math.pi)
    x = np.arange(WIDTH)[None, :] - WIDTH / 2
    y = np.arange(HEIGHT)[:, None] - HEIGHT / 2
    u = x * math.cos(angle) + y * math.sin(angle)
    v = (-x * math.sin(angle) + y * math.cos(angle)) / axis
    radius = np.hypot(u, v)
    arms = 1 + 0.3 * np.cos(2 * np.arctan2(v, u) - radius / length * 3)
    return sky * (rng.uniform(1, 5) * np.exp(-radius / length) * arms + 12 * np.exp(-radius / (0.06 * length)))


def draw(rng, catalog, fov_deg, extended=None):
    """A frame and its truth."""
    vectors, mags = catalog
    ra, dec = rng.uniform(0, 360), math.asin(rng.uniform(-1, 1)) / RAD
    roll, mirrored = rng.uniform(0, 360) * RAD, rng.random() < 0.5
    centre = direction(ra, dec)
    latitude = math.asin(np.dot(centre, direction(*NORTH_POLE))) / RAD
    focal = WIDTH / 2 / math.tan(fov_deg * RAD / 2)
    radius_deg = fov_deg * 0.7
    near = vectors @ centre > math.cos(radius_deg * RAD)
    east, north = axes(ra, dec)
    stars = vectors[near]
    offsets = np.stack([stars @ east, stars @ north], 1) / (stars @ centre)[:, None]
    offsets += rng.normal(0, 0.15 / 3600 * RAD, offsets.shape)
    more, faint = faint_stars(rng, radius_deg, latitude, mags[near])
    offsets = np.concatenate([offsets, more * RAD])
    # The camera is no V filter: redder stars are brighter.
    all_mags = np.concatenate([mags[near], faint])
    all_mags = all_mags + rng.normal(0, 0.25, len(all_mags))
    x, y = offsets[:, 0], offsets[:, 1]
    px = focal * (x * math.cos(roll) - y * math.sin(roll))
    py = -focal * (x * math.sin(roll) + y * math.cos(roll))
    if mirrored:
        px = -px
    bend = 1 + rng.normal(0, 6e-4) * (px**2 + py**2) / (WIDTH / 2) ** 2
    px, py = px * bend + (WIDTH - 1) / 2, py * bend + (HEIGHT - 1) / 2
    if extended == "cluster":
        more_x, more_y, more_mags = cluster(rng)
        px, py = np.concatenate([px, more_x]), np.concatenate([py, more_y])
        all_mags = np.concatenate([all_mags, more_mags])
    image = render(rng, px, py, all_mags, extended)
    scale_arcsec = 206264.806 / focal
    return image, {"ra": ra, "dec": dec, "fov": fov_deg, "scale": scale_arcsec}


def render(rng, px, py, mags, extended):
    """A frame of 16 bits: sky, spots, noise."""
    fwhm = rng.uniform(2.2, 4.5)
    beta, stretch, angle = 2.8, 1 + abs(rng.normal(0, 0.08)), rng.uniform(0, math.pi)
    alpha = fwhm / (2 * math.sqrt(2 ** (1 / beta) - 1))
    sky = rng.uniform(150, 2500)
    noise = math.sqrt(sky + 25)
    # A star of this magnitude has a signal-to-noise ratio of about 6.
    limit = rng.uniform(13.5, 16)
    flux_at_limit = 6 * noise * math.sqrt(4 * math.pi * (fwhm / 2.355) ** 2)
    light = np.full((HEIGHT, WIDTH), sky)
    light *= 1 + 0.1 * np.linspace(-1, 1, WIDTH)[None, :] * rng.uniform(-1, 1)
    if extended == "galaxy":
        light += galaxy(rng, sky)
    half = 24
    for x0, y0, mag in zip(px, py, mags):
        if not (-half < x0 < WIDTH + half and -half < y0 < HEIGHT + half) or mag > limit + 2:
            continue
        flux = flux_at_limit * 10 ** (-0.4 * (mag - limit))
        left, right = max(0, int(x0) - half), min(WIDTH, int(x0) + half + 1)
        top, bottom = max(0, int(y0) - half), min(HEIGHT, int(y0) + half + 1)
        if left >= right or top >= bottom:
            continue
        dx = np.arange(left, right)[None, :] - x0
        dy = np.arange(top, bottom)[:, None] - y0
        u = (dx * math.cos(angle) + dy * math.sin(angle)) / stretch
        v = (-dx * math.sin(angle) + dy * math.cos(angle)) * stretch
        spot = (1 + (u * u + v * v) / alpha**2) ** -beta
        light[top:bottom, left:right] += flux * (beta - 1) / (math.pi * alpha**2) * spot
    counts = rng.poisson(np.minimum(light, 1e6)) + rng.normal(0, 5, light.shape) + 300
    return np.clip(np.round(counts), 0, 65535).astype(np.uint16)


def write_fits(path, image):
    cards = [
        "SIMPLE  =                    T",
        "BITPIX  =                   16",
        "NAXIS   =                    2",
        f"NAXIS1  = {WIDTH:20}",
        f"NAXIS2  = {HEIGHT:20}",
        "BZERO   =                32768",
        "BSCALE  =                    1",
        "ROWORDER= 'TOP-DOWN'",
        "END",
    ]
    header = "".join(f"{card:80}" for card in cards).ljust(2880)
    data = (image.astype(np.int32) - 32768).astype(">i2").tobytes()
    padding = b"\0" * (-len(data) % 2880)
    pathlib.Path(path).write_bytes(header.encode() + data + padding)


def apart_deg(a, b):
    return math.acos(min(1.0, float(np.dot(direction(*a), direction(*b))))) / RAD


def timed(command, **options):
    """Output, seconds and processor seconds of a command."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = time.time()
    done = subprocess.run(command, check=False, capture_output=True, text=True, **options)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return done, time.time() - start, cpu


def hints(rng, truth, mode):
    """The direction and scale that are stated, right or wrong."""
    turn = rng.uniform(0, 2 * math.pi)
    off = rng.uniform(0, 2.0)
    dec = max(-89.5, min(89.5, truth["dec"] + off * math.sin(turn)))
    ra = truth["ra"] + off * math.cos(turn) / max(0.05, math.cos(truth["dec"] * RAD))
    if mode == "wrong":
        ra, dec = (ra + rng.uniform(60, 300)) % 360, -dec * rng.uniform(0.2, 0.9)
    scale = truth["scale"] * (1 + rng.uniform(-0.1, 0.1))
    return ra % 360, dec, scale


def starpipe(arguments, path, hint):
    command = [arguments.program, "process", path, "--format", "json", "--quiet"]
    if arguments.catalog:
        command += ["--catalog", arguments.catalog]
    if hint:
        ra, dec, scale = hint
        command += ["--near", f"{ra},{dec}", "--radius", "2.1", "--pixel-scale", str(scale), "--scale-error", "12"]
    done, seconds, cpu = timed(command)
    answer = None
    if done.stdout.strip():
        report = json.loads(done.stdout)
        if report["status"] == "identified":
            attitude = report["attitude"]
            answer = (attitude["ra_deg"], attitude["dec_deg"], report["optics"]["fov_x_deg"])
    elif done.stderr.strip():
        print(done.stderr, file=sys.stderr)
    return answer, seconds, cpu


def solve_field(arguments, path, hint):
    with tempfile.TemporaryDirectory() as folder:
        command = ["solve-field", "--no-plots", "--overwrite", "--dir", folder, path]
        command += ["--cpulimit", str(arguments.cpu_limit)]
        if hint:
            ra, dec, scale = hint
            command += ["--ra", str(ra), "--dec", str(dec), "--radius", "2.1", "--scale-units", "arcsecperpix"]
            command += ["--scale-low", str(scale * 0.88), "--scale-high", str(scale * 1.12)]
        done, seconds, cpu = timed(command)
        answer = None
        for line in done.stdout.splitlines():
            if line.startswith("Field center: (RA,Dec) = ("):
                ra, dec = line.split("= (")[1].split(")")[0].split(",")
                answer = (float(ra), float(dec), None)
    return answer, seconds, cpu


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("--index", required=True)
    parser.add_argument("--catalog", default=None)
    parser.add_argument("--fields", default="0.4,0.5,0.75,1,1.5")
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--modes", default="blind,hints,wrong")
    parser.add_argument("--object", choices=["galaxy", "cluster"], help="what fills the frame")
    parser.add_argument("--solve-field", action="store_true")
    parser.add_argument("--cpu-limit", type=int, default=30, help="seconds that solve-field may take")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--keep", default=None)
    arguments = parser.parse_args()
    catalog = read_index(arguments.index)
    folder = pathlib.Path(arguments.keep or tempfile.mkdtemp())
    folder.mkdir(exist_ok=True)
    solvers = [("starpipe", starpipe)] + ([("solve-field", solve_field)] if arguments.solve_field else [])
    wrong = 0
    print("field  mode   solver       identified  wrong  median s  max s  mean cpu s  median error arcsec")
    for fov in map(float, arguments.fields.split(",")):
        results = {}
        for number in range(arguments.count):
            rng = np.random.default_rng([arguments.seed, int(fov * 1000), number])
            image, truth = draw(rng, catalog, fov, arguments.object)
            path = str(folder / f"field-{fov}-{number}.fits")
            write_fits(path, image)
            for mode in arguments.modes.split(","):
                hint = None if mode == "blind" else hints(rng, truth, mode)
                for name, solve in solvers:
                    answer, seconds, cpu = solve(arguments, path, hint)
                    off = answer and apart_deg(answer[:2], (truth["ra"], truth["dec"]))
                    # The stars are moved by 0.15", and the lens is bent around the centre of the frame.
                    is_wrong = off is not None and (off > 0.05 * fov or (answer[2] and abs(answer[2] / fov - 1) > 0.02))
                    if is_wrong:
                        print(f"  wrong: {path} {mode} {name}: {answer}, truth {truth}")
                    results.setdefault((mode, name), []).append((off, is_wrong, seconds, cpu))
            if not arguments.keep:
                os.unlink(path)
        for (mode, name), rows in results.items():
            found = [row for row in rows if row[0] is not None and not row[1]]
            bad = sum(bool(row[1]) for row in rows)
            wrong += bad if name == "starpipe" else 0
            times = [row[2] for row in rows]
            error = np.median([row[0] for row in found]) * 3600 if found else math.nan
            print(
                f"{fov:5.2f}  {mode:6} {name:12} {len(found):4} of {len(rows):3}  {bad:5}  {np.median(times):8.2f}"
                f"  {max(times):5.1f}  {np.mean([row[3] for row in rows]):10.2f}  {error:8.2f}",
                flush=True,
            )
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
