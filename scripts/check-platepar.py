#!/usr/bin/env python3
"""Checks platepars against RMS's formulas, written anew from their description.

    check-platepar.py PLATEPAR STARS   compares with stars, one a line: RA DEC X Y (J2000 degrees, pixels)
    check-platepar.py                  prints the pixels that the tests in src/camera/formats/platepar expect

Formulas: Croatian Meteor Network, RMS, RMS/Astrometry/CyFunctions.pyx.
"""

import json
import sys
from math import acos, asin, atan2, cos, degrees, hypot, pi, radians, sin, tan

J2000 = 2451545.0


def sidereal_deg(jd):
    t = (jd - J2000) / 36525
    return (280.46061837 + 360.98564736629 * (jd - J2000) + 0.000387933 * t**2 - t**3 / 38710000) % 360


def precessed(start, end, ra, dec):
    a, t = (start - J2000) / 36525, (end - start) / 36525
    first = (2306.2181 + 1.39656 * a - 0.000139 * a**2) * t
    zeta = radians((first + (0.30188 - 0.000344 * a) * t**2 + 0.017998 * t**3) / 3600)
    z = radians((first + (1.09468 + 0.000066 * a) * t**2 + 0.018203 * t**3) / 3600)
    theta = (2004.3109 - 0.85330 * a - 0.000217 * a**2) * t
    theta = radians((theta - (0.42665 + 0.000217 * a) * t**2 - 0.041833 * t**3) / 3600)
    x = cos(theta) * cos(dec) * cos(ra + zeta) - sin(theta) * sin(dec)
    up = sin(theta) * cos(dec) * cos(ra + zeta) + cos(theta) * sin(dec)
    return (atan2(cos(dec) * sin(ra + zeta), x) + z) % (2 * pi), asin(up)


def position_angle(ra, dec, to_ra, to_dec):
    east = cos(to_dec) * sin(to_ra - ra)
    return atan2(east, sin(to_dec) * cos(dec) - cos(to_dec) * sin(dec) * cos(to_ra - ra))


def refracted(plate, ra, dec):
    jd, lat = plate["JD"], radians(plate["lat"])
    sidereal = radians(sidereal_deg(jd) + plate["lon"])
    ra, dec = precessed(J2000, jd, ra, dec)
    hour = sidereal - ra
    azimuth = pi + atan2(sin(hour), cos(hour) * sin(lat) - tan(dec) * cos(lat))
    altitude = asin(sin(lat) * sin(dec) + cos(lat) * cos(dec) * cos(hour))
    high = max(degrees(altitude), -0.5)
    altitude += radians(1.02 / (60 * tan(radians(high + 10.3 / (high + 5.11)))))
    hour = atan2(-sin(azimuth), tan(altitude) * cos(lat) - cos(azimuth) * sin(lat))
    dec = asin(sin(lat) * sin(altitude) + cos(lat) * cos(altitude) * cos(azimuth))
    return precessed(jd, J2000, (sidereal - hour) % (2 * pi), dec)


def standard(plate, ra_deg, dec_deg):
    """Where a star is on the undistorted plate, in pixels from its reference."""
    centre = radians(plate["RA_d"]), radians(plate["dec_d"])
    star = radians(ra_deg), radians(dec_deg)
    if plate["refraction"]:
        centre, star = refracted(plate, *centre), refracted(plate, *star)
    north = precessed(plate["JD"], J2000, centre[0], centre[1] + 1e-6)
    centre = precessed(plate["JD"], J2000, *centre)
    up = radians(plate["pos_angle_ref"]) + position_angle(*centre, *north)
    (ra, dec), (ra_0, dec_0) = star, centre
    cosine = sin(dec) * sin(dec_0) + cos(dec) * cos(dec_0) * cos(ra - ra_0)
    distance = degrees(acos(min(cosine, 1.0))) * plate["F_scale"]
    turn = up - pi / 2 - position_angle(*centre, *star)
    return distance * cos(turn), distance * sin(turn)


