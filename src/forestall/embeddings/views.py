"""A boundary's picture as a whole: its image feature, and what a captioner says of it.

Called by the composition root, for the views that demonstrations keep, and by the detectors that
compare pictures, so that both sides are made alike; calls the encoders that it is given.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from forestall.seams.perceiving import Captioner, ImageEncoder, TextEncoder
from forestall.types.demonstration import View
from forestall.types.feature import quantised
from forestall.types.graph import SceneGraph
from forestall.types.observation import Observation, Rgb


def picture(observation: Observation) -> Rgb:
    """The picture that stands for an observation: its last frame.

    A boundary ends with the look at the subtask's target, so the last frames of two runs show the
    same thing. Before it may come a look at where the robot has just worked, or a scan all around:
    their number differs from run to run, and a mean over all frames would change with it.
    """
    return observation.frames[-1].rgb


def image_feature(encoder: ImageEncoder, observation: Observation) -> bytes:
    """The quantised feature of an observation's picture."""
    return quantised(encoder.encode_image(picture(observation)))


def sentences(caption: str) -> tuple[str, ...]:
    """The sentences of a caption, without their full stops."""
    parts = (part.strip() for part in caption.split("."))
    return tuple(p for p in parts if any(c.isalnum() for c in p))


def caption_rows(encoder: TextEncoder, captions: Sequence[str]) -> npt.NDArray[np.float32]:
    """(n, d) float32 unit rows: for each caption the mean of its sentences' embeddings.

    Encoders read the first 16 (the shipped one) to 77 (CLIP) words or word pieces of a text; of a
    caption of several sentences the rest would be lost. A caption of one sentence is embedded as it
    stands; one without any word has a row of zeros, which is like nothing.
    """
    parts = [sentences(c) for c in captions]
    known = list(dict.fromkeys(s for several in parts for s in several))
    encoded = encoder.encode(known)
    at = {s: i for i, s in enumerate(known)}
    rows = np.zeros((len(captions), encoded.shape[1]), dtype=np.float32)
    for i, several in enumerate(parts):
        if several:
            mean = encoded[[at[s] for s in several]].mean(axis=0)
            rows[i] = mean / max(float(np.linalg.norm(mean)), 1e-12)
    return rows


def view_of(
    observation: Observation,
    scoped: SceneGraph,
    encoder: ImageEncoder | None,
    captioner: Captioner | None,
) -> View:
    """What a demonstration keeps of a boundary's picture.

    Args:
        observation: of the boundary.
        scoped: what perception made of it.
        encoder: of the picture; None keeps no image feature.
        captioner: says what is in it; None keeps no caption.
    """
    return View(
        image=None if encoder is None else image_feature(encoder, observation),
        caption="" if captioner is None else captioner.caption(observation, scoped),
        encoder="" if encoder is None else encoder.name,
        captioner="" if captioner is None else captioner.name,
    )
