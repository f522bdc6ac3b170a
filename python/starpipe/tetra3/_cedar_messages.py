"""Messages of cedar-detect's gRPC service, described where they are needed.

Two versions are in use. Real numbers are `float` in that of cedar-solve on PyPI, and `double` in
later ones, which also have more fields. Fields have the same numbers in both.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message, message_factory

PACKAGE = "cedar_detect"

REAL = "real"
"""The type that differs between the versions."""

REPEATED = "star_candidates"
"""The only field that is repeated."""

MESSAGES = {
    "CentroidsRequest": {
        "input_image": (1, "Image"),
        "sigma": (2, REAL),
        "max_size": (3, "int32"),
        "return_binned": (4, "bool"),
        "use_binned_for_star_candidates": (5, "bool"),
        "detect_hot_pixels": (6, "bool"),
        "estimate_background_region": (7, "Rectangle"),
        "binning": (8, "int32"),
        "normalize_rows": (9, "bool"),
    },
    "CentroidsResult": {
        "noise_estimate": (1, REAL),
        "hot_pixel_count": (2, "int32"),
        "star_candidates": (3, "StarCentroid"),
        "binned_image": (4, "Image"),
        "algorithm_time": (5, "Duration"),
        "peak_star_pixel": (6, "int32"),
        "background_estimate": (7, REAL),
    },
    # A name in shared memory is text, but need not be UTF-8.
    "Image": {
        "width": (1, "int32"),
        "height": (2, "int32"),
        "image_data": (3, "bytes"),
        "shmem_name": (4, "bytes"),
        "reopen_shmem": (5, "bool"),
    },
    "StarCentroid": {
        "centroid_position": (1, "ImageCoord"),
        "brightness": (4, REAL),
        "num_saturated": (6, "int32"),
    },
    "ImageCoord": {"x": (1, REAL), "y": (2, REAL)},
    "Rectangle": {
        "origin_x": (1, "int32"),
        "origin_y": (2, "int32"),
        "width": (3, "int32"),
        "height": (4, "int32"),
    },
    # The bytes are those of google.protobuf.Duration.
    "Duration": {"seconds": (1, "int64"), "nanos": (2, "int32")},
}
"""Number and type of each field of each message."""


def read_request(content: bytes) -> tuple[Any, Any]:
    """Return a request, and the class of the result that its sender understands.

    The version is that in which `sigma` can be read. Without `sigma` it is that of PyPI.

    Raises
    ------
    ValueError
        If the content is no request.
    """
    for real in ("double", "float"):
        kinds = message_classes(real)
        try:
            request = kinds["CentroidsRequest"].FromString(content)
        except message.DecodeError as error:
            raise ValueError("the message is not a CentroidsRequest") from error
        if request.HasField("sigma"):
            break
    return request, kinds["CentroidsResult"]


@cache
def message_classes(real: str) -> dict[str, Any]:
    """Return the classes of the messages, with real numbers as `float` or `double`."""
    # Fields of proto2 know whether they are present; their bytes are the same.
    file = descriptor_pb2.FileDescriptorProto(
        name=f"{PACKAGE}.proto", package=PACKAGE, syntax="proto2"
    )
    for name, fields in MESSAGES.items():
        described = file.message_type.add(name=name)
        for field, (number, kind) in fields.items():
            _describe(
                described.field.add(name=field, number=number), real if kind == REAL else kind
            )
    # Not in the pool of all messages, where a program may have those of cedar-solve.
    pool = descriptor_pool.DescriptorPool()
    pool.AddSerializedFile(file.SerializeToString())
    return {
        name: message_factory.GetMessageClass(pool.FindMessageTypeByName(f"{PACKAGE}.{name}"))
        for name in MESSAGES
    }


def _describe(field: Any, kind: str) -> None:
    """Set the type of a field: the name of a message, or a type of protobuf."""
    field.label = field.LABEL_REPEATED if field.name == REPEATED else field.LABEL_OPTIONAL
    if kind in MESSAGES:
        field.type, field.type_name = field.TYPE_MESSAGE, f".{PACKAGE}.{kind}"
    else:
        field.type = getattr(field, f"TYPE_{kind.upper()}")
