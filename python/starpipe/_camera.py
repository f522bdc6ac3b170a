"""Arguments of the extension module for cameras, conditions and scenes."""

from __future__ import annotations

import os
from typing import Any

from ._hints import number, positive

PathLike = str | os.PathLike[str]

UNITS = ("mm", "um", "nm", "s", "deg")
"""Units at the end of a parameter's name, to which a Quantity is converted."""


def stated(
    camera: PathLike, exposure: Any, reading: str | None, parameters: dict[str, Any]
) -> dict[str, Any]:
    """Return a camera, its conditions and a scene as the extension module expects them."""
    readings = {None: None, "paper": True, "physical": False}
    if reading not in readings:
        raise ValueError(f"reading must be 'paper' or 'physical', not {reading!r}")
    values: list[tuple[str, float]] = []
    for name, value in parameters.items():
        unit = name.rpartition("_")[2]
        found = number(value, unit if unit in UNITS else "", name)
        if found is not None:
            values.append((name, found))
    exposure_s = positive(exposure, "s", "exposure")
    if exposure_s is not None:
        values.append(("exposure_s", exposure_s))
    return {"camera": camera, "is_paper": readings[reading], "values": values}
