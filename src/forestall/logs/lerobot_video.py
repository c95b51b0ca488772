"""Frames of a LeRobot video at wanted times, one after the other; depth of a depth video.

Called by `lerobot_in`; calls PyAV (BSD-3-Clause; its wheels bring an FFmpeg with parts under the
GPL). Depth in videos has 12 bit, as huggingface/lerobot, src/lerobot/datasets/depth_utils.py
packs it: what is read back is up to half a step off.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from forestall.errors import FileFormatError
from forestall.logs.needed import needed
from forestall.reading.files import decoding
from forestall.reading.pictures import MOST_PIXELS
from forestall.types.observation import Depth

_LARGEST_CODE = 4095
_DEFAULTS = {"depth_min": 0.01, "depth_max": 10.0, "shift": 3.5, "use_log": True}
"""Of that package, src/lerobot/configs/video.py, for sets that do not say it."""


def frames_at(
    file: Path, times_s: Iterable[float], tolerance_s: float, depth: bool
) -> Iterator[Any]:
    """The frame at each time, which must not run backwards.

    Args:
        file: of the video.
        times_s: from its beginning.
        tolerance_s: how far a frame may be off.
        depth: (H, W) uint16 codes instead of (H, W, 3) uint8.

    Raises:
        FileFormatError: no video, one of pictures too large, cut off, or no frame at a time.
    """
    needed("av")
    import av

    if not file.is_file():
        raise FileFormatError(f"{file} is missing: the data set names it")
    with decoding(file, "a video"), av.open(str(file), format=_format(file)) as container:
        if not container.streams.video:
            raise FileFormatError(f"{file} has no video in it")
        stream = container.streams.video[0]
        width, height = stream.codec_context.width, stream.codec_context.height
        if width * height > MOST_PIXELS:
            raise FileFormatError(f"{file} has pictures of {width} x {height} pixels")
        frames = _decoded(container, stream)
        frame = next(frames, None)
        following = next(frames, None)
        started = False
        for time_s in times_s:
            if not started and time_s > 2 and stream.time_base is not None:
                container.seek(int((time_s - 1) / stream.time_base), stream=stream)
                frames = _decoded(container, stream)
                frame, following = next(frames, None), next(frames, None)
            started = True
            while following is not None and _time(following) <= time_s + tolerance_s:
                frame, following = following, next(frames, None)
            if frame is None or abs(_time(frame) - time_s) > tolerance_s:
                raise FileFormatError(
                    f"{file} has no frame at {time_s:.3f} s: it ends before, or lacks some"
                )
            yield frame.to_ndarray(format="gray12le" if depth else "rgb24")


def _format(file: Path) -> str:
    """MP4 or Matroska by its first bytes: of other formats some name further files to open."""
    with file.open("rb") as opened:
        head = opened.read(8)
    if head[4:] == b"ftyp":
        return "mp4"
    if head[:4] == b"\x1a\x45\xdf\xa3":
        return "matroska"
    raise FileFormatError(f"{file} is no video in MP4 or Matroska")


def depth_m(codes: Any, about: Mapping[str, Any], where: str) -> Depth:
    """(H, W) float32 metres of 12-bit codes; 0 where the nearest code is, which no thing has.

    Raises:
        FileFormatError: limits that cannot be.
    """
    said = {n: about.get(f"video.{n}", about.get(n, d)) for n, d in _DEFAULTS.items()}
    try:
        low, high, shift = (float(said[n]) for n in ("depth_min", "depth_max", "shift"))
    except (TypeError, ValueError) as error:
        raise FileFormatError(f"{where}: the limits of depth are {said}") from error
    if not 0 <= low < high < math.inf or not 0 < low + shift < math.inf:
        raise FileFormatError(f"{where}: the limits of depth are {said}")
    share = np.asarray(codes, np.float64) / _LARGEST_CODE
    if said["use_log"]:
        first, last = math.log(low + shift), math.log(high + shift)
        metres = np.exp(first + share * (last - first)) - shift
    else:
        metres = low + share * (high - low)
    return np.where(np.asarray(codes) > 0, metres, 0).astype(np.float32)


def _decoded(container: Any, stream: Any) -> Iterator[Any]:
    for frame in container.decode(stream):
        if frame.width * frame.height > MOST_PIXELS:
            raise ValueError(f"a picture of {frame.width} x {frame.height} pixels")
        if frame.pts is not None:
            yield frame


def _time(frame: Any) -> float:
    return float(frame.time)
