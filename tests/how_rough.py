"""How rough pictures are: the limit of the shipped encoder's `most_rough` comes from here.

    python tests/how_rough.py [FOLDER]

Draws development pictures as the encoder's are drawn, sees them once more through worse eyes, and
takes what a robot saw in development runs; beside them stand all pictures below FOLDER, photographs
for instance. Nothing is fitted: the limit is what 99 % of the drawn ones keep.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from unittest.mock import patch

import numpy as np
from PIL import Image

from forestall.assembly.configuration import Given, run_config
from forestall.assembly.make import prepare, run_episode
from forestall.cli.listing import say
from forestall.config import PICTURE_SEEDS
from forestall.domain.load import shipped
from forestall.embeddings.twotower import TwoTowerEncoder
from forestall.perception.kind import of_its_kind, roughness
from forestall.perception.learned import LearnedStateEstimator
from forestall.sensors import Sensor
from forestall.training.scenes import Artist
from forestall.training.shards import SENSED
from forestall.types.observation import Detection, Frame, GripperState, Observation, Rgb

FIRST = PICTURE_SEEDS["development"] + 200
"""Behind the scenes that temperatures and thresholds come from."""

SCENES = 12

ROOMS = (("kind", "own"), ("honest", "own"), ("honest", "ithor"))

TASKS = (
    "boil-water",
    "cook-egg",
    "egg-and-water",
    "heat-potato",
    "make-coffee",
    "make-salad",
    "store-egg",
    "warm-water",
)


def drawn() -> dict[str, list[Rgb]]:
    """Pictures by what they were seen through."""
    found: defaultdict[str, list[Rgb]] = defaultdict(list)
    artist = Artist(shipped("household"))
    for seed in range(FIRST, FIRST + SCENES):
        for picture in artist.pictures(seed):
            found["as drawn"].append(picture.frame.rgb)
            now = Observation((picture.frame,), GripperState(None, (0.0, 0.0, 0.0)), 0.0)
            for name, errors in SENSED.items():
                sensor = Sensor(errors)
                sensor.reset(seed * 100 + picture.view)
                found[name].append(sensor.sense(now).frames[0].rgb)
    return found


def seen_in_runs() -> list[Rgb]:
    """What states were read off in some development runs, in three kinds of rooms."""
    found: list[Rgb] = []
    read = LearnedStateEstimator.estimate_with_confidence

    def spied(
        self: LearnedStateEstimator, frame: Frame, detections: Sequence[Detection]
    ) -> Sequence[tuple[Mapping[str, str | None], Mapping[str, float]]]:
        found.append(frame.rgb)
        return read(self, frame, detections)

    with patch.object(LearnedStateEstimator, "estimate_with_confidence", spied):
        for kind, (profile, rooms) in enumerate(ROOMS):
            for number, task in enumerate(TASKS[kind::2]):
                seed = 10300 + 10 * number + kind
                world = {"world.profile": profile, "world.rooms": rooms, "strategy": "none"}
                run_episode(
                    prepare(run_config(task, None, seed=seed, given=Given.named(world))), None
                )
    return found


def main(folder: Path | None) -> None:
    """Print a table, and which pictures of the folder pass."""
    most = TwoTowerEncoder().reading.most_rough
    rows = drawn()
    rows["seen in runs"] = seen_in_runs()
    files = [] if folder is None else sorted(folder.rglob("*.png")) + sorted(folder.rglob("*.jpg"))
    rows["below the folder"] = [np.asarray(Image.open(f).convert("RGB")) for f in files]
    for name, pictures in rows.items():
        if pictures:
            rough = np.array([roughness(p) for p in pictures])
            share = np.mean([of_its_kind(p, most) for p in pictures])
            told = " ".join(f"{q:.2f}" for q in np.quantile(rough, (0.5, 0.95, 0.99, 1.0)))
            say(f"{name}: {len(rough)} pictures, 50, 95, 99, 100 %: {told}; {share:.1%} pass")
    for file, picture in zip(files, rows["below the folder"], strict=True):
        if of_its_kind(picture, most):
            say(f"passes: {file} ({roughness(picture):.2f})")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
