"""Archives of frames on Dask and object stores.

A task processes a part of the frames: it fetches them through fsspec, solves them, and writes its
rows as two Parquet files. Results of frames are not sent through the scheduler. Parts that are
written are not repeated, so the same call continues a run that was stopped.
"""

from __future__ import annotations

import contextlib
import glob
import json
import os
import sys
import tempfile
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import fsspec

from . import _starpipe
from ._hints import whole_number
from ._images import Input
from ._options import SolveOptions, solve_options, takes_options
from ._pipeline import Pipeline

if TYPE_CHECKING:
    from typing_extensions import Unpack

TABLES = ("frames.parquet", "stars.parquet")
"""Directories of the parts of the two tables."""

CHECKSUMS = "checksums"
"""Directory of the checksums of each part's tables."""

TIME_LIMIT_S = 60.0
"""Default time limit for a frame."""

TRIES = 5
"""How often an object is fetched or written before a task fails."""

FINAL = (
    FileExistsError,
    FileNotFoundError,
    PermissionError,
    IsADirectoryError,
    NotImplementedError,
)
"""Errors after which a part is not tried again."""


@dataclass(frozen=True)
class _Job:
    """What a worker needs to know of a run."""

    out: str
    options: dict[str, Any]
    catalog: str | None
    camera: bytes | None
    stated: dict[str, str]
    read_ahead: int
    page: int | Literal["all"] | None


class Archive:
    """The tables of a run.

    Parameters
    ----------
    out : str
        Directory or URL of the tables.
    storage_options : dict, optional
        Options of fsspec for this directory.
    """

    def __init__(self, out: str, storage_options: dict[str, Any] | None = None) -> None:
        self.out = str(out).rstrip("/")
        self._options = storage_options or {}

    def __repr__(self) -> str:
        return f"<Archive {self.out}>"

    def frames(self) -> Any:
        """Return the table of frames as a dask DataFrame."""
        return self._table(TABLES[0])

    def stars(self) -> Any:
        """Return the table of stars as a dask DataFrame."""
        return self._table(TABLES[1])

    def _table(self, table: str) -> Any:
        from dask import dataframe

        # What was listed while it was written is old.
        _open(self.out, self._options)[0].invalidate_cache()
        return dataframe.read_parquet(f"{self.out}/{table}", storage_options=self._options)

    def summary(self) -> list[dict[str, Any]]:
        """Return a summary of each night and camera, as the JSON of ``starpipe archive report``."""
        parts = sorted(_written(self.out, self._options))
        read = (_fetch(f"{self.out}/{TABLES[0]}/{part}", self._options) for part in parts)
        nights: list[dict[str, Any]] = json.loads(_starpipe.archive_nights(read))
        return nights


@takes_options
def process(
    frames: str | Iterable[str],
    out: str,
    *,
    client: Any = None,
    catalog: str | None = None,
    camera: str | None = None,
    frames_per_part: int = 500,
    storage_options: dict[str, Any] | None = None,
    read_ahead: int = 16,
    retries: int = 3,
    page: int | Literal["all"] | None = None,
    **options: Unpack[SolveOptions],
) -> Archive:
    """Solve the frames of an archive, and write tables of frames and stars.

    Parameters
    ----------
    frames : str or iterable of str
        A pattern (``s3://night/**/*.fits``), or the names of the frames: paths or URLs.
    out : str
        Directory or URL to write to. It belongs to this list of frames and these arguments;
        existing parts are not repeated.
    client : dask.distributed.Client, optional
        Client whose workers process the parts; without one, this process does.
    catalog : path, optional
        As for `Pipeline`; each worker must have it.
    camera : path, optional
        A description of the camera; workers get its content.
    frames_per_part : int
        Frames per task.
    storage_options : dict, optional
        Options of fsspec, for frames and output.
    read_ahead : int
        Frames that a task fetches while it solves another: an object store takes some 50 ms for
        each.
    retries : int
        How often a part is tried again.
    page : int or 'all', optional
        Which image of a file with several, from 1; or all, which are named ``FRAME[1]`` and so on.
        By default the first.
    **options
        Options for all frames, see `SolveOptions`; `time_limit` is 60 seconds by default.

    Returns
    -------
    Archive

    Raises
    ------
    ValueError
        If there are no frames, or the output belongs to another run.
    OSError
        If frames cannot be listed, or the output cannot be written.
    RuntimeError
        If parts failed in every try; the others are written.
    """
    job = _Job(
        out=str(out).rstrip("/"),
        options=storage_options or {},
        catalog=None if catalog is None else str(catalog),
        camera=None if camera is None else Path(camera).read_bytes(),
        stated=solve_options(**({"time_limit": TIME_LIMIT_S} | options)),
        read_ahead=whole_number(read_ahead, "read_ahead", 1),
        page=page if page is None or page == "all" else whole_number(page, "page", 1),
    )
    stated = {
        "options": job.stated,
        "camera": job.camera,
        "page": None if job.page is None else str(job.page),
    }
    names = _list(frames, job.options)
    plan = _starpipe.archive_plan(
        names, whole_number(frames_per_part, "frames_per_part", 1), _pipeline(job), stated
    )
    _claim(job, plan)
    done = _written(job.out, job.options)
    every = plan.names
    work = [(part, every[begin:end]) for part, begin, end in plan.parts if part not in done]
    progress = _Progress(sum(len(names) for _, names in work))
    if client is None:
        for part, names in work:
            progress.add(_process_part(job, part, names))
    else:
        _run(client, job, work, whole_number(retries, "retries", 0), progress)
    progress.finish()
    return Archive(job.out, job.options)


