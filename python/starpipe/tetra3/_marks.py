"""Pictures with marks, as images of PIL."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ._sky import Array

if TYPE_CHECKING:
    from PIL.Image import Image as PILImage
    from PIL.ImageDraw import ImageDraw


def marked(pixels: NDArray[Any], marks: Iterable[tuple[Array, str]], radius: float) -> PILImage:
    """Return an image with circles around (y, x), each in its color."""
    from PIL import Image, ImageDraw

    if pixels.dtype == np.uint16:
        pixels = pixels >> 8
    picture = Image.fromarray(pixels.clip(0, 255).astype(np.uint8)).convert("RGB")
    draw = ImageDraw.Draw(picture)
    for places, color in marks:
        circles(draw, places, radius, outline=color)
    return picture


def solution_picture(
    size: tuple[int, int], given: Array, matched: Array, missed: Array, radius: float
) -> PILImage:
    """Return a dark picture with the given centroids and circles around catalog stars.

    The circles around stars that were matched are green, those around others are red.
    """
    from PIL import Image, ImageDraw

    picture = Image.new("RGB", size[::-1])
    draw = ImageDraw.Draw(picture)
    circles(draw, given, 2.0, fill="white")
    circles(draw, matched, 1.0, fill="green")
    circles(draw, matched, radius, outline="green")
    circles(draw, missed, radius, outline="red")
    return picture


def circles(draw: ImageDraw, places: Array, radius: float, **style: Any) -> None:
    """Draw circles around (y, x)."""
    for y, x in places.tolist():
        draw.ellipse([x - radius, y - radius, x + radius, y + radius], **style)
