#!/usr/bin/env python3
"""Brightness in JPEG files: draws all-sky frames by scripts/all_sky.py with tone curves, and compares.

    scripts/validate-tone-curves.py target/release/starpipe SKYMAP_SKY2000_V5R4.gz DIR [--frames 100] [--seed 5000]

One frame in three has a power, the curve of sRGB, or the midtones transfer function; all have 8 bits, and are
compressed at a quality of 75 to 95. DIR keeps frames, truth, and answers; frames that are there are not drawn again.
Errors are measured minus true, in magnitudes, and over the stated ones.
"""

import argparse
import json
import pathlib
import subprocess

import all_sky
import numpy as np

TONES = ("gamma", "srgb", "stretched")
LOWEST_DEG = 10
METER_DEG, METER_REACH_DEG, MOON_REACH_DEG = 20, 30, 10


def draw(catalog, path, seed, arguments):
    """Draws a frame, unless it is there."""
    frame = path.with_suffix(".jpg")
    if not frame.exists():
        words = ["--seed", str(seed), "--bits", "8", "--tone", TONES[seed % 3], "--jpeg", str(75 + 5 * (seed // 3 % 5))]
        options = all_sky.parser().parse_args([*words, *arguments])
        all_sky.write(path, *all_sky.drawn(catalog(), options))
    return frame


def answer(program, frame, truth):
    """The JSON of `starpipe sky`."""
    site = ",".join(map(str, truth["site"]))
    command = [program, "sky", "--format=json", f"--site={site}", f"--date={truth['date']}", f"--exposure={truth['exposure_s']}", frame]
    ran = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
    if ran.returncode not in (0, 3):
        raise SystemExit(f"{frame}: {ran.stderr}")
    return json.loads(ran.stdout.splitlines()[0])


def mean_mag(mags, weights=None):
    """Magnitude of the mean light."""
    return -2.5 * np.log10(np.average(10 ** (-0.4 * mags), weights=weights))


def off_moon(truth, maps):
    """Where a meter at the zenith measures."""
    if truth["moon_direction"] is None:
        return True
    altitude, azimuth = np.radians(maps["altitude_deg"]), np.radians(maps["azimuth_deg"])
    directions = np.stack([np.cos(altitude) * np.cos(azimuth), np.cos(altitude) * np.sin(azimuth), np.sin(altitude)], axis=-1)
    return np.degrees(np.arccos(np.clip(directions @ np.array(truth["moon_direction"]), -1, 1))) > MOON_REACH_DEG


def true_zenith(truth, maps):
    """What a meter sees there."""
    angle = 90 - maps["altitude_deg"]
    seen = (angle < METER_REACH_DEG) & np.isfinite(maps["mag_arcsec2"]) & off_moon(truth, maps)
    return mean_mag(maps["mag_arcsec2"][seen], np.exp(-4 * np.log(2) * (angle[seen] / METER_DEG) ** 2))


def cell_errors(sky, maps):
    """Errors of cells above LOWEST_DEG whose sky is in the frame, and the stated ones."""
    mags, altitude, azimuth = maps["mag_arcsec2"], maps["altitude_deg"], maps["azimuth_deg"]
    errors = []
    for cell in sky["cells"]:
        if cell["mag_arcsec2"] is None or cell["altitude_deg"] is None or cell["altitude_deg"][0] < LOWEST_DEG:
            continue
        (low, high), (first, last) = cell["altitude_deg"], cell["azimuth_deg"]
        inside = (altitude >= low) & (altitude < high) & (azimuth >= first) & (azimuth < last)
        if np.isfinite(mags[inside]).mean() > 0.9:
            errors.append((cell["mag_arcsec2"] - mean_mag(mags[inside][np.isfinite(mags[inside])]), cell["sigma_mag"]))
    return errors


def summary(errors):
    """Count, mean, standard deviation and typical stated error, and errors over stated ones."""
    if not errors:
        return "none"
    off, sigma = np.array(errors).T
    pull = np.sqrt(np.mean((off / sigma) ** 2))
    largest = np.max(np.abs(off / sigma))
    return f"{len(off)}: {off.mean():+.2f} ± {off.std():.2f}, stated {np.median(sigma):.2f}; error over stated {pull:.2f}, largest {largest:.1f}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("catalog", type=pathlib.Path)
    parser.add_argument("directory", type=pathlib.Path)
    parser.add_argument("--frames", type=int, default=100)
    parser.add_argument("--seed", type=int, default=5000)
    parser.add_argument("--draw", action="append", default=[], help="one more argument of scripts/all_sky.py")
    options = parser.parse_args()
    options.directory.mkdir(parents=True, exist_ok=True)
    from astropy.utils import iers

    iers.conf.auto_download = False
    stars = []

    def catalog():
        if not stars:
            stars.append(all_sky.read_catalog(options.catalog))
        return stars[0]

    zeniths, cells, withheld, unknown = {}, {}, [], 0
    for seed in range(options.seed, options.seed + options.frames):
        path = options.directory / f"{seed}"
        frame = draw(catalog, path, seed, options.draw)
        truth, maps = json.loads(path.with_suffix(".json").read_text(encoding="utf-8")), np.load(path.with_suffix(".npz"))
        found = answer(options.program.resolve(), frame, truth)
        path.with_suffix(".answer.json").write_text(json.dumps(found), encoding="utf-8")
        sky = found.get("sky")
        if found["status"] != "identified" or sky is None:
            unknown += 1
            continue
        if sky["no_brightness"]:
            withheld.append((seed, sky["no_brightness"]))
            continue
        errors = cell_errors(sky, maps)
        cells.setdefault(truth["tone"], []).extend(errors)
        text = f"{seed} {truth['tone']} {truth.get('tone_parameter')}, {truth['unlit_level']:.1f} unlit"
        if sky["zenith"]:
            error = sky["zenith"]["mag_arcsec2"] - true_zenith(truth, maps), sky["zenith"]["sigma_mag"]
            zeniths.setdefault(truth["tone"], []).append(error)
            text += f", zenith {sky['zenith']['mag_arcsec2']:.2f}: {error[0]:+.3f} ± {error[1]:.3f}"
        if errors:
            text += f", cells {np.mean(errors, axis=0)[0]:+.3f} ± {np.std(errors, axis=0)[0]:.3f}, stated {np.median(errors, axis=0)[1]:.3f}"
        print(f"{text}; {sky.get('dark_level_source')} {sky.get('tone_curve')}", flush=True)
    print(f"{options.frames} frames; {unknown} not identified or without a sky, {len(withheld)} without brightness {withheld}")
    for name, found in (("zenith", zeniths), ("cells", cells)):
        for tone in TONES:
            print(f"{name} {tone}: {summary(found.get(tone, []))}")
        print(f"{name}: {summary([error for tone in TONES for error in found.get(tone, [])])}")


if __name__ == "__main__":
    main()
