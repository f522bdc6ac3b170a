"""What is asked of the solver: the arguments that both of its methods have."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from typing import Any, TypeVar

from numpy.typing import ArrayLike

from .._hints import positive
from .._result import Result

SLACK = 1.05
"""How much wider the field of view is searched than accepted: what is compared has errors, too."""

DISTORTED_PERCENT = 10.0
"""How much wider it is searched for a lens with distortion."""


@dataclass(frozen=True)
class Question:
    """What to solve for. The names are tetra3's.

    Parameters
    ----------
    fov_estimate : float, optional
        Approximate horizontal field of view in degrees. A hint: without `fov_max_error` the stars
        are identified even if it is wrong.
    fov_max_error : float, optional
        Largest difference of the field of view from `fov_estimate`, in degrees. Other solutions
        are rejected.
    match_threshold : float
        Largest probability of a false solution; starpipe itself requires 1e-8.
    solve_timeout : float, optional
        Time limit in milliseconds. No limit by default.
    target_pixel : array, optional
        Pixels (y, x) whose right ascension and declination are wanted.
    target_sky_coord : array, optional
        Right ascension and declination, in degrees, whose pixels are wanted.
    distortion : float, tuple or None
        None: the solution has no distortion. Otherwise without effect: it is always measured.
    return_matches, return_catalog, return_visual, return_rotation_matrix : bool
        What the solution has in addition.
    match_radius : float
        Radius of the circles in the picture of `return_visual`, as a share of the width.
    match_max_error, pattern_checking_stars : optional
        Without effect.
    """

    fov_estimate: float | None = None
    fov_max_error: float | None = None
    match_radius: float = 0.01
    match_threshold: float = 1e-4
    solve_timeout: float | None = None
    target_pixel: ArrayLike | None = None
    target_sky_coord: ArrayLike | None = None
    distortion: float | tuple[float, float] | None = 0.0
    return_matches: bool = False
    return_catalog: bool = False
    return_visual: bool = False
    return_rotation_matrix: bool = False
    match_max_error: float | None = None
    pattern_checking_stars: int | None = None

    def attempts(self) -> Iterator[dict[str, Any]]:
        """Yield the options of the searches, to be tried in turn."""
        fov = positive(self.fov_estimate, "deg", "fov_estimate", 360.0)
        error = positive(self.fov_max_error, "deg", "fov_max_error")
        if fov is None:
            yield {}
        elif error is None:
            # An estimate that is right needs little effort, and one that is wrong gets no more.
            yield {"fov": fov, "effort": "fast"}
            yield {}
            yield {"fov": fov}
        else:
            percent = 100.0 * SLACK * error / fov
            if percent < 100.0:
                yield {"fov": fov, "scale_error": percent}
            # The search compares scales, which distortion changes across the field.
            percent += DISTORTED_PERCENT
            yield {"fov": fov, "scale_error": percent} if percent < 100.0 else {}

    def accepts(self, result: Result) -> bool:
        """Whether a solution is within the stated limits."""
        match, fov = result.match, result._report["optics"]["fov_x_deg"]
        assert match is not None
        if 10.0**match.log10_false_alarm > self.match_threshold:
            return False
        if self.fov_estimate is None or self.fov_max_error is None:
            return True
        return fov is not None and abs(fov - self.fov_estimate) <= self.fov_max_error


_Method = TypeVar("_Method", bound=Callable[..., Any])


def takes(*kinds: type) -> Callable[[_Method], _Method]:
    """Replace ``**arguments`` in a method's signature by the fields of data classes."""

    def replace(method: _Method) -> _Method:
        signature = inspect.signature(method)
        own = list(signature.parameters.values())[:-1]
        known = {parameter.name for parameter in own}
        keywords = [
            inspect.Parameter(field.name, inspect.Parameter.KEYWORD_ONLY, default=field.default)
            for kind in kinds
            for field in fields(kind)
            if field.name not in known
        ]
        method.__signature__ = signature.replace(parameters=own + keywords)  # type: ignore[attr-defined]
        return method

    return replace


def divided(arguments: dict[str, Any], *kinds: type) -> list[Any]:
    """Return data classes with the arguments that are theirs; others are errors."""
    names = [{field.name for field in fields(kind)} for kind in kinds]
    for name in arguments.keys() - set().union(*names):
        raise TypeError(f"unexpected keyword argument {name!r}")
    return [
        kind(**{name: arguments[name] for name in arguments.keys() & own})
        for kind, own in zip(kinds, names, strict=True)
    ]
