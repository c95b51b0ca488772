"""Raters that a program plays, for tests and for trying a study out. Never reported as people.

Calls `answers.py`. Their true preference is known, so that intervals can be checked against it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forestall.study.answers import Answer, AnswerFile, Choice, Rater, Start, file_of
from forestall.study.model import Study, Trial


@dataclass(frozen=True, slots=True)
class Taste:
    """How simulated raters answer.

    Args:
        odds: rival → log-odds that ours is chosen over it, for the middle rater and item.
        rater_sd: of raters around it, in log-odds. `item_sd`: of items, for each rival anew.
        both: probability of "both". `both_sd`: of raters around it.
        careless: probability that a rater answers by a coin, checks included.
    """

    odds: Mapping[str, float] = field(hash=False)
    rater_sd: float = 0.4
    item_sd: float = 0.8
    both: float = 0.2
    both_sd: float = 0.1
    careless: float = 0.0

    def wins(self, rival: str) -> float:
        """The true share of wins, over all raters and items."""
        chosen, weights = self._chosen(rival)
        return (1 - self.both) * float(weights @ chosen)

    def preference(self, rival: str) -> float:
        """The true share of wins plus half that of both."""
        return self.wins(rival) + self.both / 2

    def alpha(self) -> float:
        """Krippendorff's alpha of very many raters and items who are shown each rival as often."""
        agree, shares = 0.0, np.zeros(3)
        for rival in self.odds:
            chosen, weights = self._chosen(rival)
            both = np.full_like(chosen, self.both)
            each = np.stack([(1 - both) * chosen, (1 - both) * (1 - chosen), both])
            agree += float((each**2).sum(axis=0) @ weights) / len(self.odds)
            shares += each @ weights / len(self.odds)
        return 1 - (1 - agree) / (1 - float((shares**2).sum()))

    def _chosen(self, rival: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """How often ours is chosen by all raters, on items easy and hard; weights of the items."""
        nodes, weights = np.polynomial.hermite_e.hermegauss(60)
        weights = weights / weights.sum()
        items, raters = self.item_sd * nodes, self.rater_sd * nodes
        return _logistic(self.odds[rival] + items[:, None] + raters) @ weights, weights


def simulate(study: Study, taste: Taste, seed: int) -> list[Rater]:
    """The answers of all raters of a study, drawn; every one is marked as simulated."""
    random = np.random.default_rng(seed)
    easy = {
        (i.name, rival): random.normal(0, taste.item_sd)
        for i in study.items
        for rival in study.against
    }
    raters = []
    for number, trials in enumerate(study.raters, 1):
        lean, both = random.normal(0, taste.rater_sd), _both(taste, random)
        careless = random.random() < taste.careless
        answers = {}
        for position, trial in enumerate(trials):
            if careless:
                choice: Choice = "a" if random.random() < 0.5 else "b"
            elif trial.check:
                choice = trial.ours
            else:
                odds = taste.odds[trial.against] + lean + easy[trial.item, trial.against]
                choice = _choice(trial, odds, both, random)
            answers[position] = Answer(position, choice, round(float(random.gamma(4, 5)), 1))
        raters.append(Rater(Start(study.digest, number, simulated=True), answers))
    return raters


def write_simulated(folder: Path, raters: list[Rater]) -> None:
    """Write simulated raters as answer files, as people's are.

    Raises:
        InputError: somebody has answered in a place of theirs.
    """
    for rater in raters:
        file = AnswerFile(file_of(folder, rater.start.rater), rater.start)
        for answer in rater.answers.values():
            file.add(answer)


def _both(taste: Taste, random: np.random.Generator) -> float:
    """How often a rater says "both", from a beta distribution."""
    size = taste.both * (1 - taste.both) / taste.both_sd**2 - 1 if taste.both_sd else 0
    return float(random.beta(taste.both * size, (1 - taste.both) * size)) if size else taste.both


def _choice(trial: Trial, odds: float, both: float, random: np.random.Generator) -> Choice:
    if random.random() < both:
        return "both"
    wins = random.random() < float(_logistic(np.array(odds)))
    return trial.ours if wins else ("b" if trial.ours == "a" else "a")


def _logistic(x: NDArray[np.float64]) -> NDArray[np.float64]:
    return 1 / (1 + np.exp(-x))
