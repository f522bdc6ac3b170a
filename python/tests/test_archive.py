"""Archives: the tables are the program's, whatever the workers do and whatever happens to them."""

import os
import shutil
import signal
import subprocess
import threading
import warnings

import numpy as np
import pytest

import starpipe as sp

pytest.importorskip("distributed")
duckdb = pytest.importorskip("duckdb")
pandas = pytest.importorskip("pandas")
polars = pytest.importorskip("polars")

import starpipe.dask  # noqa: E402

FRAMES = 30
PER_PART = 4


@pytest.fixture(scope="module")
def night(frame, tmp_path_factory):
    """Return a directory of frames, of which one is broken."""
    directory = tmp_path_factory.mktemp("archive")
    for number in range(FRAMES - 1):
        shutil.copy(frame, directory / f"2020-03-01T20{number:02}00.tif")
    (directory / "broken.tif").write_text("no image")
    return directory


@pytest.fixture(scope="module")
def alone(night, tmp_path_factory):
    """Return the tables that one process writes."""
    out = tmp_path_factory.mktemp("alone") / "out"
    sp.dask.process(str(night / "*.tif"), str(out), frames_per_part=PER_PART)
    return out


def tables(directory):
    """Return all files, by name."""
    found = [path for path in directory.rglob("*") if path.is_file()]
    return {str(path.relative_to(directory)): path.read_bytes() for path in found}


def cluster(workers):
    from distributed import LocalCluster

    return LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None)


def test_the_tables_are_the_programs(night, alone, program, tmp_path):
    command = [program, "process", night / "*.tif", "--out-parquet", tmp_path / "out"]
    for worker in (1, 2):
        shard = ["--shard", f"{worker}/2", "--frames-per-part", str(PER_PART)]
        subprocess.run([*command, *shard], capture_output=True)
    assert tables(tmp_path / "out") == tables(alone)


def test_any_reader_has_them_in_one_line(alone):
    frames = alone / "frames.parquet"
    assert len(pandas.read_parquet(frames)) == FRAMES
    assert len(polars.read_parquet(frames / "*.parquet")) == FRAMES
    query = f"select status, count(*) from '{frames}/*.parquet' group by 1 order by 1"
    assert duckdb.sql(query).fetchall() == [("identified", FRAMES - 1), ("unread", 1)]
    archive = sp.dask.Archive(str(alone))
    stars = archive.stars().compute()
    assert (stars["frame"].nunique(), stars["id"].ne("").sum() > 4000) == (FRAMES - 1, True)


def test_units_and_descriptions_of_merged_tables_are_astropys(alone, program, tmp_path):
    from astropy.io.votable.ucd import parse_ucd
    from astropy.table import Table

    command = [program, "archive", "merge", alone, "--out", tmp_path]
    subprocess.run(command, check=True, capture_output=True)
    for name in ("frames", "stars"):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            table = Table.read(tmp_path / f"{name}.parquet", format="parquet.votable")
        for column in table.colnames:
            info = table[column].info
            assert info.description
            if "ucd" in info.meta:
                parse_ucd(info.meta["ucd"], check_controlled_vocabulary=True)
    assert str(table["ra_deg"].unit) == "deg"
    assert table["ra_deg"].info.meta["ucd"] == "pos.eq.ra;meta.main"
    assert list(table["frame"]) == sorted(table["frame"])


def test_a_cluster_writes_the_same_and_a_rerun_does_nothing(night, alone, tmp_path):
    from distributed import Client

    with cluster(2) as workers, Client(workers) as client:
        arguments = (str(night / "*.tif"), str(tmp_path / "out"))
        archive = sp.dask.process(*arguments, frames_per_part=PER_PART, client=client)
        before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.parquet")}
        sp.dask.process(*arguments, frames_per_part=PER_PART, client=client)
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.parquet")} == before
    assert tables(tmp_path / "out") == tables(alone)
    broken, dated = archive.summary()
    assert (broken["unread"], dated["night"], dated["identified"]) == (1, "2020-03-01", FRAMES - 1)


