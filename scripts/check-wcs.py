#!/usr/bin/env python3
"""Compares the FITS headers written by `starpipe process --out DIR` with astropy.

    python3 scripts/check-wcs.py DIR

For every DIR/*.wcs:
- the directions of the identified stars in the .csv beside it, mapped to pixels by the header's
  inverse (AP, BP) and by astropy's inversion of A and B, are as far from the observed positions as
  the residual in the .csv says;
- the directions of the other detections are those of their pixels;
- a grid over the frame returns to itself through the sky;
- the centre and the position angle of up are those in the .json.
A header refers to the rows of its file, which run upwards where the .json says "bottom-up".
Prints the largest differences in pixels for each frame. Exits with 1 if one reaches TOLERANCE_PX.
"""

import csv
import json
import pathlib
import sys
import warnings

import numpy as np
from astropy.io import fits
from astropy.wcs import WCS

TOLERANCE_PX = 0.02
ANGLE_TOLERANCE_DEG = 1e-4


def detections(path, report):
    """File positions (0-based), directions and residuals: of the named stars, and of the others."""
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))

    def columns(rows):
        column = lambda name: np.array([float(row[name] or 0) for row in rows])
        x, y = column("x"), column("y")
        return x, in_file(y, report), column("ra_deg"), column("dec_deg"), column("residual_px")

    # Outside the circle of an all-sky lens a detection has no direction.
    unnamed = [row for row in rows if not row["id"] and row["ra_deg"]]
    return columns([row for row in rows if row["id"]]), columns(unnamed)


def in_file(y, report):
    """Rows of the file, from 0, of rows of the picture."""
    return report["height"] - 1 - y if report.get("row_order") == "bottom-up" else y


def by_header_inverse(wcs, ra, dec):
    """Pixels (0-based) of directions through AP and BP."""
    ideal = np.array(wcs.wcs_world2pix(ra, dec, 1))
    if wcs.sip is None:
        return ideal - 1
    u, v = ideal - np.array(wcs.sip.crpix)[:, None]
    shift = [np.polynomial.polynomial.polyval2d(u, v, terms) for terms in (wcs.sip.ap, wcs.sip.bp)]
    return ideal + shift - 1


def largest(x, y, x_there, y_there):
    return float(np.max(np.hypot(x - x_there, y - y_there)))


def angles(wcs, report):
    """How far, in degrees, the centre and image-up are from what the report says."""
    centre_x, centre_y = (report["width"] - 1) / 2, (report["height"] - 1) / 2
    if report["attitude"]["at"] == "axis":
        centre_x, centre_y = report["optics"]["axis_px"]
    to_unit = lambda ra, dec: np.array(
        [np.cos(dec) * np.cos(ra), np.cos(dec) * np.sin(ra), np.sin(dec)]
    )
    at = lambda x, y: to_unit(*np.radians(wcs.all_pix2world(x, in_file(y, report), 0)))
    attitude = report["attitude"]
    ra, dec = np.radians([attitude["ra_deg"], attitude["dec_deg"]])
    centre = to_unit(ra, dec)
    off = np.degrees(np.linalg.norm(at(centre_x, centre_y) - centre))
    east = np.array([-np.sin(ra), np.cos(ra), 0])
    north = np.cross(centre, east)
    # The report's angle is that of the camera's axes: the right angle nearest to rows and columns.
    right = at(centre_x + 0.1, centre_y) - at(centre_x - 0.1, centre_y)
    down = at(centre_x, centre_y + 0.1) - at(centre_x, centre_y - 0.1)
    left_vectors, _, right_vectors = np.linalg.svd(np.stack([right, down], axis=-1), full_matrices=False)
    up = -(left_vectors @ right_vectors)[:, 1]
    angle = np.degrees(np.arctan2(up @ east, up @ north)) - attitude["up_pa_deg"]
    return off, abs((angle + 180) % 360 - 180)


def check(path):
    header = fits.getheader(path)
    wcs = WCS(header)
    report = json.loads(path.with_suffix(".json").read_text())
    (x, y, ra, dec, residual), unnamed = detections(path.with_suffix(".csv"), report)

    # The residual is the distance between the star's own position by the header and the observed one.
    exact = wcs.all_world2pix(ra, dec, 0, tolerance=1e-7, maxiter=100)
    residuals = float(np.max(np.abs(np.hypot(exact[0] - x, exact[1] - y) - residual)))
    others = 0.0
    if len(unnamed[0]):
        there = wcs.all_world2pix(unnamed[2], unnamed[3], 0, tolerance=1e-7, maxiter=100)
        others = largest(*there, *unnamed[:2])
    inverse = largest(*by_header_inverse(wcs, ra, dec), *exact)

    width, height = report["width"], report["height"]
    gx, gy = np.meshgrid(np.linspace(-0.5, width - 0.5, 33), np.linspace(-0.5, height - 0.5, 33))
    gx, gy = gx.ravel(), gy.ravel()
    if to_deg := report["optics"]["valid_to_deg"]:
        # Within the part of the frame that sees the sky.
        axis = np.array(report["optics"]["axis_px"])[:, None]
        edge_px = np.max(np.hypot(x - axis[0], y - axis[1])) if len(x) else to_deg
        inside = np.hypot(gx - axis[0], gy - axis[1]) < edge_px
        gx, gy = gx[inside], gy[inside]
    sky = wcs.all_pix2world(gx, gy, 0)
    grid = largest(*by_header_inverse(wcs, *sky), gx, gy)
    off, turn = angles(wcs, report)
    ok = max(residuals, others, inverse, grid) < TOLERANCE_PX and max(off, turn) < ANGLE_TOLERANCE_DEG
    print(
        f"{path.name:45} {header['CTYPE1']:13} stars {len(x):5}  residuals {residuals:.5f} px  others {others:.5f} px  "
        f"AP/BP at stars {inverse:.5f} px  grid and back {grid:.5f} px  "
        f"centre {off * 3600:.4f}\"  up {turn * 3600:.4f}\"  {'ok' if ok else 'WRONG'}"
    )
    return ok


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    paths = sorted(pathlib.Path(sys.argv[1]).glob("*.wcs"))
    if not paths:
        sys.exit(f"{sys.argv[1]}: no .wcs files")
    warnings.simplefilter("error")
    # The file has no image, as those of astrometry.net, and astropy reports the keywords it adds.
    warnings.filterwarnings("ignore", message="'datfix' made the change 'Set MJD-OBS")
    warnings.filterwarnings("ignore", message="The WCS transformation has more axes")
    results = [check(path) for path in paths]
    sys.exit(0 if all(results) else 1)


main()
