#!/usr/bin/env python3
"""Compares frames of `starpipe simulate` with an independent computation.

    python3 scripts/check-simulator.py target/release/starpipe ../shared/sky2000/SKYMAP_SKY2000_V5R4.gz [CHECK...]

Takes the program and the SKY2000 catalogue; needs numpy and astropy. Star positions come from the
catalogue's columns, proper motion from astropy; projection, photometry, rotation and moonlight from
the published equations, implemented here a second time. Pixels are read from the FITS files. Prints
every value beside the expected one, and exits with 1 if one is off by more than its tolerance.
CHECK selects checks: positions flux dark flat pattern smear strays sky full.
"""

import csv
import gzip
import pathlib
import subprocess
import sys
import tempfile
import tomllib
import warnings

import astropy.units as u
import numpy as np
from astropy.coordinates import SkyCoord
from astropy.io import fits
from astropy.time import Time
from astropy.wcs import WCS

POSITION_TOLERANCE_PX = 0.01
FLUX_TOLERANCE = 1e-3
# Tolerance of means, variances and counts, in standard errors.
SIGMAS = 4.5


class Checks:
    """Runs the program, and records whether a check failed."""

    def __init__(self, program, catalog, directory):
        self.program, self.catalog, self.directory = program, catalog, pathlib.Path(directory)
        self.failed = False
        self.runs = 0
        preset = subprocess.run(
            [program, "camera", "new", "--preset", "nanosat-tracker"], check=True, capture_output=True
        )
        self.preset = preset.stdout.decode()
        self.stars = {}

    def compare(self, what, found, expected, tolerance):
        ok = bool(np.all(np.abs(np.asarray(found) - expected) <= tolerance))
        self.failed |= not ok
        print(f"  {what:58} {found:14.6g}  expected {expected:14.6g} ± {tolerance:.2g}  {'ok' if ok else 'WRONG'}")

    def camera(self, **keys):
        """A camera.toml with these keys changed, and its numbers."""
        lines = [line for line in self.preset.splitlines() if line.split(" = ")[0] not in keys]
        text = lambda value: str(value).lower() if isinstance(value, bool) else repr(value)
        lines += [f"{name} = {text(value)}" for name, value in keys.items()]
        self.runs += 1
        path = self.directory / f"camera-{self.runs}.toml"
        path.write_text("\n".join(lines) + "\n")
        return path, tomllib.loads(path.read_text())

    def frames(self, camera, *options, count=1):
        """Pixels and headers of the simulated frames, and the rows of their tables."""
        self.runs += 1
        out = self.directory / f"run-{self.runs}"
        command = [self.program, "simulate", "--camera", camera, "--catalog", self.catalog]
        command += ["--image", "fits", "--count", count, "--out", out, *options]
        made = subprocess.run([str(part) for part in command], capture_output=True, check=False)
        if made.returncode != 0:
            sys.exit(made.stderr.decode())
        result = []
        for path in sorted(out.glob("*.fits")):
            with fits.open(path) as file:
                pixels, header = file[0].data.astype(float), file[0].header.copy()
            table = path.with_suffix(".csv")
            rows = list(csv.DictReader(table.open(newline=""))) if table.exists() else []
            result.append((pixels, header, rows))
        return result

    def frame(self, camera, *options):
        return self.frames(camera, *options)[0]

    def star(self, number):
        """RA, Dec (degrees), proper motions (mas a year), V and B-V of the star "SKYMAP nnnnnnnn"."""
        if not self.stars:
            with gzip.open(self.catalog, "rt", encoding="latin-1") as lines:
                for line in lines:
                    if line[27:35].strip():
                        self.stars[int(line[27:35])] = line
        line = self.stars[int(number.removeprefix("SKYMAP "))]
        cut = lambda first, last: line[first - 1 : last].strip().replace(" ", "")
        value = lambda first, last: float(cut(first, last) or 0)
        ra = 15 * (value(119, 120) + value(121, 122) / 60 + value(123, 129) / 3600)
        dec = value(131, 132) + value(133, 134) / 60 + value(135, 140) / 3600
        dec = -dec if cut(130, 130) == "-" else dec
        pm_ra = 15e3 * value(150, 157) * np.cos(np.radians(dec))
        return ra, dec, pm_ra, 1e3 * value(158, 165), value(233, 238), value(259, 264)


# --- star positions -------------------------------------------------------------------------------


