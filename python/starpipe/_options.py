"""Options for solving frames."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, TypedDict, TypeVar

from . import _starpipe
from ._hints import (
    air_at_site,
    direction,
    header_date,
    header_exposure,
    iso_date,
    number,
    pixel_angle,
    site,
    utc_offset_text,
    velocity_km_s,
)

if TYPE_CHECKING:
    import datetime

    import numpy as np
    from astropy.coordinates import Angle, CartesianRepresentation, EarthLocation, SkyCoord
    from astropy.time import Time
    from astropy.units import Quantity
    from numpy.typing import ArrayLike

    DateLike: TypeAlias = Time | datetime.datetime | datetime.date | np.datetime64 | str


class SolveOptions(TypedDict, total=False):
    """Options for solving frames. All options may be omitted.

    Parameters
    ----------
    fov, pixel_scale : Quantity or float
        Horizontal field of view (degrees), or pixel scale (arcseconds, or arcseconds per pixel).
    scale_error : Quantity or float
        Tolerance of `fov` or `pixel_scale`, in percent; 10 by default.
    near : SkyCoord or (ra, dec)
        Approximate direction of the frame's center, in degrees.
    radius : Angle or float
        Maximum distance of the frame's center from `near`, in degrees; 10 by default.
    date : Time, datetime or str
        Date and time of the frame, in UTC; by default from the header or the file name.
    utc_offset : Quantity, float or "auto"
        Offset of local time from UTC in hours, positive if ahead, for times in file names and
        in Exif that state no offset. "auto" determines it from the stars and `site`.
    site : EarthLocation or (latitude, longitude[, height])
        Site of the camera, in degrees and meters.
    air : (pressure, temperature)
        The air at the site, in hPa and °C, for refraction; by default the standard atmosphere.
    velocity : CartesianRepresentation or (vx, vy, vz)
        Velocity of a spacecraft relative to the Earth's center in km/s, along the axes of ICRS.
    frame_of : {"icrs", "apparent"}
        Star directions that the attitude refers to: those of the catalog, or the apparent ones,
        with aberration and refraction.
    exposure : Quantity or float
        Exposure in seconds; by default from the header.
    zenith_distance : Angle or float
        Zenith distance of the frame's center in degrees, for the predicted limiting magnitude.
    extinction : Quantity or float
        Extinction in magnitudes per airmass, for the predicted limiting magnitude.
    sigma : float
        Detection threshold in standard deviations of the background, instead of `false_alarms`.
    false_alarms : float
        Accepted rate of false detections per million pixels of noise; 0.1 by default.
    max_stars : int
        Measure only this many of the brightest stars.
    centroid : {"gaussian-fit", "grey-weighted"}
        How to measure the position of a star; "gaussian-fit" (default) is the most accurate.
    name_odds : float
        Minimum odds, `name_odds` to 1, that the name of a star is right; 100 by default.
    effort : {"fast", "normal", "thorough"}
        Effort of the search if the brightest stars do not identify a frame.
    refine_lens : bool
        Fit the lens to each frame, even if the camera's description has a measured one.
    attitude_only : bool
        Measure attitude and optics only, and name only the brightest stars.
    sky : bool
        Measure brightness, extinction and clouds in each part of the sky: `Result.sky_map`.
    trails : bool
        Search for trails of satellites, aircraft and meteors: `Result.trails`.
    time_limit : Quantity or float
        Time limit for a frame, in seconds. No limit by default.
    """

    fov: Quantity | float | None
    pixel_scale: Quantity | float | None
    scale_error: Quantity | float
    near: SkyCoord | tuple[float, float] | None
    radius: Angle | Quantity | float
    date: DateLike | None
    utc_offset: Quantity | float | Literal["auto"] | None
    site: EarthLocation | tuple[float, ...] | None
    air: tuple[Quantity | float, Quantity | float] | None
    velocity: CartesianRepresentation | Quantity | ArrayLike | None
    frame_of: Literal["icrs", "apparent"]
    exposure: Quantity | float | None
    zenith_distance: Angle | Quantity | float | None
    extinction: Quantity | float | None
    sigma: float | None
    false_alarms: float | None
    max_stars: int | None
    centroid: Literal["gaussian-fit", "grey-weighted"] | None
    name_odds: float
    effort: Literal["fast", "normal", "thorough"]
    refine_lens: bool
    attitude_only: bool
    sky: bool
    trails: bool
    time_limit: Quantity | float | None


_UNITS = {
    "fov": "deg",
    "scale_error": "percent",
    "radius": "deg",
    "exposure": "s",
    "zenith_distance": "deg",
    "extinction": "mag",
    "sigma": "",
    "false_alarms": "",
    "max_stars": "",
    "name_odds": "",
    "time_limit": "s",
}
"""Units of numeric options."""

_VALUES: dict[str, Callable[[Any], Any]] = {
    "pixel_scale": pixel_angle,
    "near": direction,
    "date": iso_date,
    "utc_offset": utc_offset_text,
    "site": site,
    "air": air_at_site,
    "velocity": velocity_km_s,
    "refine_lens": bool,
    "attitude_only": bool,
    "sky": bool,
    "trails": bool,
}
"""Functions that convert the values of the other options to plain values."""


def _text(name: str, value: Any) -> str:
    """Return the value of an option as the command line takes it."""
    value = number(value, _UNITS[name], name) if name in _UNITS else value
    value = _VALUES[name](value) if name in _VALUES else value
    if isinstance(value, bool):
        return str(value).lower()
    return ",".join(map(repr, value)) if isinstance(value, tuple) else str(value)


def solve_options(header: Any = None, **options: Any) -> dict[str, str]:
    """Return options for the extension module, completed from a header."""
    for name in options.keys() - SolveOptions.__annotations__.keys():
        raise TypeError(f"unexpected keyword argument {name!r}")
    header = {} if header is None else header
    known = {"date": header_date(header), "exposure": header_exposure(header)}
    known |= {name: value for name, value in options.items() if value is not None}
    if {"fov", "pixel_scale"} <= known.keys():
        raise ValueError("fov and pixel_scale are alternatives: give one")
    if "air" in known and "site" not in known:
        raise ValueError("air needs a site: give the site, too")
    stated = {name: _text(name, value) for name, value in known.items() if value is not None}
    _starpipe.check_options(stated)
    return stated


_Function = TypeVar("_Function", bound=Callable[..., Any])


def takes_options(function: _Function) -> _Function:
    """Replace ``**options`` in a function's signature by the options of `SolveOptions`."""
    signature = inspect.signature(function)
    own = list(signature.parameters.values())[:-1]
    stated = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None)
        for name in SolveOptions.__annotations__
    ]
    function.__signature__ = signature.replace(parameters=own + stated)  # type: ignore[attr-defined]
    return function
