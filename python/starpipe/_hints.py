"""Conversion of hints, as plain numbers or objects of astropy, to plain numbers."""

from __future__ import annotations

import datetime
import os
from typing import Any

import numpy as np


def number(value: Any, unit: str, name: str) -> float | None:
    """Return `value` in `unit`: plain numbers are unchanged, a Quantity is converted."""
    if value is None:
        return None
    if hasattr(value, "to_value") and hasattr(value, "unit"):
        try:
            value = value.to_value(unit)
        except Exception as error:
            wanted = f"convertible to {unit}" if unit else "a plain number"
            raise ValueError(f"{name} must be {wanted}: {error}") from error
    try:
        number = float(value)
    except (TypeError, ValueError) as error:
        quantity = f" or a Quantity in {unit}" if unit else ""
        raise ValueError(f"{name} must be a number{quantity}: {error}") from error
    if not np.isfinite(number):
        raise ValueError(f"{name} must be a finite number, not {number}")
    return number


def positive(value: Any, unit: str, name: str, below: float = np.inf) -> float | None:
    """Return `value` in `unit`; it must be positive and less than `below`."""
    found = number(value, unit, name)
    if found is not None and not 0.0 < found < below:
        limit = f" and less than {below:g}" if np.isfinite(below) else ""
        kind = f"{limit} {unit}" if unit else limit
        raise ValueError(f"{name} must be more than 0{kind}, not {found:g}")
    return found


def within(value: Any, unit: str, name: str, least: float, most: float = np.inf) -> float | None:
    """Return `value` in `unit`; it must be from `least` to `most`."""
    found = number(value, unit, name)
    if found is not None and not least <= found <= most:
        limits = f"at least {least:g}" if most == np.inf else f"from {least:g} to {most:g}"
        raise ValueError(f"{name} must be {limits} {unit}".rstrip() + f", not {found:g}")
    return found


def whole_number(value: Any, name: str, least: int) -> int:
    """Return `value` as a whole number; it must be at least `least`."""
    try:
        found = int(value)
        is_one = found == value and found >= least
    except (TypeError, ValueError, OverflowError):
        is_one = False
    if not is_one:
        raise ValueError(f"{name} must be a whole number of at least {least}, not {value}")
    return found


def pixel_angle(scale: Any) -> float | None:
    """Return the pixel scale in arcseconds, from an angle or an angle per pixel."""
    unit = getattr(scale, "unit", None)
    if unit is not None and unit.is_equivalent("deg / pix"):
        scale = scale.to_value("arcsec / pix")
    return number(scale, "arcsec", "pixel_scale")


def seconds(time: Any, name: str) -> float | None:
    """Return a time in seconds, from any origin."""
    if hasattr(time, "unix_tai"):
        time = time.unix_tai
    elif hasattr(time, "to_value") and not hasattr(time, "unit"):
        # Differences of times.
        time = time.to_value("s")
    return number(time, "s", name)


def thread_count(threads: Any) -> int:
    """Return how many threads to start: at most 8, or the number of processors if larger."""
    return min(whole_number(threads, "threads", 1), max(8, os.cpu_count() or 1))


def direction(near: Any) -> tuple[float, float]:
    """Return right ascension and declination in degrees."""
    if hasattr(near, "icrs"):
        near = near.icrs
        near = near.ra.deg, near.dec.deg
    try:
        ra, dec = near
    except (TypeError, ValueError) as error:
        raise ValueError("near must be a SkyCoord or (ra, dec) in degrees") from error
    ra_deg, dec_deg = number(ra, "deg", "near"), number(dec, "deg", "near")
    assert ra_deg is not None and dec_deg is not None
    return ra_deg % 360.0, dec_deg


def iso_date(date: Any) -> str | None:
    """Return a date as ISO 8601 in UTC."""
    if date is None or isinstance(date, str):
        return date
    if hasattr(date, "utc") and hasattr(date.utc, "isot"):
        return str(date.utc.isot)
    if isinstance(date, np.datetime64):
        return str(np.datetime_as_string(date, unit="ms"))
    if isinstance(date, (datetime.datetime, datetime.date)):
        return date.isoformat()
    raise ValueError(f"date must be ISO 8601, a Time or a datetime, not {type(date).__name__}")


def site(location: Any) -> tuple[float, float, float]:
    """Return latitude and longitude in degrees, and height in meters."""
    if hasattr(location, "geodetic"):
        place = location.geodetic
        return float(place.lat.deg), float(place.lon.deg), float(place.height.to_value("m"))
    values = tuple(location) if np.iterable(location) else ()
    if len(values) not in (2, 3):
        raise ValueError("site must be an EarthLocation or (latitude, longitude[, height])")
    units = (("deg", "latitude"), ("deg", "longitude"), ("m", "height"))
    found = [number(value, *unit) for value, unit in zip(values, units, strict=False)]
    lat, lon, height = [*found, 0.0][:3]
    assert lat is not None and lon is not None and height is not None
    return lat, lon, height


def air_at_site(air: Any) -> tuple[float, float]:
    """Return pressure in hPa and temperature in °C."""
    if not np.iterable(air) or len(tuple(air)) != 2:
        raise ValueError("air must be (pressure, temperature)")
    pressure, temperature = air
    if hasattr(temperature, "to_value"):
        from astropy.units import temperature as converted

        temperature = temperature.to_value("deg_C", equivalencies=converted())
    hpa, celsius = number(pressure, "hPa", "pressure"), number(temperature, "", "temperature")
    assert hpa is not None and celsius is not None
    return hpa, celsius


def utc_offset_text(offset: Any) -> str:
    """Return the offset of local time from UTC in the format of the command line."""
    return offset if isinstance(offset, str) else str(number(offset, "h", "utc_offset"))


def velocity_km_s(velocity: Any) -> tuple[float, float, float]:
    """Return a velocity in km/s along three axes."""
    if hasattr(velocity, "get_xyz"):
        velocity = velocity.get_xyz()
    along = tuple(velocity) if np.iterable(velocity) else ()
    if len(along) != 3:
        raise ValueError("velocity must be (vx, vy, vz)")
    found = [number(value, "km/s", "velocity") for value in along]
    x, y, z = found
    assert x is not None and y is not None and z is not None
    return x, y, z


def header_date(header: Any) -> str | None:
    """Return the date of a header; an invalid date is ignored, as in files."""
    text = str(header.get("DATE-OBS", "")).strip()
    try:
        return None if np.isnat(np.datetime64(text.removesuffix("Z"))) else text
    except ValueError:
        return None


def header_exposure(header: Any) -> float | None:
    """Return the exposure of a header in seconds, or None if it is missing or implausible."""
    value = header.get("EXPTIME", header.get("EXPOSURE"))
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return float(value) if is_number and 1e-6 <= value <= 1e6 else None
