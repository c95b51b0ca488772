"""Runs that went wrong, as one Markdown page with a picture of each.

Called by the command line; calls `records/derived.py` and `in_picture.py`. Each run is shown at the
alarm that changed its plan, else at its first, and nothing is said but what its record says.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from forestall.errors import InputError
from forestall.files import make_folder, replace_file
from forestall.records.derived import Alarm, adopted, alarms, done_before, in_words
from forestall.records.pictures import encode_jpeg, rgb_of
from forestall.records.record import read_record
from forestall.report.in_picture import Framed, framed
from forestall.types.episode import BoundaryRecord, EpisodeRecord, StoredFrame
from forestall.types.observation import Frame, Rgb
from forestall.types.runtime import When

PAGE_NAME = "gallery.md"
PICTURES = "gallery"
WIDTH = 560
_QUALITY = 78
_FRAME = (226, 60, 40)

_HEAD = """# Failures, in pictures

Each of these runs was going to fail. Every picture is what the robot saw at the moment of the
alarm, with a frame around what it speaks about; the text is what the robot told its owner, and the
plan, where there is one, is what it did instead. Everything here comes from the records of these
runs, by the command at the end.
"""


def write_gallery(folder: Path, runs: Sequence[Path]) -> Path:
    """Write the page and its pictures.

    Args:
        folder: for gallery.md and the folder gallery/.
        runs: folders of runs, in the order of the page.

    Returns:
        The page.

    Raises:
        InputError: a run without a record, or one without an alarm.
    """
    shown = [_shown(run, read_record(run)) for run in runs]
    make_folder(folder / PICTURES)
    for name, _, picture in shown:
        replace_file(folder / PICTURES / f"{name}.jpg", picture)
    command = f"forestall gallery {folder.name} RUN..."
    made = (
        f"Made by `{command}` of what `forestall run TASK --scenario NAME --out RUN` left behind."
    )
    text = "\n".join((_HEAD, *(section for _, section, _ in shown), made, ""))
    replace_file(folder / PAGE_NAME, text.encode("utf-8"))
    return folder / PAGE_NAME


def _shown(run: Path, record: EpisodeRecord) -> tuple[str, str, bytes]:
    """Name, section and picture of a run."""
    every = alarms(record)
    alarm = next((a for a in every if a.replanned), every[0] if every else None)
    if alarm is None:
        raise InputError(f"{run}: this run has no alarm, so there is nothing to show")
    boundary = record.boundaries[alarm.position]
    found = _picture(boundary, alarm, run if run.is_dir() else run.parent)
    if found is None:
        raise InputError(f"{run}: the picture of {alarm.subtask} was not kept")
    name = record.scenario or "undisturbed"
    picture = encode_jpeg(found, width=WIDTH, quality=_QUALITY)
    return name, _section(record, boundary, alarm, name), picture


def _section(record: EpisodeRecord, boundary: BoundaryRecord, alarm: Alarm, name: str) -> str:
    plan = adopted(boundary, record.executed)
    steps = () if plan is None else plan.texts()
    step = len(done_before(record, boundary)) + (alarm.when is When.BEFORE)
    title = f"{record.task.title}: {name.replace('-', ' ')}"
    when = f"{in_words(alarm.when)} step {step}, `{alarm.subtask}`"
    score = "" if alarm.score is None else f", at a score of {alarm.score:.2f}"
    ended = {True: "The run ended well.", None: "Nobody judged how the run ended."}
    failed = "The run went on and failed." if steps else "No plan would do: the robot stopped."
    numbered = "\n".join(f"{n}. `{text}`" for n, text in enumerate(steps, 1))
    paragraphs = (
        f"## {title}",
        f"![{alarm.cause}]({PICTURES}/{name}.jpg)",
        f"*{when[0].upper()}{when[1:]}{score}:* {alarm.sentence or alarm.cause}",
        numbered,
        ended.get(record.success, failed),
    )
    return "\n\n".join(p for p in paragraphs if p) + "\n"


def _picture(boundary: BoundaryRecord, alarm: Alarm, folder: Path) -> Rgb | None:
    """The picture that shows most of what the alarm speaks about, else the newest of all."""
    seen = boundary.observation
    frames: Sequence[Frame | StoredFrame] = () if seen is None else seen.frames
    about = _about(boundary, alarm)
    best: tuple[float, Rgb] | None = None
    for frame in reversed(frames):
        rgb = rgb_of(frame, folder)
        if rgb is None:
            continue
        found = [f for f in framed(boundary.graph, frame, about) if f.culprit]
        area = sum(f.width * f.height for f in found)
        if best is None or area > best[0]:
            best = (area, _outlined(rgb, found))
    return None if best is None else best[1]


def _about(boundary: BoundaryRecord, alarm: Alarm) -> set[str]:
    """The things that an alarm names: what is to blame, else all in its cause."""
    told = " ".join((alarm.cause, *alarm.must_change))
    named = set(re.findall(r"[\w-]+", told))
    return set(alarm.culprits) or {n.id for n in boundary.graph.nodes if n.id in named}


def _outlined(rgb: Rgb, about: Sequence[Framed]) -> Rgb:
    from PIL import Image, ImageDraw

    image = Image.fromarray(rgb)
    draw = ImageDraw.Draw(image)
    for f in about:
        x, y = f.left * image.width / 100, f.top * image.height / 100
        right, bottom = x + f.width * image.width / 100, y + f.height * image.height / 100
        draw.rectangle((x, y, right, bottom), outline=_FRAME, width=max(2, image.width // 200))
    return np.asarray(image)
