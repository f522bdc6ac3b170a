"""Lens of a camera, measured in several of its frames."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from . import _starpipe
from ._result import Result


class LensCalibration:
    """A lens measured in several frames.

    Attributes
    ----------
    report : dict
        The JSON of ``starpipe calibrate``: ``lens``, ``frames``, ``left_out``, ``rms_px``,
        ``held_out_rms_px``, ``drift``, ``mount``, ...
    toml : str
        The lens as a camera description. To use it, write it to a file (see `save`), and pass
        the path to ``Pipeline(camera=path)``.
    """

    def __init__(self, report: dict[str, Any], toml: str) -> None:
        self.report = report
        self.toml = toml

    def __repr__(self) -> str:
        lens = self.report["lens"]
        return (
            f"<LensCalibration: {lens['model']}, focal length {lens['focal_length_px']} px, "
            f"{self.report['stars']} stars in {len(self.report['frames'])} frames>"
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the lens into a new file."""
        with Path(path).open("x", encoding="utf-8") as file:
            file.write(self.toml)


def calibrate(results: Iterable[Result]) -> LensCalibration:
    """Measure the lens of a camera in frames that a pipeline has solved.

    Frames that are not identified, or do not agree with the others, are not used and listed in
    ``LensCalibration.report["left_out"]``.

    Parameters
    ----------
    results : iterable of Result
        Results of `Pipeline.solve` or `Pipeline.solve_many`, but not unpickled ones.

    Raises
    ------
    ValueError
        If no frame is identified, or the stars do not determine a lens.
    """
    solved: list[_starpipe.Solved] = []
    for result in results:
        found: _starpipe.Solved | None = result.__dict__.get("_solved")
        if found is None:
            raise ValueError("an unpickled result has no stars to calibrate with")
        solved.append(found)
    report, toml = _starpipe.calibrate(solved)
    return LensCalibration(json.loads(report), toml)
