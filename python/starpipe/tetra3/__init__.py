"""The interface of tetra3 and of cedar-solve, answered by starpipe.

Programs written for these plate solvers run with starpipe after one changed import:

>>> from starpipe import tetra3
>>> solver = tetra3.Tetra3()
>>> solution = solver.solve_from_image(image, fov_estimate=11.4)  # doctest: +SKIP
>>> solution["RA"], solution["Dec"], solution["Roll"], solution["FOV"]  # doctest: +SKIP

Names of arguments, keys of the solutions and conventions are theirs: a centroid is (y, x), and
(0.5, 0.5) is the center of the first pixel.
"""

from ._extract import crop_and_downsample_image, get_centroids_from_image
from ._pinhole import transform_to_celestial_coords, transform_to_image_coords
from ._solution import CANCELLED, MATCH_FOUND, NO_MATCH, TIMEOUT, TOO_FEW
from ._solver import Tetra3

__all__ = [
    "CANCELLED",
    "MATCH_FOUND",
    "NO_MATCH",
    "TIMEOUT",
    "TOO_FEW",
    "Tetra3",
    "crop_and_downsample_image",
    "get_centroids_from_image",
    "transform_to_celestial_coords",
    "transform_to_image_coords",
]
