from __future__ import annotations

import json
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from forestall.errors import InputError, ModelFileError
from forestall.types.observation import Rgb
from forestall.vision.onnx_finder import OnnxFinder

from . import tiny

BOXES = np.array([[0.5, 0.5, 0.2, 0.4], [0.1, 0.25, 0.4, 0.25]], dtype=np.float32)


def exported(
    folder: Path, classes: int = 2, family: str = "rt_detr", outputs: tuple[str, ...] = ()
) -> Path:
    """A detector of two boxes: the first is as red as the picture is, the second as green.

    Its graph is made by hand: logits are the means of the colours, 20 times as large and less 10.
    """
    onnx = pytest.importorskip("onnx", reason="onnx is not installed")
    make, numbers = onnx.helper, onnx.numpy_helper
    logits, boxes = outputs or ("logits", "pred_boxes")
    pick = np.full((3, 2 * classes), 0, dtype=np.float32)
    bias = np.full((2 * classes,), -10, dtype=np.float32)
    pick[0, 0], pick[1, classes + 1] = 20, 20
    constants = {
        "pick": pick,
        "bias": bias,
        "shape": np.array([-1, 2, classes], dtype=np.int64),
        "boxes": BOXES[None],
        "zero": np.zeros((1, 1, 1), dtype=np.float32),
        "first": np.array([-1, 1, 1], dtype=np.int64),
        "column": np.array([0], dtype=np.int64),
    }
    nodes = [
        make.make_node("ReduceMean", ["pixel_values"], ["mean"], axes=[2, 3], keepdims=0),
        make.make_node("MatMul", ["mean", "pick"], ["product"]),
        make.make_node("Add", ["product", "bias"], ["flat"]),
        make.make_node("Reshape", ["flat", "shape"], [logits]),
        make.make_node("Gather", ["mean", "column"], ["one"], axis=1),
        make.make_node("Reshape", ["one", "first"], ["each"]),
        make.make_node("Mul", ["each", "zero"], ["nothing"]),
        make.make_node("Add", ["nothing", "boxes"], [boxes]),
    ]
    floats = onnx.TensorProto.FLOAT
    graph = make.make_graph(
        nodes,
        "two boxes",
        [make.make_tensor_value_info("pixel_values", floats, ["batch", 3, 32, 32])],
        [make.make_tensor_value_info(name, floats, None) for name in (logits, boxes)],
        [numbers.from_array(value, name) for name, value in constants.items()],
    )
    model = make.make_model(graph, opset_imports=[make.make_opsetid("", 13)], ir_version=8)
    folder.mkdir()
    onnx.save(model, str(folder / "model.onnx"))
    none = family in ("detr", "yolos")
    names = {str(i): ("cup", "dining table", "dog")[i] for i in range(classes - none)}
    described(folder, {"model_type": family, "id2label": names})
    pictures(folder, {"size": {"height": 32, "width": 32}, "do_normalize": False})
    return folder


def described(folder: Path, config: dict[str, Any]) -> None:
    (folder / "config.json").write_text(json.dumps(config))


def pictures(folder: Path, how: dict[str, Any]) -> None:
    (folder / "preprocessor_config.json").write_text(json.dumps(how))


def coloured(red: int, green: int) -> Rgb:
    rgb = np.zeros((40, 80, 3), dtype=np.uint8)
    rgb[..., 0], rgb[..., 1] = red, green
    return rgb


def test_boxes_scores_and_classes_are_those_of_the_model(tmp_path: Path) -> None:
    finder = OnnxFinder(str(exported(tmp_path / "own")))
    assert finder.name == "onnx:own" and finder.vocabulary == ("cup", "dining table")
    red, green, both, dark = finder.find(
        [coloured(255, 0), coloured(0, 255), coloured(255, 153), coloured(0, 0)],
        ["cup", "dining table"],
    )
    assert [b.phrase for b in red] == ["cup"]
    assert red[0].corners == pytest.approx((32.0, 12.0, 48.0, 28.0), abs=1e-3)
    assert red[0].score == pytest.approx(1 / (1 + np.exp(-10)), abs=1e-4)
    assert [b.phrase for b in green] == ["dining table"]
    assert np.allclose(green[0].corners, (0.0, 5.0, 24.0, 15.0))  # cut off at the border
    assert [b.phrase for b in both] == ["cup", "dining table"] and dark == []
    assert both[1].score == pytest.approx(1 / (1 + np.exp(-2)), abs=1e-3)


def test_what_was_not_asked_for_is_left_out(tmp_path: Path) -> None:
    finder = OnnxFinder(str(exported(tmp_path / "own")), batch=8)
    found = finder.find([coloured(255, 255)] * 3, ["cup"])
    assert [[b.phrase for b in boxes] for boxes in found] == [["cup"]] * 3
    sure = OnnxFinder(str(tmp_path / "own"), least_score=0.99999)
    assert sure.find([coloured(255, 255)], ["cup"]) == [[]]


def test_families_whose_last_class_is_nothing(tmp_path: Path) -> None:
    finder = OnnxFinder(str(exported(tmp_path / "own", classes=3, family="detr")))
    (found,) = finder.find([coloured(255, 0)], ["cup", "dining table"])
    assert [b.phrase for b in found] == ["cup"]
    assert found[0].score == pytest.approx(1 / (1 + 2 * np.exp(-20)), abs=1e-4)


