#!/usr/bin/env python3
"""Draws frames of all-sky cameras with code that shares nothing with the program.

    scripts/all_sky.py SKYMAP_SKY2000_V5R4.gz OUT [--seed 1] [--lens equisolid] [--size 900] [--bits 16] ...

Places of stars, refraction, aberration and the Moon are those of astropy (ERFA). The lens, the spots, the air,
the light of the sky, clouds, noise and gray levels are drawn here. It needs numpy, scipy, astropy and Pillow.

It writes OUT.fits (16 bits), OUT.png (8 bits) or OUT.jpg (`--jpeg QUALITY`), OUT.json with the truth, and
OUT.npz with maps: `mag_arcsec2`, the light of the sky as seen from the ground, and `cloud_mag`, the extinction by
clouds, both NaN where no sky is; `altitude_deg`, `azimuth_deg`; and the drawn stars `x`, `y`, `vmag`, `electrons`.
What an option does not give is random.
"""

import argparse
import functools
import gzip
import json
import math
import pathlib
import subprocess

import numpy as np
from PIL import Image
from scipy import ndimage, special

ARCSEC_PER_RAD = math.degrees(1) * 3600
# Distance from the axis over the focal length, and its derivative.
LENSES = {
    "equidistant": (lambda t: t, lambda t: np.ones_like(t)),
    "equisolid": (lambda t: 2 * np.sin(t / 2), lambda t: np.cos(t / 2)),
    "stereographic": (lambda t: 2 * np.tan(t / 2), lambda t: 1 / np.cos(t / 2) ** 2),
    "orthographic": (np.sin, np.cos),
}
FAINTEST_VMAG = 9.5
TONES = ("linear", "gamma", "srgb", "stretched")
NUMBERS = (
    "latitude_deg", "longitude_deg", "tilt_deg", "cloud_cover", "cloud_mag", "cloud_light", "coma_px", "wings", "skyline_deg",
    "exposure_s", "zenith_mag_arcsec2", "spot_sigma_px",
)


def read_catalog(path):
    """Places (degrees, J2000.0), proper motions (arcsec a year, in right ascension times cos dec), V, B−V.

    Columns: Myers et al. (2001), V/109 at the CDS."""
    rows = []
    number = lambda text: float(text.replace(" ", "") or 0)
    with gzip.open(path, "rt", encoding="latin1") as lines:
        for line in lines:
            vmag = line[232:238].strip() or line[238:243].strip()
            if not vmag or float(vmag) > FAINTEST_VMAG:
                continue
            ra = 15 * (number(line[118:120]) + number(line[120:122]) / 60 + number(line[122:129]) / 3600)
            dec = number(line[130:132]) + number(line[132:134]) / 60 + number(line[134:140]) / 3600
            dec = -dec if line[129] == "-" else dec
            motion = 15 * number(line[149:157]) * math.cos(math.radians(dec)), number(line[157:165])
            color = line[258:264].strip()
            rows.append((ra, dec, *motion, float(vmag), float(color) if color else 0.6))
    return np.array(rows).T


def rotation(axis, angle_rad):
    """Turns vectors by an angle about an axis."""
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle_rad) * cross + (1 - math.cos(angle_rad)) * cross @ cross


def quaternion(matrix):
    """[w, x, y, z] of a rotation, w ≥ 0."""
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_matrix(matrix).as_quat()
    return [float(sign * part) for sign in [1 if w >= 0 else -1] for part in (w, x, y, z)]


