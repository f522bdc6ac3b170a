"""Tables of stars and of other rows."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _starpipe

Columns = dict[str, NDArray[Any]]

OF_FRAME = ("frame", "row_order")
STAR_COLUMNS = {
    name: meaning for name, *meaning in _starpipe.star_columns() if name not in OF_FRAME
}
"""Type, unit, UCD and description of each column of stars: the fields of a star in JSON."""


def star_columns(stars: list[dict[str, Any]]) -> Columns:
    """Return stars as arrays; missing values are NaN or ""."""

    def values(name: str, kind: str) -> NDArray[Any]:
        found = [star.get(name) for star in stars]
        if kind == "number":
            return np.array(found, dtype=np.float64)
        # Flags are a list.
        words = [value if isinstance(value, str) else " ".join(value or ()) for value in found]
        return np.array(words, dtype=np.str_)

    return {name: values(name, kind) for name, (kind, *_) in STAR_COLUMNS.items()}


def star_table(named: Columns, *, plain: bool = False) -> Any:
    """Return columns of stars as a ``QTable`` with units, UCDs and descriptions.

    With `plain`, return a ``Table`` whose cells are plain numbers. Without astropy, return `named`
    unchanged.
    """
    found = table(named, {name: STAR_COLUMNS[name][1] for name in named}, plain=plain)
    if found is not named:
        for name in found.colnames:
            _, _, ucd, found[name].info.description = STAR_COLUMNS[name]
            found[name].info.meta = {"ucd": ucd}
    return found


def columns(rows: list[dict[str, Any]]) -> Columns:
    """Return rows with the same keys as arrays; missing values are NaN or ""."""
    names: Iterable[str] = rows[0] if rows else ()
    return {name: _column([row[name] for row in rows]) for name in names}


def _column(values: list[Any]) -> NDArray[Any]:
    if any(isinstance(value, str) for value in values):
        return np.array([value or "" for value in values], dtype=np.str_)
    if any(value is None for value in values):
        return np.array(values, dtype=np.float64)
    return np.array(values)


def table(named: Columns, units: dict[str, str], *, plain: bool = False) -> Any:
    """Return columns as a ``QTable`` or plain ``Table``, or unchanged without astropy."""
    try:
        from astropy.table import QTable, Table
    except ImportError:
        return named
    found = Table(named) if plain else QTable(named)
    for name, unit in units.items():
        if unit and name in found.colnames:
            found[name].unit = unit
    return found
