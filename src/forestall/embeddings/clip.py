"""CLIP itself, through `transformers`: pictures and texts as unit vectors of one space.

Called by the state estimator, by retrieval and by the comparisons, wherever the shipped encoder
can stand; calls `crops.py`, `tokens.py`, `pretrained.py` and `remembered.py`. This is the encoder
of the paper (Sec. 3). It comes with the extra [vision], and its weights, which OpenAI published
under the MIT licence, must be on this machine already.

CLIP takes no mask. An object is cut out as the shipped encoder cuts it, and what lies around it is
blurred: it stays a natural picture, as CLIP knows them, and yet says which thing is meant (the
"blur reverse mask" of Yang et al., Fine-Grained Visual Prompting, NeurIPS 2023, which there beats
cropping, colouring and blackening).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageFilter

from forestall.embeddings.crops import Crops, crop, whole
from forestall.embeddings.pretrained import chosen, label, loading, local_folder, package
from forestall.embeddings.remembered import CropRows, TextRows
from forestall.embeddings.tokens import words
from forestall.errors import InputError, ModelFileError
from forestall.types.encoder import StateReading
from forestall.types.observation import Mask, Rgb

Vectors = npt.NDArray[np.float32]

DEFAULT_MODEL = "openai/clip-vit-base-patch32"
VARIABLE = "FORESTALL_CLIP"
BLUR = 1 / 28
"""Standard deviation of the blur around an object as a share of the crop's edge."""

_EXTRA = "vision"


class ClipEncoder:
    """Crops, frames and texts → unit rows (implements `ImageTextEncoder`).

    Args:
        model: a folder, or a name on the hub whose files have been downloaded before; the
            environment variable FORESTALL_CLIP, else `DEFAULT_MODEL`, by default.
        device: where it runs, as torch calls it: "cpu", "cuda", ...
        batch: how many pictures or texts go through at once.

    Raises:
        InputError: the extra [vision] is missing, or there is no such device.
        ModelFileError: the model is missing or damaged, or is no CLIP.
    """

    def __init__(self, model: str | None = None, *, device: str = "cpu", batch: int = 32) -> None:
        if batch < 1:
            raise InputError(f"a batch holds at least one picture, got {batch}")
        self._torch = package("torch", _EXTRA)
        library = package("transformers", _EXTRA)
        asked = chosen(model, VARIABLE, DEFAULT_MODEL)
        folder = local_folder(asked, VARIABLE, _EXTRA)
        with loading(folder, _EXTRA):
            config = library.AutoConfig.from_pretrained(folder, local_files_only=True)
            if config.model_type != "clip":
                raise ModelFileError(f"{folder} holds a {config.model_type!r} model and no CLIP")
            self._model, report = library.CLIPModel.from_pretrained(
                folder,
                local_files_only=True,
                dtype=self._torch.float32,
                output_loading_info=True,
            )
            self._tokenizer = library.CLIPTokenizer.from_pretrained(folder, local_files_only=True)
            self._processor = library.CLIPImageProcessorPil.from_pretrained(
                folder, local_files_only=True
            )
        if report["missing_keys"]:
            first = min(report["missing_keys"])
            raise ModelFileError(f"{folder} lacks weights, {first} among them: download it again")
        self._device = device
        try:
            self._model.to(device)
        except (RuntimeError, AssertionError) as error:  # torch built without it asserts
            raise InputError(f"torch cannot run on device {device!r}: {error}") from error
        self._batch = batch
        self._pixels = int(config.vision_config.image_size)
        self._most_tokens = int(config.text_config.max_position_embeddings)
        self.name = label("clip", asked)
        self.reading = StateReading(scale=float(self._model.logit_scale.detach().exp()))
        self._texts = TextRows(self._encode_texts, int(config.projection_dim))
        self._crops = CropRows(self._encode_crops, int(config.projection_dim))

    def readable(self, text: str) -> bool:
        """Whether a text has anything that CLIP learned to read (Latin letters, digits)."""
        return bool(words(text))

    def encode(self, texts: Sequence[str]) -> Vectors:
        """(n, d) float32 rows of unit length; a text is cut off after CLIP's 77 tokens.

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
        return self._encode_pictures([_picture(crop(rgb, m, self._pixels)) for m in masks])

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
            values = self._tokenizer(
                list(texts[start : start + self._batch]),
                padding=True,
                truncation=True,
                max_length=self._most_tokens,
                return_tensors="np",
            )
            rows.append(self._run(self._model.get_text_features, values))
        return np.concatenate(rows)

    def _run(self, tower: Any, values: Any) -> Vectors:
        with self._torch.inference_mode():
            inputs = {k: self._torch.from_numpy(v).to(self._device) for k, v in values.items()}
            rows: Vectors = tower(**inputs).pooler_output.cpu().numpy()
        rows /= np.linalg.norm(rows, axis=1, keepdims=True)
        return rows


def _picture(pixels: Crops) -> Image.Image:
    """The object as it is, what lies around it blurred."""
    sharp = Image.fromarray(pixels[..., :3])
    blurred = sharp.filter(ImageFilter.GaussianBlur(BLUR * pixels.shape[0]))
    return Image.composite(sharp, blurred, Image.fromarray(pixels[..., 3]))
