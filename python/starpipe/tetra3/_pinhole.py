"""The camera of tetra3: a pinhole with one coefficient of distortion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ._sky import Array, SkyMap, directions_of, ra_dec_of

WIDEST_RAD = np.radians(75.0)
"""Largest angle from the center at which a lens is described as a pinhole."""

SAMPLES = 15
"""Places along each side of a frame at which its lens is compared with a pinhole."""

STEPS = 30
"""Steps of the iteration that finds where the lens puts a star."""

TOLERANCE = 1e-9
"""Largest error with which it is found, in units of half the width."""


@dataclass(frozen=True)
class Pinhole:
    """A camera as tetra3 describes it.

    With r the distance from the frame's center in units of half its width, and k the distortion,
    an angle of θ from the boresight is at tan θ = tan(FOV/2) r (1 - k r²) / (1 - k).

    Attributes
    ----------
    size : (float, float)
        Height and width of the frame.
    fov_deg : float
        Horizontal field of view.
    distortion : float
        The coefficient k: negative for barrel, positive for pincushion distortion.
    rotation : ndarray
        ICRS directions of the boresight, of the left and of the top of the frame, in rows.
    """

    size: tuple[float, float]
    fov_deg: float
    distortion: float
    rotation: Array

    @classmethod
    def of_solution(
        cls,
        width: float,
        height: float,
        fov: float,
        rotation_matrix: ArrayLike,
        distortion: float | None,
    ) -> Pinhole:
        """Return the camera that a solution describes."""
        size, rotation = (float(height), float(width)), np.asarray(rotation_matrix)
        return cls(size, float(fov), distortion or 0.0, rotation)

    @classmethod
    def like(cls, sky: SkyMap, size: tuple[float, float], *, distorted: bool) -> Pinhole | None:
        """Return the pinhole most similar to a lens; None for a lens too wide for that.

        Without `distorted` it has no distortion.
        """
        rotation = rotation_of(sky, size)
        height, width = size
        rows, columns = np.linspace(0.0, height, SAMPLES), np.linspace(0.0, width, SAMPLES)
        pixels = np.stack(np.meshgrid(rows, columns, indexing="ij"), axis=-1).reshape(-1, 2)
        place = sky.directions(pixels) @ rotation.T
        across = np.hypot(place[:, 1], place[:, 2])
        if not (np.arctan2(across, place[:, 0]) < WIDEST_RAD).all():
            return None
        radius = np.hypot(*(pixels - _center(size)).T) / (width / 2.0)
        # r = f tan θ + k r³, where f is the focal length times 1 - k.
        terms = np.stack([across / place[:, 0], radius**3], axis=-1)[:, : 1 + distorted]
        focal, *k = np.linalg.lstsq(terms, radius, rcond=None)[0].tolist()
        distortion = k[0] if k else 0.0
        fov_deg = float(np.degrees(2.0 * np.arctan((1.0 - distortion) / focal)))
        return cls(size, fov_deg, distortion, rotation)

    def directions(self, pixels: ArrayLike) -> Array:
        """Return the unit vectors (ICRS) of pixels (y, x)."""
        offset = (np.asarray(pixels, dtype=np.float64) - _center(self.size)) / self._half_width
        square = (offset**2).sum(axis=-1, keepdims=True)
        undone = offset * self._undoing(square)
        # Rows grow downward and columns to the right.
        along = -undone[..., ::-1] * np.tan(np.radians(self.fov_deg) / 2.0)
        place = np.concatenate([np.ones_like(square), along], axis=-1)
        directions: Array = place / np.linalg.norm(place, axis=-1, keepdims=True) @ self.rotation
        return directions

    def pixels(self, directions: ArrayLike) -> Array:
        """Return the pixels (y, x) of directions; NaN for those that the lens does not show."""
        place = np.asarray(directions, dtype=np.float64) @ self.rotation.T
        ahead = np.where(place[..., :1] > 0.0, place[..., :1], np.nan)
        ideal = -(place[..., 1:] / ahead / np.tan(np.radians(self.fov_deg) / 2.0))[..., ::-1]
        wanted = np.hypot(ideal[..., 0], ideal[..., 1])
        scale = self._distorted(wanted) / np.where(wanted > 0.0, wanted, 1.0)
        pixels: Array = ideal * scale[..., None] * self._half_width + _center(self.size)
        return pixels

    @property
    def _half_width(self) -> float:
        return self.size[1] / 2.0

    def _undoing(self, square: Array) -> Array:
        """Return the factor that takes the distortion from a distance whose square is known."""
        return (1.0 - self.distortion * square) / (1.0 - self.distortion)

    def _distorted(self, ideal: Array) -> Array:
        """Return the distance from the center at which the lens shows an ideal one (Newton).

        NaN if there is none: with pincushion distortion, what is farther out has no place.
        """
        k, radius = self.distortion, ideal
        with np.errstate(all="ignore"):
            for _ in range(STEPS):
                error = radius * self._undoing(radius**2) - ideal
                radius = radius - error * (1.0 - k) / (1.0 - 3.0 * k * radius**2)
            error = radius * self._undoing(radius**2) - ideal
        # Without a solution the last step is anywhere, also inside the frame.
        return np.where((radius >= 0.0) & (np.abs(error) < TOLERANCE), radius, np.nan)


def rotation_of(sky: SkyMap, size: tuple[float, float]) -> Array:
    """Return the directions of a frame's center, of its left and of its top, in rows.

    They are those of the sky in the picture: in a mirrored frame the determinant is -1.
    """
    steps = [(0.0, 0.0), (0.0, -0.5), (0.0, 0.5), (-0.5, 0.0), (0.5, 0.0)]
    center, left, right, top, bottom = sky.directions(_center(size) + np.array(steps))
    # The perpendicular directions closest to those of rows and columns.
    u, _, v = np.linalg.svd(np.stack([left - right, top - bottom]), full_matrices=False)
    return np.vstack([center, u @ v])


def within(pixels: Array, size: tuple[float, float]) -> Array:
    """Return pixels, with NaN for those outside a frame."""
    inside = ((pixels > 0.0) & (pixels < np.array(size))).all(axis=-1, keepdims=True)
    return np.where(inside, pixels, np.nan)


def _center(size: tuple[float, float]) -> Array:
    return np.array(size) / 2.0


def transform_to_image_coords(
    celestial_coords: ArrayLike,
    width: float,
    height: float,
    fov: float,
    rotation_matrix: ArrayLike,
    distortion: float | None,
) -> list[Array]:
    """Return the pixels (y, x) of places on the sky; those outside the frame are left out.

    Parameters
    ----------
    celestial_coords : array
        Rows of right ascension and declination, in degrees.
    width, height : float
        Size of the frame.
    fov, rotation_matrix, distortion
        ``FOV``, ``rotation_matrix`` and ``distortion`` of a solution.
    """
    camera = Pinhole.of_solution(width, height, fov, rotation_matrix, distortion)
    pixels = within(camera.pixels(directions_of(celestial_coords)), camera.size)
    return [pixel for pixel in pixels if np.isfinite(pixel).all()]


def transform_to_celestial_coords(
    image_coords: ArrayLike,
    width: float,
    height: float,
    fov: float,
    rotation_matrix: ArrayLike,
    distortion: float | None,
) -> list[tuple[float, float]]:
    """Return right ascension and declination of pixels (y, x), in degrees.

    Parameters
    ----------
    image_coords : array
        Rows of (y, x).
    width, height : float
        Size of the frame.
    fov, rotation_matrix, distortion
        ``FOV``, ``rotation_matrix`` and ``distortion`` of a solution.
    """
    camera = Pinhole.of_solution(width, height, fov, rotation_matrix, distortion)
    places = ra_dec_of(camera.directions(np.reshape(image_coords, (-1, 2))))
    return [(ra, dec) for ra, dec in places.tolist()]
