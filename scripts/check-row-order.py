#!/usr/bin/env python3
"""Compares FITS files stored top-down and bottom-up, and the headers written for them, with astropy.

    python3 scripts/check-row-order.py PROGRAM FRAME...

Writes each picture, PNG or TIFF of grey levels, as a FITS file top-down (ROWORDER), bottom-up (ROWORDER), and as most programs do,
bottom-up without a word about it. For each:
- the answer is that of the picture: pointing, angle, not mirrored, positions of stars;
- with FRAME.wcs pasted into the file's own header, astropy maps each star to a pixel of the file
  that is as bright as the star's own.
Exits with 1 if something differs.
"""

import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
from astropy.io import fits
from astropy.wcs import WCS
from PIL import Image

SAME_DEG = 1e-6
SAME_PX = 1e-3
BRIGHTEST = 50
SAME_PIXEL = 0.7


def process(program, out, frame):
    command = [program, "process", "--format", "json", "--out", out, frame]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def differences(found, expected, order):
    """What differs between two reports, as text."""
    if found["row_order"] != order:
        yield f"row_order is {found['row_order']}"
    if found["optics"]["mirrored"] != expected["optics"]["mirrored"]:
        yield "mirrored differs"
    for name in ("ra_deg", "dec_deg", "up_pa_deg"):
        if abs(found["attitude"][name] - expected["attitude"][name]) > SAME_DEG:
            yield f"{name} differs"
    places = [np.array([(star["x"], star["y"]) for star in report["stars"]]) for report in (found, expected)]
    if places[0].shape != places[1].shape or np.abs(places[0] - places[1]).max() > SAME_PX:
        yield "positions of stars differ"


def pasted(frame, out, picture, report):
    """What differs between the picture and the file whose header has the .wcs pasted in, as text."""
    with fits.open(frame, mode="update") as opened:
        mandatory = {"SIMPLE", "BITPIX", "NAXIS", "EXTEND"}
        cards = fits.getheader(out / f"{frame.stem}.wcs").cards
        opened[0].header.extend([card for card in cards if card.keyword not in mandatory], update=True)
    with fits.open(frame) as opened:
        data, wcs = opened[0].data, WCS(opened[0].header)
    height, width = picture.shape
    inside = lambda star: 2 < star["x"] < width - 3 and 2 < star["y"] < height - 3
    stars = [star for star in report["stars"] if star["id"] and inside(star)][:BRIGHTEST]
    directions = np.array([(star["ra_deg"], star["dec_deg"]) for star in stars]).T
    columns, rows = np.rint(wcs.all_world2pix(*directions, 0)).astype(int)
    there = np.array([picture[round(star["y"]), round(star["x"])] for star in stars])
    # A blend is not where the named star is, and rounding may take the pixel beside the brightest.
    if np.mean(data[rows, columns] == there) < SAME_PIXEL:
        yield "the header maps stars to other pixels"


def check(program, frame):
    picture = np.array(Image.open(frame))
    good = True
    with tempfile.TemporaryDirectory() as directory:
        place = pathlib.Path(directory)
        expected = process(program, place, frame)
        for name, order, says in [
            ("top-down", "top-down", "TOP-DOWN"),
            ("bottom-up", "bottom-up", "BOTTOM-UP"),
            ("silent", "bottom-up", None),
        ]:
            file = place / f"{name}.fits"
            stored = picture if order == "top-down" else picture[::-1]
            unit = fits.PrimaryHDU(stored.copy())
            if says:
                unit.header["ROWORDER"] = says
            unit.writeto(file)
            report = process(program, place, file)
            wrong = [*differences(report, expected, order), *pasted(file, place, picture, report)]
            print(f"{pathlib.Path(frame).name:20} {name:10} {', '.join(wrong) or 'ok'}")
            good = good and not wrong
    return good


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    results = [check(sys.argv[1], frame) for frame in sys.argv[2:]]
    sys.exit(0 if all(results) else 1)


main()