def warped(plate, way, x, y):
    """The displacements of RMS: to be added to the image (fwd) or taken from the sky (rev)."""
    along_x, along_y = plate[f"x_poly_{way}"], plate[f"y_poly_{way}"]
    kind, width, height = plate["distortion_type"], plate["X_res"], plate["Y_res"]
    if kind.startswith("poly"):
        r = hypot(x - along_x[0], y - along_y[0])
        common = [1, x, y, x * x, x * y, y * y, x**3, x * x * y, x * y * y, y**3]
        own_x, own_y = [x * r, y * r, x * r**3, x * r**5], [y * r, x * r, y * r**3, y * r**5]
        dx = sum(c * v for c, v in zip(along_x, common + own_x))
        return dx, sum(c * v for c, v in zip(along_y, common + own_y))
    rest = list(along_x)
    x0, y0 = (0.5, 0.5) if plate["force_distortion_centre"] else (
        rest.pop(0) * width / 2, rest.pop(0) * height / 2)
    aspect = 1 if plate["equal_aspect"] else 1 + rest.pop(0)
    amount, angle = (rest.pop(0), rest.pop(0) * 2 * pi) if plate["asymmetry_corr"] else (0, 0)
    u, v = (x, y) if way == "rev" else (x - x0, aspect * (y - y0))
    r = (hypot(u, v) + amount * (v * cos(angle) - u * sin(angle))) / (width / 2)
    powers = [1, 2, 3, 4] if kind.endswith("all") else [2, 4, 6, 8]
    scale = sum(k * r**power for k, power in zip(rest, powers))
    if way == "rev":
        return x * scale - x0, y * scale / aspect - y0 + y * (1 - 1 / aspect)
    return u * scale - x0, v * scale - y0 * aspect + y * (aspect - 1)


def pixel(plate, ra_deg, dec_deg):
    x, y = standard(plate, ra_deg, dec_deg)
    dx, dy = warped(plate, "rev", x, y)
    return x - dx + plate["X_res"] / 2, y - dy + plate["Y_res"] / 2


def compare(plate, stars):
    reverse = forward = 0.0
    for ra_deg, dec_deg, x, y in stars:
        at = pixel(plate, ra_deg, dec_deg)
        reverse = max(reverse, hypot(at[0] - x, at[1] - y))
        sky = standard(plate, ra_deg, dec_deg)
        x, y = x - plate["X_res"] / 2, y - plate["Y_res"] / 2
        dx, dy = warped(plate, "fwd", x, y)
        forward = max(forward, hypot(x + dx - sky[0], y + dy - sky[1]))
    print(f"off by up to {reverse:.4f} px on the image, {forward:.4f} px on the sky")


def print_examples():
    plate = {"X_res": 1280, "Y_res": 720, "F_scale": 14.25, "lat": 45.1, "lon": 15.2, "JD": 2460310.4375, "RA_d": 83.5,
                 "dec_d": 22.25, "pos_angle_ref": 47.5, "refraction": True, "force_distortion_centre": False,
                 "equal_aspect": False, "asymmetry_corr": False}
    radial7 = {"distortion_type": "radial7-odd", "x_poly_rev": [0.004, -0.003, 0.002, 0.02, -0.01, 0.003],
                   "y_poly_rev": [0] * 6}
    radial9 = {"distortion_type": "radial9-odd", "equal_aspect": True, "y_poly_rev": [0] * 6,
                   "x_poly_rev": [0.004, -0.003, 0.02, -0.01, 0.003, 0.0005]}
    x = [-2.5, 0.004, 0.02, 3e-6, -2e-6, 1e-6, 2e-8, 1e-9, 1.8e-8, -2e-9, 1e-9, 0.0]
    y = [1.25, -0.018, 0.003, 1e-6, 2e-6, -3e-6, 1e-9, 2.1e-8, -1e-9, 1.9e-8, 1e-9, 0.0]
    polynomial = {"distortion_type": "poly3+radial", "x_poly_rev": x, "y_poly_rev": y}
    for other in [radial7, radial7 | {"refraction": False}, radial9, polynomial]:
        print(other["distortion_type"])
        for star in [(83, 22), (60, 40), (100, 45), (70, -5), (105, 5)]:
            print("  {:.5f} {:.5f}".format(*pixel(plate | other, *star)))


if len(sys.argv) == 3:
    with open(sys.argv[1]) as file, open(sys.argv[2]) as lines:
        compare(json.load(file), [tuple(map(float, line.split())) for line in lines if line.strip()])
else:
    print_examples()
