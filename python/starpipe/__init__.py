"""From a photograph of the night sky to the stars in it, and where the camera pointed.

>>> import starpipe as sp
>>> pipeline = sp.Pipeline()
>>> result = pipeline.solve("night.tif")  # doctest: +SKIP
>>> result.center, result.stars  # doctest: +SKIP
"""

from importlib.metadata import version as _version

from ._pipeline import Pipeline
from ._result import Result

__all__ = ["Pipeline", "Result"]
__version__ = _version("starpipe")