def matrix(ra_deg, dec_deg, roll_deg):
    """Rows: camera axes in ICRS, x right, y down, z out; up has the position angle `roll_deg`."""
    ra, dec, roll = np.radians([ra_deg, dec_deg, roll_deg])
    east = np.array([-np.sin(ra), np.cos(ra), 0])
    north = np.array([-np.sin(dec) * np.cos(ra), -np.sin(dec) * np.sin(ra), np.cos(dec)])
    up = np.cos(roll) * north + np.sin(roll) * east
    out = np.array([np.cos(dec) * np.cos(ra), np.cos(dec) * np.sin(ra), np.sin(dec)])
    # Seen from inside the sphere, east is to the left of north.
    right = np.sin(roll) * north - np.cos(roll) * east
    return np.array([right, -up, out])


class Lens:
    """The documented projection, from the numbers of a camera.toml."""

    def __init__(self, toml):
        pitch_mm = np.sqrt(toml["pitch_x_um"] * toml["pitch_y_um"]) / 1e3
        self.focal_px = toml["focal_length_mm"] / pitch_mm
        self.size = np.array([toml["width_px"], toml["height_px"]])
        self.radius = np.hypot(*self.size) / 2
        number = lambda key: toml.get(key, 0) / self.radius
        self.radial = [number(key) for key in ("distortion_px", "distortion5_px", "distortion7_px")]
        self.axis = self.radius * np.array([number("axis_x_px"), number("axis_y_px")])
        self.decentring = np.array([number("decentring_x_px"), number("decentring_y_px")])
        stretch, skew = number("stretch_px"), number("skew_px")
        self.stretched = np.array([[1 + stretch, skew], [skew, 1 - stretch]])
        self.mirrored = toml.get("mirrored", False)

    def observed(self, ideal):
        """Offset from the frame's centre of an ideal offset from the axis, in pixels."""
        r = ideal / self.radius
        square = np.sum(r * r, axis=-1, keepdims=True)
        third = self.decentring / 3
        along = (r @ third)[..., None]
        radial = 1 + sum(term * square ** (i + 1) for i, term in enumerate(self.radial))
        moved = radial * r + square * third + 2 * along * r
        return self.radius * moved @ self.stretched + self.axis

    def axes(self):
        """Rows: camera axes in those of the lens. The camera looks where the frame's centre does."""
        ideal = np.zeros(2)
        step = 1e-3

        def slope(at):
            moved = [self.observed(at + step * a) - self.observed(at - step * a) for a in np.eye(2)]
            return np.stack(moved, axis=-1) / (2 * step)

        for _ in range(50):
            ideal -= np.linalg.solve(slope(ideal), self.observed(ideal))
        out = np.array([*ideal, self.focal_px])
        out /= np.linalg.norm(out)
        # What moves the image along x alone and along y alone, and the right angle nearest to both.
        moves = np.vstack([np.linalg.inv(slope(ideal)), np.zeros(2)])
        moves -= np.outer(out, out @ moves)
        left, _, right = np.linalg.svd(moves, full_matrices=False)
        return np.vstack([(left @ right).T, out])

    def pixels(self, directions):
        """Pixels of unit vectors in camera axes."""
        directions = directions @ self.axes()
        ideal = self.focal_px * directions[..., :2] / directions[..., 2:]
        sign = np.array([-1 if self.mirrored else 1, 1])
        return (self.size - 1) / 2 + sign * self.observed(ideal)


def unit(ra_deg, dec_deg):
    ra, dec = np.radians(ra_deg), np.radians(dec_deg)
    return np.stack([np.cos(dec) * np.cos(ra), np.cos(dec) * np.sin(ra), np.sin(dec)], axis=-1)


def at_date(stars, date):
    """Directions (degrees) of rows of `Checks.star` at `date`, by astropy's space motion."""
    ra, dec, pm_ra, pm_dec = (np.array([star[i] for star in stars]) for i in range(4))
    there = SkyCoord(
        ra * u.deg,
        dec * u.deg,
        pm_ra_cosdec=pm_ra * u.mas / u.yr,
        pm_dec=pm_dec * u.mas / u.yr,
        distance=1 * u.kpc,
        obstime=Time(2000.0, format="jyear", scale="tt"),
    ).apply_space_motion(new_obstime=Time(date, scale="utc"))
    return there.ra.deg, there.dec.deg


