"""Detection of stars without identification."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _starpipe, _tables
from ._hints import positive, thread_count, whole_number
from ._images import Image, ImageLike, mask_of

if TYPE_CHECKING:
    from astropy.table import QTable


class Detections:
    """The stars of an image, brightest first, and its background.

    Attributes
    ----------
    background, noise : float
        Medians of the background level and of its standard deviation.
    spot_sigma_px : float
        Standard deviation of a star's spot.
    threshold_sigma : float
        Threshold in standard deviations of the filtered background.
    """

    def __init__(self, report: dict[str, Any]) -> None:
        self._stars = report["stars"]
        self.background: float = report["background"]
        self.noise: float = report["noise"]
        self.spot_sigma_px: float = report["spot_sigma_px"]
        self.threshold_sigma: float = report["threshold_sigma"]

    def __len__(self) -> int:
        return len(self._stars)

    def __repr__(self) -> str:
        level, noise = self.background, self.noise
        return f"<Detections: {len(self)} stars, background {level:.4g}, noise {noise:.3g}>"

    @property
    def columns(self) -> _tables.Columns:
        """The stars as arrays."""
        of_sky = (
            "id",
            "name",
            "vmag",
            "ra_deg",
            "dec_deg",
            "residual_px",
            "airmass",
            "residual_blend_px",
            "p_chance",
        )
        found = _tables.star_columns(self._stars)
        return {name: column for name, column in found.items() if name not in of_sky}

    @property
    def stars(self) -> QTable:
        """The stars as a ``QTable``, or `columns` without astropy."""
        return _tables.star_table(self.columns)

    @property
    def x(self) -> NDArray[np.float64]:
        """Column (x) coordinates of the centroids, in pixels."""
        return self.columns["x"]

    @property
    def y(self) -> NDArray[np.float64]:
        """Row (y) coordinates of the centroids, in pixels."""
        return self.columns["y"]

    @property
    def flux(self) -> NDArray[np.float64]:
        """Fluxes above the background."""
        return self.columns["flux"]

    @property
    def error(self) -> NDArray[np.float64]:
        """Standard error of a centroid on each axis, in pixels, as `Pipeline.identify` takes it."""
        x, y = self.columns["sigma_x"], self.columns["sigma_y"]
        error: NDArray[np.float64] = np.hypot(x, y) / np.sqrt(2.0)
        return error


def detect(
    image: ImageLike,
    mask: ArrayLike | None = None,
    *,
    sigma: float | None = None,
    max_stars: int | None = None,
    threads: int = 1,
) -> Detections:
    """Detect the stars of an image and measure their centroids.

    Parameters
    ----------
    image, mask, sigma, max_stars, threads
        As for `Pipeline.solve`.

    Raises
    ------
    OSError
        If a file cannot be read.
    ValueError
        If the file has no image, or an argument is out of range.
    """
    taken = Image(image)
    report = _starpipe.detect(
        taken.pixels,
        mask_of(taken, mask),
        positive(sigma, "", "sigma"),
        None if max_stars is None else whole_number(max_stars, "max_stars", 4),
        thread_count(threads),
    )
    return Detections(json.loads(report))
