"""Flat fields."""

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
        The JSON of ``starpipe flats``: gain, read noise, nonuniformity, missing quantities.
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
        """Master flat for `Pipeline.solve`: the response of each pixel, with a mean of 1.

        NaN where it is unknown.
        """
        return self._flats.master().reshape(self._flats.shape)


def flats(
    images: Iterable[ImageLike],
    *,
    dark: ImageLike | None = None,
    camera: PathLike | None = None,
) -> Flats:
    """Measure pixel response, gain and read noise on flat fields.

    Frames are taken in pairs (first and second, third and fourth, ...) with equal illumination
    within a pair. The gain follows from the noise of the pairs. Frames are read one after the
    other, and not kept in memory.

    Parameters
    ----------
    images : iterable
        Frames as `Pipeline.solve` takes them.
    dark : image, optional
        Dark frame or master dark to subtract, see `Darks.masters`.
    camera : path or str, optional
        A description of the camera (TOML), or the name of a preset. Its bias is used if there
        is no dark, and its read noise.

    Raises
    ------
    OSError
        If a file cannot be read.
    ValueError
        If frames have different sizes, are overexposed or dark.
    """
    if dark is None and camera is None:
        logging.getLogger("starpipe").warning(
            "the dark level is assumed to be 0: give dark or camera"
        )
    frames = _starpipe.FlatFrames(None if dark is None else Image(dark, "dark").pixels, camera)
    for image in images:
        frames.add(Image(image).pixels)
    return Flats(frames.measure())
