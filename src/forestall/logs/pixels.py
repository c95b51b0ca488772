"""Pictures of ROS 2 messages as arrays: raw ones and compressed ones. Called by `mcap_in`.

Encodings as sensor_msgs/image_encodings names them; depth as REP 118 has it: 32FC1 in metres,
16UC1 in millimetres.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from forestall.errors import InputError
from forestall.reading.pictures import FORMATS, MOST_PIXELS
from forestall.types.observation import Depth, Rgb

_COLOUR: Mapping[str, tuple[int, tuple[int, int, int]]] = {
    "rgb8": (3, (0, 1, 2)),
    "bgr8": (3, (2, 1, 0)),
    "rgba8": (4, (0, 1, 2)),
    "bgra8": (4, (2, 1, 0)),
    "8UC3": (3, (2, 1, 0)),
    "mono8": (1, (0, 0, 0)),
}
"""Encoding → channels, and which of them are red, green and blue."""

_ONE: Mapping[str, str] = {
    "mono8": "u1", "8UC1": "u1", "mono16": "u2", "16UC1": "u2", "32SC1": "i4", "32FC1": "f4",
}  # fmt: skip
_MILLIMETRES = 0.001
_DEPTH_HEAD = 12
"""Bytes before the PNG in a "compressedDepth" picture: its format and two numbers."""


def colour_of(message: Any) -> Rgb:
    """(H, W, 3) uint8 of a sensor_msgs Image or CompressedImage.

    Raises:
        InputError: it is no picture in colour, or its bytes do not fit.
    """
    if not hasattr(message, "encoding"):
        return np.asarray(_unpacked(message).convert("RGB"), dtype=np.uint8)
    found = _COLOUR.get(message.encoding)
    if found is None:
        raise InputError(
            f"a picture in {message.encoding!r} is no colour: {', '.join(_COLOUR)} are read"
        )
    channels, order = found
    return np.ascontiguousarray(_raw(message, "u1", channels)[..., list(order)])


def depth_of(message: Any) -> Depth:
    """(H, W) float32 metres of a sensor_msgs Image or CompressedImage; NaN becomes 0.

    Raises:
        InputError: it is no depth, or its bytes do not fit.
    """
    raw = one_channel(message)
    if raw.dtype.kind == "i" or raw.dtype.itemsize == 1:
        raise InputError("depth is 32FC1 in metres or 16UC1 in millimetres")
    if raw.dtype.kind == "f":
        return np.where(np.isfinite(raw) & (raw > 0), raw, 0).astype(np.float32)
    return raw.astype(np.float32) * np.float32(_MILLIMETRES)


def one_channel(message: Any) -> npt.NDArray[Any]:
    """(H, W) numbers of a picture with one of them a pixel.

    Raises:
        InputError: it has several, or its bytes do not fit.
    """
    if not hasattr(message, "encoding"):
        picture = np.asarray(_unpacked(message))
        if picture.ndim != 2:
            raise InputError("one number a pixel is expected, and this picture is in colour")
        return picture.astype(np.uint16) if picture.dtype == np.int32 else picture
    kind = _ONE.get(message.encoding)
    if kind is None:
        raise InputError(f"a picture in {message.encoding!r}: {', '.join(_ONE)} are read")
    return _raw(message, kind, 1)[..., 0]


def _raw(message: Any, kind: str, channels: int) -> npt.NDArray[Any]:
    """(H, W, channels) of a raw picture."""
    height, width, step = message.height, message.width, message.step
    if not height or not width or height * width > MOST_PIXELS:
        raise InputError(f"a picture of {width} x {height} pixels; at most {MOST_PIXELS} are read")
    order = ">" if message.is_bigendian else "<"
    dtype = np.dtype(f"{order}{kind}")
    row = width * channels * dtype.itemsize
    if step < row or len(message.data) != height * step or step % dtype.itemsize:
        raise InputError(
            f"a picture of {width} x {height} in {message.encoding} needs rows of {row} bytes: it "
            f"says {step}, and has {len(message.data)} in all"
        )
    rows = np.frombuffer(message.data, dtype).reshape(height, -1)
    taken = rows[:, : width * channels].reshape(height, width, channels)
    return taken.astype(dtype.newbyteorder("="))


def _unpacked(message: Any) -> Any:
    """The picture in a compressed message."""
    from PIL import Image

    said = message.format.lower()
    data = bytes(message.data)
    if "compresseddepth" in said.replace(" ", ""):
        if "rvl" in said:
            raise InputError("depth packed as RVL is not read: record it as png")
        data = data[_DEPTH_HEAD:]
    try:
        image = Image.open(io.BytesIO(data), formats=FORMATS)
        if image.width * image.height > MOST_PIXELS:
            raise InputError(f"a picture of {image.width} x {image.height} pixels is too large")
        image.load()
    except InputError:
        raise
    except Exception as error:  # decoders of Pillow raise anything over damaged bytes
        raise InputError(f"a packed picture ({message.format!r}) that cannot be read") from error
    return image
