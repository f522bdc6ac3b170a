"""The gRPC service of cedar-detect: centroids for its clients, on frames that are drawn here."""

import contextlib
import importlib
import signal
import socket
import subprocess
import sys
from multiprocessing import shared_memory

import numpy as np
import pytest

import starpipe as sp

grpc = pytest.importorskip("grpc", reason="grpcio is not installed")
pytest.importorskip("google.protobuf", reason="protobuf is not installed")
from starpipe.tetra3._cedar_centroids import MAX_PIXELS, answer  # noqa: E402
from starpipe.tetra3._cedar_messages import message_classes  # noqa: E402

SERVER = [sys.executable, "-m", "starpipe.tetra3.cedar_detect_server"]
SHAPE = (480, 640)
SPOT_PX = 1.3
BACKGROUND, NOISE = 20.0, 2.0
HOT = ((100, 300), (33, 44))
TIMEOUT_S = 60.0


@pytest.fixture(scope="module")
def drawn():
    """Return a frame with stars and hot pixels, and the stars: rows of (y, x), brightest first."""
    rng = np.random.default_rng(7)
    stars = rng.uniform(12.0, np.array(SHAPE) - 12.0, (40, 2))
    rows, columns = np.indices(SHAPE)
    light = np.full(SHAPE, BACKGROUND)
    for (y, x), flux in zip(stars, np.geomspace(20_000.0, 600.0, len(stars)), strict=True):
        distance = np.hypot(rows - y, columns - x) / SPOT_PX
        light += flux / (2.0 * np.pi * SPOT_PX**2) * np.exp(-(distance**2) / 2.0)
    light += rng.normal(0.0, NOISE, SHAPE)
    for place in HOT:
        light[place] = 240.0
    # The first pixel's center is at (0.5, 0.5).
    return light.round().clip(0, 255).astype(np.uint8), stars + 0.5


@contextlib.contextmanager
def serving(*arguments):
    """Run the server, and return its process and its address."""
    with subprocess.Popen([*SERVER, *arguments], stdout=subprocess.PIPE, text=True) as process:
        try:
            line = process.stdout.readline()
            assert line.startswith("listening on ")
            yield process, line.split()[-1]
        finally:
            process.kill()


@pytest.fixture(scope="module")
def channel():
    with serving("--port", "0") as (_, address), grpc.insecure_channel(address) as channel:
        assert address.startswith("127.0.0.1:")
        yield channel


def ask(channel, image, real="double", method="ExtractCentroids", **fields):
    """Send a request for an image, which is an array or the fields of a message."""
    kinds = message_classes(real)
    if isinstance(image, np.ndarray):
        height, width = image.shape
        image = {"width": width, "height": height, "image_data": image.tobytes()}
    request = kinds["CentroidsRequest"](**{"input_image": image, "sigma": 5.0, **fields})
    call = channel.unary_unary(
        f"/cedar_detect.CedarDetect/{method}",
        request_serializer=type(request).SerializeToString,
        response_deserializer=kinds["CentroidsResult"].FromString,
    )
    return call(request, timeout=TIMEOUT_S)


def refused(channel, image, **fields):
    """Return the code and the text with which a request is refused."""
    with pytest.raises(grpc.RpcError) as caught:
        ask(channel, image, **fields)
    return caught.value.code(), caught.value.details()


def centroids(result):
    places = [star.centroid_position for star in result.star_candidates]
    return np.array([[place.y, place.x] for place in places])


def expected(found, with_hot=False):
    """Return the centroids (y, x) among detections, with (0.5, 0.5) in the first pixel."""
    is_hot = found.columns["flags"] == "hot_pixel"
    return np.stack([found.y, found.x], axis=-1)[~is_hot | with_hot] + 0.5


@pytest.mark.parametrize("real", ["double", "float"])
def test_stars_are_those_of_detect(channel, drawn, real):
    pixels, stars = drawn
    result = ask(channel, pixels, real, detect_hot_pixels=True)
    found = sp.detect(pixels, sigma=5.0)
    places = centroids(result)
    np.testing.assert_allclose(places, expected(found), rtol=1e-6)
    distance = np.hypot(*(stars[:, None] - places).transpose(2, 0, 1)).min(axis=1)
    assert distance.max() < 0.05
    assert result.hot_pixel_count == len(HOT)
    brightness = [star.brightness for star in result.star_candidates]
    assert brightness == sorted(brightness, reverse=True)
    assert brightness[0] == pytest.approx(found.flux[0], rel=1e-6)
    y, x = places[0].astype(int)
    around = pixels[y - 6 : y + 7, x - 6 : x + 7]
    assert result.star_candidates[0].num_saturated == (around == 255).sum() > 0
    assert result.star_candidates[-1].num_saturated == 0
    assert result.peak_star_pixel == 255
    assert result.noise_estimate == pytest.approx(NOISE, rel=0.1)
    assert result.background_estimate == pytest.approx(BACKGROUND, abs=0.2)
    assert not result.HasField("binned_image")
    assert 0 < result.algorithm_time.seconds + result.algorithm_time.nanos / 1e9 < TIMEOUT_S


