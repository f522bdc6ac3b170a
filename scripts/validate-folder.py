#!/usr/bin/env python3
"""Draws a folder as programs for all-sky cameras leave it, 200 files of ten kinds, runs `night`, `sky`,
`process --out-parquet`, `archive` and `calibrate` over it, and compares what they count with the truth.

    scripts/validate-folder.py target/release/starpipe [--frames 40] [--keep DIR]

Needs numpy, astropy and Pillow. Frames are simulated by starpipe, stretched to 8 bits and saved as JPEG
with local times in their names; all else is drawn here. Exits with 1 where a count is not the truth.
"""

import argparse
import collections
import datetime
import json
import math
import pathlib
import shutil
import subprocess
import sys
import tempfile

import numpy as np
from astropy.io import fits
from PIL import Image

SITE = "50,10,300"
LAT_DEG, LON_DEG = 50.0, 10.0
UTC_OFFSET_H = 1
# Local time of the first frame of the night.
START = datetime.datetime(2026, 1, 15, 20, 0)
SIDE_PX = 560
CAMERA = {
    "name": '"all-sky camera"',
    "width_px": SIDE_PX,
    "height_px": SIDE_PX,
    "pitch_x_um": 6,
    "pitch_y_um": 6,
    "focal_length_mm": SIDE_PX / 2 / math.radians(88) * 6e-3,
    "aperture_mm": 1.4,
    "lens_transmission": 0.87,
    "quantum_efficiency": 0.7,
    "band_from_nm": 400,
    "band_to_nm": 800,
    "read_noise_e": 5,
    "dark_current_e_s": 0.1,
    "full_well_e": 60000,
    "gain_e_per_adu": 1,
    "bits": 16,
    "bias_adu": 100,
    "spot_sigma_px": 0.8,
    "projection": '"equidistant"',
    "field_radius_deg": 88,
}
# The frames' exposures in seconds, from change to change.
EXPOSURES_S = (20, 30, 15)
RANDOM = np.random.default_rng(7)


def zenith_ra_deg(local):
    """Right ascension of the zenith, to 0.01°."""
    utc = local - datetime.timedelta(hours=UTC_OFFSET_H)
    days = (utc - datetime.datetime(2000, 1, 1, 12)) / datetime.timedelta(days=1)
    return (280.46062 + 360.98564737 * days + LON_DEG) % 360


def jpeg(path, picture):
    Image.fromarray(np.clip(picture, 0, 255).astype(np.uint8)).save(path, quality=95)


def disk():
    """The distance from the middle of the frame over the radius of the lens's circle."""
    y, x = np.mgrid[:SIDE_PX, :SIDE_PX] - (SIDE_PX - 1) / 2
    return np.hypot(x, y) / (SIDE_PX / 2)


def noise(sigma):
    return RANDOM.normal(0, sigma, (SIDE_PX, SIDE_PX))


