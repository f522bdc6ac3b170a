"""Conversion of images for the extension module."""

from __future__ import annotations

import io
import os
import warnings
from dataclasses import dataclass
from typing import IO, TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _starpipe
from ._camera import PathLike

if TYPE_CHECKING:
    from astropy.io.fits import HDUList, ImageHDU, PrimaryHDU
    from astropy.nddata import NDData
    from PIL.Image import Image as PILImage

    ImageLike: TypeAlias = (
        PathLike
        | bytes
        | bytearray
        | memoryview
        | IO[bytes]
        | ArrayLike
        | PILImage
        | HDUList
        | PrimaryHDU
        | ImageHDU
        | NDData
    )
else:
    ImageLike = Any
"""Types that are accepted as an image.

- A path, the bytes of a file, or a file that is open for reading in binary mode.
- An array (rows, columns), or (rows, columns, 3 or 4) or (3 or 4, rows, columns) of colors; an
  image of PIL.
- An HDU or ``HDUList`` of astropy, which are read like the file that they would be written to; an
  object with ``data``, such as ``CCDData`` and ``NDData``.
"""

COLORS = (3, 4)
"""Accepted numbers of color channels; the fourth channel is ignored."""

KINDS = (
    "a path, bytes, a file open for reading in binary mode, an array, an image of PIL, "
    "an HDU, an HDUList, CCDData or NDData"
)


@dataclass(frozen=True, slots=True, eq=False)
class Input:
    """A frame for the extension module, with its mask, dark, flat and bias level."""

    image: _starpipe._Image
    name: PathLike | None = None
    mask: NDArray[np.bool_] | None = None
    dark: _starpipe._Image | None = None
    flat: _starpipe._Image | None = None
    bias_adu: float = 0.0

    @property
    def is_of_files(self) -> bool:
        """Whether image, dark and flat are files, which can be read again."""
        parts = (self.image, self.dark, self.flat)
        are_files = all(part is None or isinstance(part, (str, os.PathLike)) for part in parts)
        return are_files and self.mask is None


class Image:
    """An image with the mask, the header and the name that came with it."""

    def __init__(self, image: ImageLike, name: str = "image") -> None:
        self.mask: NDArray[np.bool_] | None = None
        self.header: Any = {}
        self.file_name: str | None = None
        self.pixels: _starpipe._Image
        if isinstance(image, (str, os.PathLike)):
            self.pixels = image
        elif isinstance(image, (bytes, bytearray, memoryview)):
            self.pixels = bytes(image)
        elif hasattr(image, "read") and not hasattr(image, "meta"):
            # NDData reads files, too.
            self.pixels = _content(image, name)
            self.file_name = _name_of(getattr(image, "name", None))
        elif _is_fits(image):
            self.pixels = _written(image, name)
            self.file_name = _fits_name(image)
        else:
            self._take_pixels(image, name)

    def _take_pixels(self, image: Any, name: str) -> None:
        """Take the pixels of an array, or of an object that has one."""
        if image is None or isinstance(image, (int, float, complex, dict, set)):
            raise TypeError(f"the {name} must be {KINDS}, not {type(image).__name__}")
        if hasattr(image, "getbands") and hasattr(image, "convert"):
            image = _of_pil(image)
        elif not isinstance(image, np.ndarray) and hasattr(image, "data"):
            # NDData's header is its `meta`.
            self.header = getattr(image, "header", None) or getattr(image, "meta", None) or {}
            mask = getattr(image, "mask", None)
            image = image.data
            if isinstance(mask, np.ndarray) and mask.ndim:
                self.mask = _mask(mask, name)
            if _has_fits_header(self.header, image):
                self.pixels = _written(_unit_of(image, self.header), name)
                self.file_name, self.header = "array", {}
                return
        if hasattr(image, "unit") and hasattr(image, "value"):
            image = image.value
        if isinstance(image, np.ma.MaskedArray):
            if image.mask is not np.ma.nomask:
                mask = _layout(np.ma.getmaskarray(image))
                self.mask = _mask(np.asarray(mask.any(axis=2)) if mask.ndim == 3 else mask, name)
            image = image.data
        self.pixels = _pixels(image, name)

    def input(
        self,
        name: PathLike | None,
        mask: ArrayLike | None,
        dark: ImageLike | None,
        flat: ImageLike | None,
        bias_adu: float,
    ) -> Input:
        """Return the image with its mask and calibration; `name` replaces that of its file."""
        return Input(
            self.pixels,
            self.file_name if name is None else str(name),
            mask_of(self, mask),
            None if dark is None else Image(dark, "dark").pixels,
            None if flat is None else Image(flat, "flat").pixels,
            bias_adu,
        )

    @property
    def shape(self) -> tuple[int, ...] | None:
        """Rows and columns of an array."""
        pixels = self.pixels[0] if isinstance(self.pixels, tuple) else self.pixels
        return pixels.shape[:2] if isinstance(pixels, np.ndarray) else None


def _content(file: Any, name: str) -> bytes:
    content = file.read()
    if not isinstance(content, (bytes, bytearray, memoryview)):
        kind = type(content).__name__
        raise TypeError(f"the file of the {name} returns {kind}: open it in binary mode ('rb')")
    return bytes(content)


def _name_of(name: Any) -> str | None:
    return os.fspath(name) if isinstance(name, (str, os.PathLike)) else None