def positions(checks):
    cases = [
        ("pinhole", {}, (83.8, -1.2, 33.0)),
        ("radial, outward", {"distortion_px": 40.0}, (266.4, -28.9, -120.0)),
        ("radial, inward, mirrored", {"distortion_px": -60.0, "mirrored": True}, (310.0, 40.0, 200.0)),
        (
            "radial of all orders",
            {"distortion_px": -45.0, "distortion5_px": 20.0, "distortion7_px": 9.0},
            (83.8, -1.2, 33.0),
        ),
        (
            "all of it, at the north pole",
            {"distortion_px": 25.0, "decentring_x_px": 6.0, "decentring_y_px": -9.0}
            | {"distortion5_px": -7.0, "distortion7_px": 5.0, "axis_x_px": 30.0, "axis_y_px": -21.0}
            | {"stretch_px": 5.0, "skew_px": -3.0},
            (120.0, 89.7, 75.0),
        ),
        (
            "all of it, mirrored, the south pole in the centre",
            {"distortion_px": -25.0, "decentring_x_px": -8.0, "decentring_y_px": 5.0, "mirrored": True},
            (0.0, -90.0, 10.0),
        ),
    ]
    date = "2026-11-21T12:00:00"
    for name, keys, (ra, dec, roll) in cases:
        camera, toml = checks.camera(**keys)
        where = ["--ra", ra, "--dec", dec, "--roll", roll, "--date", date + "Z"]
        _, header, rows = checks.frame(camera, *where)
        rows = [row for row in rows if row["kind"] == "star" and row["id"].startswith("SKYMAP ")]
        seen = np.array([[float(row["x"]), float(row["y"])] for row in rows])
        star_ra, star_dec = at_date([checks.star(row["id"]) for row in rows], date)
        print(f"positions: {name}, {len(rows)} stars")
        here = Lens(toml).pixels(unit(star_ra, star_dec) @ matrix(ra, dec, roll).T)
        off = np.max(np.hypot(*(here - seen).T))
        checks.compare("largest distance from the second projection (px)", off, 0, POSITION_TOLERANCE_PX)
        wcs = WCS(header)
        by_wcs = np.array(wcs.all_world2pix(star_ra, star_dec, 0, tolerance=1e-8, maxiter=200)).T
        off = np.max(np.hypot(*(by_wcs - seen).T))
        checks.compare("largest distance from astropy with the header (px)", off, 0, POSITION_TOLERANCE_PX)
        sky_ra, sky_dec = np.array([[float(row["ra_deg"]), float(row["dec_deg"])] for row in rows]).T
        off = np.max(np.linalg.norm(unit(sky_ra, sky_dec) - unit(star_ra, star_dec), axis=1))
        checks.compare("largest error of the table's directions (arcsec)", np.degrees(off) * 3600, 0, 0.01)


# --- flux -----------------------------------------------------------------------------------------


def photons(nm, temperature_k):
    """Photons / (s m^2 nm) of a black body of V = 0; 1005 / (s cm^2 angstrom) at 550 nm."""
    planck = lambda nm: nm**-4.0 / np.expm1(1.438776877e7 / (nm * temperature_k))
    return 1005e5 * planck(nm) / planck(550.0)


def electrons_of_mag_0(toml, temperature_k, transmission=lambda nm: 1.0):
    """Electrons a second of V = 0."""
    nm = np.linspace(toml["band_from_nm"], toml["band_to_nm"], 60001)
    curve = np.array(toml["quantum_efficiency"])
    efficiency = np.interp(nm, curve[:, 0], curve[:, 1])
    rate = photons(nm, temperature_k) * efficiency * toml["lens_transmission"] * transmission(nm)
    area_m2 = np.pi / 4 * (toml["aperture_mm"] / 1e3) ** 2
    return np.trapezoid(rate, nm) * area_m2


def ballesteros_k(bv):
    return 4600 * (1 / (0.92 * bv + 1.7) + 1 / (0.92 * bv + 0.62))


def kasten_young(z_deg):
    return 1 / (np.cos(np.radians(z_deg)) + 0.50572 * (96.07995 - z_deg) ** -1.6364)


# A detector without noise: only photon noise is left.
CLEAN = {
    "width_px": 400,
    "height_px": 300,
    "read_noise_e": 0.0,
    "dark_current_e_s": 0.0,
    "full_well_e": 1e12,
    "gain_e_per_adu": 1000.0,
    "bits": 32,
    "bias_adu": 0.0,
}
DARK_SKY = ["--sky-mag-arcsec2", 40]


