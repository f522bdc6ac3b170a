"""cedar-detect's gRPC service."""

from __future__ import annotations

import signal
import threading
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import grpc

from ._cedar_centroids import MAX_PIXELS, answer

SERVICE = "cedar_detect.CedarDetect"

WORKERS = 2
"""Number of requests that are answered at the same time."""

WAITING = 4
"""Number of further requests that may wait."""

GRACE_S = 5.0
"""How long requests may take when the server ends."""

OPTIONS = (
    # The image, and the other fields.
    ("grpc.max_receive_message_length", MAX_PIXELS + 4096),
    # A port belongs to one server.
    ("grpc.so_reuseport", 0),
)

LOCAL = ("ipv4:127.", "ipv6:[::1]", "ipv6:%5B::1%5D", "unix:")
"""Beginnings of the addresses of clients on the same machine."""


def start(listen: str, port: int) -> tuple[Any, str]:
    """Start a server, and return it and the address where it listens; port 0 is any free one.

    Raises
    ------
    OSError
        If it cannot listen there.
    """
    server = grpc.server(
        ThreadPoolExecutor(WORKERS), options=OPTIONS, maximum_concurrent_rpcs=WORKERS + WAITING
    )
    methods = {"ExtractCentroids": grpc.unary_unary_rpc_method_handler(_extract_centroids)}
    server.add_generic_rpc_handlers((grpc.method_handlers_generic_handler(SERVICE, methods),))
    host = f"[{listen}]" if ":" in listen else listen
    try:
        bound = server.add_insecure_port(f"{host}:{port}")
    except RuntimeError:
        bound = 0
    if not bound:
        raise OSError(f"cannot listen on {host}:{port}")
    server.start()
    return server, f"{host}:{bound}"


def serve(listen: str, port: int) -> None:
    """Answer requests until a signal ends the server."""
    ended = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ended.set())
    server, address = start(listen, port)
    print(f"listening on {address}", flush=True)
    # Where signals do not interrupt waiting, they are noticed in between.
    while not ended.wait(1.0):
        pass
    server.stop(GRACE_S).wait()


def _extract_centroids(content: bytes, context: Any) -> Any:
    try:
        return answer(content, context.peer().startswith(LOCAL))
    except ValueError as error:
        refusal = grpc.StatusCode.INVALID_ARGUMENT, str(error)
    except OSError as error:
        # With this code, clients send their images in the message from then on.
        refusal = grpc.StatusCode.INTERNAL, f"cannot read the shared memory: {error}"
    return context.abort(*refusal)
