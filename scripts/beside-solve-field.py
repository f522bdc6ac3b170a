#!/usr/bin/env python3
"""Runs solve-field of astrometry.net and starpipe in its place over frames, with the same hints, and compares.

usage: beside-solve-field.py STARPIPE FRAME... [--truth CSV] [--hints] [--cpulimit SECONDS] [--keep DIR]

For each frame: which files of the one the other lacks, whether astropy reads them, by how much the coordinates of
the two .wcs files differ (centre, greatest over a grid of pixels, pixel scale, angle), the lines on standard output
that differ in more than numbers, and the time of each. Needs astropy and numpy.
"""

import argparse
import csv
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import warnings

import numpy as np
from astropy.io import fits
from astropy.wcs import WCS

SUFFIXES = [".axy", ".corr", ".match", ".new", ".rdls", ".solved", ".wcs", "-indx.xyls"]
# What callers look for at the beginning of a line.
LINES = [
    "Reading input file", "Field 1: solved with", "Field:", "Field center: (RA,Dec)", "Field center: (RA H:M:S",
    "Field size:", "Field rotation angle:", "Field parity:", "Did not solve", "Creating new FITS file",
]


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("starpipe")
    parser.add_argument("frames", nargs="+", type=pathlib.Path)
    parser.add_argument("--solve-field", default="solve-field", help="the other program")
    parser.add_argument("--truth", type=pathlib.Path, help="CSV with file,fov_x_deg and the like: gives scale hints")
    parser.add_argument("--cpulimit", default="20", help="for both [default: 20]")
    parser.add_argument("--keep", type=pathlib.Path, help="keep the files in this directory")
    parser.add_argument("options", nargs="*", help=argparse.SUPPRESS)
    return parser.parse_args()


def fields(path):
    """Width of the field in degrees, by the name of the file."""
    if path is None:
        return {}
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    return {row["file"]: float(row["fov_x_deg"]) for row in rows if row.get("fov_x_deg")}


def run(command, frame, directory, hints):
    directory.mkdir(parents=True, exist_ok=True)
    begun = time.monotonic()
    done = subprocess.run(
        [*command, "--overwrite", "--no-plots", "--dir", str(directory), *hints, str(frame)],
        check=False, capture_output=True, text=True, errors="replace",
    )
    return done, time.monotonic() - begun


def found(directory, frame):
    base = re.sub(r"\.[^./]{2,4}$", "", frame.name)
    files = {suffix: directory / (base + suffix) for suffix in SUFFIXES}
    return {suffix: path for suffix, path in files.items() if path.exists()}


def unread(files):
    """Suffixes of FITS files that astropy does not read, or whose table or header is empty."""
    wrong = []
    for suffix, path in files.items():
        if suffix == ".solved":
            if path.read_bytes() != b"\x01":
                wrong.append(suffix)
            continue
        try:
            with fits.open(path) as units:
                units.verify("exception")
                if suffix in (".wcs", ".new"):
                    WCS(units[0].header)
                    if suffix == ".new" and units[0].data is None:
                        wrong.append(suffix)
                elif len(units[1].data) == 0:
                    wrong.append(suffix)
        except (OSError, ValueError, TypeError, IndexError) as error:
            wrong.append(f"{suffix} ({error})")
    return wrong


def coordinates(path):
    header = fits.getheader(path)
    return WCS(header), header["IMAGEW"], header["IMAGEH"]


def directions(wcs, x, y):
    ra, dec = np.radians(wcs.all_pix2world(x, y, 1))
    return np.stack([np.cos(dec) * np.cos(ra), np.cos(dec) * np.sin(ra), np.sin(dec)], axis=-1)


def angle_arcsec(a, b):
    return np.degrees(2 * np.arcsin(np.clip(np.linalg.norm(a - b, axis=-1) / 2, 0, 1))) * 3600


def values(text):
    """The numbers that callers read."""
    patterns = {
        "centre": r"Field center: \(RA,Dec\) = \(([-\d.]+), ([-\d.]+)\)",
        "size": r"Field size: ([-\d.e+]+) x ([-\d.e+]+) (\w+)",
        "angle": r"Field rotation angle: up is ([-\d.e+]+)",
        "parity": r"Field parity: (\w+)",
    }
    matches = {name: re.search(pattern, text) for name, pattern in patterns.items()}
    return {name: match.groups() for name, match in matches.items() if match}