def flux(checks):
    pointings = [("Spica", 201.2983, -11.1613), ("Vega", 279.2347, 38.7837), ("Procyon", 114.8255, 5.2250)]
    pointings += [("Arcturus", 213.9153, 19.1824), ("Aldebaran", 68.9802, 16.5093)]
    law = lambda nm: np.exp(-(0.009 * (nm * 1e-3) ** -4 + 0.223))
    grey = lambda nm: 10 ** (-0.4 * 0.25)
    for z_deg, options, zenith, vignetting in [
        (0, ["--extinction", 0], lambda nm: 1.0, 0.0),
        (50, [], law, 0.0),
        (30, ["--extinction", 0.25], grey, 0.6),
    ]:
        camera, toml = checks.camera(**CLEAN, vignetting=vignetting)
        lens = Lens(toml)
        print(f"flux: zenith distance {z_deg}°, {' '.join(map(str, options)) or 'the law of extinction'}, vignetting {vignetting}")
        for name, ra, dec in pointings:
            # Away from the centre, so that vignetting matters.
            turn = ["--ra", ra, "--dec", dec + (0.7 if vignetting else 0.0), "--roll", 30]
            deep = [*turn, *DARK_SKY, *options, "--exposure", 1000, "--zenith-distance", z_deg]
            pixels, header, rows = checks.frame(camera, *deep, "--faintest-vmag", 1.5)
            stars = [row for row in rows if row["kind"] == "star"]
            empty, _, none = checks.frame(camera, *deep, "--faintest-vmag", -5)
            assert len(stars) == 1 and not none, (name, stars)
            _, _, _, _, v, bv = checks.star(stars[0]["id"])
            airmass = kasten_young(z_deg)
            rate = electrons_of_mag_0(toml, ballesteros_k(bv), lambda nm, zenith=zenith, airmass=airmass: zenith(nm) ** airmass)
            x, y = float(stars[0]["x"]), float(stars[0]["y"])
            offset = np.hypot(*(np.array([x, y]) - (lens.size - 1) / 2)) / lens.radius
            expected = rate * 1000 * 10 ** (-0.4 * v) * (1 - vignetting * offset**2)
            found = np.sum(pixels - empty) * header["EGAIN"]
            what = f"{name}, V {v:.2f}, B-V {bv:+.2f}: light over that expected"
            checks.compare(what, found / expected, 1.0, FLUX_TOLERANCE)
            checks.compare("  its electrons in the table", float(stars[0]["electrons"]) / expected, 1.0, FLUX_TOLERANCE)
    camera, toml = checks.camera(**CLEAN)
    pixels, header, _ = checks.frame(
        camera, "--ra", 0, "--dec", 0, "--faintest-vmag", -5, "--sky-mag-arcsec2", 5, "--exposure", 10
    )
    arcsec2 = (np.degrees(toml["pitch_x_um"] / 1e3 / toml["focal_length_mm"]) * 3600) ** 2
    expected = electrons_of_mag_0(toml, 5800.0) * 10 * arcsec2 * 10 ** (-0.4 * 5)
    print("flux: the sky, 5 mag in a square arcsecond")
    checks.compare("light over that expected", pixels.mean() * header["EGAIN"] / expected, 1.0, FLUX_TOLERANCE)


# --- noise and pattern ----------------------------------------------------------------------------


def moments(checks, what, values, mean, variance):
    count = values.size
    checks.compare(f"{what}: mean (ADU)", values.mean(), mean, SIGMAS * np.sqrt(variance / count))
    excess = 3 + 1 / variance
    checks.compare(f"{what}: variance (ADU^2)", values.var(), variance, SIGMAS * variance * np.sqrt(excess / count))


def dark(checks):
    for exposure, rate, read_noise in [(0.1, 20.0, 2.0), (10.0, 50.0, 7.5), (0.001, 0.0, 12.0)]:
        keys = {"dark_current_e_s": rate, "read_noise_e": read_noise, "width_px": 800, "height_px": 600}
        camera, toml = checks.camera(**keys, bias_adu=100.0)
        gain = toml["gain_e_per_adu"]
        print(f"dark: {exposure} s, {rate} e/s, read noise {read_noise} e")
        pixels = np.array([frame[0] for frame in checks.frames(camera, "--dark", "--exposure", exposure, count=5)])
        mean = 100 + rate * exposure / gain
        moments(checks, "five frames", pixels, mean, (rate * exposure + read_noise**2) / gain**2 + 1 / 12)


def flat(checks):
    camera, toml = checks.camera(width_px=800, height_px=600, bias_adu=42.0)
    gain = toml["gain_e_per_adu"]
    for level_e in [0.5, 50.0, 3000.0]:
        print(f"flat: {level_e} e")
        pixels = np.array([frame[0] for frame in checks.frames(camera, "--flat", level_e, count=5)])
        light = level_e + toml["dark_current_e_s"] * 0.1
        moments(checks, "five frames", pixels, 42 + light / gain, (light + toml["read_noise_e"] ** 2) / gain**2 + 1 / 12)


def spread(checks, what, stack, expected, scale=1.0):
    """Standard deviation of the pixels of a stack's mean, corrected for its noise."""
    mean = stack.mean(axis=0)
    noise = stack.var(axis=0, ddof=1).mean() / len(stack)
    found = np.sqrt(mean.var() - noise) * scale
    total = mean.var() * scale**2
    checks.compare(what, found, expected, SIGMAS * total / expected / np.sqrt(2 * mean.size))


