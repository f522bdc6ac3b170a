#!/usr/bin/env python3
"""Simulates a night of an all-sky camera, measures it by `starpipe night`, and compares what is found when
with the truth: the tables of docs/night.md.

    scripts/validate-night.py target/release/starpipe [--frames 96] [--keep DIR]

The camera stands still over 50° north, 10° east, 4° from the zenith. The Moon rises, a bank of clouds moves
through from the west-southwest, the camera is knocked, and from 3 o'clock on dew makes the stars wider and
dimmer.
"""

import argparse
import datetime
import json
import math
import pathlib
import subprocess
import sys
import tempfile

SITE = "50,10,300"
LAT_DEG, LON_DEG = 50.0, 10.0
START = datetime.datetime(2026, 1, 10, 19, 0, tzinfo=datetime.UTC)
HOURS = 9.5
SIDE_PX = 700
FIELD_DEG = 88.0
FOCAL_PX = SIDE_PX / 2 / math.radians(FIELD_DEG)
SPOT_PX = 0.8
CAMERA = {
    "width_px": SIDE_PX,
    "height_px": SIDE_PX,
    "pitch_x_um": 6,
    "pitch_y_um": 6,
    "focal_length_mm": FOCAL_PX * 6e-3,
    "aperture_mm": 1.4,
    "spot_sigma_px": SPOT_PX,
}
EXTINCTION_MAG, SKY_MAG, EXPOSURE_S = 0.17, 21.0, 20
# Hours after the start.
CLOUDS_H, CLOUDS_LAST_H, CLOUDS_FROM_DEG = 3.0, 2.0, 245.0
BANK_PX = 500
# Share of the sky above 10° from which on there are clouds.
CLOUDED = 0.05
KNOCK_H, KNOCK_DEG = 6.5, 2.0
DEW_H = 8.0
# The boresight and the position of image-up, before the knock.
ALTITUDE_DEG, AZIMUTH_DEG, UP_DEG = 86.0, 150.0, 20.0


def unit(altitude_deg, azimuth_deg):
    """East, north, up."""
    a, z = math.radians(altitude_deg), math.radians(azimuth_deg)
    return [math.cos(a) * math.sin(z), math.cos(a) * math.cos(z), math.sin(a)]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def normal(a):
    length = math.sqrt(dot(a, a))
    return [x / length for x in a]


def turned(vector, axis, angle_deg):
    """`vector` turned about `axis`."""
    sin, cos = math.sin(math.radians(angle_deg)), math.cos(math.radians(angle_deg))
    along = dot(vector, axis)
    return [v * cos + c * sin + a * along * (1 - cos) for v, c, a in zip(vector, cross(axis, vector), axis, strict=True)]


def axes(is_knocked):
    """Boresight and image-up over the horizon."""
    boresight = unit(ALTITUDE_DEG, AZIMUTH_DEG)
    up = unit(0.0, UP_DEG)
    up = normal([u - b * dot(up, boresight) for u, b in zip(up, boresight, strict=True)])
    if is_knocked:
        axis = unit(0.0, 60.0)
        boresight, up = turned(boresight, axis, KNOCK_DEG), turned(up, axis, KNOCK_DEG)
    return boresight, up


def to_sky(date):
    """East, north and zenith as directions of ICRS, to some 0.01°."""
    days = (date - datetime.datetime(2000, 1, 1, 12, tzinfo=datetime.UTC)).total_seconds() / 86400
    sidereal = math.radians((280.46061837 + 360.98564736629 * days + LON_DEG) % 360)
    lat = math.radians(LAT_DEG)
    sin_s, cos_s, sin_l, cos_l = math.sin(sidereal), math.cos(sidereal), math.sin(lat), math.cos(lat)
    of_date = [[-sin_s, cos_s, 0.0], [-sin_l * cos_s, -sin_l * sin_s, cos_l], [cos_l * cos_s, cos_l * sin_s, sin_l]]
    # Precession since J2000.0 (Meeus 1998, chapter 21).
    t = days / 36525
    zeta, z, theta = (math.radians(a * t / 3600) for a in (2306.2181, 2306.2181, 2004.3109))

    def back(v):
        x, y = v[0] * math.cos(z) + v[1] * math.sin(z), -v[0] * math.sin(z) + v[1] * math.cos(z)
        x, w = x * math.cos(theta) + v[2] * math.sin(theta), -x * math.sin(theta) + v[2] * math.cos(theta)
        return [x * math.cos(zeta) + y * math.sin(zeta), -x * math.sin(zeta) + y * math.cos(zeta), w]

    return [back(v) for v in of_date]