def test_an_output_of_another_run_is_refused(night, alone, tmp_path):
    for change, message in [
        ({"fov": 11.0}, "fov_deg was null, now 11.0"),
        ({"frames_per_part": 5}, "frames_per_part was 4, now 5"),
    ]:
        arguments = {"frames_per_part": PER_PART} | change
        with pytest.raises(ValueError, match=message):
            sp.dask.process(str(night / "*.tif"), str(alone), **arguments)
    with pytest.raises(ValueError, match="there are no frames"):
        sp.dask.process(str(tmp_path / "*.tif"), str(tmp_path / "out"))
    (tmp_path / "stars.parquet").mkdir()
    with pytest.raises(ValueError, match=r"but no archive\.json"):
        sp.dask.process([str(night / "broken.tif")], str(tmp_path))
    with pytest.raises(OSError):
        sp.dask.process([str(night / "broken.tif")], str(night / "broken.tif" / "out"))


def test_killed_workers_lose_nothing(night, alone, tmp_path):
    from distributed import Client

    with cluster(2) as workers, Client(workers) as client:
        stopped = threading.Event()

        def kill():
            for _ in range(3):
                if stopped.wait(0.7):
                    return
                process = next(iter(workers.workers.values())).process
                if process is not None and process.pid is not None:
                    os.kill(process.pid, signal.SIGKILL)

        # The frames are few: they are read slowly, so that workers are killed at work.
        frames = [f"slow://{path}" for path in sorted(night.glob("*.tif"))]
        client.register_plugin(_slow_files_plugin())
        _slow_files()
        killer = threading.Thread(target=kill)
        killer.start()
        try:
            out = str(tmp_path / "out")
            archive = sp.dask.process(frames, out, frames_per_part=PER_PART, client=client)
        finally:
            stopped.set()
            killer.join()
    frames = archive.frames().compute()
    assert list(frames["status"]).count("identified") == FRAMES - 1
    assert frames["frame"].is_unique and len(frames) == FRAMES
    expected = pandas.read_parquet(alone / "stars.parquet")
    found = pandas.read_parquet(tmp_path / "out" / "stars.parquet")
    assert np.array_equal(found["x"], expected["x"])


def _slow_files():
    """Register files that are read slowly, as ``slow://``."""
    import time

    import fsspec
    from fsspec.implementations.local import LocalFileSystem

    class Slow(LocalFileSystem):
        protocol = "slow"

        def cat_file(self, path, **options):
            time.sleep(0.15)
            return super().cat_file(path.removeprefix("slow://"), **options)

        @classmethod
        def _strip_protocol(cls, path):
            return path.removeprefix("slow://")

    fsspec.register_implementation("slow", Slow, clobber=True)


def _slow_files_plugin():
    """Return a plugin that registers slow files in each worker that starts."""
    from distributed import WorkerPlugin

    class SlowFiles(WorkerPlugin):
        name = "slow files"

        def setup(self, worker):
            _slow_files()

    return SlowFiles()