def stack(checks, camera, *options, count=40):
    return np.array([frame[0] for frame in checks.frames(camera, *options, count=count)])


def pattern(checks):
    size = {"width_px": 500, "height_px": 400}
    camera, toml = checks.camera(**size, response_sigma=0.03, dead_pixels_per_mpx=2000.0)
    gain, bias = toml["gain_e_per_adu"], toml["bias_adu"]
    print("pattern: response 3 %, 2000 dead pixels in a million")
    lit = stack(checks, camera, "--flat", 4000)
    is_dead = lit.mean(axis=0) < bias + 1000 / gain
    checks.compare("dead pixels", is_dead.sum(), 400, SIGMAS * np.sqrt(400))
    spread(checks, "response, standard deviation", lit[:, ~is_dead][:, :, None], 0.03, gain / 4000)
    camera, _ = checks.camera(**size, offset_sigma_adu=5.0)
    print("pattern: bias of pixels 5 ADU")
    spread(checks, "bias, standard deviation (ADU)", stack(checks, camera, "--dark"), 5.0)
    camera, _ = checks.camera(**size, column_sigma_adu=4.0)
    print("pattern: bias of columns 4 ADU")
    columns = stack(checks, camera, "--dark").mean(axis=(0, 1))
    checks.compare("columns, standard deviation (ADU)", columns.std(), 4.0, SIGMAS * 4.0 / np.sqrt(2 * 500))
    rate, exposure = 200.0, 2.0
    camera, _ = checks.camera(**size, dark_current_e_s=rate, dark_current_sigma=0.4)
    print("pattern: dark current of pixels 40 %")
    currents = stack(checks, camera, "--dark", "--exposure", exposure)
    # Kurtosis of a log-normal distribution.
    w = 1 + 0.4**2
    kurtosis = w**4 + 2 * w**3 + 3 * w**2 - 3
    mean = currents.mean(axis=0)
    noise = currents.var(axis=0, ddof=1).mean() / len(currents)
    found = np.sqrt(mean.var() - noise) * gain / (rate * exposure)
    checks.compare("dark current, standard deviation", found, 0.4, SIGMAS * 0.4 / 2 * np.sqrt((kurtosis - 1) / mean.size) * 1.2)
    checks.compare(
        "dark current, mean (e/s)", (mean.mean() - bias) * gain / exposure, rate, SIGMAS * rate * 0.4 / np.sqrt(mean.size)
    )
    camera, _ = checks.camera(**size, hot_pixels_per_mpx=5000.0, hot_pixel_e_s=800.0)
    print("pattern: 5000 hot pixels in a million, 800 e/s")
    mean = (stack(checks, camera, "--dark", "--exposure", 2).mean(axis=0) - bias) * gain / 2
    hot = mean[mean > 60] - 20
    share = np.exp(-40 / 800)
    checks.compare("those of more than 40 e/s", hot.size, 1000 * share, SIGMAS * np.sqrt(1000 * share))
    checks.compare("their mean current (e/s)", hot.mean(), 840, SIGMAS * 800 / np.sqrt(hot.size))


# --- motion ---------------------------------------------------------------------------------------


def trail_of(pixels, empty):
    """Centroid and covariance of the light of a star."""
    light = pixels - empty
    y, x = np.mgrid[: light.shape[0], : light.shape[1]]
    total = light.sum()
    middle = np.array([(light * x).sum(), (light * y).sum()]) / total
    dx, dy = x - middle[0], y - middle[1]
    xx, xy, yy = ((light * product).sum() / total for product in (dx * dx, dx * dy, dy * dy))
    return middle, np.array([[xx, xy], [xy, yy]])


