"""Centroids of the stars of an image, as tetra3 returns them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._detect import Detections, detect
from .._images import COLORS, _of_pil
from ._marks import marked
from ._sky import Array

LUMINANCE = np.array([0.299, 0.587, 0.114], dtype=np.float32)
"""Shares of red, green and blue in the gray level."""

SELECTING = (
    *("image_th", "crop", "max_area", "min_area", "max_sum", "min_sum", "max_axis_ratio"),
    *("max_returned", "return_moments", "return_images"),
)
"""Arguments that select centroids, or ask for more than these."""

NO_STARS = {"hot_pixel", "trail", "extended"}
"""Flags of detections that are not stars."""

SPOT_SIGMA = 3.0
"""Standard deviations of the noise above which a pixel belongs to a spot."""

RADIUS_SIGMA = 5.0
"""Half of the side of the square around a spot, in standard deviations of its form."""

MARK_SHARE = 0.01
"""Radius of the marks in pictures, as a share of the width."""


@dataclass(frozen=True)
class Extraction:
    """How to extract centroids: the arguments of `get_centroids_from_image`."""

    sigma: float | None = None
    image_th: float | None = None
    crop: int | tuple[int, ...] | None = None
    downsample: int | None = None
    filtsize: int | None = None
    bg_sub_mode: str | None = None
    sigma_mode: str | None = None
    binary_open: bool | None = None
    centroid_window: int | None = None
    max_area: float | None = None
    min_area: float | None = None
    max_sum: float | None = None
    min_sum: float | None = None
    max_axis_ratio: float | None = None
    max_returned: int | None = None
    return_moments: bool = False
    return_images: bool = False

    @property
    def is_plain(self) -> bool:
        """Whether all stars are wanted, and nothing but their centroids."""
        return not any(getattr(self, name) for name in SELECTING)


@dataclass(frozen=True)
class Spots:
    """Spots in an image, brightest first.

    Attributes
    ----------
    centroids : ndarray
        Rows of (y, x).
    flux, peak, error : ndarray
        Flux and brightest pixel above the background; standard error on each axis in pixels.
    area, moments, axis_ratio : ndarray
        Number of pixels that stand out, second moments (xx, yy, xy) and ratio of the axes.
    """

    centroids: Array
    flux: Array
    peak: Array
    error: Array
    area: Array
    moments: Array
    axis_ratio: Array

    def __getitem__(self, chosen: NDArray[Any] | slice) -> Spots:
        return Spots(*(column[chosen] for column in self.__dict__.values()))

    def __len__(self) -> int:
        return len(self.flux)


def get_centroids_from_image(
    image: Any,
    sigma: float | None = None,
    image_th: float | None = None,
    crop: int | tuple[int, ...] | None = None,
    downsample: int | None = None,
    filtsize: int | None = None,
    bg_sub_mode: str | None = None,
    sigma_mode: str | None = None,
    binary_open: bool | None = None,
    centroid_window: int | None = None,
    max_area: float | None = None,
    min_area: float | None = None,
    max_sum: float | None = None,
    min_sum: float | None = None,
    max_axis_ratio: float | None = None,
    max_returned: int | None = None,
    return_moments: bool = False,
    return_images: bool = False,
) -> Any:
    """Return the centroids of the stars of an image, brightest first.

    Parameters
    ----------
    image : PIL image or array
        The image, gray or in colors.
    image_th : float, optional
        Reject spots whose brightest pixel is not that far above the background.
    crop : int or tuple, optional
        Part of the image to use, as for `crop_and_downsample_image`.
    max_area, min_area : float, optional
        Reject spots with more or with fewer pixels that stand out. Without them none is rejected.
    max_sum, min_sum : float, optional
        Reject spots with more or with less flux.
    max_axis_ratio : float, optional
        Reject spots whose axes have a larger ratio.
    max_returned : int, optional
        Return at most this many of the brightest spots.
    return_moments : bool
        Return a list with sum, area, second moments (xx, yy, xy) and ratio of the axes as well.
    return_images : bool
        Return a dictionary of pictures of the steps as well; needs Pillow.
    sigma, downsample, filtsize, bg_sub_mode, sigma_mode, binary_open, centroid_window : optional
        Accepted, and without effect on the centroids: starpipe finds the values itself.

    Returns
    -------
    ndarray or tuple
        Rows of (y, x): (0.5, 0.5) is the center of the first pixel. A tuple if more is returned.

    Raises
    ------
    ValueError
        If the image has no pixels, or an argument is out of range.
    """
    stated = {name: value for name, value in locals().items() if name != "image"}
    spots, more = extract(image, Extraction(**stated))
    return (spots.centroids, *more) if more else spots.centroids


def extract(image: Any, wanted: Extraction) -> tuple[Spots, tuple[Any, ...]]:
    """Return the wanted stars of an image, and what else is wanted: moments and pictures."""
    pixels = pixels_of(image)
    box = crop_box(pixels.shape, wanted.crop, wanted.downsample)
    part = pixels[box]
    found = detect(part)
    spots, mask = _measured(found, _gray(part))
    # From pixels of the part to those of the image.
    corner = np.array([side.start for side in box], dtype=np.float64)
    spots = replace(spots, centroids=spots.centroids + corner)
    kept = _kept(spots, wanted)
    chosen = spots[kept][: int(wanted.max_returned) if wanted.max_returned else None]
    more: list[Any] = []
    if wanted.return_moments:
        more.append([chosen.flux, chosen.area, chosen.moments, chosen.axis_ratio])
    if wanted.return_images:
        whole, step = _gray(pixels), wanted.downsample or 1
        small = crop_and_downsample_image(whole, wanted.crop, wanted.downsample)
        marks = [(spots[kept].centroids, "green"), (spots[~kept].centroids, "red")]
        pictures = {
            "converted_input": whole,
            "cropped_and_downsampled": small,
            "removed_background": small - found.background * step**2,
            "binary_mask": _downsampled(mask.astype(np.float32), step, add=True) > 0.0,
            "final_centroids": marked(pixels, marks, MARK_SHARE * whole.shape[1]),
        }
        more.append(pictures)
    return chosen, tuple(more)


def pixels_of(image: Any) -> NDArray[Any]:
    """Return the pixels of an array or of an image of PIL: rows, columns and perhaps colors."""
    pixels: NDArray[Any] = _of_pil(image) if hasattr(image, "getbands") else np.asarray(image)
    if pixels.ndim == 3 and pixels.shape[2] == 1:
        pixels = pixels[..., 0]
    if pixels.ndim != 2 and (pixels.ndim != 3 or pixels.shape[2] not in COLORS):
        raise ValueError(f"an image has rows, columns and perhaps colors, not {pixels.shape}")
    return pixels


def crop_box(
    shape: tuple[int, ...], crop: ArrayLike | None, downsample: int | None
) -> tuple[slice, slice]:
    """Return rows and columns of the part of an image to which `crop` and `downsample` lead."""
    full = np.array(shape[:2])
    size, offset = full, np.zeros(2)
    if crop is not None:
        sides = np.asarray(crop, dtype=np.int64)
        if sides.ndim == 0:
            if sides < 1 or (full % sides).any():
                raise ValueError("crop must be a divisor of the image's height and width")
            size = full // sides
        elif sides.size in (2, 4):
            size, offset = sides[:2], np.append(sides[2:], [0, 0])[:2]
        else:
            raise ValueError(f"crop must have 2 or 4 numbers, not {sides.size}")
        step = 2 if downsample is None else downsample
        size = np.minimum(-(-size // step) * step, full)
    start = np.round(offset + (full - size) / 2.0).astype(np.int64)
    top, left = np.clip(start, 0, full - size).tolist()
    height, width = size.tolist()
    return slice(top, top + height), slice(left, left + width)


def crop_and_downsample_image(
    image: ArrayLike,
    crop: int | tuple[int, ...] | None = None,
    downsample: int | None = None,
    sum_when_downsample: bool = True,
    return_offsets: bool = False,
) -> Any:
    """Return a part of an image, with fewer pixels if wanted.

    Parameters
    ----------
    image : array
        Rows and columns.
    crop : int or tuple, optional
        A number n: the middle n-th of height and width. (height, width): the middle. (height,
        width, down, right): the same, moved from the middle. Sides are rounded up to multiples of
        `downsample`, or to even numbers without it.
    downsample : int, optional
        Combine squares of so many pixels a side into one.
    sum_when_downsample : bool
        Add the pixels of a square; otherwise, their mean is taken. Whole numbers stay in the range
        of their type.
    return_offsets : bool
        Return the offsets of the part from the top and from the left as well.

    Raises
    ------
    ValueError
        If the image has not two dimensions, or cannot be divided as wanted.
    """
    pixels = np.asarray(image)
    if pixels.ndim != 2:
        raise ValueError(f"the image must have rows and columns, not {pixels.ndim} dimensions")
    box = crop_box(pixels.shape, crop, downsample)
    part = pixels[box]
    if downsample is not None:
        part = _downsampled(part, downsample, sum_when_downsample)
    return (part, (box[0].start, box[1].start)) if return_offsets else part


def _downsampled(pixels: NDArray[Any], step: int, add: bool) -> NDArray[Any]:
    height, width = pixels.shape
    if height % step or width % step:
        raise ValueError(f"{width} x {height} pixels are no multiple of {step}")
    is_whole = np.issubdtype(pixels.dtype, np.integer)
    squares = pixels.astype(np.float32) if is_whole else pixels
    squares = squares.reshape(height // step, step, width // step, step)
    combined: NDArray[Any] = squares.sum(axis=(1, 3)) if add else squares.mean(axis=(1, 3))
    if is_whole:
        limits = np.iinfo(pixels.dtype)
        combined = combined.clip(limits.min, limits.max).astype(pixels.dtype)
    return combined


def _gray(pixels: NDArray[Any]) -> NDArray[np.float32]:
    gray: NDArray[np.float32] = pixels.astype(np.float32)
    if gray.ndim == 3:
        gray = np.asarray(gray[..., :3] @ LUMINANCE)
    return gray


def _kept(spots: Spots, wanted: Extraction) -> NDArray[np.bool_]:
    """Return which spots are within the limits."""
    kept = np.ones(len(spots), dtype=bool)
    for limit, values, sign in (
        (wanted.image_th, spots.peak, 1.0),
        (wanted.min_area, spots.area, 1.0),
        (wanted.max_area, spots.area, -1.0),
        (wanted.min_sum, spots.flux, 1.0),
        (wanted.max_sum, spots.flux, -1.0),
        (wanted.max_axis_ratio, spots.axis_ratio, -1.0),
    ):
        if limit:
            kept &= sign * values >= sign * float(limit)
    return kept


def _measured(found: Detections, gray: NDArray[np.float32]) -> tuple[Spots, NDArray[np.bool_]]:
    """Return the spots among detections with their forms, and the pixels that belong to them."""
    columns = found.columns
    is_star = np.array(
        [not NO_STARS & set(flags.split()) for flags in columns["flags"]], dtype=bool
    )
    y, x, flux, peak = (columns[name][is_star] for name in ("y", "x", "flux", "peak"))
    squares = _Squares(gray, y, x, max(3, int(np.ceil(RADIUS_SIGMA * found.spot_sigma_px))))
    light, mask = squares.above(SPOT_SIGMA * found.noise)
    moments = squares.moments(light)
    area = (light > 0.0).sum(axis=(1, 2)).astype(np.float64)
    centroids = np.stack([y, x], axis=-1) + 0.5
    errors = found.error[is_star]
    return Spots(centroids, flux, peak, errors, area, moments, _axis_ratio(moments)), mask


class _Squares:
    """The pixels in squares around spots."""

    def __init__(self, gray: NDArray[np.float32], y: Array, x: Array, half: int) -> None:
        self._gray = gray
        step = np.arange(-half, half + 1)
        # Spots, rows, columns.
        self._rows = np.round(y).astype(int)[:, None, None] + step[:, None]
        self._columns = np.round(x).astype(int)[:, None, None] + step
        self._rows, self._columns = np.broadcast_arrays(self._rows, self._columns)
        self._border = np.ones((len(step), len(step)), dtype=bool)
        self._border[1:-1, 1:-1] = False

    def above(self, threshold: float) -> tuple[Array, NDArray[np.bool_]]:
        """Return the light of pixels that stand out, and all of these pixels in the image."""
        height, width = self._gray.shape
        rows, columns = self._rows.clip(0, height - 1), self._columns.clip(0, width - 1)
        is_inside = (rows == self._rows) & (columns == self._columns)
        pixels = self._gray[rows, columns].astype(np.float64)
        level = np.median(pixels[:, self._border], axis=1)[:, None, None]
        stands_out = is_inside & (pixels - level > threshold)
        mask = np.zeros(self._gray.shape, dtype=bool)
        mask[rows[stands_out], columns[stands_out]] = True
        return np.where(stands_out, pixels - level, 0.0), mask

    def moments(self, light: Array) -> Array:
        """Return the second moments xx, yy and xy of the light; NaN without light."""
        total = light.sum(axis=(1, 2))
        share = light / np.where(total > 0.0, total, np.nan)[:, None, None]
        x, y = (
            places - (share * places).sum(axis=(1, 2), keepdims=True)
            for places in (self._columns, self._rows)
        )
        return np.stack([(share * a * b).sum(axis=(1, 2)) for a, b in ((x, x), (y, y), (x, y))], -1)


def _axis_ratio(moments: Array) -> Array:
    """Return the ratio of the longer to the shorter axis."""
    xx, yy, xy = moments.T
    spread = np.hypot(xx - yy, 2.0 * xy)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio: Array = np.sqrt((xx + yy + spread) / np.maximum(xx + yy - spread, 0.0))
    return ratio