class Folder:
    """The folder, and what each of its files is."""

    def __init__(self, starpipe, work):
        self.starpipe, self.work = starpipe, work
        self.root = work / "20260115"
        self.root.mkdir()
        self.kinds = {}

    def add(self, kind, name):
        self.kinds[name] = kind
        return self.root / name

    def frames(self, count):
        camera = self.work / "camera.toml"
        camera.write_text("".join(f"{key} = {value}\n" for key, value in CAMERA.items()))
        raw = self.work / "raw.fits"
        pictures, full = [], None
        for number in range(count):
            local = START + datetime.timedelta(minutes=2 * number)
            utc = local - datetime.timedelta(hours=UTC_OFFSET_H)
            exposure_s = EXPOSURES_S[len(EXPOSURES_S) * number // count]
            command = [
                self.starpipe, "simulate", f"--camera={camera}", f"--exposure={exposure_s}", "--by-altitude=1",
                "--extinction=0.17", "--sky-mag-arcsec2=20.5", f"--seed={number + 1}", f"--site={SITE}",
                f"--date={utc:%Y-%m-%dT%H:%M:%SZ}", f"--ra={zenith_ra_deg(local):.3f}", f"--dec={LAT_DEG}",
                f"--out={raw}", "--force",
            ]  # fmt: skip
            subprocess.run(command, check=True, capture_output=True)
            # Rows of FITS images are stored bottom-up.
            light = np.maximum(fits.getdata(raw)[::-1].astype(float) - 100, 0)
            # The stretch of the first frame is that of all.
            full = full or 16 * np.median(light[disk() < 0.8])
            picture = 255 * np.sqrt(light / full)
            jpeg(self.add("frame", f"image-{local:%Y%m%d%H%M%S}.jpg"), picture)
            pictures.append(picture)
        return pictures

    def day_and_twilight(self, days, twilights):
        radius = disk()
        for number in range(days):
            local = datetime.datetime(2026, 1, 15, 10, 0) + datetime.timedelta(minutes=10 * number)
            sun = np.exp(-((radius - 0.8) ** 2) / 0.002)
            sky = np.where(radius < 1, 150 + 40 * radius + 80 * sun, 4)
            jpeg(self.add("day", f"image-{local:%Y%m%d%H%M%S}.jpg"), sky + noise(3))
        for number in range(twilights):
            # The Sun is 3° to 8° below the horizon.
            local = datetime.datetime(2026, 1, 15, 17, 10) + datetime.timedelta(minutes=3 * number)
            sky = np.where(radius < 1, 40 + 60 * radius, 4)
            jpeg(self.add("twilight", f"image-{local:%Y%m%d%H%M%S}.jpg"), sky + noise(3))

    def products(self, pictures, names):
        for name, picture in zip(names, pictures, strict=True):
            small = Image.fromarray(np.clip(picture, 0, 255).astype(np.uint8)).resize((100, 100))
            small.save(self.add("thumbnail", f"thumb_{name.removeprefix('image-')}"))
        columns = [np.repeat(picture[:, SIDE_PX // 2 : SIDE_PX // 2 + 1], 3, axis=1) for picture in pictures]
        jpeg(self.add("keogram", "keogram-20260115.jpg"), np.hstack(columns))
        # One that its name does not tell.
        jpeg(self.add("keogram", "strip.jpg"), np.hstack(columns)[::-1, : SIDE_PX // 4])
        trails = self.trails()
        jpeg(self.add("startrails", "startrails-20260115.jpg"), trails)
        # One that its name does not tell.
        jpeg(self.add("startrails", "image-20260116070000.jpg"), np.flipud(trails))
        shutil.copy(self.root / names[-1], self.add("copy", "image.jpg"))

    def trails(self):
        """Arcs about a pole."""
        y, x = np.mgrid[:SIDE_PX, :SIDE_PX].astype(float)
        radius, angle = np.hypot(x - 280, y - 150), np.arctan2(y - 150, x - 280)
        picture = np.where(disk() < 1, 40.0, 4.0)
        for _ in range(300):
            own, begin = RANDOM.uniform(8, 500), RANDOM.uniform(-np.pi, np.pi)
            is_arc = (angle - begin) % (2 * np.pi) < 1.2
            picture += RANDOM.uniform(40, 200) * np.exp(-((radius - own) ** 2) / 2) * is_arc * (disk() < 1)
        return picture + noise(2)

    def calibration(self, count):
        for number in range(count):
            dark = noise(2) + 6
            dark[RANDOM.integers(0, SIDE_PX, 60), RANDOM.integers(0, SIDE_PX, 60)] = 200
            jpeg(self.add("dark", f"image-202601160800{number:02}.jpg"), dark)
            header = fits.Header([("IMAGETYP", "Dark Frame"), ("EXPTIME", 20.0)])
            levels = np.clip(dark, 0, None).astype(np.uint16)
            fits.PrimaryHDU(levels, header).writeto(self.add("calibration", f"d{number}.fits"))

    def others(self, count):
        movie = b"\0\0\0\x18ftypmp42\0\0\0\0mp42isom" + bytes(500)
        contents = {
            "video": [("allsky-{}.mp4", movie), ("mini-{}.webm", b"\x1a\x45\xdf\xa3" + bytes(99)), ("new-{}.mp4", b"")],
            "no_image": [("log-{}.txt", b"exposure 20 s\n"), ("config-{}.json", b"{}"), ("sky-{}.db", b"SQLite format 3\0")],
            "other_format": [("web-{}.webp", b"RIFF\x24\0\0\0WEBPVP8 " + bytes(40))],
            "hidden": [("._image-{}.jpg", b"\0\5\x16\7"), (".cache-{}", b"")],
            "unread": [("cut-{}.jpg", b"\xff\xd8\xff\xe0\0\x10JFIF"), ("empty-{}.jpg", b""), ("text-{}.jpg", b"not found\n")],
        }  # fmt: skip
        for number in range(count):
            kind = list(contents)[number % len(contents)]
            name, content = contents[kind][number // len(contents) % len(contents[kind])]
            self.add(kind, name.format(number)).write_bytes(content)

    def draw(self, frames):
        pictures = self.frames(frames)
        names = list(self.kinds)
        self.day_and_twilight(max(frames // 4, 2), max(frames // 10, 2))
        self.products(pictures, names)
        self.calibration(max(frames // 12, 2))
        self.others(max(200 - len(self.kinds), 5))
        return self

    def count(self, *kinds):
        return sum(kind in kinds for kind in self.kinds.values())


def run(starpipe, *arguments):
    command = [starpipe, *(str(argument) for argument in arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


class Check:
    """Compares, and remembers whether all was as it should be."""

    def __init__(self):
        self.is_well = True

    def same(self, what, found, truth):
        self.is_well &= found == truth
        print(f"| {what} | {truth} | {found} | {'' if found == truth else 'differs'} |")


def check_night(check, starpipe, folder, out):
    options = [f"--site={SITE}", f"--camera={folder.work / 'camera.toml'}", f"--utc-offset={UTC_OFFSET_H}"]
    ran = run(starpipe, "night", "--format=json", *options, f"--out={out}", folder.root)
    print(ran.stderr, file=sys.stderr)
    check.same("night: exit status", ran.returncode, 1)
    night = json.loads(ran.stdout)
    found = {entry["kind"]: entry["count"] for entry in night["passed_over"]}
    kinds = collections.Counter(folder.kinds.values())
    for kind in sorted({*kinds, *found} - {"frame", "twilight", "unread"}):
        check.same(f"night: {kind}", found.get(kind, 0), kinds[kind])
    check.same("night: frames", night["frames"], folder.count("frame", "twilight", "unread"))
    check.same("night: unread", night["unread"], folder.count("unread"))
    rows = [json.loads(line) for line in (out / "night.jsonl").read_text().splitlines()]
    of_night = [row for row in rows if folder.kinds.get(pathlib.Path(row["frame"]).name) == "frame"]
    check.same("night: frames of the night that are identified",
               sum(row["status"] == "identified" for row in of_night), len(of_night))  # fmt: skip
    wrong = [entry["kind"] for entry in night["passed_over"]
             for name in entry["files"] if folder.kinds[pathlib.Path(name).name] != entry["kind"]]  # fmt: skip
    check.same("night: files of another kind than is said", len(wrong), 0)
    again = run(starpipe, "night", "--format=json", *options, f"--out={out}", folder.root)
    check.same("night: the same from what is there", again.stdout == ran.stdout, True)


def check_others(check, starpipe, folder, work):
    # Star trails, frames of the day and darks that only their pixels tell are read, and have no stars.
    others = folder.count("day", "dark", "twilight") + 1
    camera = f"--camera={work / 'camera.toml'}"
    ran = run(starpipe, "sky", "--format=json", f"--site={SITE}", camera, folder.root)
    reports = [json.loads(line) for line in ran.stdout.splitlines()]
    found = collections.Counter(report["status"] for report in reports)
    # Strips and copies are of the frames of any camera.
    check.same("sky: identified", found["identified"], folder.count("frame", "copy"))
    check.same("sky: not identified", found["not_identified"], others + 1)
    check.same("sky: exit status", ran.returncode, 1)
    archive = work / "archive"
    ran = run(starpipe, "process", camera, f"--out-parquet={archive}", folder.root)
    print(ran.stderr, file=sys.stderr)
    status = json.loads(run(starpipe, "archive", "status", "--format=json", archive).stdout)
    check.same("archive: identified", status["identified"], folder.count("frame", "copy"))
    check.same("archive: not identified", status["not_identified"], others + 1)
    check.same("archive: unread", len(status["unread"]), folder.count("unread"))
    ran = run(starpipe, "calibrate", "--format=json", folder.root, "-o", work / "lens.toml")
    check.same("calibrate: a lens is measured", (work / "lens.toml").exists(), True)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("starpipe")
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--keep", type=pathlib.Path, help="directory for the folder and the results")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        work = arguments.keep or pathlib.Path(temporary)
        work.mkdir(parents=True, exist_ok=True)
        folder = Folder(arguments.starpipe, work).draw(arguments.frames)
        print(f"{len(folder.kinds)} files of {len(set(folder.kinds.values()))} kinds\n")
        print("| what | truth | found | |\n|---|---|---|---|")
        check = Check()
        check_night(check, arguments.starpipe, folder, work / "night")
        check_others(check, arguments.starpipe, folder, work)
    sys.exit(0 if check.is_well else 1)


if __name__ == "__main__":
    main()
