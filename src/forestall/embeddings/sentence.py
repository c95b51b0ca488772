"""A sentence encoder through `sentence-transformers`: knows meanings and sees no pictures.

Called by retrieval and by the comparison of graphs, wherever a text encoder can stand; calls
`pretrained.py` and `remembered.py`. It is what the shipped encoder's texts are measured against.
It comes with the extra [text]; the weights of the default model (Apache-2.0) must be on this
machine already.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from forestall.embeddings.remembered import TextRows
from forestall.errors import InputError, ModelFileError
from forestall.pretrained import chosen, label, loading, local_folder, package

Vectors = npt.NDArray[np.float32]

DEFAULT_MODEL = "sentence-transformers/all-MiniLM-L6-v2"
VARIABLE = "FORESTALL_SENTENCE_MODEL"

_EXTRA = "text"


class SentenceEncoder:
    """Texts → unit rows (implements `TextEncoder`).

    Args:
        model: a folder, or a name on the hub whose files have been downloaded before; the
            environment variable FORESTALL_SENTENCE_MODEL, else `DEFAULT_MODEL`, by default.
        device: where it runs, as torch calls it: "cpu", "cuda", ...
        batch: how many texts go through at once.

    Raises:
        InputError: the extra [text] is missing, or there is no such device.
        ModelFileError: the model is missing or damaged, or gives no sentence vectors.
    """

    def __init__(self, model: str | None = None, *, device: str = "cpu", batch: int = 32) -> None:
        if batch < 1:
            raise InputError(f"a batch holds at least one text, got {batch}")
        torch = package("torch", _EXTRA)
        library = package("sentence_transformers", _EXTRA)
        asked = chosen(model, VARIABLE, DEFAULT_MODEL)
        folder = local_folder(asked, VARIABLE, _EXTRA)
        if not (folder / "modules.json").is_file():
            raise ModelFileError(
                f"{folder} holds no sentence encoder: there is no modules.json in it"
            )
        with loading(folder, _EXTRA):
            self._model = library.SentenceTransformer(
                str(folder), device="cpu", local_files_only=True
            )
            _check_weights(self._model[0], folder)
        try:
            self._model.to(torch.device(device))
        except (RuntimeError, AssertionError) as error:  # torch built without it asserts
            raise InputError(f"torch cannot run on device {device!r}: {error}") from error
        self._batch = batch
        self.name = label("sentence", asked)
        self._texts = TextRows(self._compute, self._compute(["width"]).shape[1])

    def encode(self, texts: Sequence[str]) -> Vectors:
        """(n, d) float32 rows of unit length.

        Raises:
            InputError: a text without a letter or digit.
        """
        for text in texts:
            if not any(c.isalnum() for c in text):
                raise InputError(f"the encoder {self.name!r} cannot read {text!r}")
        return self._texts(texts)

    def _compute(self, texts: Sequence[str]) -> Vectors:
        rows: Vectors = self._model.encode(
            list(texts),
            batch_size=self._batch,
            show_progress_bar=False,
            convert_to_numpy=True,
            normalize_embeddings=True,
        )
        return rows.astype(np.float32, copy=False)


def _check_weights(body: Any, folder: Path) -> None:
    """Refuse a model of which a part was left to chance, because its weights are not there.

    Raises:
        ModelFileError: see `SentenceEncoder`.
    """
    if not hasattr(body, "auto_model"):
        return
    modules = json.loads((folder / "modules.json").read_text(encoding="utf-8"))
    _, report = type(body.auto_model).from_pretrained(
        folder / modules[0]["path"], local_files_only=True, output_loading_info=True
    )
    missing = [k for k in report["missing_keys"] if not k.startswith("pooler.")]
    if missing:
        raise ModelFileError(f"{folder} lacks weights, {min(missing)} among them")
