#!/usr/bin/env python3
"""Counts right sites and times that are accused, and wrong ones that are noticed and put right.

    scripts/validate-sites.py target/release/starpipe catalogs/SKYMAP_SKY2000_V5R4.gz [--right 200] [--wrong 60] [--seed 1]

Lists of stars are drawn with places, refraction and aberration of astropy, for level and tilted all-sky lenses and
for narrow fields, with clouds, a skyline, errors of positions and false detections. Each is given to `starpipe identify` with
its site and time, or with one mistake in them. It needs numpy, astropy, and scripts/all_sky.py.
"""

import argparse
import collections
import datetime
import json
import math
import pathlib
import subprocess
import tempfile

import all_sky
import numpy as np
from astropy.coordinates import get_sun
from astropy.time import Time
from astropy.utils import iers

iers.conf.auto_download = False
SIZE = 1000
SKYLINE = 12


class Sky:
    """A camera at a place and a time at night, and the stars that it sees."""

    def __init__(self, catalog, random, narrow):
        self.narrow = narrow
        self.lat = math.degrees(math.asin(random.uniform(-0.9, 0.9)))
        self.lon = random.uniform(-180, 180)
        self.height = random.uniform(0, 2500)
        while True:
            self.date = datetime.datetime(2010, 1, 1) + datetime.timedelta(days=int(random.integers(5800)), seconds=int(random.integers(86400)))
            place = all_sky.Place(self.lat, self.lon, self.height, Time(self.date))
            if get_sun(place.time).transform_to(place.airless).alt.deg < -10:
                break
        seen = catalog[:, catalog[4] < (8 if narrow else 6.3)]
        north, east, up = all_sky.observed_stars(seen, place).T
        vmag = seen[4]
        self.rows = self.seen_by_camera(np.arcsin(up), np.arctan2(east, north), vmag, random)

    def seen_by_camera(self, alt, az, vmag, random):
        tilt = random.uniform(5, 20) if random.random() < 0.15 else abs(random.normal(0, 1.5))
        self.tilt = random.uniform(0, 65) if self.narrow else tilt
        towards, roll = random.uniform(0, 2 * math.pi, 2)
        axis = np.array([math.cos(towards), math.sin(towards), 0]) * math.sin(math.radians(self.tilt))
        axis[2] = math.cos(math.radians(self.tilt))
        right = np.cross(axis, [math.cos(roll), math.sin(roll), 0.3])
        right /= np.linalg.norm(right)
        down = np.cross(axis, right)
        # East, north, up.
        directions = np.stack([np.cos(alt) * np.sin(az), np.cos(alt) * np.cos(az), np.sin(alt)])
        along = np.arccos(np.clip(axis @ directions, -1, 1))
        around = np.arctan2(down @ directions, right @ directions)
        if self.narrow:
            radius = np.tan(np.minimum(along, 1.2)) * SIZE / 2 / math.tan(math.radians(random.uniform(10, 25)))
        else:
            lens = random.choice(list(all_sky.LENSES)[:3])
            profile = all_sky.LENSES[lens][0]
            radius = profile(along) / profile(np.array(math.radians(91))) * SIZE / 2
            radius *= 1 + random.normal(0, 0.01) * (along / 1.57) ** 2
        x, y = SIZE / 2 + radius * np.cos(around), SIZE / 2 + radius * np.sin(around)
        skyline = np.radians(random.uniform(0, SKYLINE) + 3 * np.sin(2 * az + roll))
        airmass = 1 / (np.sin(np.maximum(alt, 0)) + 0.025 * np.exp(-11 * np.sin(np.maximum(alt, 0))))
        limit = random.uniform(6.5, 8) if self.narrow else random.uniform(4.8, 6.2)
        dimmed = vmag + 0.25 * airmass + random.normal(0, 0.1, len(vmag))
        cloud = random.uniform(0, 1) < 0.4
        clear = ~((np.cos(around - towards) > random.uniform(0.2, 1)) & (along > 0.5)) if cloud else np.ones(len(x), bool)
        inside = (x > 0) & (x < SIZE - 1) & (y > 0) & (y < SIZE - 1) & (along < 1.6)
        kept = inside & clear & (alt > skyline) & (alt > 0) & (dimmed < limit)
        sigma = random.uniform(0.05, 0.3)
        x, y = x[kept] + random.normal(0, sigma, kept.sum()), y[kept] + random.normal(0, sigma, kept.sum())
        flux = 10 ** (-0.4 * (dimmed[kept] - 12))
        false = random.integers(0, 1 + kept.sum() // 20)
        rows = [*zip(x, y, flux)] + [(*random.uniform(0, SIZE, 2), 10 ** (-0.4 * (random.uniform(2, limit) - 12))) for _ in range(false)]
        return [(x, y, flux, sigma) for x, y, flux in rows]

    def report(self, program, lat, lon, date):
        with tempfile.TemporaryDirectory() as directory:
            path = pathlib.Path(directory) / "stars.csv"
            path.write_text("x,y,flux,sigma_x,sigma_y\n" + "".join(f"{x},{y},{f},{s},{s}\n" for x, y, f, s in self.rows))
            site = f"--site={lat:.4f},{lon:.4f},{self.height:.0f}"
            size = f"--width={SIZE}", f"--height={SIZE}"
            command = [program, "identify", "--format", "json", site, f"--date={date.isoformat()}Z", *size, path]
            return json.loads(subprocess.run(command, check=False, capture_output=True, text=True).stdout)


def zenith(lat, lon, date):
    """Its direction among the stars."""
    turn = math.radians(Time(date).sidereal_time("mean", "greenwich").deg + lon)
    lat = math.radians(lat)
    return np.array([math.cos(lat) * math.cos(turn), math.cos(lat) * math.sin(turn), math.sin(lat)])


def apart_deg(a, b):
    return math.degrees(math.acos(min(1, max(-1, a @ b))))


def mistakes(sky, random):
    """What a single mistake makes of the place and the time."""
    hours = float(random.choice([-9, -8, -6, -5, -4, -3, -2, -1, 1, 2, 3, 4, 5, 5.5, 6, 8, 9, 10]))
    days = int(random.choice([-150, -90, -60, -30, 30, 45, 60, 120, 150]))
    yield "latitude_sign", -sky.lat, sky.lon, sky.date
    yield "longitude_sign", sky.lat, -sky.lon, sky.date
    if abs(sky.lon) <= 90:
        yield "exchanged", sky.lon, sky.lat, sky.date
    yield "hours", sky.lat, sky.lon, sky.date + datetime.timedelta(hours=hours)
    yield "days", sky.lat, sky.lon, sky.date + datetime.timedelta(days=days)
    yield "place", math.degrees(math.asin(random.uniform(-0.9, 0.9))), random.uniform(-180, 180), sky.date


def is_right(sky, candidate):
    """Whether a proposal puts the zenith where it is, within what the grid of proposals leaves."""
    date = datetime.datetime.fromisoformat(candidate["date"].rstrip("Z"))
    least = 0.0 if candidate["amount"] is None else abs(candidate["amount_to"] - candidate["amount_from"])
    degrees = {"hours": 7.5 * least, "days": 0.5 * least}.get(candidate["change"], 0)
    found = zenith(candidate["lat_deg"], candidate["lon_deg"], date)
    return apart_deg(found, zenith(sky.lat, sky.lon, sky.date)) < 6 + degrees + (sky.tilt if candidate["change"] in ("place", "days") else 0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("catalog")
    parser.add_argument("--right", type=int, default=200)
    parser.add_argument("--wrong", type=int, default=60)
    parser.add_argument("--narrow", type=float, default=0.2, help="share of narrow fields")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    catalog = all_sky.read_catalog(options.catalog)
    catalog = catalog[:, catalog[4] < 8]
    counts = collections.Counter()
    number = 0
    while counts["right"] < options.right or counts["wrong"] < options.wrong:
        random = np.random.default_rng([options.seed, number])
        number += 1
        sky = Sky(catalog, random, random.random() < options.narrow)
        report = sky.report(options.program, sky.lat, sky.lon, sky.date)
        if report["status"] != "identified":
            counts["not identified"] += 1
            continue
        counts["right"] += 1
        if report["place_time"]:
            counts["right, accused"] += 1
            print("ACCUSED", number, sky.lat, sky.lon, sky.date, report["place_time"])
        wrong = list(mistakes(sky, random))
        kind, lat, lon, date = wrong[int(random.integers(len(wrong)))]
        shift = apart_deg(zenith(lat, lon, date), zenith(sky.lat, sky.lon, sky.date))
        if counts["wrong"] >= options.wrong or shift < 5:
            continue
        counts["wrong"] += 1
        report = sky.report(options.program, lat, lon, date)
        found = report["place_time"]
        size = "far" if shift > 30 else "near"
        group = f"{'narrow' if sky.narrow else 'all-sky'}, {size}"
        counts[f"wrong, {group}"] += 1
        counts[f"wrong, {group}, noticed"] += bool(found)
        ranks = [at for at, candidate in enumerate(found["candidates"]) if is_right(sky, candidate)] if found else []
        counts[f"wrong, {group}, put right"] += bool(ranks)
        print(kind, f"zenith off by {shift:.0f}°", f"tilt {sky.tilt:.0f}°", group, report["status"], found and found["contradicted_by"],
              found and [(c["change"], c["amount_from"], c["amount_to"]) for c in found["candidates"]], "right at", ranks[:1], flush=True)
    for name, count in sorted(counts.items()):
        print(f"{count:5} {name}")


if __name__ == "__main__":
    main()