def _list(frames: str | Iterable[str], options: dict[str, Any]) -> list[str]:
    """Return the names of the frames; those of an object store as URLs."""
    if not isinstance(frames, (str, os.PathLike)):
        return [str(frame) for frame in frames]
    pattern = str(frames)
    if "://" not in pattern:
        found = glob.glob(pattern, recursive=True)
        return [name for name in found if not os.path.isdir(name)]
    filesystem, path = fsspec.url_to_fs(pattern, **options)
    found = _again(lambda: filesystem.glob(path))
    bucket = path.split("/")[0]
    if not found and bucket and not _again(lambda: filesystem.exists(bucket)):
        raise FileNotFoundError(f"there is no {filesystem.unstrip_protocol(bucket)}")
    return [filesystem.unstrip_protocol(name) for name in found]


def _claim(job: _Job, plan: _starpipe.ArchivePlan) -> None:
    """Take the output for this run, or go on in it."""
    filesystem, root = _open(job.out, job.options)
    path = f"{root}/archive.json"
    if not _again(lambda: filesystem.exists(path)):
        for table in TABLES:
            if _again(lambda table=table: filesystem.exists(f"{root}/{table}")):  # type: ignore[misc]
                raise ValueError(f"{job.out} has {table} but no archive.json: its run is unknown")
        _write(filesystem, path, plan.identity.encode(), is_new=True)
    found = _again(lambda: filesystem.cat_file(path)).decode()
    differences = _starpipe.archive_differences(found, plan.identity)
    if differences:
        told = ", ".join(differences)
        raise ValueError(
            f"{job.out} has the results of a run with other settings: {told}; choose another output"
        )
    inputs = f"{root}/inputs.txt"
    if not _again(lambda: filesystem.exists(inputs)):
        _write(filesystem, inputs, ("\n".join(plan.names) + "\n").encode())


def _written(out: str, options: dict[str, Any]) -> set[str]:
    """Return the names of the parts that are written."""
    filesystem, root = _open(out, options)
    filesystem.invalidate_cache()
    try:
        found = _again(lambda: filesystem.ls(f"{root}/{TABLES[0]}", detail=False))
    except FileNotFoundError:
        return set()
    names = (path.rstrip("/").rsplit("/", 1)[-1] for path in found)
    return {name for name in names if name.endswith(".parquet") and name.startswith("part-")}


def _run(
    client: Any,
    job: _Job,
    work: list[tuple[str, list[str]]],
    retries: int,
    progress: _Progress,
) -> None:
    """Do the work on a cluster: only some tasks at a time, so that the scheduler stays small."""
    import distributed

    as_completed: Any = distributed.as_completed

    waiting = deque((part, names, 0) for part, names in work)
    at_once = 2 * max(1, sum(client.nthreads().values()))
    shared = client.scatter(job, broadcast=False, hash=False)
    submitted: dict[Any, tuple[str, list[str], int]] = {}
    failed: list[str] = []

    def submit() -> Any:
        part, names, tried = waiting.popleft()
        key = f"starpipe-{part}-{tried}-{time.time_ns()}"
        future = client.submit(_process_part, shared, part, names, key=key, pure=False)
        submitted[future] = part, names, tried
        return future

    running = as_completed([submit() for _ in range(min(at_once, len(waiting)))])
    for future in running:
        part, names, tried = submitted.pop(future)
        error = future.exception()
        if error is None:
            progress.add(future.result())
        elif tried < retries:
            waiting.append((part, names, tried + 1))
        else:
            failed.append(f"{part}: {type(error).__name__}: {error}")
        if waiting:
            running.add(submit())
    if failed:
        raise RuntimeError(
            f"{len(failed)} of {len(work)} parts failed, the others are written; run it again: "
            f"{failed[0]}"
        )