class Faults:
    """A store that fails: some requests with 503, some objects break off."""

    def __init__(self, store):
        self.store = store
        self.requests = 0
        self.lock = threading.Lock()

    def __call__(self, environ, start_response):
        with self.lock:
            self.requests += 1
            number = self.requests
        if number % 20 == 0:
            start_response("503 Slow Down", [("Content-Length", "0")])
            return [b""]
        response = self.store(environ, start_response)
        is_object = environ["REQUEST_METHOD"] == "GET" and environ["PATH_INFO"].endswith(".tif")
        if number % 23 == 0 and is_object:
            content = b"".join(response)
            return [content[: len(content) // 2]]
        return response


@pytest.fixture(scope="module")
def store():
    """Return options of an object store that fails now and then, and its count of requests."""
    pytest.importorskip("moto")
    pytest.importorskip("s3fs")
    from moto.server import DomainDispatcherApplication, create_backend_app
    from werkzeug.serving import make_server

    faults = Faults(DomainDispatcherApplication(create_backend_app))
    server = make_server("127.0.0.1", 0, faults, threaded=True)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    options = {
        "key": "test",
        "secret": "test",
        "client_kwargs": {"endpoint_url": f"http://127.0.0.1:{server.server_port}"},
    }
    yield options, faults
    server.shutdown()
    thread.join()


def test_frames_and_tables_in_an_object_store_that_fails(night, store):
    import s3fs
    from distributed import Client

    options, faults = store
    filesystem = s3fs.S3FileSystem(**options)
    filesystem.mkdir("archive")
    for path in night.glob("*.tif"):
        filesystem.pipe_file(f"archive/night/{path.name}", path.read_bytes())
    before = faults.requests
    with cluster(2) as workers, Client(workers) as client:
        archive = sp.dask.process(
            "s3://archive/night/*.tif",
            "s3://archive/results",
            frames_per_part=PER_PART,
            client=client,
            storage_options=options,
        )
        frames = archive.frames().compute()
    assert faults.requests > before + 60
    broken, dated = archive.summary()
    assert sorted(frames["frame"]) == sorted(
        f"s3://archive/night/{path.name}" for path in night.glob("*.tif")
    )
    assert (broken["frames"], dated["identified"]) == (1, FRAMES - 1)


def test_what_a_store_refuses_is_told(night, store, tmp_path, monkeypatch):
    options, _ = store
    frames = str(night / "*.tif")
    with pytest.raises(FileNotFoundError, match="there is no s3://none"):
        sp.dask.process("s3://none/*.tif", str(tmp_path / "out"), storage_options=options)
    with pytest.raises(FileNotFoundError, match="bucket does not exist"):
        sp.dask.process(frames, "s3://none/results", storage_options=options)
    closed = {"endpoint_url": "http://127.0.0.1:1"}
    with pytest.raises(OSError, match=r"http://127\.0\.0\.1:1"):
        sp.dask.process(
            frames, "s3://archive/other", storage_options=options | {"client_kwargs": closed}
        )
    for name in [name for name in os.environ if name.startswith("AWS_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("AWS_EC2_METADATA_DISABLED", "true")
    monkeypatch.setenv("HOME", str(tmp_path))
    nobody = {"client_kwargs": options["client_kwargs"]}
    with pytest.raises(OSError, match=r"[Cc]redentials"):
        sp.dask.process("s3://archive/*.tif", str(tmp_path / "out"), storage_options=nobody)


def test_an_output_is_of_who_came_first(store, tmp_path):
    from starpipe.dask import _open, _write

    options, _ = store
    _open("s3://first", options)[0].mkdir("first")
    for out, used in [("s3://first", options), (str(tmp_path), {})]:
        filesystem, root = _open(out, used)
        for content in (b"first", b"second"):
            _write(filesystem, f"{root}/archive.json", content, is_new=True)
        assert filesystem.cat_file(f"{root}/archive.json") == b"first"
    assert [path.name for path in tmp_path.iterdir()] == ["archive.json"]


def test_two_runs_at_once_into_one_output_do_no_harm(night, alone, tmp_path):
    out = str(tmp_path / "out")

    def run():
        sp.dask.process(str(night / "*.tif"), out, frames_per_part=PER_PART)

    runs = [threading.Thread(target=run) for _ in range(2)]
    for each in runs:
        each.start()
    for each in runs:
        each.join()
    assert tables(tmp_path / "out") == tables(alone)


def test_a_full_disk_is_told_and_the_run_goes_on_later(night, alone, tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=100k", "none", disk]
    if not shutil.which("mount") or subprocess.run(mount, capture_output=True).returncode != 0:
        pytest.skip("no file system can be mounted here")
    arguments = (str(night / "*.tif"), str(disk / "out"))
    try:
        with pytest.raises(OSError, match="No space left"):
            sp.dask.process(*arguments, frames_per_part=PER_PART)
        subprocess.run(["mount", "-o", "remount,size=10m", disk], check=True)
        sp.dask.process(*arguments, frames_per_part=PER_PART)
        assert tables(disk / "out") == tables(alone)
    finally:
        subprocess.run(["umount", disk], check=True)


def test_all_images_of_a_mosaic_are_frames(program, tmp_path):
    from astropy.io import fits

    pixels = np.random.default_rng(1).poisson(100, (2, 60, 80)).astype(np.uint16)
    images = [fits.ImageHDU(plane) for plane in pixels]
    for image in images:
        image.header["DATE-OBS"] = "2020-03-01T20:00:00"
    fits.HDUList([fits.PrimaryHDU(), *images]).writeto(tmp_path / "mosaic.fits")
    whole = (tmp_path / "mosaic.fits").read_bytes()
    (tmp_path / "part.fits").write_bytes(whole[:-20000])
    for page, frames in [("all", 3), (2, 2)]:
        out, ours = tmp_path / f"program-{page}", tmp_path / f"dask-{page}"
        command = [program, "process", tmp_path / "*.fits", "--out-parquet", out]
        subprocess.run([*command, "--page", str(page)], capture_output=True)
        sp.dask.process(str(tmp_path / "*.fits"), str(ours), page=page)
        assert tables(ours) == tables(out)
        assert len(pandas.read_parquet(ours / "frames.parquet")) == frames
