"""Segment Anything and SAM 2, through `transformers`: boxes in, masks out.

Called by the segmenter `finder`; calls `pretrained.py`. Kirillov et al., Segment Anything, ICCV
2023; Ravi et al., SAM 2, ICLR 2025. They come with the extra [vision], and their weights
(Apache-2.0) must be on this machine already.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from PIL import Image

from forestall.errors import InputError
from forestall.pretrained import (
    AUTO,
    check_family,
    chosen,
    label,
    loading,
    local_folder,
    on_device,
    package,
    read_weights,
)
from forestall.types.grounding import Corners
from forestall.types.observation import Frame, Mask, Rgb

DEFAULT_MODEL = "facebook/sam2.1-hiera-tiny"
VARIABLE = "FORESTALL_SAM"

_EXTRA = "vision"
_FIRST, _SECOND = ("sam",), ("sam2", "sam2_video")
"""Model types; published weights of SAM 2 are those of its video model."""

_MEAN = np.array([0.485, 0.456, 0.406], dtype=np.float32)
_DEVIATION = np.array([0.229, 0.224, 0.225], dtype=np.float32)
"""ImageNet's, by which both models' pictures are normalised."""


class SamOutliner:
    """Boxes → masks (implements `Outliner`): one mask for each box, as is advised for boxes.

    Args:
        model: a folder, or a name on the hub whose files have been downloaded before; the
            environment variable FORESTALL_SAM, else `DEFAULT_MODEL`, by default.
        device: where it runs, as torch calls it ("cpu", "cuda"); "auto": a GPU if there is one.
        batch: how many boxes of a picture are outlined at once; the picture itself is encoded once.

    Raises:
        InputError: the extra [vision] is missing, or there is no such device.
        ModelFileError: the model is missing or damaged, or is neither SAM nor SAM 2.
    """

    exact = True

    def __init__(self, model: str | None = None, *, device: str = AUTO, batch: int = 32) -> None:
        if batch < 1:
            raise InputError(f"a batch holds at least one box, got {batch}")
        self._torch = package("torch", _EXTRA)
        library = package("transformers", _EXTRA)
        asked = chosen(model, VARIABLE, DEFAULT_MODEL)
        folder = local_folder(asked, VARIABLE, _EXTRA)
        with loading(folder, _EXTRA):
            config = library.AutoConfig.from_pretrained(folder, local_files_only=True)
            check_family(folder, config.model_type, (*_FIRST, *_SECOND), "SAM or SAM 2")
            self._padded = config.model_type in _FIRST
            kind = library.SamModel if self._padded else library.Sam2Model
            self._model = read_weights(kind, folder, self._torch)
        self._device = on_device(self._model, device, self._torch)
        self._side = int(self._model.config.prompt_encoder_config.image_size)
        self._batch = batch
        self.name = label(config.model_type.partition("_")[0], asked)

    def outline(self, frame: Frame, boxes: Sequence[Corners]) -> list[Mask]:
        """See the Protocol."""
        if not boxes:
            return []
        pixels, (wide, high) = self._pixels(frame.rgb)
        size = frame.rgb.shape[:2]
        scale = np.array([wide / size[1], high / size[0]] * 2)
        with self._torch.inference_mode():
            embedded = self._model.get_image_embeddings(self._tensor(pixels))
            return [
                mask
                for start in range(0, len(boxes), self._batch)
                for mask in self._masks(
                    embedded,
                    np.array(boxes[start : start + self._batch]) * scale,
                    (wide, high),
                    size,
                )
            ]

    def _pixels(self, rgb: Rgb) -> tuple[Any, tuple[int, int]]:
        """The picture as the model takes it (1, 3, side, side), and its (W, H) in there.

        SAM keeps the ratio of the sides and pads with 0 to the right and below; SAM 2 stretches.
        """
        high, wide = rgb.shape[:2]
        to = (self._side, self._side)
        if self._padded:
            scale = self._side / max(high, wide)
            to = (int(wide * scale + 0.5), int(high * scale + 0.5))
        resized = Image.fromarray(rgb).resize(to, Image.Resampling.BILINEAR)
        values = (np.asarray(resized, dtype=np.float32) / 255 - _MEAN) / _DEVIATION
        pixels = np.zeros((1, 3, self._side, self._side), dtype=np.float32)
        pixels[0, :, : to[1], : to[0]] = values.transpose(2, 0, 1)
        return pixels, to

    def _masks(
        self, embedded: Any, boxes: Any, shown: tuple[int, int], size: tuple[int, ...]
    ) -> Iterator[Mask]:
        """Masks of the picture's own size: the logits are enlarged, and what was padded is cut."""
        enlarge = self._torch.nn.functional.interpolate
        out = self._model(
            image_embeddings=embedded,
            input_boxes=self._tensor(boxes[None].astype(np.float32)),
            multimask_output=False,
        )
        logits = out.pred_masks[0]  # (boxes, 1, low, low)
        if self._padded:
            logits = enlarge(logits, (self._side, self._side), mode="bilinear")
            logits = logits[..., : shown[1], : shown[0]]
        logits = enlarge(logits, tuple(size), mode="bilinear")
        for mask in (logits[:, 0] > 0).cpu().numpy():
            yield mask.astype(np.bool_)

    def _tensor(self, values: Any) -> Any:
        return self._torch.from_numpy(values).to(self._device)
