"""Simulated frames."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _starpipe, _tables
from ._camera import PathLike, stated
from ._hints import direction, iso_date, number, whole_number, within
from ._result import wcs_of

if TYPE_CHECKING:
    from astropy.coordinates import Angle
    from astropy.table import QTable
    from astropy.units import Quantity
    from astropy.wcs import WCS

    from ._options import DateLike


class Simulation:
    """A simulated frame with its truth.

    Attributes
    ----------
    image : ndarray
        Gray levels, in the smallest integer type that holds the camera's bit depth.
    quaternion : ndarray or None
        Rotation of ICRS vectors into camera axes: [w, x, y, z].
    limit_vmag : float or None
        Predicted limiting magnitude: V at which half of the stars are detected.
    exposure_s : float
        Exposure in seconds.
    """

    def __init__(self, simulated: _starpipe.Simulated) -> None:
        levels = simulated.pixels.reshape(simulated.shape)
        bits = simulated.bits
        self.image: NDArray[Any] = levels
        if bits <= 16:
            self.image = levels.astype(np.uint8 if bits <= 8 else np.uint16)
        self._truth = simulated.truth
        self._wcs_header = simulated.wcs_header
        quaternion = simulated.quaternion
        self.quaternion = None if quaternion is None else np.array(quaternion)
        self.limit_vmag = simulated.limit_vmag
        self.exposure_s = simulated.exposure_s

    def __repr__(self) -> str:
        rows, columns = self.image.shape
        what = f"{len(self.stars)} stars" if self._truth else "no stars"
        return f"<Simulation {columns} x {rows}: {what}>"

    @property
    def wcs(self) -> WCS | None:
        """True world coordinates, without distortion."""
        shape = self.image.shape
        return None if self._wcs_header is None else wcs_of(self._wcs_header, shape)

    @property
    def columns(self) -> _tables.Columns:
        """True objects on the frame, as arrays: stars, false stars, trails and cosmic rays."""
        return _tables.columns(json.loads(self._truth or "[]"))

    @property
    def stars(self) -> QTable:
        """True objects on the frame as a ``QTable``, or `columns` without astropy."""
        units = {"vmag": "mag", "bv_mag": "mag", "ra_deg": "deg", "dec_deg": "deg"}
        places = dict.fromkeys(("x", "y", "x_end", "y_end"), "pix")
        return _tables.table(self.columns, units | places | {"electrons": "electron"})


def simulate(
    camera: PathLike,
    *,
    ra: Angle | Quantity | float | None = None,
    dec: Angle | Quantity | float | None = None,
    roll: Angle | Quantity | float = 0.0,
    dark: bool = False,
    flat: float | None = None,
    date: DateLike | None = None,
    seed: int = 1,
    frame: int = 0,
    exposure: Quantity | float | None = None,
    catalog: PathLike | None = None,
    **parameters: float,
) -> Simulation:
    """Simulate a frame.

    Parameters
    ----------
    camera : path or str
        A description of the camera (TOML), or the name of a preset.
    ra, dec, roll : Angle or float, optional
        Center of the frame and position angle of the image's up direction, in degrees. Without them
        the pointing is random, uniform over all rotations.
    dark : bool
        Simulate a dark frame: the shutter is closed.
    flat : float, optional
        Simulate a flat field: the same light on each pixel, in electrons.
    date : Time, datetime or str, optional
        Date for proper motion; 2000 by default.
    seed, frame : int
        Seed of the random numbers, and number of the frame. ``starpipe simulate`` with the same
        two numbers simulates the same frame.
    exposure : Quantity or float, optional
        Exposure in seconds.
    catalog : path, optional
        Star catalog instead of the built-in one.
    **parameters
        Other parameters of camera, conditions and scene, named like the program's options, such as
        ``read_noise_e`` or ``satellite_trails``.

    Raises
    ------
    OSError
        If a file cannot be read.
    ValueError
        If an argument is out of range or unknown.
    """
    subject: tuple[float, float, float] | float | str
    if dark or flat is not None:
        if ra is not None or dec is not None or (dark and flat is not None):
            raise ValueError("ra and dec, dark, and flat are alternatives: give one")
        light = within(flat, "electron", "flat", 0.0)
        subject = "dark" if light is None else light
    elif ra is None and dec is None:
        subject = "random"
    else:
        if ra is None or dec is None:
            raise ValueError("ra and dec belong together: give both")
        pointing = direction((ra, dec))
        angle = number(roll, "deg", "roll")
        assert pointing is not None and angle is not None
        subject = pointing[0], pointing[1], angle
    simulated = _starpipe.simulate(
        stated(camera, exposure, None, parameters),
        subject,
        catalog,
        iso_date(date),
        whole_number(seed, "seed", 0),
        whole_number(frame, "frame", 0),
    )
    return Simulation(simulated)
