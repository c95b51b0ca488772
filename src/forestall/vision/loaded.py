"""Finders of `transformers` as they lie on this machine: one way to read and to run them.

Called by `grounding_dino` and `owl`; calls `pretrained.py`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from forestall.pretrained import (
    check_family,
    chosen,
    label,
    loading,
    local_folder,
    on_device,
    package,
    read_weights,
)
from forestall.vision.boxes import Floats

_EXTRA = "vision"


@dataclass(frozen=True, slots=True)
class Source:
    """Where the model of a finder is looked for, and what of `transformers` reads it.

    Args:
        family: its `model_type`, and how its name begins.
        called: what such a model is called.
        default: a name on the hub.
        variable: environment variable that names another one.
        model: class of the model.
        tokenizer: class of its tokenizer.
        processor: class of what makes its input of pictures.
    """

    family: str
    called: str
    default: str
    variable: str
    model: str
    tokenizer: str
    processor: str


class Loaded:
    """A finder that has been read: its parts, and its heads.

    Args:
        source: where it is looked for.
        model: a folder, or a name on the hub whose files have been downloaded before; the
            variable of the source, else its default, by default.
        device: where it runs, as torch calls it, or `AUTO`.

    Raises:
        InputError: the extra [vision] is missing, or there is no such device.
        ModelFileError: the model is missing or damaged, or is of another family.
    """

    def __init__(self, source: Source, model: str | None, device: str) -> None:
        self._torch = package("torch", _EXTRA)
        library = package("transformers", _EXTRA)
        asked = chosen(model, source.variable, source.default)
        folder = local_folder(asked, source.variable, _EXTRA)

        def read(name: str) -> Any:
            return getattr(library, name).from_pretrained(folder, local_files_only=True)

        with loading(folder, _EXTRA):
            self.config = read("AutoConfig")
            check_family(folder, self.config.model_type, (source.family,), source.called)
            self._model = read_weights(getattr(library, source.model), folder, self._torch)
            self.tokenizer = read(source.tokenizer)
            self.processor = read(source.processor)
        self._device = on_device(self._model, device, self._torch)
        self.name = label(source.family, asked)

    def heads(self, inputs: Mapping[str, Any]) -> tuple[Floats, Floats]:
        """Logits (count, boxes, texts) and boxes (count, boxes, 4) of inputs by their names."""
        with self._torch.inference_mode():
            given = {k: self._torch.as_tensor(v).to(self._device) for k, v in inputs.items()}
            out = self._model(**given)
        return out.logits.cpu().numpy(), out.pred_boxes.cpu().numpy()