def forms(text):
    """The lines that callers read, with # for numbers; paths and the name of the index are left out."""
    lines = [line for line in text.splitlines() if line.startswith(tuple(LINES))]
    lines = [re.sub(r'"[^"]*"|(?<=Field: ).*|(?<=index ).*', "…", line) for line in lines]
    lines = [re.sub(r"(?<![A-Za-z])[-+]?\d[\d.:]*(e[-+]?\d+)?", "#", line) for line in lines]
    # Each once, in any order: attempts of several indexes are no matter.
    return set(lines)


def compared(theirs, ours, texts):
    """A line of what differs."""
    if ".wcs" not in theirs or ".wcs" not in ours:
        who = {(False, False): "neither", (True, False): "only solve-field", (False, True): "only starpipe"}
        return "solved by " + who[(".wcs" in theirs, ".wcs" in ours)]
    (a, width, height), (b, *size) = coordinates(theirs[".wcs"]), coordinates(ours[".wcs"])
    if size != [width, height]:
        return f"SIZE {size} instead of {[width, height]}"
    x, y = np.meshgrid(np.linspace(1, width, 9), np.linspace(1, height, 9))
    x, y = np.append(x, (width + 1) / 2), np.append(y, (height + 1) / 2)
    scale = np.sqrt(abs(np.linalg.det(a.pixel_scale_matrix))) * 3600
    off_px = angle_arcsec(directions(a, x, y), directions(b, x, y)) / scale
    their, our = values(texts[0]), values(texts[1])
    parts = [f"centre {off_px[-1]:.3f} px, median {np.median(off_px):.3f} px, most {off_px.max():.3f} px"]
    size = 100 * (float(our["size"][0]) / float(their["size"][0]) - 1)
    turn = (float(our["angle"][0]) - float(their["angle"][0]) + 180) % 360 - 180
    parts.append(f"width {size:+.3f} %, angle {turn:+.4f} deg")
    for name in ["parity"]:
        if their[name] != our[name]:
            parts.append(f"{name.upper()} {our[name]} instead of {their[name]}")
    if their["size"][2] != our["size"][2]:
        parts.append(f"UNIT {our['size'][2]} instead of {their['size'][2]}")
    return ", ".join(parts)


def main():
    options = arguments()
    known = fields(options.truth)
    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory() as temporary:
        root = options.keep or pathlib.Path(temporary)
        for number, frame in enumerate(options.frames):
            hints = ["--cpulimit", options.cpulimit]
            if frame.name in known:
                field = known[frame.name]
                hints += ["--scale-units", "degwidth", "--scale-low", f"{0.9 * field:.3f}"]
                hints += ["--scale-high", f"{1.1 * field:.3f}"]
            commands = [[options.solve_field], [options.starpipe, "solve-field"]]
            runs = [run(c, frame, root / f"{number}-{w}", hints) for c, w in zip(commands, ["theirs", "ours"])]
            theirs, ours = (found(root / f"{number}-{which}", frame) for which in ["theirs", "ours"])
            texts = [done.stdout for done, _ in runs]
            print(f"{frame.name}: {runs[0][1]:.1f} s, {runs[1][1]:.1f} s: {compared(theirs, ours, texts)}")
            if ".wcs" in theirs and ".wcs" in ours:
                for what, names in [("missing", theirs.keys() - ours.keys()), ("unread", unread(ours)),
                                    ("lines missing", forms(texts[0]) - forms(texts[1])),
                                    ("lines more", forms(texts[1]) - forms(texts[0]))]:
                    if names:
                        print(f"    {what}: {', '.join(sorted(names))}")
            if runs[0][0].returncode != runs[1][0].returncode:
                print(f"    exit status {runs[1][0].returncode} instead of {runs[0][0].returncode}")
            if runs[1][0].stderr:
                print("    " + runs[1][0].stderr.strip())
            sys.stdout.flush()


if __name__ == "__main__":
    main()
