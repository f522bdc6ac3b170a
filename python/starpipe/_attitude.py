"""Attitude of a camera."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from astropy.coordinates import SkyCoord
    from astropy.units import Quantity
    from scipy.spatial.transform import Rotation

ARCSEC_PER_RAD = 180.0 * 3600.0 / np.pi


class Attitude:
    """The attitude of a camera in a frame; its values are `None` if unknown."""

    @property
    def _attitude(self) -> dict[str, Any] | None:
        """As in the program's JSON."""
        raise NotImplementedError

    @property
    def quaternion(self) -> NDArray[np.float64] | None:
        """Rotation of ICRS vectors into camera axes: [w, x, y, z], w ≥ 0."""
        attitude = self._attitude
        return None if attitude is None else np.array(attitude["quaternion"])

    @property
    def rotation(self) -> Rotation | None:
        """`quaternion` as a ``scipy.spatial.transform.Rotation``."""
        from scipy.spatial.transform import Rotation

        quaternion = self.quaternion
        return None if quaternion is None else Rotation.from_quat(np.roll(quaternion, -1))

    @property
    def center(self) -> SkyCoord | None:
        """Direction of the frame's center, or of the lens axis for lenses other than pinholes."""
        from astropy.coordinates import SkyCoord

        attitude = self._attitude
        if attitude is None:
            return None
        return SkyCoord(attitude["ra_deg"], attitude["dec_deg"], unit="deg", frame="icrs")

    @property
    def center_err(self) -> Quantity | None:
        """Standard errors of `center` along the rows and along the columns, in arcseconds."""
        # A turn about an axis moves the centre along the other one.
        return self._sigma("y", "x")

    @property
    def roll(self) -> Quantity | None:
        """Position angle of the image's up direction, toward the first row, in degrees.

        At `center`, from north through east, in (-180, 180].
        """
        attitude = self._attitude
        return None if attitude is None else quantity(attitude["up_pa_deg"], "deg")

    @property
    def roll_err(self) -> Quantity | None:
        """Standard error of the angle about the boresight, in arcseconds."""
        return self._sigma("roll")

    def _sigma(self, *axes: str) -> Quantity | None:
        attitude = self._attitude
        if attitude is None:
            return None
        sigma = [attitude["sigma_arcsec"][axis] for axis in axes]
        return quantity(sigma if len(sigma) > 1 else sigma[0], "arcsec")


def quantity(value: Any, unit: str) -> Quantity:
    """Return `value` as a Quantity in `unit`; None becomes NaN."""
    from astropy.units import Quantity

    return Quantity(np.array(value, dtype=np.float64), unit)
