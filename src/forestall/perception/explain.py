"""What was understood of an observation, drawn: for `forestall check --explain`.

Left every picture with its masks and names, right the scene from above: where the camera stands and
looks, the hand, and the box of every located thing, by height. A wrong unit, axis or mask is seen
at once. Called by the command line; calls nothing but the observation and its graph.
"""

from __future__ import annotations

import colorsys
import zlib
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont

from forestall.perception.coarse import Masks
from forestall.types.facts import category_of, is_instance
from forestall.types.finding import Finding
from forestall.types.graph import ObjectNode, Relation, SceneGraph, Seen
from forestall.types.observation import Detection, Frame, Observation

_SIDE = 640
_LINE = 16
_MARGIN = 36
_FAR_M = 1e4
_INK, _PALE, _PAPER, _ROBOT = (30, 30, 30), (205, 205, 205), (255, 255, 255), (190, 30, 30)
_SEEN = {Seen.VISIBLE: "", Seen.REMEMBERED: " (remembered)", Seen.UNOBSERVED: " (unobserved)"}


def explain(
    observation: Observation,
    graph: SceneGraph,
    findings: Sequence[Finding] = (),
    predicates: Collection[str] | None = None,
) -> Image.Image:
    """One RGB picture of what was understood.

    Args:
        observation: with at least one picture for the left side.
        graph: what perception made of it.
        findings: of the input gate, written below.
        predicates: relations that are written out, `Domain.scored` for those that count; all by
            default.
    """
    pictures = [_picture(frame) for frame in observation.frames]
    plan = _plan(observation, graph)
    shown = [r for r in graph.relations if predicates is None or r.predicate in predicates]
    lines = list(_lines(observation, graph, shown, findings))
    left = max((p.width for p in pictures), default=0)
    tall = max(sum(p.height for p in pictures), plan.height)
    sheet = Image.new("RGB", (left + plan.width, tall + _LINE * (len(lines) + 1)), _PAPER)
    y = 0
    for picture in pictures:
        sheet.paste(picture, (0, y))
        y += picture.height
    sheet.paste(plan, (left, 0))
    draw = ImageDraw.Draw(sheet)
    for number, line in enumerate(lines):
        draw.text((8, tall + _LINE // 2 + number * _LINE), line, _INK, _font())
    return sheet


def _font() -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size=12)


def _colour(name: str) -> tuple[int, int, int]:
    """A colour of its own for every category, the same in every picture."""
    hue = (zlib.crc32(category_of(name).encode()) % 997) / 997
    red, green, blue = colorsys.hsv_to_rgb(hue, 0.75, 0.85)
    return (int(255 * red), int(255 * green), int(255 * blue))


def _detections(frame: Frame) -> Sequence[Detection]:
    if frame.detections is not None or frame.instance_ids is None:
        return frame.detections or ()
    return [
        Detection(category_of(n), frame.instance_ids == i, n if is_instance(n) else None)
        for i in np.unique(frame.instance_ids[frame.instance_ids >= 0])
        for n in (frame.instance_names[i],)
    ]


def _picture(frame: Frame) -> Image.Image:
    """The picture, each mask tinted, named at its middle."""
    found = _detections(frame)
    masks = Masks.of(found, 1, frame.depth_m.shape)
    tint = frame.rgb.astype(np.float64)
    names: list[tuple[tuple[int, int], str]] = []
    for label, detection in enumerate(found):
        cells = masks.labels == label
        if not cells.any():
            continue
        name = detection.instance or detection.category
        tint[cells] = 0.55 * tint[cells] + 0.45 * np.array(_colour(name))
        rows, columns = np.nonzero(cells)
        middle = int(np.argmin(np.hypot(rows - rows.mean(), columns - columns.mean())))
        sure = "" if detection.score >= 1 else f" {detection.score:.2f}"
        names.append(((int(columns[middle]), int(rows[middle])), name + sure))
    picture = Image.fromarray(tint.astype(np.uint8))
    draw = ImageDraw.Draw(picture)
    for place, name in names:
        _label(draw, place, name)
    return picture


def _label(draw: ImageDraw.ImageDraw, place: tuple[float, float], text: str) -> None:
    box = draw.textbbox(place, text, _font(), anchor="mm")
    draw.rectangle((box[0] - 2, box[1] - 1, box[2] + 2, box[3] + 1), fill=_PAPER)
    draw.text(place, text, _INK, _font(), anchor="mm")


@dataclass(frozen=True, slots=True)
class _Map:
    """From world to plan: x to the right, y upwards."""

    low_m: npt.NDArray[np.float64]
    scale: float

    def at(self, x: float, y: float) -> tuple[float, float]:
        u, v = (np.array([x, y]) - self.low_m) * self.scale
        return (_MARGIN + float(u), _SIDE - _MARGIN - float(v))


def _plan(observation: Observation, graph: SceneGraph) -> Image.Image:
    """The scene from above: a metre grid, boxes from the floor up, camera and hands."""
    plan = Image.new("RGB", (_SIDE, _SIDE), _PAPER)
    draw = ImageDraw.Draw(plan)
    boxes = sorted((n for n in graph.nodes if n.box_m is not None), key=_top)
    eyes = [f for f in observation.frames if not f.colour_only]
    spots = [f.camera_to_world[:2, 3] for f in eyes]
    spots += [np.array(h.position_world_m[:2]) for h in observation.hands]
    for node in boxes:
        assert node.box_m is not None
        spots += [np.array(node.box_m.low[:2]), np.array(node.box_m.high[:2])]
    if not spots or not float(np.abs(spots).max()) < _FAR_M:
        why = "places are beyond every scene" if spots else "nothing is located"
        draw.text((_MARGIN, _MARGIN), why, _INK, _font())
        return plan
    low, high = np.min(spots, axis=0) - 0.2, np.max(spots, axis=0) + 0.2
    map_ = _Map(low, (_SIDE - 2 * _MARGIN) / float(max(high - low)))
    _grid(draw, map_, low, high)
    for node in boxes:
        _box(draw, map_, node)
    for frame in eyes:
        _camera(draw, map_, frame)
    for hand in observation.hands:
        x, y = map_.at(*hand.position_world_m[:2])
        draw.line((x - 6, y, x + 6, y), _ROBOT, 2)
        draw.line((x, y - 6, x, y + 6), _ROBOT, 2)
        draw.text((x + 8, y - 6), hand.name, _ROBOT, _font())
    draw.text((8, 4), "from above; grid of 1 m, heights over the floor", _INK, _font())
    return plan


def _top(node: ObjectNode) -> float:
    assert node.box_m is not None
    return node.box_m.high[2]


def _grid(
    draw: ImageDraw.ImageDraw,
    map_: _Map,
    low: npt.NDArray[np.float64],
    high: npt.NDArray[np.float64],
) -> None:
    step = max(1, int(np.ceil(float(max(high - low)) / 20)))
    for axis in (0, 1):
        for metre in range(int(np.ceil(low[axis])), int(high[axis]) + 1, step):
            ends = [[float(metre)] * 2 if a == axis else [low[a], high[a]] for a in (0, 1)]
            (x0, x1), (y0, y1) = ends
            draw.line((*map_.at(x0, y0), *map_.at(x1, y1)), _PALE)
            x, y = map_.at(x0, y0)
            draw.text((x + 2, y - 12), f"{'xy'[axis]} {metre}", _PALE, _font())


def _box(draw: ImageDraw.ImageDraw, map_: _Map, node: ObjectNode) -> None:
    assert node.box_m is not None
    low, high = node.box_m.low, node.box_m.high
    (x0, y1), (x1, y0) = map_.at(low[0], low[1]), map_.at(high[0], high[1])
    colour = _colour(node.category)
    light = tuple(int(c + 0.75 * (255 - c)) for c in colour)
    draw.rectangle((x0, y0, x1, y1), fill=light, outline=colour, width=2)
    _label(draw, ((x0 + x1) / 2, (y0 + y1) / 2), f"{node.id} {low[2]:.2f}-{high[2]:.2f}")


def _camera(draw: ImageDraw.ImageDraw, map_: _Map, frame: Frame) -> None:
    """A dot, and the edges of what it sees."""
    k, pose = frame.intrinsics, frame.camera_to_world
    eye = pose[:3, 3]
    x, y = map_.at(float(eye[0]), float(eye[1]))
    for column in (0.0, float(k.width)):
        ray = pose[:3, :3] @ np.array([(column - k.cx) / k.fx, 0.0, 1.0])
        end = eye + 0.6 * ray
        draw.line((x, y, *map_.at(float(end[0]), float(end[1]))), _ROBOT, 1)
    draw.ellipse((x - 5, y - 5, x + 5, y + 5), fill=_ROBOT)
    draw.text((x + 8, y + 2), f"camera {eye[2]:.2f}", _ROBOT, _font())


def _lines(
    observation: Observation,
    graph: SceneGraph,
    relations: Sequence[Relation],
    findings: Sequence[Finding],
) -> Iterator[str]:
    for index, frame in enumerate(observation.frames):
        k, known = frame.intrinsics, frame.depth_m[frame.depth_m > 0]
        wide = 2 * np.degrees(np.arctan2(k.width / 2, k.fx))
        if frame.colour_only:
            yield f"picture {index}: {k.width} x {k.height}, colour only: nothing is located"
            continue
        pitch = np.degrees(np.arcsin(np.clip(frame.camera_to_world[2, 2], -1, 1)))
        far = "no depth" if known.size == 0 else f"median distance {np.median(known):.2f} m"
        yield (
            f"picture {index}: {k.width} x {k.height}, {wide:.0f} degrees wide, looks "
            f"{'upwards' if pitch > 0 else 'downwards'} by {abs(pitch):.0f} degrees, {far}"
        )
    for hand in observation.hands:
        yield f"{hand.name}: {hand.holding or 'empty'}"
    for node in graph.nodes:
        if node.box_m is None and node.centroid_m is None:
            yield f"{node.id}: not located{_SEEN[node.seen]}"
    yield from map(str, relations)
    for name in graph.hidden:
        yield f"inside of {name}: not seen"
    for finding in findings:
        verdict = "refused" if finding.refuses else "note"
        yield f"{verdict}: {finding.what}: {finding.sentence}"
