"""Detectors of fixed classes as ONNX files, without torch.

Called by the segmenter `finder`; calls `pretrained.py`, `boxes.py` and the readers. The folder is
the one that `optimum-cli export onnx --task object-detection` writes for the family of DETR
(Carion et al., ECCV 2020; RT-DETR, Zhao et al., CVPR 2024): the model, what its classes are called
and how its pictures are prepared. Nothing of it is guessed: what is not said there is an error.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from pydantic import BaseModel, ConfigDict, Field

from forestall.errors import FileFormatError, InputError, ModelFileError
from forestall.pretrained import AUTO, label, onnx_session
from forestall.reading.documents import read_json
from forestall.reading.files import read_bytes
from forestall.reading.models import validated
from forestall.types.grounding import GroundedBox
from forestall.types.observation import Rgb
from forestall.vision.boxes import Floats, batches, check_finding, grounded, sigmoid

FAMILIES = {
    "conditional_detr": False,
    "d_fine": False,
    "deformable_detr": False,
    "detr": True,
    "rt_detr": False,
    "rt_detr_v2": False,
    "yolos": True,
}
"""Model type → whether its last class means nothing at all: scores are then shares of all classes,
else each class has one of its own (`post_process_object_detection` of transformers)."""

MODEL_FILES = ("model.onnx", "onnx/model.onnx")
CONFIG_FILE, PICTURES_FILE = "config.json", "preprocessor_config.json"
INPUT, OUTPUTS = "pixel_values", ("logits", "pred_boxes")
MOST_BYTES = 2**31

_WANTED = "the folder that `optimum-cli export onnx --task object-detection` writes"


class _Config(BaseModel):
    model_config = ConfigDict(extra="ignore")
    model_type: str
    id2label: dict[int, str] = Field(min_length=1)


class _Size(BaseModel):
    """Edges in pixels: of every picture, or of its shorter side, and of its longer one at most."""

    model_config = ConfigDict(extra="forbid")
    height: int | None = Field(default=None, gt=0)
    width: int | None = Field(default=None, gt=0)
    shortest_edge: int | None = Field(default=None, gt=0)
    longest_edge: int | None = Field(default=None, gt=0)


class _Pictures(BaseModel):
    model_config = ConfigDict(extra="ignore", allow_inf_nan=False)
    size: _Size
    do_resize: bool = True
    do_rescale: bool = True
    rescale_factor: float = 1 / 255
    do_normalize: bool
    image_mean: tuple[float, float, float] = (0.0, 0.0, 0.0)
    image_std: tuple[float, float, float] = (1.0, 1.0, 1.0)


class OnnxFinder:
    """Pictures → boxes of the classes that a model knows (implements `Finder`).

    Args:
        model: the folder; see above.
        device: "cpu", "cuda" where onnxruntime has it, "auto": the best of them.
        batch: how many pictures go through at once.
        least_score: under which there is no box.

    Raises:
        InputError: no folder was named, or onnxruntime has no such device.
        ModelFileError: a file is missing or damaged, or is of another family.
    """

    def __init__(
        self,
        model: str | None = None,
        *,
        device: str = AUTO,
        batch: int = 1,
        least_score: float = 0.5,
    ) -> None:
        check_finding(least_score, batch)
        if model is None:
            raise InputError(f"the finder 'onnx' needs the option model: {_WANTED}")
        folder = Path(model).expanduser()
        if not folder.is_dir():
            raise ModelFileError(f"{model} is not a folder: name {_WANTED}")
        try:
            config, self._how = _described(folder)
            file = next((folder / n for n in MODEL_FILES if (folder / n).is_file()), None)
            if file is None:
                raise ModelFileError(f"{folder} has no {MODEL_FILES[0]}: name {_WANTED}")
            data = read_bytes(file, "model", MOST_BYTES)
        except FileFormatError as error:
            raise ModelFileError(f"{error}: name {_WANTED}") from error
        self._nothing = FAMILIES[config.model_type]
        self._classes = config.id2label
        self.vocabulary: Sequence[str] | None = tuple(dict.fromkeys(config.id2label.values()))
        self._session = onnx_session(data, file, remedy="export it again", device=device)
        _check_session(self._session, file)
        self._file, self._batch, self._least = file, batch, least_score
        self.name = label("onnx", model)

    def find(self, pictures: Sequence[Rgb], phrases: Sequence[str]) -> list[list[GroundedBox]]:
        """See the Protocol; what is found and was not asked for is left out.

        Raises:
            ModelFileError: the model does not take such pictures, or answers in another form.
        """
        found: list[list[GroundedBox]] = [[] for _ in pictures]
        for together in batches(pictures, self._batch):
            logits, boxes = self._run(np.stack([self._pixels(pictures[i]) for i in together]))
            for row, index in enumerate(together):
                high, wide = pictures[index].shape[:2]
                all_of_it = self._boxes(logits[row], boxes[row], (wide, high))
                found[index] = [box for box in all_of_it if box.phrase in phrases]
        return found

    def _pixels(self, rgb: Rgb) -> Floats:
        """(3, H, W) as the model takes it."""
        how, picture = self._how, Image.fromarray(rgb)
        if how.do_resize:
            picture = picture.resize(_resized(how.size, picture.size), Image.Resampling.BILINEAR)
        values = np.asarray(picture, dtype=np.float32)
        if how.do_rescale:
            values = values * np.float32(how.rescale_factor)
        if how.do_normalize:
            mean, deviation = (np.array(v, np.float32) for v in (how.image_mean, how.image_std))
            values = (values - mean) / deviation
        return np.ascontiguousarray(values.transpose(2, 0, 1), dtype=np.float32)

    def _run(self, pixels: Floats) -> tuple[Floats, Floats]:
        from onnxruntime.capi.onnxruntime_pybind11_state import Fail, InvalidArgument

        try:
            logits, boxes = self._session.run(list(OUTPUTS), {INPUT: pixels})
        except (Fail, InvalidArgument) as error:
            line = str(error).strip().partition("\n")[0]
            raise ModelFileError(
                f"{self._file} cannot take pictures of {pixels.shape[2]} x {pixels.shape[3]} "
                f"pixels in batches of {len(pixels)} ({line}): see {PICTURES_FILE} beside it"
            ) from error
        count = len(self._classes) + self._nothing
        if logits.ndim != 3 or boxes.shape != (*logits.shape[:2], 4) or logits.shape[2] != count:
            raise ModelFileError(
                f"{self._file} gives logits {logits.shape} and boxes {boxes.shape}; by "
                f"{CONFIG_FILE} there are {count} classes"
            )
        return logits, boxes

    def _boxes(self, logits: Floats, boxes: Floats, size: tuple[int, int]) -> list[GroundedBox]:
        if self._nothing:
            weights = np.exp(logits - logits.max(axis=1, keepdims=True))
            scores = (weights / weights.sum(axis=1, keepdims=True))[:, :-1]
        else:
            scores = sigmoid(logits)
        best, kept = scores.argmax(axis=1), scores.max(axis=1) >= self._least
        called = [self._classes[int(i)] for i in best[kept]]
        return grounded(called, scores.max(axis=1)[kept], boxes[kept], size)


def _described(folder: Path) -> tuple[_Config, _Pictures]:
    """What stands beside a model.

    Raises:
        FileFormatError: a file is missing, or says something else.
        ModelFileError: a model of a family whose answers cannot be read.
    """
    place = folder / CONFIG_FILE
    config = validated(_Config, read_json(place, "model description"), str(place))
    if config.model_type not in FAMILIES:
        raise ModelFileError(
            f"{folder} holds a {config.model_type!r} model; what can be read are "
            f"{', '.join(FAMILIES)}"
        )
    if set(config.id2label) != set(range(len(config.id2label))):
        raise FileFormatError(f"{place}: id2label does not number its classes from 0 on")
    place = folder / PICTURES_FILE
    pictures = validated(_Pictures, read_json(place, "model description"), str(place))
    size = pictures.size
    if pictures.do_resize and not (size.height and size.width) and not size.shortest_edge:
        raise FileFormatError(f"{place}: size has neither height and width nor shortest_edge")
    return config, pictures


def _check_session(session: Any, file: Path) -> None:
    """See that the model takes pictures alone and gives what is read.

    Raises:
        ModelFileError: it does not.
    """
    takes = [i.name for i in session.get_inputs()]
    gives = [o.name for o in session.get_outputs()]
    if takes != [INPUT] or not set(OUTPUTS) <= set(gives):
        raise ModelFileError(
            f"{file} takes {', '.join(takes)} and gives {', '.join(gives)}: it should take "
            f"{INPUT} and give {' and '.join(OUTPUTS)}; name {_WANTED}"
        )


def _resized(size: _Size, now: tuple[int, int]) -> tuple[int, int]:
    """(W, H) that a picture of (W, H) comes to."""
    if size.height and size.width:
        return size.width, size.height
    assert size.shortest_edge is not None
    scale = size.shortest_edge / min(now)
    if size.longest_edge:
        scale = min(scale, size.longest_edge / max(now))
    return max(1, round(now[0] * scale)), max(1, round(now[1] * scale))
