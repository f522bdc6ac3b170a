"""The pipeline."""

from __future__ import annotations

import inspect
import os
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from . import _starpipe
from ._camera import PathLike
from ._hints import thread_count, whole_number
from ._images import Image, ImageLike, Input
from ._options import SolveOptions, solve_options, takes_options
from ._result import Result

if TYPE_CHECKING:
    from typing_extensions import Unpack


class Pipeline:
    """Find and name the stars of frames, and determine where the camera pointed.

    A pipeline may be used by several threads at once, and can be pickled. Its catalog is read once
    per process.

    Parameters
    ----------
    catalog : path, optional
        A star catalog instead of the built-in one: SKY2000, Tycho-2, a table, or a file written
        by ``starpipe catalog import``. Or one for narrow fields, which is used beside the built-in
        one: index files of astrometry.net, or a database of ASTAP. If none is given, those that
        are installed are used, such as the package ``starpipe-tycho2``.
    camera : path or str, optional
        A description of the camera (TOML), or the name of a preset. It gives the scale if no
        option does, and a predicted limiting magnitude.
    cache_dir : path, optional
        Directory for the index of the catalog. The user's cache directory by default.

    Raises
    ------
    OSError
        If a file cannot be read.
    ValueError
        If a file has no catalog or no camera.
    """

    def __init__(
        self,
        catalog: PathLike | None = None,
        camera: PathLike | None = None,
        cache_dir: PathLike | None = None,
    ) -> None:
        self._arguments = (catalog, camera, cache_dir)
        self._pipeline = _starpipe.Pipeline(catalog, camera, cache_dir)

    def __reduce__(self) -> tuple[type[Pipeline], tuple[PathLike | None, ...]]:
        return type(self), self._arguments

    def __repr__(self) -> str:
        names = ("catalog", "camera", "cache_dir")
        given = zip(names, self._arguments, strict=True)
        return f"Pipeline({', '.join(f'{k}={str(v)!r}' for k, v in given if v is not None)})"

    @takes_options
    def solve(
        self,
        image: ImageLike,
        mask: ArrayLike | None = None,
        *,
        name: PathLike | None = None,
        dark: ImageLike | None = None,
        flat: ImageLike | None = None,
        threads: int = 1,
        **options: Unpack[SolveOptions],
    ) -> Result:
        """Solve one frame.

        Parameters
        ----------
        image : path, bytes, file, array, PIL image, HDU, HDUList, CCDData or NDData
            The frame. An array has the shape (rows, columns), or (rows, columns, 3) for colors, and
            real numbers. Contiguous arrays of uint8, uint16 and float32 are not copied. From an
            HDUList the same image is used as from its file. An object's mask and header are used.
        mask : array of bool, optional
            True for pixels to ignore; its rows are in the order of those of `image`.
        name : path, optional
            Name of the frame, if `image` is not a path; a date in the name is used.
        dark, flat : image, optional
            Master dark to subtract, and master flat to divide by. If frame and master are files,
            they are matched as displayed, otherwise row by row.
        threads : int
            Threads for this frame, at most 8, or the number of processors if larger.
        **options
            Options, see `SolveOptions`.

        Returns
        -------
        Result
            Its truth value is False if the stars are not identified. It keeps an array that was
            passed, for `Result.plot`; a file is read again.

        Raises
        ------
        OSError
            If a file cannot be read.
        ValueError
            If the file has no image, or an argument is out of range.
        TypeError
            If an argument is of a wrong type.
        TimeoutError
            If the frame is not solved within `time_limit`.
        RuntimeError
            If starpipe has a bug.
        """
        taken = Image(image)
        frame = taken.input(name, mask, dark, flat, self._pipeline.bias_adu)
        stated = solve_options(taken.header, **options)
        solved = self._pipeline.solve(frame, stated, thread_count(threads), False)
        return _in_time(solved, frame)

    def point(self, image: ImageLike, mask: ArrayLike | None = None, **known: Any) -> Result:
        """Measure only where the camera points, from the brightest stars.

        Several times faster than `solve`: the faint stars are neither measured nor named.

        Parameters
        ----------
        image : path, bytes, file, array, PIL image, HDU, HDUList, CCDData or NDData
            The frame, as `solve` takes it.
        mask : array of bool, optional
            True for pixels to ignore.
        **known
            Other arguments of `solve`.

        Returns
        -------
        Result
            The same as `solve` returns with `attitude_only`.

        Raises
        ------
        OSError, ValueError, TypeError, TimeoutError, RuntimeError
            As `solve` does.
        """
        return self.solve(image, mask, attitude_only=True, **known)

    @takes_options
    def identify(
        self,
        x: ArrayLike,
        y: ArrayLike,
        *,
        shape: tuple[int, int] | None = None,
        flux: ArrayLike | None = None,
        mag: ArrayLike | None = None,
        error: ArrayLike | None = None,
        **options: Unpack[SolveOptions],
    ) -> Result:
        """Identify the stars of a list of centroids.

        Parameters
        ----------
        x, y : array
            Positions in pixels: (0, 0) is the center of the first pixel.
        shape : (int, int), optional
            Rows and columns of the frame; those of the pipeline's camera by default. Without a
            camera the extent of the centroids is used; `notes` say so, and the errors include the
            uncertainty of the frame's center.
        flux, mag : array, optional
            Brightness, either linear or in magnitudes. If neither is given, the positions must be
            sorted by brightness.
        error : array or float, optional
            Standard error on each axis, in pixels; 0.5 by default.

            Positions are ignored if a number is not finite, if a flux or an error is 0 or below, or
            if they coincide with a brighter one; `notes` report them.
        **options
            Options, see `SolveOptions`; those that need pixels are ignored.

        Returns
        -------
        Result
            Its truth value is False if the stars are not identified.

        Raises
        ------
        ValueError
            If arrays do not match, an argument is out of range, the shape is not that of the
            pipeline's camera, or a position is more than 5 pixels outside the frame.
        TimeoutError
            If the frame is not solved within `time_limit`.
        """
        if flux is not None and mag is not None:
            raise ValueError("flux and mag are alternatives: give one")
        if error is not None and np.ndim(error) == 0 and not np.asarray(error) > 0.0:
            raise ValueError(f"error must be above 0, not {error}")
        brightness = "flux" if flux is not None else "mag" if mag is not None else None
        values = flux if flux is not None else mag
        given = (x, y, np.nan if values is None else values, np.nan if error is None else error)
        columns = [np.asarray(column, dtype=np.float64) for column in given]
        for number in (2, 3):
            if columns[number].ndim == 0:
                columns[number] = np.full_like(columns[0], columns[number])
        shapes = {column.shape for column in columns}
        if len(shapes) > 1 or columns[0].ndim != 1:
            found = ", ".join(str(column.shape) for column in columns)
            raise ValueError(f"x, y, brightness and error must be lists of one length, not {found}")
        table = np.stack(columns, axis=-1)
        sides = None
        if shape is not None:
            rows, width = (whole_number(side, "shape", 3) for side in shape)
            sides = (rows, width)
        solved = self._pipeline.identify(
            table, sides, brightness, error is not None, solve_options(**options)
        )
        return _in_time(solved, None)

    def solve_many(
        self, images: Iterable[ImageLike], *, threads: int = 1, **known: Any
    ) -> Iterator[Result]:
        """Solve many frames on several threads; results come in the order of the images.

        Images are read as results are consumed; at most twice `threads` are in progress.

        Parameters
        ----------
        images : iterable
            Images as `solve` takes them, preferably paths.
        threads : int
            Number of frames that are solved at once, at most 8, or the number of processors if
            larger. The memory limit applies to each frame.
        **known
            Other arguments of `solve`, for all frames.

        Yields
        ------
        Result
            As of `solve`, but without the pixels of images that are no files. An image that cannot
            be read does not end the others: its result is false, and has in `error` what `solve`
            raises for it.

        Raises
        ------
        TypeError, ValueError
            If an argument is of a wrong type or out of range.
        """
        inspect.signature(self.solve).bind(None, **known)
        stated = known.keys() & SolveOptions.__annotations__.keys()
        solve_options(**{name: known[name] for name in stated})
        return self._solve_in_order(images, thread_count(threads), known)

    def _solve_in_order(
        self, images: Iterable[ImageLike], workers: int, known: dict[str, Any]
    ) -> Iterator[Result]:
        waiting: deque[Future[Result]] = deque()
        pool = ThreadPoolExecutor(workers, thread_name_prefix="starpipe")
        try:
            for image in images:
                waiting.append(pool.submit(self._result, image, known))
                if len(waiting) >= 2 * workers:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            # Ctrl-C does not wait for the frames in work.
            pool.shutdown(wait=False, cancel_futures=True)

    def _result(self, image: ImageLike, known: dict[str, Any]) -> Result:
        """Return the result of an image; what is wrong with it alone is part of the result."""
        try:
            return self.solve(image, **known)._keeping_paths()
        except (OSError, ValueError, RuntimeError) as error:
            is_path = isinstance(image, (str, os.PathLike))
            name = str(image) if is_path else type(image).__name__
            return Result._unread(name, error)


def _in_time(solved: _starpipe.Solved, frame: Input | None) -> Result:
    """Return the result, unless there was no answer within the time limit."""
    reason = solved.timeout
    if reason is not None:
        raise TimeoutError(reason)
    return Result._of(solved, frame)
