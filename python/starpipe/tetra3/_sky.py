"""The sky at the pixels of a solved frame, with numpy alone."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

CARD = 80
"""Length of a card of a FITS header."""

STEPS = 50
"""Most steps of an iteration; each gains a digit or more."""


class SkyMap:
    """The directions at the pixels of a frame, from its FITS header.

    The header has the projection ``TAN``, or ``ZPN`` for wide lenses, and the polynomials of SIP
    for the distortion. Pixels are (y, x) as in tetra3: (0.5, 0.5) is the center of the first one.
    """

    def __init__(self, header: bytes) -> None:
        cards = dict(_cards(header))
        self._axes = _axes(*np.radians([cards["CRVAL1"], cards["CRVAL2"]]))
        # FITS counts the center of the first pixel as 1.
        self._reference = np.array([cards["CRPIX1"], cards["CRPIX2"]]) - 0.5
        numbers = [cards[f"CD{row}_{column}"] for row in (1, 2) for column in (1, 2)]
        self._linear = np.radians(np.reshape(numbers, (2, 2)))
        self._bends = [_coefficients(cards, "A"), _coefficients(cards, "B")]
        angles = {int(name[4:]): value for name, value in cards.items() if name.startswith("PV2_")}
        # The distance in the plane as a polynomial of the angle; empty for the tangent.
        self._radial = np.zeros(max(angles, default=-1) + 1)
        self._radial[list(angles)] = list(angles.values())

    def directions(self, pixels: ArrayLike) -> Array:
        """Return the unit vectors (ICRS) of pixels; NaN where the lens shows none."""
        offset = np.asarray(pixels, dtype=np.float64)[..., ::-1] - self._reference
        plane = (offset + self._bend(offset)) @ self._linear.T
        radius = np.hypot(plane[..., 0], plane[..., 1])
        angle = self._angle(radius)
        across = plane * (np.sin(angle) / np.where(radius > 0.0, radius, 1.0))[..., None]
        place = np.concatenate([np.cos(angle)[..., None], across], axis=-1)
        directions: Array = place @ self._axes
        return directions

    def pixels(self, directions: ArrayLike) -> Array:
        """Return the pixels of directions; NaN for those that the lens does not show."""
        place = np.asarray(directions, dtype=np.float64) @ self._axes.T
        across = np.hypot(place[..., 1], place[..., 2])
        angle = np.arctan2(across, place[..., 0])
        scale = self._radius(angle) / np.where(across > 0.0, across, 1.0)
        wanted = (place[..., 1:] * scale[..., None]) @ np.linalg.inv(self._linear).T
        offset = wanted
        with np.errstate(all="ignore"):
            for _ in range(STEPS):
                offset = wanted - self._bend(offset)
            reached = np.abs(offset + self._bend(offset) - wanted).max(axis=-1) < 1e-6
        # What is far outside the frame is not reached.
        offset = np.where(reached[..., None], offset, np.nan)
        pixels: Array = (offset + self._reference)[..., ::-1]
        return pixels

    def _bend(self, offset: Array) -> Array:
        """Return what SIP adds to offsets from the reference."""
        x, y = offset[..., 0], offset[..., 1]
        return np.stack([polynomial.polyval2d(x, y, bend) for bend in self._bends], axis=-1)

    def _radius(self, angle: Array) -> Array:
        """Return the distance from the reference in the plane."""
        if not self._radial.size:
            tangent: Array = np.where(angle < np.pi / 2.0, np.tan(angle), np.nan)
            return tangent
        return np.asarray(polynomial.polyval(angle, self._radial), dtype=np.float64)

    def _angle(self, radius: Array) -> Array:
        """Return the angle from the reference at a distance in the plane."""
        if not self._radial.size:
            return np.arctan(radius)
        slope = polynomial.polyder(self._radial)
        angle: Array = radius / self._radial[1]
        for _ in range(STEPS):
            step = self._radius(angle) - radius
            angle = angle - step / polynomial.polyval(angle, slope)
            angle = np.clip(angle, 0.0, np.pi)
        return np.where(np.abs(self._radius(angle) - radius) < 1e-9, angle, np.nan)


def _cards(header: bytes) -> Iterator[tuple[str, float]]:
    """Yield the numbers of a header."""
    for start in range(0, len(header), CARD):
        card = header[start : start + CARD].decode("ascii")
        found = re.match(r"(\S+)\s*=\s*([-+.\dEeDd]+)\s*(?:/|$)", card)
        if found:
            yield found[1], float(found[2].replace("D", "E"))


def _coefficients(cards: dict[str, float], name: str) -> Array:
    """Return the coefficients of a polynomial of SIP, by the powers of x and y."""
    order = int(cards.get(f"{name}_ORDER", 0))
    powers = range(order + 1)
    return np.array([[cards.get(f"{name}_{p}_{q}", 0.0) for q in powers] for p in powers])


def _axes(ra_rad: float, dec_rad: float) -> Array:
    """Return the directions of a place on the sky, and of east and north there."""
    sin_ra, cos_ra, sin_dec, cos_dec = (
        function(angle) for angle in (ra_rad, dec_rad) for function in (np.sin, np.cos)
    )
    return np.array(
        [
            [cos_ra * cos_dec, sin_ra * cos_dec, sin_dec],
            [-sin_ra, cos_ra, 0.0],
            [-cos_ra * sin_dec, -sin_ra * sin_dec, cos_dec],
        ]
    )


def directions_of(ra_dec_deg: ArrayLike) -> Array:
    """Return the unit vectors of rows of right ascension and declination, in degrees."""
    ra, dec = np.radians(np.asarray(ra_dec_deg, dtype=np.float64).reshape(-1, 2)).T
    return np.stack([np.cos(ra) * np.cos(dec), np.sin(ra) * np.cos(dec), np.sin(dec)], axis=-1)


def ra_dec_of(directions: Array) -> Array:
    """Return rows of right ascension and declination of unit vectors, in degrees."""
    x, y, z = np.moveaxis(directions, -1, 0)
    ra, dec = np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))
    return np.stack([np.degrees(ra) % 360.0, np.degrees(dec)], axis=-1)