def smear(checks):
    ra, dec, roll, exposure = 279.2347, 38.2, 25.0, 2.0
    for name, keys, rates in [
        ("about x", {}, (0.15, 0, 0)),
        ("about y", {}, (0, -0.2, 0)),
        ("about z", {}, (0, 0, 8.0)),
        ("about all, mirrored, distorted", {"mirrored": True, "distortion_px": 10.0}, (0.1, 0.15, -6.0)),
        ("at rest", {}, (0, 0, 0)),
    ]:
        camera, toml = checks.camera(**CLEAN | {"gain_e_per_adu": 1.0}, **keys)
        options = ["--ra", ra, "--dec", dec, "--roll", roll, *DARK_SKY, "--exposure", exposure]
        for axis, rate in zip("xyz", rates):
            options += [f"--rate-{axis}-deg-s", rate]
        pixels, _, rows = checks.frame(camera, *options, "--faintest-vmag", 1)
        empty, _, _ = checks.frame(camera, *options, "--faintest-vmag", -5)
        star = next(row for row in rows if row["kind"] == "star")
        # The camera turns about its own axes at the rate; directions turn the other way.
        direction = unit(*checks.star(star["id"])[:2]) @ matrix(ra, dec, roll).T
        path = []
        turn = -np.radians(rates)
        angle = np.linalg.norm(turn)
        axis = turn / angle if angle else np.array([0.0, 0.0, 1.0])
        for t in (np.arange(4000) + 0.5) / 4000 * exposure - exposure / 2:
            cos, sin = np.cos(angle * t), np.sin(angle * t)
            path.append(direction * cos + np.cross(axis, direction) * sin + axis * (axis @ direction) * (1 - cos))
        path = Lens(toml).pixels(np.array(path))
        print(f"smear: {name}, {np.sum(np.hypot(*np.diff(path, axis=0).T)):.2f} px")
        middle, covariance = trail_of(pixels, empty)
        expected = np.cov(path.T, bias=True) + np.eye(2) * (toml["spot_sigma_px"] ** 2 + 1 / 12)
        counts = (pixels - empty).sum()
        for i, axis_name in enumerate("xy"):
            error = SIGMAS * np.sqrt(expected[i, i] / counts)
            checks.compare(f"middle along {axis_name} (px)", middle[i], path.mean(axis=0)[i], max(error, 1e-3))
        for i, j, name_ij in [(0, 0, "xx"), (1, 1, "yy"), (0, 1, "xy")]:
            error = SIGMAS * np.sqrt(2 * expected[i, i] * expected[j, j] / counts)
            checks.compare(f"covariance {name_ij} (px^2)", covariance[i, j], expected[i, j], max(error, 2e-3))
        if angle and rates[2] == 0:
            along = np.linalg.eigh(covariance)
            length = np.sqrt(12 * (along[0][1] - toml["spot_sigma_px"] ** 2 - 1 / 12))
            checks.compare("length (px)", length, np.hypot(*(path[-1] - path[0])), 0.05)
    noise_of_smear(checks)


def noise_of_smear(checks):
    camera, toml = checks.camera(width_px=80, height_px=60, full_well_e=1e6, bits=16, gain_e_per_adu=0.5)
    options = ["--ra", 279.2347, "--dec", 38.7837, "--rate-y-deg-s", 1.0, "--faintest-vmag", 1, "--exposure", 0.1]
    options += ["--aperture-mm", 3]
    made = checks.frames(camera, *options, count=400)
    gain = toml["gain_e_per_adu"]
    fluxes = np.array([(frame - toml["bias_adu"]).sum() * gain for frame, _, _ in made])
    dark_e = toml["dark_current_e_s"] * 0.1
    arcsec2 = (np.degrees(toml["pitch_x_um"] / 1e3 / toml["focal_length_mm"]) * 3600) ** 2
    sky = electrons_of_mag_0(toml | {"aperture_mm": 3}, 5800.0) * 0.1 * arcsec2 * 10 ** (-0.4 * 21)
    star = float(made[0][2][0]["electrons"])
    pixels = 80 * 60
    mean = star + pixels * (sky + dark_e)
    variance = mean + pixels * (toml["read_noise_e"] ** 2 + gain**2 / 12)
    print(f"smear: noise of a star of {star:.0f} e along 11 px, 400 frames")
    checks.compare("light (e)", fluxes.mean(), mean, SIGMAS * np.sqrt(variance / 400))
    checks.compare("variance (e^2)", fluxes.var(ddof=1), variance, SIGMAS * variance * np.sqrt(2 / 400))


# --- trails and cosmic rays -----------------------------------------------------------------------


