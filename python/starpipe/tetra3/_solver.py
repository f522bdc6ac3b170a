"""The solver."""

from __future__ import annotations

import logging
import threading
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._camera import PathLike
from .._pipeline import Pipeline
from .._result import Result
from ._extract import Extraction, extract, pixels_of
from ._question import Question, divided, takes
from ._sky import Array
from ._solution import (
    CANCELLED,
    EPOCH,
    EQUINOX,
    MATCH_FOUND,
    NO_MATCH,
    PATTERN_SIZE,
    TIMEOUT,
    TOO_FEW,
    solved,
    unsolved,
)

POLL_S = 0.01
"""How often a search is asked whether it was cancelled."""

MAG_PER_DECADE = 2.0
"""Magnitudes in which ten times as many stars are brighter: of lists in order of brightness."""

NO_DATABASE = "starpipe has its catalog built in: no database is needed, and none is written"

UNKNOWN = (
    *("pattern_mode", "pattern_size", "pattern_bins", "pattern_max_error", "hash_table_type"),
    *("pattern_stars_per_fov", "verification_stars_per_fov", "lattice_field_oversampling"),
    *("patterns_per_lattice_field", "simplify_pattern", "presort_patterns", "num_patterns"),
    *("star_max_magnitude", "range_ra", "range_dec"),
)
"""Properties of databases that starpipe's catalog does not have."""

logger = logging.getLogger("starpipe.tetra3")


