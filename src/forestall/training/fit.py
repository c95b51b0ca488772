"""Trains the two towers on a folder of pictures; needs the extra `[training]`.

Called by the command line; calls `network.py`, `augment.py`, `texts.py` and `shards.py`. Four
losses, all softmax over cosines: which value of an attribute fits a crop (the others of the same
thing are the hard negatives, they differ in one state only), which category it is, which crops of
the batch a caption is true of, and which texts say the same.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import torch
import torch.nn.functional as F
from torch import Tensor

from forestall.domain.model import Domain
from forestall.embeddings.tokens import tokens, words
from forestall.errors import InputError
from forestall.training.augment import augment
from forestall.training.network import TwoTowers
from forestall.training.questions import ATTRIBUTES
from forestall.training.shards import Crops
from forestall.training.texts import ANY_THING, PLAIN, SAYINGS, Writer

Report = Callable[[int, int, str], None]

FRAMES = 0.06
"""Share of whole frames in a batch."""


@dataclass(frozen=True, slots=True)
class TrainConfig:
    """How the encoder is trained.

    Args:
        seed: of everything that is drawn.
        steps: batches.
        batch: crops in each.
        rate: highest learning rate; warmed up and then lowered along a cosine.
        decay: weight decay.
        average: by how much the average of the weights, which is what is kept, lags.
        threads: of PyTorch; 0 for its own choice.
    """

    seed: int = 0
    steps: int = 5000
    batch: int = 256
    rate: float = 2e-3
    decay: float = 0.05
    average: float = 0.998
    threads: int = 0

    def __post_init__(self) -> None:
        if self.steps < 1 or self.batch < 8:
            raise InputError("training takes at least 1 step and batches of at least 8")


def known_words(domain: Domain) -> frozenset[str]:
    """Every word that training may write, made-up names apart."""
    texts = [*PLAIN, *ANY_THING, *(t for s in SAYINGS.values() for t in s), "kitchen room with and"]
    texts += [skill.replace("_", " ") for skill in domain.skills]
    for name, category in domain.categories.items():
        texts += [name, category.words, *category.synonyms]
        for a in category.attributes:
            if domain.attributes[a].camera:
                texts += [p for v in domain.values(a) for p in domain.phrases(name, a, v)]
    return frozenset(w for t in texts for w in words(t))


class _Batches:
    """Draws crops, rare categories more often than they occur, and the texts about them."""

    def __init__(self, crops: Crops, domain: Domain, config: TrainConfig) -> None:
        self.rng = np.random.default_rng([config.seed, 7])
        self.generator = torch.Generator().manual_seed(config.seed)
        self.writer = Writer(domain, self.rng)
        self.known = known_words(domain)
        self._order = sorted(self.known)
        self._crops = crops
        self._config = config
        index = {c: k for k, c in enumerate(self.writer.categories)}
        self.category = np.array([index.get(c, -1) for c in crops.category.tolist()])
        self.values = crops.values.astype(np.int64)
        counts = np.bincount(self.category[self.category >= 0], minlength=len(index))
        weight = np.where(self.category >= 0, counts[self.category].clip(1) ** -0.6, 0.0)
        small = np.clip(crops.area / 150.0, 0.35, 1.0)
        self._cumulative = np.cumsum(weight * small)
        self._frames = np.flatnonzero(self.category < 0)
        self._in_frame: dict[int, list[int]] = {}
        for i in np.flatnonzero((self.category >= 0) & (crops.area >= 150)).tolist():
            self._in_frame.setdefault(int(crops.frame[i]), []).append(i)
        starts: list[tuple[int, int]] = []
        first = 0
        self._question: dict[tuple[str, int], int] = {}
        for k, q in enumerate(self.writer.questions):
            self._question[q.category, list(ATTRIBUTES).index(q.attribute)] = k
            starts.append((first, len(q.values)))
            first += len(q.values)
        self._starts = np.array(starts)
        most = int(self._starts[:, 1].max())
        place = np.arange(most)[None, :]
        self.columns = torch.from_numpy(
            self._starts[:, :1] + place.clip(max=self._starts[:, 1:] - 1)
        )
        self.beyond = torch.from_numpy(place >= self._starts[:, 1:])

    def draw(self) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """Indices of crops, and of whole frames."""
        frames = max(int(FRAMES * self._config.batch), 2)
        at = self.rng.uniform(0, self._cumulative[-1], self._config.batch - frames)
        chosen = np.searchsorted(self._cumulative, at, side="right")
        return chosen, self.rng.choice(self._frames, frames)

    def pixels(self, indices: npt.NDArray[np.int64]) -> Tensor:
        """Augmented crops."""
        return augment(torch.from_numpy(self._crops.pixels[indices]), self.generator)

    def encode(self, texts: list[str]) -> Tensor:
        """Texts as pieces; some known words are read by their spelling alone."""
        forgotten = self.rng.choice(len(self._order), len(self._order) // 10, replace=False)
        known = self.known.difference(self._order[int(i)] for i in forgotten)
        return torch.from_numpy(tokens(texts, known))

    def asked(self, indices: npt.NDArray[np.int64]) -> tuple[Tensor, Tensor, Tensor]:
        """(crop in the batch, question, true value) for every state that is known."""
        rows: list[tuple[int, int, int]] = []
        for row, i in enumerate(indices.tolist()):
            name = self.writer.categories[self.category[i]]
            for a in np.flatnonzero(self.values[i] >= 0).tolist():
                question = self._question.get((name, a))
                if question is not None:
                    rows.append((row, question, int(self.values[i, a])))
        crop, question_, value = torch.tensor(rows, dtype=torch.int64).reshape(-1, 3).T
        return crop, question_, value

    def captions(self, indices: npt.NDArray[np.int64], count: int) -> tuple[list[str], Tensor]:
        """Captions of some of the crops, and which crops each is true of."""
        names = list(ATTRIBUTES)
        texts = []
        true = np.empty((count, len(indices)), dtype=bool)
        for row, at in enumerate(self.rng.permutation(len(indices))[:count].tolist()):
            i = indices[at]
            there = np.flatnonzero(self.values[i] >= 0)
            some = there[self.rng.uniform(size=len(there)) < 0.6]
            category = self.writer.categories[self.category[i]]
            allowed = [a for a in some.tolist() if (category, a) in self._question]
            states = {names[a]: ATTRIBUTES[names[a]][self.values[i, a]] for a in allowed}
            texts.append(self.writer.caption(category, states))
            true[row] = self.category[indices] == self.category[i]
            for a in allowed:
                true[row] &= self.values[indices, a] == self.values[i, a]
        return texts, torch.from_numpy(true)

    def scenes(self, frames: npt.NDArray[np.int64]) -> list[str]:
        """A caption for each whole frame: some of what is in it."""
        texts = []
        names = list(ATTRIBUTES)
        for f in frames.tolist():
            inside = self._in_frame.get(int(self._crops.frame[f]), [])
            some = [inside[int(k)] for k in self.rng.permutation(len(inside))[:4]]
            parts = []
            for i in some:
                category = self.writer.categories[self.category[i]]
                states = {
                    names[a]: ATTRIBUTES[names[a]][self.values[i, a]]
                    for a in np.flatnonzero(self.values[i] >= 0).tolist()
                    if (category, a) in self._question
                }
                kept = dict(list(states.items())[:1])
                parts.append(self.writer.caption(category, kept))
            texts.append("a room with " + " and ".join(parts))
        return texts


def train(
    crops: Crops, domain: Domain, config: TrainConfig, report: Report
) -> tuple[TwoTowers, list[dict[str, float]]]:
    """Train from nothing; returns the averaged towers and the losses on the way."""
    if config.threads:
        torch.set_num_threads(config.threads)
    torch.manual_seed(config.seed)
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    batches = _Batches(crops, domain, config)
    towers = TwoTowers().to(device)
    towers.image.to(memory_format=torch.channels_last)  # type: ignore[call-overload]
    average = copy.deepcopy(towers).eval()
    plain = [p for p in towers.parameters() if p.ndim < 2]
    heavy = [p for p in towers.parameters() if p.ndim >= 2]
    optimiser = torch.optim.AdamW(
        [{"params": heavy, "weight_decay": config.decay}, {"params": plain, "weight_decay": 0.0}],
        lr=config.rate,
    )
    warm = max(min(500, config.steps // 10), 1)
    schedule = torch.optim.lr_scheduler.LambdaLR(
        optimiser,
        lambda s: min((s + 1) / warm, 0.5 + 0.5 * math.cos(math.pi * min(s / config.steps, 1.0))),
    )
    history: list[dict[str, float]] = []
    recent: dict[str, float] = {}
    for step in range(config.steps):
        towers.train()
        losses = _losses(towers, batches, device)
        total = sum(LOSS_WEIGHTS[k] * v for k, v in losses.items())
        assert isinstance(total, Tensor)
        optimiser.zero_grad(set_to_none=True)
        total.backward()  # type: ignore[no-untyped-call]
        torch.nn.utils.clip_grad_norm_(towers.parameters(), 1.0)
        optimiser.step()
        schedule.step()
        _follow(average, towers, min(config.average, (step + 1) / (step + 10)))
        for name, loss in losses.items():
            value = float(loss.detach())
            recent[name] = 0.98 * recent.get(name, value) + 0.02 * value
        if (step + 1) % 50 == 0 or step + 1 == config.steps:
            history.append({"step": step + 1, **recent})
            told = " ".join(f"{k} {v:.3f}" for k, v in recent.items())
            report(step + 1, config.steps, told)
    return average.cpu(), history


LOSS_WEIGHTS: Mapping[str, float] = {
    "state": 1.0,
    "category": 0.4,
    "caption": 0.2,
    "scene": 0.1,
    "text": 0.2,
}


def _losses(towers: TwoTowers, batches: _Batches, device: torch.device) -> dict[str, Tensor]:
    writer = batches.writer
    indices, frames = batches.draw()
    pixels = batches.pixels(np.concatenate([indices, frames]))
    pixels = pixels.to(device, memory_format=torch.channels_last)
    with torch.autocast(device.type, torch.bfloat16):
        vectors = towers.image(pixels).float()
    images, scenes = vectors[: len(indices)], vectors[len(indices) :]

    answers = [t for q in writer.questions for t in writer.answers(q)]
    things = [writer.thing(c) for c in writer.categories]
    captions, true = batches.captions(indices, min(96, len(indices)))
    whole = batches.scenes(frames)
    said, says = writer.sayings(40)
    named, names = writer.same(len(writer.categories))
    groups = (answers, things, captions, whole, said, says, named, names)
    texts = towers.text(batches.encode([t for g in groups for t in g]).to(device))
    parts = torch.split(texts, [len(g) for g in groups])

    scale = towers.scale
    crop, question, value = (t.to(device) for t in batches.asked(indices))
    logits = scale * images @ parts[0].T
    columns, beyond = batches.columns.to(device), batches.beyond.to(device)
    chosen = logits[crop[:, None], columns[question]].masked_fill(beyond[question], -1e4)
    kinds = torch.from_numpy(batches.category[indices]).to(device)
    fits = (scale * parts[2] @ images.T).log_softmax(1)
    true = true.to(device)
    together = fits.masked_fill(~true, -1e4).logsumexp(1)
    return {
        "state": F.cross_entropy(chosen, value),
        "category": F.cross_entropy(scale * images @ parts[1].T, kinds),
        "caption": -together.mean(),
        "scene": _both_ways(scale, scenes, parts[3]),
        "text": _both_ways(scale, parts[4], parts[5]) + _both_ways(scale, parts[6], parts[7]),
    }


def _both_ways(scale: Tensor, ones: Tensor, others: Tensor) -> Tensor:
    logits = scale * ones @ others.T
    same = torch.arange(len(ones), device=ones.device)
    return (F.cross_entropy(logits, same) + F.cross_entropy(logits.T, same)) / 2


@torch.no_grad()
def _follow(average: TwoTowers, towers: TwoTowers, keep: float) -> None:
    for mean, now in zip(average.parameters(), towers.parameters(), strict=True):
        mean.lerp_(now, 1 - keep)
    for kept, new in zip(average.buffers(), towers.buffers(), strict=True):
        if kept.is_floating_point():
            kept.lerp_(new, 1 - keep)
        else:
            kept.copy_(new)


def facts(config: TrainConfig, towers: TwoTowers) -> dict[str, Any]:
    """What the model's description says about its training."""
    return {
        "torch": torch.__version__,
        "image parameters": sum(p.numel() for p in towers.image.parameters()),
        "text parameters": sum(p.numel() for p in towers.text.parameters()),
        "seed": config.seed,
        "steps": config.steps,
        "batch": config.batch,
    }