class Place:
    """Where and when: turns catalog directions into observed ones. Axes of the horizon: north, east, up."""

    def __init__(self, latitude_deg, longitude_deg, height_m, time):
        from astropy import units as u
        from astropy.coordinates import AltAz, EarthLocation

        self.time = time
        self.site = (latitude_deg, longitude_deg, height_m)
        self.location = EarthLocation(lon=longitude_deg * u.deg, lat=latitude_deg * u.deg, height=height_m * u.m)
        # The standard atmosphere at that height.
        pressure = 1013.25 * (1 - 2.25577e-5 * height_m) ** 5.25588
        air = {"pressure": pressure * u.hPa, "temperature": (15 - 0.0065 * height_m) * u.deg_C}
        self.horizon = AltAz(
            obstime=time, location=self.location, relative_humidity=0.5, obswl=0.55 * u.micron, **air
        )
        self.airless = AltAz(obstime=time, location=self.location)

    def vectors(self, coordinates):
        """Unit vectors of the horizon from coordinates of astropy."""
        horizontal = coordinates.transform_to(self.horizon)
        return from_angles(horizontal.az.rad, horizontal.alt.rad)

    def icrs_to_horizon(self):
        """The rotation of the axes alone, without aberration and refraction."""
        import erfa

        time = self.time
        matrix = erfa.c2t06a(time.tt.jd1, time.tt.jd2, time.ut1.jd1, time.ut1.jd2, 0.0, 0.0)
        phi, lam = (math.radians(angle) for angle in self.site[:2])
        north = [-math.sin(phi) * math.cos(lam), -math.sin(phi) * math.sin(lam), math.cos(phi)]
        east = [-math.sin(lam), math.cos(lam), 0]
        up = [math.cos(phi) * math.cos(lam), math.cos(phi) * math.sin(lam), math.sin(phi)]
        return np.array([north, east, up]) @ matrix

    def catalog_direction(self, vector):
        """The ICRS direction that is observed there."""
        from astropy import units as u
        from astropy.coordinates import SkyCoord

        azimuth, altitude = np.arctan2(vector[1], vector[0]), np.arcsin(vector[2])
        observed = SkyCoord(az=azimuth * u.rad, alt=altitude * u.rad, frame=self.horizon).icrs
        return from_angles(observed.ra.rad, observed.dec.rad)


def from_angles(longitude_rad, latitude_rad):
    """Unit vectors, last axis x, y, z."""
    cos = np.cos(latitude_rad)
    return np.stack([cos * np.cos(longitude_rad), cos * np.sin(longitude_rad), np.sin(latitude_rad)], axis=-1)


def observed_stars(catalog, place):
    """Observed directions of the stars at the place and time."""
    from astropy import units as u
    from astropy.coordinates import SkyCoord

    ra, dec, motion_ra, motion_dec = catalog[:4]
    years = place.time.jyear - 2000
    dec_now = dec + motion_dec * years / 3600
    ra_now = ra + motion_ra * years / 3600 / np.cos(np.radians(dec))
    return place.vectors(SkyCoord(ra_now * u.deg, np.clip(dec_now, -90, 90) * u.deg))


class Lens:
    """Camera directions to pixels, and back by a table."""

    def __init__(self, kind, focal_px, axis_px, terms, field_rad, stretch):
        self.form, self.slope = LENSES[kind]
        self.kind, self.focal_px, self.axis_px, self.terms = kind, focal_px, axis_px, terms
        self.field_rad, self.stretch = field_rad, stretch
        self.angles = np.linspace(0, field_rad, 4000)
        self.radii_px = self.radius_px(self.angles)

    def radius_px(self, angle):
        cubic, quintic = self.terms
        share = angle / self.field_rad
        return self.focal_px * self.form(angle) * (1 + cubic * share**2 + quintic * share**4)

    def pixels(self, vectors):
        """x, y and the angle from the axis."""
        angle = np.arctan2(np.hypot(vectors[..., 0], vectors[..., 1]), vectors[..., 2])
        phase = np.arctan2(vectors[..., 1], vectors[..., 0])
        radius = self.radius_px(angle)
        x, y = radius * np.cos(phase), radius * np.sin(phase)
        return self.axis_px[0] + x * (1 + self.stretch), self.axis_px[1] + y * (1 - self.stretch), angle

    def vectors(self, x, y):
        """Camera directions of pixels, and whether the lens sees anything there."""
        dx, dy = (x - self.axis_px[0]) / (1 + self.stretch), (y - self.axis_px[1]) / (1 - self.stretch)
        radius = np.hypot(dx, dy)
        angle = np.interp(radius, self.radii_px, self.angles)
        phase = np.arctan2(dy, dx)
        sine = np.sin(angle)
        vectors = np.stack([sine * np.cos(phase), sine * np.sin(phase), np.cos(angle)], axis=-1)
        return vectors, radius <= self.radii_px[-1]