def test_pictures_are_prepared_as_is_said(tmp_path: Path) -> None:
    folder = exported(tmp_path / "own")
    how = {"size": {"height": 32, "width": 32}, "do_normalize": True}
    pictures(folder, {**how, "image_mean": [0.5, 0, 0], "image_std": [0.5, 1, 1]})
    half = OnnxFinder(str(folder)).find([coloured(204, 0)], ["cup"])[0][0]
    assert half.score == pytest.approx(1 / (1 + np.exp(-2)), abs=1e-2)  # (0.8 - 0.5) / 0.5
    pictures(folder, {"size": {"shortest_edge": 40}, "do_normalize": False})
    with pytest.raises(ModelFileError, match=r"cannot take pictures of 40 x 80 .*preprocessor_con"):
        OnnxFinder(str(folder)).find([coloured(255, 0)], ["cup"])


def test_sizes_keep_the_ratio_where_the_shorter_edge_is_given() -> None:
    from forestall.vision.onnx_finder import _resized, _Size

    assert _resized(_Size(shortest_edge=800, longest_edge=1333), (640, 480)) == (1067, 800)
    assert _resized(_Size(shortest_edge=800, longest_edge=1000), (640, 480)) == (1000, 750)
    assert _resized(_Size(height=640, width=320), (100, 100)) == (320, 640)


def _without(file: str) -> Callable[[Path], None]:
    return lambda folder: (folder / file).unlink()


FAULTS: dict[str, tuple[Callable[[Path], Any], str]] = {
    "no model": (_without("model.onnx"), "has no model.onnx"),
    "no config": (_without("config.json"), r"config.json.*optimum-cli export onnx"),
    "no pictures": (_without("preprocessor_config.json"), "preprocessor_config.json"),
    "torn": (
        lambda f: (f / "model.onnx").write_bytes((f / "model.onnx").read_bytes()[:-60]),
        "model.onnx is damaged",
    ),
    "another family": (
        lambda f: described(f, {"model_type": "bert", "id2label": {"0": "cup"}}),
        "a 'bert' model; what can be read are",
    ),
    "gaps": (
        lambda f: described(f, {"model_type": "rt_detr", "id2label": {"0": "a", "2": "b"}}),
        "does not number its classes",
    ),
    "no classes": (lambda f: described(f, {"model_type": "rt_detr"}), "id2label"),
    "no size": (lambda f: pictures(f, {"size": {}, "do_normalize": False}), "size has neither"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_folders_that_cannot_be_read(fault: str, tmp_path: Path) -> None:
    folder = exported(tmp_path / "own")
    spoil, why = FAULTS[fault]
    spoil(folder)
    with pytest.raises(ModelFileError, match=why):
        OnnxFinder(str(folder))


def test_answers_of_another_form(tmp_path: Path) -> None:
    other = exported(tmp_path / "other", outputs=("scores", "boxes_out"))
    with pytest.raises(ModelFileError, match="gives scores, boxes_out: it should take pixel_v"):
        OnnxFinder(str(other))
    folder = exported(tmp_path / "own")
    names = {str(i): f"thing {i}" for i in range(5)}
    described(folder, {"model_type": "rt_detr", "id2label": names})
    with pytest.raises(ModelFileError, match="there are 5 classes"):
        OnnxFinder(str(folder)).find([coloured(255, 0)], ["thing 1"])


def test_what_is_missing_is_said(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="needs the option model"):
        OnnxFinder()
    with pytest.raises(ModelFileError, match="is not a folder"):
        OnnxFinder(str(tmp_path / "gone"))
    with pytest.raises(InputError, match=r"device 'abacus': this machine has cpu"):
        OnnxFinder(str(exported(tmp_path / "own")), device="abacus")


def test_an_export_of_a_real_class_gives_what_the_class_gives(tmp_path: Path, rgb: Rgb) -> None:
    pytest.importorskip("onnx", reason="onnx is not installed")
    torch, transformers = tiny.libraries()
    names = {0: "cup", 1: "dining table", 2: "dog"}
    config = transformers.YolosConfig(
        hidden_size=16,
        num_hidden_layers=1,
        num_attention_heads=2,
        intermediate_size=32,
        image_size=[32, 48],
        patch_size=8,
        num_detection_tokens=5,
        id2label=names,
        label2id={name: i for i, name in names.items()},
    )
    model = transformers.YolosForObjectDetection(config).eval()
    folder = tmp_path / "yolos"
    model.save_pretrained(folder)
    size = {"height": 32, "width": 48}
    processor = transformers.YolosImageProcessorPil(size=size, do_pad=False)
    processor.save_pretrained(folder)

    class Heads(torch.nn.Module):  # type: ignore[name-defined, misc]
        def __init__(self) -> None:
            super().__init__()
            self.model = model

        def forward(self, pixels: Any) -> Any:
            out = self.model(pixel_values=pixels)
            return out.logits, out.pred_boxes

    with warnings.catch_warnings(), torch.no_grad():
        warnings.simplefilter("ignore")
        torch.onnx.export(
            Heads(),
            (torch.zeros(1, 3, 32, 48),),
            str(folder / "model.onnx"),
            input_names=["pixel_values"],
            output_names=["logits", "pred_boxes"],
            dynamo=False,
        )
    finder = OnnxFinder(str(folder), least_score=0.0)
    mine = finder.find([rgb], list(names.values()))[0]
    inputs = processor([rgb], return_tensors="pt")
    with torch.inference_mode():
        out = model(pixel_values=inputs["pixel_values"])
    expected = processor.post_process_object_detection(
        out, threshold=0.0, target_sizes=[rgb.shape[:2]]
    )[0]
    high, wide = rgb.shape[:2]
    theirs = np.clip(expected["boxes"].numpy(), 0, [wide, high, wide, high])
    assert len(mine) == 5
    assert [b.phrase for b in mine] == [names[int(i)] for i in expected["labels"]]
    assert np.allclose([b.score for b in mine], expected["scores"].numpy(), atol=0.02)
    assert np.allclose([b.corners for b in mine], theirs, atol=1.0)
