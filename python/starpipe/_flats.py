"""Evenly lit frames."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _starpipe
from ._camera import PathLike
from ._images import Image, ImageLike


class Flats:
    """Properties of a detector, measured with flats.

    Attributes
    ----------
    report : dict
        As the JSON of ``starpipe flats``: gain, read noise, nonuniformity, what is missing.
    """

    def __init__(self, flats: _starpipe.Flats) -> None:
        self._flats = flats
        self.report: dict[str, Any] = json.loads(flats.json())

    def __repr__(self) -> str:
        rows, columns = self._flats.shape
        nonuniformity = self.report["nonuniformity_percent"]
        return f"<Flats {columns} x {rows}: response varies by {nonuniformity:.2g} %>"

    @property
    def master(self) -> NDArray[np.float32]:
        """Response of each pixel, with a mean of 1: a flat for `Pipeline.solve`.

        NaN if unknown.
        """
        return self._flats.master().reshape(self._flats.shape)


def flats(
    images: Iterable[ImageLike],
    *,
    dark: ImageLike | None = None,
    camera: PathLike | None = None,
) -> Flats:
    """Measure response, gain and read noise on evenly lit frames.

    The first and second frame are a pair with the same light, and so on: the gain follows from the
    noise of such pairs. Frames are read one after the other; none is kept.

    Parameters
    ----------
    images : iterable
        Frames as `Pipeline.solve` takes them.
    dark : image, optional
        Frame taken without light, or the mean of many, see `Darks.masters`.
    camera : path or str, optional
        A description of the camera (TOML), or the name of a preset: its bias if there is no dark,
        and its read noise.

    Raises
    ------
    OSError
        If a file cannot be read.
    ValueError
        If frames have different sizes, are overexposed or have no light.
    """
    if dark is None and camera is None:
        logging.getLogger("starpipe").warning(
            "the dark level is assumed to be 0: give dark or camera"
        )
    frames = _starpipe.FlatFrames(None if dark is None else Image(dark, "dark").pixels, camera)
    for image in images:
        frames.add(Image(image).pixels)
    return Flats(frames.measure())
