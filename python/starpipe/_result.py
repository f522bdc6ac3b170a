"""Results of solving frames."""

from __future__ import annotations

import html
import json
import os
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _plot, _starpipe, _tables
from ._attitude import ARCSEC_PER_RAD, Attitude, quantity
from ._camera import PathLike
from ._images import Image, ImageLike, Input
from ._measured import Distortion, Limit, Match
from ._plot import printable

if TYPE_CHECKING:
    from astropy.coordinates import SkyCoord
    from astropy.io.fits import Header
    from astropy.table import QTable
    from astropy.table import Table as PlainTable
    from astropy.units import Quantity
    from astropy.wcs import WCS
    from matplotlib.axes import Axes
    from pyarrow import Table


class Result(Attitude):
    """Result of solving a frame. Its truth value is True if the stars are identified.

    Pixels are those of the array, or of the array that ``astropy.io.fits.getdata`` reads from the
    file: (0, 0) is the center of the first pixel of its first row, x runs along a row, y counts
    rows. Everything else refers to the same pixels: `wcs`, `quaternion`, whether the frame is
    mirrored.

    Unknown values are None; if the frame is not identified, this applies to everything measured
    with its stars.

    Attributes
    ----------
    error : Exception or None
        Exception of a frame that could not be solved, in results of `Pipeline.solve_many`.
    """

    error: Exception | None = None
    _input: Input | None = None

    def __init__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)

    @classmethod
    def _of(cls, solved: _starpipe.Solved, frame: Input | None) -> Result:
        return cls({"_solved": solved, "_input": frame})

    def _keeping_paths(self) -> Result:
        """Return the result without the pixels of its frame; what is in files is read again."""
        if self._input is not None and not self._input.is_of_files:
            self._input = None
        return self

    @classmethod
    def _unread(cls, name: str, error: Exception) -> Result:
        """Return what stands for a frame without an answer."""
        nothing = ("attitude", "optics", "match", "magnitude", "photometry", "prediction")
        report: dict[str, Any] = dict.fromkeys((*nothing, "width", "height"))
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
            "_input": self._input if self._input and self._input.is_of_files else None,
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

    @property
    def _is_bottom_up(self) -> bool:
        """Whether the first row is the bottom of the picture as drawn."""
        return self._row_order == "BOTTOM-UP"

    @property
    def _name(self) -> str:
        name: str = self._report["frame"]
        return name

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
        name = printable(report["frame"])
        if self.error is not None:
            return f"<Result {name}: {type(self.error).__name__}: {printable(str(self.error))}>"
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
                ("shows", str(self.sentence)),
                ("center", f"{attitude['ra_deg']:.5f}°, {attitude['dec_deg']:+.5f}°"),
                ("field", f"{optics['fov_x_deg']:.3f}° by {optics['fov_y_deg']:.3f}°"),
                ("stars", f"{match['matched']} of {match['detected']} named"),
                ("false alarm", f"10^{match['log10_false_alarm']:.0f}"),
            ]
        else:
            rows += [("not identified", str(self.reason))]
        rows += [("note", note) for note in self.notes]
        cells = "".join(
            f"<tr><th>{html.escape(name)}</th><td>{html.escape(printable(value))}</td></tr>"
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
            labels.append(f"<text {place}>{html.escape(printable(star['name']))}</text>")
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
        """Names of options that may help if the stars are not identified."""
        return self._report["remedies"]  # type: ignore[no-any-return]

    @property
    def sentence(self) -> str | None:
        """What the frame shows, in one sentence; ``None`` if it is not identified."""
        return self._report["sentence"]  # type: ignore[no-any-return]

    @property
    def constellations(self) -> list[dict[str, Any]]:
        """Constellations in the frame, largest share first: the `constellations` of the JSON."""
        return self._report["constellations"]  # type: ignore[no-any-return]

    @property
    def annotations(self) -> list[dict[str, Any]]:
        """Named objects in the frame: the `annotations` of the JSON, with pixels as in `stars`.

        Bright stars are listed even if they were not measured; ``why`` gives the reason.
        """
        height = self._report["height"]
        found = [dict(shown) for shown in self._report["annotations"]]
        for shown in found if self._is_bottom_up else []:
            shown["y"] = height - 1 - shown["y"]
        return found

    @property
    def notes(self) -> list[str]:
        """Notes: problems of the header or the options, and unusual properties of the frame."""
        return [note["text"] for note in self._report["notes"]]

    @property
    def photometry(self) -> dict[str, Any] | None:
        """Zero point and limiting magnitude."""
        return self._report["photometry"]  # type: ignore[no-any-return]

    @property
    def prediction(self) -> dict[str, Any] | None:
        """Prediction for the camera, if one is given."""
        return self._report["prediction"]  # type: ignore[no-any-return]

    @property
    def sky_map(self) -> dict[str, Any] | None:
        """Brightness, extinction and clouds (`sky` of the JSON); needs ``sky=True``."""
        return self._report.get("sky")

    @property
    def trails(self) -> list[dict[str, Any]] | None:
        """Trails of satellites and the like (`trails` of the JSON); needs ``trails=True``."""
        return self._report.get("trails")

    @property
    def timing(self) -> dict[str, float]:
        """Run time of each stage, in milliseconds."""
        return self._report["timing_ms"]  # type: ignore[no-any-return]

    @property
    def _attitude(self) -> dict[str, Any] | None:
        attitude: dict[str, Any] | None = self._report["attitude"]
        return attitude

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the frame."""
        return self._report["height"], self._report["width"]

    @property
    def fov(self) -> Quantity | None:
        """Field of view: horizontal and vertical, in degrees.

        The angles between the midpoints of opposite borders; NaN if one is outside the image
        circle.
        """
        optics = self._report["optics"]
        if optics is None:
            return None
        return quantity([optics["fov_x_deg"], optics["fov_y_deg"]], "deg")

    @property
    def pixel_scale(self) -> Quantity | None:
        """Pixel scale at the frame's center, in arcseconds per pixel.

        For lenses other than pinholes, it is that on the axis.
        """
        optics = self._report["optics"]
        if optics is None:
            return None
        return quantity(ARCSEC_PER_RAD / optics["focal_length_px"], "arcsec / pix")

    @property
    def distortion(self) -> Distortion | None:
        """Distortion of the lens; also None if it is not measurable."""
        optics = self._report["optics"]
        found = None if optics is None else optics["distortion"]
        if found is None:
            return None
        fields = {name: found[name] for name in Distortion.__slots__}
        return Distortion(**fields | {"coefficients_px": np.array(found["coefficients_px"])})

    @property
    def match(self) -> Match | None:
        """How well the detections match the catalog."""
        found = self._report["match"]
        if found is None:
            return None
        known = (self.prediction or {}) | found
        return Match(**{name: known.get(name) for name in Match.__slots__})

    @property
    def limit(self) -> Limit | None:
        """Measured and predicted limiting magnitude."""
        measured, compared = self._report["photometry"], self._report["magnitude"]
        if measured is None and compared is None:
            return None
        known = (measured or {}) | (compared or {})
        return Limit(**{name: known.get(name) for name in Limit.__slots__})

    @property
    def wcs(self) -> WCS | None:
        """World coordinates of the pixels of `stars`."""
        cards = self._wcs_header
        return None if cards is None else wcs_of(cards, self.shape)

    def to_header(self) -> Header | None:
        """Return `wcs` as a FITS header, to be added to that of the file or the array."""
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
        """Every detection, brightest first, as arrays; missing values are NaN or ""."""
        return _tables.star_columns(self._report["stars"])

    @property
    def stars(self) -> QTable:
        """Every detection, brightest first, as a ``QTable``, or `star_columns` without astropy.

        Cells have units. If plain numbers are needed, as in ``float(row["x"])``, use `plain_stars`.
        """
        return self._star_table(plain=False)

    @property
    def plain_stars(self) -> PlainTable:
        """`stars` as a ``Table`` whose cells are plain numbers; its columns have the units."""
        return self._star_table(plain=True)

    def _star_table(self, *, plain: bool) -> Any:
        columns = self.star_columns
        table = _tables.star_table(columns, plain=plain)
        if table is not columns:
            table.meta["frame"] = self._report["frame"]
        return table

    @property
    def sky(self) -> SkyCoord | None:
        """ICRS positions of `stars` at the frame's date."""
        from astropy.coordinates import SkyCoord

        if not self:
            return None
        columns = self.star_columns
        return SkyCoord(columns["ra_deg"], columns["dec_deg"], unit="deg", frame="icrs")

    def to_arrow(self) -> Table:
        """Return `star_columns` as a ``pyarrow.Table``."""
        import pyarrow

        return pyarrow.table(self.star_columns)

    def plot(
        self,
        ax: Axes | None = None,
        *,
        image: ImageLike | None = None,
        rings: _plot.Rings = "named",
        names: int = 20,
    ) -> Axes:
        """Draw the photograph with its stars marked and named, with matplotlib.

        A color photograph is shown in color, and brightened as in the program's overlays. A frame
        that was solved from a file is read again. Coordinates are the pixels of `stars`; the rows
        of a file that begins with the bottom row run upward.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Where to draw; new axes by default.
        image : path, array or another image, optional
            The photograph, if the result does not keep it: for a list of centroids, and for an
            array if the result is from `Pipeline.solve_many` or was unpickled. Without a photograph
            the background is dark.
        rings : {"named", "all", "none"}
            Detections to mark: "named" for stars with a label (all detections if the frame is not
            identified), all, or none. Circles mark identified stars, squares other detections, and
            crosses detections that are not shaped like stars.
        names : int
            How many stars to label: the brightest with a proper name, and then the brightest
            others with their catalog number.

        Returns
        -------
        matplotlib.axes.Axes

        Raises
        ------
        ImportError
            If matplotlib is not installed.
        OSError
            If the file cannot be read. An exception in `error` is raised again.
        ValueError
            If `image` does not have the size of the frame.
        """
        if self.error is not None:
            raise self.error
        frame = self._shown(image)
        picture = None if frame is None else _starpipe.picture(frame)
        if picture is not None and picture[1] != self.shape:
            (found_rows, found_columns), (rows, columns) = picture[1], self.shape
            sizes = f"{found_columns} x {found_rows} pixels, the frame {columns} x {rows}"
            raise ValueError(f"the image is {sizes}")
        return _plot.draw(self, picture, ax, rings, names)

    def write_page(
        self, path: PathLike, *, image: ImageLike | None = None, overwrite: bool = False
    ) -> None:
        """Write a page for a browser, as ``starpipe process --html`` does.

        The page is a single HTML file with the result, the picture with its stars, figures and a
        table. Pixels are those of `stars`, and the first row is on top.

        Parameters
        ----------
        path : path
            The file; its name ends with ``.html``.
        image : path, array or another image, optional
            The photograph, as for `plot`; without one the page has no picture.
        overwrite : bool
            Whether to replace a file that exists.

        Raises
        ------
        OSError
            If the file exists, or cannot be written; if the frame cannot be read.
        ValueError
            If `image` does not have the size of the frame, or the result was unpickled.
        """
        content = self._found.page(self._shown(image))
        _write(path, content.encode(), overwrite)

    def write_regions(self, path: PathLike, *, overwrite: bool = False) -> None:
        """Write the detections as regions for SAOImage DS9, as ``--regions`` does.

        Positions are in pixels of the file, as counted by DS9.

        Parameters
        ----------
        path : path
            The file; its name ends with ``.reg``.
        overwrite : bool
            Whether to replace a file that exists.

        Raises
        ------
        OSError
            If the file exists, or cannot be written.
        ValueError
            If the result was unpickled.
        """
        _write(path, self._found.regions().encode(), overwrite)

    def write_fits(
        self, path: PathLike, *, image: ImageLike | None = None, overwrite: bool = False
    ) -> None:
        """Write a copy of the frame with `wcs` in its header, as ``--write-fits`` does.

        The copy has the pixels that were solved: the luminance of a color frame, calibrated with
        dark and flat. Its rows are in the order of the array, so its pixels are those of `stars`.
        To keep the header of a file, add `to_header` to that header instead.

        Parameters
        ----------
        path : path
            The file; its name ends with ``.fits``.
        image : path, array or another image, optional
            The frame, if the result does not keep it, as for `plot`.
        overwrite : bool
            Whether to replace a file that exists.

        Raises
        ------
        OSError
            If the file exists, or cannot be written; if the frame cannot be read.
        ValueError
            If the stars are not identified, there is no frame, `image` does not have its size, or
            the result was unpickled.
        """
        found, frame = self._found, self._shown(image)
        if frame is None:
            raise ValueError("the result has no frame to copy: pass it as image=...")
        content = found.fits_copy(frame)
        if content is None:
            raise ValueError(f"a frame that is not identified has no coordinates: {self.reason}")
        _write(path, content, overwrite)

    @property
    def _found(self) -> _starpipe.Solved:
        """What the compiled part found."""
        if self.error is not None:
            raise self.error
        solved: _starpipe.Solved | None = self.__dict__.get("_solved")
        if solved is None:
            raise ValueError("an unpickled result cannot be written: solve the frame again")
        return solved

    def _shown(self, image: ImageLike | None) -> Input | None:
        """Return the frame to show: `image`, or what was solved."""
        return self._input if image is None else Input(Image(image).pixels)

    def write(self, path: PathLike, *, format: str | None = None, **options: Any) -> None:
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


def _write(path: PathLike, content: bytes, overwrite: bool) -> None:
    """Write a file, whole or not at all."""
    if not overwrite and os.path.lexists(path):
        raise FileExistsError(f"{os.fspath(path)} exists; overwrite=True replaces it")
    _starpipe.write_file(path, content)


def wcs_of(cards: bytes, shape: tuple[int, ...]) -> WCS:
    """Return the WCS in the cards of a header, for an image of `shape`."""
    from astropy.wcs import WCS

    header = _header(cards)
    # It describes an image, and has none: astropy would warn.
    header.remove("NAXIS", ignore_missing=True)
    wcs = WCS(header, fix=False)
    wcs.pixel_shape = shape[::-1]
    return wcs


def _header(cards: bytes) -> Header:
    from astropy.io.fits import Header

    return Header.fromstring(cards)