class Tetra3:
    """Solve star patterns with the methods and arguments of tetra3 and cedar-solve.

    Parameters
    ----------
    load_database, pattern_cache_size_fraction : optional
        Without effect: the star catalog is built in.
    debug_folder : pathlib.Path, optional
        Is created and kept; nothing is written there.
    """

    def __init__(
        self,
        load_database: PathLike | None = "default_database",
        debug_folder: Path | None = None,
        pattern_cache_size_fraction: float | None = None,
    ) -> None:
        self._pipeline = Pipeline()
        self._cancelled = threading.Event()
        self._debug_folder: Path | None = None
        if debug_folder is not None:
            self.debug_folder = debug_folder

    @property
    def debug_folder(self) -> Path | None:
        """Folder for debug logging, which is created; nothing is written there."""
        return self._debug_folder

    @debug_folder.setter
    def debug_folder(self, path: Path) -> None:
        folder = path.parent if path.is_file() else path
        folder.mkdir(parents=True, exist_ok=True)
        self._debug_folder = folder

    @property
    def has_database(self) -> bool:
        """Whether there is a catalog: always."""
        return True

    @property
    def database_properties(self) -> dict[str, Any]:
        """Properties of the catalog; None for those that only patterns of stars have."""
        known = {"star_catalog": "SKY2000", "min_fov": 1.5, "max_fov": 180.0}
        known |= {"epoch_equinox": EQUINOX, "epoch_proper_motion": EPOCH}
        return dict.fromkeys(UNKNOWN) | known

    star_table = None
    """Not available: the catalog is part of starpipe's compiled code."""
    star_kd_tree = None
    """Not available."""
    star_catalog_IDs = None  # noqa: N815
    """Not available."""
    pattern_catalog = None
    """Not available: starpipe has no patterns."""
    pattern_largest_edge = None
    """Not available."""
    num_patterns = None
    """Not available."""

    def load_database(self, path: PathLike = "default_database") -> None:
        """Do nothing: the catalog is built in. Any name is accepted."""
        logger.info("load_database(%r): %s", str(path), NO_DATABASE)

    def save_database(self, path: PathLike) -> None:
        """Warn that no database is needed, and write none."""
        warnings.warn(f"save_database: {NO_DATABASE}", stacklevel=2)

    def generate_database(
        self,
        max_fov: float,
        min_fov: float | None = None,
        save_as: PathLike | None = None,
        star_catalog: PathLike = "hip_main",
        *,
        lattice_field_oversampling: int | None = None,
        patterns_per_lattice_field: int | None = None,
        pattern_stars_per_fov: int | None = None,
        verification_stars_per_fov: int | None = None,
        star_max_magnitude: float | None = None,
        pattern_max_error: float | None = None,
        simplify_pattern: bool | None = None,
        range_ra: tuple[float, float] | None = None,
        range_dec: tuple[float, float] | None = None,
        presort_patterns: bool | None = None,
        save_largest_edge: bool | None = None,
        multiscale_step: float | None = None,
        epoch_proper_motion: str | float | None = None,
        linear_probe: bool | None = None,
    ) -> None:
        """Warn that no database is needed, and make none."""
        warnings.warn(f"generate_database: {NO_DATABASE}", stacklevel=2)

    @takes(Question, Extraction)
    def solve_from_image(
        self,
        image: Any,
        fov_estimate: float | None = None,
        fov_max_error: float | None = None,
        **arguments: Any,
    ) -> Any:
        """Identify the stars of an image.

        Parameters
        ----------
        image : PIL image or array
            The image, gray or in colors.
        fov_estimate, fov_max_error : float, optional
            Approximate horizontal field of view, and its largest error, in degrees. An estimate
            without `fov_max_error` may be wrong: the stars are then identified without it.
        **arguments
            Those of `solve_from_centroids` and of `get_centroids_from_image`.

        Returns
        -------
        dict or tuple
            The solution, as from `solve_from_centroids`, with ``T_extract``. A tuple with moments
            and pictures if they are asked for.

        Raises
        ------
        TypeError
            If an argument is unknown.
        ValueError
            If the image cannot be solved, or an argument is out of range.
        """
        arguments |= {"fov_estimate": fov_estimate, "fov_max_error": fov_max_error}
        question, wanted = divided(arguments, Question, Extraction)
        pixels = pixels_of(image)
        if wanted.is_plain:
            solution, result = self._solve(partial(self._pipeline.solve, pixels), question)
            times = result.timing if result is not None else {}
            solution["T_extract"] = times.get("read", 0.0) + times.get("detect", 0.0)
            solution["T_solve"] -= solution["T_extract"]
            return solution
        started = perf_counter()
        spots, more = extract(pixels, wanted)
        extract_ms = _milliseconds_since(started)
        known = {"flux": spots.flux, "error": spots.error}
        solution = self._solve_list(spots.centroids, pixels.shape[:2], question, **known)
        solution["T_extract"] = extract_ms
        return (solution, *more) if more else solution

    @takes(Question)
    def solve_from_centroids(
        self,
        star_centroids: ArrayLike,
        size: tuple[float, float],
        fov_estimate: float | None = None,
        fov_max_error: float | None = None,
        **arguments: Any,
    ) -> dict[str, Any]:
        """Identify the stars of a list of centroids.

        Parameters
        ----------
        star_centroids : array
            Rows of (y, x), brightest first: (0.5, 0.5) is the center of the first pixel.
        size : (float, float)
            Height and width of the frame.
        fov_estimate, fov_max_error : float, optional
            As for `solve_from_image`.
        **arguments
            ``match_threshold`` (largest probability of a false solution; starpipe requires 1e-8),
            ``solve_timeout`` (in milliseconds; no limit by default), ``target_pixel`` (rows of
            (y, x) whose right ascension and declination are wanted), ``target_sky_coord`` (the
            reverse), ``return_matches``, ``return_catalog``, ``return_visual``,
            ``return_rotation_matrix``, ``match_radius`` (of the circles in the picture, as a share
            of the width) and ``distortion`` (None: the solution has none). ``match_max_error`` and
            ``pattern_checking_stars`` have no effect.

        Returns
        -------
        dict
            ``RA``, ``Dec``, ``Roll``, ``FOV`` (degrees), ``distortion``, ``RMSE``, ``P90E``,
            ``MAXE`` (arcseconds), ``Matches``, ``Prob``, ``epoch_equinox``,
            ``epoch_proper_motion``, ``cache_hit_fraction``, ``T_solve`` (milliseconds) and
            ``status``, and what is asked for. All but the last two are None if the status is not
            `MATCH_FOUND`.

        Raises
        ------
        TypeError
            If an argument is unknown.
        ValueError
            If an argument is out of range, or a centroid is more than 5 pixels outside the frame.
        """
        arguments |= {"fov_estimate": fov_estimate, "fov_max_error": fov_max_error}
        (question,) = divided(arguments, Question)
        centroids = np.reshape(np.asarray(star_centroids, dtype=np.float64), (-1, 2))
        return self._solve_list(centroids, size, question)

    def cancel_solve(self) -> None:
        """End the solve that is running in another thread; if none is, the next one."""
        self._cancelled.set()

    def _solve_list(
        self, centroids: Array, size: Sequence[float], question: Question, **known: Any
    ) -> dict[str, Any]:
        """Return the solution of a list of centroids (y, x), brightest first."""
        if len(centroids) < PATTERN_SIZE:
            return unsolved(TOO_FEW) | {"T_solve": 0.0}
        y, x = centroids.T - 0.5
        if "flux" not in known:
            known["mag"] = MAG_PER_DECADE * np.log10(np.arange(1, len(centroids) + 1))
        shape = (round(size[0]), round(size[1]))
        solve = partial(self._pipeline.identify, x, y, shape=shape, **known)
        return self._solve(solve, question, centroids)[0]

    def _solve(
        self, solve: Callable[..., Result], question: Question, given: Array | None = None
    ) -> tuple[dict[str, Any], Result | None]:
        """Return the solution, and the result of the last search if it ended."""
        started = perf_counter()
        result, status = self._search(solve, question)
        if result is not None and status == MATCH_FOUND:
            solution = solved(result, question, given)
        else:
            solution = unsolved(status)
        return solution | {"T_solve": _milliseconds_since(started)}, result

    def _search(
        self, solve: Callable[..., Result], question: Question
    ) -> tuple[Result | None, int]:
        """Solve with the hints, and without them if they may be wrong; return the status, too."""
        limit, started = question.solve_timeout, perf_counter()
        result = None
        for options in question.attempts():
            if limit is not None:
                options["time_limit"] = (float(limit) - _milliseconds_since(started)) / 1000.0
                if options["time_limit"] <= 0.0:
                    return None, TIMEOUT
            try:
                result = self._unless_cancelled(partial(solve, **options))
            except TimeoutError:
                return None, TIMEOUT
            if result is None:
                return None, CANCELLED
            if result and question.accepts(result):
                return result, MATCH_FOUND
        assert result is not None
        return result, TOO_FEW if len(result.star_columns["x"]) < PATTERN_SIZE else NO_MATCH

    def _unless_cancelled(self, solve: Callable[[], Result]) -> Result | None:
        """Return the result of a search, or None as soon as it is cancelled.

        A search that is cancelled ends by itself in its thread; nobody waits for it.
        """
        pool = ThreadPoolExecutor(1, thread_name_prefix="starpipe")
        try:
            found = None if self._cancelled.is_set() else pool.submit(solve)
            while found is not None and not self._cancelled.is_set():
                if wait([found], POLL_S).done:
                    return found.result()
            self._cancelled.clear()
            return None
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def _milliseconds_since(started: float) -> float:
    return 1000.0 * (perf_counter() - started)
