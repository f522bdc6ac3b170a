"""The client of cedar-detect, answered by starpipe: no server runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ._extract import get_centroids_from_image


class CedarDetectClient:
    """Extract centroids with the method of cedar-detect's client.

    Parameters
    ----------
    binary_path, port : optional
        Without effect: there is no server.
    """

    def __init__(self, binary_path: Path | str | None = None, port: int = 50051) -> None:
        pass

    def extract_centroids(
        self,
        image: Any,
        sigma: float | None = None,
        max_size: int | None = None,
        use_binned: bool | None = None,
        detect_hot_pixels: bool = True,
    ) -> list[tuple[float, float]]:
        """Return the centroids (y, x) of the stars of an image, brightest first.

        Parameters
        ----------
        image : array or PIL image
            The image.
        sigma, max_size, use_binned, detect_hot_pixels : optional
            Without effect: starpipe finds the threshold itself, and leaves out hot pixels.
        """
        return [(y, x) for y, x in get_centroids_from_image(image).tolist()]
