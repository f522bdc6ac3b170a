"""Images as the compiled part takes them."""

from __future__ import annotations

import os
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from . import _starpipe

ImageLike: TypeAlias = Any
"""A path, the bytes of a file, an array, or an object with ``data`` (CCDData, NDData, an HDU)."""


class Image:
    """An image with the mask and the header that came with it."""

    def __init__(self, image: ImageLike, name: str = "image") -> None:
        self.mask: NDArray[np.bool_] | None = None
        self.header: Any = {}
        self.pixels: _starpipe._Image
        if isinstance(image, (bytearray, memoryview)):
            image = bytes(image)
        if isinstance(image, (str, os.PathLike, bytes)):
            self.pixels = image
            return
        if not isinstance(image, np.ndarray) and hasattr(image, "data"):
            # NDData's header is its `meta`.
            self.header = getattr(image, "header", None) or getattr(image, "meta", None) or {}
            mask = getattr(image, "mask", None)
            image = image.data
            if isinstance(mask, np.ndarray):
                self.mask = _mask(mask, name)
        if hasattr(image, "unit") and hasattr(image, "value"):
            image = image.value
        if isinstance(image, np.ma.MaskedArray):
            if image.mask is not np.ma.nomask:
                self.mask = _mask(np.ma.getmaskarray(image), name)
            image = image.data
        self.pixels = _pixels(image, name)


def _mask(mask: NDArray[Any], name: str) -> NDArray[np.bool_]:
    if mask.dtype != np.bool_:
        raise ValueError(f"the mask of the {name} must be an array of bool, not of {mask.dtype}")
    return np.ascontiguousarray(mask)


def mask_of(image: Image, given: Any, name: str = "image") -> NDArray[np.bool_] | None:
    """Return the pixels to leave out: those of the image's own mask and of `given`."""
    if given is None:
        return image.mask
    mask = _mask(np.asarray(given), name)
    if image.mask is not None:
        if image.mask.shape != mask.shape:
            raise ValueError(f"the mask is {mask.shape}, that of the {name} {image.mask.shape}")
        mask = mask | image.mask
    shape = getattr(image.pixels, "shape", mask.shape)
    if shape != mask.shape:
        raise ValueError(f"the mask is {mask.shape}, the {name} {shape}")
    return mask


def _pixels(image: Any, name: str) -> _starpipe._Image:
    """Return an array that the compiled part can borrow; it is copied only if it must be.

    Contiguous arrays of uint8, uint16 and float32 in the machine's byte order are not copied.
    """
    array = np.asarray(image)
    if array.dtype.kind not in "buif":
        raise ValueError(f"the {name} must hold real numbers, not {array.dtype}")
    if array.ndim != 2:
        hint = "; a colour image must be made grey first" if array.ndim == 3 else ""
        raise ValueError(
            f"the {name} must be an array of 2 dimensions (rows, columns), not {array.ndim}{hint}"
        )
    _starpipe.check_size(array.shape[1], array.shape[0])
    kind, size = array.dtype.kind, array.dtype.itemsize
    if kind == "b" or (kind == "u" and size == 1):
        return np.ascontiguousarray(array, dtype=np.uint8)
    if kind == "u" and size == 2:
        return np.ascontiguousarray(array, dtype=np.uint16)
    if size == 8 or kind == "f":
        with np.errstate(over="ignore"):
            return np.ascontiguousarray(array, dtype=np.float32)
    # Negative levels, and levels of more than 16 bits.
    return np.ascontiguousarray(array, dtype=np.int64), int(np.iinfo(array.dtype).max)