def pixel_solid_angles(lens, x, y):
    """Solid angle of pixels in square arcseconds: dΩ = sin θ dθ dφ, over the area r dr dφ."""
    radius = np.hypot((x - lens.axis_px[0]) / (1 + lens.stretch), (y - lens.axis_px[1]) / (1 - lens.stretch))
    slope = np.gradient(lens.radii_px, lens.angles)
    ratio = np.sin(lens.angles[1:]) / (lens.radii_px[1:] * slope[1:])
    return np.interp(radius, lens.radii_px[1:], ratio) * ARCSEC_PER_RAD**2 / (1 - lens.stretch**2)


def airmass(altitude_rad):
    """Pickering (2002)."""
    degrees = np.degrees(np.maximum(altitude_rad, 0))
    return 1 / np.sin(np.radians(degrees + 244 / (165 + 47 * degrees**1.1)))


def fractal(pick, size, slope):
    """A random field with a spectrum of a power law, mean 0 and standard deviation 1."""
    frequency = np.hypot(*np.meshgrid(np.fft.fftfreq(size), np.fft.rfftfreq(size), indexing="ij"))
    frequency[0, 0] = 1
    amplitude = frequency ** (slope / 2) * (frequency > 1.5 / size)
    noise = pick.normal(size=(size, size // 2 + 1)) + 1j * pick.normal(size=(size, size // 2 + 1))
    field = np.fft.irfft2(amplitude * noise, s=(size, size))
    return (field - field.mean()) / field.std()


def clouds(pick, directions, sees_sky, scene):
    """Extinction by clouds for directions of the horizon, in magnitudes: a layer that is a plane above the ground."""
    if scene["cloud_cover"] == 0:
        return np.zeros(directions.shape[:-1])
    size = 1024
    field = fractal(pick, size, scene["cloud_slope"])
    # On a shell above a curved Earth the layer is this far away, in units of its height.
    sine = np.maximum(directions[..., 2], 0)
    distance = 1 / np.sqrt(sine**2 + 2 * 0.004 * (1 + 0.002))
    place = directions[..., :2] * np.minimum(distance, 25)[..., None] * scene["cloud_scale"] * size / 16
    sampled = ndimage.map_coordinates(field, [place[..., 0] + size / 2, place[..., 1] + size / 2], order=1, mode="wrap")
    clear = np.quantile(sampled[sees_sky], 1 - scene["cloud_cover"])
    return np.clip((sampled - clear) * scene["cloud_mag"], 0, 8)


def sky_light(directions, moon, scene):
    """V magnitudes of a square arcsecond of clear sky: airglow, a light dome, and the Moon."""
    altitude = np.arcsin(np.clip(directions[..., 2], 0.01, 1))
    zenith_distance = math.pi / 2 - altitude
    extinction = scene["extinction_mag"]
    # Airglow of a layer at 90 km (van Rhijn 1921), dimmed by half of the air below it.
    layer = 1 / np.sqrt(1 - (np.sin(zenith_distance) / (1 + 90 / 6371)) ** 2)
    light = layer * 10 ** (-0.2 * extinction * (airmass(altitude) - 1))
    azimuth = np.arctan2(directions[..., 1], directions[..., 0])
    toward = np.cos(azimuth - scene["dome_azimuth_rad"])
    light = light + scene["dome"] * np.exp(2 * (toward - 1)) * np.exp(-altitude / math.radians(18))
    light = light * 10 ** (-0.4 * scene["zenith_mag_arcsec2"])
    if moon is not None:
        light = light + moon_light(directions, altitude, moon, extinction)
    return -2.5 * np.log10(light)


def moon_light(directions, altitude, moon, extinction):
    """Krisciunas & Schaefer (1991), eq. 15, 20, 21, in units of V = 0 per square arcsecond."""
    distance = np.degrees(np.arccos(np.clip(directions @ moon["direction"], -1, 1)))
    distance = np.maximum(distance, 2)
    phase = moon["phase_deg"]
    illuminance = 10 ** (-0.4 * (3.84 + 0.026 * phase + 4e-9 * phase**4))
    scatter = 10**5.36 * (1.06 + np.cos(np.radians(distance)) ** 2) + 10 ** (6.15 - distance / 40)
    depth = lambda sine: 1 / np.sqrt(1 - 0.96 * (1 - sine**2))
    moon_depth = depth(max(moon["direction"][2], 0.02))
    nanolamberts = scatter * illuminance * 10 ** (-0.4 * extinction * moon_depth)
    nanolamberts = nanolamberts * (1 - 10 ** (-0.4 * extinction * depth(np.sin(altitude))))
    return nanolamberts / (34.08 * math.exp(20.7233))


def add_spots(image, stars, lens, scene):
    """Adds the light of stars, integrated over each pixel."""
    height, width = image.shape
    for reach, chosen in [(5, stars["electrons"] < 3e4), (14, stars["electrons"] >= 3e4)]:
        x, y, light = (stars[key][chosen] for key in ("x", "y", "electrons"))
        for share, shift, widening in spot_parts(scene):
            # Coma grows outward with the distance from the axis.
            out_x, out_y = (x - lens.axis_px[0]) / lens.radii_px[-1], (y - lens.axis_px[1]) / lens.radii_px[-1]
            sigma = scene["spot_sigma_px"] * widening
            part_x, part_y = x + shift * out_x, y + shift * out_y
            columns = np.round(x).astype(int)[:, None] + np.arange(-reach, reach + 1)
            rows = np.round(y).astype(int)[:, None] + np.arange(-reach, reach + 1)
            along_x, along_y = pixel_shares(columns, part_x, sigma), pixel_shares(rows, part_y, sigma)
            values = share * light[:, None, None] * along_y[:, :, None] * along_x[:, None, :]
            inside = ((rows >= 0) & (rows < height))[:, :, None] & ((columns >= 0) & (columns < width))[:, None, :]
            index = rows[:, :, None] * width + columns[:, None, :]
            image += np.bincount(index[inside], values[inside], minlength=image.size).reshape(image.shape)


def spot_parts(scene):
    """Share of the light, shift at the edge of the field in pixels, and width of the Gaussians of a spot."""
    coma, wings = scene["coma_px"], scene["wings"]
    parts = [(1 - wings, 0.0, 1.0), (wings, 0.0, 2.6)] if wings else [(1.0, 0.0, 1.0)]
    if not coma:
        return parts
    tail = [(0.5, 0.0, 1.0), (0.25, 0.3, 1.15), (0.15, 0.6, 1.35), (0.1, 1.0, 1.6)]
    return [(a * b, shift * coma, width * wide) for a, _, width in parts for b, shift, wide in tail]


def pixel_shares(pixels, centre, sigma):
    """Share of a Gaussian's light in each pixel of a row."""
    edge = (pixels - centre[:, None]) / (sigma * math.sqrt(2))
    half = 0.5 / (sigma * math.sqrt(2))
    return 0.5 * (special.erf(edge + half) - special.erf(edge - half))


def random_scene(pick, options):
    """The scene and the camera; options that are given hold."""
    height_m = float(pick.uniform(0, 2500))
    scene = {
        "lens": str(pick.choice(list(LENSES))),
        "latitude_deg": math.degrees(math.asin(pick.uniform(-0.9, 0.9))),
        "longitude_deg": float(pick.uniform(-180, 180)),
        "height_m": height_m,
        "tilt_deg": float(abs(pick.normal(0, 3))),
        "roll_deg": float(pick.uniform(0, 360)),
        "mirrored": False,
        "extinction_mag": float(pick.uniform(0.12, 0.3)),
        "zenith_mag_arcsec2": float(pick.uniform(18.5, 21.7)),
        "dome": float(pick.uniform(0, 3)),
        "dome_azimuth_rad": float(pick.uniform(0, 2 * math.pi)),
        "exposure_s": float(pick.choice([5, 10, 20, 30])),
        "spot_sigma_px": float(pick.uniform(0.7, 1.2)),
        "coma_px": 0.0,
        "wings": 0.0,
        "color_term": float(pick.normal(0, 0.08)),
        "vignetting": float(pick.uniform(0, 0.5)),
        "stray": float(pick.uniform(0, 0.04)),
        "cloud_cover": float(pick.uniform(0.1, 0.8)) if pick.random() < 0.5 else 0.0,
        "cloud_mag": float(pick.uniform(0.3, 2.5)),
        "cloud_scale": float(pick.uniform(0.5, 3)),
        "cloud_slope": float(pick.uniform(-4, -2.7)),
        "cloud_light": float(pick.uniform(-0.2, 1.5)),
        "skyline_deg": float(pick.uniform(1, 12)),
        "moon": bool(pick.random() < 0.4),
        "zero_point_e_s": float(pick.uniform(11.0, 12.6)),
        "scatter_mag": 0.03,
        "read_noise_e": float(pick.uniform(2, 8)),
        "gain_e_adu": float(pick.uniform(0.3, 2)),
        "bits": 16,
        "tone": "linear",
        "jpeg": 0,
    }
    given = {key: value for key, value in vars(options).items() if key in scene and value is not None}
    return scene | given


def night_time(pick, scene):
    """A random time with the Sun lower than 16 degrees below the horizon, the Moon up or down as asked."""
    from astropy import units as u
    from astropy.coordinates import AltAz, EarthLocation, get_body
    from astropy.time import Time

    location = EarthLocation(lon=scene["longitude_deg"] * u.deg, lat=scene["latitude_deg"] * u.deg)
    times = Time(2457300 + pick.uniform(0, 3000, size=120), format="jd")
    frame = AltAz(obstime=times, location=location)
    altitudes = {body: get_body(body, times, location).transform_to(frame).alt.deg for body in ("sun", "moon")}
    fits = (altitudes["sun"] < -16) & ((altitudes["moon"] > 12) if scene["moon"] else (altitudes["moon"] < -4))
    return times[np.flatnonzero(fits)[0]] if fits.any() else night_time(pick, scene)


def moon_of(place, scene):
    """Direction and phase of the Moon."""
    from astropy.coordinates import get_body

    if not scene["moon"]:
        return None
    moon, sun = (get_body(body, place.time, place.location) for body in ("moon", "sun"))
    direction, toward_sun = place.vectors(moon), place.vectors(sun)
    elongation = math.degrees(math.acos(np.clip(direction @ toward_sun, -1, 1)))
    return {"direction": direction, "phase_deg": 180 - elongation}


def pose(scene):
    """The rotation from the axes of the horizon to those of the camera: x right, y down, z along the axis."""
    # Looking up with north on top of the picture, east is to the left.
    upright = np.array([[0.0, -1, 0], [-1, 0, 0], [0, 0, 1]])
    roll = math.radians(scene["roll_deg"])
    tilt = rotation([math.cos(2.3 * roll), math.sin(2.3 * roll), 0], math.radians(scene["tilt_deg"]))
    return rotation([0, 0, 1], roll) @ upright @ tilt


def lens_of(pick, scene, size):
    """A lens whose circle nearly fills the frame, with distortion and an axis off the centre."""
    field_deg = pick.uniform(60, 78) if scene["lens"] == "orthographic" else pick.uniform(70, 92)
    field = math.radians(field_deg)
    radius_px = size / 2 * pick.uniform(0.88, 1.02)
    corner = size / math.sqrt(2)
    axis = (size - 1) / 2 + pick.uniform(-0.03, 0.03, size=2) * corner
    terms = pick.uniform(-0.02, 0.02), pick.uniform(-0.008, 0.008)
    focal_px = radius_px / float(LENSES[scene["lens"]][0](field))
    return Lens(scene["lens"], focal_px, axis, terms, field, pick.uniform(-5e-4, 5e-4))


def truth_attitude(place, horizon_to_camera):
    """The rotation from ICRS to the camera as the conventions define it: the catalog's direction of what is on the
    axis is on the axis, and the frame is not turned about it."""
    light_to_camera = horizon_to_camera @ place.icrs_to_horizon()
    light = light_to_camera[2]
    catalog = place.catalog_direction(horizon_to_camera[2])
    turn = np.cross(catalog, light)
    angle = math.atan2(np.linalg.norm(turn), catalog @ light)
    return light_to_camera @ (rotation(turn, angle) if angle > 0 else np.eye(3))


def tone_curve(pick, tone):
    """The curve from light to gray levels, both from 0 to 1, and its parameter."""
    if tone == "gamma":
        exponent = float(pick.uniform(0.4, 0.8))
        return lambda share: share**exponent, exponent
    if tone == "srgb":
        # IEC 61966-2-1.
        return lambda share: np.where(share <= 0.0031308, 12.92 * share, 1.055 * share ** (1 / 2.4) - 0.055), None
    if tone == "stretched":
        # The midtones transfer function of programs that stretch pictures: this share becomes one half.
        middle = float(pick.uniform(0.1, 0.35))
        return lambda share: (middle - 1) * share / ((2 * middle - 1) * share - middle), middle
    return lambda share: share, None


def gray_levels(pick, electrons, sees_sky, scene):
    """Noise, and the gray levels of the file; what is true of them."""
    signal = pick.poisson(np.maximum(electrons, 0)) + pick.normal(0, scene["read_noise_e"], electrons.shape)
    bias, largest = 200.0, 2 ** scene["bits"] - 1
    adu = signal / scene["gain_e_adu"] + bias
    if scene["bits"] == 16:
        return np.clip(np.round(adu), 0, largest), {"largest_level": largest, "unlit_level": bias}
    # The sky's median is at a twentieth to a third of the range before the curve.
    black = bias - pick.uniform(5, 40)
    full = (np.median(adu[sees_sky]) - black) / pick.uniform(0.05, 0.3)
    curve, parameter = tone_curve(pick, scene["tone"])
    level = lambda value: curve(np.clip((value - black) / full, 0, 1)) * largest
    return np.round(level(adu)), {
        "largest_level": largest, "unlit_level": float(level(bias)), "black_adu": black, "full_adu": full, "tone_parameter": parameter,
    }


def drawn(catalog, options):
    """Draws one frame; returns gray levels, truth and maps."""
    pick = np.random.default_rng(options.seed)
    scene = random_scene(pick, options)
    size = options.size
    lens = lens_of(pick, scene, size)
    time = night_time(pick, scene)
    place = Place(scene["latitude_deg"], scene["longitude_deg"], scene["height_m"], time)
    horizon_to_camera = pose(scene)

    y, x = np.mgrid[0:size, 0:size].astype(float)
    camera_vectors, in_circle = lens.vectors(x, y)
    directions = camera_vectors @ horizon_to_camera
    azimuth = np.arctan2(directions[..., 1], directions[..., 0])
    altitude = np.arcsin(np.clip(directions[..., 2], -1, 1))
    skyline = skyline_rad(pick, azimuth, scene)
    sees_sky = in_circle & (altitude > skyline)

    moon = moon_of(place, scene)
    cloud_mag = clouds(pick, directions, sees_sky, scene)
    clear_mag = sky_light(directions, moon, scene)
    passed = 10 ** (-0.4 * cloud_mag)
    sky_mag = clear_mag - 2.5 * np.log10(passed + (1 - passed) * (1 + scene["cloud_light"]))

    vignetting = lambda px, py: 1 - scene["vignetting"] * (np.hypot(px - lens.axis_px[0], py - lens.axis_px[1]) / lens.radii_px[-1]) ** 2
    rate = 10 ** (0.4 * scene["zero_point_e_s"]) * scene["exposure_s"]
    light = rate * 10 ** (-0.4 * sky_mag) * pixel_solid_angles(lens, x, y) * vignetting(x, y)
    image = np.where(sees_sky, light, 0.0)
    image = ndimage.gaussian_filter(image, 0.8) + scene["stray"] * np.median(light[sees_sky])

    stars = star_light(pick, catalog, place, lens, horizon_to_camera, scene)
    row, column = (np.clip(np.round(stars[key]).astype(int), 0, size - 1) for key in ("y", "x"))
    stars["electrons"] *= rate * vignetting(stars["x"], stars["y"]) * passed[row, column]
    # What is behind the skyline, or too faint to change a pixel, is not drawn.
    kept = sees_sky[row, column] & (stars["electrons"] > 1)
    stars = {key: value[kept] for key, value in stars.items()}
    add_spots(image, stars, lens, scene)
    if moon is not None:
        add_moon(image, moon, lens, horizon_to_camera)

    levels, detector = gray_levels(pick, image, sees_sky, scene)
    attitude = truth_attitude(place, horizon_to_camera)
    truth = scene | detector | {
        "seed": options.seed, "date": time.utc.isot + "Z", "site": place.site,
        "quaternion": quaternion(attitude), "axis_px": list(map(float, lens.axis_px)), "terms": list(lens.terms),
        "stretch": lens.stretch, "focal_length_px": lens.focal_px, "field_deg": math.degrees(lens.field_rad),
        "size_px": size, "moon_phase_deg": moon and moon["phase_deg"],
        "moon_direction": moon and list(map(float, moon["direction"])),
        "zero_point_vmag": scene["zero_point_e_s"] - 2.5 * math.log10(scene["gain_e_adu"]),
    }
    hidden = lambda values: np.where(sees_sky, values, np.nan).astype(np.float32)
    maps = {
        "mag_arcsec2": hidden(sky_mag), "cloud_mag": hidden(cloud_mag),
        "altitude_deg": np.degrees(altitude).astype(np.float32), "azimuth_deg": (np.degrees(azimuth) % 360).astype(np.float32),
        **stars,
    }
    return levels, truth, maps


def skyline_rad(pick, azimuth, scene):
    """Altitude of hills around the horizon."""
    hills = sum(pick.normal(0, 1 / order) * np.cos(order * azimuth + pick.uniform(0, 6.3)) for order in range(1, 9))
    return np.radians(np.maximum(scene["skyline_deg"] * (0.6 + 0.25 * hills), 0.3))


def star_light(pick, catalog, place, lens, horizon_to_camera, scene):
    """Pixels of the stars that the lens sees, and their light with the air alone, in units of a star of V = 0."""
    vectors = observed_stars(catalog, place)
    vmag, color = catalog[4], catalog[5]
    x, y, angle = lens.pixels(vectors @ horizon_to_camera.T)
    seen = (vectors[:, 2] > 0.005) & (angle < lens.field_rad)
    altitude = np.arcsin(vectors[seen, 2])
    dimming = scene["extinction_mag"] * airmass(altitude) + scene["color_term"] * (color[seen] - 0.6)
    shown = vmag[seen] + dimming + pick.normal(0, scene["scatter_mag"], size=altitude.size)
    return {"x": x[seen], "y": y[seen], "vmag": vmag[seen], "electrons": 10 ** (-0.4 * shown)}


def add_moon(image, moon, lens, horizon_to_camera):
    """A disc that is far beyond full scale."""
    x, y, _ = lens.pixels(horizon_to_camera @ moon["direction"])
    rows, columns = np.indices(image.shape)
    radius_px = max(2.0, lens.focal_px * math.radians(0.26))
    image[np.hypot(columns - x, rows - y) < radius_px] += 1e6


def write(out, levels, truth, maps):
    """Writes the frame and what is true of it; returns the frame's path."""
    out = pathlib.Path(out)
    out.with_suffix(".json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")
    np.savez(out.with_suffix(".npz"), **maps)
    if truth["largest_level"] > 255:
        from astropy.io import fits

        hdu = fits.PrimaryHDU(levels.astype(np.uint16))
        hdu.header["DATE-OBS"] = truth["date"].rstrip("Z")
        hdu.header["EXPTIME"] = truth["exposure_s"]
        hdu.header["ROWORDER"] = "TOP-DOWN"
        path = out.with_suffix(".fits")
        hdu.writeto(path, overwrite=True)
        return path
    path = out.with_suffix(".jpg" if truth["jpeg"] else ".png")
    Image.fromarray(levels.astype(np.uint8)).save(path, **({"quality": int(truth["jpeg"])} if truth["jpeg"] else {}))
    return path


def parser():
    """The options of a frame, all but the files."""
    options = argparse.ArgumentParser(add_help=False)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--size", type=int, default=900, help="columns and rows")
    options.add_argument("--lens", choices=list(LENSES))
    options.add_argument("--bits", type=int, choices=(8, 12, 16))
    options.add_argument("--tone", choices=TONES, help="curve of the gray levels, for 8 bits")
    options.add_argument("--jpeg", type=int, help="quality")
    options.add_argument("--moon", type=lambda text: text == "yes", help="yes or no")
    for name in NUMBERS:
        options.add_argument("--" + name.replace("_", "-"), type=float)
    return options


def comparison(description, seed):
    """The arguments of a script that compares frames with their truth."""
    options = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("program", type=lambda path: pathlib.Path(path).resolve())
    options.add_argument("catalog", type=pathlib.Path)
    options.add_argument("directory", type=pathlib.Path)
    options.add_argument("--frames", type=int, default=100)
    options.add_argument("--seed", type=int, default=seed)
    return options


@functools.cache
def catalog_of(path):
    """The catalog, read once, for places without data from the network."""
    from astropy.utils import iers

    iers.conf.auto_download = False
    return read_catalog(path)


def frame_of(options, seed, words):
    """Draws a frame into the directory of a comparison, unless it is there; returns file, truth and maps."""
    path = options.directory / f"{seed}"
    path.parent.mkdir(parents=True, exist_ok=True)
    there = [path.with_suffix(end) for end in (".fits", ".png", ".jpg") if path.with_suffix(end).exists()]
    if not there:
        there = [write(path, *drawn(catalog_of(options.catalog), parser().parse_args(["--seed", str(seed), *words])))]
    return there[0], json.loads(path.with_suffix(".json").read_text(encoding="utf-8")), np.load(path.with_suffix(".npz"))


def answer(options, frame, truth, *arguments):
    """The JSON of `starpipe sky` with date and site, which is kept beside the frame."""
    site = ",".join(map(str, truth["site"]))
    command = [options.program, "sky", "--format=json", f"--site={site}", f"--date={truth['date']}", *arguments, frame]
    ran = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
    if ran.returncode not in (0, 3):
        raise SystemExit(f"{frame}: {ran.stderr}")
    found = json.loads(ran.stdout.splitlines()[0])
    frame.with_suffix(".answer.json").write_text(json.dumps(found), encoding="utf-8")
    return found


def main():
    options = argparse.ArgumentParser(description=__doc__, parents=[parser()], formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("catalog", type=pathlib.Path)
    options.add_argument("out", type=pathlib.Path)
    options = options.parse_args()
    print(write(options.out, *drawn(catalog_of(options.catalog), options)))


if __name__ == "__main__":
    main()
