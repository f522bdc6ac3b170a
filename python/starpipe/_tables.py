"""Tables of stars, and of other rows."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _starpipe

Columns = dict[str, NDArray[Any]]

STAR_COLUMNS = {name: meaning for name, *meaning in _starpipe.star_columns()}
"""Unit, UCD and description of each column of stars."""


def star_columns(stars: list[dict[str, Any]]) -> Columns:
    """Return the reports of stars as arrays; NaN and "" where there is no value."""

    def numbers(key: str) -> NDArray[np.float64]:
        return np.array([star[key] for star in stars], dtype=np.float64)

    def texts(key: str) -> NDArray[np.str_]:
        return np.array([star[key] or "" for star in stars], dtype=np.str_)

    flux, snr = numbers("flux"), numbers("snr")
    return {
        "id": texts("id"),
        "name": texts("name"),
        "x_centroid": numbers("x"),
        "y_centroid": numbers("y"),
        "x_centroid_err": numbers("sigma_x"),
        "y_centroid_err": numbers("sigma_y"),
        "flux": flux,
        "flux_err": flux / snr,
        "peak": numbers("peak"),
        "snr": snr,
        "flags": np.array([",".join(star["flags"]) for star in stars], dtype=np.str_),
        "ra": numbers("ra_deg"),
        "dec": numbers("dec_deg"),
        "vmag": numbers("vmag"),
        "residual": numbers("residual_px"),
        "p_chance": numbers("p_chance"),
    }


def star_table(named: Columns) -> Any:
    """Return columns of stars as a ``QTable`` with units, UCDs and descriptions.

    Without astropy they are returned as they are.
    """
    found = table(named, {name: STAR_COLUMNS[name][0] for name in named})
    if found is not named:
        for name in found.colnames:
            _, ucd, found[name].info.description = STAR_COLUMNS[name]
            found[name].info.meta = {"ucd": ucd}
    return found


def flat(stars: Any) -> Any:
    """Return a table of stars with right ascension and declination as columns of their own."""
    from astropy.table import Table

    found = Table(stars, copy=False)
    for name in ("dec", "ra"):
        if "sky_centroid" in found.colnames:
            angle = getattr(stars["sky_centroid"], name).deg
            _, ucd, description = STAR_COLUMNS[name]
            place = found.colnames.index("sky_centroid") + 1
            found.add_column(angle, name=name, index=place)
            found[name].info.unit = "deg"
            found[name].info.description = description
            found[name].info.meta = {"ucd": ucd}
    if "sky_centroid" in found.colnames:
        found.remove_column("sky_centroid")
    return found


def columns(rows: list[dict[str, Any]]) -> Columns:
    """Return rows of equal keys as arrays; NaN and "" where there is no value."""
    names: Iterable[str] = rows[0] if rows else ()
    return {name: _column([row[name] for row in rows]) for name in names}


def _column(values: list[Any]) -> NDArray[Any]:
    if any(isinstance(value, str) for value in values):
        return np.array([value or "" for value in values], dtype=np.str_)
    if any(value is None for value in values):
        return np.array(values, dtype=np.float64)
    return np.array(values)


def table(named: Columns, units: dict[str, str]) -> Any:
    """Return columns as a ``QTable``; without astropy as they are."""
    try:
        from astropy.table import QTable
    except ImportError:
        return named
    found = QTable(named)
    for name, unit in units.items():
        if unit and name in found.colnames:
            found[name].unit = unit
    return found
