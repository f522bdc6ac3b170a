#!/usr/bin/env python3
"""Measures how accurate `starpipe sky` is, on simulated all-sky frames: the tables of docs/sky.md.

    scripts/validate-sky.py target/release/starpipe [--frames 40] [--seed 21]

The sky is that of random nights over 50° north, 10° east. Clear frames tell the errors of extinction,
brightness and limits. Cloudy ones are drawn with and without clouds: the light of the stars in both is the
truth in each cell.
"""

import argparse
import csv
import json
import math
import pathlib
import random
import statistics
import subprocess
import tempfile

SITE = "50,10,300"
LAT_DEG, LON_DEG = 50.0, 10.0
SIDE_PX = 1600
FIELD_DEG = 88.0
FOCAL_PX = SIDE_PX / 2 / math.radians(FIELD_DEG)
CAMERA = {
    "width_px": SIDE_PX,
    "height_px": SIDE_PX,
    "pitch_x_um": 4,
    "pitch_y_um": 4,
    "focal_length_mm": FOCAL_PX * 4e-3,
    "aperture_mm": 2,
    "spot_sigma_px": 0.9,
}


def zenith(date):
    """Right ascension and declination of the zenith in ICRS, in degrees, to some 0.01°."""
    year, month, day, hour, minute = date
    days = 367 * year - 7 * (year + (month + 9) // 12) // 4 + 275 * month // 9 + day - 730530.5
    days += (hour + minute / 60) / 24 - 1
    sidereal = math.radians((280.46061837 + 360.98564736629 * days + LON_DEG) % 360)
    lat = math.radians(LAT_DEG)
    # Precession since J2000.0 (Meeus 1998, chapter 21).
    t = days / 36525
    zeta, z, theta = (math.radians(a * t / 3600) for a in (2306.2181, 2306.2181, 2004.3109))
    a, dec = sidereal - z, lat
    x = math.cos(theta) * math.cos(dec) * math.cos(a) + math.sin(theta) * math.sin(dec)
    y = math.cos(dec) * math.sin(a)
    sin = -math.sin(theta) * math.cos(dec) * math.cos(a) + math.cos(theta) * math.sin(dec)
    return math.degrees(math.atan2(y, x) - zeta) % 360, math.degrees(math.asin(sin))


class Study:
    def __init__(self, program, seed, directory):
        self.program, self.random, self.directory = program, random.Random(seed), directory
        text = self.run("camera", "new", "--preset=imx174-35mm")
        lines = []
        for line in text.splitlines():
            key = line.split(" = ")[0]
            lines.append(f"{key} = {CAMERA[key]}" if key in CAMERA else line)
        lines += ['projection = "equidistant"', f"field_radius_deg = {FIELD_DEG}"]
        self.camera = directory / "camera.toml"
        self.camera.write_text("\n".join(lines) + "\n")

    def run(self, *arguments):
        ran = subprocess.run([self.program, *map(str, arguments)], capture_output=True, text=True, check=False)
        if ran.returncode not in (0, 3):
            raise SystemExit(ran.stderr)
        return ran.stdout

    def night(self, brightest):
        """A random date, and the options of its sky."""
        pick = self.random
        date = (2024, pick.choice([1, 2, 3, 9, 10, 11, 12]), pick.randint(1, 28), pick.choice([20, 22, 23, 0, 1, 2, 3]), pick.randint(0, 59))
        sky, extinction = pick.uniform(brightest, 21.9), pick.uniform(0.1, 0.35)
        exposure = pick.choice([5, 10, 20, 40]) if sky > 19 else 5
        return date, sky, extinction, exposure

    def frame(self, name, number, night, more=()):
        date, sky, extinction, exposure = night
        ra, dec = zenith(date)
        out = self.directory / name
        iso = "{}-{:02}-{:02}T{:02}:{:02}:00Z".format(*date)
        self.run("simulate", f"--camera={self.camera}", f"--site={SITE}", f"--date={iso}", f"--ra={ra}", f"--dec={dec}", f"--seed={number}", f"--exposure={exposure}", f"--sky-mag-arcsec2={sky}", f"--extinction={extinction}", "--by-altitude=1", f"--out={out}", "--force", *more)
        return out, iso

    def sky(self, frame, iso):
        text = self.run("sky", f"--camera={self.camera}", f"--site={SITE}", f"--date={iso}", "--format=json", frame)
        return json.loads(text.splitlines()[0]).get("sky")

    def clear(self, number):
        night = self.night(17.5)
        found = self.sky(*self.frame("clear.tif", number, night))
        if not found:
            return None
        limits = [c["limit_vmag"] - c["expected_limit_vmag"] for c in found["cells"] if c["limit_vmag"] and (c["clear"] or 0) > 0.9]
        off = found["extinction_mag_per_airmass"] - night[2]
        zenith_off = found["zenith"]["mag_arcsec2"] - night[1]
        return {
            "sky": night[1],
            "extinction": off,
            "extinction in errors": off / found["extinction_sigma_mag"],
            "zenith": zenith_off,
            "zenith in errors": zenith_off / found["zenith"]["sigma_mag"],
            "limit": statistics.mean(limits) if limits else math.nan,
            "clouds": found["cloud_share"],
        }

    def stars(self, frame):
        """Electrons, altitude and azimuth of each star."""
        with frame.with_suffix(".csv").open() as lines:
            rows = [row for row in csv.DictReader(lines) if row["kind"] == "star" and float(row["electrons"]) > 0]
        middle = (SIDE_PX - 1) / 2
        stars = {}
        for row in rows:
            dx, dy = float(row["x"]) - middle, float(row["y"]) - middle
            altitude = 90 - math.degrees(math.hypot(dx, dy) / FOCAL_PX)
            stars[row["id"]] = float(row["electrons"]), altitude, math.degrees(math.atan2(-dx, -dy)) % 360
        return stars

    def cloudy(self, number):
        """Pairs of the mean extinction in a cell and `clear`."""
        night = self.night(19.0)
        pick = self.random
        clouds = [f"--cloud-mag={pick.choice([0.5, 1, 2, 4])}", f"--cloud-size-px={pick.choice([100, 200, 400])}", f"--cloud-light={pick.choice([0, 0.5, 1.5])}"]
        without = self.stars(self.frame("clear.tif", number, night)[0])
        frame, iso = self.frame("cloudy.tif", number, night, clouds)
        behind = self.stars(frame)
        found = self.sky(frame, iso)
        pairs = []
        for cell in found["cells"] if found else []:
            if cell["clear"] is None or cell["altitude_deg"][0] < 10:
                continue
            (low, high), (start, end) = cell["altitude_deg"], cell["azimuth_deg"]
            dimmed = [2.5 * math.log10(e / behind[i][0]) for i, (e, alt, az) in without.items() if low <= alt < high and start <= az < end and i in behind]
            if len(dimmed) >= 4:
                pairs.append((statistics.mean(dimmed), cell["clear"]))
        return pairs


def of_clear(name, results):
    """Prints the errors of some clear frames."""

    def values(key):
        return [r[key] for r in results if not math.isnan(r[key])]

    def rms(key):
        return f"{math.sqrt(statistics.mean(v * v for v in values(key))):.3f}"

    def spread(key):
        return f"{statistics.mean(values(key)):+.3f} ± {statistics.pstdev(values(key)):.3f}"

    print(f"{name}: {len(results)} clear frames")
    print(f"  extinction {rms('extinction')} mag, {rms('extinction in errors')} errors")
    print(f"  zenith {spread('zenith')} mag, {rms('zenith in errors')} errors")
    print(f"  limit, measured − expected: {spread('limit')} mag")
    print(f"  share of clouds: {statistics.mean(values('clouds')):.3f}")


def of_cloudy(pairs):
    thick = [1 - clear for mag, clear in pairs if mag > 0.5]
    none = [1 - clear for mag, clear in pairs if mag < 0.1]
    ranked = sorted([(value, 1) for value in thick] + [(value, 0) for value in none])
    ranks, first = 0.0, 0
    while first < len(ranked):
        last = first
        while last < len(ranked) and ranked[last][0] == ranked[first][0]:
            last += 1
        ranks += sum(kind for _, kind in ranked[first:last]) * (first + last + 1) / 2
        first = last
    area = (ranks - len(thick) * (len(thick) + 1) / 2) / (len(thick) * len(none))
    print(f"clouds: {len(pairs)} cells; area under the curve, 0.5 mag against 0.1 mag: {area:.4f}")
    for tenth in range(10):
        chosen = [mag for mag, clear in pairs if tenth == min(int(10 * (1 - clear)), 9)]
        if chosen:
            share = sum(mag > 0.2 for mag in chosen) / len(chosen)
            print(f"  1 − clear from {tenth / 10:.1f}: {len(chosen)} cells, {share:.3f} above 0.2 mag")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--seed", type=int, default=21)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as directory:
        study = Study(options.program.resolve(), options.seed, pathlib.Path(directory))
        clear = [study.clear(number) for number in range(options.frames)]
        print(f"not measured: {clear.count(None)} of {len(clear)} clear frames")
        measured = [result for result in clear if result]
        of_clear("darker than V 19", [result for result in measured if result["sky"] > 19])
        of_clear("brighter", [result for result in measured if result["sky"] <= 19])
        of_cloudy([pair for number in range(options.frames // 2) for pair in study.cloudy(number)])


main()