def attitude(date, is_knocked):
    """Right ascension, declination and position angle of image-up, in degrees."""
    frame = to_sky(date)
    boresight, up = ([sum(c * f[i] for c, f in zip(v, frame, strict=True)) for i in range(3)] for v in axes(is_knocked))
    ra, dec = math.atan2(boresight[1], boresight[0]), math.asin(boresight[2])
    east = [-math.sin(ra), math.cos(ra), 0.0]
    north = [-math.sin(dec) * math.cos(ra), -math.sin(dec) * math.sin(ra), math.cos(dec)]
    return math.degrees(ra) % 360, math.degrees(dec), math.degrees(math.atan2(dot(up, east), dot(up, north)))


def image_direction_deg(toward, is_knocked):
    """Where a direction over the horizon is in the image, in degrees from image-up towards the right."""
    boresight, up = axes(is_knocked)
    return math.degrees(math.atan2(dot(toward, cross(boresight, up)), dot(toward, up)))


def moon(date):
    """Altitude and azimuth of the Moon, and its phase angle, in degrees (Astronomical Almanac, low precision)."""
    days = (date - datetime.datetime(2000, 1, 1, 12, tzinfo=datetime.UTC)).total_seconds() / 86400
    t = days / 36525

    def terms(function, *terms):
        return sum(a * function(math.radians(b + c * t)) for a, b, c in terms)

    lon = 218.32 + 481267.881 * t + terms(math.sin, (6.29, 135.0, 477198.87), (-1.27, 259.3, -413335.36), (0.66, 235.7, 890534.22), (0.21, 269.9, 954397.74), (-0.19, 357.5, 35999.05), (-0.11, 186.5, 966404.03))
    lat = terms(math.sin, (5.13, 93.3, 483202.02), (0.28, 228.2, 960400.89), (-0.28, 318.3, 6003.15), (-0.17, 217.6, -407332.21))
    parallax = 0.9508 + terms(math.cos, (0.0518, 135.0, 477198.87), (0.0095, 259.3, -413335.36), (0.0078, 235.7, 890534.22), (0.0028, 269.9, 954397.74))
    sun = 280.460 + 36000.770 * t + terms(math.sin, (1.915, 357.528, 35999.05), (0.020, 715.056, 71998.1))
    phase = 180 - math.degrees(math.acos(math.cos(math.radians(lat)) * math.cos(math.radians(lon - sun))))
    lon, lat, tilt = math.radians(lon), math.radians(lat), math.radians(23.439)
    x, y, z = math.cos(lat) * math.cos(lon), math.cos(lat) * math.sin(lon), math.sin(lat)
    y, z = y * math.cos(tilt) - z * math.sin(tilt), y * math.sin(tilt) + z * math.cos(tilt)
    sidereal, site = math.radians((280.46061837 + 360.98564736629 * days + LON_DEG) % 360), math.radians(LAT_DEG)
    east = y * math.cos(sidereal) - x * math.sin(sidereal)
    out = x * math.cos(sidereal) + y * math.sin(sidereal)
    north, up = z * math.cos(site) - out * math.sin(site), z * math.sin(site) + out * math.cos(site)
    altitude = math.degrees(math.asin(up))
    return altitude - parallax * math.cos(math.radians(altitude)), math.degrees(math.atan2(east, north)) % 360, phase


