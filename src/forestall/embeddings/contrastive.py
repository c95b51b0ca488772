"""What CLIP and SigLIP have in common: pictures and texts as unit vectors of one space.

Subclassed by `clip.py` and `siglip.py`; calls `crops.py`, `tokens.py`, `pretrained.py` and
`remembered.py`. They come with the extra [vision], and their weights must be on this machine
already.

Neither takes a mask. An object is cut out as the shipped encoder cuts it, and what lies around it
is blurred: it stays a natural picture, as such encoders know them, and yet says which thing is
meant (the "blur reverse mask" of Yang et al., Fine-Grained Visual Prompting, NeurIPS 2023, which
there beats cropping, colouring and blackening).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageFilter

from forestall.embeddings.crops import Crops, crop, whole
from forestall.embeddings.remembered import CropRows, TextRows
from forestall.embeddings.tokens import words
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
from forestall.types.encoder import StateReading
from forestall.types.observation import Mask, Rgb

Vectors = npt.NDArray[np.float32]

BLUR = 1 / 28
"""Standard deviation of the blur around an object as a share of the crop's edge."""

EXTRA = "vision"


class ContrastiveEncoder:
    """Crops, frames and texts → unit rows (implements `ImageTextEncoder`).

    A subclass says which family it is: `family` as transformers calls it, `called` as people do,
    `default_model`, the environment variable that names another one, and how texts and pictures
    are prepared.

    Args:
        model: a folder, or a name on the hub whose files have been downloaded before; the family's
            environment variable, else its default, by default.
        device: where it runs, as torch calls it ("cpu", "cuda"); "auto": a GPU if there is one.
        batch: how many pictures or texts go through at once.

    Raises:
        InputError: the extra [vision] is missing, or there is no such device.
        ModelFileError: the model is missing or damaged, or is of another family.
    """

    family: str
    called: str
    default_model: str
    variable: str

    def __init__(self, model: str | None = None, *, device: str = AUTO, batch: int = 32) -> None:
        if batch < 1:
            raise InputError(f"a batch holds at least one picture, got {batch}")
        self._torch = package("torch", EXTRA)
        library = package("transformers", EXTRA)
        asked = chosen(model, self.variable, self.default_model)
        folder = local_folder(asked, self.variable, EXTRA)
        with loading(folder, EXTRA):
            config = library.AutoConfig.from_pretrained(folder, local_files_only=True)
            check_family(folder, config.model_type, (self.family,), self.called)
            self._read(library, folder)
        self._device = on_device(self._model, device, self._torch)
        self._batch = batch
        self._pixels = int(config.vision_config.image_size)
        self._most_tokens = int(config.text_config.max_position_embeddings)
        self.name = label(self.family, asked)
        self.reading = StateReading(scale=float(self._model.logit_scale.detach().exp()))
        width = self._width(config)
        self._texts = TextRows(self._encode_texts, width)
        self._crops = CropRows(self._encode_crops, width)

    def _read(self, library: Any, folder: Path) -> None:
        """Read model, tokenizer and processor of a folder."""
        raise NotImplementedError

    def _width(self, config: Any) -> int:
        """How many numbers a row has."""
        raise NotImplementedError

    def _tokens(self, texts: Sequence[str]) -> Any:
        """Name → array of numbers, as the text tower takes them."""
        raise NotImplementedError

    def _load(self, model: Any, tokenizer: Any, processor: Any, folder: Path) -> None:
        """Read the three of these classes."""
        self._model = read_weights(model, folder, self._torch)
        self._tokenizer = tokenizer.from_pretrained(folder, local_files_only=True)
        self._processor = processor.from_pretrained(folder, local_files_only=True)

    def readable(self, text: str) -> bool:
        """Whether a text has anything to read (Latin letters, digits)."""
        return bool(words(text))

    def encode(self, texts: Sequence[str]) -> Vectors:
        """(n, d) float32 rows of unit length; a text is cut off where the model reads no further.

        Raises:
            InputError: a text without a Latin letter or digit.
        """
        for text in texts:
            if not self.readable(text):
                raise InputError(
                    f"the encoder {self.name!r} cannot read {text!r}: it knows Latin letters only"
                )
        return self._texts(texts)

    def encode_crops(self, rgb: Rgb, masks: Sequence[Mask]) -> Vectors:
        """(n, d) float32 unit rows, one for each mask.

        What was asked of the same frame just before is not computed again.
        """
        return self._crops(rgb, masks)

    def encode_image(self, rgb: Rgb) -> Vectors:
        """(d,) float32 unit vector of a whole frame, grey above and below: no side is cut off."""
        frame = Image.fromarray(whole(rgb, self._pixels)[..., :3])
        row: Vectors = self._encode_pictures([frame])[0]
        return row

    def _encode_crops(self, rgb: Rgb, masks: Sequence[Mask]) -> Vectors:
        return self._encode_pictures([shown(crop(rgb, m, self._pixels)) for m in masks])

    def _encode_pictures(self, pictures: Sequence[Image.Image]) -> Vectors:
        rows = []
        for start in range(0, len(pictures), self._batch):
            values = self._processor(
                list(pictures[start : start + self._batch]),
                do_resize=False,
                do_center_crop=False,
                return_tensors="np",
            )
            rows.append(self._run(self._model.get_image_features, values))
        return np.concatenate(rows)

    def _encode_texts(self, texts: Sequence[str]) -> Vectors:
        rows = []
        for start in range(0, len(texts), self._batch):
            values = self._tokens(texts[start : start + self._batch])
            rows.append(self._run(self._model.get_text_features, values))
        return np.concatenate(rows)

    def _run(self, tower: Any, values: Any) -> Vectors:
        with self._torch.inference_mode():
            inputs = {k: self._torch.from_numpy(v).to(self._device) for k, v in values.items()}
            rows: Vectors = tower(**inputs).pooler_output.cpu().numpy()
        rows /= np.linalg.norm(rows, axis=1, keepdims=True)
        return rows


def shown(pixels: Crops) -> Image.Image:
    """The object as it is, what lies around it blurred."""
    sharp = Image.fromarray(pixels[..., :3])
    blurred = sharp.filter(ImageFilter.GaussianBlur(BLUR * pixels.shape[0]))
    return Image.composite(sharp, blurred, Image.fromarray(pixels[..., 3]))