def strays(checks):
    exposure = 0.5
    camera, toml = checks.camera(**CLEAN | {"gain_e_per_adu": 0.01, "width_px": 800, "height_px": 600})
    lens = Lens(toml)
    options = ["--ra", 10, "--dec", 10, "--faintest-vmag", -5, *DARK_SKY, "--exposure", exposure]
    made = checks.frames(
        camera, *options, "--trails", 1, "--trail-vmag", 0, "--trail-rate-deg-s", 1, "--extinction", 0, count=60
    )
    lengths, lights, inside = [], [], 0
    for pixels, header, rows in made:
        trails = [row for row in rows if row["kind"] == "trail"]
        inside += len(trails)
        ends = [[float(t[key]) for key in ("x", "y", "x_end", "y_end")] for t in trails]
        lengths += [np.hypot(e[2] - e[0], e[3] - e[1]) for e in ends]
        # Trails that are entirely on the frame leave all their light.
        whole = lambda e: all(15 < e[i] < lens.size[i % 2] - 15 for i in range(4))
        if trails and all(map(whole, ends)):
            lights.append(pixels.sum() * header["EGAIN"] / len(trails))
    expected = lens.focal_px * np.radians(1.0 * exposure)
    light = electrons_of_mag_0(toml, 5800.0) * exposure
    print(f"strays: trails at 1°/s in {exposure} s")
    checks.compare("trails on 60 frames", inside, 60, SIGMAS * np.sqrt(60))
    checks.compare("shortest (px)", min(lengths), expected, 0.01)
    checks.compare("longest (px)", max(lengths), expected, 0.01)
    checks.compare(f"light of {len(lights)} trails over that expected", np.mean(lights) / light, 1.0, FLUX_TOLERANCE)
    per_px = light / expected
    for pixels, header, rows in made:
        trails = [row for row in rows if row["kind"] == "trail"]
        if len(trails) == 1:
            row = trails[0]
            from_, to = ([float(row[x]), float(row[y])] for x, y in (("x", "y"), ("x_end", "y_end")))
            middle = (np.array(from_) + to) / 2
            along = (np.array(to) - from_) / expected
            if not all(40 < middle[i] < lens.size[i] - 40 for i in range(2)):
                continue
            y, x = np.mgrid[: pixels.shape[0], : pixels.shape[1]]
            s = (x - middle[0]) * along[0] + (y - middle[1]) * along[1]
            t = (y - middle[1]) * along[0] - (x - middle[0]) * along[1]
            part = pixels[(np.abs(s) < 20) & (np.abs(t) < 12)].sum() * header["EGAIN"] / 40
            checks.compare("light on a px of one of them (e)", part, per_px, 0.03 * per_px)
            break

    camera, toml = checks.camera(**CLEAN | {"gain_e_per_adu": 1.0, "width_px": 800, "height_px": 600})
    made = checks.frames(camera, *options, "--cosmic-rays-cm2-s", 2000, count=60)
    area = 800 * 600 * (2.2e-4) ** 2
    rays = [float(row["electrons"]) for _, _, rows in made for row in rows if row["kind"] == "cosmic_ray"]
    mean = 2000 * area * exposure * 60
    print(f"strays: cosmic rays, {len(rays)} on 60 frames")
    checks.compare("their number", len(rays), mean, SIGMAS * np.sqrt(mean))
    # Mean path of 1/cos, at most 100, over a flux proportional to cos: 1.99 depths of 10 um,
    # 80 e/um each.
    checks.compare("their mean charge (e)", np.mean(rays), 1592, SIGMAS * np.std(rays) / np.sqrt(len(rays)))
    collected = sum(frame[0].sum() for frame in made)
    lost = 1 - collected / sum(rays)
    checks.compare("part of their charge beyond the border", lost, 0.0, 0.01)


# --- sky ------------------------------------------------------------------------------------------


def krisciunas_schaefer(rho_deg, phase_deg, k, moon_z_deg, z_deg):
    """Moonlight in nanolamberts: 1991, PASP 103, 1033, eqs. 3, 15, 20, 21."""
    airmass = lambda z: (1 - 0.96 * np.sin(np.radians(z)) ** 2) ** -0.5
    moon = 10 ** (-0.4 * (3.84 + 0.026 * abs(phase_deg) + 4e-9 * phase_deg**4))
    scattering = 10**5.36 * (1.06 + np.cos(np.radians(rho_deg)) ** 2) + 10 ** (6.15 - rho_deg / 40)
    return scattering * moon * 10 ** (-0.4 * k * airmass(moon_z_deg)) * (1 - 10 ** (-0.4 * k * airmass(z_deg)))


