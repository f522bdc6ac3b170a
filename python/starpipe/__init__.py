"""Identify the stars in photographs of the night sky, and measure where the camera pointed.

>>> import starpipe as sp
>>> pipeline = sp.Pipeline()
>>> result = pipeline.solve("night.tif")  # doctest: +SKIP
>>> result.center, result.stars  # doctest: +SKIP
"""

from importlib.metadata import version as _version

from ._darks import Darks, darks
from ._detect import Detections, detect
from ._flats import Flats, flats
from ._lens import LensCalibration, calibrate
from ._measured import Distortion, Limit, Match
from ._options import SolveOptions
from ._pipeline import Pipeline
from ._result import Result
from ._simulate import Simulation, simulate
from ._studies import Validation, defocus, limit, robustness, validate
from ._track import Track, Tracker

__all__ = [
    "Darks",
    "Detections",
    "Distortion",
    "Flats",
    "LensCalibration",
    "Limit",
    "Match",
    "Pipeline",
    "Result",
    "Simulation",
    "SolveOptions",
    "Track",
    "Tracker",
    "Validation",
    "calibrate",
    "darks",
    "defocus",
    "detect",
    "flats",
    "limit",
    "robustness",
    "simulate",
    "validate",
]
__version__ = _version("starpipe")
