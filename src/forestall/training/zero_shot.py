"""What the encoder was never trained on: other things, and other questions about known ones.

Called by the command line; calls the learned state estimator. The things and questions stand in
`data/encoder_zero_shot.toml`, in the form in which a user's task file states its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from forestall.domain.load import extend
from forestall.domain.model import Domain
from forestall.embeddings.twotower import TwoTowerEncoder
from forestall.training.examine import Vectors, answers
from forestall.training.measure import Answers, Group, Values, measure
from forestall.training.page import ZeroShot
from forestall.training.questions import ATTRIBUTES
from forestall.training.shards import Crops, unseen_file, unseen_things


@dataclass(frozen=True, slots=True)
class Alias:
    """A question that was not trained on, and where its truth can be read off.

    Args:
        attribute: of the question.
        of: the attribute that decides it.
        values: new value → the values that it stands for.
        categories: of which it is asked.
    """

    attribute: str
    of: str
    values: Mapping[str, tuple[str, ...]]
    categories: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Unseen:
    """The household with things and questions that were not trained on."""

    domain: Domain
    categories: tuple[str, ...]
    aliases: tuple[Alias, ...]


def unseen() -> Unseen:
    """Read the shipped file."""
    data = unseen_file()
    aliases = tuple(
        Alias(name, t["attribute"], {k: tuple(v) for k, v in t["is"].items()}, tuple(t["of"]))
        for name, t in data["same_as"].items()
    )
    domain = extend(unseen_things(), {}, data["attributes"])
    return Unseen(domain, tuple(data["categories"]), aliases)


def new_things(encoder: TwoTowerEncoder, rows: Vectors, crops: Crops) -> list[ZeroShot]:
    """Known attributes of things that were not trained on."""
    found = unseen()
    chosen = np.isin(crops.category, found.categories)
    if not chosen.any():
        return []
    part = crops.where(chosen)
    said = answers(encoder, rows[chosen], part, found.domain)
    return [
        _row(g, found.domain[str(g.category)].words, str(g.attribute), forced)
        for g, forced in _pairs(said, ATTRIBUTES)
    ]


def new_questions(encoder: TwoTowerEncoder, rows: Vectors, crops: Crops) -> list[ZeroShot]:
    """Other questions about known things."""
    found = unseen()
    order = list(found.domain.attributes)
    out = []
    for alias in found.aliases:
        old = crops.values[:, order.index(alias.of)]
        new = _translated(old, alias, found.domain)
        chosen = np.isin(crops.category, alias.categories) & (new >= 0)
        if not chosen.any():
            continue
        values = np.full((int(chosen.sum()), len(order)), -1, dtype=np.int8)
        values[:, order.index(alias.attribute)] = new[chosen]
        part = replace(crops.where(chosen), values=values)
        said = answers(encoder, rows[chosen], part, _asking(found.domain, alias))
        values_of = {alias.attribute: found.domain.values(alias.attribute)}
        for g, forced in _pairs(said, values_of):
            asked = f"{alias.attribute} ({' / '.join(g.values)})"
            out.append(_row(g, found.domain[str(g.category)].words, asked, forced))
    return out


def _pairs(said: Answers, values: Values) -> list[tuple[Group, float | None]]:
    """Each attribute and category, and its balanced accuracy had everything been answered."""
    forced = measure(replace(said, answered=np.ones_like(said.answered)), values).pairs
    given = measure(said, values).pairs
    return [(g, f.figures.balanced) for g, f in zip(given, forced, strict=True)]


def _row(group: Group, what: str, asked: str, forced: float | None) -> ZeroShot:
    figures = group.figures
    return ZeroShot(what, asked, figures.n, figures.balanced, figures.answered.value, forced)


def _translated(old: npt.NDArray[np.int8], alias: Alias, domain: Domain) -> npt.NDArray[np.int8]:
    """The new attribute's value for each old one, -1 where there is none."""
    values = domain.values(alias.of)
    new = np.full(len(old), -1, dtype=np.int8)
    for k, value in enumerate(domain.values(alias.attribute)):
        new[np.isin(old, [values.index(v) for v in alias.values[value]])] = k
    return new


def _asking(domain: Domain, alias: Alias) -> Domain:
    """The domain in which the categories of an alias have its attribute only."""
    changed = {
        c: replace(domain[c], attributes=(alias.attribute,), defaults=()) for c in alias.categories
    }
    return replace(domain, categories={**domain.categories, **changed})