def sky(checks):
    empty = ["--ra", 10, "--dec", 10, "--faintest-vmag", -5, "--exposure", 1e5]
    for mirrored in [False, True]:
        camera, toml = checks.camera(**CLEAN | {"width_px": 640, "height_px": 480, "focal_length_mm": 2.0}, mirrored=mirrored)
        even = checks.frame(camera, *empty, "--sky-mag-arcsec2", 20, "--extinction", 0.2)[0].mean()
        moonlit, _, _ = checks.frame(
            camera, *empty, "--sky-mag-arcsec2", 20, "--extinction", 0.2, "--zenith-distance", 30,
            "--moon-distance-deg", 50, "--moon-direction-deg", 70, "--moon-phase-deg", 40, "--moon-zenith-distance-deg", 55,
        )
        print(f"sky: moonlight{', mirrored' if mirrored else ''}")
        lens = Lens(toml)
        way = np.radians(70)
        # To the right and up in the image.
        moon = np.array([np.sin(way) * np.sin(np.radians(50)), -np.cos(way) * np.sin(np.radians(50)), np.cos(np.radians(50))])
        dark_nl = 34.08 * np.exp(20.7233 - 0.92104 * 20)
        for x, y in [(0, 0), (319, 239), (630, 100), (200, 470)]:
            offset = (np.array([x, y]) - (lens.size - 1) / 2) / lens.focal_px
            there = np.array([*offset, 1]) / np.hypot(np.hypot(*offset), 1)
            rho = np.degrees(np.arccos(there @ moon))
            expected = 1 + krisciunas_schaefer(rho, 40, 0.2, 55, 30) / dark_nl
            checks.compare(f"at ({x}, {y}), {rho:.1f}° from the Moon, over the dark sky", moonlit[y, x] / even, expected, 2e-3 * expected)

    camera, toml = checks.camera(**CLEAN)
    even = checks.frame(camera, *empty, "--sky-mag-arcsec2", 15)[0].mean()
    tilted, _, _ = checks.frame(camera, *empty, "--sky-mag-arcsec2", 15, "--sky-gradient", 0.4, "--sky-gradient-deg", 90)
    print("sky: gradient of 0.4 to the right")
    step = 0.4 / 200
    checks.compare("last column", tilted[:, -1].mean() / even, 1.4 - step / 2, 1e-3)
    checks.compare("first column", tilted[:, 0].mean() / even, 0.6 + step / 2, 1e-3)

    stars = checks.directory / "list.csv"
    places = [(x, y) for y in range(20, 300, 40) for x in range(20, 400, 40)]
    stars.write_text("x,y,vmag\n" + "".join(f"{x},{y},3\n" for x, y in places))
    clouds = ["--cloud-mag", 1.5, "--cloud-size-px", 150, "--exposure", 1e5, "--sky-mag-arcsec2", 15, "--seed", 3]
    _, _, rows = checks.frame(camera, "--stars", stars, *clouds)
    stars.write_text("x,y,vmag\n1,1,30\n")
    light, _, _ = checks.frame(camera, "--stars", stars, *clouds, "--cloud-light", 1)
    clear = max(float(row["electrons"]) for row in rows)
    off = [
        float(row["electrons"]) / clear
        - 10 ** (-0.4 * 1.5 * (light[round(float(row["y"])), round(float(row["x"]))] / even - 1))
        for row in rows
    ]
    print("sky: clouds of 1.5 mag that add their own light")
    checks.compare("largest difference of the stars' dimming from the sky's", np.max(np.abs(off)), 0, 0.01)
    checks.compare("part of the sky that is covered", np.mean(light > 1.0001 * even), 0.5, 0.3)


def full(checks):
    well = 6460.0
    keys = CLEAN | {"full_well_e": well, "gain_e_per_adu": 0.5, "bits": 16, "bias_adu": 100.0}
    options = ["--ra", 279.2347, "--dec", 38.7837, "--faintest-vmag", 1, *DARK_SKY, "--exposure", 0.2]
    camera, _ = checks.camera(**keys)
    plain, header, rows = checks.frame(camera, *options)
    star = float(rows[0]["electrons"])
    print(f"full: a star of {star:.0f} e, wells of {well:.0f} e")
    checks.compare("highest level (ADU)", plain.max(), 100 + well / 0.5, 0)
    checks.compare("saturation in the header (ADU)", header["SATURATE"], 100 + well / 0.5, 0)
    camera, _ = checks.camera(**keys, blooming=1.0)
    bloomed, _, _ = checks.frame(camera, *options)
    checks.compare("light with blooming over all", (bloomed - 100).sum() * 0.5 / star, 1.0, SIGMAS / np.sqrt(star))
    lit = np.argwhere(bloomed >= bloomed.max())
    rows_lit, columns_lit = np.ptp(lit[:, 0]) + 1, np.ptp(lit[:, 1]) + 1
    checks.compare("full pixels along the column for each along the row > 1", float(rows_lit > columns_lit), 1.0, 0)
    camera, _ = checks.camera(**keys | {"bits": 12})
    clipped, header, _ = checks.frame(camera, *options)
    checks.compare("highest level of 12 bits (ADU)", clipped.max(), 4095, 0)


CHECKS = [positions, flux, dark, flat, pattern, smear, strays, sky, full]


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    wanted = sys.argv[3:] or [check.__name__ for check in CHECKS]
    unknown = set(wanted) - {check.__name__ for check in CHECKS}
    if unknown:
        sys.exit(f"{', '.join(sorted(unknown))}: no such check")
    warnings.filterwarnings("ignore", message="'datfix' made the change 'Set MJD-OBS")
    warnings.filterwarnings("ignore", message=".*dubious year")
    with tempfile.TemporaryDirectory() as directory:
        checks = Checks(sys.argv[1], sys.argv[2], directory)
        for check in CHECKS:
            if check.__name__ in wanted:
                check(checks)
    sys.exit(1 if checks.failed else 0)


main()
