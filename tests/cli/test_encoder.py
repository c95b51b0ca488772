"""`forestall encoder` and the choice of where states come from: errors, without pictures."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from forestall.assembly.configuration import run_config
from forestall.assembly.make import make_strategy, prepare
from forestall.assembly.parts import Assembly
from forestall.cli.main import call
from forestall.domain.load import shipped
from forestall.embeddings.twotower import TwoTowerEncoder
from forestall.errors import InputError, UnknownNameError
from forestall.kinds import IMAGE_ENCODER, STATES
from forestall.training import shards
from forestall.training.questions import ATTRIBUTES
from forestall.types.demonstration import Demonstration, DemonstrationStep
from forestall.types.graph import ObjectNode, SceneGraph
from forestall.types.plan import Subtask


@pytest.fixture
def pictures(tmp_path: Path) -> Path:
    """Six grey crops of closed fridges, which say nothing; one is held, one disturbed."""
    folder = tmp_path / "pictures"
    (folder / "test").mkdir(parents=True)
    values = np.full((6, len(ATTRIBUTES)), -1, dtype=np.int8)
    values[:, list(ATTRIBUTES).index("open")] = 0
    np.savez(
        folder / "test" / "000000.npz",
        pixels=np.full((6, 80, 80, 4), 127, dtype=np.uint8),
        category=np.array(["Fridge"] * 6),
        values=values,
        area=np.full(6, 900, dtype=np.int32),
        frame=np.array([0, 1, 2, 3, 4, 4], dtype=np.int32),
        held=np.array([True, *[False] * 5]),
        seen=np.array([""] * 5 + ["all of it"]),
    )
    return folder


def test_missing_pictures_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["encoder", "test", "--pictures", str(tmp_path), "--quiet"]) == 2
    assert "forestall encoder pictures" in capsys.readouterr().err


def test_a_missing_model_is_named(
    tmp_path: Path, pictures: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["encoder", "test", "--pictures", str(pictures), "--model", str(tmp_path / "no")]
    assert call([*arguments, "--quiet"]) == 3
    assert "there is no encoder at" in capsys.readouterr().err


def test_figures_tables_and_page_of_the_shipped_encoder(
    tmp_path: Path, pictures: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert call(["encoder", "test", "--pictures", str(pictures), "--out", str(out), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["encoder"] == TwoTowerEncoder().name
    assert data["states"]["overall"]["figures"]["n"] == 5
    told = {c["name"]: c["group"]["figures"]["n"] for c in data["conditions"]}
    assert told == {"in the hand": 1, "as drawn, of the pictures below": 1, "all of it": 1}
    assert data["size_bytes"] < 10_000_000
    assert {w["group"] for w in data["words"]} == {"spelling", "meaning"}
    assert shards.read(pictures, "test").frame.tolist() == [0, 1, 2, 3, 4, 4]
    names = {p.name for p in out.iterdir()}
    assert names >= {"index.html", "measurement.md", "figures.csv", "confusion.csv"}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"states": "given"}, "states of a run 'given'.*learned"),
        ({"feature": "pixels"}, "feature of the perceiver 'graph' 'pixels'.*image"),
        ({"encoder": "word2vec"}, "encoder 'word2vec'.*two-tower"),
    ],
)
def test_unknown_names_are_refused_before_anything_is_built(
    change: dict[str, Any], message: str
) -> None:
    with pytest.raises(UnknownNameError, match=message):
        prepare(run_config("heat-potato", **change))


def test_states_are_learned_when_nothing_is_said() -> None:
    config = run_config("heat-potato")
    assert config.choice(STATES).name == "learned"
    one, two = (Assembly(config.choices, shipped("household")) for _ in range(2))
    assert one.part(STATES).name == f"learned states ({TwoTowerEncoder().name})"
    assert one.part(IMAGE_ENCODER) is two.part(IMAGE_ENCODER)  # read once for each process


def test_a_memory_without_looks_is_refused_for_the_feature_image() -> None:
    subtask = Subtask.parse("pick_up(Potato)")
    graph = SceneGraph((ObjectNode("Potato-1", "Potato"),), subtask=subtask)
    step = DemonstrationStep(0, subtask, graph, graph)
    config = run_config("heat-potato", feature="image")
    with pytest.raises(InputError, match=r"node features of demonstration .* come from nothing"):
        make_strategy(
            config, shipped("household"), [Demonstration("heat-potato", "kitchen-1", 1, (step,))]
        )