class Night:
    def __init__(self, program, frames, directory):
        self.program, self.frames, self.directory = program, frames, directory
        text = self.run("camera", "new", "--preset=imx174-35mm")
        lines = []
        for line in text.splitlines():
            key = line.split(" = ")[0]
            lines.append(f"{key} = {CAMERA[key]}" if key in CAMERA else line)
        lines += ['projection = "equidistant"', f"field_radius_deg = {FIELD_DEG}"]
        self.camera = directory / "camera.toml"
        self.camera.write_text("\n".join(lines) + "\n")
        (directory / "frames").mkdir(exist_ok=True)

    def run(self, *arguments):
        ran = subprocess.run([self.program, *map(str, arguments)], capture_output=True, text=True, check=False)
        if ran.returncode not in (0, 3):
            raise SystemExit(ran.stderr)
        return ran.stdout

    def hour(self, number):
        return HOURS * number / (self.frames - 1)

    def date(self, number):
        return START + datetime.timedelta(seconds=round(3600 * self.hour(number)))

    def front_px(self, hour):
        """How far the front of the clouds is from the centre; it crosses the field in the time stated."""
        edge = SIDE_PX / 2
        return edge - (hour - CLOUDS_H) / CLOUDS_LAST_H * (2 * edge + BANK_PX)

    def options(self, number):
        hour, date = self.hour(number), self.date(number)
        is_knocked = hour >= KNOCK_H
        ra, dec, up = attitude(date, is_knocked)
        spot, dimmed = SPOT_PX, 0.0
        if hour > DEW_H:
            spot, dimmed = SPOT_PX * (1 + 0.25 * (hour - DEW_H)), 0.3 * (hour - DEW_H)
        options = [f"--ra={ra}", f"--dec={dec}", f"--roll={up}", f"--date={date:%Y-%m-%dT%H:%M:%SZ}", f"--site={SITE}", f"--exposure={EXPOSURE_S}", f"--sky-mag-arcsec2={SKY_MAG + dimmed}", f"--extinction={EXTINCTION_MAG}", "--by-altitude=1", "--hot-pixels-per-mpx=60", "--hot-pixel-e-s=1000", f"--seed={number}", f"--spot-sigma-px={spot}"]
        if dimmed:
            options.append(f"--lens-transmission={0.87 * 10 ** (-0.4 * dimmed)}")
        altitude, azimuth, phase = moon(date)
        if altitude > 0.5:
            toward = unit(altitude, azimuth)
            distance = math.degrees(math.acos(dot(toward, axes(is_knocked)[0])))
            options += [f"--moon-distance-deg={distance}", f"--moon-direction-deg={image_direction_deg(toward, is_knocked)}", f"--moon-phase-deg={phase}", f"--moon-zenith-distance-deg={90 - altitude}"]
        if self.has_clouds(number):
            direction = image_direction_deg(unit(0.0, CLOUDS_FROM_DEG), is_knocked)
            options += ["--cloud-mag=4", "--cloud-light=0.5", "--cloud-size-px=200", f"--cloud-bank-px={self.front_px(hour)}", f"--cloud-bank-deg={direction}", f"--cloud-bank-width-px={BANK_PX}"]
        return options

    def has_clouds(self, number):
        return CLOUDS_H <= self.hour(number) <= CLOUDS_H + CLOUDS_LAST_H

    def draw(self):
        for number in range(self.frames):
            out = self.directory / "frames" / f"{number:04}.fits"
            if not out.exists():
                self.run("simulate", f"--camera={self.camera}", f"--out={out}", "--force", *self.options(number))

    def measure(self):
        out = self.directory / "night"
        self.run("night", f"--site={SITE}", f"--camera={self.camera}", f"--out={out}", self.directory / "frames")
        return json.loads((out / "night.json").read_text())

    def covered(self, number):
        """Share of the sky above 10° behind the bank."""
        if not self.has_clouds(number):
            return 0.0
        front, is_knocked = self.front_px(self.hour(number)), self.hour(number) >= KNOCK_H
        boresight, up = axes(is_knocked)
        direction = math.radians(image_direction_deg(unit(0.0, CLOUDS_FROM_DEG), is_knocked))
        right, inside, all_of_it = cross(boresight, up), 0, 0
        for step in range(4000):
            # Even over the sphere.
            height = math.sin(math.radians(10)) + (1 - math.sin(math.radians(10))) * (step + 0.5) / 4000
            place = unit(math.degrees(math.asin(height)), 222.492 * step % 360)
            radius = FOCAL_PX * math.acos(dot(place, boresight))
            x, y = dot(place, right), dot(place, up)
            along = radius * (x * math.sin(direction) + y * math.cos(direction)) / math.hypot(x, y)
            inside += front < along < front + BANK_PX
            all_of_it += 1
        return inside / all_of_it

    def first(self, hour):
        """Number of the first frame at or after an hour."""
        return next(n for n in range(self.frames) if self.hour(n) >= hour)