def test_options_are_honored(channel, drawn):
    pixels, _ = drawn
    with_hot = ask(channel, pixels)
    assert with_hot.hot_pixel_count == 0
    np.testing.assert_allclose(centroids(with_hot), expected(sp.detect(pixels, sigma=5.0), True))
    few = ask(channel, pixels, sigma=100.0, detect_hot_pixels=True)
    np.testing.assert_allclose(centroids(few), expected(sp.detect(pixels, sigma=100.0)))
    assert 0 < len(few.star_candidates) < len(with_hot.star_candidates) - len(HOT)
    brighter = pixels.copy()
    brighter[:50, :60] += 7
    region = {"origin_x": 10, "origin_y": 5, "width": 40, "height": 30}
    result = ask(channel, brighter, estimate_background_region=region)
    assert result.background_estimate == pytest.approx(BACKGROUND + 7.0, abs=0.3)
    # No pixel is near the mean of these two.
    brighter[:1, :2] = 10, 200
    two = {"width": 2, "height": 1}
    assert ask(channel, brighter, estimate_background_region=two).background_estimate == 10.0
    dark = ask(channel, np.zeros(SHAPE, np.uint8))
    assert dark.HasField("background_estimate") and dark.background_estimate == 0.0
    assert len(dark.star_candidates) == 0 and dark.peak_star_pixel == 255