def _process_part(job: _Job, part: str, names: list[str]) -> dict[str, int]:
    """Solve the frames of a part, and write its two files; return how many have which status."""
    pipeline = _pipeline(job)
    rows = _starpipe.PartRows()
    counted: Counter[str] = Counter()
    with ThreadPoolExecutor(job.read_ahead, thread_name_prefix="starpipe-read") as pool:
        for name, image in _images(_ahead(pool, names, job), job):
            try:
                if isinstance(image, Exception):
                    raise image
                solved = pipeline.solve(Input(image, name), job.stated, 1, True)
                status = rows.add(solved)
            except (*FINAL, TimeoutError, ValueError, RuntimeError) as error:
                rows.add_unread(name, str(error).replace("\n", " "))
                counted["unread"] += 1
            else:
                counted[status] += 1
    filesystem, root = _open(job.out, job.options)
    frames, stars, checksums = rows.finish()
    sums = str(Path(part).with_suffix(".txt"))
    # A part is there when its table of frames is.
    files = ((CHECKSUMS, sums, checksums), (TABLES[1], part, stars), (TABLES[0], part, frames))
    for directory, name, file in files:
        _write(filesystem, f"{root}/{directory}/{name}", file)
    return dict(counted)


def _images(
    contents: Iterator[tuple[str, Future[bytes]]], job: _Job
) -> Iterator[tuple[str, bytes | _starpipe.Page | Exception]]:
    """Return the images of the frames, each with its name, or why there is none."""
    for name, content in contents:
        try:
            if job.page is None:
                yield name, content.result()
            elif job.page == "all":
                yield from _starpipe.Pages(content.result(), name)
            else:
                yield name, _starpipe.read_page(content.result(), name, job.page)
        except (*FINAL, ValueError, RuntimeError) as error:
            yield name, error


def _ahead(
    pool: ThreadPoolExecutor, names: list[str], job: _Job
) -> Iterator[tuple[str, Future[bytes]]]:
    """Return the frames in their order, while the next ones are fetched."""
    waiting: deque[tuple[str, Future[bytes]]] = deque()
    for name in names:
        waiting.append((name, pool.submit(_fetch, name, job.options)))
        if len(waiting) > job.read_ahead:
            yield waiting.popleft()
    yield from waiting


def _fetch(name: str, options: dict[str, Any]) -> bytes:
    filesystem, path = _open(name, options)
    content: bytes = _again(lambda: filesystem.cat_file(path))
    return content


def _open(name: str, options: dict[str, Any]) -> tuple[Any, str]:
    """Return the file system of a path or URL, and the path in it."""
    if "://" not in name:
        return fsspec.filesystem("file"), name
    filesystem, path = fsspec.url_to_fs(name, **options)
    return filesystem, path


def _again(work: Callable[[], Any]) -> Any:
    """Do something that may fail for a moment: some times, after longer and longer pauses."""
    for attempt in range(TRIES):
        try:
            return work()
        except FINAL:
            raise
        except Exception as error:
            if attempt + 1 == TRIES:
                if isinstance(error, OSError):
                    raise
                # Stores have exceptions of their own.
                raise OSError(f"{type(error).__name__}: {error}") from error
            time.sleep(0.1 * 2**attempt)
    raise AssertionError("every try returns or raises")


def _write(filesystem: Any, path: str, content: bytes, is_new: bool = False) -> None:
    """Write a file whole or not at all: object stores do so, elsewhere it is renamed.

    A file that is to be new is left as it is where another process was faster.
    """
    if "file" not in filesystem.protocol:
        mode = "create" if is_new else "overwrite"
        with contextlib.suppress(FileExistsError):
            _again(lambda: filesystem.pipe_file(path, content, mode=mode))
        return
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    beside, temporary = tempfile.mkstemp(dir=target.parent, prefix=".starpipe-", suffix=".tmp")
    try:
        with os.fdopen(beside, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(temporary, 0o644)
        if is_new:
            with contextlib.suppress(FileExistsError):
                os.link(temporary, target)
        else:
            os.replace(temporary, target)
    finally:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(temporary)


_pipelines: dict[tuple[str | None, bytes | None], _starpipe.Pipeline] = {}
_lock = threading.Lock()


def _pipeline(job: _Job) -> _starpipe.Pipeline:
    """Return the pipeline of this process: the catalog is read once."""
    key = job.catalog, job.camera
    with _lock:
        if key not in _pipelines:
            with tempfile.TemporaryDirectory() as directory:
                camera = None
                if job.camera is not None:
                    camera = Path(directory) / "camera.toml"
                    camera.write_bytes(job.camera)
                _pipelines[key] = Pipeline(job.catalog, camera)._pipeline
        return _pipelines[key]


class _Progress:
    """Frames so far, on a terminal."""

    def __init__(self, frames: int) -> None:
        self._frames = frames
        self._counted: Counter[str] = Counter()
        self._started = time.monotonic()
        self._shows = sys.stderr.isatty()

    def add(self, counted: dict[str, int]) -> None:
        self._counted.update(counted)
        if self._shows:
            done = sum(self._counted.values())
            rate = done / max(time.monotonic() - self._started, 1e-3)
            told = ", ".join(f"{number} {name}" for name, number in sorted(self._counted.items()))
            print(
                f"\r{done} of {self._frames} frames, {rate:.0f} a second: {told}",
                end="",
                file=sys.stderr,
                flush=True,
            )

    def finish(self) -> None:
        if self._shows and self._counted:
            print(file=sys.stderr)
