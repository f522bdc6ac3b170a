from os import PathLike
from typing import Any, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

__all__ = ["Pipeline", "Solved"]

_Image: TypeAlias = (
    bytes
    | str
    | PathLike[str]
    | NDArray[np.uint8]
    | NDArray[np.uint16]
    | NDArray[np.float32]
    | tuple[NDArray[np.int64], int]
)

@final
class Pipeline:
    def __new__(
        cls,
        catalog: str | PathLike[str] | None,
        camera: str | PathLike[str] | None,
        cache_dir: str | PathLike[str] | None,
    ) -> Pipeline: ...
    def solve(
        self,
        image: _Image,
        mask: NDArray[np.bool_] | None,
        hints: dict[str, Any],
        dark: _Image | None,
        flat: _Image | None,
        sigma: float | None,
        max_stars: int | None,
        attitude_only: bool,
        threads: int,
    ) -> Solved: ...
    def identify(
        self,
        centroids: NDArray[np.float64],
        shape: tuple[int, int],
        hints: dict[str, Any],
        attitude_only: bool,
    ) -> Solved: ...

@final
class Solved:
    @property
    def identified(self) -> bool: ...
    def json(self) -> str: ...
    def wcs_header(self, top_down: bool) -> bytes | None: ...
    def attitude_covariance_rad2(self) -> list[list[float]] | None: ...
