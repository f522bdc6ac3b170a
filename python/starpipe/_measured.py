"""Quantities measured in a frame. Fields and units are those of the program's JSON."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class Distortion:
    """Distortion of a lens.

    Attributes
    ----------
    model : str
        ``radial``, ``radial5``, ``radial7``, ``brown_conrady``, ``stretched``, ``irregular3`` or
        ``irregular5``.
    focal_length_px : float
        Focal length on the axis of the lens, in pixels.
    radius_px : float
        Offset from the axis at which a normalized offset is 1, in pixels.
    largest_px : float
        Largest displacement in the corners, or at the edge of an all-sky lens, in pixels.
    coefficients_px : ndarray
        Coefficients in the model's order, in pixels.
    """

    model: str
    focal_length_px: float
    radius_px: float
    largest_px: float
    coefficients_px: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Match:
    """How well the detections match the catalog.

    Attributes
    ----------
    detected, matched : int
        Number of detections, and of those identified with a catalog star.
    stars_expected : float or None
        Expected number of catalog stars detected in the field, if a camera is given.
    rms_px, rms_arcsec : float
        Root mean square of the residuals, in pixels and in arcseconds.
    log10_false_alarm : float
        log10 of the false-alarm probability.
    """

    detected: int
    matched: int
    stars_expected: float | None
    rms_px: float
    rms_arcsec: float
    log10_false_alarm: float


@dataclass(frozen=True, slots=True)
class Limit:
    """Limiting magnitude of a frame, in V. Unknown values are None.

    Attributes
    ----------
    limit50_vmag, limit50_sigma_mag : float or None
        Magnitude at which half of the catalog's stars are detected, and its standard error.
    limit50_reason : str or None
        Why there is no limiting magnitude.
    faintest_vmag : float or None
        V magnitude of the faintest identified star.
    predicted_limit_vmag : float or None
        Predicted magnitude at which the camera detects half of the stars.
    limit_difference_mag, limit_difference_sigma_mag : float or None
        Measured minus predicted limit, and the standard error of the measured one.
    expected_faintest_vmag, expected_faintest_sigma_mag : float or None
        Predicted faintest star detected by the camera in this field, and its scatter.
    """

    limit50_vmag: float | None
    limit50_sigma_mag: float | None
    limit50_reason: str | None
    faintest_vmag: float | None
    predicted_limit_vmag: float | None
    limit_difference_mag: float | None
    limit_difference_sigma_mag: float | None
    expected_faintest_vmag: float | None
    expected_faintest_sigma_mag: float | None
