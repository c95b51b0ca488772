"""A captioning model that sees: BLIP, through `transformers`.

Called by views and by caption-based comparison; calls `pretrained.py` and `views.py`. The paper
has a vision-language model describe each picture (Sec. 3, caption-based comparison) and does not
name it; BLIP is the one of its time that runs on a CPU. It comes with the extra [vision], and its
weights (BSD-3-Clause) must be on this machine already.
"""

from __future__ import annotations

from PIL import Image

from forestall.embeddings.views import picture
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
from forestall.types.graph import SceneGraph
from forestall.types.observation import Observation

DEFAULT_MODEL = "Salesforce/blip-image-captioning-base"
VARIABLE = "FORESTALL_BLIP"

_EXTRA = "vision"


class BlipCaptioner:
    """Picture → one sentence (implements `Captioner`), the same for the same picture.

    Args:
        model: a folder, or a name on the hub whose files have been downloaded before; the
            environment variable FORESTALL_BLIP, else `DEFAULT_MODEL`, by default.
        device: where it runs, as torch calls it ("cpu", "cuda"); "auto": a GPU if there is one.
        beams: how many captions are followed at once; 1 takes the likeliest word each time.
        most_tokens: where a caption is cut off.

    Raises:
        InputError: the extra [vision] is missing, or there is no such device.
        ModelFileError: the model is missing or damaged, or is no BLIP.
    """

    def __init__(
        self,
        model: str | None = None,
        *,
        device: str = AUTO,
        beams: int = 3,
        most_tokens: int = 40,
    ) -> None:
        if beams < 1 or most_tokens < 1:
            raise InputError(f"beams and tokens are at least 1, got {beams} and {most_tokens}")
        self._torch = package("torch", _EXTRA)
        library = package("transformers", _EXTRA)
        asked = chosen(model, VARIABLE, DEFAULT_MODEL)
        folder = local_folder(asked, VARIABLE, _EXTRA)
        with loading(folder, _EXTRA):
            config = library.AutoConfig.from_pretrained(folder, local_files_only=True)
            check_family(folder, config.model_type, ("blip",), "BLIP")
            blip = library.BlipForConditionalGeneration
            self._model = read_weights(blip, folder, self._torch)
            self._tokenizer = library.BertTokenizer.from_pretrained(folder, local_files_only=True)
            self._processor = library.BlipImageProcessorPil.from_pretrained(
                folder, local_files_only=True
            )
        self._device = on_device(self._model, device, self._torch)
        self._how = {"num_beams": beams, "do_sample": False, "max_new_tokens": most_tokens}
        self.name = label("blip", asked)

    def caption(self, observation: Observation, scoped: SceneGraph) -> str:
        """What is in the observation's picture (`views.picture`); the graph is not looked at."""
        values = self._processor([Image.fromarray(picture(observation))], return_tensors="np")
        pixels = self._torch.from_numpy(values["pixel_values"]).to(self._device)
        with self._torch.inference_mode():
            written = self._model.generate(pixel_values=pixels, **self._how)
        text: str = self._tokenizer.decode(written[0], skip_special_tokens=True)
        return text.strip()
