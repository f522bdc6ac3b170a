"""Plots of results on a photograph, with matplotlib."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ._tables import Columns

Rings = Literal["named", "all", "none"]

UNLIKE_STARS = ("hot_pixel", "trail", "extended")
"""Flags of detections that are not shaped like stars."""

MARKS: dict[str, tuple[str, dict[str, Any]]] = {
    "identified": ("o", {"facecolors": "none", "edgecolors": "#6ecdff"}),
    "not identified": ("s", {"facecolors": "none", "edgecolors": "#ffaa3c"}),
    "not a star": ("x", {"color": "#c878be"}),
}
"""Shapes and colors of marks, as in the program's overlays."""


def printable(text: str) -> str:
    """Return a text with its unprintable characters escaped."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


class Drawn(Protocol):
    """The properties of a result that are drawn."""

    @property
    def _name(self) -> str: ...

    @property
    def shape(self) -> tuple[int, int]: ...

    @property
    def star_columns(self) -> Columns: ...

    @property
    def annotations(self) -> list[dict[str, Any]]: ...

    @property
    def _is_bottom_up(self) -> bool: ...

    def __bool__(self) -> bool: ...


def draw(
    result: Drawn,
    picture: tuple[NDArray[np.uint8], tuple[int, int]] | None,
    ax: Axes | None,
    rings: Rings,
    names: int,
) -> Axes:
    """Draw what `Result.plot` returns."""
    try:
        from matplotlib import pyplot
    except ImportError as error:
        message = "plot needs matplotlib; install it with: pip install matplotlib"
        raise ImportError(message) from error
    if rings not in ("named", "all", "none"):
        raise ValueError(f"rings must be 'named', 'all' or 'none', not {rings!r}")
    if ax is None:
        ax = pyplot.subplots()[1]
    rows, columns = result.shape
    ax.set_facecolor("0.15")
    if picture is not None:
        _show(ax, *picture)
    _mark(ax, result, rings, names)
    if names > 0:
        _annotate(ax, result)
    ax.set_xlim(-0.5, columns - 0.5)
    ax.set_ylim(*((-0.5, rows - 0.5) if result._is_bottom_up else (rows - 0.5, -0.5)))
    ax.set_aspect("equal")
    if not hasattr(ax, "wcs"):
        ax.set_xlabel("x (px)")
        ax.set_ylabel("y (px)")
    title = repr(result).strip("<>").removeprefix("Result ")
    name = printable(result._name)
    title = title.replace(name, printable(os.path.basename(result._name)), 1)
    # Dollars in a name are no formula.
    ax.set_title(title, fontsize=8, parse_math=False)
    return ax


def _annotate(ax: Axes, result: Drawn) -> None:
    """Write constellations, and in italics the stars that were not measured at their place."""
    from matplotlib.patheffects import withStroke

    outline = [withStroke(linewidth=2.0, foreground="black")]
    look: dict[str, Any] = {"clip_on": True, "parse_math": False, "path_effects": outline}
    for shown in result.annotations:
        place, label = (shown["x"], shown["y"]), shown["label"]
        if shown["kind"] == "constellation":
            ax.annotate(
                label, place, ha="center", va="center", color="#bbc3df", fontsize=10, **look
            )
        elif shown["kind"] == "star" and shown["why"] is not None:
            offset: dict[str, Any] = {
                "xytext": (8, 8),
                "textcoords": "offset points",
                "style": "italic",
            }
            ax.annotate(label, place, color="#c9efe4", fontsize=8, **offset, **look)


def _show(ax: Axes, levels: NDArray[np.uint8], shape: tuple[int, int]) -> None:
    """Show a picture whose pixels are parts, or squares, of those of the frame."""
    longer, drawn = max(shape), max(levels.shape[:2])
    side = 1.0 / (drawn // longer) if drawn >= longer else float(-(-longer // drawn))
    rows, columns = (side * count - 0.5 for count in levels.shape[:2])
    # The axes of WCS take no other origin; which end is up is a matter of their limits.
    ax.imshow(levels, extent=(-0.5, columns, -0.5, rows), origin="lower")


def _called(stars: Columns) -> NDArray[np.str_]:
    """Return what the program's overlays call each star: its name, or else a number."""

    def called(name: str, hd: float, hip: float, identifier: str) -> str:
        numbers = (("HD", hd), ("HIP", hip))
        known = [f"{catalog} {number:.0f}" for catalog, number in numbers if number > 0]
        return name or (known or [identifier])[0]

    columns = (stars[name] for name in ("name", "hd", "hip", "id"))
    return np.array([called(*star) for star in zip(*columns, strict=True)], dtype=np.str_)


def _mark(ax: Axes, result: Drawn, rings: Rings, names: int) -> None:
    from matplotlib.patheffects import withStroke

    stars = result.star_columns
    called = _called(stars)
    # The brightest first.
    with_name, with_number = stars["name"] != "", (called != "") & (stars["name"] == "")
    named = np.concatenate([np.flatnonzero(with_name), np.flatnonzero(with_number)])[:names]
    is_known = (stars["id"] != "") | (stars["name"] != "")
    unlike = [any(flag in UNLIKE_STARS for flag in flags.split()) for flags in stars["flags"]]
    is_marked = np.full(len(is_known), rings != "none")
    if rings == "named" and result:
        is_marked[:] = False
        is_marked[named] = True
    is_unlike = ~is_known & np.array(unlike, dtype=np.bool_)
    groups = (is_known, ~is_known & ~is_unlike, is_unlike)
    # The brightest first, with the largest marks.
    area = 30.0 + 150.0 / (1.0 + np.arange(len(is_known)) / 8.0)
    for group, (label, (marker, look)) in zip(groups, MARKS.items(), strict=True):
        shown = group & is_marked
        if shown.any():
            x, y = stars["x"][shown], stars["y"][shown]
            ax.scatter(x, y, s=area[shown], marker=marker, linewidths=1.0, label=label, **look)
    rows, columns = result.shape
    outline = [withStroke(linewidth=2.0, foreground="black")]
    for index in named:
        x, y = float(stars["x"][index]), float(stars["y"][index])
        from_top = rows - y if result._is_bottom_up else y
        # Names lie towards the middle where the picture ends.
        is_left, is_below = x > 0.85 * columns, from_top < 0.06 * rows
        ax.annotate(
            printable(str(called[index])),
            (x, y),
            xytext=(-6 if is_left else 6, -6 if is_below else 6),
            textcoords="offset points",
            horizontalalignment="right" if is_left else "left",
            verticalalignment="top" if is_below else "bottom",
            color="#b6e6ff",
            fontsize=8,
            clip_on=True,
            parse_math=False,
            path_effects=outline,
        )