def _is_fits(image: Any) -> bool:
    """Whether `image` is an HDU or a list of them, without astropy where nobody else has it."""
    kinds = {kind.__name__ for kind in type(image).__mro__ if kind.__module__.startswith("astropy")}
    return bool(kinds & {"HDUList", "_BaseHDU"})


def _has_fits_header(header: Any, pixels: Any) -> bool:
    """Whether `pixels` with this header are as good as a file."""
    if type(header).__name__ != "Header" or not isinstance(pixels, np.ndarray):
        return False
    kind, size = pixels.dtype.kind, pixels.dtype.itemsize
    return pixels.ndim == 2 and (kind in "iu" or (kind == "f" and size in (4, 8)))


def _unit_of(pixels: NDArray[Any], header: Any) -> Any:
    from astropy.io import fits

    return fits.PrimaryHDU(pixels, header)


def _written(image: Any, name: str) -> bytes:
    """Return the content of the FITS file of an HDU or a list of them: what is read is the same."""
    from astropy.io import fits

    units = list(image) if isinstance(image, list) else [image]
    # Compressing again would change the pixels.
    units = [
        fits.ImageHDU(unit.data, unit.header) if isinstance(unit, fits.CompImageHDU) else unit
        for unit in units
    ]
    if not units:
        raise ValueError(f"the HDUList of the {name} is empty")
    if not isinstance(units[0], fits.PrimaryHDU):
        units.insert(0, fits.PrimaryHDU())
    content = io.BytesIO()
    with warnings.catch_warnings():
        # What is odd about a header is not new, and of no account here.
        warnings.simplefilter("ignore")
        fits.HDUList(units).writeto(content, output_verify="ignore")
    return content.getvalue()


def _fits_name(image: Any) -> str:
    """Return the name of the file that an HDU or a list of them was read from, or of its type."""
    name = image.filename() if hasattr(image, "filename") else None
    if name is None:
        file = getattr(image, "_file", None)
        name = getattr(file, "name", None)
    return _name_of(name) or type(image).__name__


def _of_pil(image: Any) -> NDArray[Any]:
    """Return the pixels of an image of PIL; palettes and other color spaces become colors."""
    if image.mode in ("1", "LA", "La"):
        image = image.convert("L")
    elif image.mode in ("P", "PA", "CMYK", "YCbCr", "LAB", "HSV", "RGBX", "RGBa"):
        image = image.convert("RGB")
    return np.asarray(image)


def _mask(mask: NDArray[Any], name: str) -> NDArray[np.bool_]:
    if mask.dtype != np.bool_:
        raise ValueError(f"the mask of the {name} must be an array of bool, not of {mask.dtype}")
    return np.ascontiguousarray(mask)


def mask_of(image: Image, given: Any, name: str = "image") -> NDArray[np.bool_] | None:
    """Return the pixels to ignore: those of the image's own mask and of `given`."""
    if given is None:
        return image.mask
    if np.ndim(given) == 0:
        raise TypeError(
            f"mask must be an array of bool, not {given!r}; pass hints for the {name} by "
            "keyword, such as fov=20"
        )
    mask = _mask(np.asarray(given), name)
    if image.mask is not None:
        if image.mask.shape != mask.shape:
            raise ValueError(f"mask has shape {mask.shape}, that of the {name} {image.mask.shape}")
        mask = mask | image.mask
    shape = image.shape or mask.shape
    if shape != mask.shape:
        raise ValueError(f"mask has shape {mask.shape}, the {name} {shape}")
    return mask


def _layout(array: NDArray[Any]) -> NDArray[Any]:
    """Return an array without axes of length 1, the one of colors last, as a FITS file is read.

    The only axis of length 3 or 4 is that of the colors, else the first of that length.
    """
    longer = [length for length in array.shape if length != 1]
    if len(longer) >= 2:
        array = array.reshape(longer)
    places = [place for place, length in enumerate(array.shape) if length in COLORS]
    if array.ndim == 3 and places and (len(places) == 1 or places[0] == 0):
        array = np.moveaxis(array, places[0], -1)
    return array


def _pixels(image: Any, name: str) -> _starpipe._Image:
    """Return an array that the compiled part can borrow; it is copied only if it must be.

    Contiguous arrays of uint8, uint16 and float32 in the machine's byte order are not copied.
    """
    array = np.asarray(image)
    if array.ndim == 0:
        raise TypeError(f"the {name} must be {KINDS}, not {type(image).__name__}")
    if array.dtype.kind not in "buif":
        raise ValueError(f"the {name} must hold real numbers, not {array.dtype}")
    array = _layout(array)
    is_color = array.ndim == 3
    if array.ndim != 2 and not (is_color and array.shape[2] in COLORS):
        hint = "; pass one of its planes, such as image[0]" if is_color else ""
        raise ValueError(
            f"the {name} must be an array (rows, columns), or (rows, columns, 3) of colors, "
            f"not {np.shape(image)}{hint}"
        )
    _starpipe.check_size(array.shape[1], array.shape[0])
    kind, size = array.dtype.kind, array.dtype.itemsize
    if kind == "b":
        array, kind = array.astype(np.uint8), "u"
    if size == 8 or kind == "f":
        with np.errstate(over="ignore"):
            return np.ascontiguousarray(array, dtype=np.float32)
    if not is_color and kind == "u" and size <= 2:
        return np.ascontiguousarray(array, dtype=(np.uint8, np.uint16)[size - 1])
    # Negative levels, levels of more than 16 bits, and colors.
    return np.ascontiguousarray(array, dtype=np.int64), int(np.iinfo(array.dtype).max)
