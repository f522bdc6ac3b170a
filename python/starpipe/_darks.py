"""Dark frames."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _starpipe, _tables
from ._hints import header_exposure, positive, whole_number
from ._images import Image, ImageLike

if TYPE_CHECKING:
    from astropy.table import QTable
    from astropy.units import Quantity


class Darks:
    """Properties of a detector, measured with dark frames.

    Attributes
    ----------
    report : dict
        The JSON of ``starpipe darks``: noise, fixed pattern, dark current, warnings.
    """

    def __init__(self, darks: _starpipe.Darks) -> None:
        self._darks = darks
        self.report: dict[str, Any] = json.loads(darks.json())

    def __repr__(self) -> str:
        rows, columns = self._darks.shape
        hot = len(json.loads(self._darks.hot_pixels()))
        return f"<Darks {columns} x {rows}: {hot} hot pixels>"

    @property
    def masters(self) -> dict[float | None, NDArray[np.float32]]:
        """Master dark for each exposure in seconds, for the `dark` of `Pipeline.solve`."""
        shape = self._darks.shape
        return {exposure: means.reshape(shape) for exposure, means in self._darks.masters()}

    @property
    def noise(self) -> NDArray[np.float32] | None:
        """Standard deviation of each pixel from frame to frame."""
        noise = self._darks.noise_adu()
        return None if noise is None else noise.reshape(self._darks.shape)

    @property
    def hot_pixels(self) -> QTable:
        """The hot pixels as a ``QTable`` or a dict of arrays."""
        return _tables.table(_tables.columns(json.loads(self._darks.hot_pixels())), {})

    @property
    def mask(self) -> NDArray[np.bool_]:
        """Mask for `Pipeline.solve`: True at the hot pixels."""
        mask = np.zeros(self._darks.shape, dtype=np.bool_)
        for pixel in json.loads(self._darks.hot_pixels()):
            mask[pixel["y"], pixel["x"]] = True
        return mask


def darks(
    images: Iterable[ImageLike],
    *,
    exposure: Quantity | float | Sequence[Quantity | float | None] | None = None,
    bits: int | None = None,
    gain: Quantity | float | None = None,
) -> Darks:
    """Measure read noise, fixed-pattern noise, dark current and hot pixels on dark frames.

    Frames are read one after the other, and not kept in memory.

    Parameters
    ----------
    images : iterable
        Frames as `Pipeline.solve` takes them.
    exposure : Quantity or float, or a list of them, optional
        Exposure of all frames, or of each, in seconds; by default from the header.
    bits : int, optional
        Bit depth; by default that of the file's format.
    gain : Quantity or float, optional
        Gain, in electrons per ADU.

    Raises
    ------
    OSError
        If a file cannot be read.
    ValueError
        If frames have different sizes, or an argument is out of range.
    """
    images = list(images)
    exposures: list[Any] = [exposure] * len(images)
    if isinstance(exposure, (list, tuple, np.ndarray)) and np.ndim(exposure) == 1:
        exposures = list(exposure)
    if len(exposures) != len(images):
        raise ValueError(f"{len(exposures)} exposures are given for {len(images)} frames")
    frames = _starpipe.DarkFrames()
    for image, seconds in zip(images, exposures, strict=True):
        taken = Image(image)
        stated = header_exposure(taken.header) if seconds is None else seconds
        frames.add(taken.pixels, positive(stated, "s", "exposure"))
    bits = None if bits is None else whole_number(bits, "bits", 1)
    return Darks(frames.measure(bits, positive(gain, "electron / adu", "gain")))
