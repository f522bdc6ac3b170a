from collections.abc import Iterable, Sequence
from os import PathLike
from typing import Any, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "ArchivePlan",
    "DarkFrames",
    "Darks",
    "Page",
    "Pages",
    "PartRows",
    "Pipeline",
    "Simulated",
    "Solved",
    "archive_differences",
    "archive_nights",
    "archive_plan",
    "calibrate",
    "check_size",
    "defocus",
    "detect",
    "limit",
    "read_page",
    "robustness",
    "simulate",
    "star_columns",
    "validate",
]

_Path: TypeAlias = str | PathLike[str]

_Image: TypeAlias = (
    bytes
    | Page
    | str
    | PathLike[str]
    | NDArray[np.uint8]
    | NDArray[np.uint16]
    | NDArray[np.float32]
    | tuple[NDArray[np.int64], int]
)
"""Arrays of 2 dimensions; of float32 and int64 also of 3: the last is that of the colors."""

@final
class Pipeline:
    def __new__(
        cls,
        catalog: _Path | None,
        camera: _Path | None,
        cache_dir: _Path | None,
    ) -> Pipeline: ...
    def solve(
        self,
        image: _Image,
        name: _Path | None,
        mask: NDArray[np.bool_] | None,
        options: dict[str, Any],
        dark: _Image | None,
        flat: _Image | None,
        threads: int,
        as_drawn: bool,
    ) -> Solved: ...
    def identify(
        self,
        centroids: NDArray[np.float64],
        shape: tuple[int, int],
        brightness: str | None,
        has_errors: bool,
        options: dict[str, Any],
    ) -> Solved: ...

@final
class Solved:
    @property
    def identified(self) -> bool: ...
    @property
    def timeout(self) -> str | None: ...
    def json(self) -> str: ...
    def wcs_header(self) -> bytes | None: ...
    @property
    def row_order(self) -> str | None: ...
    def attitude_covariance_rad2(self) -> list[list[float]] | None: ...

@final
class Simulated:
    @property
    def shape(self) -> tuple[int, int]: ...
    @property
    def bits(self) -> int: ...
    @property
    def pixels(self) -> NDArray[np.float32]: ...
    @property
    def truth(self) -> str | None: ...
    @property
    def quaternion(self) -> list[float] | None: ...
    @property
    def wcs_header(self) -> bytes | None: ...
    @property
    def limit_vmag(self) -> float | None: ...
    @property
    def exposure_s(self) -> float: ...

@final
class ArchivePlan:
    @property
    def identity(self) -> str: ...
    @property
    def names(self) -> list[str]: ...
    @property
    def parts(self) -> list[tuple[str, int, int]]: ...

@final
class Page: ...

@final
class Pages:
    def __new__(cls, content: bytes, name: str) -> Pages: ...
    def __iter__(self) -> Pages: ...
    def __next__(self) -> tuple[str, Page | Exception]: ...

def read_page(content: bytes, name: str, number: int) -> Page: ...

@final
class PartRows:
    def __new__(cls) -> PartRows: ...
    def add(self, solved: Solved) -> str: ...
    def add_unread(self, name: str, reason: str) -> None: ...
    def finish(self) -> tuple[bytes, bytes]: ...

def archive_plan(
    names: list[str], frames_per_part: int, pipeline: Pipeline, stated: dict[str, Any]
) -> ArchivePlan: ...
def archive_differences(found: str, wanted: str) -> list[str]: ...
def archive_nights(parts: Iterable[bytes]) -> str: ...

@final
class DarkFrames:
    def __new__(cls) -> DarkFrames: ...
    def add(self, image: _Image, exposure_s: float | None) -> None: ...
    def measure(self, bits: int | None, gain_e_per_adu: float | None) -> Darks: ...

@final
class Darks:
    @property
    def shape(self) -> tuple[int, int]: ...
    def json(self) -> str: ...
    def masters(self) -> list[tuple[float | None, NDArray[np.float32]]]: ...
    def noise_adu(self) -> NDArray[np.float32] | None: ...
    def hot_pixels(self) -> str: ...

def star_columns() -> list[list[str]]: ...
def check_size(width: int, height: int) -> None: ...
def detect(
    image: _Image,
    mask: NDArray[np.bool_] | None,
    sigma: float | None,
    max_stars: int | None,
    threads: int,
) -> str: ...
def calibrate(solved: Sequence[Solved]) -> tuple[str, str]: ...
def limit(stated: dict[str, Any]) -> str: ...
def simulate(
    stated: dict[str, Any],
    subject: tuple[float, float, float] | float | str,
    catalog: _Path | None,
    date: str | None,
    seed: int,
    number: int,
) -> Simulated: ...
def validate(
    stated: dict[str, Any],
    catalog: _Path | None,
    frames: int,
    seed: int,
    scale_known: bool,
    threads: int,
) -> str: ...
def robustness(
    lists: dict[str, Any], catalog: _Path | None, trials: int, seed: int, threads: int
) -> str: ...
def defocus(
    stated: dict[str, Any] | None,
    darks: Darks | None,
    vmag: list[float],
    required_error_px: list[float],
    trials: int | None,
    seed: int,
    threads: int,
) -> str: ...
