"""What all models have in common: how they are found, and what is said where they are not."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from forestall.embeddings.siglip import SiglipEncoder
from forestall.errors import InputError, ModelFileError
from forestall.fingerprint import weights_of
from forestall.vision.grounding_dino import GroundingDinoFinder
from forestall.vision.owl import Owlv2Finder
from forestall.vision.sam import SamOutliner

from . import tiny

MODELS: dict[str, tuple[Any, str, str]] = {
    "grounding_dino": (GroundingDinoFinder, "Grounding DINO", "FORESTALL_GROUNDING_DINO"),
    "owlv2": (Owlv2Finder, "OWLv2", "FORESTALL_OWLV2"),
    "sam": (SamOutliner, "SAM or SAM 2", "FORESTALL_SAM"),
    "sam2": (SamOutliner, "SAM or SAM 2", "FORESTALL_SAM"),
}
Checkpoint = Callable[[str], Path]
EVERY = pytest.mark.parametrize("name", MODELS)


@EVERY
def test_a_folder_is_named_by_option_or_variable(
    name: str, checkpoint: Checkpoint, monkeypatch: pytest.MonkeyPatch
) -> None:
    model, _, variable = MODELS[name]
    monkeypatch.setenv(variable, str(checkpoint(name)))
    assert model().name == f"{name.replace('_', '-')}:tiny-{name}"


@EVERY
def test_a_gpu_that_is_absent_is_said(name: str, checkpoint: Checkpoint) -> None:
    torch, _ = tiny.libraries()
    if torch.cuda.is_available():
        pytest.skip("this machine has a GPU")
    model = MODELS[name][0]
    with pytest.raises(InputError, match=r"device 'cuda' .*this machine has cpu; 'auto' takes"):
        model(str(checkpoint(name)), device="cuda")
    with pytest.raises(InputError, match="device 'abacus'"):
        model(str(checkpoint(name)), device="abacus")


@EVERY
def test_damaged_and_wrong_models(name: str, checkpoint: Checkpoint, tmp_path: Path) -> None:
    model, called, _ = MODELS[name]
    torn = shutil.copytree(checkpoint(name), tmp_path / "torn")
    weights = torn / "model.safetensors"
    weights.write_bytes(weights.read_bytes()[:-50])
    with pytest.raises(ModelFileError, match="torn cannot be loaded"):
        model(str(torn))
    other = shutil.copytree(checkpoint(name), tmp_path / "other")
    (other / "config.json").write_text(json.dumps({"model_type": "bert"}))
    with pytest.raises(ModelFileError, match=f"other holds a 'bert' model and no {called}"):
        model(str(other))
    with pytest.raises(ModelFileError, match="neither a folder nor a model name"):
        model(str(tmp_path / "gone"))


@EVERY
@pytest.mark.parametrize("missing", ["torch", "transformers"])
def test_missing_packages_name_the_extra(
    name: str, missing: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for package in ("torch", "transformers"):
        monkeypatch.setitem(sys.modules, package, ModuleType(package))
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(InputError, match=rf"{missing}.*pip install 'forestall\[vision\]'"):
        MODELS[name][0]()


@pytest.mark.parametrize("model", [GroundingDinoFinder, Owlv2Finder, SamOutliner, SiglipEncoder])
def test_missing_weights_name_the_download(model: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def absent(name: str, *, local_files_only: bool) -> str:
        assert local_files_only
        raise FileNotFoundError(name)

    for package in ("torch", "transformers"):
        monkeypatch.setitem(sys.modules, package, ModuleType(package))
    hub = ModuleType("huggingface_hub")
    monkeypatch.setattr(hub, "snapshot_download", absent, raising=False)
    monkeypatch.setitem(sys.modules, "huggingface_hub", hub)
    with pytest.raises(ModelFileError, match=r"snapshot_download\('.*set FORESTALL_[A-Z0-9_]+ to"):
        model()


def test_results_are_kept_apart_by_the_weights_that_a_variable_names(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("FORESTALL_GROUNDING_DINO", "/models/dino")
    assert weights_of(["sam", "grounding-dino"]) == [("grounding-dino", "/models/dino")]


@pytest.mark.parametrize("model", [GroundingDinoFinder, Owlv2Finder])
def test_options_that_cannot_be(model: Any) -> None:
    with pytest.raises(InputError, match="least_score is 0 to 1"):
        model(least_score=1.5)
    with pytest.raises(InputError, match="at least one picture"):
        model(batch=0)