def read_skyglow(path):
    """Dates and brightnesses of a file in the skyglow community's text format, read by its definition alone."""
    text = path.read_bytes().decode("ascii")
    assert "\t" not in text and text.count("\n") == text.count("\r\n") and text.endswith("\r\n")
    lines = text.split("\r\n")[:-1]
    assert all(lines), "a blank line"
    header = [line for line in lines if line.startswith("# ")]
    assert all(len(line) <= 150 for line in header) and lines[: len(header)] == header
    known = dict(line[2:].split(": ", 1) for line in header if ": " in line)
    assert int(known["Number of header lines"]) == len(header) and header[-1] == "# END OF HEADER"
    names, units = header[-3][2:].split(", "), header[-2][2:].split(";")
    assert len(names) == len(units) == int(known["Number of fields per line"])
    at, unit_of_time = names.index("MSAS"), "YYYY-MM-DDTHH:mm:ss.fff"
    assert units[:2] == [unit_of_time, unit_of_time] and units[at] == "mag/arcsec^2"
    lat_deg, lon_deg, _ = (float(part) for part in known["Position (lat, lon, elev(m))"].split(", "))
    assert (lat_deg, lon_deg) == (LAT_DEG, LON_DEG)
    rows = [line.split(";") for line in lines[len(header) :]]
    assert all(len(row) == len(names) for row in rows)
    return [(datetime.datetime.strptime(row[0], "%Y-%m-%dT%H:%M:%S.%f"), float(row[at])) for row in rows]


def check_skyglow(directory):
    """Whether night.dat has the dates and brightnesses of night.jsonl."""
    rows = [json.loads(line) for line in (directory / "night.jsonl").read_text().splitlines()]
    wanted = [(row["date"], row["zenith_mag_arcsec2"]) for row in rows if row["date"] and row["zenith_mag_arcsec2"] is not None]
    read = read_skyglow(directory / "night.dat")
    same = len(read) == len(wanted)
    for (date, mag), (iso, known) in zip(read, wanted, strict=False):
        off = date - datetime.datetime.fromisoformat(iso).replace(tzinfo=None)
        same &= abs(off.total_seconds()) < 0.001 and abs(mag - known) < 0.00501
    print(f"night.dat: {len(read)} lines, {'as' if same else 'other than'} in night.jsonl")
    return same


def compared(night, found):
    """Lines of what should be found, and what is; whether all is."""
    clouded = [n for n in range(night.frames) if night.covered(n) > CLOUDED]
    # The upper limb, refracted.
    rises = next((n for n in range(1, night.frames) if moon(night.date(n - 1))[0] < -0.83 <= moon(night.date(n))[0]), None)
    expected = [
        ("moonrise", rises, None),
        ("clouds_come", clouded[0], CLOUDS_FROM_DEG),
        ("clouds_go", clouded[-1] + 1, (CLOUDS_FROM_DEG + 180) % 360),
        ("knock", night.first(KNOCK_H), None),
        ("dew", night.first(DEW_H), None),
    ]
    lines, good = ["| moment | frame, truth | frame, found | direction, truth | direction, found |", "|---|---|---|---|---|"], True
    moments = [m for m in found["moments"] if m["kind"] not in ("twilight_ends", "twilight_begins", "moonset")]
    for kind, frame, azimuth in expected:
        same = [m for m in moments if m["kind"] == kind]
        if len(same) != 1:
            lines.append(f"| {kind} | {frame} | {[m['frame'] for m in same]} | | |")
            good = False
            continue
        moment = same[0]
        is_near = abs(moment["frame"] - frame) <= 1
        off = ""
        if azimuth is not None:
            off = moment["azimuth_deg"]
            is_near &= off is not None and abs((off - azimuth + 180) % 360 - 180) <= 10
        lines.append(f"| {kind} | {frame} | {moment['frame']} | {'' if azimuth is None else azimuth} | {off} |")
        good &= is_near
    others = [m for m in moments if m["kind"] not in [kind for kind, _, _ in expected]]
    lines += [f"not in the truth: {m['kind']} at frame {m['frame']}" for m in others]
    return lines, good and not others


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--frames", type=int, default=96)
    parser.add_argument("--keep", type=pathlib.Path, help="directory for frames and results")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        directory = arguments.keep or pathlib.Path(temporary)
        directory.mkdir(parents=True, exist_ok=True)
        night = Night(arguments.program, arguments.frames, directory)
        night.draw()
        found = night.measure()
        lines, is_good = compared(night, found)
        print("\n".join(lines))
        for key in ("identified", "held", "clear_hours", "hours", "median"):
            print(key, found[key])
        for moment in found["moments"]:
            print(moment["date"], moment["kind"], moment["azimuth_deg"], moment["angle_deg"])
        is_good &= check_skyglow(directory / "night")
        sys.exit(0 if is_good else 1)


if __name__ == "__main__":
    main()
