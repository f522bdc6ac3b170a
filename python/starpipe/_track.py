"""The attitude from frame to frame."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _starpipe
from ._attitude import ARCSEC_PER_RAD, Attitude, quantity
from ._camera import PathLike
from ._hints import seconds, whole_number
from ._images import Image, ImageLike
from ._options import SolveOptions, solve_options, takes_options
from ._pipeline import Pipeline

if TYPE_CHECKING:
    from astropy.time import Time, TimeDelta
    from astropy.units import Quantity
    from typing_extensions import Unpack


class Track(Attitude):
    """Result of tracking for a frame. Its truth value is True if the attitude is known.

    Pixels are as in `Result`.
    """

    def __init__(self, report: dict[str, Any]) -> None:
        self._report = report

    def __bool__(self) -> bool:
        return self._report["attitude"] is not None

    def __repr__(self) -> str:
        report = self._report
        if not self:
            return f"<Track {report['frame']}: {self.mode} ({report['reason_code']})>"
        attitude = report["attitude"]
        return (
            f"<Track {report['frame']}: {self.mode}, ra {attitude['ra_deg']:.4f}° "
            f"dec {attitude['dec_deg']:+.4f}°, {self.stars_used} stars>"
        )

    @property
    def mode(self) -> Literal["tracked", "acquired", "lost"]:
        """How the attitude was found: in windows around predicted stars, or by a full solution."""
        return self._report["mode"]  # type: ignore[no-any-return]

    @property
    def reason(self) -> str | None:
        """Why the attitude is not known."""
        return self._report["reason"]  # type: ignore[no-any-return]

    @property
    def _attitude(self) -> dict[str, Any] | None:
        attitude: dict[str, Any] | None = self._report["attitude"]
        return attitude

    @property
    def attitude_covariance(self) -> NDArray[np.float64] | None:
        """Covariance of small rotations about the camera's x, y and z axes, in rad²."""
        attitude = self._attitude
        if attitude is None:
            return None
        covariance = np.array(attitude["covariance_arcsec2"], dtype=np.float64)
        return covariance / ARCSEC_PER_RAD**2

    @property
    def rate(self) -> Quantity | None:
        """Angular rate of the camera about its x, y and z axes, in degrees per second.

        It is in degrees per frame if times are not given, and None before the second attitude.
        """
        return self._rate("")

    @property
    def rate_err(self) -> Quantity | None:
        """Standard errors of `rate`."""
        return self._rate("_sigma")

    def _rate(self, what: str) -> Quantity | None:
        for per, unit in (("s", "deg / s"), ("frame", "deg")):
            rate = self._report[f"rate{what}_deg_{per}"]
            if rate is not None:
                return quantity([rate["x"], rate["y"], rate["z"]], unit)
        return None

    @property
    def stars_used(self) -> int:
        """Number of stars to which the attitude was fitted."""
        return self._report["stars_used"]  # type: ignore[no-any-return]

    def to_dict(self) -> dict[str, Any]:
        """Return all numbers as the JSON of ``starpipe track`` has them."""
        copy: dict[str, Any] = json.loads(json.dumps(self._report))
        return copy


class Tracker:
    """Follow the attitude of a camera from frame to frame.

    If the attitude and the angular rate are known, only windows around predicted stars are read.
    The first two frames are solved in full, and so are frames whose stars are not at the predicted
    positions.

    Parameters
    ----------
    pipeline : Pipeline, optional
        Catalog and camera; those of ``Pipeline()`` by default.
    stars : int
        Maximum number of stars to measure in a frame.
    dark, flat : image, optional
        Master dark to subtract, and master flat to divide by, as for `Pipeline.solve`.
    **options
        Options for all frames, see `SolveOptions`.

    Raises
    ------
    ValueError
        If an argument is out of range.
    """

    @takes_options
    def __init__(
        self,
        pipeline: Pipeline | None = None,
        *,
        stars: int = 30,
        dark: ImageLike | None = None,
        flat: ImageLike | None = None,
        **options: Unpack[SolveOptions],
    ) -> None:
        pipeline = Pipeline() if pipeline is None else pipeline
        self._masters = (
            None if dark is None else Image(dark, "dark").pixels,
            None if flat is None else Image(flat, "flat").pixels,
        )
        self._bias_adu = pipeline._pipeline.bias_adu
        self._tracker = _starpipe.Tracker(
            pipeline._pipeline, solve_options(**options), whole_number(stars, "stars", 4)
        )

    def track(
        self,
        image: ImageLike,
        mask: ArrayLike | None = None,
        *,
        time: Time | TimeDelta | Quantity | float | None = None,
        name: PathLike | None = None,
    ) -> Track:
        """Return the attitude of the next frame.

        Parameters
        ----------
        image, mask, name
            As for `Pipeline.solve`.
        time : Time, TimeDelta, Quantity or float, optional
            Middle of the exposure; a number is in seconds from any origin. Without it frames are
            assumed to have equal intervals, and rates are per frame.

        Raises
        ------
        OSError
            If a file cannot be read.
        ValueError
            If the file has no image, or an argument is out of range.
        RuntimeError
            If starpipe has a bug.
        """
        frame = Image(image).input(name, mask, *self._masters, self._bias_adu)
        return Track(json.loads(self._tracker.track(frame, seconds(time, "time"))))

    def reset(self) -> None:
        """Forget all frames: the next one is solved in full."""
        self._tracker.reset()
