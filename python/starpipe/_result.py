"""What was found in a frame."""

from __future__ import annotations

import html
import json
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _starpipe, _tables


class Result:
    """What was found in a frame. In a condition it is true where the stars are identified.

    Pixels are those of the array, or of the array that ``astropy.io.fits.getdata`` reads from the
    file: (0, 0) is the centre of the first pixel of its first row, x runs along a row, y counts
    rows. Everything else agrees with that: `wcs`, `quaternion`, whether the frame is mirrored.

    Attributes
    ----------
    error : Exception or None
        What was raised instead of an answer, in results of `Pipeline.solve_many`.
    """

    error: Exception | None = None

    def __init__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)

    @classmethod
    def _of(cls, solved: _starpipe.Solved) -> Result:
        return cls({"_solved": solved})

    @classmethod
    def _unread(cls, name: str, error: Exception) -> Result:
        """Return what stands for a frame without an answer."""
        nothing = ("attitude", "optics", "match", "photometry", "prediction", "width", "height")
        report: dict[str, Any] = dict.fromkeys(nothing)
        report |= {"frame": name, "notes": [], "remedies": [], "stars": [], "timing_ms": {}}
        report |= {"status": "unread", "reason": str(error), "reason_code": "unread"}
        none = dict.fromkeys(("_wcs_header", "_row_order", "attitude_covariance"))
        return cls({"_report": report, "error": error} | none)

    def __getstate__(self) -> dict[str, Any]:
        """Return what was computed so far and all that the compiled part holds."""
        return {
            "_report": self._report,
            "_wcs_header": self._wcs_header,
            "_row_order": self._row_order,
            "error": self.error,
            "attitude_covariance": self.attitude_covariance,
        }

    @cached_property
    def _report(self) -> dict[str, Any]:
        report: dict[str, Any] = json.loads(self.__dict__["_solved"].json())
        return report

    @cached_property
    def _wcs_header(self) -> bytes | None:
        solved: _starpipe.Solved = self.__dict__["_solved"]
        return solved.wcs_header()

    @cached_property
    def _row_order(self) -> str | None:
        """ROWORDER of the file."""
        solved: _starpipe.Solved = self.__dict__["_solved"]
        return solved.row_order

    @cached_property
    def attitude_covariance(self) -> NDArray[np.float64] | None:
        """Covariance of small rotations about the camera's x, y and z axes, in rad²."""
        solved: _starpipe.Solved = self.__dict__["_solved"]
        covariance = solved.attitude_covariance_rad2()
        return None if covariance is None else np.array(covariance)

    def __bool__(self) -> bool:
        return self.identified

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Result):
            return NotImplemented
        apart = "timing_ms"
        mine, others = ({k: v for k, v in r._report.items() if k != apart} for r in (self, other))
        return mine == others

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        report = self._report
        name = report["frame"]
        if self.error is not None:
            return f"<Result {name}: {type(self.error).__name__}: {self.error}>"
        if not self:
            return f"<Result {name}: not identified ({self.reason_code})>"
        attitude, match = report["attitude"], report["match"]
        return (
            f"<Result {name}: {match['matched']} of {match['detected']} stars, "
            f"ra {attitude['ra_deg']:.4f}° dec {attitude['dec_deg']:+.4f}°, "
            f"field {report['optics']['fov_x_deg']:.2f}°>"
        )

    def _repr_html_(self) -> str:
        report = self._report
        rows = [("frame", report["frame"])]
        if self:
            attitude, optics, match = report["attitude"], report["optics"], report["match"]
            rows += [
                ("centre", f"{attitude['ra_deg']:.5f}°, {attitude['dec_deg']:+.5f}°"),
                ("field", f"{optics['fov_x_deg']:.3f}° by {optics['fov_y_deg']:.3f}°"),
                ("stars", f"{match['matched']} of {match['detected']} named"),
                ("false alarm", f"10^{match['log10_false_alarm']:.0f}"),
            ]
        else:
            rows += [("not identified", str(self.reason))]
        rows += [("note", note) for note in self.notes]
        cells = "".join(
            f"<tr><th>{html.escape(name)}</th><td>{html.escape(value)}</td></tr>"
            for name, value in rows
        )
        return f"<div>{self._overlay()}<table>{cells}</table></div>"

    def _overlay(self) -> str:
        """Return the detections as rings on a small picture (SVG), the brightest largest."""
        width, height = self._report["width"], self._report["height"]
        if width is None:
            return ""
        # Sizes on the picture, which is 360 wide.
        pixel = width / 360.0
        stars = self._report["stars"]
        marks, labels = [], []
        for rank, star in enumerate(stars[:400]):
            radius = pixel * (2.0 + 5.0 / (1.0 + rank / 10.0))
            color = "limegreen" if star["id"] else "orange"
            place = f'cx="{star["x"]:.1f}" cy="{star["y"]:.1f}" r="{radius:.1f}"'
            marks.append(f'<circle {place} fill="none" stroke="{color}"/>')
        for star in [star for star in stars if star["name"]][:8]:
            place = f'x="{star["x"] + 8 * pixel:.1f}" y="{star["y"]:.1f}"'
            labels.append(f"<text {place}>{html.escape(star['name'])}</text>")
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="360" viewBox="0 0 {width} {height}" '
            f'stroke-width="{pixel:.2f}"><rect width="100%" height="100%" fill="#222"/>'
            f"{''.join(marks)}"
            f'<g fill="gold" font-size="{9 * pixel:.1f}">{"".join(labels)}</g></svg>'
        )

    @property
    def identified(self) -> bool:
        """Whether the stars are identified."""
        if "_report" in self.__dict__:
            return bool(self._report["status"] == "identified")
        return bool(self.__dict__["_solved"].identified)

    @property
    def reason(self) -> str | None:
        """Why the stars are not identified, and what may help."""
        return self._report["reason"]  # type: ignore[no-any-return]

    @property
    def reason_code(self) -> str | None:
        """Code of the reason."""
        return self._report["reason_code"]  # type: ignore[no-any-return]

    @property
    def remedies(self) -> list[str]:
        """Names of the options that may help where the stars are not identified."""
        return self._report["remedies"]  # type: ignore[no-any-return]

    @property
    def notes(self) -> list[str]:
        """What is odd about the frame."""
        return [note["text"] for note in self._report["notes"]]

    @property
    def photometry(self) -> dict[str, Any] | None:
        """Zero point and limiting magnitude."""
        return self._report["photometry"]  # type: ignore[no-any-return]

    @property
    def prediction(self) -> dict[str, Any] | None:
        """What the camera should see, where one is stated."""
        return self._report["prediction"]  # type: ignore[no-any-return]

    @property
    def timing(self) -> dict[str, float]:
        """Run time of each stage, in milliseconds."""
        return self._report["timing_ms"]  # type: ignore[no-any-return]

    @property
    def quaternion(self) -> NDArray[np.float64] | None:
        """Rotation of ICRS vectors into camera axes: [w, x, y, z], w ≥ 0."""
        attitude = self._report["attitude"]
        return None if attitude is None else np.array(attitude["quaternion"])

    @property
    def rotation(self) -> Any:
        """The same as a ``scipy.spatial.transform.Rotation``."""
        from scipy.spatial.transform import Rotation

        quaternion = self.quaternion
        return None if quaternion is None else Rotation.from_quat(np.roll(quaternion, -1))

    @property
    def center(self) -> Any:
        """Centre of the frame as a ``SkyCoord``."""
        from astropy.coordinates import SkyCoord

        attitude = self._report["attitude"]
        if attitude is None:
            return None
        return SkyCoord(attitude["ra_deg"], attitude["dec_deg"], unit="deg", frame="icrs")

    @property
    def wcs(self) -> Any:
        """World coordinates of the pixels of `stars` as an ``astropy.wcs.WCS``."""
        cards = self._wcs_header
        shape = self._report["height"], self._report["width"]
        return None if cards is None else wcs_of(cards, shape)

    def to_header(self) -> Any:
        """Return the same as a FITS header, to be added to that of the file or the array."""
        if self._wcs_header is None:
            return None
        header = _header(self._wcs_header)
        # How the rows of an array are drawn is not known.
        header.remove("ROWORDER")
        if self._row_order is not None:
            header.set("ROWORDER", self._row_order, "of the image's file", after="IMAGEH")
        return header

    def to_dict(self) -> dict[str, Any]:
        """Return all numbers as the program's JSON has them, with pixels as in `stars`."""
        copy: dict[str, Any] = json.loads(json.dumps(self._report))
        return copy

    @property
    def star_columns(self) -> _tables.Columns:
        """Every detection, brightest first, as arrays; NaN and "" where there is no value."""
        return _tables.star_columns(self._report["stars"])

    @property
    def stars(self) -> Any:
        """Every detection, brightest first, as a ``QTable``; without astropy `star_columns`."""
        columns = self.star_columns
        table = _tables.star_table(columns)
        if table is not columns:
            table.meta["frame"] = self._report["frame"]
        return table

    @property
    def sky(self) -> Any:
        """Where `stars` are at the frame's date, as a ``SkyCoord``."""
        from astropy.coordinates import SkyCoord

        if not self:
            return None
        columns = self.star_columns
        return SkyCoord(columns["ra_deg"], columns["dec_deg"], unit="deg", frame="icrs")

    def to_arrow(self) -> Any:
        """Return `star_columns` as a ``pyarrow.Table``."""
        import pyarrow

        return pyarrow.table(self.star_columns)

    def plot(self, image: Any = None, *, ax: Any = None, names: int = 20) -> Any:
        """Draw the detections as rings, with matplotlib.

        Parameters
        ----------
        image : array, optional
            What to draw them on, its first row on top: the array that was solved, or that
            ``astropy.io.fits.getdata`` reads from the file.
        ax : matplotlib.axes.Axes, optional
            Where to draw; new axes by default.
        names : int
            How many of the brightest named stars get their name.

        Returns
        -------
        matplotlib.axes.Axes
        """
        from matplotlib import pyplot

        if ax is None:
            ax = pyplot.subplots()[1]
        ax.set_facecolor("0.15")
        if image is not None:
            low, high = np.nanpercentile(image, [1.0, 99.8])
            ax.imshow(image, cmap="gray", vmin=low, vmax=high)
        stars = self.star_columns
        is_named = stars["id"] != ""
        for group, color in ((is_named, "limegreen"), (~is_named, "orange")):
            x, y = stars["x"][group], stars["y"][group]
            ax.scatter(x, y, s=60, facecolors="none", edgecolors=color)
        for index in np.flatnonzero(is_named & (stars["name"] != ""))[:names]:
            place = stars["x"][index], stars["y"][index]
            offset = {"xytext": (6, 6), "textcoords": "offset points", "clip_on": True}
            ax.annotate(str(stars["name"][index]), place, color="gold", fontsize=8, **offset)
        ax.set_xlim(-0.5, self._report["width"] - 0.5)
        ax.set_ylim(self._report["height"] - 0.5, -0.5)
        ax.set_aspect("equal")
        ax.set_title(repr(self).strip("<>").removeprefix("Result "), fontsize=8)
        return ax

    def write(self, path: Any, *, format: str | None = None, **options: Any) -> None:
        """Write `stars` as ``QTable.write`` does: ECSV, VOTable, Parquet and more."""
        stars = self.stars
        if format is None and str(path).endswith((".vot", ".votable")):
            format = "votable"
        if format == "parquet.votable":
            # Descriptions are taken from the table.
            known = {name: _tables.STAR_COLUMNS[name] for name in stars.colnames}
            metadata = {
                name: {"unit": unit or None, "ucd": ucd}
                for name, (_, unit, ucd, _) in known.items()
            }
            options = {"metadata": metadata} | options
        stars.write(path, format=format, **options)


def wcs_of(cards: bytes, shape: tuple[int, int]) -> Any:
    """Return the world coordinates in the cards of a header, of an image of `shape`."""
    from astropy.wcs import WCS

    header = _header(cards)
    # It describes an image, and has none: astropy would warn.
    header.remove("NAXIS", ignore_missing=True)
    wcs = WCS(header, fix=False)
    wcs.pixel_shape = shape[::-1]
    return wcs


def _header(cards: bytes) -> Any:
    from astropy.io.fits import Header

    return Header.fromstring(cards)