@pytest.mark.parametrize("step", [None, 2, 4])
def test_binned_images_have_no_hot_pixels(channel, drawn, step):
    pixels = drawn[0][:478, :637]
    binning = {} if step is None else {"binning": step}
    image = ask(channel, pixels, return_binned=True, detect_hot_pixels=True, **binning).binned_image
    step = step or 2
    binned = np.frombuffer(image.image_data, np.uint8).reshape(image.height, image.width)
    height, width = 478 // step, 637 // step
    squares = pixels[: height * step, : width * step].reshape(height, step, width, step)
    means = squares.mean(axis=(1, 3)).astype(np.uint8)
    differs = np.argwhere(binned != means)
    assert sorted(map(tuple, differs)) == sorted((y // step, x // step) for y, x in HOT)
    assert max(binned[tuple(place)] for place in differs) < BACKGROUND + 4.0 * NOISE


def test_images_in_shared_memory_are_read_and_left(drawn):
    pixels, _ = drawn
    height, width = pixels.shape
    memory = shared_memory.SharedMemory(create=True, size=pixels.size)
    try:
        image = {"width": width, "height": height, "shmem_name": memory.name.encode()}
        with serving("-p", "0") as (process, address), grpc.insecure_channel(address) as channel:
            for shown in (pixels, pixels[::-1]):
                np.ndarray(shown.shape, np.uint8, memory.buf)[:] = shown
                result = ask(channel, {**image, "reopen_shmem": True}, detect_hot_pixels=True)
                np.testing.assert_allclose(centroids(result), expected(sp.detect(shown, sigma=5.0)))
            # An object may be rounded up to whole pages.
            larger = {**image, "height": height + 100}
            code, text = refused(channel, larger)
            assert code == grpc.StatusCode.INVALID_ARGUMENT and "need 371200 bytes" in text
            code, text = refused(channel, {**image, "shmem_name": b"none-of-this-name"})
            assert code == grpc.StatusCode.INTERNAL and "shared memory" in text
            with pytest.raises(FileNotFoundError):
                shared_memory.SharedMemory("none-of-this-name")
            for name in (b"a\0b", b"\xff\xfe"):
                code, _ = refused(channel, {**image, "shmem_name": name})
                assert code == grpc.StatusCode.INVALID_ARGUMENT
            assert refused(channel, {**image, "shmem_name": b".."})[0] == grpc.StatusCode.INTERNAL
            process.send_signal(signal.SIGTERM)
            assert process.wait(TIMEOUT_S) == 0
        assert bytes(memory.buf[: pixels.size]) == pixels[::-1].tobytes()
        shared_memory.SharedMemory(memory.name).close()
        request = message_classes("double")["CentroidsRequest"](input_image=image)
        with pytest.raises(OSError, match="same machine"):
            answer(request.SerializeToString(), may_share=False)
    finally:
        memory.close()
        memory.unlink()


def test_wrong_requests_are_refused(channel, drawn):
    pixels, _ = drawn
    image = {"width": 4, "height": 5, "image_data": bytes(20)}
    side = int(MAX_PIXELS**0.5) + 1
    for wrong, fields, text in (
        ({**image, "width": 5}, {}, "need 25 bytes, found 20"),
        ({**image, "width": -4, "height": -5}, {}, "must have pixels"),
        ({**image, "width": 0}, {}, "must have pixels"),
        ({**image, "width": side, "height": side}, {}, "too large"),
        ({"width": 2, "height": 2, "image_data": bytes(4)}, {}, "too small"),
        (None, {}, "input_image is missing"),
        (pixels, {"binning": 3}, "binning must be 2 or 4"),
        (pixels, {"sigma": -1.0}, "sigma must be more than 0"),
        (pixels, {"sigma": float("nan")}, "sigma must be a finite number"),
        (pixels, {"estimate_background_region": {"width": 641, "height": 1}}, "outside the image"),
        (pixels, {"estimate_background_region": {"origin_x": -1}}, "outside the image"),
        (pixels, {"estimate_background_region": {}}, "has no pixels"),
    ):
        code, details = refused(channel, wrong, **fields)
        assert code == grpc.StatusCode.INVALID_ARGUMENT
        assert text in details
    raw = channel.unary_unary("/cedar_detect.CedarDetect/ExtractCentroids")
    with pytest.raises(grpc.RpcError) as caught:
        raw(b"\xff\xff", timeout=TIMEOUT_S)
    assert caught.value.code() == grpc.StatusCode.INVALID_ARGUMENT
    code, _ = refused(channel, pixels, method="Identify")
    assert code == grpc.StatusCode.UNIMPLEMENTED
    assert len(ask(channel, pixels).star_candidates) > 0


def test_a_server_that_cannot_start_says_why():
    def output(*command):
        done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S)
        assert done.returncode != 0 and "Traceback" not in done.stderr
        return done.stderr

    with serving("--port", "0") as (process, address):
        assert "cannot listen on" in output(*SERVER, "--port", address.split(":")[-1])
        process.send_signal(signal.SIGINT)
        assert process.wait(TIMEOUT_S) == 0
    for port in ("65536", "-1", "any"):
        assert "from 0 to 65535" in output(*SERVER, f"--port={port}")
    code = "import sys; sys.modules['grpc'] = None; sys.argv[1:] = []; "
    code += "from starpipe.tetra3.cedar_detect_server import main; main()"
    assert "pip install grpcio protobuf" in output(sys.executable, "-c", code)


def test_the_client_of_cedar_solve_gets_the_centroids(drawn, tmp_path, monkeypatch):
    pytest.importorskip("tetra3", reason="cedar-solve is not installed")
    # cedar-solve 0.5.1 imports this module as if it were installed alone.
    messages = importlib.import_module("tetra3.cedar_detect_pb2")
    monkeypatch.setitem(sys.modules, "cedar_detect_pb2", messages)
    client_module = importlib.import_module("tetra3.cedar_detect_client")
    program = tmp_path / "cedar-detect-server"
    program.write_text(f'#!/bin/sh\nexec {" ".join(SERVER)} "$@"\n')
    program.chmod(0o755)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    client = client_module.CedarDetectClient(program, port)
    try:
        channel = grpc.insecure_channel(f"localhost:{port}")
        grpc.channel_ready_future(channel).result(TIMEOUT_S)
        small = drawn[0][:300, :400].copy()
        # The second image is larger, and needs new shared memory.
        for pixels in (small, drawn[0]):
            found = client.extract_centroids(pixels, sigma=8, max_size=10, use_binned=False)
            wanted = expected(sp.detect(pixels, sigma=8.0))
            np.testing.assert_allclose(found, wanted, rtol=1e-6)
            assert client._use_shmem and client._shmem is not None
        client._del_shmem()
        client._use_shmem = False
        found = client.extract_centroids(drawn[0], sigma=8, max_size=10, use_binned=False)
        wanted = expected(sp.detect(drawn[0], sigma=8.0), with_hot=True)
        np.testing.assert_allclose(found, wanted, rtol=1e-6)
    finally:
        channel.close()
        client._subprocess.kill()
        client._subprocess.wait()
        client._del_shmem()
