"""Solutions, as tetra3 returns them."""

from __future__ import annotations

from typing import Any

import numpy as np

from .._attitude import ARCSEC_PER_RAD
from .._result import Result
from ._marks import solution_picture
from ._pinhole import Pinhole, rotation_of, within
from ._question import Question
from ._sky import Array, SkyMap, directions_of, ra_dec_of

MATCH_FOUND = 1
"""Status: the stars are identified."""
NO_MATCH = 2
"""Status: the stars are not identified."""
TIMEOUT = 3
"""Status: there was no answer within `solve_timeout`."""
CANCELLED = 4
"""Status: `Tetra3.cancel_solve` was called."""
TOO_FEW = 5
"""Status: there are fewer stars than a pattern has."""

PATTERN_SIZE = 4
"""Stars of a pattern of tetra3."""

EQUINOX = 2000
"""Equinox of right ascension and declination."""

EPOCH = 2000.0
"""Year of the stars' positions: frames have no dates here."""

ROUNDING_PX = 0.01
"""More than centroids are rounded by in a result."""

VALUES = (
    *("RA", "Dec", "Roll", "FOV", "distortion", "RMSE", "P90E", "MAXE", "Matches", "Prob"),
    *("epoch_equinox", "epoch_proper_motion", "cache_hit_fraction"),
)
"""Keys of each solution, besides the status and the time; None if there is no match."""


def unsolved(status: int) -> dict[str, Any]:
    """Return the solution of a frame that is not identified."""
    return dict.fromkeys(VALUES) | {"status": status}


def solved(result: Result, question: Question, given: Array | None) -> dict[str, Any]:
    """Return the solution of a frame that is identified.

    `given` are the centroids (y, x) of a list, which have more digits than those of the result.
    """
    header, match = result._wcs_header, result.match
    assert header is not None and match is not None
    sky, size = SkyMap(header), result.shape
    rotation = rotation_of(sky, size)
    with_distortion = question.distortion is not None
    camera = Pinhole.like(sky, size, distorted=with_distortion)
    stars = _Stars(result, sky, given)
    optics = result._report["optics"]
    residuals = np.sort(stars.residuals_px) * ARCSEC_PER_RAD / optics["focal_length_px"]
    (ra, dec), roll = ra_dec_of(rotation[0]).tolist(), np.arctan2(rotation[1, 2], rotation[2, 2])
    solution = {
        "RA": ra,
        "Dec": dec,
        "Roll": float(np.degrees(roll) % 360.0),
        "FOV": camera.fov_deg if camera else optics["fov_x_deg"],
        "distortion": camera.distortion if camera and with_distortion else None,
        "RMSE": match.rms_arcsec,
        "P90E": float(residuals[int(0.9 * (len(residuals) - 1))]),
        "MAXE": float(residuals[-1]),
        "Matches": match.matched,
        "Prob": 10.0**match.log10_false_alarm,
        "epoch_equinox": EQUINOX,
        "epoch_proper_motion": EPOCH,
        "cache_hit_fraction": 0.0,
        "status": MATCH_FOUND,
    }
    solution |= _targets(sky, size, question)
    if question.return_matches:
        solution |= stars.matches()
    if question.return_catalog:
        solution["catalog_stars"] = stars.of_catalog()
    if question.return_visual:
        radius = question.match_radius * size[1]
        solution["visual"] = solution_picture(
            size, stars.centroids, stars.matched, stars.missed, radius
        )
    if question.return_rotation_matrix:
        solution["rotation_matrix"] = rotation.tolist()
    return solution


def _targets(sky: SkyMap, size: tuple[int, int], question: Question) -> dict[str, Any]:
    """Return the sky of the wanted pixels, and the pixels of the wanted places on the sky."""
    found: dict[str, Any] = {}
    if question.target_pixel is not None:
        places = ra_dec_of(sky.directions(np.reshape(question.target_pixel, (-1, 2))))
        found |= _columns(places, "RA_target", "Dec_target")
    if question.target_sky_coord is not None:
        pixels = within(sky.pixels(directions_of(question.target_sky_coord)), size)
        found |= _columns(pixels, "y_target", "x_target")
    return found


def _columns(rows: Array, *names: str) -> dict[str, Any]:
    """Return columns as lists, or as numbers if there is one row; None for NaN."""
    columns = [
        [None if np.isnan(value) else value for value in column] for column in rows.T.tolist()
    ]
    single = len(rows) == 1
    return {
        name: column[0] if single else column for name, column in zip(names, columns, strict=True)
    }


def _as_given(rounded: Array, given: Array) -> Array:
    """Return for each centroid that was rounded the one that was given."""
    given = given[np.isfinite(given).all(axis=1)]
    given = given[np.argsort(given[:, 0])]
    # Only neighbors are compared: the distances of all would need gigabytes for long lists.
    first, end = (
        np.searchsorted(given[:, 0], rounded[:, 0] + shift) for shift in (-ROUNDING_PX, ROUNDING_PX)
    )
    exact = np.empty_like(rounded)
    for number, place in enumerate(rounded):
        near = given[first[number] : end[number]]
        exact[number] = near[np.abs(near - place).sum(axis=1).argmin()]
    return exact


class _Stars:
    """The stars of a result."""

    def __init__(self, result: Result, sky: SkyMap, given: Array | None) -> None:
        columns = result.star_columns
        self.centroids = np.stack([columns["y"], columns["x"]], axis=-1) + 0.5
        if given is not None:
            self.centroids = _as_given(self.centroids, given)
        named = columns["id"] != ""
        self._columns = {name: column[named] for name, column in columns.items()}
        self._missed = [
            shown
            for shown in result.annotations
            if shown["kind"] == "star" and shown["why"] is not None
        ]
        self.matched = self.centroids[named]
        self._sky = sky

    @property
    def missed(self) -> Array:
        """Pixels (y, x) of stars of the catalog that are in the frame and were not measured."""
        places = [(shown["y"] + 0.5, shown["x"] + 0.5) for shown in self._missed]
        return np.reshape(np.array(places, dtype=np.float64), (-1, 2))

    @property
    def residuals_px(self) -> Array:
        """Distances from the predicted positions; from the center of light for blends."""
        blend, single = self._columns["residual_blend_px"], self._columns["residual_px"]
        residuals: Array = np.where(np.isnan(blend), single, blend)
        return residuals

    @property
    def places(self) -> Array:
        """Right ascension, declination and magnitude."""
        names = ("ra_deg", "dec_deg", "vmag")
        return np.stack([self._columns[name] for name in names], axis=-1)

    def matches(self) -> dict[str, Any]:
        """Return the matched stars, brightest first."""
        numbers = zip(self._columns["hip"], self._columns["id"], strict=True)
        return {
            "matched_centroids": self.matched.tolist(),
            "matched_stars": self.places.tolist(),
            "matched_catID": [str(name) if np.isnan(hip) else int(hip) for hip, name in numbers],
            "pattern_centroids": list(self.matched[:PATTERN_SIZE]),
        }

    def of_catalog(self) -> list[tuple[float, ...]]:
        """Return right ascension, declination, magnitude, y and x of the known stars."""
        known = np.hstack([self.places, self._sky.pixels(directions_of(self.places[:, :2]))])
        missed = ra_dec_of(self._sky.directions(self.missed))
        magnitudes = [[shown["vmag"]] for shown in self._missed]
        others = np.hstack([missed, np.reshape(magnitudes, (-1, 1)), self.missed])
        rows = np.vstack([known, others]).astype(np.float64)
        return [tuple(row) for row in rows[np.argsort(rows[:, 2])].tolist()]
