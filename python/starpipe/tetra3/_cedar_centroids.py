"""Answers to requests of cedar-detect's gRPC service."""

from __future__ import annotations

import mmap
import os
import sys
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._detect import Detections, detect
from ._cedar_messages import read_request
from ._extract import NO_STARS, RADIUS_SIGMA, crop_and_downsample_image

MAX_PIXELS = 100_000_000
"""Maximum number of pixels of an image."""

SATURATED = 255
"""Level of saturated pixels, and `peak_star_pixel` without stars."""

PEAKS = 10
"""Number of stars whose brightest pixels are averaged."""

CLIP_SIGMA = 3.0
"""Standard deviations of the noise within which a pixel belongs to the background."""

Pixels = NDArray[np.uint8]


def answer(content: bytes, may_share: bool) -> bytes:
    """Return the result for a request, both as they are sent.

    Parameters
    ----------
    content : bytes
        A `CentroidsRequest`.
    may_share : bool
        Whether images may be read from shared memory.

    Raises
    ------
    ValueError
        If the request is wrong.
    OSError
        If the shared memory cannot be read.
    """
    request, result_class = read_request(content)
    start = time.perf_counter()
    pixels = _image(request, may_share)
    if request.binning not in (0, 2, 4):
        raise ValueError(f"binning must be 2 or 4, not {request.binning}")
    region = _region(request, pixels)
    found = detect(pixels, sigma=request.sigma or None)
    result = result_class(noise_estimate=found.noise)
    if region is None:
        result.background_estimate = found.background
    else:
        result.background_estimate = _background(region, found.noise)
    hot = _add_stars(result, found, pixels, request.detect_hot_pixels)
    if request.return_binned:
        _set_binned(result.binned_image, _without(pixels, hot), request.binning or 2)
    seconds, part = divmod(time.perf_counter() - start, 1.0)
    result.algorithm_time.seconds = int(seconds)
    result.algorithm_time.nanos = int(part * 1e9)
    sent: bytes = result.SerializeToString()
    return sent


def _image(request: Any, may_share: bool) -> Pixels:
    """Return the pixels of a request's image."""
    if not request.HasField("input_image"):
        raise ValueError("input_image is missing")
    image = request.input_image
    width, height = image.width, image.height
    if width < 1 or height < 1:
        raise ValueError(f"an image must have pixels, not {width} x {height}")
    size = width * height
    if size > MAX_PIXELS:
        raise ValueError(f"too large: found {width} x {height} pixels, at most {MAX_PIXELS}")
    if image.shmem_name:
        if not may_share:
            raise OSError("shared memory is only read for clients on the same machine")
        content = _shared(os.fsdecode(image.shmem_name), size)
    else:
        content = image.image_data
    if len(content) != size:
        raise ValueError(f"{width} x {height} pixels need {size} bytes, found {len(content)}")
    return np.frombuffer(content, dtype=np.uint8).reshape(height, width)


def _shared(name: str, size: int) -> bytes:
    """Return the first bytes of an object in POSIX shared memory; fewer if it is smaller.

    `multiprocessing.shared_memory` would ask for permission to write, and before Python 3.13
    remove the client's object at the end.
    """
    try:
        import _posixshmem
    except ImportError as error:
        raise OSError("there is no POSIX shared memory") from error
    if "\0" in name:
        raise ValueError("shmem_name has a null character")
    file = _posixshmem.shm_open(name, os.O_RDONLY, mode=0)
    try:
        size = min(size, os.fstat(file).st_size)
        if sys.platform != "darwin":
            # If the client shortens the object now, this returns less. Mapped, it would be fatal.
            return os.pread(file, size, 0)
        with mmap.mmap(file, size, access=mmap.ACCESS_READ) as mapped:
            return bytes(mapped)
    finally:
        os.close(file)


def _region(request: Any, pixels: Pixels) -> Pixels | None:
    """Return the pixels over which the background is wanted."""
    if not request.HasField("estimate_background_region"):
        return None
    region = request.estimate_background_region
    left, top = region.origin_x, region.origin_y
    right, bottom = left + region.width, top + region.height
    height, width = pixels.shape
    if not (0 <= left < right <= width and 0 <= top < bottom <= height):
        raise ValueError("estimate_background_region has no pixels, or some outside the image")
    return pixels[top:bottom, left:right]


def _background(region: Pixels, noise: float) -> float:
    """Return the mean level of the pixels without stars."""
    # The level of a pixel: the mean of two levels can be far from all pixels.
    median = np.percentile(region, 50.0, method="lower").astype(np.float64)
    distance = np.abs(region - median)
    # One level is the least difference of two pixels.
    return float(region[distance <= max(CLIP_SIGMA * noise, 1.0)].mean())


def _add_stars(
    result: Any, found: Detections, pixels: Pixels, leave_out_hot: bool
) -> list[tuple[int, int]]:
    """Add the stars to a result, and return the hot pixels: row and column."""
    (height, width), columns = pixels.shape, found.columns
    hot: list[tuple[int, int]] = []
    peaks: list[int] = []
    half = int(np.ceil(RADIUS_SIGMA * found.spot_sigma_px))
    wanted = (columns[name] for name in ("y", "x", "flux", "flags"))
    for y, x, flux, flags in zip(*wanted, strict=True):
        row, column = min(max(round(y), 0), height - 1), min(max(round(x), 0), width - 1)
        unlike = NO_STARS & set(flags.split())
        if leave_out_hot and "hot_pixel" in unlike:
            hot.append((row, column))
        if unlike - (set() if leave_out_hot else {"hot_pixel"}):
            continue
        result.star_candidates.add(
            centroid_position={"x": x + 0.5, "y": y + 0.5},
            brightness=flux,
            num_saturated=int((_square(pixels, row, column, half) == SATURATED).sum()),
        )
        peaks.append(int(_square(pixels, row, column, 1).max()))
    result.hot_pixel_count = len(hot)
    result.peak_star_pixel = int(np.mean(peaks[:PEAKS])) if peaks else SATURATED
    return hot


def _square(pixels: Pixels, row: int, column: int, half: int) -> Pixels:
    """Return the pixels of a square that are inside the image."""
    rows = slice(max(0, row - half), row + half + 1)
    square: Pixels = pixels[rows, max(0, column - half) : column + half + 1]
    return square


def _without(pixels: Pixels, hot: list[tuple[int, int]]) -> Pixels:
    """Return an image whose hot pixels have the median level of the pixels around them."""
    clean: Pixels = pixels.copy()
    for row, column in hot:
        clean[row, column] = np.median(_square(pixels, row, column, 1))
    return clean


def _set_binned(image: Any, pixels: Pixels, step: int) -> None:
    """Set an image to the means of squares; pixels at the right and below may be left over."""
    height, width = (side // step * step for side in pixels.shape)
    binned = crop_and_downsample_image(
        pixels[:height, :width], downsample=step, sum_when_downsample=False
    )
    image.height, image.width = binned.shape
    image.image_data = binned.tobytes()
