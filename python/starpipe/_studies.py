"""Predictions and studies: their results are the program's JSON."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from . import _starpipe, _tables
from ._camera import PathLike, stated
from ._darks import Darks
from ._hints import positive, thread_count, whole_number, within

if TYPE_CHECKING:
    from astropy.table import QTable
    from astropy.units import Quantity


def limit(
    camera: PathLike,
    *,
    exposure: Quantity | float | None = None,
    reading: Literal["paper", "physical"] | None = None,
    **parameters: float,
) -> dict[str, Any]:
    """Predict the limiting magnitude of a camera.

    Parameters
    ----------
    camera : path or str
        A description of the camera (TOML), or the name of a preset.
    exposure : Quantity or float, optional
        Exposure in seconds.
    reading : {'paper', 'physical'}, optional
        The equations as used by Tong, Li & Wang (2014), or with physical errors corrected.
    **parameters
        Other parameters of camera and conditions, named like the program's options, such as
        ``aperture_mm`` or ``sky_mag_arcsec2``.

    Returns
    -------
    dict
        The JSON of ``starpipe limit``: ``limit_vmag``, ``snr``, ``detector``, ...
    """
    found: dict[str, Any] = json.loads(
        _starpipe.limit(stated(camera, exposure, reading, parameters))
    )
    return found


class Validation:
    """Simulated frames, solved and compared with the truth.

    Attributes
    ----------
    summary : dict
        The ``summary.json`` of ``starpipe validate``.
    """

    def __init__(self, report: dict[str, Any]) -> None:
        self.summary: dict[str, Any] = report["summary"]
        self._frames = report["frames"]
        self._stars = report["stars"]

    def __repr__(self) -> str:
        found = self.summary["identification"]
        return (
            f"<Validation: {found['frames']} frames, {found['right']} right, "
            f"{found['wrong']} wrong, {found['none']} not identified>"
        )

    @property
    def frames(self) -> QTable:
        """A row for each frame, as a ``QTable`` or a dict of arrays."""
        return _tables.table(_tables.columns(self._frames), {})

    @property
    def stars(self) -> QTable:
        """A row for each true star and each other detection, as a ``QTable`` or a dict."""
        return _tables.table(_tables.columns(self._stars), {})


def validate(
    camera: PathLike,
    *,
    count: int = 100,
    seed: int = 1,
    scale_known: bool = True,
    threads: int = 1,
    exposure: Quantity | float | None = None,
    catalog: PathLike | None = None,
    **parameters: float,
) -> Validation:
    """Simulate frames at random attitudes, solve them, and compare them with the truth.

    All rows are kept in memory; ``starpipe validate`` writes them to files, and continues
    interrupted runs.

    Parameters
    ----------
    camera, exposure, catalog, **parameters
        As for `simulate`.
    count, seed : int
        Number of frames, and seed of the random numbers.
    scale_known : bool
        Whether the camera's description is given to the pipeline.
    threads : int
        Number of threads; results do not depend on it.
    """
    report = _starpipe.validate(
        stated(camera, exposure, None, parameters),
        catalog,
        whole_number(count, "count", 1),
        whole_number(seed, "seed", 0),
        bool(scale_known),
        thread_count(threads),
    )
    return Validation(json.loads(report))


def robustness(
    *,
    fov: Quantity | float | None = None,
    count: int = 2000,
    seed: int = 1,
    threads: int = 1,
    stars: float = 30.0,
    centroid_error: float = 0.3,
    mag_error: float = 0.2,
    missing: float = 15.0,
    false: float = 15.0,
    scale_error: float | None = 10.0,
    shape: tuple[int, int] = (1024, 1024),
    catalog: PathLike | None = None,
) -> list[dict[str, Any]]:
    """Measure how often identification is right, on simulated lists of centroids.

    Parameters
    ----------
    fov : Quantity or float, optional
        Horizontal field of view in degrees, for one row. Without it the standard table is computed:
        five fields of view, then one condition at a time made worse.
    count, seed, threads : int
        Trials of each row, seed of the random numbers, and number of threads.
    stars : float
        Mean number of catalog stars on a frame.
    centroid_error, mag_error : float
        Standard deviations, in pixels and magnitudes.
    missing, false : float
        Stars that are missing, and false stars, in percent of the stars.
    scale_error : float or None
        Largest error of the field of view, in percent; if None, the field of view is not given.
    shape : (int, int)
        Rows and columns of the frame.
    catalog : path, optional
        Star catalog instead of the built-in one.

    Returns
    -------
    list of dict
        The rows in the JSON of ``starpipe validate --suite robustness``.
    """
    lists = {
        "fov_deg": positive(fov, "deg", "fov", 179.0),
        "stars": positive(stars, "", "stars"),
        "centroid_error_px": within(centroid_error, "", "centroid_error", 0.0),
        "mag_error": within(mag_error, "", "mag_error", 0.0),
        "missing_percent": within(missing, "percent", "missing", 0.0, 100.0),
        "false_stars_percent": within(false, "percent", "false", 0.0, 1e4),
        "scale_error_percent": positive(scale_error, "percent", "scale_error", 100.0),
        "shape": tuple(whole_number(side, "shape", 3) for side in shape),
    }
    rows: list[dict[str, Any]] = json.loads(
        _starpipe.robustness(
            lists,
            catalog,
            whole_number(count, "count", 1),
            whole_number(seed, "seed", 0),
            thread_count(threads),
        )
    )
    return rows


def defocus(
    camera: PathLike | None = None,
    *,
    vmag: ArrayLike = (),
    required_error: ArrayLike = (),
    darks: Darks | None = None,
    count: int | None = None,
    seed: int = 1,
    threads: int = 1,
    exposure: Quantity | float | None = None,
    **parameters: float,
) -> dict[str, Any]:
    """Measure the centroid error as a function of the spot radius, and the best radius.

    Parameters
    ----------
    camera : path or str, optional
        A camera; without one, the experiment of Wang et al. (2019) is repeated.
    vmag : float or list
        V magnitudes of the stars; by default 1.5 mag brighter than the camera's limit.
    required_error : float or list
        Required errors in pixels; the radii that meet them are reported.
    darks : Darks, optional
        Dark frames from which the noise is taken.
    count, seed, threads : int
        Stars at each point of the grid, seed of the random numbers, and number of threads.
    exposure, **parameters
        As for `limit`.

    Returns
    -------
    dict
        The JSON of ``starpipe defocus``.
    """
    if camera is None and (exposure is not None or parameters or np.size(vmag)):
        raise ValueError("vmag, exposure and other numbers need a camera: give one")
    report = _starpipe.defocus(
        None if camera is None else stated(camera, exposure, None, parameters),
        None if darks is None else darks._darks,
        [float(value) for value in np.ravel(vmag)],
        [float(value) for value in np.ravel(required_error)],
        None if count is None else whole_number(count, "count", 1),
        whole_number(seed, "seed", 0),
        thread_count(threads),
    )
    found: dict[str, Any] = json.loads(report)
    return found
