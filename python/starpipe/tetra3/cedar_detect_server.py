"""The server of cedar-detect, answered by starpipe.

``python -m starpipe.tetra3.cedar_detect_server`` offers the gRPC service that the client of
cedar-solve and other programs ask for centroids. It needs grpcio and protobuf.
"""

from __future__ import annotations

import argparse
import sys


def main() -> None:
    """Run the server with the arguments of the command line."""
    parser = argparse.ArgumentParser(
        prog="cedar_detect_server", description="The gRPC service of cedar-detect, by starpipe."
    )
    parser.add_argument(
        "-p", "--port", type=_port, default=50051, help="port to listen on (%(default)s)"
    )
    parser.add_argument(
        "--listen",
        default="127.0.0.1",
        metavar="ADDRESS",
        help="address to listen on (%(default)s); 0.0.0.0 lets other machines ask",
    )
    asked = parser.parse_args()
    try:
        from ._cedar_service import serve
    except ImportError as error:
        packages = "needs grpcio and protobuf; install them with: pip install grpcio protobuf"
        sys.exit(f"cedar_detect_server {packages} ({error})")
    try:
        serve(asked.listen, asked.port)
    except OSError as error:
        sys.exit(f"cedar_detect_server: {error}")


def _port(text: str) -> int:
    if not (text.isdecimal() and len(text) <= 5 and int(text) < 1 << 16):
        raise argparse.ArgumentTypeError(f"a port is a number from 0 to 65535, not {text!r}")
    return int(text)


if __name__ == "__main__":
    main()
