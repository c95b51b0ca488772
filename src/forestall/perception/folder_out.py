"""Observations as folders, written so that `folder.read_observation` gives them back.

Called by recording, logs and people's own programs; the format is that of
`docs/observation-format.md`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from forestall.types.facts import GRIPPER, category_of, is_instance
from forestall.types.observation import Frame, GripperState, Observation

OBSERVATION_FILE = "observation.json"
OBSERVATION_FORMAT = 1


def write_observation(
    path: Path | str,
    observation: Observation,
    states: Mapping[str, Mapping[str, str]] | None = None,
) -> None:
    """Write an observation so that `read_observation` gives it back.

    Args:
        path: the folder; made if it is not there.
        observation: frames with instance ids or with detections.
        states: instance → attribute → value, written beside the detections.
    """
    folder = Path(path)
    folder.mkdir(parents=True, exist_ok=True)
    frames = []
    for index, frame in enumerate(observation.frames):
        tail = "" if len(observation.frames) == 1 else f"-{index + 1}"
        frames.append(_write_frame(folder, frame, tail, states or {}))
    document: dict[str, Any] = {
        "format": OBSERVATION_FORMAT,
        "time_s": observation.time_s,
        "gripper": _hand(observation.gripper),
        "robot_position_m": observation.robot_position_world_m,
        "frames": frames,
    }
    if observation.others:
        document["other_hands"] = [_hand(hand) for hand in observation.others]
    if observation.told:
        document["named"] = dict(observation.told)
    text = json.dumps(document, indent=2)
    (folder / OBSERVATION_FILE).write_text(text + "\n", encoding="utf-8")


def _hand(hand: GripperState) -> dict[str, object]:
    """A hand as it is written: what is as usual is left out."""
    said = {
        "name": None if hand.name == GRIPPER else hand.name,
        "released": hand.released,
        "released_m": hand.released_world_m,
        "width_m": hand.width_m,
        "told": None if hand.told else False,
    }
    further = {key: value for key, value in said.items() if value is not None}
    return {"holding": hand.holding, "position_m": hand.position_world_m, **further}


def _write_frame(
    folder: Path, frame: Frame, tail: str, states: Mapping[str, Mapping[str, str]]
) -> dict[str, object]:
    Image.fromarray(frame.rgb).save(folder / f"rgb{tail}.png")
    np.save(folder / f"depth{tail}.npy", frame.depth_m)
    detections: list[dict[str, object]] = []
    masks: str | None = None
    if frame.detections is not None:
        masks = f"masks{tail}.npz"
        arrays: dict[str, Any] = {f"m{i}": d.mask for i, d in enumerate(frame.detections)}
        np.savez_compressed(folder / masks, **arrays)
        for key, d in zip(arrays, frame.detections, strict=True):
            told: dict[str, object] = {"category": d.category, "instance": d.instance}
            told |= {"score": d.score, "mask": key}
            detections.append(told if d.outlined else {**told, "outlined": False})
    elif frame.instance_ids is not None:
        masks = f"masks{tail}.png"
        Image.fromarray((frame.instance_ids + 1).astype(np.uint16)).save(folder / masks)
        for i in np.unique(frame.instance_ids[frame.instance_ids >= 0]):
            name = frame.instance_names[int(i)]
            instance = name if is_instance(name) else None
            detections.append(
                {"category": category_of(name), "instance": instance, "id": int(i) + 1}
            )
    for detection in detections:
        known = states.get(str(detection["instance"]))
        if known:
            detection["states"] = dict(known)
    k = frame.intrinsics
    return {
        "intrinsics": {"fx": k.fx, "fy": k.fy, "cx": k.cx, "cy": k.cy},
        "camera_to_world": frame.camera_to_world.tolist(),
        "rgb": f"rgb{tail}.png",
        "depth": f"depth{tail}.npy",
        "masks": masks,
        "detections": detections,
    }
